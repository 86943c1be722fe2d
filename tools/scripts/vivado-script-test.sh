#!/usr/bin/env bash
# Runs the Vivado script tools/vivado/zcu102.tcl on the generated Verilog with a stand-in for Vivado's
# commands, tools/vivado/mock.tcl: the block design must be accepted, and with planted mistakes refused.
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
attend "$target_root/debug/rtlgen" generate --out "$folder/rtl"

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

# Changes one of the two files by a sed expression, and expects the result to be refused.
plant() {
	local what=$1 file=$2 change=$3 expected=$4
	cp tools/vivado/zcu102.tcl tools/vivado/pgs_interrupts.v "$folder"
	sed -i "$change" "$folder/$file"
	! cmp -s "$folder/$file" "tools/vivado/$file" || fail "$what: nothing to change in $file"
	refused "$what" "$expected" "$folder/zcu102.tcl"
}

# As it is, with another clock, and without its ending: from the script to the files for the board.
# One segment for each of the 12 masters, at the memory that the device tree reserves, wherever that is.
fences() {
	local found
	found=$(grep -c -E "^address +dma[0-3]/Data_(SG|MM2S|S2MM) +processor/SAXIGP[2-5]/HP[0-3]_$1 +$2\$" <<<"$3")
	[ "$found" = 12 ] || fail "$found masters with the segment $1 at $2: $3"
}
said=$(mock tools/vivado/zcu102.tcl) || fail "the script is refused: $said"
echo "$said"
fences DDR_LOW '0x0050000000 \+ 0x4000000' "$said"
attend "$target_root/debug/rtlgen" generate --out "$folder/high" --memory 0x840000000+1G
said=$(mock tools/vivado/zcu102.tcl -rtl "$folder/high" -until design) || fail "another memory: $said"
fences DDR_HIGH '0x0840000000 \+ 0x40000000' "$said"
for file in zynq-pgs.bit zynq-pgs.bif zynq-pgs.xsa timing.rpt utilization.rpt; do
	[ -e "$folder/out/$file" ] || fail "no $file"
done
grep -q -x 'all: { \[destination_device = pl\] zynq-pgs.bit }' "$folder/out/zynq-pgs.bif" || fail "zynq-pgs.bif is not what bootgen reads"
said=$(mock tools/vivado/zcu102.tcl --clock-khz 250000 -until design) || fail "another clock: $said"
[[ $said = *"warning: the clock is 250000 kHz and CLOCK_KHZ says 275000"* ]] || fail "no warning: $said"
said=$(mock tools/vivado/zcu102.tcl -help) || fail "-help: $said"
[[ $said = usage:* ]] || fail "-help: $said"

# A design that misses its timing makes no bitstream without `-negative-slack allow`.
rm "$folder"/out/zynq-pgs.*
export MOCK_SLACK=-0.05
refused "timing" "misses its timing" tools/vivado/zcu102.tcl
[ ! -e "$folder/out/zynq-pgs.bit" ] || fail "a bitstream although the timing is missed"
mock tools/vivado/zcu102.tcl -negative-slack allow >/dev/null || fail "-negative-slack allow"
[ -e "$folder/out/zynq-pgs.bit" ] || fail "no bitstream although it is asked for"
unset MOCK_SLACK

refused "an unknown option" "no option -clock" tools/vivado/zcu102.tcl -clock 250
refused "no Verilog" "rtlgen -- generate" tools/vivado/zcu102.tcl -rtl "$folder/nowhere"

script=zcu102.tcl
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
	plant "a master without memory" $script 's|list dma$k/Data_SG |list |' "dma0/Data_SG reaches processor/SAXIGP2/HP0_DDR_HIGH"
	plant "a second segment" $script 's|^\tplace $space ${port}_$pgs(memory_segment).*|&; place $space ${port}_DDR_HIGH 0x800000000 0x80000000|' \
		"dma0/Data_MM2S has a second segment, processor/SAXIGP2/HP0_DDR_HIGH"
	plant "all of the low memory" $script 's/{\*}$pgs(memory)/0 0x80000000/' \
		"HP0_DDR_LOW at offset 0x0, the interface at 0x50000000"
	plant "twice the memory" $script 's/{\*}$pgs(memory)/[lindex $pgs(memory) 0] 0x8000000/' \
		"HP0_DDR_LOW at range 0x8000000, the interface at 0x4000000"
	plant "the flash within reach" $script 's/ QSPI / /' "HP0_QSPI, which is not excluded"
	plant "PCIe left in" $script 's/ PCIE_LOW / /' "HP0_PCIE_LOW, which is not excluded"
	plant "the high memory left in" $script 's/{DDR_LOW DDR_HIGH /{DDR_LOW /' "HP0_DDR_HIGH, which is not excluded"
	plant "secure accesses" $script '/wire non_secure/d' "processor/saxigp2_arprot is driven by the bus"
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
echo "$planted mistakes refused, each with its name"
