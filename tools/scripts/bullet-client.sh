#!/usr/bin/env bash
# Builds the library for C and tools/clients/bullet with it, and runs Bullet's scenes on both solvers.
#
# usage: bullet-client.sh                all scenes but `spread`; compares their table with the README's
#        bullet-client.sh --renew-table  all scenes but `spread`; writes their table to the README
#        bullet-client.sh ARGUMENT...    arguments of bullet-client, such as --board emulated pile
#
# Exit code: 0 done, 1 a limit does not hold, the table differs or something does not build, 2 wrong
# usage, 77 skipped: not on this machine.
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

client=$work/bullet-client
readme=tools/clients/bullet/README.md
table=$work/table
[ $# = 0 ] || [ "$*" = --renew-table ] || {
	code=0
	attend "$client" "$@" || code=$?
	exit $code
}

SECONDS=0
mapfile -t scenes < <("$client" --list | awk '$1 != "spread" { print $1 }')
code=0
attend "$client" "${scenes[@]}" > "$table" || code=$?
cat "$table"
echo "bullet-client: the scenes took $SECONDS s"
[ $code = 0 ] || exit $code
# The limits hold, too, where the board gets the places of the impulses.
attend "$client" --by-place pile tower ratio || code=$?
[ $code = 0 ] || exit $code

if [ $# = 1 ]; then
	awk -v table="$table" '/^```$/ { inside = 0 } !inside
		/^```text$/ { inside = 1; while ((getline line < table) > 0) print line }' \
		"$readme" > "$work/README.md"
	cp "$work/README.md" "$readme"
	exit 0
fi

# Another Bullet, or another sine and cosine, rounds otherwise, and many scenes are chaotic.
printed() { awk '/^```$/ { inside = 0 } inside; /^```text$/ { inside = 1 }' "$readme"; }
[ -n "$(printed)" ] || fail "$readme has no table: tools/scripts/bullet-client.sh --renew-table"
not_compared() { echo "not compared with $readme: $*"; exit 0; }
[ "$(uname -m)" = x86_64 ] || not_compared "it was made on x86-64"
grep -qw fma /proc/cpuinfo || not_compared "it was made by a processor with FMA"
version() { grep -o -m 1 '^Bullet [0-9.]*'; }
[ "$(version < "$table")" = "$(printed | version)" ] || not_compared "it was made with another Bullet"

# Processor times differ from run to run.
same() { sed 's/\(processor time\).*/\1/'; }
diff -u --label "$readme" --label bullet-client <(printed | same) <(same < "$table") ||
	fail "the client prints another table than $readme: tools/scripts/bullet-client.sh --renew-table"
