#!/usr/bin/env bash
# Checks that everything builds with the oldest compiler that Cargo.toml promises.
#
# usage: oldest-compiler.sh
#
# Exit code: 0 done, 1 something does not build, 77 skipped: the compiler cannot be had here.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
cd "$repository"

version=$(sed -n 's/^rust-version = "\(.*\)"$/\1/p' Cargo.toml | head -n 1)
[ -n "$version" ] || fail "Cargo.toml names no rust-version"
command -v rustup >/dev/null || skip "needs rustup, which brings Rust $version"
rustup run "$version" rustc --version >/dev/null 2>&1 ||
	attend timeout 600 rustup toolchain install "$version" --profile minimal --no-self-update ||
	skip "Rust $version cannot be had here"
# A folder of its own: two compilers in one make cargo build all of it anew.
CARGO_TARGET_DIR=$target_root/oldest attend timeout 1200 \
	rustup run "$version" cargo check --workspace --all-targets --locked
