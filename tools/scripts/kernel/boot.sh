#!/usr/bin/env bash
# Boots a kernel on QEMU's ZCU102 and says what its checks found.
#
# usage: boot.sh KERNEL INITRD LOG           KERNEL: a directory made by debian.sh or small.sh
# environment: QEMU (qemu-system-aarch64), BOOT_LIMIT (seconds, 900),
#   TREE (device tree source, tools/guest/zcu102.dts),
#   BOARD (a program that plays the programmable logic: tools/guest/board; none),
#   SIMULATOR (of the accelerator of BOARD; none: the model)
# Exit code: 0 when every check passed and the guest said so itself.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/../lib.sh"
need_packages qemu-system-arm device-tree-compiler

kernel=$1 initrd=$2 log=$3
limit=${BOOT_LIMIT:-900}
scratch=$(mktemp -d) # the path of a socket must be short
ram=$log.ram
litter+=("$scratch" "$ram")
tree=$scratch/dtb
dtc -q -I dts -O dtb -o "$tree" "${TREE:-$repository/tools/guest/zcu102.dts}"
machine=xlnx-zcu102 shared=()
if [ -n "${BOARD:-}" ]; then
	# Memory that another process sees too, and a socket for interrupts.
	machine+=,memory-backend=ddr
	shared=(-object "memory-backend-file,id=ddr,size=2G,mem-path=$ram,share=on" -accel tcg
		-qtest "unix:$scratch/qtest,server=on,wait=off" -qtest-log /dev/null)
	begin "$BOARD" --memory "$ram" --qtest "$scratch/qtest" --mailbox 0x31000000 \
		--limit "$limit" ${SIMULATOR:+--simulator "$SIMULATOR"} > "$log.board" 2>&1
	board=$!
fi
began=$(date +%s%N)
code=0
# The module takes its option where it is loaded; a kernel that has it built in takes it here.
QEMU_AUDIO_DRV=none begin timeout --kill-after=10 "$limit" "${QEMU:-qemu-system-aarch64}" \
	-M "$machine" "${shared[@]}" -smp 2 -m 2G -display none -monitor none -serial stdio -no-reboot \
	-kernel "$kernel/Image" -dtb "$tree" -initrd "$initrd" \
	-append 'console=ttyPS0,115200n8 panic=-1 quiet uio_pdrv_genirq.of_id=generic-uio' \
	< /dev/null > "$log" 2> "$log.qemu"
await $! || code=$?
sed -i 's/\r//g' "$log"
grep -a -E '^(guest:|ok |FAIL |  )' "$log" || true
printf 'QEMU ended with %s after %s ms, log %s\n' "$code" $((($(date +%s%N) - began) / 1000000)) "$log"

if [ -n "${BOARD:-}" ]; then
	served=0
	[ $code = 0 ] || kill "$board" 2>/dev/null || true
	await "$board" || served=$?
	cat "$log.board"
	[ $code != 0 ] || [ $served = 0 ] || fail "the board ended with $served"
fi
[ $code = 0 ] || { tail -n 20 "$log" "$log.qemu" >&2; fail "the guest did not power itself off in time"; }
total=$(sed -n 's/^guest: \([0-9]* ok, [0-9]* failed\)$/\1/p' "$log")
[ -n "$total" ] || { tail -n 20 "$log" >&2; fail "the guest did not reach the end of its checks"; }
ok=${total%% ok*}
[ "$ok" -gt 0 ] && [ "$total" = "$ok ok, 0 failed" ] || fail "in the guest: $total"
