#!/usr/bin/env bash
# Fetches Debian's arm64 kernel and builds the one module that it lacks, uio_pdrv_genirq, against
# its headers. Nothing is installed: the packages are unpacked.
#
# usage: debian.sh DIRECTORY    makes DIRECTORY/Image and DIRECTORY/modules/{*.ko,order}
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/../lib.sh"
mkdir -p "$1"
out=$(cd "$1" && pwd)
if [ -f "$out/version" ]; then
	echo "Debian's kernel $(cat "$out/version") is there"
	exit 0
fi
need_packages make gcc-aarch64-linux-gnu xz-utils bc
need_arm64
need_lists
image=$(apt-cache depends linux-image-arm64:arm64 | sed -n 's/.*Depends: \(linux-image-[^:]*\).*/\1/p' | head -n 1 || true)
[ -n "$image" ] || skip "Debian's package linux-image-arm64:arm64 is not in the package lists"
version=${image#linux-image-}      # 6.1.0-56-arm64
abi=${version%-arm64}              # 6.1.0-56
series=$(cut -d. -f1,2 <<<"$version") # 6.1

scratch=$out/scratch
rm -rf "$out"
mkdir -p "$scratch" "$out/modules"
cd "$scratch"
apt download "$image:arm64" "linux-headers-$version:arm64" "linux-headers-$abi-common" \
	"linux-kbuild-$series" "linux-source-$series" ||
	skip "the packages of Debian's kernel $version cannot be fetched"
for package in *.deb; do
	dpkg -x "$package" root
done

source=linux-source-$series
mkdir uio
tar -xJf "root/usr/src/$source.tar.xz" --occurrence=1 --strip-components=3 -C uio \
	"$source/drivers/uio/uio_pdrv_genirq.c"
echo 'obj-m := uio_pdrv_genirq.o' > uio/Makefile
headers=$scratch/root/usr/src/linux-headers-$version
# Its only absolute path: it expects to be installed.
sed -i "s#^include /usr/src/#include $scratch/root/usr/src/#" "$headers/Makefile"
attend timeout 300 make -s -C "$headers" M="$scratch/uio" ARCH=arm64 CROSS_COMPILE=aarch64-linux-gnu- modules

cp "root/boot/vmlinuz-$version" "$out/Image"
for module in "root/lib/modules/$version/kernel/drivers/uio/uio.ko" uio/uio_pdrv_genirq.ko; do
	aarch64-linux-gnu-strip --strip-debug -o "$out/modules/${module##*/}" "$module"
done
printf '%s\n' 'uio.ko' 'uio_pdrv_genirq.ko of_id=generic-uio' > "$out/modules/order"
cd "$out"
rm -rf "$scratch"
echo "$version" > version
echo "Debian's kernel $version"
