# The accelerator on a ZCU102, KV260 or ZCU104: from the generated Verilog to a bitstream, with Vivado.
#
# THIS SCRIPT WAS NEVER RUN WITH VIVADO: none was at hand. tools/vivado/mock.tcl runs it in tclsh and checks
# the structure of the block design. Its commands stand in UG835 of 2022.1 to 2024.1; no version was tried.
# Names of parameters and pins of Vivado's IP come from their documentation and from public designs;
# docs/to-a-board.md lists what only Vivado can tell.
#
#   vivado -mode batch -source tools/vivado/build.tcl -tclargs [OPTION VALUE]...
#
#                    one SmartConnect
#   HPM0_FPD ---------> registers -----> S_AXI_LITE of dma0..dma3, s_axi of the accelerator
#   HP0..HP3 <--------- memory0..3 <---- SG, MM2S and S2MM of dma0..dma3: one segment a master, the fence
#                                        dma0..dma3 <===> s0_axis..s3_axis, m0_axis..m3_axis
#                                        (a profile with three streams has no dma3, memory3, HP3)
#   pl_ps_irq0[0] <---- interrupts <---- both channels of dma0..dma3, the accelerator
#   pl_clk0 (100 MHz) -+--------------> registers: HPM0_FPD, their SmartConnect, S_AXI_LITE of dma0..dma3
#                      +-> clock (MMCM) -> everything else, with the registers of the accelerator
#
# The design has no pin of the board: the clocks' constraints come with the IP. The one constraint file sets
# the word of the bitstream that tells its loader the rate of pl_clk0.

# A namespace of its own, because Vivado has commands of many names.
namespace eval build {}

# The boards: device, name of the board files that have the processing system's preset, parts of the DDR that
# this preset has, LUTs and blocks of RAM of 36 kbit (DS891, DS987). The ports are the same on all.
set build::boards {
	zcu102 {part xczu9eg-ffvb1156-2-e files zcu102 ddr {DDR_LOW DDR_HIGH} luts 274080 blocks 912}
	kv260 {part xck26-sfvc784-2LV-c files kv260_som ddr {DDR_LOW DDR_HIGH} luts 117120 blocks 144}
	zcu104 {part xczu7ev-ffvc1156-2-e files zcu104 ddr DDR_LOW luts 230400 blocks 312}
}
# Years of the versions of Vivado whose commands were read.
set build::years {2022 2023 2024}
# Blocks beside the large memories: 16 in the FIFOs of the results and 6.5 in tables, by rtl-resources.sh, and 32
# for the DMA cores, by estimate.
set build::blocks_beside 54.5

proc build::usage {} {
	return {usage: vivado -mode batch -source tools/vivado/build.tcl -tclargs [OPTION VALUE]...

  -board NAME           zcu102, kv260 or zcu104 (zcu102)
  -rtl FOLDER           the Verilog, as `rtlgen generate --out FOLDER` writes it (rtl)
  -out FOLDER           reports, bitstream and hardware platform (vivado-out)
  -jobs NUMBER          processes that Vivado may use (4)
  -clock-khz KHZ        clock of the logic; by default the one that CLOCK_KHZ of the design reports
  -until STEP           stop after "design", "synthesis" or "route" ("bitstream": go on to the end)
  -strategy NAME        of the implementation (Performance_ExplorePostRoutePhysOpt); for a design that misses its
                        timing also Performance_NetDelay_high, Performance_ExtraTimingOpt, Congestion_SpreadLogic_high
  -negative-slack WHAT  "refuse" to write a bitstream that misses its timing, or "allow" it (refuse)
  -help                 this text}
}

# The values of the options.
proc build::options {arguments} {
	variable boards
	set options [dict create -board zcu102 -rtl rtl -out vivado-out -jobs 4 -clock-khz {} -until bitstream \
		-strategy Performance_ExplorePostRoutePhysOpt -negative-slack refuse]
	foreach {name value} $arguments {
		# Options with two dashes do as well.
		regsub {^--} $name - name
		if {![dict exists $options $name]} { error "no option $name; -help lists them" }
		if {$value eq ""} { error "$name has no value" }
		dict set options $name $value
	}
	foreach {name values} [list -board [dict keys $boards] -until {design synthesis route bitstream} \
		-negative-slack {refuse allow}] {
		if {[dict get $options $name] ni $values} { error "$name is one of: $values" }
	}
	foreach name {-jobs -clock-khz} {
		set value [dict get $options $name]
		if {$value ne "" && (![string is integer -strict $value] || $value <= 0)} {
			error "$name is a whole number, not $value"
		}
	}
	return $options
}

# The numbers of the design, which rtlgen writes beside the Verilog: the array `pgs`.
proc build::read_numbers {rtl} {
	global pgs
	set file [file join $rtl pgs_vivado.tcl]
	if {![file exists $file]} {
		error "no $file: cargo run --release -p rtlgen -- generate --out $rtl"
	}
	uplevel #0 [list source $file]
	# pgs_interrupts.v and the memory ports are for four cores.
	if {[llength $pgs(dma_addresses)] > 4} { error "this script wires four AXI DMAs at most" }
	if {$pgs(interrupt_bit) != 0} { error "this script wires bit 0 of pl_ps_irq0" }
}

# Blocks of a memory: pgs_true_dual_port.v lays nines of bits into tiles of 4,096 words and the rest into the
# deepest tiles that hold it. A tile of half the depth is half a block.
proc build::blocks {words bits} {
	set depth [lindex {4096 32768 16384 8192 8192 4096 4096 4096 4096} [expr {$bits % 9}]]
	set sum 0
	foreach lanes [list [expr {$bits / 9}] [expr {$bits % 9 > 0}]] depth [list 4096 $depth] {
		set tiles [expr {2 * $words <= $depth ? 0.5 : ceil(double($words) / $depth)}]
		set sum [expr {$sum + $lanes * $tiles}]
	}
	return $sum
}

# Blocks of all large memories for these numbers of bodies and collisions. A bank has half the bodies.
proc build::blocks_for {bodies collisions} {
	global pgs
	set bank [expr {($bodies + 1) / 2}]
	set sum 0
	foreach memory $pgs(memories) {
		lassign $memory words bits
		set sum [expr {$sum + [blocks [set $words] $bits]}]
	}
	return $sum
}

# Refuses a build that the board's device or memory cannot hold. LUTs are not refused: Vivado packs them
# otherwise than the tool that counted them.
proc build::check_board {name board} {
	global pgs
	variable blocks_beside
	dict with board {
		puts "board: $name, $part, $luts LUTs, $blocks blocks of RAM; docs/to-a-board.md has the count of LUTs"
		if {$pgs(memory_segment) ni $ddr} {
			error "the $name has no $pgs(memory_segment) in its preset: rtlgen generate --memory, below 2 GiB"
		}
		set room [expr {$blocks - $blocks_beside}]
	}
	set needed [blocks_for $pgs(bodies) $pgs(collisions)]
	puts "block RAM: $needed in the large memories, and $room are free for them"
	if {$needed <= $room} return
	# About the same share of bodies, in whole tiles, and as many collisions as fit.
	for {set collisions $pgs(collisions)} {$collisions > 0} {incr collisions -4096} {
		set bodies [expr {max(1, $pgs(bodies) * $collisions / $pgs(collisions) / 4096) * 4096}]
		if {[blocks_for $bodies $collisions] <= $room} break
	}
	error "the memories take $needed blocks of RAM, and the $name has $room for them: rtlgen generate\
		--bodies $bodies --collisions $collisions is the largest build of about the same share that fits"
}

# Warns of a version that nobody has read the commands of.
proc build::check_version {} {
	variable years
	set version [version -short]
	if {[lindex [split $version .] 0] ni $years} {
		puts "warning: this is Vivado $version; the commands of this script were read for [join $years {, }]"
	}
}

# ---------------------------------------------------------------------------------------------------------
# Shorthand

# Adds an IP in the newest version that this Vivado has.
proc build::add_ip {name cell {parameters {}}} {
	set found [get_ipdefs -all -filter "VLNV =~ xilinx.com:ip:$name:* && UPGRADE_VERSIONS == \"\""]
	if {[llength $found] != 1} { error "this Vivado has [llength $found] IPs named $name: $found" }
	create_bd_cell -type ip -vlnv $found $cell
	configure $cell $parameters
}

proc build::configure {cell parameters} {
	set properties {}
	foreach {name value} $parameters { lappend properties CONFIG.$name $value }
	if {[llength $properties] > 0} { set_property -dict $properties [get_bd_cells $cell] }
}

# Connects an output with inputs.
proc build::wire {from args} {
	set pins [list [get_bd_pins $from]]
	foreach pin $args { lappend pins [get_bd_pins $pin] }
	connect_bd_net {*}$pins
}

# Connects a master with a slave.
proc build::link {master slave} {
	connect_bd_intf_net [get_bd_intf_pins $master] [get_bd_intf_pins $slave]
}

# Puts these clock pins on the clock of the logic, and these reset pins on its reset.
proc build::clocked {cell clocks resets} {
	foreach pin $clocks { wire clock/clk_out1 $cell/$pin }
	foreach pin $resets { wire reset/peripheral_aresetn $cell/$pin }
}

# The same with the clock of the registers.
proc build::slowly_clocked {cell clocks resets} {
	foreach pin $clocks { wire processor/pl_clk0 $cell/$pin }
	foreach pin $resets { wire slow_reset/peripheral_aresetn $cell/$pin }
}

# The one segment of this name.
proc build::segment {pattern} {
	set found [get_bd_addr_segs $pattern]
	if {[llength $found] != 1} { error "[llength $found] address segments are $pattern: $found" }
	return $found
}

proc build::place {space segment offset range} {
	assign_bd_address -offset $offset -range $range -target_address_space [get_bd_addr_spaces $space] \
		[segment $segment]
}

# ---------------------------------------------------------------------------------------------------------
# The block design

proc build::add_processor {} {
	global pgs
	add_ip zynq_ultra_ps_e processor
	apply_bd_automation -rule xilinx.com:bd_rule:zynq_ultra_ps_e -config {apply_board_preset "1"} \
		[get_bd_cells processor]
	# M_AXI_GP0 is M_AXI_HPM0_FPD. S_AXI_GP2 to 5 are S_AXI_HP0_FPD to HP3. The node pgs-ports of the
	# overlays sets the same widths.
	configure processor {
		PSU__USE__M_AXI_GP0 1 PSU__USE__M_AXI_GP1 0 PSU__USE__M_AXI_GP2 0
		PSU__MAXIGP0__DATA_WIDTH 128
		PSU__USE__IRQ0 1
		PSU__FPGA_PL0_ENABLE 1
	}
	configure processor [list PSU__CRL_APB__PL0_REF_CTRL__FREQMHZ $pgs(pl_clock_mhz)]
	for {set gp 2} {$gp < [llength $pgs(dma_addresses)] + 2} {incr gp} {
		configure processor [list PSU__USE__S_AXI_GP$gp 1 PSU__SAXIGP${gp}__DATA_WIDTH 128]
	}
}

# The PLLs of the processing system of the board's preset do not make 275 MHz. An MMCM makes the clock from
# 100 MHz, which they do make. Both resets wait for it.
proc build::add_clock {khz} {
	add_ip clk_wiz clock [list PRIM_SOURCE No_buffer CLKOUT1_REQUESTED_OUT_FREQ [expr {$khz / 1000.0}] \
		USE_LOCKED true USE_RESET true RESET_TYPE ACTIVE_LOW]
	add_ip proc_sys_reset reset
	add_ip proc_sys_reset slow_reset
	wire processor/pl_clk0 clock/clk_in1
	wire processor/pl_resetn0 clock/resetn reset/ext_reset_in slow_reset/ext_reset_in
	wire clock/locked reset/dcm_locked slow_reset/dcm_locked
	clocked reset slowest_sync_clk {}
	slowly_clocked slow_reset slowest_sync_clk {}
}

proc build::add_accelerator {} {
	global pgs
	create_bd_cell -type module -reference $pgs(top) accelerator
	clocked accelerator aclk aresetn
	create_bd_cell -type module -reference pgs_interrupts interrupts
	wire accelerator/irq interrupts/accelerator
	wire interrupts/irq processor/pl_ps_irq0
}

# The registers: all slaves behind one SmartConnect, which crosses to the clock of the accelerator. The DMA cores
# cross themselves: their S_AXI_LITE may be slower than their one other clock (PG021, synchronous mode).
proc build::add_registers {} {
	global pgs
	set cores [llength $pgs(dma_addresses)]
	add_ip smartconnect registers [list NUM_SI 1 NUM_MI [expr {$cores + 1}] NUM_CLKS 2]
	slowly_clocked registers aclk aresetn
	clocked registers aclk1 {}
	slowly_clocked processor maxihpm0_fpd_aclk {}
	link processor/M_AXI_HPM0_FPD registers/S00_AXI
	for {set k 0} {$k < $cores} {incr k} { link registers/M0${k}_AXI dma$k/S_AXI_LITE }
	link registers/M0${cores}_AXI accelerator/s_axi
	for {set k 0} {$k < $cores} {incr k} {
		place processor/Data dma$k/S_AXI_LITE/* [lindex $pgs(dma_addresses) $k] $pgs(dma_bytes)
	}
	place processor/Data accelerator/s_axi/* $pgs(control_address) $pgs(control_bytes)
}

# One address segment for a master, the memory that the device tree reserves. Everything else at its port is
# excluded, whatever this version of the processing system calls it.
proc build::fence {space port} {
	global pgs
	place $space ${port}_$pgs(memory_segment) {*}$pgs(memory)
	foreach found [get_bd_addr_segs ${port}_*] {
		if {[string match *_$pgs(memory_segment) $found]} continue
		exclude_bd_addr_seg -target_address_space [get_bd_addr_spaces $space] $found
	}
}

# AXI DMA k with stream k of the accelerator in both directions, and its three masters at port HP k.
#
# Bursts have 16 beats: inside the port the bus is AXI3, which has no longer ones, and eight of them fill its
# FIFO of 128 beats (UG1085). Longer bursts would be cut there, and take more block RAM of the core.
proc build::add_dma {k} {
	global pgs
	set in [lindex $pgs(mm2s_stream_bits) $k]
	set out [lindex $pgs(s2mm_stream_bits) $k]
	add_ip axi_dma dma$k [list c_include_sg 1 c_sg_include_stscntrl_strm 0 c_micro_dma 0 \
		c_sg_length_width $pgs(dma_length_bits) c_addr_width $pgs(dma_address_bits) \
		c_include_mm2s 1 c_m_axi_mm2s_data_width 128 c_m_axis_mm2s_tdata_width $in \
		c_include_mm2s_dre 0 c_mm2s_burst_size 16 \
		c_include_s2mm 1 c_m_axi_s2mm_data_width 128 c_s_axis_s2mm_tdata_width $out \
		c_include_s2mm_dre 0 c_s2mm_burst_size 16]
	slowly_clocked dma$k s_axi_lite_aclk axi_resetn
	clocked dma$k {m_axi_sg_aclk m_axi_mm2s_aclk m_axi_s2mm_aclk} {}
	link dma$k/M_AXIS_MM2S accelerator/s${k}_axis
	link accelerator/m${k}_axis dma$k/S_AXIS_S2MM
	wire dma$k/mm2s_introut interrupts/mm2s$k
	wire dma$k/s2mm_introut interrupts/s2mm$k

	add_ip smartconnect memory$k {NUM_SI 3 NUM_MI 1}
	clocked memory$k aclk aresetn
	clocked processor saxihp${k}_fpd_aclk {}
	link dma$k/M_AXI_SG memory$k/S00_AXI
	link dma$k/M_AXI_MM2S memory$k/S01_AXI
	link dma$k/M_AXI_S2MM memory$k/S02_AXI
	link memory$k/M00_AXI processor/S_AXI_HP${k}_FPD
	set gp [expr {$k + 2}]
	foreach space [list dma$k/Data_SG dma$k/Data_MM2S dma$k/Data_S2MM] { fence $space processor/SAXIGP$gp/HP$k }
	# Non-secure: the AXI DMA drives AxPROT with 000, secure, which an SMMU lets pass untranslated.
	wire non_secure/dout processor/saxigp${gp}_arprot processor/saxigp${gp}_awprot
}

proc build::build_design {khz} {
	global pgs
	create_bd_design pgs
	add_processor
	add_clock $khz
	add_accelerator
	# AxPROT[1]
	add_ip xlconstant non_secure {CONST_WIDTH 3 CONST_VAL 2}
	for {set k 0} {$k < [llength $pgs(dma_addresses)]} {incr k} { add_dma $k }
	if {$k < 4} { add_ip xlconstant no_interrupt {CONST_WIDTH 1 CONST_VAL 0} }
	for {} {$k < 4} {incr k} { wire no_interrupt/dout interrupts/mm2s$k interrupts/s2mm$k }
	add_registers
	validate_bd_design
	check_fences
	save_bd_design
}

# What Vivado has made of it: every master of a DMA core has the one segment, where the bitstream reports it.
proc build::check_fences {} {
	global pgs
	lassign $pgs(memory) base bytes
	for {set k 0} {$k < [llength $pgs(dma_addresses)]} {incr k} {
		foreach master {SG MM2S S2MM} {
			set space dma$k/Data_$master
			set found [get_bd_addr_segs -of_objects [get_bd_addr_spaces $space]]
			if {[llength $found] != 1} { error "$space has [llength $found] segments, not one: $found" }
			set offset [get_property OFFSET $found]
			set range [get_property RANGE $found]
			if {$offset != $base || $range != $bytes} {
				error "$space has $found at $offset + $range, not at $base + $bytes"
			}
		}
	}
}

# ---------------------------------------------------------------------------------------------------------
# The project, from the Verilog to the files for the board

proc build::open_project_with {board rtl out here} {
	global pgs
	create_project -force pgs [file join $out project] -part [dict get $board part]
	set name [dict get $board files]
	set found [get_board_parts -quiet xilinx.com:$name:part0:*]
	if {[llength $found] == 0} {
		error "this Vivado has no board files named $name; newer ones install them apart:\
			xhub::refresh_catalog \[xhub::get_xstores xilinx_board_store\];\
			xhub::install \[xhub::get_xitems *$name*\]"
	}
	set_property board_part [lindex [lsort -dictionary $found] end] [current_project]
	set list [open [file join $rtl pgs.f]]
	set modules [split [string trim [read $list]] \n]
	close $list
	foreach module $modules { add_files -norecurse [file join $rtl $module] }
	foreach header [lsort [glob -directory $rtl *.vh]] {
		add_files -norecurse $header
		set_property file_type {Verilog Header} [get_files [file tail $header]]
	}
	add_files -norecurse [file join $here pgs_interrupts.v]
	# `pgs load` holds this word against the overlay.
	set constraints [file join $out usr_access.xdc]
	set file [open $constraints w]
	puts $file "set_property BITSTREAM.CONFIG.USR_ACCESS $pgs(usr_access) \[current_design\]"
	close $file
	add_files -fileset constrs_1 -norecurse $constraints
	update_compile_order -fileset sources_1
}

# Runs a step to its end.
proc build::run_to_end {name args} {
	launch_runs $name {*}$args
	wait_on_run $name
	if {[get_property PROGRESS [get_runs $name]] ne "100%"} {
		error "$name: [get_property STATUS [get_runs $name]]"
	}
}

proc build::report_route {out} {
	open_run impl_1
	report_timing_summary -max_paths 20 -file [file join $out timing.rpt]
	report_high_fanout_nets -timing -max_nets 50 -file [file join $out fanout.rpt]
	report_utilization -file [file join $out utilization.rpt]
	report_utilization -hierarchical -file [file join $out utilization-hierarchical.rpt]
	report_ram_utilization -file [file join $out ram.rpt]
	report_cdc -file [file join $out crossings.rpt]
	report_methodology -file [file join $out methodology.rpt]
}

# Writes what bootgen reads, and says what to do with it.
proc build::write_bif {out} {
	set file [open [file join $out zynq-pgs.bif] w]
	puts $file "all: { \[destination_device = pl\] zynq-pgs.bit }"
	close $file
	puts "next: cd $out && bootgen -image zynq-pgs.bif -arch zynqmp -process_bitstream bin -w"
	puts "which makes zynq-pgs.bit.bin; docs/to-a-board.md goes on from there"
}

# Everything. `here` is the folder of this script.
proc build::main {arguments here} {
	global pgs
	variable boards
	foreach help {-h -help --help} {
		if {$help in $arguments} {
			puts [usage]
			return
		}
	}
	set options [options $arguments]
	set rtl [file normalize [dict get $options -rtl]]
	set out [file normalize [dict get $options -out]]
	set jobs [dict get $options -jobs]
	set until [dict get $options -until]
	read_numbers $rtl
	check_version
	set board [dict get $boards [dict get $options -board]]
	check_board [dict get $options -board] $board
	set khz [dict get $options -clock-khz]
	if {$khz eq ""} { set khz $pgs(clock_khz) }
	if {$khz != $pgs(clock_khz)} {
		puts "warning: the clock is $khz kHz and CLOCK_KHZ says $pgs(clock_khz): rtlgen generate --clock-khz $khz"
	}
	if {$khz < 1000 * $pgs(pl_clock_mhz)} {
		error "$khz kHz is slower than the clock of the registers, which the DMA cores do not take (PG021)"
	}
	file mkdir $out
	open_project_with $board $rtl $out $here
	build_design $khz
	if {$until eq "design"} { return }

	make_wrapper -files [get_files pgs.bd] -top -import
	set_property top pgs_wrapper [current_fileset]
	run_to_end synth_1 -jobs $jobs
	open_run synth_1
	report_utilization -file [file join $out utilization-synthesis.rpt]
	close_design
	if {$until eq "synthesis"} { return }

	set_property strategy [dict get $options -strategy] [get_runs impl_1]
	run_to_end impl_1 -jobs $jobs
	report_route $out
	set setup [get_property STATS.WNS [get_runs impl_1]]
	set hold [get_property STATS.WHS [get_runs impl_1]]
	puts "slack at $khz kHz: $setup ns setup, $hold ns hold; [file join $out timing.rpt]"
	if {$until eq "route"} { return }
	if {($setup < 0 || $hold < 0) && [dict get $options -negative-slack] eq "refuse"} {
		error "the design misses its timing, and would miscalculate without a word; see docs/to-a-board.md"
	}

	run_to_end impl_1 -to_step write_bitstream -jobs $jobs
	file copy -force [file join [get_property DIRECTORY [get_runs impl_1]] pgs_wrapper.bit] \
		[file join $out zynq-pgs.bit]
	write_hw_platform -fixed -include_bit -force -file [file join $out zynq-pgs.xsa]
	write_bif $out
}

build::main $argv [file dirname [file normalize [info script]]]
