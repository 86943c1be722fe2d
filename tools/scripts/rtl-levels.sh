#!/usr/bin/env bash
# Counts the levels of logic between the registers of the accelerator, part by part, and the fan-out of every
# clock enable, by Yosys' synthesis for UltraScale+. Nothing is placed. It fails where a clock enable drives
# more than 1,200 bits.
#
# usage: rtl-levels.sh [OPTION...]     options of `rtlgen generate`, such as --inertia world
# environment: YOSYS (the program; yosys)
#
# The solver is a netlist of its own: it takes minutes.
#
# Exit code: 0 done, 1 a clock enable drives too much, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
cd "$repository"
case ${1-} in
-h | --help) sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; exit 0 ;;
esac
yosys=${YOSYS:-yosys}
command -v "$yosys" >/dev/null || need_packages yosys

mkdir -p "$target_root"
work=$(mktemp -d "$target_root/rtl-levels.XXXXXX")
litter+=("$work")
attend cargo run --quiet --locked -p rtlgen -- generate --out "$work" "$@" >/dev/null

# Synthesises the module `$1`, without the module `$2`.
netlist() {
	cd "$work"
	attend timeout 3600 "$yosys" -q -p "
		read_verilog $(tr '\n' ' ' < pgs.f)
		${2:+blackbox $2}
		synth_xilinx -family xcup -flatten -noiopad -noclkbuf -top $1
		write_blif $1.blif" > "$1.log" 2>&1 || { tail -n 5 "$1.log" >&2; fail "Yosys on $1"; }
	cd "$repository"
}

for module in pgs_fadd pgs_fmul pgs_fdiv pgs_fsqrt pgs_horner pgs_fsincos pgs_queue; do netlist "$module"; done
netlist pgs_top pgs_solver
netlist pgs_solver
attend python3 tools/scripts/rtl_levels.py "$work"/*.blif
