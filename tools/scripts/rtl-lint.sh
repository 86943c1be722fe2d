#!/usr/bin/env bash
# Reads the generated Verilog with Icarus as plain Verilog-2001, with Verilator and all its checks, with Yosys,
# and with slang. A warning fails it.
#
# usage: rtl-lint.sh [OPTION...]     options of `rtlgen generate`, such as --hazards unchecked; without any, the
#                                    default build, the one with world inertia, one without an issue queue, and
#                                    profile `half`
#
# Verilator's complaints about constants of the headers that a module does not use are switched off
# there; no other warning is.
#
# environment: SLANG (a Python that has pyslang; otherwise it is installed from PyPI below the target folder, and
#   slang is left out where that cannot be done)
#
# Exit code: 0 done, 1 a tool has a warning, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
cd "$repository"
need_packages iverilog verilator yosys

slang=${SLANG:-$target_root/tools/slang/bin/python3}
if ! "$slang" -c 'import pyslang.driver' 2>/dev/null; then
	python3 -m venv "$target_root/tools/slang" >/dev/null 2>&1 &&
		attend timeout 600 "$target_root/tools/slang/bin/pip" install --quiet pyslang==12.1.0 ||
		{ slang=; echo "skipped: slang (pyslang cannot be installed from PyPI)"; }
fi

mkdir -p "$target_root"
work=$(mktemp -d "$target_root/rtl-lint.XXXXXX")
litter+=("$work")

# Runs a tool, which has nothing to say unless it has a warning.
failed=
quietly() {
	local tool=$1
	shift
	attend timeout 300 "$@" > "$tool.log" 2>&1 || echo "$tool ends with exit code $?" >> "$tool.log"
	if [ -s "$tool.log" ]; then
		echo "$tool:" >&2
		cat "$tool.log" >&2
		failed=yes
	else
		echo "$tool: no warning"
	fi
}

# Reads the build with these options.
read_build() {
	local files
	cd "$repository"
	attend cargo run --quiet --locked -p rtlgen -- generate --out "$work" "$@"
	cd "$work"
	files=$(tr '\n' ' ' < pgs.f)
	quietly iverilog iverilog -g2001 -Wall -s pgs_top -o /dev/null -f pgs.f
	quietly verilator verilator --lint-only -Wall --top-module pgs_top -f pgs.f
	quietly yosys yosys -q -p "read_verilog $files; hierarchy -check -top pgs_top"
	[ -z "$slang" ] || quietly slang "$slang" -B "$repository/tools/scripts/rtl_slang.py" pgs_top
}
read_build "$@"
if [ $# = 0 ]; then
	read_build --inertia world
	read_build --queue 0
	read_build --profile half
fi
[ -z "$failed" ] || fail "the Verilog has warnings"
