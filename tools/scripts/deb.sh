#!/usr/bin/env bash
# Builds the Debian package of one architecture: target/packages/zynq-pgs_VERSION_ARCH.deb, with the tool, its
# manual pages and completions, the C library and its header, overlays, udev rule and systemd unit.
#
# usage: deb.sh [ARCH]     amd64 or arm64; this machine's if none
# environment: DEB_MAINTAINER (who answers for the package), SOURCE_DATE_EPOCH (the last commit's time)
#
# The same sources, compiler and folders make the same file. arm64 is built by aarch64-env.sh's cross compiler.
# Exit code: 0 done, 1 the build failed, 2 wrong usage, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
. "$repository/tools/scripts/packages-env.sh"
cd "$repository"
# The rights of the files do not depend on the builder's.
umask 022

command -v dpkg-deb >/dev/null || skip "needs dpkg-deb, and this is no Debian"
native=$(dpkg --print-architecture)
[ $# -le 1 ] || { sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2; }
architecture=${1:-$native}
case $architecture in
amd64) triplet=x86_64-linux-gnu rust_target=x86_64-unknown-linux-gnu ;;
arm64) triplet=aarch64-linux-gnu rust_target=aarch64-unknown-linux-gnu ;;
-h | --help) sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; exit 0 ;;
*) sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2 ;;
esac
for tool in dtc:device-tree-compiler readelf:binutils strip:binutils python3:python3-minimal; do
	command -v "${tool%:*}" >/dev/null || need_packages "${tool#*:}"
done

maintainer=${DEB_MAINTAINER:-the zynq-pgs authors <packages@zynq-pgs.invalid>}
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct 2>/dev/null || stat -c %Y Cargo.toml)}
sources=tools/packages
tree=$(mktemp -d)
litter+=("$tree")
chmod 755 "$tree"

# Flags of their own have a target directory of their own.
export CARGO_TARGET_DIR=$target_root/deb
CARGO_BUILD_RUSTFLAGS=$(nameless_flags)
export CARGO_BUILD_RUSTFLAGS

# The tool and the C library; in the cargo features that every build of both has.
build() {
	attend timeout 1800 cargo build --release --locked -p pgs -p zynq-pgs-c "$@" ||
		fail "cargo does not build the tool and the library"
}

# The pages come from a tool that runs here. It is built first, so that the one to pack replaces it.
pages=$packages/pages
build --features pgs/pages
rm -rf "$pages"
attend "$CARGO_TARGET_DIR/release/pgs" generate --out "$pages"

stripper="strip"
if [ "$architecture" = "$native" ]; then
	build
	built=$CARGO_TARGET_DIR/release
elif [ "$architecture" = arm64 ]; then
	# A subshell: the variables are for this compiler alone.
	(
		. tools/scripts/aarch64-env.sh
		with_shared_library build --target "$rust_target"
	)
	built=$target_root/aarch64-shared/$rust_target/release
	stripper="aarch64-linux-gnu-strip"
else
	skip "$architecture cannot be built on $native"
fi

put() { install -D -m "$1" "$2" "$tree/$3"; }
libraries=usr/lib/$triplet
documents="usr/share/doc/zynq-pgs"

put 755 "$built/pgs" usr/bin/pgs
put 644 "$built/libzynq_pgs_c.so" "$libraries/libzynq_pgs_c.so.$abi"
ln -s "libzynq_pgs_c.so.$abi" "$tree/$libraries/libzynq_pgs_c.so"
put 644 "$built/libzynq_pgs_c.a" "$libraries/libzynq_pgs_c.a"
$stripper --strip-all --remove-section=.comment --remove-section=.note "$tree/usr/bin/pgs"
$stripper --strip-unneeded --remove-section=.comment --remove-section=.note "$tree/$libraries/libzynq_pgs_c.so.$abi"
$stripper --strip-debug --enable-deterministic-archives "$tree/$libraries/libzynq_pgs_c.a"
nameless "$tree/usr/bin/pgs" "$tree/$libraries"/libzynq_pgs_c.{so,a}
put 644 tools/capi/include/zynq_pgs.h usr/include/zynq_pgs.h
mkdir -p "$tree/$libraries/pkgconfig"
sed "s|@prefix@|/usr|; s|@version@|$version|; s|^libdir=.*|libdir=\${prefix}/lib/$triplet|" \
	tools/capi/zynq-pgs.pc.in > "$tree/$libraries/pkgconfig/zynq-pgs.pc"

for page in "$pages"/man/*; do put 644 "$page" "usr/share/man/man1/${page##*/}"; done
gzip -9n "$tree"/usr/share/man/man1/*
put 644 "$pages/bash/pgs.bash" usr/share/bash-completion/completions/pgs
put 644 "$pages/zsh/_pgs" usr/share/zsh/vendor-completions/_pgs
put 644 "$pages/fish/pgs.fish" usr/share/fish/vendor_completions.d/pgs.fish

for file in device-tree/*.dts?; do
	put 644 "$file" "usr/share/zynq-pgs/$file"
	[[ $file = *.dtso ]] || continue
	overlay=usr/share/zynq-pgs/overlays/$(basename "$file" .dtso).dtbo
	mkdir -p "$tree/${overlay%/*}"
	dtc -q -@ -I dts -O dtb -o "$tree/$overlay" "$file"
	chmod 644 "$tree/$overlay"
done
put 644 device-tree/99-zynq-pgs.rules usr/lib/udev/rules.d/99-zynq-pgs.rules
put 644 $sources/systemd/pgs-serve.service usr/lib/systemd/system/pgs-serve.service
put 644 $sources/systemd/pgs-serve.default etc/default/pgs-serve

# The pages with all that they link to: no link leads out of the package.
linked=$(python3 -B $sources/pages.py) || fail "a page links to a missing file, as above"
for page in $linked; do put 644 "$page" "$documents/$page"; done
for example in tools/capi/examples/*; do put 644 "$example" "$documents/examples/${example##*/}"; done
put 644 $sources/debian/copyright "$documents/copyright"
python3 -B $sources/licences.py "$rust_target" pgs zynq-pgs-c > "$tree/$documents/third-party.txt"
{
	printf 'zynq-pgs (%s) unstable; urgency=medium\n\n  * CHANGELOG.md lists the changes.\n\n' "$version"
	printf ' -- %s  %s\n' "$maintainer" "$(LC_ALL=C date -u -R -d "@$SOURCE_DATE_EPOCH")"
} > "$tree/$documents/changelog"
gzip -9n "$tree/$documents"/{changelog,third-party.txt}
put 644 $sources/debian/lintian-overrides usr/share/lintian/overrides/zynq-pgs

# Debian's packages with the libraries that the programs are linked with; libc6 in the version whose symbols they
# take.
depends() {
	local library libc='' needed=()
	for library in $(LC_ALL=C readelf -d "$@" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p' | sort -u); do
		case $library in
		libc.so.6 | libm.so.6 | libdl.so.2 | libpthread.so.0 | ld-linux-*) ;;
		libgcc_s.so.1) needed+=("libgcc-s1") ;;
		*) fail "no package is known for $library" ;;
		esac
	done
	libc=$(LC_ALL=C readelf -V "$@" | sed -n 's/.*Name: GLIBC_\([0-9.]*\).*/\1/p' | sort -V | tail -n 1)
	[ -n "$libc" ] || fail "expected symbols of the C library in $*"
	needed=("libc6 (>= $libc)" "${needed[@]}")
	local text
	printf -v text '%s, ' "${needed[@]}"
	echo "${text%, }"
}
needs=$(depends "$tree/usr/bin/pgs" "$tree/$libraries/libzynq_pgs_c.so.$abi")
size=$(du -k -s --apparent-size "$tree" | cut -f1)
mkdir "$tree/DEBIAN"
sed "s|@version@|$version|; s|@architecture@|$architecture|; s|@maintainer@|$maintainer|; s|@size@|$size|; s|@depends@|$needs|" \
	$sources/debian/control.in > "$tree/DEBIAN/control"
install -m 644 $sources/debian/conffiles "$tree/DEBIAN/conffiles"
for script in postinst prerm postrm; do install -m 755 "$sources/debian/$script" "$tree/DEBIAN/$script"; done
# The loader's cache must learn of a new shared library.
echo "activate-noawait ldconfig" > "$tree/DEBIAN/triggers"
echo "libzynq_pgs_c $abi zynq-pgs (>= $version)" > "$tree/DEBIAN/shlibs"
(cd "$tree" && find etc usr -type f -print0 | sort -z | xargs -0 md5sum) > "$tree/DEBIAN/md5sums"
find "$tree" -exec touch --no-dereference --date="@$SOURCE_DATE_EPOCH" {} +

package=$(debian_package "$architecture")
dpkg-deb --root-owner-group -Zxz --build "$tree" "$package" >/dev/null
echo "$package: $(stat -c %s "$package") bytes, needs $needs"
sha256sum "$package" | cut -d' ' -f1
