//! Tests that the device trees agree with the interface: regions, sizes, names, interrupt, clock,
//! ports. Buffers lie in the one segment that every DMA core reaches. The udev rule names every
//! node and gives rights to its group alone.

#[path = "device_tree/mod.rs"]
mod device_tree;

use std::collections::BTreeSet;
use std::fs;

use device_tree::{Tree, sources, tools_found};
use rtlgen::design::{Design, Parameters};
use zynq_pgs::interface::address_map;
use zynq_pgs::interface::fence::Fence;
use zynq_pgs::interface::profile::{FLOAT, PROFILES, Profile};
use zynq_pgs::interface::usr_access::PL_CLOCK_MHZ;
use zynq_pgs::platform::DevMemWindows;

/// GIC, in device tree bindings: shared peripheral interrupt, and level, active high.
const SPI: u32 = 0;
const LEVEL_HIGH: u32 = 4;

/// Every region of the interface: the name of its map, address, length.
fn interface() -> Vec<(&'static str, u64, u64)> {
    let dma = address_map::UIO_DMA_MAPS
        .iter()
        .enumerate()
        .map(|(k, name)| (*name, address_map::dma_base(k), u64::from(address_map::DMA_BYTES)));
    let bytes = u64::from(address_map::CONTROL_BYTES);
    dma.chain([(address_map::UIO_CONTROL_MAP, address_map::CONTROL_BASE, bytes)]).collect()
}

/// Compares one property, and names it if it differs.
fn equal<T: PartialEq + std::fmt::Debug>(
    node: &str,
    what: &str,
    found: T,
    expected: T,
) -> Result<(), String> {
    if found == expected {
        return Ok(());
    }
    Err(format!("{node}: {what} is {found:?}, the interface says {expected:?}"))
}

/// Compares a node with the interface: its UIO name, its regions, and whether it has the interrupt.
fn check_node(
    tree: &Tree,
    node: &str,
    uio_name: &str,
    regions: &[(&str, u64, u64)],
    interrupt: bool,
) -> Result<(), String> {
    let strings = |property| tree.strings(node, property).unwrap_or_default();
    equal(node, "compatible", strings("compatible"), vec!["generic-uio".to_owned()])?;
    equal(node, "linux,uio-name", strings("linux,uio-name"), vec![uio_name.to_owned()])?;
    // Kernels without linux,uio-name take the node's name without its address.
    let own = node.rsplit('/').next().unwrap_or_default();
    let expected = format!("{uio_name}@{:x}", regions[0].1);
    equal(node, "the node's name", own, expected.as_str())?;
    let found = tree.regions(node).unwrap_or_default();
    let expected: Vec<_> = regions.iter().map(|(_, address, bytes)| (*address, *bytes)).collect();
    equal(node, "reg", found, expected)?;
    let expected: Vec<_> = regions.iter().map(|(name, _, _)| (*name).to_owned()).collect();
    equal(node, "reg-names", strings("reg-names"), expected)?;
    let expected = interrupt.then_some(vec![SPI, address_map::INTERRUPT_SPI, LEVEL_HIGH]);
    equal(node, "interrupts", tree.cells(node, "interrupts"), expected)?;
    let gic = tree.strings("/__symbols__", "gic").unwrap_or_default().concat();
    let expected = interrupt.then(|| tree.cells(&gic, "phandle")).flatten();
    equal(node, "interrupt-parent", tree.cells(node, "interrupt-parent"), expected)
}

/// Number of the PL clock 0 in the bindings of the chip's clock controller, `PL0_REF`.
const PL0_REF: u32 = 71;
/// Registers of the memory ports' widths, and the value for 128 bits.
const PORT_REGISTERS: std::ops::Range<u32> = 0..14;
const PORT_128: u32 = 0;
/// The register of the widths of `M_AXI_HPM0_FPD` and `M_AXI_HPM1_FPD`, and the value for 128 bits
/// on both.
const FPD_REGISTER: u32 = 14;
const FPD_128: u32 = 2 << 8 | 2 << 10;
/// The profile of the overlays.
const PROFILE: &Profile = &FLOAT;

/// Rate of the PL clock 0 that the Vivado script's bitstream takes, Hz.
const RATE: u32 = PL_CLOCK_MHZ * 1_000_000;

/// Compares the clock of an overlay with the bitstream, and its ports with the profile.
fn check_fabric(tree: &Tree, parent: &str) -> Result<(), String> {
    let node = format!("{parent}/pgs-clock");
    let compatible = |node: &str| tree.strings(node, "compatible").unwrap_or_default().concat();
    equal(&node, "compatible", compatible(&node), "xlnx,fclk".to_owned())?;
    let controller = tree.strings("/__symbols__", "zynqmp_clk").unwrap_or_default().concat();
    let phandle = tree.cells(&controller, "phandle").unwrap_or_default();
    let clock = [phandle, vec![PL0_REF]].concat();
    for property in ["clocks", "assigned-clocks"] {
        equal(&node, property, tree.cells(&node, property), Some(clock.clone()))?;
    }
    equal(&node, "rate", tree.cells(&node, "assigned-clock-rates"), Some(vec![RATE]))?;

    let node = format!("{parent}/pgs-ports");
    equal(&node, "compatible", compatible(&node), "xlnx,afi-fpga".to_owned())?;
    let ports = PORT_REGISTERS.flat_map(|register| [register, PORT_128]);
    let expected: Vec<_> = ports.chain([FPD_REGISTER, FPD_128]).collect();
    equal(&node, "config-afi", tree.cells(&node, "config-afi"), Some(expected))
}

fn check_single(tree: &Tree, parent: &str) -> Result<(), String> {
    let node = format!("{parent}/{}@{:x}", address_map::UIO_NODE, address_map::DMA_BASE);
    check_node(tree, &node, address_map::UIO_NODE, &interface(), true)
}

fn check_separate(tree: &Tree) -> Result<(), String> {
    for region in interface() {
        let name = format!("{}-{}", address_map::UIO_NODE, region.0);
        let node = format!("/{name}@{:x}", region.1);
        let interrupt = region.0 == address_map::UIO_CONTROL_MAP;
        check_node(tree, &node, &name, &[region], interrupt)?;
    }
    Ok(())
}

fn as_shipped(text: String) -> String {
    text
}

#[test]
fn the_single_node_has_the_regions_and_the_interrupt_of_the_interface() {
    if !tools_found() {
        return;
    }
    check_single(&Tree::with_overlay("zynq-pgs.dtso", as_shipped), "").expect("as the interface");
}

#[test]
fn inside_the_fpga_region_stands_the_same_node_and_the_bitstream() {
    if !tools_found() {
        return;
    }
    let tree = Tree::with_overlay("zynq-pgs-region.dtso", as_shipped);
    check_single(&tree, "/fpga-full").expect("as the interface");
    let firmware = tree.strings("/fpga-full", "firmware-name");
    assert_eq!(firmware, Some(vec!["zynq-pgs.bit.bin".to_owned()]));
}

#[test]
fn the_separate_nodes_have_the_regions_and_control_has_the_interrupt() {
    if !tools_found() {
        return;
    }
    check_separate(&Tree::with_overlay("zynq-pgs-nodes.dtso", as_shipped))
        .expect("as the interface");
}

#[test]
fn every_overlay_keeps_the_clock_at_the_bitstreams_rate_and_sets_the_ports_to_128_bits() {
    if !tools_found() {
        return;
    }
    let widest = PROFILE.mm2s_widths.iter().chain(PROFILE.s2mm_widths).max();
    assert_eq!(widest, Some(&128), "the ports are as wide as the streams");
    for (overlay, parent) in
        [("zynq-pgs.dtso", ""), ("zynq-pgs-region.dtso", "/fpga-full"), ("zynq-pgs-nodes.dtso", "")]
    {
        check_fabric(&Tree::with_overlay(overlay, as_shipped), parent)
            .unwrap_or_else(|error| panic!("{overlay}: {error}"));
    }
    for (original, mutant, noticed) in [
        ("<100000000>", "<275000000>", "rate"),
        ("clocks = <&zynqmp_clk 71>", "clocks = <&zynqmp_clk 72>", "clocks"),
        ("<3 0>", "<3 1>", "config-afi"),
        ("<14 0xa00>", "<14 0x200>", "config-afi"),
        ("\"xlnx,fclk\"", "\"fixed-clock\"", "compatible"),
    ] {
        let mutate = |text: String| text.replace(original, mutant);
        let error = check_fabric(&Tree::with_overlay("zynq-pgs.dtso", mutate), "")
            .expect_err("a difference");
        assert!(error.contains(noticed), "{original} -> {mutant}: {error}");
    }
}

#[test]
fn the_readme_has_the_rate_of_every_profile() {
    let readme = fs::read_to_string(sources().join("README.md")).expect("the README");
    for profile in PROFILES {
        let rate = format!("{} MHz for ", profile.clock_khz / 1000);
        let (_, rest) = readme.split_once(&rate).unwrap_or_else(|| panic!("no {rate}"));
        let names = rest.split([',', ')']).next().unwrap_or_default();
        assert!(names.contains(&format!("`{}`", profile.name)), "{}: {rate}{names}", profile.name);
    }
}

#[test]
fn every_difference_from_the_interface_is_noticed() {
    if !tools_found() {
        return;
    }
    for (original, mutant, noticed) in [
        ("0x0 0xa0020000 0x0", "0x0 0xa0050000 0x0", "reg "),
        ("0x0 0xa0040000 0x0 0x1000>", "0x0 0xa0040000 0x0 0x2000>", "reg "),
        ("0x0 0xa0030000 0x0", "0x4 0xa0030000 0x0", "reg "),
        ("\"dma1\", \"dma2\"", "\"dma2\", \"dma1\"", "reg-names"),
        // The GIC's own number, 32 more, is the classic mistake; so is an edge.
        ("<0 89 4>", "<0 121 4>", "interrupts"),
        ("<0 89 4>", "<0 89 1>", "interrupts"),
        ("linux,uio-name = \"pgs\"", "linux,uio-name = \"solver\"", "linux,uio-name"),
        ("\"generic-uio\"", "\"xlnx,axi-dma-1.00.a\"", "compatible"),
    ] {
        let mutate = |text: String| text.replace(original, mutant);
        let shipped = fs::read_to_string(sources().join("zynq-pgs.dtsi")).expect("the node");
        assert_ne!(mutate(shipped.clone()), shipped, "{original} is not in the source");
        let error = check_single(&Tree::with_overlay("zynq-pgs.dtso", mutate), "")
            .expect_err("a difference");
        assert!(error.contains(noticed), "{original} -> {mutant}: {error}");
    }
    for (original, mutant) in [
        ("0x0 0xa0010000 0x0 0x10000", "0x0 0xa0010000 0x0 0x8000"),
        ("<0 89 4>", "<0 90 4>"),
        ("\"pgs-dma3\"", "\"pgs-dma4\""),
    ] {
        let mutate = |text: String| text.replace(original, mutant);
        check_separate(&Tree::with_overlay("zynq-pgs-nodes.dtso", mutate))
            .expect_err("a difference");
    }
}

/// Whether a node is enabled: a node without a status is.
fn enabled(tree: &Tree, node: &str) -> bool {
    tree.strings(node, "status").is_none_or(|status| status == ["okay"])
}

/// The node with this label.
fn labelled(tree: &Tree, label: &str) -> String {
    tree.strings("/__symbols__", label).expect("a label").concat()
}

/// The tree reserves the segment that the numbers for the Vivado script give to every DMA master,
/// the constants are the same, and the guard begins where it ends.
#[test]
fn the_tree_the_constants_and_the_script_have_one_segment_and_a_guard_behind_it() {
    let fence = Fence::default();
    let numbers = rtlgen::emit::files(&Design::new(Parameters::default()));
    let numbers = numbers.iter().find(|file| file.name == "pgs_vivado.tcl").expect("the numbers");
    let of_script = format!("set pgs(memory) {{0x{:X} 0x{:X}}}\n", fence.base(), fence.bytes());
    assert!(numbers.text.contains(&of_script), "{}", numbers.text);
    let script =
        fs::read_to_string(sources().join("../tools/vivado/build.tcl")).expect("the script");
    let places = script.lines().filter(|line| line.contains("{*}$pgs(memory)"));
    assert_eq!(places.count(), 1, "the script gives a master this segment at one place");
    let constants = (address_map::MEMORY_BASE, address_map::MEMORY_BYTES);
    assert_eq!((fence.base(), fence.bytes()), constants);
    let windows = DevMemWindows::default().memory;
    assert_eq!((windows.start, windows.end), (fence.base(), fence.end()));
    if !tools_found() {
        return;
    }
    let tree = Tree::with_included("zynq-pgs-memory.dtsi", "");
    let guard = fence.guard().expect("memory behind it");
    let guard = (guard.start, guard.end - guard.start);
    for (reserved, node, name, map, region) in [
        ("pgs_reserved", "pgs_memory", address_map::UIO_MEMORY_NODE, "memory", constants),
        // Not named as memory: `pgs list` must not offer it.
        ("pgs_reserved_guard", "pgs_guard", address_map::UIO_GUARD_NODE, "guard", guard),
    ] {
        let (reserved, node) = (labelled(&tree, reserved), labelled(&tree, node));
        assert!(reserved.starts_with("/reserved-memory/"), "{reserved}");
        assert_eq!(tree.regions(&reserved), Some(vec![region]), "{reserved}");
        assert!(tree.properties(&reserved).contains(&"no-map".to_owned()), "{reserved}");
        check_node(&tree, &node, name, &[(map, region.0, region.1)], false).expect(name);
        assert!(enabled(&tree, &reserved) && enabled(&tree, &node), "{node}");
    }
    assert!(!enabled(&tree, &labelled(&tree, "pgs_buffer")), "only one way is on");
}

#[test]
fn the_pool_takes_the_same_place_with_the_lines_that_the_file_shows() {
    if !tools_found() {
        return;
    }
    let source = fs::read_to_string(sources().join("zynq-pgs-memory.dtsi")).expect("the source");
    let lines: Vec<_> =
        source.lines().filter_map(|line| line.strip_prefix(" *\t")).map(str::trim).collect();
    assert_eq!(lines.len(), 3, "{lines:?}");
    let tree = Tree::with_included("zynq-pgs-memory.dtsi", &lines.join("\n"));
    let (pool, buffer) = (labelled(&tree, "pgs_reserved"), labelled(&tree, "pgs_buffer"));
    assert!(enabled(&tree, &pool) && enabled(&tree, &buffer));
    assert!(!enabled(&tree, &labelled(&tree, "pgs_memory")), "only one way is on");
    assert!(enabled(&tree, &labelled(&tree, "pgs_guard")), "the guard serves both ways");
    let fence = Fence::default();
    assert_eq!(tree.regions(&pool), Some(vec![(fence.base(), fence.bytes())]));
    let properties = tree.properties(&pool);
    let has = |name: &str| properties.iter().any(|property| property == name);
    assert!(has("reusable") && !has("no-map"), "{properties:?}");
    assert_eq!(tree.strings(&pool, "compatible"), Some(vec!["shared-dma-pool".to_owned()]));

    assert_eq!(tree.cells(&buffer, "memory-region"), tree.cells(&pool, "phandle"));
    assert_eq!(tree.strings(&buffer, "device-name"), Some(vec![address_map::U_DMA_BUF.to_owned()]));
    assert_eq!(tree.strings(&buffer, "compatible"), Some(vec!["ikwzm,u-dma-buf".to_owned()]));
    assert_eq!(tree.cells(&buffer, "size").map(|size| u64::from(size[0])), Some(fence.bytes()));
}

/// The names that a udev pattern of alternatives and ranges of one digit matches.
fn names(pattern: &str) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for alternative in pattern.split('|') {
        match alternative.split_once('[') {
            None => drop(names.insert(alternative.to_owned())),
            Some((before, rest)) => {
                let (range, after) = rest.split_once(']').expect("a closed range");
                let (first, last) = range.split_once('-').expect("a range");
                let digit = |text: &str| text.parse::<u32>().expect("a digit");
                for k in digit(first)..=digit(last) {
                    names.insert(format!("{before}{k}{after}"));
                }
            }
        }
    }
    names
}

/// The value that a rule compares or assigns for a key.
fn rule_value<'a>(rule: &'a str, key: &str) -> Option<&'a str> {
    let term = rule.split(", ").find(|term| term.starts_with(key))?;
    Some(term[key.len()..].trim_matches('"'))
}

#[test]
fn the_udev_rule_names_every_node_and_gives_rights_to_the_group_only() {
    let text = fs::read_to_string(sources().join("99-zynq-pgs.rules")).expect("the rules");
    let rules: Vec<_> =
        text.lines().filter(|line| !line.is_empty() && !line.starts_with('#')).collect();
    let of = |subsystem| {
        let ours = move |rule: &&&str| rule_value(rule, "SUBSYSTEM==") == Some(subsystem);
        rules.iter().filter(ours).copied().collect::<Vec<_>>()
    };
    let [uio] = of("uio")[..] else { panic!("one rule for UIO nodes: {text}") };
    let node = address_map::UIO_NODE;
    let maps = interface().into_iter().map(|(map, _, _)| format!("{node}-{map}"));
    let memory = [address_map::UIO_MEMORY_NODE, address_map::UIO_GUARD_NODE].map(str::to_owned);
    let expected: BTreeSet<_> = maps.chain([node.to_owned()]).chain(memory).collect();
    assert_eq!(names(rule_value(uio, "ATTR{name}==").expect("by name")), expected);
    let buffers = of("u-dma-buf|udmabuf");
    assert_eq!(buffers.len() + 1, rules.len(), "{text}");
    for rule in buffers {
        assert_eq!(rule_value(rule, "KERNEL=="), Some(node), "{rule}");
    }
    for rule in rules {
        let mode = rule_value(rule, "MODE=");
        assert!(mode == Some("0660") || rule.contains("RUN+="), "{rule}");
        assert_eq!(rule_value(rule, "GROUP=").is_some(), mode.is_some(), "{rule}");
    }
    for attribute in ["sync_for_cpu", "sync_for_device"] {
        for command in ["/bin/chgrp pgs ", "/bin/chmod 0660 "] {
            let given = text.lines().any(|l| l.contains(command) && l.contains(attribute));
            assert!(given, "{command}{attribute}");
        }
    }
}

#[test]
fn the_readme_says_of_every_file_what_it_is_for() {
    let readme = fs::read_to_string(sources().join("README.md")).expect("the README");
    for entry in fs::read_dir(sources()).expect("the folder") {
        let name = entry.expect("an entry").file_name().into_string().expect("UTF-8");
        assert!(name == "README.md" || readme.contains(&format!("`{name}`")), "{name}");
    }
    if !tools_found() {
        return;
    }
    // The file has no node that the README and the rule do not know.
    let tree = Tree::with_overlay("zynq-pgs-nodes.dtso", as_shipped);
    let ours = tree.children("/").into_iter().filter(|name| name.starts_with("pgs")).count();
    let fabric = ["`pgs-clock`", "`pgs-ports`"];
    assert!(fabric.iter().all(|name| readme.contains(name)), "{fabric:?}");
    assert_eq!(ours, interface().len() + fabric.len());
}
