#!/usr/bin/env bash
# Counts what the accelerator takes of the ZCU102's device, part by part, by Yosys' synthesis for
# UltraScale+, and holds the sums against limits. Nothing is placed or routed. In front of each table it counts
# the block RAM by the shapes of the device's blocks, which needs no tool's choice.
#
# usage: rtl-resources.sh [OPTION...]     options of `rtlgen generate`, such as --collisions 100000
# environment: YOSYS (the program; yosys)
#
# Without options there are three tables: the default build, the one with the most collisions that leaves
# room for four DMA engines, and the cost of the rule for results that round up to the smallest normal number
# (`--smallest-normal`). The pipelines are synthesised once, which takes minutes.
#
# Exit code: 0 done, 1 a build is too large, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
cd "$repository"
yosys=${YOSYS:-yosys}
command -v "$yosys" >/dev/null || need_packages yosys
readonly MOST_COLLISIONS=172032

mkdir -p "$target_root"
work=$(mktemp -d "$target_root/rtl-resources.XXXXXX")
litter+=("$work")

# Writes a build into the folder `$1`.
generate() {
	local folder=$1
	shift
	attend cargo run --quiet --locked -p rtlgen -- generate --out "$work/$folder" "$@" >/dev/null
}

# Synthesises the module `$2` of the folder `$1`, without the modules that follow. Yosys takes paths below
# its own folder alone if it comes from PyPI.
synthesise() {
	local folder=$1 top=$2
	shift 2
	cd "$work/$folder"
	attend timeout 3600 "$yosys" -q -p "
		read_verilog $(tr '\n' ' ' < pgs.f)
		${*:+blackbox $*}
		${parameters:+chparam $parameters $top}
		synth_xilinx -family xcup -noiopad -noclkbuf -top $top
		tee -q -o $top.json stat -json" > "$top.log" 2>&1 || { tail -n 5 "$top.log" >&2; fail "Yosys on $top"; }
	cd "$repository"
}

# Prints the tables of the folder `$1`; `$2` is the largest allowed number of BRAM36.
table() {
	cd "$work/$1"
	attend timeout 600 "$yosys" -q -p "
		read_verilog $(tr '\n' ' ' < pgs.f)
		hierarchy -top pgs_top; proc; write_json memories.json" > memories.log 2>&1 ||
		{ tail -n 5 memories.log >&2; fail "Yosys on the memories"; }
	cd "$repository"
	attend python3 tools/scripts/rtl_memories.py --brams "$2" "$work/$1/memories.json"
	echo
	attend python3 tools/scripts/rtl_resources.py --brams "$2" \
		"$work/$1/pgs_top.json" "$work/base/pgs_solver.json"
}

# Prints what the rule of the smallest normal number takes in each operator that has it, and in all of them.
rule() {
	local operator
	for operator in pgs_fmul pgs_fdiv; do
		synthesise base "$operator"
		parameters='-set SMALLEST_NORMAL 0' synthesise without "$operator"
	done
	attend python3 tools/scripts/rtl_resources.py --rule "$work/base" "$work/without" \
		"$work"/base/pgs_{top,solver}.json
}

parameters=
pipelines=(pgs_solver)
generate base "$@"
synthesise base pgs_top "${pipelines[@]}"
for pipeline in "${pipelines[@]}"; do synthesise base "$pipeline"; done
echo "$("$yosys" -V | cut -d '(' -f 1), not placed: ${*:-the default build}"
table base 800
if [ $# = 0 ]; then
	generate most --collisions "$MOST_COLLISIONS"
	synthesise most pgs_top "${pipelines[@]}"
	echo
	echo "The same with $MOST_COLLISIONS collisions"
	table most 880
	cp -r "$work/base" "$work/without"
	echo
	rule
fi
