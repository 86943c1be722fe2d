#!/usr/bin/env bash
# Runs the tool and the driver's own platform code under a real arm64 kernel, on QEMU's ZCU102.
#
# usage: kernel-test.sh [debian|small]        which kernel, see tools/guest/README.md
# environment: QEMU (qemu-system-aarch64), BOOT_LIMIT (seconds, 900)
#
# Made for Debian 12 on x86-64; missing packages are installed (as root), kernels only unpacked.
# Exit code: 0 done, 1 a check failed, 2 wrong usage, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
kernel=${1:-debian}
scripts=$repository/tools/scripts
[ -x "$scripts/kernel/$kernel.sh" ] || { sed -n '2,8s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; exit 2; }
cd "$repository"

# What the same run ends with on this machine.
attend cargo build --quiet --release --locked -p pgs
digest=$("${CARGO_TARGET_DIR:-target}/release/pgs" run --board emulated --grid 5x5x5 --steps 120 --json |
	sed -n 's/.*"value": "\([0-9a-f]\{16\}\)".*/\1/p')
[ -n "$digest" ] || fail "the run on this machine gave no digest"

attend "$scripts/cross-aarch64.sh"
work=$target_root/kernel-test
attend "$scripts/kernel/$kernel.sh" "$work/$kernel"

content=$work/content
rm -rf "$content"
mkdir -p "$content/bin" "$content/expected"
for program in pgs zdma; do
	install -m 755 "$target_root/aarch64/aarch64-unknown-linux-gnu/release/$program" "$content/bin/"
done
cp -r tests/golden "$content/golden"
echo "$digest" > "$content/expected/digest"
echo "$kernel" > "$content/expected/kernel"

attend "$scripts/kernel/initrd.sh" "$work/$kernel" "$content" "$work/$kernel.initrd"
attend "$scripts/kernel/boot.sh" "$work/$kernel" "$work/$kernel.initrd" "$work/$kernel.log"
