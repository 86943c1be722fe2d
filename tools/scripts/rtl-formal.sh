#!/usr/bin/env bash
# Proves properties of the Verilog's control, by Yosys and the solver ABC that Debian's package has with it.
# The properties are in bitstream-model/rtl/formal, in modules that a `bind` puts beside the product's signals;
# no other tool reads them.
#
# usage: rtl-formal.sh [--mutations] [MODULE...]     all modules, or these
#          --mutations   instead, mistakes planted in the modules: a property must find each
#        rtl-formal.sh --help
#
# A module is either proven, for all times, by induction: the solver finds an invariant (property directed
# reachability) that holds at the start, that every step keeps, and from which the properties follow, or the
# properties have it among them; or it is bounded: no property fails within this number of cycles. Memories and
# windows are small: each line names the parameters. The queue is bounded as a whole, and proven with the outputs of
# two modules inside it as its properties say that they are. A property that fails is named with its line, and a
# waveform of the failure is kept below target.
#
# Exit code: 0 all properties hold, or all mistakes are found; 1 not; 2 wrong usage; 77 skipped: not on this
# machine.
set -euo pipefail
. "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
cd "$repository"

usage() { sed -n '2,/^set /s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; }
mutations='' wanted=()
for argument in "$@"; do
	case $argument in
	-h | --help) usage; exit 0 ;;
	--mutations) mutations=yes ;;
	pgs_*) wanted+=("$argument") ;;
	*) usage >&2; exit 2 ;;
	esac
done
need_packages yosys

properties=$repository/bitstream-model/rtl/formal
failures=$target_root/rtl-formal
mkdir -p "$target_root"
work=$(mktemp -d "$target_root/rtl-formal.XXXXXX")
litter+=("$work")
attend cargo run --quiet --locked -p rtlgen -- generate --out "$work/verilog" >/dev/null
rm -rf "$failures"

# The module `$1` of the file `$2` with its properties, as the file's `bind` says. Yosys reads such a line and does
# nothing, so that the instance is written into a copy here.
bound() {
	local instance
	instance=$(cat "$properties"/*.sv | tr '\n' ' ' | grep -o -E "bind $1 [^;]*;") || fail "no properties of $1"
	INSTANCE=${instance#bind "$1" } perl -pe 's/^endmodule/$ENV{INSTANCE}\nendmodule/' "$2"
}

# The file of the module `$1`, with the mistake that is planted in it.
file_of() {
	if [ -f "$work/mistake/$1.v" ]; then echo "$work/mistake/$1.v"; else echo "$work/verilog/$1.v"; fi
}

# Makes a circuit of the module `$1` and its properties: folder/circuit.aig. `$parameters` are of this
# module, `$parts` the files of the modules inside, `$cuts` the instances whose outputs are left to the solver.
circuit() {
	local module=$1 folder=$work/$1 part files=
	rm -rf "$folder"
	mkdir "$folder"
	bound "$module" "$(file_of "$module")" > "$folder/$module.sv"
	for part in $parts; do files+=" $(file_of "$part")"; done
	attend timeout 600 yosys -q -p "
		read_verilog ${cuts:+-D CUT} -formal -sv -I $work/verilog $folder/$module.sv $files $properties/*.sv
		${parameters:+chparam $(printf -- ' -set %s' $parameters | tr = ' ') $module}
		hierarchy -check -top $module
		${cuts:+cutpoint $(printf " $module/%s" $cuts)}
		prep -flatten -top $module
		tee -q -o $folder/count select -count t:\$assert
		expose -input t:\$anyseq %co1:+[Y] w:* %i; memory_map -formal
		write_rtlil $folder/model.il
		delete -output; formalff -clk2ff -ff2anyinit; setundef -undriven -anyseq
		opt -full; techmap; opt -fast; simplemap; dffunmap; abc -g AND -fast; opt_clean
		write_aiger -I -B -zinit -map $folder/circuit.aim $folder/circuit.aig" > "$folder/yosys.log" 2>&1 ||
		{ tail -n 5 "$folder/yosys.log" >&2; fail "Yosys on $module"; }
}

# Solves the circuit of the module `$1` by these commands of ABC. The report is in folder/solver.log.
solve() {
	local folder=$work/$1
	attend timeout 1200 yosys-abc -q "read_aiger $folder/circuit.aig; fold; strash; $2;
		write_cex -a $folder/failure.aiw" > "$folder/solver.log" 2>&1 || true
	grep -q "was asserted in frame" "$folder/solver.log" || return 0
	# The failure step by step, in the module as it is written. All states begin at 0: an input of the first
	# step sets the ones that have no value at the start. ABC writes fewer of them than there are.
	sed -i "1s/.*/$(printf '%0*d' "$(head -n 1 "$folder/circuit.aig" | cut -d ' ' -f 4)" 0)/" "$folder/failure.aiw"
	attend timeout 120 yosys -p "read_rtlil $folder/model.il
		sim -r $folder/failure.aiw -map $folder/circuit.aim -clock clk -vcd $folder/$1.vcd" \
		> "$folder/failure.log" 2>&1 || { tail -n 5 "$folder/failure.log" >&2; fail "Yosys on a failure of $1"; }
	grep -o -E 'pgs_[a-z_]*properties.sv:[0-9]+' "$folder/failure.log" | head -n 1 > "$folder/found"
	[ -s "$folder/found" ] || fail "$1: Yosys does not repeat the solver's failure"
}

failed=
# Prints the result for the module `$1`.
report() {
	local module=$1 folder=$work/$1 result
	if [ -s "$folder/found" ]; then
		result="FAILS at $(cat "$folder/found")"
		mkdir -p "$failures"
		mv "$folder/$module.vcd" "$failures/"
		echo "waveform: $failures/$module.vcd" >&2
		failed=yes
	elif grep -q "Property proved" "$folder/solver.log"; then
		result="proven by induction, invariant of $(grep -o -E '[0-9]+ clauses' "$folder/solver.log" | head -n 1)"
	elif grep -q "Networks are equivalent" "$folder/solver.log"; then
		result="proven by induction, invariant of the properties"
	elif result=$(grep -o -E '(limit on the number of timeframes \(|No output asserted in )[0-9]+' "$folder/solver.log"); then
		result="bounded, ${result##*[( ]} cycles"
	else
		tail -n 5 "$folder/solver.log" >&2
		result="UNDECIDED"
		failed=yes
	fi
	printf '%-18s %2s properties  %s  (%s)  %s s\n' "$module" "$(grep -o -E '^[0-9]+' "$folder/count")" \
		"$result${cuts:+, without ${cuts// / and }}" "${parameters:-all sizes as built}" $((SECONDS - began))
}

# Checks the module `$1` by the commands `$2` of ABC; then each pair of arguments is a text in its source, or in that of
# a part, and the mistake to be planted in its place.
check() {
	local module=$1 commands=$2 began=$SECONDS file
	shift 2
	[ ${#wanted[@]} = 0 ] || [[ " ${wanted[*]} " = *" $module "* ]] || return 0
	if [ -z "$mutations" ]; then
		circuit "$module"
		solve "$module" "$commands"
		report "$module"
		return
	fi
	while [ $# -gt 0 ]; do
		began=$SECONDS
		rm -rf "$work/mistake"
		mkdir "$work/mistake"
		file=$(cd "$work/verilog" && grep -l -F -e "$1" "$module.v" ${parts:+$(printf '%s.v ' $parts)} | head -n 1) ||
			fail "$module has no text '$1'"
		OLD=$1 NEW=$2 perl -0pe 's/\Q$ENV{OLD}\E/$ENV{NEW}/' "$work/verilog/$file" > "$work/mistake/$file"
		circuit "$module"
		solve "$module" "$commands"
		if [ -s "$work/$module/found" ]; then
			echo "$module: '$2' is found by $(cat "$work/$module/found")  $((SECONDS - began)) s"
		else
			echo "$module: '$2' is NOT FOUND"
			failed=yes
		fi
		shift 2
	done
}

parts='' cuts='' parameters='WIDTH=2 ADDRESS=3 LIMIT=6'
check pgs_fifo 'scorr; pdr' \
	'some  <= count != 1' "some  <= count != 2" \
	'count <= TOP' 'count < TOP' \
	'if (push) words[newest]' 'words[newest]' \
	'if (pop) oldest' 'if (pop & some & ~push) oldest'
parameters='WIDTH=2 ADDRESS=3'
check pgs_block_fifo 'scorr; pdr' \
	'none_left | (one_left & pop)' 'none_left' \
	'pop ? after_oldest : oldest' 'oldest' \
	'count == 2' "1'b0" \
	'one_left  <= none_left' "one_left  <= 1'b1"
parts='pgs_block_fifo pgs_word_sum' parameters='ADDRESS=3'
check pgs_sender 'scorr; pdr' \
	'row_is_last & result' 'row_is_last' \
	"rows_left == 20'd2" "rows_left == 20'd1" \
	'(~tvalid | tready)' "1'b1" \
	'CREDITS = (1 << ADDRESS) - 4' 'CREDITS = (1 << ADDRESS) + 1' \
	'has_room <= credits > 3' 'has_room <= credits > 2' \
	'leaves & tlast & ~clear' 'leaves & ~clear' \
	'given   <= leaves & ~clear' 'given   <= tready & ~clear'
parts='' parameters='COLLISION=3 CONTACT_WINDOW=10 FRICTION_WINDOW=8'
check pgs_issue 'scorr; pdr' \
	'(last_use_a[COLLISION-1:0] >= retired)' '(last_use_a[COLLISION-1:0] > retired)' \
	'under_way[FRICTION_WINDOW/2-2]' 'under_way[FRICTION_WINDOW/2-3]' \
	'under_way[CONTACT_WINDOW/2-2]' 'under_way[CONTACT_WINDOW/2-3]' \
	'hazard <= hazard_a | hazard_b' 'hazard <= hazard_a' \
	'moves_b & (last_use_b[COLLISION] == parity)' 'moves_b' \
	'phase & there' 'there' \
	'streams_ready & found' 'streams_ready'
parts='' parameters=
check pgs_control_block 'scorr; pdr' \
	'if (bready) bvalid' 'bvalid' \
	'& ~sticky & ~failed) go' '& ~sticky) go'
parts='pgs_fifo pgs_word_sum' parameters=
check pgs_receiver 'scorr; pdr -F 22' \
	'tlast != beat_is_last' 'tlast & ~beat_is_last' \
	"left == 21'd2" "left == 21'd3" \
	'error_beat <= beat' 'error_beat <= left' \
	'passes_left == before_friction' 'passes_left == passes'
parts='pgs_queue_first pgs_queue_hazard pgs_queue_records pgs_fifo'
parameters='DEPTH=2 SLOTS=4 SLOT=3 BODY=1 COLLISION=2 WINDOW=5 PATIENCE=3 FACTS=6'
check pgs_queue 'scorr; bmc3 -F 22' \
	'loads        <= phase & some_loading' 'loads        <= some_loading' \
	'slot_rest    <= slot;' 'slot_rest    <= loading;' \
	'waiting != 1}' 'waiting != 2}' \
	'early_has_b ? early_use :' "1'b0 ? early_use :" \
	'(moves_b_s4 & last_has_b)' "(moves_b_s4 & 1'b0)" \
	'(slots_a > slots_b)' '(slots_a < slots_b)'
cuts='first_hazard records' parameters='DEPTH=3 SLOTS=5 SLOT=3 BODY=2 COLLISION=2 WINDOW=4 PATIENCE=3 FACTS=8'
by='orpos; bmc3 -F 6; ind -F 3'
if [ -n "$mutations" ]; then             # a mistake leaves no proof: the solver looks for a failure
	by='scorr; orpos; bmc3 -F 22' parameters='DEPTH=2 SLOTS=4 SLOT=2 BODY=2 COLLISION=2 WINDOW=3 PATIENCE=1 FACTS=8'
fi
check pgs_queue "$by" \
	'from_pick <= from_first' 'from_pick <= first_of' \
	'not_held & ~renewed' 'not_held' \
	'& ~holds & ~blocked)' '& ~holds)' \
	"PATIENCE[10:0] - 11'd1)" "PATIENCE[10:0] - 11'd2)" \
	'(held | renewed) & ~over)' 'held & ~over)' \
	'(free_at == slot_after)' "(free_at == slot_after + 8'd1)" \
	'(enters ? behind' "(1'b0 ? behind" \
	'& ~owed & has_room' '& ~owed' \
	'else if (issues & more) owed' 'else if (issues) owed' \
	'oldest_goes & held_before' 'issues & held_before'

[ -z "$failed" ] || [ -z "$mutations" ] || fail "a planted mistake is not found"
[ -z "$failed" ] || fail "a property does not hold"
