#!/usr/bin/env bash
# Has other programs read the files that show the inside of a step: GTKWave's vcd2fst the dump, and
# python3-jsonschema the trace events.
#
# usage: trace-test.sh
#
# Exit code: 0 done, 1 a program complains or reads something else, 77 skipped: not on this machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
cd "$repository"
need_packages gtkwave python3-jsonschema

mkdir -p "$target_root"
work=$(mktemp -d "$target_root/trace-test.XXXXXX")
litter+=("$work")
attend cargo build --quiet --locked -p pgs
pgs=$target_root/debug/pgs

# The number of changes in a dump, of bits and of vectors.
changes() {
	awk '/^\$enddefinitions/ { begun = 1; next }
		begun && /^[01]/ { bits++ }
		begun && /^b/ { vectors++ }
		END { print bits, vectors }' "$1"
}

# Validates a document against the schema. Debian's Python has the package, another one may not.
readonly VALIDATE='
import json, sys
import jsonschema
schema, document = (json.load(open(path)) for path in sys.argv[1:])
jsonschema.Draft202012Validator.check_schema(schema)
jsonschema.Draft202012Validator(schema).validate(document)'
readonly PARSE='import sys, xml.dom.minidom; xml.dom.minidom.parse(sys.argv[1])'

# Reads the files of one step; the rest of the words are the command.
read_files() {
	local name=$1
	shift
	attend env PGS_BOARD=emulated "$pgs" "$@" --vcd "$work/$name.vcd" --trace "$work/$name.json" \
		--timeline "$work/$name.svg" > "$work/$name.out" 2> "$work/$name.err" ||
		{ cat "$work/$name.err" >&2; fail "$name: pgs $* has failed"; }
	attend vcd2fst "$work/$name.vcd" "$work/$name.fst" > "$work/$name.log" 2>&1 ||
		{ cat "$work/$name.log" >&2; fail "$name: vcd2fst refuses the dump"; }
	[ ! -s "$work/$name.log" ] || { cat "$work/$name.log" >&2; fail "$name: vcd2fst complains"; }
	attend fst2vcd "$work/$name.fst" -o "$work/$name.back.vcd"
	[ -s "$work/$name.back.vcd" ] || fail "$name: vcd2fst has kept nothing"
	local read kept
	read=$(changes "$work/$name.vcd")
	kept=$(changes "$work/$name.back.vcd")
	[ "$read" = "$kept" ] || fail "$name: the dump has $read changes, vcd2fst has read $kept"
	attend /usr/bin/python3 -B -c "$VALIDATE" docs/trace.schema.json "$work/$name.json" ||
		fail "$name: the trace is not as docs/trace.schema.json says"
	attend /usr/bin/python3 -B -c "$PARSE" "$work/$name.svg" || fail "$name: the picture is no XML"
	echo "$name: $(grep -c '^#' "$work/$name.vcd") times of changes, $(grep -c '"ph":"X"' "$work/$name.json") spans"
}

read_files one_cube solve tests/golden/one_cube
read_files pile solve tests/golden/pile5_step60 --compare
read_files half solve tests/golden/pile5_step60 --board emulated:half
read_files naive solve tests/golden/pile5_step60 --board emulated:naive
read_files small-descriptors solve tests/golden/pile5_step60 --board emulated:float,length-width=10,bandwidth=3
read_files run run --grid 3x3x3 --steps 20 --traced-step 12
echo "the files of every step can be read"
