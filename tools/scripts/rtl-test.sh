#!/usr/bin/env bash
# The generated accelerator, verified in simulation: the operators against integer arithmetic and libm,
# then whole steps against Bullet's recorded bits and, beat by beat, against the model.
#
# usage: tools/scripts/rtl-test.sh             a few minutes
#        tools/scripts/rtl-test.sh steps       instead, the driver's whole steps through registers and DMA:
#                                              all recorded ones, and faults; then 500 random steps against
#                                              the model, and 500 among register accesses in lock step, with
#                                              either form of inertia; and 500 with gaps and stalls; the same
#                                              500 and 500 with profile `half`
#        tools/scripts/rtl-test.sh mutations   instead, seeded mistakes in the Verilog: each must be found
#        tools/scripts/rtl-test.sh --help
#
# Installs Verilator and a C++ compiler (Debian's packages) where it may.
#
# environment: VECTORS (for each operator, 1000000), CASES (random steps, 150), PGS_VECTORS (a folder
#              of recorded steps beside tests/golden)
# Exit code: 0 passed, 1 failed, 2 wrong usage, 77 skipped.
set -euo pipefail
. "$(dirname "$0")/lib.sh"
cd "$repository"

mode=${1-}
case $mode in
-h | --help) sed -n '2,/^set /s/^# \{0,1\}//p' "$0"; exit 0 ;;
'' | steps | mutations) ;;
*) sed -n '2,/^set /s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
esac

need_packages verilator g++ make
# Optimised: a step of random words costs the model as much as the simulator.
cargo build --release --quiet --locked -p rtlgen -p zynq-pgs-cosim -p pgs
built=$target_root/release

if [ "$mode" = mutations ]; then
	attend "$built/cosim" mutations
	exit
fi

folder=$(mktemp -d)
litter+=("$folder")
if [ "$mode" = '' ]; then
	attend "$built/rtlgen" operators --vectors "${VECTORS:-1000000}"
	attend "$built/rtlgen" operators --numbers binary16 --vectors "${VECTORS:-1000000}"
	attend "$built/rtlgen" sincos --all
	attend "$built/rtlgen" schedule
	attend "$built/rtlgen" schedule --inertia world
fi

# Both hazard modes, and world inertia, are built side by side. Interlocked builds have an issue queue.
simulations=()
begin "$built/rtlgen" simulator --out "$folder/interlocked"
simulations+=($!)
begin "$built/rtlgen" simulator --out "$folder/unchecked" --hazards unchecked
simulations+=($!)
begin "$built/rtlgen" simulator --out "$folder/world" --inertia world
simulations+=($!)
for process in "${simulations[@]}"; do await "$process"; done
# One after the other: two of these builds at once take too much memory.
for hazards in interlocked unchecked; do
	attend "$built/rtlgen" simulator --profile half --out "$folder/half-$hazards" --hazards "$hazards"
done
world=$folder/world/pgs-rtl
half=(--simulator "$folder/half-interlocked/pgs-rtl" --profile half)
queued=(--simulator "$folder/interlocked/pgs-rtl")

recorded=(tests/golden/*/)
simulators=("$folder/interlocked/pgs-rtl" "$folder/unchecked/pgs-rtl")
if [ "$mode" = steps ]; then
	if [ -n "${PGS_VECTORS-}" ]; then recorded+=("$PGS_VECTORS"/pile*/); fi
	attend "$built/pgs" check --board emulated --accelerator "rtl:${simulators[0]}"
	attend "$built/pgs" check --board emulated:float,world --accelerator "rtl:$world"
	attend "$built/pgs" faults --accelerator "rtl:${simulators[0]}"
	for build in interlocked world; do
		cosim=(--simulator "$folder/$build/pgs-rtl")
		if [ "$build" = world ]; then cosim+=(--inertia world); fi
		attend "$built/cosim" random "${cosim[@]}" --cases 500 --seed 5000000
		attend "$built/cosim" registers "${cosim[@]}" --cases 500
	done
	attend "$built/cosim" random "${queued[@]}" --cases 500 --seed 6000000 --gaps 300 --stalls 700
	attend "$built/cosim" random "${half[@]}" --cases 500 --seed 5000000
	attend "$built/cosim" registers "${half[@]}" --cases 500
	attend "$built/cosim" random "${half[@]}" --cases 500 --seed 6000000 --gaps 300 --stalls 700
	# The longest part comes last.
	attend python3 tools/scripts/rtl_steps.py "$built/pgs" "${simulators[@]}" "${recorded[@]}"
	exit
fi
if [ -n "${PGS_VECTORS-}" ]; then recorded+=("$PGS_VECTORS"/pile10*/); fi
cases=${CASES:-150}
# The longest parts, side by side.
random=()
for hazards in interlocked unchecked; do
	begin "$built/cosim" random --simulator "$folder/$hazards/pgs-rtl" --hazards "$hazards" --cases "$cases"
	random+=($!)
done
begin "$built/cosim" random --simulator "$world" --inertia world --cases $((cases / 2))
random+=($!)
for process in "${random[@]}"; do await "$process"; done
for hazards in interlocked unchecked; do
	cosim=(--simulator "$folder/$hazards/pgs-rtl" --hazards "$hazards")
	attend "$built/cosim" recorded "${cosim[@]}" "${recorded[@]}"
	attend "$built/cosim" errors "${cosim[@]}"
	attend "$built/cosim" full "${cosim[@]}"
	attend "$built/cosim" registers "${cosim[@]}" --cases $((cases / 4))
done
cosim=(--simulator "$world" --inertia world)
attend "$built/cosim" recorded "${cosim[@]}" "${recorded[@]}"
attend "$built/cosim" errors "${cosim[@]}"
attend "$built/cosim" full "${cosim[@]}"
attend "$built/cosim" registers "${cosim[@]}" --cases $((cases / 4))
attend "$built/cosim" random "${cosim[@]}" --cases $((cases / 10)) --seed 1000000 --gaps 300 --stalls 700
for verb in "recorded ${recorded[*]}" errors full "registers --cases $((cases / 4))" "random --cases $cases" \
	"random --cases $((cases / 5)) --seed 1000000 --gaps 300 --stalls 700"; do
	# shellcheck disable=SC2086
	attend "$built/cosim" $verb "${half[@]}"
done
attend "$built/cosim" random --simulator "$folder/half-unchecked/pgs-rtl" --profile half --hazards unchecked \
	--cases $((cases / 2))
attend "$built/cosim" crowded "${queued[@]}"
# Without the interlock the bits depend on the time at which beats come.
attend "$built/cosim" random --simulator "$folder/interlocked/pgs-rtl" --cases $((cases / 5)) --seed 1000000 \
	--gaps 300 --stalls 700
attend "$built/cosim" full --simulator "$folder/interlocked/pgs-rtl" --gaps 300 --stalls 700
attend "$built/pgs" solve tests/golden/two_cubes --compare --board emulated \
	--accelerator "both:${simulators[0]}"
attend "$built/pgs" solve tests/golden/pile5_step60 --board emulated:half \
	--accelerator "both:$folder/half-interlocked/pgs-rtl"
# Impulses of each step come out, and go into the next one.
attend "$built/pgs" run --grid 3x3x3 --drop 0 --steps 12 --warm-start --board emulated \
	--accelerator "both:${simulators[0]}"
# Boxes, capsules, cylinders and hulls, with the masses of the shape table.
attend "$built/pgs" run --scene shapes --grid 5x5x5 --drop 0 --steps 20 --board emulated \
	--accelerator "both:$world"
