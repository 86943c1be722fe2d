//! Describes devices as sysfs and the device tree do, with mistakes, and has the driver read them.

use std::fs;
use std::path::Path;

use bitstream_model::interface::address_map::{
    CONTROL_BASE, MEMORY_BASE, UIO_CONTROL_MAP, UIO_MEMORY_MAP, UIO_MEMORY_NODE,
};
use bitstream_model::interface::record::Beat;
use zynq_pgs::platform::{
    ManagerChoice, PlatformError, ReservedMemory, System, UioDevice, ZYNQMP_MANAGER, fpga_managers,
    require_bitstream, try_u_dma_buf, u_dma_buf_names, uio_nodes,
};

use crate::input::Input;
use crate::tally::Tally;

/// Bytes of a device file, which is a plain file here.
const FILE_BYTES: u64 = 1 << 18;

const NAMES: [&str; 6] =
    ["pgs", UIO_MEMORY_NODE, "pgs-control", "pgs-dma0", UIO_MEMORY_MAP, UIO_CONTROL_MAP];
const NUMBERS: [u64; 8] =
    [0, 0x1000, 0x10, 1 << 16, 1 << 20, CONTROL_BASE, MEMORY_BASE, u64::MAX - 15];

/// One execution.
pub(super) fn run(bytes: &[u8]) -> Tally {
    let mut input = Input::new(bytes);
    let root = tempfile::tempdir().expect("a folder");
    let system = System::under(root.path());
    for number in 0..1 + input.below(3) {
        node(&mut input, &system, number);
    }
    for number in 0..input.below(3) {
        let manager = system.fpga_manager.join(format!("fpga{number}"));
        text(&mut input, &manager.join("name"), ZYNQMP_MANAGER);
        text(&mut input, &manager.join("state"), "operating");
    }
    if input.one_in(4) {
        let buffer = system.u_dma_buf.join("pgs");
        for name in ["phys_addr", "size", "sync_mode", "dma_coherent"] {
            number(&mut input, &buffer.join(name));
        }
        text(&mut input, &system.dev.join("pgs"), "");
    }

    let mut tally = Tally::default();
    let mut count = |ended: Result<(), PlatformError>| match ended {
        Ok(()) => tally.steps += 1,
        Err(error) => {
            assert!(!error.to_string().is_empty());
            let _ = error.next_step();
            tally.refused += 1;
        }
    };
    count(uio_nodes(&system.uio).map(|nodes| {
        for node in nodes {
            let _ = (node.part(), node.is_in_logic());
        }
    }));
    for name in NAMES {
        count(UioDevice::open_in(&system, name).map(|device| {
            for map in NAMES {
                let Ok(window) = device.window(map) else { continue };
                let listed = device.node().map(map).expect("it has a window").bytes;
                assert!(window.bytes() <= listed, "{} of {listed} bytes", window.bytes());
                if let Ok(behind) = u32::try_from(window.bytes()) {
                    window.read32(behind & !3).expect_err("behind its end");
                }
            }
        }));
        count(ReservedMemory::open_in(&system, name).map(|memory| check(&memory)));
    }
    count(fpga_managers(&system.fpga_manager).map(drop));
    count(require_bitstream(&system, &ManagerChoice::Automatic));
    for name in u_dma_buf_names(&system) {
        count(try_u_dma_buf(&system, &name));
    }
    tally
}

/// No beat behind the end is reached, and the last one is.
fn check(memory: &ReservedMemory) {
    let mut beat = [Beat::default()];
    let bytes = memory.bytes();
    memory.read(bytes & !15, &mut beat).expect_err("behind its end");
    assert_eq!(memory.address() % 16, 0);
    // The device file of a real node has no end.
    if (16..=FILE_BYTES / 2).contains(&bytes) {
        memory.read((bytes - 16) & !15, &mut beat).expect("its last beat");
    }
}

fn node(input: &mut Input<'_>, system: &System, number: u32) {
    let node = system.uio.join(format!("uio{number}"));
    let name = input.pick(&NAMES);
    text(input, &node.join("name"), name);
    for map in 0..input.below(3) {
        let map = node.join(format!("maps/map{map}"));
        let name = input.pick(&NAMES);
        text(input, &map.join("name"), name);
        for name in ["addr", "size"] {
            self::number(input, &map.join(name));
        }
        // Inside a page, as the kernel has it: the device file must reach behind the region.
        let offset = input.pick(&["0x0", "0x0", "0x10", "8", "0xff0", "none"]);
        text(input, &map.join("offset"), offset);
    }
    let device = system.dev.join(format!("uio{number}"));
    text(input, &device, "");
    if let Ok(file) = fs::File::options().write(true).open(&device) {
        file.set_len(FILE_BYTES).expect("a sparse file");
    }
    if input.one_in(2) {
        let tree = node.join("device");
        for name in ["#address-cells", "#size-cells"] {
            let cells = input.pick(&[1_u32, 2, 2, 0, 3]).to_be_bytes();
            bytes(&tree.join(name), if input.one_in(8) { &cells[1..] } else { &cells });
        }
        let cut = if input.one_in(8) { 3 } else { 0 };
        let entries = (0..input.below(4)).flat_map(|_| input.pick(&NUMBERS).to_be_bytes());
        let entries: Vec<u8> = entries.skip(cut).collect();
        bytes(&tree.join("of_node/reg"), &entries);
    }
}

/// A number as the kernel writes it, or something else.
fn number(input: &mut Input<'_>, path: &Path) {
    let mut value = input.pick(&NUMBERS);
    if input.one_in(8) {
        value = input.long();
    }
    let decimal = input.one_in(4);
    text(input, path, &if decimal { value.to_string() } else { format!("{value:#x}") });
}

/// A text as the kernel writes it; sometimes cut, random, a folder, or absent.
fn text(input: &mut Input<'_>, path: &Path, right: &str) {
    match input.below(32) {
        0 => {}
        1 => bytes(path, input.bytes(12)),
        2 => bytes(path, &right.as_bytes()[..right.len() / 2]),
        3 => fs::create_dir_all(path).expect("made"),
        _ => bytes(path, format!("{right}\n").as_bytes()),
    }
}

fn bytes(path: &Path, content: &[u8]) {
    fs::create_dir_all(path.parent().expect("below the root")).expect("made");
    fs::write(path, content).expect("written");
}
