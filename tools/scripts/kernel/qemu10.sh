#!/usr/bin/env bash
# Fetches QEMU 10 from Debian's backports, which raises the alignment faults on Device memory that
# the board raises and Debian 12's own QEMU does not. Nothing is installed: it is unpacked.
#
# usage: qemu10.sh DIRECTORY    makes DIRECTORY/qemu; then QEMU=DIRECTORY/qemu kernel-test.sh
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/../lib.sh"
need_packages qemu-system-arm # for the libraries

mkdir -p "$1"
out=$(cd "$1" && pwd)
if [ -x "$out/qemu" ]; then
	"$out/qemu" --version | head -n 1
	exit 0
fi
backports=bookworm-backports
# The machine's own entry for Debian 12, for the other suite.
entry=$(grep -lE '^Suites: *bookworm( |$)' /etc/apt/sources.list.d/*.sources 2>/dev/null | head -n 1) ||
	skip "no entry for Debian 12 in /etc/apt/sources.list.d"
rm -rf "$out"
mkdir -p "$out"/{lists/partial,packages}
awk -v RS= '/\nSuites: *bookworm( |\n)/ && !found { found = 1; print }' "$entry" |
	sed "s/^Suites:.*/Suites: $backports/" > "$out/$backports.sources"
options=(-o "Dir::Etc::sourcelist=$out/$backports.sources" -o Dir::Etc::sourceparts=-
	-o "Dir::State::lists=$out/lists" -o Dir::Cache::pkgcache= -o Dir::Cache::srcpkgcache=)
cd "$out/packages"
apt "${options[@]}" update || skip "$backports cannot be fetched"
apt "${options[@]}" download qemu-system-{arm,common,data,misc}/$backports ||
	skip "QEMU cannot be fetched from $backports"
for package in *.deb; do
	dpkg -x "$package" "$out/root"
done
cd "$out"
rm -rf lists packages
cat > "$out/qemu" <<END
#!/bin/sh
QEMU_MODULE_DIR=$out/root/usr/lib/x86_64-linux-gnu/qemu exec $out/root/usr/bin/qemu-system-aarch64 \\
	-L $out/root/usr/share/qemu -audio none "\$@"
END
chmod +x "$out/qemu"
"$out/qemu" --version | head -n 1
