#!/usr/bin/env bash
# Counts a step of the driver on a Cortex-A53, on paper, and solvers in software beside it: docs/worth.md.
#
# usage: a53-step.sh [--quick] [FOLDER]
#
#   --quick   the smallest scene alone; holds the driver's instructions against their budget
#   FOLDER    a step in arrays, counted too, cold
#
# The aarch64 build runs under user-mode QEMU, with a model of the core as a plugin (a53/plugin.c).
#
# Exit code: 0 done, 1 nothing can be counted or a budget is passed, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
need_packages qemu-user gcc libc6-dev
cd "$repository"

readonly target=aarch64-unknown-linux-musl
command -v rustup >/dev/null || skip "needs rustup, which brings the standard library for $target"
attend timeout 300 rustup target add "$target" || skip "$target cannot be had here"
attend timeout 1800 cargo build --release --locked --quiet -p pgs --target "$target"
plugin=$(mktemp --suffix=.so)
litter+=("$plugin")
cc -O2 -Wall -Wextra -Werror -shared -fPIC -o "$plugin" tools/scripts/a53/plugin.c
attend timeout 3600 python3 tools/scripts/a53_step.py "$target_root/$target/release/pgs" "$plugin" "$@"
