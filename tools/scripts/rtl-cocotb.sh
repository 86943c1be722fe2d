#!/usr/bin/env bash
# The generated accelerator under tools that nobody here wrote: Icarus, cocotb, and cocotbext-axi at its AXI ports.
# Registers, resets, order, back-pressure and the rules of AXI. The programs are in bitstream-model/rtl/cocotb.
#
# usage: rtl-cocotb.sh [--seed N]     of the random values, 1
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
seed=1
while [ $# -gt 0 ]; do
	case $1 in
	-h | --help) usage; exit 0 ;;
	--seed) [[ ${2-} =~ ^[0-9]+$ ]] || { usage >&2; exit 2; } ;;
	*) usage >&2; exit 2 ;;
	esac
	declare "${1#--}=$2"
	shift 2
done
need_packages iverilog libpython3-dev

tools=${TOOLS:-$target_root/tools/cocotb/bin}
if ! "$tools/python3" -c 'import cocotb, cocotbext.axi, numpy' 2>/dev/null; then
	python3 -m venv "${tools%/bin}" >/dev/null 2>&1 || skip "needs Python's venv"
	attend timeout 600 "$tools/pip" install --quiet cocotb==1.9.2 cocotbext-axi==0.1.28 numpy==2.4.6 ||
		skip "cocotb, cocotbext-axi and numpy cannot be installed from PyPI"
fi

mkdir -p "$target_root"
work=$(mktemp -d "$target_root/rtl-cocotb.XXXXXX")
litter+=("$work")

# Begins the tests in these modules on a build with this form of inertia; its number in `runs`.
runs=()
test_build() {
	local inertia=$1 modules=$2 folder=$work/$1
	local bodies=128 collisions=256 queue=8
	attend cargo run --quiet --locked -p rtlgen -- generate --out "$folder" --inertia "$inertia" \
		--bodies "$bodies" --collisions "$collisions" --queue "$queue"
	(
		cd "$folder"
		{ echo "+timescale+1ns/1ps"; cat pgs.f; } > sources.f
		iverilog -g2001 -s pgs_top -o sim.vvp -f sources.f
	)
	begin env PGS_INERTIA="$inertia" PGS_BODIES="$bodies" PGS_COLLISIONS="$collisions" PGS_QUEUE="$queue" \
		PGS_SEED="$seed" \
		PYTHONPATH="$repository/bitstream-model/rtl/cocotb" PYTHONDONTWRITEBYTECODE=1 \
		LIBPYTHON_LOC="$("$tools/cocotb-config" --libpython)" PATH="$tools:$PATH" VIRTUAL_ENV="${tools%/bin}" \
		MODULE="$modules" TOPLEVEL=pgs_top TOPLEVEL_LANG=verilog COCOTB_RESULTS_FILE="$folder/results.xml" \
		vvp -M "$("$tools/cocotb-config" --lib-dir)" -m libcocotbvpi_icarus "$folder/sim.vvp" > "$folder/log" 2>&1
	runs+=("$! $folder")
}
test_build isotropic test_registers
test_build world test_registers

# vvp ends with 0 whatever the tests say: the file of results tells.
failed=
for run in "${runs[@]}"; do
	folder=${run#* }
	await "${run%% *}" || failed=yes
	grep -a -E "\*\* test_|\*\* TESTS=" "$folder/log" || true
	if [ ! -s "$folder/results.xml" ] || grep -q -E "<(failure|error)" "$folder/results.xml"; then
		failed=yes
		grep -a -B 2 -A 40 -E "(failed|Traceback|[Ee]rror)" "$folder/log" >&2 || tail -n 50 "$folder/log" >&2
	fi
done
[ -z "$failed" ] || fail "a test failed; --seed $seed repeats it"
