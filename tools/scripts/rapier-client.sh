#!/usr/bin/env bash
# Builds tools/clients/rapier, which no other build compiles, and runs Rapier's scenes on both solvers.
#
# usage: rapier-client.sh [ARGUMENT...]     arguments of rapier-client, such as --board emulated:float,world,threads=1 pile
#
# Exit code: 0 done, 1 a limit does not hold, a test fails or something does not build, 2 wrong usage,
# 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

command -v cargo >/dev/null || skip "needs cargo in PATH"
cd "$repository/tools/clients/rapier"
export CARGO_TARGET_DIR=$target_root/rapier-client

# Rapier and its dependencies come from the registry, and stay in cargo's own cache.
log=$(mktemp)
litter+=("$log")
if ! attend timeout 600 cargo fetch --quiet --locked > "$log" 2>&1; then
	cat "$log" >&2
	! grep -q -e '--locked' "$log" || fail "Cargo.lock of tools/clients/rapier does not fit its Cargo.toml"
	skip "Rapier cannot be fetched: the registry is not reachable"
fi

# No other stage reads these sources.
! cargo fmt --version >/dev/null 2>&1 || attend cargo fmt --check
! cargo clippy --version >/dev/null 2>&1 ||
	attend cargo clippy --release --all-targets --quiet --locked --offline -- -D warnings
attend cargo test --release --quiet --locked --offline
attend cargo build --release --quiet --locked --offline

SECONDS=0
code=0
attend "$CARGO_TARGET_DIR/release/rapier-client" "$@" || code=$?
echo "rapier-client: the scenes took $SECONDS s"
exit $code
