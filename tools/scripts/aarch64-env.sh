# This file makes cargo build for aarch64, and run what it built. To be sourced after lib.sh.

aarch64=aarch64-unknown-linux-gnu
need_packages rustc-web libstd-rust-web-dev:arm64 gcc-aarch64-linux-gnu libc6-dev-arm64-cross \
	qemu-user-static file
command -v cargo >/dev/null || skip "needs cargo in PATH"

export RUSTC=/usr/bin/rustc RUSTDOC=/usr/bin/rustdoc
oldest=$(sed -n 's/^rust-version = "\(.*\)"$/\1/p' "$repository/Cargo.toml")
found=$($RUSTC --version | cut -d' ' -f2)
[ "$(printf '%s\n' "$oldest" "$found" | sort -V | head -n 1)" = "$oldest" ] ||
	skip "$RUSTC is $found, and this project needs $oldest"

# Two compilers in one target directory would rebuild everything at each change of them.
export CARGO_TARGET_DIR=$target_root/aarch64
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc
# LLVM 22.1 writes a wrong row into the unwind table of a function whose prologue it moves behind a branch and
# copies: a panic through that function unwinds for ever.
given_away="-C strip=symbols -C llvm-args=-enable-shrink-wrap=false $(nameless_flags)"
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUSTFLAGS="-C target-feature=+crt-static $given_away"
# QEMU's own choice of CPU has half precision instructions, which the board's has not. There is no
# -L: with the loader of one C library and the threads of another, a program hangs.
export PGS_TEST_RUNNER="timeout 900 qemu-aarch64-static -cpu cortex-a53"
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER=$PGS_TEST_RUNNER

# Runs a command, or a function, that builds with a shared C library. A build with a static one makes no shared
# library, and another C library needs a target directory of its own.
with_shared_library() {
	CARGO_TARGET_DIR=$target_root/aarch64-shared \
		CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUSTFLAGS=$given_away \
		CC=aarch64-linux-gnu-gcc CXX=aarch64-linux-gnu-g++ "$@"
}
