#!/usr/bin/env bash
# Runs the driver, as it is built for the board, in an arm64 guest whose programmable logic is the
# emulated board on this machine: see tools/guest/board/README.md.
#
# usage: board-test.sh [debian|small]        which kernel
# environment: STEPS (of the run of 125 cubes, 120), QEMU (qemu-system-aarch64),
#   BOOT_LIMIT (seconds, 1200)
#
# Made for Debian 12 on x86-64; missing packages are installed (as root), kernels only unpacked.
# Exit code: 0 done, 1 a check failed, 2 wrong usage, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
kernel=${1:-debian}
scripts=$repository/tools/scripts
guest=$repository/tools/guest
[ -x "$scripts/kernel/$kernel.sh" ] || { sed -n '2,10s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; exit 2; }
cd "$repository"

attend cargo build --quiet --release --locked -p pgs -p guest-board
host=${CARGO_TARGET_DIR:-target}/release
steps=${STEPS:-120}
digest=$("$host/pgs" --board emulated run --grid 5x5x5 --steps "$steps" |
	sed -n 's/^digest  *fnv1a-64 \([0-9a-f]\{16\}\)$/\1/p')
[ -n "$digest" ] || fail "the run on this machine gave no digest"

attend "$scripts/cross-aarch64.sh"
work=$target_root/kernel-test
attend "$scripts/kernel/$kernel.sh" "$work/$kernel"

content=$work/board-content
rm -rf "$content"
mkdir -p "$content/bin" "$content/expected" "$content/golden"
for program in pgs pgs-trap uio-probe; do
	install -m 755 "$target_root/aarch64/aarch64-unknown-linux-gnu/release/$program" "$content/bin/"
done
cp -r tests/golden/*/ "$content/golden/"
echo "$digest" > "$content/expected/digest"
echo "$steps" > "$content/expected/steps"
echo "${BOOT_LIMIT:-1200}" > "$content/limit"

CHECKS=$guest/board/checks attend "$scripts/kernel/initrd.sh" "$work/$kernel" "$content" \
	"$work/$kernel-board.initrd"
TREE=$guest/zcu102-board.dts BOARD=$host/guest-board BOOT_LIMIT=${BOOT_LIMIT:-1200} \
	attend "$scripts/kernel/boot.sh" "$work/$kernel" "$work/$kernel-board.initrd" "$work/$kernel-board.log"
