#!/usr/bin/env bash
# Runs the driver's buffers and windows with what builds on them, the threads that share work, and the C
# interface's access to its caller's memory, under Miri: it finds reads and writes outside an allocation,
# references that overlap, and data races.
#
# Not under Miri: what goes through a device file, as it maps none, the vectors of a processor, and what
# the emulated board's threads share by themselves. valgrind.sh runs whole steps.
# Needs a nightly toolchain with the components miri and rust-src; the first run builds its own
# standard library.
# Exit code: 0 done, 1 something was found, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

command -v rustup >/dev/null || skip "needs rustup and a nightly toolchain with miri and rust-src"
cargo +nightly miri --version >/dev/null 2>&1 ||
	skip "needs Miri: rustup component add --toolchain nightly miri rust-src"

cd "$repository"
# Files of the tests' own are opened and locked.
export MIRIFLAGS="-Zmiri-disable-isolation -Zmiri-strict-provenance ${MIRIFLAGS:-}"
# What maps a file cannot run; names are those of the tests.
attend timeout "${MIRI_LIMIT:-1800}" cargo +nightly miri test --locked -p zynq-pgs --lib -- \
	platform::linux::mapped::tests::words_and_beats platform::linux::mapped::tests::pieces_of \
	platform::memory::copy:: platform::fence:: platform::memory::buffer:: axi_dma::ring::
# The threads that packing, detection and the emulated board share their work among: they outlive what
# they borrow.
attend timeout "${MIRI_LIMIT:-1800}" cargo +nightly miri test --locked -p pgs-support --lib
# The structures and strided arrays of a C caller.
attend timeout "${MIRI_LIMIT:-1800}" cargo +nightly miri test --locked -p zynq-pgs-c --lib -- memory::
