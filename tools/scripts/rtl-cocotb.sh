#!/usr/bin/env bash
# The generated accelerator under tools that nobody here wrote: cocotb, and cocotbext-axi at its AXI ports.
# Registers, resets and the rules of AXI; then steps that numpy packs and solves by the specification alone, with
# pauses on all streams, and resets in the middle. The programs are in bitstream-model/rtl/cocotb.
#
# usage: rtl-cocotb.sh [--scenes N] [--cycles N] [--seed N] [--full]
#          --scenes   random steps for each form of inertia: 2, with --full 100
#          --cycles   the longest step among them, without waits: 2200, with --full 6000
#          --seed     of the random steps and of the pauses: 1
#          --full     every part on both builds: faults in packets and all golden folders, too. Three million cycles:
#                     Verilator, whose build takes minutes, takes the place of Icarus, which has unknown levels, but
#                     runs 70 cycles a second where Verilator runs 3,000
#        rtl-cocotb.sh --help
#
# environment: TOOLS (a folder with a Python that has cocotb, cocotbext-axi and numpy; otherwise they are installed
#   from PyPI below the target folder)
#
# Exit code: 0 passed, 1 failed, 2 wrong usage, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
cd "$repository"

usage() { sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; }
scenes='' cycles='' seed=1 full=
while [ $# -gt 0 ]; do
	case $1 in
	-h | --help) usage; exit 0 ;;
	--full) full=yes; shift; continue ;;
	--scenes | --cycles | --seed) [[ ${2-} =~ ^[0-9]+$ ]] || { usage >&2; exit 2; } ;;
	*) usage >&2; exit 2 ;;
	esac
	declare "${1#--}=$2"
	shift 2
done
scenes=${scenes:-${full:+100}} scenes=${scenes:-2}
cycles=${cycles:-${full:+6000}} cycles=${cycles:-2200}
if [ -n "$full" ]; then need_packages libpython3-dev verilator g++ make; else need_packages libpython3-dev iverilog; fi

tools=${TOOLS:-$target_root/tools/cocotb/bin}
if ! "$tools/python3" -c 'import cocotb, cocotbext.axi, numpy' 2>/dev/null; then
	python3 -m venv "${tools%/bin}" >/dev/null 2>&1 || skip "needs Python's venv"
	attend timeout 600 "$tools/pip" install --quiet cocotb==1.9.2 cocotbext-axi==0.1.28 numpy==2.4.6 ||
		skip "cocotb, cocotbext-axi and numpy cannot be installed from PyPI"
fi

mkdir -p "$target_root"
work=$(mktemp -d "$target_root/rtl-cocotb.XXXXXX")
litter+=("$work")

libraries=$("$tools/cocotb-config" --lib-dir)

# Makes `$folder/simulation` of the Verilog there.
by_icarus() {
	{ echo "+timescale+1ns/1ps"; cat pgs.f; } > sources.f
	iverilog -g2001 -s pgs_top -o sim.vvp -f sources.f
	printf '#!/bin/sh\nexec vvp -M %s -m libcocotbvpi_icarus %s\n' "$libraries" "$PWD/sim.vvp" > simulation
	chmod +x simulation
}
by_verilator() {
	local pins
	{
		echo '`verilator_config'
		for pins in aclk aresetn irq 's_axi_*' 's?_axis_*' 'm?_axis_*'; do
			echo "public_flat_rw -module \"pgs_top\" -var \"$pins\""
		done
	} > public.vlt
	attend verilator --cc --exe --build -Wno-fatal -O3 --vpi --prefix Vtop --timescale 1ns/1ps \
		--output-split 20000 -j 0 --top-module pgs_top -Mdir obj -CFLAGS -O1 \
		-LDFLAGS "-Wl,-rpath,$libraries -L$libraries -lcocotbvpi_verilator" -o simulation \
		public.vlt -f pgs.f "$("$tools/cocotb-config" --share)/lib/verilator/verilator.cpp" > verilator.log 2>&1 ||
		{ tail -n 20 verilator.log >&2; fail "Verilator"; }
	ln -s obj/simulation simulation
}

# Begins the tests in these modules on a build with this form of inertia; its number and folder in `runs`.
runs=()
test_build() {
	local inertia=$1 modules=$2 folder=$work/$1
	local bodies=128 collisions=256 queue=8
	attend cargo run --quiet --locked -p rtlgen -- generate --out "$folder" --inertia "$inertia" \
		--bodies "$bodies" --collisions "$collisions" --queue "$queue"
	cd "$folder"
	if [ -n "$full" ]; then by_verilator; else by_icarus; fi
	cd "$repository"
	begin env PGS_INERTIA="$inertia" PGS_BODIES="$bodies" PGS_COLLISIONS="$collisions" PGS_QUEUE="$queue" \
		PGS_SCENES="$scenes" PGS_CYCLES="$cycles" PGS_SEED="$seed" PGS_FULL="$full" \
		PGS_GOLDEN="$repository/tests/golden" \
		PYTHONPATH="$repository/bitstream-model/rtl/cocotb" PYTHONDONTWRITEBYTECODE=1 \
		LIBPYTHON_LOC="$("$tools/cocotb-config" --libpython)" PATH="$tools:$PATH" VIRTUAL_ENV="${tools%/bin}" \
		MODULE="$modules" TOPLEVEL=pgs_top TOPLEVEL_LANG=verilog COCOTB_RESULTS_FILE="$folder/results.xml" \
		"$folder/simulation" > "$folder/log" 2>&1
	runs+=("$! $folder")
}
test_build isotropic test_registers,test_steps
test_build world "${full:+test_registers,}test_steps"

# A simulator ends with 0 whatever the tests say: the file of results tells.
failed=
for run in "${runs[@]}"; do
	folder=${run#* }
	await "${run%% *}" || failed=yes
	grep -a -E "^(scene|folder|faults)|\*\* (test_|TESTS=)" "$folder/log" || true
	if [ ! -s "$folder/results.xml" ] || grep -q -E "<(failure|error)" "$folder/results.xml"; then
		failed=yes
		grep -a -B 2 -A 40 -E "(failed|Traceback|error|Error)" "$folder/log" >&2 || tail -n 50 "$folder/log" >&2
	fi
done
[ -z "$failed" ] || fail "a test failed; --seed $seed repeats it"
