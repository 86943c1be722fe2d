#!/usr/bin/env bash
# Counts instructions by callgrind: what noise hides from a benchmark, and no other test sees.
#
# - Packing and its checks, once it is known where the records lie.
# - A step on the emulated board: collisions that are taken one after the other instead of many at a time give
#   the same bits.
#
#   tools/scripts/instructions.sh                    counts on a pile, and holds the counts against limits
#   tools/scripts/instructions.sh --input FOLDER     prints them alone, of a step in a folder of arrays
#
# Of each: profile, thing (of those that tools/bench/benches/pack.rs describes, or a step), instructions an
# entry or a collision, limit. The packing of an entry has its share of the bodies.
#
# Exit code: 0 done, 1 something takes more than its limit or cannot be counted, 77 skipped: not on this
# machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

case "$*" in
	'') scene=(--grid 12x12x12) ;;
	'--input '?*) scene=(--input "$(realpath -e "$2")") ;;
	*) fail "expected nothing or --input FOLDER, found: $*" ;;
esac
# Elsewhere the conversions and the emulated board use other instructions than those that the limits count.
[[ $(rustc -vV) == *'host: x86_64'* ]] || skip "the limits are those of x86-64"
for feature in avx2 f16c; do
	grep -q -w $feature /proc/cpuinfo 2>/dev/null || skip "the limits are those of $feature, which the processor has not"
done
command -v valgrind >/dev/null || need_packages valgrind
cd "$repository"

# Builds a benchmark; where it is.
built() {
	local binary
	binary=$(cargo bench --bench "$1" --no-run --locked --quiet --message-format=json-render-diagnostics |
		sed -n 's/.*"executable":"\([^"]*\/'"$1"'-[^"]*\)".*/\1/p') || fail "the benchmark '$1' cannot be built"
	[ -n "$binary" ] || fail "cargo does not say where the benchmark '$1' is that it has built"
	echo "$binary"
}
pack=$(built pack)
speed=$(built speed)

# All of packing is in the first of these functions, all that the board does in the last.
packers=('zynq_pgs::beat::collisions::CollisionPacker::write*' 'zynq_pgs::beat::impulses::WarmDealer::write'
	'zynq_pgs::beat::bodies::BodyPacker::write')
board='bitstream_model::board::Board::advance'
log=$(mktemp)
litter+=("$log")
limit_of_time=${VALGRIND_LIMIT:-600}

# Has callgrind count what the first names, with options of its own and a program's; what both say is in the log.
count() {
	local what=$1 code=0
	shift
	attend timeout "$limit_of_time" valgrind --tool=callgrind --callgrind-out-file=/dev/null "$@" >"$log" 2>&1 ||
		code=$?
	[ $code != 124 ] || fail "$what: not done in $limit_of_time s (VALGRIND_LIMIT)"
	[ $code = 0 ] || fail "$what: $(tail -n 3 "$log")"
}
# What the log says instead of the number in this text: one number, as what cannot be computed would end a loop
# and no more.
said() {
	local found
	found=$(sed -n "s/.*${1/NUMBER/\\([0-9][0-9]*\\)}.*/\\1/p" "$log")
	[[ $found =~ ^[0-9]+$ ]] || fail "callgrind and the benchmark say '$1' not once: '$found'"
	echo "$found"
}
# The same of what something is divided by.
some() {
	local found
	found=$(said "$1")
	[ "$found" -gt 0 ] || fail "the benchmark says '$1' of none"
	echo "$found"
}

compared=no
[ "${scene[0]}" != --grid ] || compared=yes
good=yes
held=0
# Prints instructions, given in tenths, which the shell can divide, and holds them against their limit.
hold() {
	local what=$1 tenths=$2 each=$3 limit=$4 verdict=
	[ "$tenths" -gt 0 ] || fail "$what: nothing is counted (of ${packers[*]} or $board)"
	if [ $compared = yes ]; then
		verdict=" of $limit"
		[ "$tenths" -le $((limit * 10)) ] || { good=no; verdict+=': too many'; }
		# So few that the limit would hide anything, if they are all of them.
		[ "$tenths" -ge $((limit * 8)) ] || { good=no; verdict+=': too few'; }
	fi
	echo "$what: $((tenths / 10)).$((tenths % 10)) instructions $each$verdict"
	held=$((held + 1))
}

# Packing. Limits are a tenth above what was counted when they were set, or less, here and below.
while read -r profile thing limit; do
	what="$profile $thing"
	# In one stretch and in two: the difference is that of the runs of a stretch alone.
	counted=()
	for runs in 1 2; do
		count "$what" "${packers[@]/#/--toggle-collect=}" "$pack" --bench "${scene[@]}" \
			--profile "$profile" --thing "$thing" --runs $runs
		counted+=("$(said 'Collected : NUMBER')")
	done
	packings=$(some 'stretches of NUMBER runs')
	entries=$(some ' NUMBER collisions;')
	added=$(said ' NUMBER empty entries;')
	case $thing in in-order | warm) entries=$((entries + added)) ;; esac
	hold "$what" $(((counted[1] - counted[0]) * 10 / packings / entries)) "an entry" "$limit"
done <<'LIMITS'
float as-given 275
float in-order 268
float warm 286
half as-given 376
half in-order 394
half warm 418
LIMITS

# A step on the emulated board, on one thread; the vectors are those that valgrind knows, AVX2.
while read -r profile limit; do
	what="$profile step"
	count "$what" "--toggle-collect=$board" "$speed" --bench "${scene[@]}" --steps 1 --only emulated --profile "$profile"
	instructions=$(said 'Collected : NUMBER')
	collisions=$(some ' NUMBER collisions,')
	hold "$what" $((instructions * 10 / collisions)) "a collision" "$limit"
done <<'LIMITS'
float 3840
half 5690
LIMITS

[ $held = 8 ] || fail "$held of 8 were counted"
[ $good = yes ] || fail "something does not take the instructions it did: if the commit before it does, with" \
	"$(rustc --version), look at the loops (and at the names ${packers[*]} and $board); else change the limits"
