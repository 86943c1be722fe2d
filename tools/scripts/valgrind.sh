#!/usr/bin/env bash
# Runs whole steps under valgrind's memcheck: no read or write outside memory that is allocated, and
# none after it was freed. The driver and the emulated board run, on every profile.
#
# Not asked is whether a jump depends on what was never written: optimised code compares the value of
# an `Option` before it looks whether there is one, and memcheck takes that for a mistake.
#
# Exit code: 0 done, 1 something was found, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

command -v valgrind >/dev/null || need_packages valgrind
cd "$repository"
# With the benchmarks' library, as `cargo run` builds it.
cargo build --release --locked --quiet
check() {
	attend timeout "${VALGRIND_LIMIT:-600}" valgrind --quiet --error-exitcode=1 --exit-on-first-error=yes \
		--undef-value-errors=no --leak-check=full --show-leak-kinds=definite --errors-for-leak-kinds=definite "$@"
}
pgs=$target_root/release/pgs
for profile in naive float half mixed windowed windowed16; do
	check "$pgs" run --board emulated --profile "$profile" --grid 2x2x2 --steps 2 >/dev/null
	echo "memcheck: nothing found in 2 steps on $profile"
done
