#!/usr/bin/env bash
# Makes a Yocto layer with the recipe, the sources and the list of crates: target/packages/meta-zynq-pgs.
#
# usage: yocto.sh [--build]
#   --build   also builds for aarch64 from the layer alone
#
# Unpacks the layer's sources and crates as the fetchers do, and has cargo resolve them without network.
# Needs no BitBake, and says nothing about what only BitBake knows.
# Exit code: 0 done, 1 something is wrong with the layer, 2 wrong usage, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
. "$repository/tools/scripts/packages-env.sh"
cd "$repository"

build=no
case ${1-} in
'') ;;
--build) build=yes ;;
-h | --help) sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; exit 0 ;;
*) sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2 ;;
esac

layer=$packages/meta-zynq-pgs
recipe=$layer/recipes-support/zynq-pgs
rm -rf "$layer"
mkdir -p "$layer/conf" "$recipe/files"
cp tools/packages/yocto/layer.conf "$layer/conf"
md5_of() { md5sum "$1" | cut -d' ' -f1; }
sed "s|@md5_mit@|$(md5_of LICENSE-MIT)|; s|@md5_apache@|$(md5_of LICENSE-APACHE)|
	s|@abi@|$abi|" \
	tools/packages/yocto/zynq-pgs.bb > "$recipe/zynq-pgs_$version.bb"
git ls-files -z --cached --others --exclude-standard | sort -z |
	tar --null --files-from=- --ignore-failed-read --sort=name --owner=0 --group=0 --numeric-owner --mtime=@0 \
		--transform="s|^|zynq-pgs-$version/|" -cf - | gzip -9n > "$recipe/files/zynq-pgs-$version.tar.gz"

# Cargo.lock has a block of lines for each crate, with a checksum where it is from the registry.
crates() {
	awk '/^name = /{gsub(/"/, ""); name=$3} /^version = /{gsub(/"/, ""); version=$3}
		/^checksum = /{gsub(/"/, ""); print name, version, $3}' Cargo.lock
}
{
	echo "# Made by tools/scripts/yocto.sh from Cargo.lock."
	echo
	echo "SRC_URI += \" \\"
	crates | while read -r name number _; do echo "    crate://crates.io/$name/$number \\"; done
	echo "\""
	echo
	crates | while read -r name number sum; do echo "SRC_URI[$name-$number.sha256sum] = \"$sum\""; done
} > "$recipe/zynq-pgs-crates.inc"
echo "$layer: $(crates | wc -l) crates"

if command -v oelint-adv >/dev/null; then
	# No address of the project exists yet, and the list has the form that BitBake's own task gives it.
	oelint-adv --exit-zero --quiet --suppress oelint.var.mandatoryvar.HOMEPAGE --suppress oelint.vars.inconspaces \
		"$recipe/zynq-pgs_$version.bb" 2>&1 | tee "$packages/oelint.txt"
	! grep ':error:' "$packages/oelint.txt" || fail "oelint-adv finds errors"
else
	echo "skipped: rules of recipes (oelint-adv is not installed)"
fi

# As BitBake's fetcher of crates: each archive with the checksum of the list, unpacked beside a file that gives the
# checksum to cargo.
work=$(mktemp -d)
litter+=("$work")
cargo fetch --locked --quiet
cache=${CARGO_HOME:-$HOME/.cargo}/registry/cache
vendor=$work/cargo_home/bitbake
mkdir -p "$vendor"
sed -n 's|^ *crate://crates.io/\([^/]*\)/\([^ ]*\) .*|\1-\2|p' "$recipe/zynq-pgs-crates.inc" | while read -r crate; do
	archive=$(find "$cache" -name "$crate.crate" -print -quit)
	[ -n "$archive" ] || fail "cargo has not fetched $crate"
	sum=$(sed -n "s|^SRC_URI\[$crate.sha256sum\] = \"\(.*\)\"|\1|p" "$recipe/zynq-pgs-crates.inc")
	[ "$(sha256sum "$archive" | cut -d' ' -f1)" = "$sum" ] || fail "$crate has not the checksum of the list"
	tar -xzf "$archive" -C "$vendor" --no-same-owner
	printf '{"files":{},"package":"%s"}' "$sum" > "$vendor/$crate/.cargo-checksum.json"
done
cat > "$work/cargo_home/config.toml" <<END
[source.bitbake]
directory = "$vendor"
[source.crates-io]
replace-with = "bitbake"
local-registry = "/nonexistent"
END
tar -xzf "$recipe/files/zynq-pgs-$version.tar.gz" -C "$work"
manifest=$work/zynq-pgs-$version/Cargo.toml
# unshare: without network, where this machine allows it.
alone=()
! unshare --net true 2>/dev/null || alone=(unshare --net)
# Outside the repository, whose settings for cargo would hold.
cd "$work"
CARGO_HOME=$work/cargo_home "${alone[@]}" cargo metadata --frozen --format-version 1 --manifest-path "$manifest" >/dev/null ||
	fail "the list of crates is not enough"
echo "cargo resolves the layer's crates"
[ $build = yes ] || exit 0

(
	. "$repository/tools/scripts/aarch64-env.sh"
	export CARGO_HOME=$work/cargo_home
	with_shared_library attend timeout 1800 "${alone[@]}" cargo build --frozen --target "$aarch64" --release \
		--manifest-path "$manifest" -p pgs -p zynq-pgs-c
) || fail "the layer's sources do not build"
echo "built from the layer alone, for aarch64${alone[*]:+, without network}"
