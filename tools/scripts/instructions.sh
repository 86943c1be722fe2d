#!/usr/bin/env bash
# Counts by callgrind the instructions that pack and look at records once it is known where these lie: what
# noise hides from a benchmark, and no other test sees, as a loop that has lost its registers to another packs
# the same beats, and what is looked at twice is as right or wrong.
#
#   tools/scripts/instructions.sh                    counts on a pile, and holds the counts against limits
#   tools/scripts/instructions.sh --input FOLDER     prints them alone, of a step in a folder of arrays
#
# Of each: profile, thing (of those that tools/bench/benches/pack.rs describes), instructions an entry, limit.
# The pile's collisions have four contact points and its order is near to the one that they lie in; loops of
# other collisions and of orders that go far are counted of a step in a folder alone.
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
# Elsewhere the loops are compiled for other vectors than those whose instructions the limits count.
[[ $(rustc -vV) == *'host: x86_64'* ]] || skip "the limits are those of x86-64"
for feature in avx2 f16c; do
	grep -q -w $feature /proc/cpuinfo 2>/dev/null || skip "the limits are those of $feature, which the processor has not"
done
command -v valgrind >/dev/null || need_packages valgrind
cd "$repository"
built=$(cargo bench --bench pack --no-run --locked --quiet --message-format=json-render-diagnostics |
	sed -n 's/.*"executable":"\([^"]*\/pack-[^"]*\)".*/\1/p') || fail "the benchmark 'pack' cannot be built"
[ -n "$built" ] || fail "cargo does not say where the benchmark is that it has built"

# All of that is in these functions.
packers=('zynq_pgs::beat::collisions::CollisionPacker::write*' 'zynq_pgs::beat::bodies::BodyPacker::write')
log=$(mktemp)
litter+=("$log")
limit_of_time=${VALGRIND_LIMIT:-600}

# Has callgrind count in a run of the benchmark, in so many stretches; what both say is in the log.
count() {
	local code=0
	attend timeout "$limit_of_time" valgrind --tool=callgrind --callgrind-out-file=/dev/null \
		"${packers[@]/#/--toggle-collect=}" "$built" --bench "${scene[@]}" --order hazard-free \
		--profile "$1" --thing "$2" --runs "$3" >"$log" 2>&1 || code=$?
	[ $code != 124 ] || fail "$1 $2: not done in $limit_of_time s (VALGRIND_LIMIT)"
	[ $code = 0 ] || fail "$1 $2: $(tail -n 3 "$log")"
}
# What the log says instead of the number in this text.
said() {
	local found
	found=$(sed -n "s/.*${1/NUMBER/\\([0-9][0-9]*\\)}.*/\\1/p" "$log")
	[ -n "$found" ] || fail "neither callgrind nor the benchmark says '$1'"
	echo "$found"
}

compared=no
[ "${scene[0]}" != --grid ] || compared=yes
good=yes
# A tenth above what they were when this was written.
while read -r profile thing limit; do
	count "$profile" "$thing" 1
	once=$(said 'Collected : NUMBER')
	count "$profile" "$thing" 2
	twice=$(said 'Collected : NUMBER')
	packings=$(said 'stretches of NUMBER runs')
	entries=$(said ' NUMBER collisions;')
	added=$(said ' NUMBER empty entries;')
	case $thing in *in-order) entries=$((entries + added)) ;; esac
	# In tenths, which the shell can divide.
	tenths=$(((twice - once) * 10 / packings / entries))
	[ $tenths -gt 0 ] || fail "$profile $thing: nothing is counted (of ${packers[*]})"
	verdict=
	if [ $compared = yes ]; then
		verdict=" of $limit"
		[ $tenths -le $((limit * 10)) ] || { good=no; verdict+=': too many'; }
		# So few that the limit would hide anything, if they are all of them.
		[ $tenths -ge $((limit * 8)) ] || { good=no; verdict+=': too few'; }
	fi
	echo "$profile $thing: $((tenths / 10)).$((tenths % 10)) instructions an entry$verdict"
done <<'LIMITS'
float as-given 49
float in-order 75
float checked-as-given 127
float checked-in-order 163
half as-given 38
half in-order 54
half checked-as-given 145
half checked-in-order 173
mixed as-given 45
mixed in-order 65
mixed checked-as-given 127
mixed checked-in-order 160
LIMITS
[ $good = yes ] || fail "packing does not take the instructions it did: if the commit before it does, with" \
	"$(rustc --version), look at the loops (and at the names ${packers[*]}); else change the limits"
