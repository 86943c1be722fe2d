# Names the version, the packages and their folder. To be sourced after lib.sh.
# shellcheck disable=SC2034 # for the scripts that source it

version=$(sed -n 's/^version = "\(.*\)"/\1/p' "$repository/Cargo.toml" | head -n 1)
# The number of the binary interface of the C library.
abi=$(sed -n 's/^#define ZPGS_ABI_VERSION //p' "$repository/tools/capi/include/zynq_pgs.h")
[ -n "$version" ] && [ -n "$abi" ] || fail "Cargo.toml names no version, or zynq_pgs.h no ZPGS_ABI_VERSION"
packages=$target_root/packages

# The Debian package of an architecture.
debian_package() { echo "$packages/zynq-pgs_${version}_$1.deb"; }
