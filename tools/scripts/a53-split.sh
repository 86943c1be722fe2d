#!/usr/bin/env bash
# Computes the shares of collision search and collision response in a step on a Cortex-A53, on paper (thesis §4.4:
# 40 and 60 %).
#
#   tools/scripts/a53-split.sh [--grid NXxNYxNZ] [--steps N] [--runs N]
#
#   --grid    cubes of the pile; default: the thesis' 36x30x36
#   --steps   steps before the counted ones; default: 45
#   --runs    counted steps; default: 8. Detection keeps contacts from step to step, so that steps differ
#
# Callgrind counts the instructions of `pgs thesis split` and simulates the caches of the ZCU102's A53. The
# instructions are those of x86-64: an aarch64 build differs by tens of percent. The prefetcher is left out. Four
# cores are computed: one instruction a clock and two, each with two times for memory.
#
# Exit code: 0 done, 1 nothing can be counted, 2 wrong usage, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

usage() { sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; }
grid=36x30x36
steps=45
runs=8
while [ $# -gt 0 ]; do
	case $1 in
		--grid) grid=${2:?} && shift ;;
		--steps) steps=${2:?} && shift ;;
		--runs) runs=${2:?} && shift ;;
		-h | --help) usage; exit 0 ;;
		*) usage >&2; exit 2 ;;
	esac
	shift
done
command -v valgrind >/dev/null || need_packages valgrind
cd "$repository"

cargo build --release --locked --quiet -p pgs || fail "pgs cannot be built"
counts=$(mktemp -d)
litter+=("$counts")

# The A53 of the ZCU102 (AMD UG1085): first-level caches of 32 KB, four ways for data and two for instructions, a
# second level of 1 MB and 16 ways, lines of 64 bytes.
caches=(--cache-sim=yes --I1=32768,2,64 --D1=32768,4,64 --LL=1048576,16,64)
# Has callgrind count inside a function of the study.
count() {
	attend timeout "${VALGRIND_LIMIT:-1800}" valgrind --tool=callgrind "${caches[@]}" \
		--toggle-collect="*study::split::measured_$1" --callgrind-out-file="$counts/$1" \
		"$target_root/release/pgs" thesis split --grid "$grid" --steps "$steps" --runs "$runs" --board emulated --json \
		>"$counts/$1.json" 2>"$counts/$1.log" || fail "the study under callgrind: $(tail -n 3 "$counts/$1.log")"
}
# Instructions, misses of the first level, misses of the second level, of a step in the mean.
counted() {
	awk -v runs="$runs" '/^events:/ { for (i = 2; i <= NF; i++) at[$i] = i }
		/^summary:/ { for (name in at) sum[name] = $at[name] }
		END {
			first = sum["I1mr"] + sum["D1mr"] + sum["D1mw"]
			second = sum["ILmr"] + sum["DLmr"] + sum["DLmw"]
			printf "%d %d %d\n", sum["Ir"] / runs, first / runs, second / runs
		}' "$counts/$1"
}
count search
count response
read -r -a searched < <(counted search)
read -r -a responded < <(counted response)
[ "${searched[0]}" -gt 0 ] && [ "${responded[0]}" -gt 0 ] ||
	fail "callgrind counted nothing in measured_search or measured_response of the study"

awk -v grid="$grid" -v runs="$runs" -v s_ir="${searched[0]}" -v s_l1="${searched[1]}" -v s_l2="${searched[2]}" \
	-v r_ir="${responded[0]}" -v r_l1="${responded[1]}" -v r_l2="${responded[2]}" '
	# A miss of the first level that hits the second: 3.5 ns beyond a hit (5.6 and 2.1 ns by lat_mem_rd on the AM62x of
	# Texas Instruments, an A53 at 1.4 GHz). Memory: 50 ns where a prefetcher helps (30 to 53 ns by lat_mem_rd with a
	# stride of 128 bytes on AM62x and AM64x), 150 ns where it does not (assumed).
	function ms(ir, l1, l2, rate, memory) { return (ir / rate / 1.2 + (l1 - l2) * 3.5 + l2 * memory) / 1e6 }
	function share(s, r) { return 100 * r / (s + r) }
	BEGIN {
		printf "%s cubes, mean of %d steps, counted by callgrind; times of one A53 at 1.2 GHz, on paper\n\n", grid, runs
		printf "%-34s %12s %12s %9s\n", "", "search", "response", "response"
		printf "%-34s %12d %12d %8.1f%%\n", "instructions (x86-64)", s_ir, r_ir, share(s_ir, r_ir)
		printf "%-34s %12d %12d\n", "misses of the first level", s_l1, r_l1
		printf "%-34s %12d %12d\n", "misses of the second level", s_l2, r_l2
		for (rate = 2; rate >= 1; rate--) {
			for (memory = 50; memory <= 150; memory += 100) {
				s = ms(s_ir, s_l1, s_l2, rate, memory); r = ms(r_ir, r_l1, r_l2, rate, memory)
				name = sprintf("%d a clock, memory %d ns: ms", rate, memory)
				printf "%-34s %12.1f %12.1f %8.1f%%\n", name, s, r, share(s, r)
			}
		}
		print "\nthesis (recorded): response 60 % of the processor'"'"'s step"
	}'
