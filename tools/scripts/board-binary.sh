#!/usr/bin/env bash
# Builds the static binary for the board by the two commands of docs/to-a-board.md, and compares Bullet's vectors
# with it as a Cortex-A53, under user-mode QEMU.
#
# usage: board-binary.sh
#
# Exit code: 0 done, 1 the build or a comparison failed, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
cd "$repository"
need_packages qemu-user-static file

readonly target=aarch64-unknown-linux-musl
command -v rustup >/dev/null || skip "needs rustup, which brings the standard library for $target"
grep -qx "rustup target add $target" docs/to-a-board.md || fail "docs/to-a-board.md does not show how to add $target"
attend timeout 300 rustup target add "$target" || skip "$target cannot be had here"
build=$(sed -n "s/^\(cargo build --release --target $target\)$/\1/p" docs/to-a-board.md | head -n 1)
[ -n "$build" ] || fail "docs/to-a-board.md does not show how to build for $target"
CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_RUSTFLAGS=$(nameless_flags)
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_RUSTFLAGS
# shellcheck disable=SC2086 # a command and its options
attend timeout 1800 $build --locked
binary=$target_root/$target/release/pgs
file -b "$binary" | grep -q 'ARM aarch64.*statically linked' ||
	fail "expected a static aarch64 binary in $binary"
echo "$binary: $(stat -c %s "$binary") bytes"
nameless "$binary"

for folder in tests/golden/*/ ${PGS_VECTORS:+"$PGS_VECTORS"/*/}; do
	[ -e "$folder/params.npy" ] || continue
	attend timeout 600 qemu-aarch64-static -cpu cortex-a53 "$binary" \
		solve "$folder" --compare --board emulated >/dev/null || fail "$folder: not Bullet's bits"
	echo "Bullet's bits as a Cortex-A53: $(basename "$folder")"
done
