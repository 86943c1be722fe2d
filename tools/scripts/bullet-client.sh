#!/usr/bin/env bash
# Builds the library for C and tools/clients/bullet with it, and runs Bullet's scenes on both solvers.
#
# usage: bullet-client.sh [ARGUMENT...]     arguments of bullet-client, such as --board emulated:naive,world pile
#
# Exit code: 0 done, 1 a limit does not hold or something does not build, 2 wrong usage, 77 skipped: not on
# this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

packages=()
command -v "${CXX:-c++}" >/dev/null || packages+=(g++)
command -v make >/dev/null || packages+=(make)
command -v "${PKG_CONFIG:-pkg-config}" >/dev/null || packages+=(pkg-config)
"${PKG_CONFIG:-pkg-config}" --exists bullet 2>/dev/null || packages+=(libbullet-dev)
[ ${#packages[@]} = 0 ] || need_packages "${packages[@]}"
command -v "${CXX:-c++}" >/dev/null || skip "needs a C++ compiler, and CXX names none: $CXX"
"${PKG_CONFIG:-pkg-config}" --exists bullet || skip "needs Bullet, and pkg-config does not find the package bullet"

cd "$repository"
attend cargo build --release --quiet --locked -p zynq-pgs-c

# The static library alone, so that no other one takes its place.
work=$target_root/bullet-client
mkdir -p "$work/library"
cp -p "$target_root/release/libzynq_pgs_c.a" tools/capi/include/zynq_pgs.h "$work/library"
attend make --silent -C tools/clients/bullet ZYNQ_PGS_DIR="$work/library" BUILD="$work" ||
	fail "tools/clients/bullet does not build"

SECONDS=0
code=0
attend "$work/bullet-client" "$@" || code=$?
echo "bullet-client: the scenes took $SECONDS s"
exit $code
