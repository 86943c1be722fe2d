#!/usr/bin/env bash
# Makes the first file system of the guest: busybox, the kernel's modules, tools/guest, and a folder
# whose content goes to its root as it is.
#
# usage: initrd.sh KERNEL CONTENT OUTPUT     KERNEL: a directory made by debian.sh or small.sh
# environment: CHECKS (what the guest runs, a folder; tools/guest/checks)
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/../lib.sh"
need_packages cpio

kernel=$1 content=$2 output=$3
cache=$target_root/kernel-test/busybox
if [ ! -x "$cache/bin/busybox" ]; then
	need_arm64
	need_lists
	mkdir -p "$cache"
	(cd "$cache" && apt download busybox-static:arm64 && dpkg -x busybox-static_*.deb .) ||
		skip "Debian's package busybox-static:arm64 cannot be fetched"
fi

root=$(mktemp -d)
litter+=("$root")
chmod 755 "$root" # the guest's ordinary user is to see it too
mkdir -p "$root"/{bin,sbin,usr/bin,usr/sbin,etc,proc,sys,dev,tmp,modules,checks}
cp "$cache/bin/busybox" "$root/bin/"
cp "$kernel"/modules/* "$root/modules/"
install -m 755 "$repository/tools/guest/init" "$root/init"
install -m 755 "${CHECKS:-$repository/tools/guest/checks}"/* "$root/checks/"
printf '%s\n' 'root:x:0:0:root:/:/bin/sh' 'user:x:1000:1000:user:/:/bin/sh' > "$root/etc/passwd"
printf '%s\n' 'root:x:0:' 'user:x:1000:' > "$root/etc/group"
cp -r "$content/." "$root/"
(cd "$root" && find . | LC_ALL=C sort | cpio --quiet -o -H newc -R 0:0) | gzip -1 > "$output"
