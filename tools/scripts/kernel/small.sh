#!/usr/bin/env bash
# Builds a small arm64 kernel from Debian's kernel source with tools/guest/small.config: UIO built
# in, /dev/mem unrestricted. Takes minutes and 1.6 GB.
#
# usage: small.sh DIRECTORY     makes DIRECTORY/Image and DIRECTORY/modules/order
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/../lib.sh"
mkdir -p "$1"
out=$(cd "$1" && pwd)
config=$repository/tools/guest/small.config
if cmp -s "$out/config" "$config"; then
	echo "the small kernel is there"
	exit 0
fi
need_packages flex bison bc make gcc libc6-dev xz-utils gcc-aarch64-linux-gnu
need_lists
source=$(apt-cache depends linux-source | sed -n 's/.*Depends: \(linux-source-[^:]*\).*/\1/p' | head -n 1 || true)
[ -n "$source" ] || skip "Debian's package linux-source is not in the package lists"

rm -rf "$out"
mkdir -p "$out"/{modules,scratch/build}
cd "$out/scratch"
apt download "$source" || skip "Debian's package $source cannot be fetched"
dpkg -x "$source"_*.deb package
tar -xJf "package/usr/src/$source.tar.xz"
rm -r package
kernel() { attend timeout 3600 make -s -C "$source" O="$PWD/build" ARCH=arm64 CROSS_COMPILE=aarch64-linux-gnu- "$@"; }
kernel KCONFIG_ALLCONFIG="$config" allnoconfig
for option in $(grep -o '^CONFIG_[A-Z0-9_]*=y' "$config"); do
	grep -qx "$option" build/.config || fail "$source does not know $option, or drops it"
done
kernel -j"$(nproc)" Image
cp build/arch/arm64/boot/Image "$out/Image"
: > "$out/modules/order"
cd "$out"
rm -rf scratch
cp "$config" config
echo "small kernel of $source"
