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
# A C program over the shared library, installed and linked as docs/engines.md says.
check_c() {
	local prefix abi found
	prefix=$(mktemp -d)
	litter+=("$prefix")
	cargo build --release --locked --quiet -p zynq-pgs-c
	abi=$(sed -n 's/^#define ZPGS_ABI_VERSION //p' tools/capi/include/zynq_pgs.h)
	install -D -m 644 tools/capi/include/zynq_pgs.h "$prefix/include/zynq_pgs.h"
	install -D -m 755 "$target_root/release/libzynq_pgs_c.so" "$prefix/lib/libzynq_pgs_c.so.$abi"
	ln -s "libzynq_pgs_c.so.$abi" "$prefix/lib/libzynq_pgs_c.so"
	mkdir -p "$prefix/lib/pkgconfig"
	sed "s|@prefix@|$prefix|; s|@version@|0|" tools/capi/zynq-pgs.pc.in > "$prefix/lib/pkgconfig/zynq-pgs.pc"
	# shellcheck disable=SC2046 # several words
	cc -std=c99 -O1 -g tools/capi/examples/cube.c -o "$prefix/cube" \
		$(PKG_CONFIG_PATH=$prefix/lib/pkgconfig pkg-config --cflags --libs zynq-pgs)
	found=$(LD_LIBRARY_PATH=$prefix/lib check "$prefix/cube")
	[ "$found" = "$(LD_LIBRARY_PATH=$prefix/lib "$prefix/cube")" ] || fail "the C example differs under memcheck"
	echo "memcheck: nothing found in the C example, ${found##*digest}"
}

pgs=$target_root/release/pgs
for profile in naive float half; do
	check "$pgs" run --board "emulated:$profile" --grid 2x2x2 --steps 2 >/dev/null
	echo "memcheck: nothing found in 2 steps on $profile"
done
check "$pgs" run --board emulated --scene shapes --pair-friction --warm-start \
	--grid 2x2x2 --steps 2 >/dev/null
echo "memcheck: nothing found in 2 steps with impulses"
if command -v cc >/dev/null && command -v pkg-config >/dev/null; then
	check_c
else
	echo "skipped: the C example under memcheck (cc or pkg-config is not installed)"
fi
