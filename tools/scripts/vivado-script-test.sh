#!/usr/bin/env bash
# Runs the Vivado script tools/vivado/build.tcl on the generated Verilog with a stand-in for Vivado's
# commands, tools/vivado/mock.tcl: the block design must be accepted on each board, and with planted mistakes
# refused. Where there is Yosys, the script's count of block RAM is held against that of the Verilog.
#
# usage: tools/scripts/vivado-script-test.sh
#        tools/scripts/vivado-script-test.sh --help
#
# Needs no Vivado, and says nothing about what only Vivado knows. Installs tclsh (Debian's package tcl)
# where it may.
#
# Exit code: 0 passed, 1 failed, 2 wrong usage, 77 skipped.
set -euo pipefail
. "$(dirname "$0")/lib.sh"
cd "$repository"

case ${1-} in
-h | --help) sed -n '2,/^set /s/^# \{0,1\}//p' "$0"; exit 0 ;;
'') ;;
*) sed -n '2,/^set /s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
esac

command -v tclsh >/dev/null || need_packages tcl
cargo build --quiet --locked -p rtlgen
folder=$(mktemp -d)
litter+=("$folder")
generate() { attend "$target_root/debug/rtlgen" generate --out "$folder/$1" "${@:2}"; }
generate rtl
# The largest builds for the other boards, as the script names them.
declare -A world=([kv260]='--bodies 4096 --collisions 8192' [zcu104]='--bodies 8192 --collisions 45056')
declare -A half=([kv260]='--bodies 4096 --collisions 24576' [zcu104]='--bodies 16384 --collisions 61440')
declare -A largest=([kv260]='--bodies 4096 --collisions 16384' [zcu104]='--bodies 12288 --collisions 49152')
cp -r "$folder/rtl" "$folder/zcu102"
# shellcheck disable=SC2086 # options of rtlgen, each a word
for board in "${!largest[@]}"; do generate "$board" ${largest[$board]}; done
generate world --inertia world
generate half --profile half

# Runs a script with the stand-in; its last lines.
mock() { tclsh tools/vivado/mock.tcl "$1" -rtl "$folder/rtl" -out "$folder/out" "${@:2}" 2>&1; }

# Expects a run to be refused, and a text in its reason.
refused() {
	local what=$1 expected=$2 said
	if said=$(mock "${@:3}"); then fail "$what was accepted"; fi
	said=$(tail -n 1 <<<"$said")
	[[ $said = refused:* && $said = *"$expected"* ]] || fail "$what: not '$expected' but: $said"
	echo "$what: $said"
	planted=$((planted + 1))
}
planted=0

# Changes one of the two files by a sed expression, and expects the result to be refused. Options follow.
plant() {
	local what=$1 file=$2 change=$3 expected=$4
	cp tools/vivado/build.tcl tools/vivado/pgs_interrupts.v "$folder"
	sed -i "$change" "$folder/$file"
	! cmp -s "$folder/$file" "tools/vivado/$file" || fail "$what: nothing to change in $file"
	refused "$what" "$expected" "$folder/build.tcl" "${@:5}"
}

# One segment for each of the 12 masters, at the memory that the device tree reserves, wherever that is.
fences() {
	local found
	found=$(grep -c -E "^address +dma[0-3]/Data_(SG|MM2S|S2MM) +processor/SAXIGP[2-5]/HP[0-3]_$1 +$2\$" <<<"$3")
	[ "$found" = 12 ] || fail "$found masters with the segment $1 at $2: $3"
}
# As it is, for each board: from the script to the files for the board.
for board in zcu104 kv260 zcu102; do
	said=$(mock tools/vivado/build.tcl -board "$board" -rtl "$folder/$board") || fail "$board: the script is refused: $said"
	echo "$said"
	fences DDR_LOW '0x0050000000 \+ 0x4000000' "$said"
	[[ $said != *warning* ]] || fail "a warning: $said"
done
# Three streams, one of them narrow: a DMA core, a port and two interrupts less.
said=$(mock tools/vivado/build.tcl -rtl "$folder/half" -until design) || fail "half: the script is refused: $said"
[[ $said = *"7 sources on pl_ps_irq0"* && $said != *HP3* ]] || fail "half: $said"
generate high --memory 0x840000000+1G
said=$(mock tools/vivado/build.tcl -rtl "$folder/high" -until design) || fail "another memory: $said"
fences DDR_HIGH '0x0840000000 \+ 0x40000000' "$said"
for file in zynq-pgs.bit zynq-pgs.bif zynq-pgs.xsa timing.rpt utilization.rpt; do
	[ -e "$folder/out/$file" ] || fail "no $file"
done
grep -q -x 'all: { \[destination_device = pl\] zynq-pgs.bit }' "$folder/out/zynq-pgs.bif" || fail "zynq-pgs.bif is not what bootgen reads"
said=$(mock tools/vivado/build.tcl --clock-khz 250000 -until design) || fail "another clock: $said"
[[ $said = *"warning: the clock is 250000 kHz and CLOCK_KHZ says 275000"* ]] || fail "no warning: $said"
said=$(MOCK_VERSION=2019.2 mock tools/vivado/build.tcl -until design) || fail "another version: $said"
[[ $said = *"warning: this is Vivado 2019.2"* ]] || fail "no warning: $said"
said=$(mock tools/vivado/build.tcl -help) || fail "-help: $said"
[[ $said = usage:* ]] || fail "-help: $said"

# A design that misses its timing makes no bitstream without `-negative-slack allow`.
rm "$folder"/out/zynq-pgs.*
export MOCK_SLACK=-0.05
refused "timing" "misses its timing" tools/vivado/build.tcl
[ ! -e "$folder/out/zynq-pgs.bit" ] || fail "a bitstream although the timing is missed"
mock tools/vivado/build.tcl -negative-slack allow >/dev/null || fail "-negative-slack allow"
[ -e "$folder/out/zynq-pgs.bit" ] || fail "no bitstream although it is asked for"
unset MOCK_SLACK

refused "an unknown option" "no option -clock" tools/vivado/build.tcl -clock 250
refused "an unknown board" "-board is one of: zcu102 kv260 zcu104" tools/vivado/build.tcl -board zcu106
refused "a slow clock" "slower than the clock of the registers" tools/vivado/build.tcl -clock-khz 90000
for board in "${!largest[@]}"; do
	refused "the default build on $board" "rtlgen generate ${largest[$board]} is the largest" tools/vivado/build.tcl -board "$board"
	refused "world inertia on $board" "rtlgen generate ${world[$board]} is the largest" tools/vivado/build.tcl -board "$board" -rtl "$folder/world"
	refused "half on $board" "rtlgen generate ${half[$board]} is the largest" tools/vivado/build.tcl -board "$board" -rtl "$folder/half"
	grep -q -e "${largest[$board]}.*${world[$board]}.*${half[$board]}" docs/to-a-board.md || fail "docs/to-a-board.md has other builds for $board"
done
generate high104 --memory 0x840000000+1G --bodies 4096 --collisions 16384
refused "memory that the board does not have" "the zcu104 has no DDR_HIGH" tools/vivado/build.tcl -board zcu104 -rtl "$folder/high104"
refused "no Verilog" "rtlgen -- generate" tools/vivado/build.tcl -rtl "$folder/nowhere"

script=build.tcl
# shellcheck disable=SC2016 # Tcl's dollars, not the shell's
{
	plant "a stream twice" $script 's|accelerator/s${k}_axis|accelerator/s0_axis|' \
		"accelerator/s0_axis is connected twice"
	plant "a missing interrupt" $script '/wire dma$k\/s2mm_introut/d' "dma0/s2mm_introut hangs"
	plant "an interrupt that is not passed on" pgs_interrupts.v 's/ | s2mm3//' "not the OR of all inputs"
	plant "the interrupt nowhere" $script '/wire interrupts\/irq/d' "hangs"
	plant "a wrong address of a core" $script 's/$pgs(dma_addresses) $k/$pgs(dma_addresses) 1/' \
		"dma0/S_AXI_LITE/Reg at offset 0xA0010000, the interface at 0xA0000000"
	plant "a wrong length of the registers" $script 's/$pgs(control_address) $pgs(control_bytes)/$pgs(control_address) $pgs(dma_bytes)/' \
		"accelerator/s_axi/reg0 at range 0x10000, the interface at 0x1000"
	plant "a master without memory" $script 's|list dma$k/Data_SG |list |' "dma0/Data_SG reaches processor/SAXIGP2/HP0_QSPI"
	plant "a second segment" $script 's|^\tplace $space ${port}_$pgs(memory_segment).*|&; place $space ${port}_DDR_HIGH 0x800000000 0x80000000|' \
		"dma0/Data_MM2S has a second segment, processor/SAXIGP2/HP0_DDR_HIGH"
	plant "all of the low memory" $script 's/{\*}$pgs(memory)/0 0x80000000/' \
		"HP0_DDR_LOW at offset 0x0, the interface at 0x50000000"
	plant "twice the memory" $script 's/{\*}$pgs(memory)/[lindex $pgs(memory) 0] 0x8000000/' \
		"HP0_DDR_LOW at range 0x8000000, the interface at 0x4000000"
	plant "memory beyond the end of its part" $script 's/{\*}$pgs(memory)/0x7FF00000 0x4000000/' "begins at 0x0 and has 0x80000000 bytes"
	for board in zcu102 kv260 zcu104; do
		for part in PCIE_LOW PCIE_HIGH1 PCIE_HIGH2 QSPI LPS_OCM DDR_HIGH; do
			[ "$board-$part" != zcu104-DDR_HIGH ] || continue
			plant "$part within reach on $board" $script "s/if {\[string match \*_\$pgs(memory_segment) \$found\]/& || [string match *_$part \$found]/" \
				"HP0_$part, which is not excluded" -board "$board" -rtl "$folder/$board"
		done
		plant "secure accesses on $board" $script '/wire non_secure/d' "processor/saxigp2_arprot is driven by the bus" \
			-board "$board" -rtl "$folder/$board"
		plant "another board's files on $board" $script "/^\t$board /s/files [a-z0-9_]*/files zc706/" "no board files named zc706" \
			-board "$board" -rtl "$folder/$board"
		plant "an unknown device on $board" $script "/^\t$board /s/part x[a-z]*[0-9]*/part xczu3/" "no device" \
			-board "$board" -rtl "$folder/$board"
	done
	plant "secure writes" $script 's| processor/saxigp${gp}_awprot||' "processor/saxigp2_awprot is driven by the bus"
	plant "a constant that says secure" $script 's/CONST_VAL 2/CONST_VAL 5/' "is 5, which says secure"
	plant "a hanging pin" $script '/wire clock\/locked/d' "reset/dcm_locked hangs"
	plant "two drivers" $script 's|^\twire clock/locked|\twire processor/pl_clk0 reset/slowest_sync_clk\n&|' \
		"reset/slowest_sync_clk has two drivers"
	plant "a bus without an end" $script '/link dma$k\/M_AXI_SG/d' "hangs: a bus without its other end"
	plant "two masters" $script 's|link dma$k/M_AXI_SG memory$k/S00_AXI|link dma$k/M_AXI_SG memory$k/M00_AXI|' \
		"are both masters"
	plant "a memory bus at a stream" $script 's|link dma$k/M_AXIS_MM2S|link dma$k/M_AXI_SG|' \
		"dma0/M_AXI_SG is a memory bus, accelerator/s0_axis a stream bus"
	plant "a narrow stream" $script 's/c_m_axis_mm2s_tdata_width $in/c_m_axis_mm2s_tdata_width 64/' \
		"has 64 bits, accelerator/s0_axis has 128"
	plant "channels that are swapped" $script 's|link accelerator/m${k}_axis|link accelerator/m[expr {$k ^ 1}]_axis|' \
		"accelerator/m0_axis goes to dma1/S_AXIS_S2MM"
	plant "another length register" $script 's/c_sg_length_width $pgs(dma_length_bits)/c_sg_length_width 23/' \
		"c_sg_length_width is 23, not 26"
	plant "a parameter that is misspelt" $script 's/c_addr_width/c_address_width/' "axi_dma has no parameter"
	plant "a second clock" $script 's|clocked memory$k aclk|wire processor/pl_clk0 memory$k/aclk; clocked memory$k {}|' \
		"dma0/M_AXI_MM2S runs on clock/clk_out1, memory0/S01_AXI on processor/pl_clk0"
	plant "registers on one clock alone" $script 's/slowly_clocked registers aclk aresetn/clocked registers aclk aresetn/' \
		"dma0/S_AXI_LITE runs on processor/pl_clk0, registers/M00_AXI on clock/clk_out1"
	plant "no crossing to the accelerator" $script 's/ NUM_CLKS 2//; /clocked registers aclk1/d' \
		"accelerator/s_axi runs on clock/clk_out1, registers/M04_AXI on processor/pl_clk0"
	plant "a DMA core with the other reset" $script 's/s_axi_lite_aclk axi_resetn/s_axi_lite_aclk {}/; s/m_axi_s2mm_aclk} {}/m_axi_s2mm_aclk} axi_resetn/' \
		"dma0/axi_resetn has the reset of clock/clk_out1, dma0/s_axi_lite_aclk is on processor/pl_clk0"
	plant "a reset that does not wait" $script 's| slow_reset/dcm_locked||' "slow_reset/dcm_locked hangs"
	plant "longer bursts" $script 's/c_mm2s_burst_size 16/c_mm2s_burst_size 256/' "c_mm2s_burst_size is 256, not 16"
	plant "a wrong rate" $script 's/$khz \/ 1000.0/$khz \/ 1001.0/' "not 275000"
	plant "another PL clock" $script 's/__FREQMHZ $pgs(pl_clock_mhz)/__FREQMHZ 275/' \
		"pl_clk0 is 275 MHz, and USR_ACCESS asks for 100"
	plant "no word for the loader" $script '/-fileset constrs_1/d' "USR_ACCESS of the bitstream is ''"
	plant "the word of another rate" $script 's/USR_ACCESS $pgs(usr_access)/USR_ACCESS $pgs(pl_clock_mhz)/' \
		"USR_ACCESS of the bitstream is '100', not 0x50470064"
	plant "a port without its clock" $script 's/PSU__USE__M_AXI_GP1 0/PSU__USE__M_AXI_GP1 1/' \
		"processor/maxihpm1_fpd_aclk hangs"
	plant "a module that is missing" $script 's/foreach module $modules/foreach module [lrange $modules 1 end]/' \
		"uses pgs_fadd, which is not in the project"
	plant "a header that is missing" $script 's/-directory $rtl \*.vh/-directory $rtl pgs_o*.vh/' \
		"which is not in the project"
	plant "a design that is not validated" $script '/^\tvalidate_bd_design/d' "before it is valid"
}
# The script counts the blocks of the Verilog, but for the FIFOs of the results.
for build in rtl world half kv260 zcu104; do
	command -v yosys >/dev/null || break
	yosys -q -p "read_verilog -I$folder/$build $(sed "s|^|$folder/$build/|" "$folder/$build/pgs.f" | tr '\n' ' ')
		blackbox pgs_solver; hierarchy -top pgs_top; proc; write_json $folder/memories.json" >"$folder/log" 2>&1 || fail "Yosys on $build: $(tail -n 3 "$folder/log")"
	counted=$(python3 tools/scripts/rtl_memories.py "$folder/memories.json" | awk -F '[|* ]+' '/sum/ { total = $3 } /^. rows/ { rows = $7 } END { print total - rows }')
	said=$(mock tools/vivado/build.tcl -rtl "$folder/$build" -until design | sed -n 's/^block RAM: \([0-9.]*\)\.0 .*/\1/p; s/^block RAM: \([0-9]*\.5\) .*/\1/p')
	[ "$said" = "$counted" ] || fail "$build: the script counts $said blocks of RAM, the Verilog has $counted"
	echo "$build: $counted blocks of RAM in the large memories, by the script and by the Verilog"
done
echo "$planted mistakes refused, each with its name"
