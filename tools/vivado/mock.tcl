# A stand-in for Vivado's commands, for tclsh: it runs tools/vivado/build.tcl and checks the structure of the
# block design that the script builds.
#
#   tclsh tools/vivado/mock.tcl SCRIPT [OPTION VALUE]...      the options are the script's
#
# It refuses, with the reason and exit code 1:
#   - a pin or a bus that does not exist, or a parameter that the IP does not have
#   - an input with two drivers or with none, a bus that is connected twice or not at all
#   - two masters, two slaves, a stream at a memory bus, different widths
#   - a clock pin without a clock, a bus between two clocks, a reset of another clock
#   - a channel of a DMA core at the wrong stream of the accelerator
#   - an interrupt that does not reach pl_ps_irq0
#   - a segment that is missing, superfluous, or not where the interface has it; for a master of a DMA core any
#     but the one of the fence, and any address of the chip's map that is not excluded
#   - a memory port that is not held non-secure (AxPROT[1])
#   - a DMA core, a port or a clock that is not built as the interface says
#   - a header or a module of the Verilog that is not in the project
#
# The pins and parameters of Vivado's IP in this file are a transcript by hand. That Vivado has them is not
# checked by anything here.
#
# environment: MOCK_SLACK, the slack that the implementation reports (0.1); MOCK_VERSION, of Vivado (2024.1)

proc refuse {message} {
	puts stderr "refused: $message"
	leave 1
}
proc leave {code} { exit $code }

# ---------------------------------------------------------------------------------------------------------
# The IP: parameters with the pattern of their values, pins, buses

# The boards by their device: the name of the board files, and the end of the DDR.
set boards {
	xczu9eg-ffvb1156-2-e {zcu102 0x880000000}
	xck26-sfvc784-2LV-c {kv260_som 0x880000000}
	xczu7ev-ffvc1156-2-e {zcu104 0x80000000}
}
# The targets of an access at a memory port of the processing system, as UG1085 maps the chip's addresses: the name
# in Vivado, first byte, bytes. The DDR ends where the board's does.
set address_map {
	DDR_LOW 0x0 0x80000000
	QSPI 0xC0000000 0x20000000
	PCIE_LOW 0xE0000000 0x10000000
	LPS_OCM 0xFF000000 0x1000000
	PCIE_HIGH1 0x600000000 0x200000000
	DDR_HIGH 0x800000000 0x80000000
	PCIE_HIGH2 0x8000000000 0x4000000000
}

# Parameters and their defaults. The processing system has the board's preset.
set parameters(zynq_ultra_ps_e) {
	PSU__USE__M_AXI_GP0 1 PSU__USE__M_AXI_GP1 1 PSU__USE__M_AXI_GP2 0
	PSU__MAXIGP0__DATA_WIDTH 128 PSU__MAXIGP1__DATA_WIDTH 128 PSU__MAXIGP2__DATA_WIDTH 32
	PSU__USE__S_AXI_GP2 0 PSU__USE__S_AXI_GP3 0 PSU__USE__S_AXI_GP4 0 PSU__USE__S_AXI_GP5 0
	PSU__SAXIGP2__DATA_WIDTH 128 PSU__SAXIGP3__DATA_WIDTH 128
	PSU__SAXIGP4__DATA_WIDTH 128 PSU__SAXIGP5__DATA_WIDTH 128
	PSU__USE__IRQ0 1 PSU__FPGA_PL0_ENABLE 1 PSU__CRL_APB__PL0_REF_CTRL__FREQMHZ 100
}
set parameters(clk_wiz) {
	PRIM_SOURCE Single_ended_clock_capable_pin CLKOUT1_REQUESTED_OUT_FREQ 100.0
	USE_LOCKED true USE_RESET true RESET_TYPE ACTIVE_HIGH
}
set parameters(proc_sys_reset) {}
set parameters(xlconstant) {CONST_WIDTH 1 CONST_VAL 1}
set parameters(smartconnect) {NUM_SI 2 NUM_MI 1 NUM_CLKS 1}
set parameters(axi_dma) {
	c_include_sg 1 c_sg_include_stscntrl_strm 1 c_micro_dma 0 c_sg_length_width 14 c_addr_width 32
	c_include_mm2s 1 c_m_axi_mm2s_data_width 32 c_m_axis_mm2s_tdata_width 32
	c_include_mm2s_dre 0 c_mm2s_burst_size 16
	c_include_s2mm 1 c_m_axi_s2mm_data_width 32 c_s_axis_s2mm_tdata_width 32
	c_include_s2mm_dre 0 c_s2mm_burst_size 16
}

# Pins of a cell: name {direction role bits [clock]}. Roles: clock, reset, interrupt, data. A reset without a clock
# belongs to all clocks of its cell.
# Buses of a cell: name {side protocol bits clocks}: one of these clocks.
proc shape:zynq_ultra_ps_e {cell} {
	set pins {pl_resetn0 {out reset 1}}
	set buses {}
	if {[value $cell PSU__FPGA_PL0_ENABLE]} { dict set pins pl_clk0 {out clock 1} }
	if {[value $cell PSU__USE__IRQ0]} { dict set pins pl_ps_irq0 {in interrupt 1} }
	foreach {number port} {0 hpm0_fpd 1 hpm1_fpd 2 hpm0_lpd} {
		if {[value $cell PSU__USE__M_AXI_GP$number]} {
			dict set pins maxi${port}_aclk {in clock 1}
			dict set buses M_AXI_[string toupper $port] \
				[list master memory [value $cell PSU__MAXIGP${number}__DATA_WIDTH] maxi${port}_aclk]
		}
	}
	foreach {number port} {2 hp0_fpd 3 hp1_fpd 4 hp2_fpd 5 hp3_fpd} {
		if {[value $cell PSU__USE__S_AXI_GP$number]} {
			dict set pins saxi${port}_aclk {in clock 1}
			# Signals of the bus. A net of their own takes the place of the bus's.
			dict set pins saxigp${number}_arprot {in overrides 3}
			dict set pins saxigp${number}_awprot {in overrides 3}
			dict set buses S_AXI_[string toupper $port] \
				[list slave memory [value $cell PSU__SAXIGP${number}__DATA_WIDTH] saxi${port}_aclk]
		}
	}
	return [list $pins $buses]
}
proc shape:clk_wiz {cell} {
	set pins {clk_in1 {in clock 1} clk_out1 {out clock 1}}
	if {[value $cell USE_LOCKED]} { dict set pins locked {out data 1} }
	if {[value $cell USE_RESET]} {
		set name [expr {[value $cell RESET_TYPE] eq "ACTIVE_LOW" ? "resetn" : "reset"}]
		dict set pins $name {in reset 1}
	}
	return [list $pins {}]
}
proc shape:xlconstant {cell} { return [list [list dout [list out data [value $cell CONST_WIDTH]]] {}] }
proc shape:proc_sys_reset {cell} {
	return {{
		slowest_sync_clk {in clock 1} ext_reset_in {in reset 1} dcm_locked {in data 1}
		peripheral_aresetn {out reset 1} interconnect_aresetn {out reset 1}
	} {}}
}
proc shape:smartconnect {cell} {
	set buses {}
	# It crosses between its clocks, and takes a reset of any of them.
	set pins {aclk {in clock 1} aresetn {in reset 1 aclk}}
	for {set k 1} {$k < [value $cell NUM_CLKS]} {incr k} { dict set pins aclk$k {in clock 1} }
	set clocks [lsearch -all -inline [dict keys $pins] aclk*]
	foreach {letter side} {S slave M master} {
		for {set k 0} {$k < [value $cell NUM_${letter}I]} {incr k} {
			# It converts widths: 0 stands for any.
			dict set buses [format %s%02d_AXI $letter $k] [list $side memory 0 $clocks]
		}
	}
	return [list $pins $buses]
}
proc shape:axi_dma {cell} {
	set mm2s [value $cell c_m_axi_mm2s_data_width]
	set s2mm [value $cell c_m_axi_s2mm_data_width]
	return [list {
		s_axi_lite_aclk {in clock 1} m_axi_sg_aclk {in clock 1}
		m_axi_mm2s_aclk {in clock 1} m_axi_s2mm_aclk {in clock 1}
		axi_resetn {in reset 1 s_axi_lite_aclk}
		mm2s_introut {out interrupt 1} s2mm_introut {out interrupt 1}
	} [list \
		S_AXI_LITE {slave memory 32 s_axi_lite_aclk} \
		M_AXI_SG {master memory 32 m_axi_sg_aclk} \
		M_AXI_MM2S [list master memory $mm2s m_axi_mm2s_aclk] \
		M_AXI_S2MM [list master memory $s2mm m_axi_s2mm_aclk] \
		M_AXIS_MM2S [list master stream [value $cell c_m_axis_mm2s_tdata_width] m_axi_mm2s_aclk] \
		S_AXIS_S2MM [list slave stream [value $cell c_s_axis_s2mm_tdata_width] m_axi_s2mm_aclk]]]
}

# Signals that a bus must have to be recognised by the names of its ports.
set signals(stream) {tdata tkeep tlast tvalid tready}
set signals(memory) {
	awaddr awprot awvalid awready wdata wstrb wvalid wready bresp bvalid bready
	araddr arprot arvalid arready rdata rresp rvalid rready
}

proc text_of {file} {
	set channel [open $file]
	set text [read $channel]
	close $channel
	return $text
}

# The ports of a module in Verilog as pins and buses, the way Vivado infers them.
proc shape_of_module {file} {
	global signals
	set text [regsub -all -line {//.*$} [text_of $file] {}]
	set module [file rootname [file tail $file]]
	set infos [regexp -all -inline {X_INTERFACE_INFO = "xilinx.com:signal:(\w+):1.0 (\w+) \w+"} $text]
	foreach {- role port} $infos { set roles($port) $role }
	set associated {}
	regexp {ASSOCIATED_BUSIF ([\w:]+)} $text - associated
	set associated [split $associated :]
	# Without attributes the ports stand between the first parentheses.
	set text [regsub -all {\(\*.*?\*\)} $text {}]
	if {![regexp "\\mmodule\\s+$module\\s*\\((\[^()\]*)\\)" $text - header]} {
		refuse "$file has no module $module"
	}
	set pins {}
	foreach port [split $header ,] {
		set port [string trim $port]
		if {[regexp {^(input|output)\s+wire\s*(?:\[(\d+):0\])?\s*(\w+)$} $port - way high name]} {
			set direction [string range $way 0 [expr {$way eq "input" ? 1 : 2}]]
			set bits [expr {$high eq "" ? 1 : $high + 1}]
		} elseif {[regexp {^\w+$} $port]} {
			set name $port
		} else {
			refuse "$file: a port that is not understood: $port"
		}
		if {[dict exists $pins $name]} { refuse "$file: port $name twice" }
		dict set pins $name [list $direction [expr {[info exists roles($name)] ? $roles($name) : "data"}] $bits]
	}
	set clocks [lmap {name pin} $pins { if {[lindex $pin 1] ne "clock"} continue; set name }]
	set buses {}
	foreach {name pin} $pins {
		if {![regexp {^(.*)_(tdata|wdata)$} $name - bus data]} continue
		set protocol [expr {$data eq "tdata" ? "stream" : "memory"}]
		set drives [expr {[lindex $pin 0] eq "out"}]
		dict set buses $bus [list [expr {$drives ? "master" : "slave"}] $protocol [lindex $pin 2] $clocks]
		if {$bus ni $associated} { refuse "$file: the clock of $bus is not named by ASSOCIATED_BUSIF" }
	}
	foreach {bus facts} $buses {
		foreach signal $signals([lindex $facts 1]) {
			if {![dict exists $pins ${bus}_$signal]} { refuse "$file: $bus has no $signal" }
			dict unset pins ${bus}_$signal
		}
	}
	foreach bus $associated {
		if {![dict exists $buses $bus]} { refuse "$file: ASSOCIATED_BUSIF names $bus, which is no bus" }
	}
	return [list $pins $buses]
}

# ---------------------------------------------------------------------------------------------------------
# The state

# cells: name -> kind. config: cell,parameter -> value. modules: file of a module's cell.
# driver: input pin -> output pin. peer: bus -> bus. assigned: {space segment} -> {offset range}.
array set cells {}
array set config {}
array set modules {}
array set driver {}
array set peer {}
array set assigned {}
set excluded {}
set files {}
set done {}
set bit_folder {}

proc value {cell parameter} { return $::config($cell,$parameter) }

# Pins and buses of a cell as it is configured now.
proc shape {cell} {
	global cells modules shapes
	if {![info exists cells($cell)]} { refuse "no cell $cell" }
	if {[info exists modules($cell)]} { return $shapes($cell) }
	return [shape:$cells($cell) $cell]
}
proc pin {name} {
	lassign [split $name /] cell pin
	set pins [lindex [shape $cell] 0]
	if {![dict exists $pins $pin]} { refuse "no pin $name" }
	return [dict get $pins $pin]
}
proc bus {name} {
	lassign [split $name /] cell bus
	set buses [lindex [shape $cell] 1]
	if {![dict exists $buses $bus]} { refuse "no bus $name" }
	return [dict get $buses $bus]
}
proc all {what} {
	global cells
	set found {}
	foreach cell [lsort [array names cells]] {
		foreach name [dict keys [lindex [shape $cell] [expr {$what eq "buses"}]]] { lappend found $cell/$name }
	}
	return $found
}
proc cells_of {kind} {
	return [lsort [lmap {cell of} [array get ::cells] { if {$of ne $kind} continue; set cell }]]
}
# The source of a clock or reset pin.
proc source_of {pin} { return [expr {[info exists ::driver($pin)] ? $::driver($pin) : "nothing"}] }

# The address spaces and segments, each with its bus.
proc spaces {} {
	set spaces {}
	foreach cell [cells_of zynq_ultra_ps_e] { dict set spaces $cell/Data $cell/M_AXI_HPM0_FPD }
	foreach cell [cells_of axi_dma] {
		foreach way {SG MM2S S2MM} { dict set spaces $cell/Data_$way $cell/M_AXI_$way }
	}
	return $spaces
}
proc segments {} {
	set segments {}
	foreach name [all buses] {
		lassign [split $name /] cell bus
		lassign [bus $name] side protocol
		if {$side ne "slave" || $protocol ne "memory"} continue
		switch $::cells($cell) {
			smartconnect {}
			axi_dma { dict set segments $name/Reg $name }
			zynq_ultra_ps_e {
				regexp {HP(\d)} $bus - k
				foreach {part first -} $::address_map {
					if {[string match DDR* $part] && $first >= [lindex $::board 1]} continue
					dict set segments $cell/SAXIGP[expr {$k + 2}]/HP${k}_$part $name
				}
			}
			default { dict set segments $name/reg0 $name }
		}
	}
	return $segments
}

# The slaves that a master reaches.
proc reached {master} {
	global peer cells
	if {![info exists peer($master)]} { return {} }
	set slave $peer($master)
	set cell [lindex [split $slave /] 0]
	if {$cells($cell) ne "smartconnect"} { return [list $slave] }
	set found {}
	for {set k 0} {$k < [value $cell NUM_MI]} {incr k} {
		lappend found {*}[reached $cell/[format M%02d_AXI $k]]
	}
	return $found
}

# ---------------------------------------------------------------------------------------------------------
# Vivado's commands

# Splits arguments into options with a value, flags, and the rest.
proc arguments {command arguments with_value flags} {
	set options {}
	set rest {}
	while {[llength $arguments] > 0} {
		set arguments [lassign $arguments first]
		if {$first in $with_value} {
			set arguments [lassign $arguments option]
			dict set options $first $option
		} elseif {$first in $flags} {
			dict set options $first 1
		} elseif {[regexp {^-[a-z]} $first]} {
			refuse "$command has no option $first"
		} else {
			lappend rest $first
		}
	}
	return [list $options $rest]
}

proc create_project args {
	lassign [arguments create_project $args {-part} {-force}] options
	if {![dict exists $::boards [dict get $options -part]]} { refuse "no device [dict get $options -part]" }
	set ::board [dict get $::boards [dict get $options -part]]
}
proc version args { return [expr {[info exists ::env(MOCK_VERSION)] ? $::env(MOCK_VERSION) : "2024.1"}] }
foreach command {create_bd_design update_compile_order close_design open_run wait_on_run} {
	proc $command args "lappend ::done $command"
}
foreach command {current_project current_fileset get_runs get_files} {
	proc $command args { return [lindex $args end] }
}
foreach command {
	report_timing_summary report_high_fanout_nets report_utilization report_ram_utilization
	report_methodology report_cdc write_hw_platform
} {
	proc $command args "
		lassign \[arguments $command \$args {-file -max_paths -max_nets} \
			{-timing -hierarchical -fixed -include_bit -force}\] options rest
		if {\$rest ne {}} { refuse \"$command: \$rest\" }
		close \[open \[dict get \$options -file\] w\]
	"
}
proc get_board_parts args {
	set name [lindex $::board 0]
	return [lsearch -all -inline "xilinx.com:$name:part0:1.9 xilinx.com:$name:part0:1.10" [lindex $args end]]
}
proc get_ipdefs args {
	if {![regexp {ip:(\w+):} [lindex $args end] - name] || ![info exists ::parameters($name)]} { return {} }
	return xilinx.com:ip:$name:1.0
}
proc add_files args {
	set file [lindex $args end]
	if {![file exists $file]} { refuse "no file $file" }
	lappend ::files $file
}
proc create_bd_cell args {
	global cells config modules shapes parameters files
	lassign [arguments create_bd_cell $args {-type -vlnv -reference} {}] options cell
	if {[info exists cells($cell)]} { refuse "cell $cell twice" }
	if {[dict get $options -type] eq "module"} {
		set module [dict get $options -reference]
		set file [lsearch -inline $files */$module.v]
		if {$file eq ""} { refuse "no module $module in the project" }
		set cells($cell) $module
		set modules($cell) $file
		set shapes($cell) [shape_of_module $file]
	} else {
		regexp {ip:(\w+):} [dict get $options -vlnv] - kind
		set cells($cell) $kind
		foreach {name default} $parameters($kind) { set config($cell,$name) $default }
	}
	return $cell
}
proc apply_bd_automation args {}
proc set_property args {
	global cells config
	if {[lindex $args 0] eq "-dict"} {
		lassign $args - properties cell
	} else {
		lassign $args name value cell
		set properties [list $name $value]
	}
	foreach {name value} $properties {
		if {$name eq "board_part" && $value ne "xilinx.com:[lindex $::board 0]:part0:1.10"} {
			refuse "$value is not the newest of the board files"
		}
		if {![regsub {^CONFIG\.} $name {} name]} continue
		if {![info exists config($cell,$name)]} { refuse "$cells($cell) has no parameter $name ($cell)" }
		set config($cell,$name) $value
	}
}
proc get_property {name object} {
	global bit_folder
	switch $name {
		PROGRESS { return 100% }
		STATS.WNS - STATS.WHS { return [expr {[info exists ::env(MOCK_SLACK)] ? $::env(MOCK_SLACK) : 0.1}] }
		DIRECTORY { return $bit_folder }
		OFFSET { return [lindex $::assigned([lindex $object 0]) 0] }
		RANGE { return [lindex $::assigned([lindex $object 0]) 1] }
		default { refuse "no property $name" }
	}
}
proc get_bd_cells cell {
	shape $cell
	return $cell
}
proc get_bd_pins name {
	pin $name
	return $name
}
proc get_bd_intf_pins name {
	bus $name
	return $name
}
proc get_bd_addr_spaces name {
	if {![dict exists [spaces] $name]} { refuse "no address space $name" }
	return $name
}
# The segments of this name, from the root of the design on; with -of_objects, the ones that are assigned in an
# address space.
proc get_bd_addr_segs args {
	lassign [arguments get_bd_addr_segs $args {-of_objects} {}] options pattern
	if {![dict exists $options -of_objects]} { return [lmap name [dict keys [segments] $pattern] { string cat / $name }] }
	set space [dict get $options -of_objects]
	return [lsort [lsearch -all -inline -index 0 -exact [array names ::assigned] $space]]
}

proc connect_bd_net args {
	global driver
	set outputs [lsearch -all -inline -not [lmap name $args {
		expr {[lindex [pin $name] 0] eq "out" ? $name : ""}
	}] {}]
	if {[llength $outputs] != 1} { refuse "a net of [llength $outputs] drivers: $args" }
	lassign [pin $outputs] - from_role from_bits
	foreach name $args {
		if {$name eq $outputs} continue
		lassign [pin $name] - role bits
		if {[info exists driver($name)]} { refuse "$name has two drivers, $driver($name) and $outputs" }
		if {$bits != $from_bits} { refuse "$name has $bits bits, $outputs has $from_bits" }
		foreach kind {clock reset} {
			if {($role eq $kind) != ($from_role eq $kind)} { refuse "$outputs ($from_role) at $name ($role)" }
		}
		set driver($name) $outputs
	}
}
proc connect_bd_intf_net {a b} {
	global peer
	foreach {name other} [list $a $b $b $a] {
		if {[info exists peer($name)]} { refuse "$name is connected twice, with $peer($name) and $other" }
	}
	lassign [bus $a] side protocol bits
	lassign [bus $b] other_side other_protocol other_bits
	if {$side eq $other_side} { refuse "$a and $b are both ${side}s" }
	if {$protocol ne $other_protocol} { refuse "$a is a $protocol bus, $b a $other_protocol bus" }
	if {$bits != $other_bits && $bits != 0 && $other_bits != 0} {
		refuse "$a has $bits bits, $b has $other_bits"
	}
	set peer($a) $b
	set peer($b) $a
}
proc assign_bd_address args {
	global assigned
	lassign [arguments assign_bd_address $args {-offset -range -target_address_space} {}] options segment
	set segment [string trimleft $segment /]
	foreach {part first bytes} $::address_map {
		if {![string match */HP?_$part $segment]} continue
		set inside [expr {[dict get $options -offset] - $first}]
		if {$inside < 0 || $inside + [dict get $options -range] > $bytes} {
			refuse "$segment begins at $first and has $bytes bytes"
		}
	}
	set key [list [dict get $options -target_address_space] $segment]
	if {[info exists assigned($key)]} { refuse "$key is assigned twice" }
	set assigned($key) [list [dict get $options -offset] [dict get $options -range]]
}
proc exclude_bd_addr_seg args {
	lassign [arguments exclude_bd_addr_seg $args {-target_address_space} {}] options segment
	lappend ::excluded [list [dict get $options -target_address_space] [string trimleft $segment /]]
}
proc validate_bd_design {} {
	check
	lappend ::done validate_bd_design
}
proc save_bd_design {} {
	if {[lindex $::done end] ne "validate_bd_design"} { refuse "the block design is saved before it is valid" }
}
proc make_wrapper args { lappend ::done make_wrapper }
# The word USR_ACCESS, which only a constraint file brings into the run that writes the bitstream.
proc check_usr_access {} {
	global files pgs
	set word {}
	foreach file [lsearch -all -inline $files *.xdc] {
		set constraints [open $file]
		regexp {set_property BITSTREAM.CONFIG.USR_ACCESS (\S+) \[current_design\]} [read $constraints] - word
		close $constraints
	}
	if {$word ne $pgs(usr_access)} { refuse "USR_ACCESS of the bitstream is '$word', not $pgs(usr_access)" }
}
proc launch_runs args {
	global bit_folder
	lassign [arguments launch_runs $args {-jobs -to_step} {}] options name
	if {"make_wrapper" ni $::done} { refuse "$name starts before the block design has a wrapper" }
	if {[dict exists $options -to_step] && [dict get $options -to_step] eq "write_bitstream"} {
		check_usr_access
		set bit_folder [file normalize [file join $::scratch pgs.runs $name]]
		file mkdir $bit_folder
		close [open [file join $bit_folder pgs_wrapper.bit] w]
	}
}

# ---------------------------------------------------------------------------------------------------------
# The checks of the whole design

proc check {} {
	check_files
	check_connections
	check_clocks
	check_channels
	check_interrupt
	check_addresses
	check_protection
	check_parameters
	summary
}

# Every module and header that the Verilog uses is in the project.
proc check_files {} {
	global files
	set names [lmap file $files { file tail $file }]
	foreach file [lsearch -all -inline $files *.v] {
		set text [regsub -all -line {//.*$} [text_of $file] {}]
		foreach {- header} [regexp -all -inline {`include "([^"]+)"} $text] {
			if {$header ni $names} { refuse "[file tail $file] includes $header, which is not in the project" }
		}
		# An instance: a module's name, perhaps parameters, the instance's name, and named ports.
		foreach {- module} [regexp -all -inline -line {^\s*(\w+)\s+(?:#\(.*\)\s*)?\w+\s*\(\s*(?:$|\.)} $text] {
			if {$module in {module function task begin end else if for case}} continue
			if {"$module.v" ni $names} { refuse "[file tail $file] uses $module, which is not in the project" }
		}
	}
}

# Every pin and every bus is connected, but for outputs that nothing must take.
proc check_connections {} {
	global driver peer modules
	set driving {}
	foreach {to from} [array get driver] { dict lappend driving $from $to }
	foreach name [all pins] {
		lassign [pin $name] direction role
		if {$direction eq "in" && $role ne "overrides" && ![info exists driver($name)]} { refuse "$name hangs: nothing drives it" }
		set must [expr {$role eq "interrupt" || [info exists modules([lindex [split $name /] 0])]}]
		if {$direction eq "out" && $must && ![dict exists $driving $name]} { refuse "$name hangs: nothing takes it" }
	}
	foreach name [all buses] {
		if {![info exists peer($name)]} { refuse "$name hangs: a bus without its other end" }
	}
}

# The sources of the clocks that a bus can run on.
proc clocks_of {bus} {
	return [lmap clock [lindex [bus $bus] 3] { source_of [lindex [split $bus /] 0]/$clock }]
}

# Both ends of a bus run on one clock, and a reset belongs to the clock of its cell.
proc check_clocks {} {
	global peer driver cells
	foreach {a b} [lsort -stride 2 [array get peer]] {
		if {![llength [lmap clock [clocks_of $a] { if {$clock ni [clocks_of $b]} continue; set clock }]]} {
			refuse "$a runs on [clocks_of $a], $b on [clocks_of $b]"
		}
	}
	foreach name [all pins] {
		lassign [pin $name] direction role - its_clock
		lassign [split $name /] cell
		if {$direction ne "in" || $role ne "reset" || $cells($cell) in {clk_wiz proc_sys_reset}} continue
		set from [lindex [split $driver($name) /] 0]
		if {$cells($from) ne "proc_sys_reset"} { refuse "$name is reset by $driver($name), which no clock has seen" }
		set clock [source_of $from/slowest_sync_clk]
		foreach {other facts} [lindex [shape $cell] 0] {
			if {[lrange $facts 0 1] eq "in clock" && $its_clock in [list {} $other] && [source_of $cell/$other] ne $clock} {
				refuse "$name has the reset of $clock, $cell/$other is on [source_of $cell/$other]"
			}
		}
	}
	foreach cell [cells_of proc_sys_reset] {
		set wizard [cells_of clk_wiz]
		if {[source_of $cell/dcm_locked] ne "$wizard/locked"} { refuse "$cell does not wait until $wizard is locked" }
	}
	# The synchronous mode of PG021: one clock, and a slower one for the registers.
	foreach core [cells_of axi_dma] {
		foreach pin {m_axi_sg_aclk m_axi_mm2s_aclk m_axi_s2mm_aclk} {
			set source [source_of $core/$pin]
			if {$source ne [source_of [accelerator]/aclk]} { refuse "$core/$pin is on $source" }
		}
	}
	if {$::expected_khz < 1000 * $::pgs(pl_clock_mhz)} { refuse "the registers of the DMA cores are on the faster clock" }
}

proc accelerator {} {
	set found [cells_of $::pgs(top)]
	if {[llength $found] != 1} { refuse "[llength $found] accelerators" }
	return $found
}

# The DMA core that feeds a stream of the accelerator.
proc core_of {k} {
	global peer cells
	set core [lindex [split $peer([accelerator]/s${k}_axis) /] 0]
	if {$cells($core) ne "axi_dma"} { refuse "stream $k comes from $core, which is no DMA core" }
	return $core
}

# Stream k comes from the core whose other channel takes stream k.
proc check_channels {} {
	global pgs peer
	foreach {letter widths} [list s $pgs(mm2s_stream_bits) m $pgs(s2mm_stream_bits)] {
		set k 0
		foreach bits $widths {
			set name [accelerator]/$letter${k}_axis
			if {[lindex [bus $name] 2] != $bits} { refuse "$name has [lindex [bus $name] 2] bits, the interface $bits" }
			incr k
		}
	}
	for {set k 0} {$k < [llength $pgs(dma_addresses)]} {incr k} {
		set core [core_of $k]
		set expected $core/S_AXIS_S2MM
		set found $peer([accelerator]/m${k}_axis)
		if {$found ne $expected} { refuse "[accelerator]/m${k}_axis goes to $found, not to $expected" }
	}
	set cores [llength [cells_of axi_dma]]
	if {$cores != $k} { refuse "$cores DMA cores, the interface has $k" }
}

# Every interrupt reaches pl_ps_irq0, through a module that is an OR of all its inputs.
proc check_interrupt {} {
	global driver modules cells sources
	set processor [cells_of zynq_ultra_ps_e]
	lassign [split [source_of $processor/pl_ps_irq0] /] any output
	if {![info exists modules($any)] || $cells($any) eq $::pgs(top)} {
		refuse "$processor/pl_ps_irq0 is driven by [source_of $processor/pl_ps_irq0], which is no OR of interrupts"
	}
	set inputs [lmap {name facts} [lindex [shape $any] 0] { if {[lindex $facts 0] ne "in"} continue; set name }]
	set text [text_of $modules($any)]
	if {![regexp "assign\\s+$output\\s*=(\[^;\]*);" $text - expression]} { refuse "$cells($any): no assign of $output" }
	set terms [lmap term [split $expression |] { string trim $term }]
	if {[lsort $terms] ne [lsort $inputs]} { refuse "$cells($any): $output is not the OR of all inputs: $expression" }
	# A constant 0 is no source.
	set sources [lsort [lmap input $inputs {
		lassign [split [source_of $any/$input] /] cell
		if {[info exists cells($cell)] && $cells($cell) eq "xlconstant" && [value $cell CONST_VAL] == 0} continue
		source_of $any/$input
	}]]
	set expected [list [accelerator]/irq]
	foreach core [cells_of axi_dma] { lappend expected $core/mm2s_introut $core/s2mm_introut }
	if {$sources ne [lsort $expected]} { refuse "interrupts $sources, not [lsort $expected]" }
}

# Every access of a DMA core is non-secure: AxPROT[1] of the memory ports is a constant 1.
proc check_protection {} {
	global cells
	foreach processor [cells_of zynq_ultra_ps_e] {
		foreach name [all pins] {
			if {![string match $processor/saxigp*_a?prot $name]} continue
			set from [lindex [split [source_of $name] /] 0]
			if {![info exists cells($from)] || $cells($from) ne "xlconstant"} {
				refuse "$name is driven by the bus, which says secure: an SMMU lets it pass untranslated"
			}
			if {!([value $from CONST_VAL] & 2)} { refuse "$name is [value $from CONST_VAL], which says secure" }
		}
	}
}

# Every segment that a master reaches lies where the interface has it, and no other.
proc check_addresses {} {
	global pgs assigned
	set home {}
	for {set k 0} {$k < [llength $pgs(dma_addresses)]} {incr k} {
		dict set home [core_of $k]/S_AXI_LITE/Reg [list [lindex $pgs(dma_addresses) $k] $pgs(dma_bytes)]
	}
	dict set home [accelerator]/s_axi/reg0 [list $pgs(control_address) $pgs(control_bytes)]
	foreach segment [dict keys [segments]] {
		if {[string match *_$pgs(memory_segment) $segment]} { dict set home $segment $pgs(memory) }
	}
	set expected {}
	foreach {space master} [spaces] {
		set slaves [reached $master]
		foreach {segment slave} [segments] {
			if {$slave in $slaves && [dict exists $home $segment]} {
				dict set expected [list $space $segment] [dict get $home $segment]
			}
		}
		# Vivado complains of a segment that is neither assigned nor excluded.
		foreach {segment slave} [segments] {
			set key [list $space $segment]
			if {$slave in $slaves && ![dict exists $home $segment] && $key ni $::excluded} {
				refuse "$space reaches $segment, which is not excluded"
			}
		}
	}
	foreach {segment place} $home {
		if {[lsearch -index 1 [dict keys $expected] $segment] < 0} { refuse "no master reaches $segment" }
	}
	foreach {key place} $expected {
		lassign $key space segment
		if {![info exists assigned($key)]} { refuse "$space has no address for $segment" }
		foreach found $assigned($key) value $place what {offset range} {
			if {$found != $value} {
				refuse "$space has $segment at $what [format 0x%X $found], the interface at [format 0x%X $value]"
			}
		}
	}
	foreach key [lsort [array names assigned]] {
		if {[dict exists $expected $key]} continue
		lassign $key space segment
		if {[dict get [segments] $segment] in [reached [dict get [spaces] $space]]} {
			refuse "$space has a second segment, $segment"
		}
		refuse "$space has an address for $segment without a way there"
	}
	# Registers lie in the window of their master, as UG1085 has it.
	foreach {segment place} $home {
		if {[string match */SAXIGP* $segment]} continue
		lassign $place offset range
		if {$offset < 0xA0000000 || $offset + $range > 0xB0000000} { refuse "$segment is outside M_AXI_HPM0_FPD" }
		if {$range & ($range - 1) || $offset % $range} { refuse "$segment: $range bytes do not fit at $offset" }
	}
}

# The cores, the ports and the clock are built as the interface says.
proc check_parameters {} {
	global pgs config
	for {set k 0} {$k < [llength $pgs(dma_addresses)]} {incr k} {
		set core [core_of $k]
		set in [lindex $pgs(mm2s_stream_bits) $k]
		set out [lindex $pgs(s2mm_stream_bits) $k]
		foreach {name expected} [list c_include_sg 1 c_sg_include_stscntrl_strm 0 c_micro_dma 0 \
			c_sg_length_width $pgs(dma_length_bits) c_addr_width $pgs(dma_address_bits) \
			c_include_mm2s 1 c_m_axi_mm2s_data_width 128 c_m_axis_mm2s_tdata_width $in c_include_mm2s_dre 0 \
			c_include_s2mm 1 c_m_axi_s2mm_data_width 128 c_s_axis_s2mm_tdata_width $out \
			c_include_s2mm_dre 0 c_mm2s_burst_size 16 c_s2mm_burst_size 16] {
			if {[value $core $name] != $expected} { refuse "$core: $name is [value $core $name], not $expected" }
		}
	}
	set processor [cells_of zynq_ultra_ps_e]
	foreach port [lrange {MAXIGP0 SAXIGP2 SAXIGP3 SAXIGP4 SAXIGP5} 0 $k] {
		set bits [value $processor PSU__${port}__DATA_WIDTH]
		if {$bits != 128} { refuse "$port has $bits bits; the overlays set the ports to 128" }
	}
	set mhz [value $processor PSU__CRL_APB__PL0_REF_CTRL__FREQMHZ]
	if {$mhz != $::pgs(pl_clock_mhz)} { refuse "pl_clk0 is $mhz MHz, and USR_ACCESS asks for $::pgs(pl_clock_mhz)" }
	foreach wizard [cells_of clk_wiz] {
		set wanted [expr {round([value $wizard CLKOUT1_REQUESTED_OUT_FREQ] * 1000)}]
		if {$wanted != $::expected_khz} { refuse "$wizard makes $wanted kHz, not $::expected_khz" }
		if {[value $wizard PRIM_SOURCE] ne "No_buffer"} { refuse "$wizard: the clock of the processor needs no buffer of a pin" }
	}
	set wizard [lindex [split [source_of [accelerator]/aclk] /] 0]
	if {$wizard ni [cells_of clk_wiz]} { refuse "the accelerator runs on [source_of [accelerator]/aclk]" }
}

proc summary {} {
	global assigned pgs sources driver peer
	foreach key [lsort [array names assigned]] {
		lassign $assigned($key) offset range
		puts [format "address    %-18s %-32s 0x%010X + 0x%X" {*}$key $offset $range]
	}
	puts "interrupt  [llength $sources] sources on pl_ps_irq0"
	puts "clock      $::expected_khz kHz"
	puts "accepted   [array size ::cells] cells, [array size driver] connected inputs, [expr {[array size peer] / 2}] buses"
}

# ---------------------------------------------------------------------------------------------------------

set argv [lassign $argv script]
if {$script eq ""} { refuse "usage: tclsh mock.tcl SCRIPT \[OPTION VALUE\]..." }
if {![file exists $script]} { refuse "no script $script" }

# The script's own options, read a second time.
set rtl rtl
foreach {name value} $argv {
	switch [regsub {^--} $name -] {
		-rtl { set rtl $value }
		-out { set scratch $value }
		-clock-khz { set expected_khz $value }
	}
}
# The stand-ins for Vivado's files go away with the process, unless the command line names a folder.
set keep [info exists scratch]
if {!$keep} {
	close [file tempfile scratch vivado-mock]
	file delete $scratch
	lappend argv -out $scratch
}
proc leave {code} {
	if {!$::keep} { file delete -force $::scratch }
	exit $code
}
if {[file exists $rtl/pgs_vivado.tcl]} {
	source $rtl/pgs_vivado.tcl
	if {![info exists expected_khz]} { set expected_khz $pgs(clock_khz) }
}
if {[catch { source $script } message]} { refuse "the script ends with an error: $message" }
if {[array size cells] > 0 && "validate_bd_design" ni $done} { refuse "the block design is never validated" }
leave 0
