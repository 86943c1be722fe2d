#!/usr/bin/env bash
# Runs the driver, as it is built for the board, in an arm64 guest whose programmable logic is the
# emulated board on this machine: see tools/guest/board/README.md.
#
# usage: board-test.sh [rtl] [debian|small]  rtl: the generated Verilog, in a simulator, is the
#   accelerator of that board, and takes a few steps; debian or small: which kernel
# environment: STEPS (of the run of 125 cubes; 120, on rtl 3), QEMU (qemu-system-aarch64),
#   BOOT_LIMIT (seconds, 1200), SIMULATOR (built before, for rtl; else one is built)
#
# Made for Debian 12 on x86-64; missing packages are installed (as root), kernels only unpacked.
# Exit code: 0 done, 1 a check failed, 2 wrong usage, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
usage() { sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; exit "$1"; }
accelerator=model kernel=debian
for argument in "$@"; do
	case $argument in
	rtl) accelerator=rtl ;;
	debian | small) kernel=$argument ;;
	-h | --help) usage 0 ;;
	*) usage 2 ;;
	esac
done
scripts=$repository/tools/scripts
guest=$repository/tools/guest
cd "$repository"

host=$target_root/release
work=$target_root/kernel-test
if [ $accelerator = rtl ]; then
	# A step takes the simulator seconds.
	golden=(two_cubes pile5_step60) steps=${STEPS:-3}
	if [ -z "${SIMULATOR:-}" ]; then
		need_packages verilator g++ make
		attend cargo run --quiet --release --locked -p rtlgen -- simulator --out "$work/rtl"
		SIMULATOR=$work/rtl/pgs-rtl
	fi
	export SIMULATOR
else
	mapfile -t golden < <(cd tests/golden && printf '%s\n' */)
	steps=${STEPS:-120}
	unset SIMULATOR
fi

attend cargo build --quiet --release --locked -p pgs -p guest-board
# The expected digest is the model's, whatever the accelerator.
digest=$("$host/pgs" run --board emulated --accelerator model --grid 5x5x5 --steps "$steps" |
	sed -n 's/^digest  *fnv1a-64 \([0-9a-f]\{16\}\)$/\1/p')
[ -n "$digest" ] || fail "the run on this machine gave no digest"

attend "$scripts/cross-aarch64.sh"
attend "$scripts/kernel/$kernel.sh" "$work/$kernel"

content=$work/board-content
rm -rf "$content"
mkdir -p "$content/bin" "$content/expected" "$content/golden"
for program in pgs pgs-trap uio-probe uio-unplug; do
	install -m 755 "$target_root/aarch64/aarch64-unknown-linux-gnu/release/$program" "$content/bin/"
done
for folder in "${golden[@]}"; do cp -r "tests/golden/${folder%/}" "$content/golden/"; done
echo "$digest" > "$content/expected/digest"
echo "$steps" > "$content/expected/steps"
echo "${BOOT_LIMIT:-1200}" > "$content/limit"

CHECKS=$guest/board/checks attend "$scripts/kernel/initrd.sh" "$work/$kernel" "$content" \
	"$work/$kernel-board.initrd"
TREE=$guest/zcu102-board.dts BOARD=$host/guest-board BOOT_LIMIT=${BOOT_LIMIT:-1200} \
	attend "$scripts/kernel/boot.sh" "$work/$kernel" "$work/$kernel-board.initrd" "$work/$kernel-board.log"
