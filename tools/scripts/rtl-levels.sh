#!/usr/bin/env bash
# Counts the levels of logic between the registers of the operators, of the issue queue, and of the accelerator without
# its solver, by Yosys' synthesis for UltraScale+, and the registers that each clock enable of the whole drives.
# Nothing is placed. It fails where a clock enable drives more than 1,200.
#
# usage: rtl-levels.sh [OPTION...]     options of `rtlgen generate`, such as --inertia world
# environment: YOSYS (the program; yosys)
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

cd "$work"
sources=$(tr '\n' ' ' < pgs.f)
modules=(pgs_fadd pgs_fmul pgs_fdiv pgs_fsqrt pgs_horner pgs_fsincos pgs_queue pgs_top)
for module in "${modules[@]}"; do
	attend timeout 3600 "$yosys" -q -p "
		read_verilog $sources
		blackbox pgs_solver
		synth_xilinx -family xcup -flatten -noiopad -noclkbuf -top $module
		write_blif $module.blif" > "$module.log" 2>&1 || { tail -n 5 "$module.log" >&2; fail "Yosys on $module"; }
done
attend python3 "$repository/tools/scripts/rtl_levels.py" "${modules[@]/%/.blif}"
attend timeout 3600 "$yosys" -q -p "
	read_verilog $sources
	hierarchy -top pgs_top
	setattr -mod -set keep_hierarchy 1 *pgs_delay*
	proc; flatten; opt_expr; opt_dff; opt_clean
	write_rtlil enables.il" > enables.log 2>&1 || { tail -n 5 enables.log >&2; fail "Yosys on pgs_top"; }
attend python3 "$repository/tools/scripts/rtl_enables.py" 1200 enables.il
