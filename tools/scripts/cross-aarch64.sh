#!/usr/bin/env bash
# Builds the command line tool for the board: a static aarch64 binary that needs no library there.
#
# usage: cross-aarch64.sh [--test]
#   --test   also run what computes and drives as tests, under user-mode QEMU as a Cortex-A53
#
# Made for Debian 12 on x86-64. The cargo is the one in PATH; the compiler is Debian's rustc-web,
# the only one there with an aarch64 standard library. Missing packages are installed (as root).
# Exit code: 0 done, 1 the build or a test failed, 2 wrong usage, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

run_tests=no
case ${1:-} in
'') ;;
--test) run_tests=yes ;;
*) sed -n '2,9s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; exit 2 ;;
esac

. "$repository/tools/scripts/aarch64-env.sh"
cd "$repository"
time_of() { local begin=$SECONDS; "$@"; echo "($((SECONDS - begin)) s for: $*)"; }

# With the guest programs of tools/guest, so that one build has all.
time_of attend timeout 1800 cargo build --release --locked --target "$aarch64" \
	-p pgs -p zdma -p guest-board
binary=$CARGO_TARGET_DIR/$aarch64/release/pgs
file -b "$binary"
file -b "$binary" | grep -q 'ARM aarch64.*statically linked' ||
	fail "expected a static aarch64 binary in $binary"
echo "$binary: $(stat -c %s "$binary") bytes"
nameless "$binary"

if [ $run_tests = yes ]; then
	# What computes, what drives and what converts: there another processor could make a difference.
	# What reads command lines, finds files or judges texts has run where it was built.
	time_of attend timeout "${TEST_LIMIT:-1200}" cargo test --release --locked --target "$aarch64" \
		-p zynq-pgs -p bitstream-model --lib
	time_of attend timeout "${TEST_LIMIT:-1200}" cargo test --release --locked --target "$aarch64" \
		-p zynq-pgs -p bitstream-model --test it -- fast:: float_environment:: warm_start:: asked::
	# The examples in C and C++, with the static and the shared library. The programs find their loader and
	# C library where Debian's libc6 of arm64 has them, so that loader and threads are of one C library.
	need_packages libc6:arm64
	# The test names the example that it skips without a compiler.
	(need_packages g++-aarch64-linux-gnu) || true
	with_shared_library time_of attend timeout "${TEST_LIMIT:-1200}" \
		cargo test --release --locked --target "$aarch64" -p zynq-pgs-c --test examples
	# Bullet's bits from the binary itself, which no test has to be built for.
	for folder in tests/golden/*/ ${PGS_VECTORS:+"$PGS_VECTORS"/*/}; do
		[ -e "$folder/params.npy" ] || continue
		# shellcheck disable=SC2086 # a command and its options
		attend $PGS_TEST_RUNNER "$binary" solve "$folder" --compare >/dev/null ||
			fail "$folder: not Bullet's bits"
		echo "Bullet's bits as a Cortex-A53: $(basename "$folder")"
	done
fi
