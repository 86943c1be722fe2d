#!/usr/bin/env bash
# Counts by callgrind the instructions of the loops that pack: what noise hides from a benchmark, and no
# other test sees, as a loop that has lost its registers to another packs the same beats.
#
#   tools/scripts/instructions.sh                    counts on a pile, and holds the counts against limits
#   tools/scripts/instructions.sh --input FOLDER     prints them alone, of a step in a folder of arrays
#
# Of each: profile, thing (`cargo bench --bench pack -- --help`), instructions an entry, limit.
#
# Exit code: 0 done, 1 something takes more than its limit, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

case "$*" in
	'') scene=(--grid 12x12x12) ;;
	'--input '?*) scene=("$@") ;;
	*) fail "expected nothing or --input FOLDER, found: $*" ;;
esac
# The loops are compiled for other vectors elsewhere, and the limits are of these.
for feature in avx2 f16c; do
	grep -q -w $feature /proc/cpuinfo 2>/dev/null || skip "the processor has no $feature, of which the limits are"
done
command -v valgrind >/dev/null || need_packages valgrind
cd "$repository"
built=$(cargo bench --bench pack --no-run --locked --quiet --message-format=json |
	sed -n 's/.*"executable":"\([^"]*\/pack-[^"]*\)".*/\1/p')
[ -n "$built" ] || fail "cargo does not say where the benchmark is that it has built"

# The loops are functions of their own, of this name.
loops='zynq_pgs::platform::vectors::x86::apart*'

# What a run of the benchmark says, in so many stretches.
run() {
	attend timeout "${VALGRIND_LIMIT:-600}" valgrind --tool=callgrind --callgrind-out-file=/dev/null \
		--toggle-collect="$loops" "$built" --bench "${scene[@]}" --order hazard-free \
		--profile "$1" --thing "$2" --runs "$3" 2>&1
}
# The number in front of these words, or behind them.
before() { sed -n "s/.* \([0-9]*\) $1.*/\1/p" <<<"$2"; }
behind() { sed -n "s/.*$1 \([0-9]*\).*/\1/p" <<<"$2"; }

# Of a stretch, so many packings: those of `tools/bench/src/lib.rs` that count and those that do not.
packings=13
good=yes
# A tenth above what they were when this was written.
while read -r profile thing limit; do
	one=$(run "$profile" "$thing" 1) || fail "$profile $thing: $one"
	two=$(run "$profile" "$thing" 2) || fail "$profile $thing: $two"
	entries=$(before 'collisions;' "$one")
	case $thing in *in-order) entries=$((entries + $(before 'empty entries;' "$one"))) ;; esac
	count=$((($(behind 'Collected :' "$two") - $(behind 'Collected :' "$one")) / packings))
	[ $count -gt 0 ] || fail "callgrind sees no $loops: is it called something else now?"
	# In tenths, which the shell can divide.
	tenths=$((count * 10 / entries))
	verdict=
	if [ "${scene[0]}" = --grid ]; then
		verdict=" of $limit"
		[ $tenths -le $((limit * 10)) ] || { good=no; verdict+=': too many'; }
	fi
	echo "$profile $thing: $((tenths / 10)).$((tenths % 10)) instructions an entry$verdict"
done <<'LIMITS'
float as-given 49
float in-order 63
float checked-as-given 162
float checked-in-order 195
half as-given 38
half in-order 47
half checked-as-given 245
half checked-in-order 272
mixed as-given 45
mixed in-order 54
mixed checked-as-given 170
mixed checked-in-order 212
LIMITS
[ $good = yes ] || fail "packing takes more instructions than it did: the loops are in src/beat/unit.rs"
