//! Tests which boards are opened, refused or left alone, on systems made of files.

use std::fs;
use std::time::Duration;

use super::open::{BoardChoice, BoardKind, Found, find};
use crate::axi_dma::DmaError;
use crate::control_block::fake as bitstream;
use crate::error::OpenError;
use crate::platform::fake::FakeRegisters;
use crate::platform::{
    Caching, DevMemWindows, ManagerChoice, MemoryChoice, PlatformError, RegisterMap, System,
    ZYNQMP_MANAGER, fpga_fake, uio_fake,
};
use crate::{Accelerator, Error};

fn find_in(
    system: &System,
    board: &BoardChoice,
    memory: &MemoryChoice,
) -> Result<Found, OpenError> {
    find(board, memory, &ManagerChoice::Automatic, system)
}

fn uio(node: &str) -> BoardChoice {
    BoardChoice::Uio { node: node.to_owned() }
}

/// A system with the nodes `fabric` and `pgs`; `describe` fills the control block of `pgs`.
fn system_with(describe: impl Fn(&FakeRegisters)) -> (tempfile::TempDir, System) {
    let root = tempfile::tempdir().expect("a directory");
    let system = System::under(root.path());
    uio_fake::add_node(&system, 0, "fabric", &[]);
    uio_fake::add_node(&system, 1, "pgs", &uio_fake::regions());
    let registers = FakeRegisters::default();
    describe(&registers);
    // Pages of up to 64 KiB; the control block is map 4.
    let path = system.dev.join("uio1");
    let mut device = fs::read(&path).expect("read");
    for page in [1 << 12, 1 << 14, 1 << 16] {
        registers.with(|state| {
            for (at, value) in &state.values {
                let at = 4 * page + *at as usize;
                device[at..at + 4].copy_from_slice(&value.to_le_bytes());
            }
        });
    }
    fs::write(path, device).expect("written");
    (root, system)
}

fn open(choice: &BoardChoice, system: &System) -> Result<Accelerator, Error> {
    let found = find_in(system, choice, &MemoryChoice::Automatic).map_err(Error::Open)?;
    Accelerator::on(found, None)
}

fn error_of(choice: &BoardChoice, system: &System) -> OpenError {
    match open(choice, system).expect_err("no board") {
        Error::Open(error) => error,
        other => panic!("{other}"),
    }
}

fn add_memory(system: &System) {
    uio_fake::add_node(system, 7, "pgs-memory", &[("memory", 0x6000_0000, 0x1_0000)]);
}

#[test]
fn a_node_that_is_not_there_is_named_beside_those_that_are() {
    let (_root, system) = system_with(bitstream::describe);
    let text = error_of(&uio("pgs2"), &system).to_string();
    assert!(text.contains("\"pgs2\" (found: fabric, pgs)"), "{text}");
    let text = error_of(&uio("fabric"), &system).to_string();
    assert!(text.contains("\"fabric\" has no map named \"control\""), "{text}");
}

#[test]
fn a_board_without_memory_says_what_it_looked_for() {
    let (_root, system) = system_with(bitstream::describe);
    for choice in [BoardChoice::Automatic, uio("pgs")] {
        let error = error_of(&choice, &system);
        assert!(matches!(error, OpenError::Platform(PlatformError::NoMemory { .. })), "{error}");
    }
}

#[test]
fn a_real_board_is_identified_and_never_replaced_by_an_emulated_one() {
    let (_root, system) = system_with(bitstream::describe);
    add_memory(&system);
    for choice in [BoardChoice::Automatic, uio("pgs")] {
        // The control block in the file identifies itself; the DMA cores stay in reset.
        let error = error_of(&choice, &system);
        assert!(
            matches!(
                &error,
                OpenError::Core(DmaError::State { channel, .. })
                    if channel.to_string() == "dma0 MM2S"
            ),
            "{error}"
        );
    }
}

#[test]
fn another_bitstream_behind_the_node_is_refused_as_such() {
    let (_root, system) = system_with(|_| ());
    add_memory(&system);
    let error = error_of(&uio("pgs"), &system);
    assert!(matches!(error, OpenError::Identity(_)), "{error}");
}

#[test]
fn nothing_is_touched_before_a_bitstream_is_loaded() {
    let (_root, system) = system_with(bitstream::describe);
    add_memory(&system);
    fpga_fake::add_manager(&system, 0, ZYNQMP_MANAGER, "unknown");
    let before = fs::read(system.dev.join("uio1")).expect("read");
    let error = error_of(&uio("pgs"), &system);
    assert!(matches!(error, OpenError::Platform(PlatformError::NoBitstream { .. })), "{error}");
    assert!(fs::read(system.dev.join("uio1")).expect("read") == before);
}

#[test]
fn a_board_in_use_is_busy_until_it_is_closed() {
    let (_root, system) = system_with(bitstream::describe);
    add_memory(&system);
    let memory = MemoryChoice::Automatic;
    let first = find_in(&system, &uio("pgs"), &memory).expect("opened");
    let error = error_of(&uio("pgs"), &system);
    assert!(matches!(error, OpenError::Platform(PlatformError::Busy { .. })), "{error}");
    assert!(error.to_string().contains("Two worlds on one board"), "{error}");
    drop(first);
    find_in(&system, &uio("pgs"), &memory).expect("opened");
}

fn assert_busy(found: Result<Found, OpenError>, file: &str) {
    let error = found.expect_err("in use");
    assert!(
        matches!(&error, OpenError::Platform(PlatformError::Busy { path }) if path.ends_with(file)),
        "{file}: {error}"
    );
}

#[test]
fn two_boards_do_not_share_memory() {
    let (_root, system) = system_with(bitstream::describe);
    add_memory(&system);
    uio_fake::add_node(&system, 2, "pgs2", &uio_fake::regions());
    let memory = MemoryChoice::Automatic;
    let first = find_in(&system, &uio("pgs"), &memory).expect("opened");
    assert_busy(find_in(&system, &uio("pgs2"), &memory), "uio7");
    // The same memory through /dev/mem is refused, too.
    uio_fake::write(system.dev.join("mem"), "");
    let window = MemoryChoice::DevMem { window: 0x6000_0000..0x6000_1000 };
    assert_busy(find_in(&system, &uio("pgs2"), &window), "uio7");
    drop(first);
    let second = find_in(&system, &uio("pgs2"), &memory).expect("the first is closed");

    // A board with another buffer is free.
    for (name, text) in [("phys_addr", "0x70000000"), ("size", "4096"), ("sync_mode", "2")] {
        uio_fake::write(system.u_dma_buf.join("own").join(name), text);
    }
    let device = fs::File::create(system.dev.join("own"));
    device.and_then(|file| file.set_len(4096)).expect("resized");
    let own = MemoryChoice::UDmaBuf { name: "own".to_owned(), caching: Caching::WriteCombining };
    let first = find_in(&system, &uio("pgs"), &own).expect("nothing is shared");
    drop(second);
    assert_busy(find_in(&system, &uio("pgs2"), &own), "own");
    drop(first);
    find_in(&system, &uio("pgs2"), &own).expect("the first is closed");
}

#[test]
fn each_dma_core_behind_a_node_of_its_own_has_one_user() {
    let root = tempfile::tempdir().expect("a directory");
    let system = System::under(root.path());
    add_memory(&system);
    let regions = uio_fake::regions();
    uio_fake::add_node(&system, 0, "pgs-control", &regions[4..]);
    uio_fake::add_node(&system, 2, "pgs-dma1", &regions[1..2]);
    let core = crate::platform::UioDevice::open_in(&system, "pgs-dma1").expect("opened");
    let find = || find_in(&system, &BoardChoice::Automatic, &MemoryChoice::Automatic);
    assert_busy(find(), "uio2");
    drop(core);
    find().expect("nobody has it");
}

/// A system with a `/dev/mem`, and windows in it.
fn dev_mem() -> (tempfile::TempDir, System, DevMemWindows) {
    let root = tempfile::tempdir().expect("a directory");
    let system = System::under(root.path());
    uio_fake::write(system.dev.join("mem"), "");
    let device = fs::File::create(system.dev.join("mem"));
    device.and_then(|file| file.set_len(0x10_0000)).expect("resized");
    let windows = DevMemWindows {
        dma: [0, 0x1_0000, 0x2_0000, 0x3_0000],
        control: 0x4_0000,
        memory: 0x8_0000..0x9_0000,
    };
    (root, system, windows)
}

#[test]
fn a_board_without_an_interrupt_is_polled_once_a_millisecond() {
    let (_root, system, windows) = dev_mem();
    let found = find_in(&system, &BoardChoice::DevMem(windows), &MemoryChoice::Automatic);
    let Found { platform, .. } = found.expect("opened");
    let hour = Duration::from_secs(3600);
    for (timeout, least) in [(hour, 1000), (hour, 1000), (Duration::from_micros(300), 300)] {
        let before = platform.now();
        assert_eq!(platform.wait_interrupt(timeout).expect("polling"), None);
        let waited = platform.now() - before;
        assert!(waited >= Duration::from_micros(least) && waited < hour, "{waited:?}");
    }
}

#[test]
fn dev_mem_carries_registers_and_memory_of_one_board() {
    let (_root, system, windows) = dev_mem();
    let choice = BoardChoice::DevMem(windows);
    for memory in [MemoryChoice::Automatic, MemoryChoice::DevMem { window: 0xA_0000..0xB_0000 }] {
        let Found { platform, .. } = find_in(&system, &choice, &memory).expect("opened once");
        platform.window(RegisterMap::Dma(3)).expect("mapped").write32(4, 0x66);
        assert_eq!(fs::read(system.dev.join("mem")).expect("read")[0x3_0004], 0x66);
        let (address, _) = platform.memory().allocate(4).expect("there is room");
        let expected = if memory == MemoryChoice::Automatic { 0x8_0000 } else { 0xA_0000 };
        assert_eq!(address, expected);
        assert_busy(find_in(&system, &choice, &memory), "mem");
    }
    find_in(&system, &choice, &MemoryChoice::Automatic).expect("nobody has it");
}

#[test]
fn separate_nodes_are_a_board_and_an_absent_core_is_named() {
    let root = tempfile::tempdir().expect("a directory");
    let system = System::under(root.path());
    add_memory(&system);
    let regions = uio_fake::regions();
    uio_fake::add_node(&system, 0, "pgs-control", &regions[4..]);
    uio_fake::add_node(&system, 2, "pgs-dma1", &regions[1..2]);
    let found = find_in(&system, &BoardChoice::Automatic, &MemoryChoice::Automatic);
    let Found { platform, description } = found.expect("a board");
    assert_eq!(description.to_string(), "pgs (its UIO node is there)");
    assert_eq!(platform.window(RegisterMap::Control).expect("mapped").bytes(), 0x1000);
    platform.window(RegisterMap::Dma(1)).expect("mapped").write32(4, 0x55);
    assert_eq!(fs::read(system.dev.join("uio2")).expect("read")[4], 0x55);
    for core in [0, 2, 3, 4] {
        let error = platform.window(RegisterMap::Dma(core)).expect_err("absent").to_string();
        assert!(error.contains("found: pgs-dma1, pgs-control"), "{error}");
    }
}

#[test]
fn dev_mem_is_opened_on_request_only_and_refused_without_the_file() {
    let root = tempfile::tempdir().expect("a directory");
    let system = System::under(root.path());
    let error = error_of(&BoardChoice::DevMem(DevMemWindows::default()), &system);
    assert!(matches!(error, OpenError::Platform(PlatformError::NoDevice { .. })), "{error}");
}

#[test]
fn memory_is_taken_from_where_it_is_asked_for() {
    let (_root, system) = system_with(bitstream::describe);
    add_memory(&system);
    let open = |memory| find_in(&system, &uio("pgs"), &memory).map(|_| ());
    open(MemoryChoice::Uio { node: "pgs-memory".to_owned() }).expect("it is there");
    let other = open(MemoryChoice::Uio { node: "other".to_owned() }).expect_err("no such node");
    assert!(other.to_string().contains("\"other\""), "{other}");
    let name = "pgs".to_owned();
    let other = open(MemoryChoice::UDmaBuf { name, caching: Caching::Cached });
    let other = other.expect_err("no such buffer");
    assert!(matches!(other, OpenError::Platform(PlatformError::NoUDmaBuf { .. })), "{other}");
    let other = open(MemoryChoice::DevMem { window: 0..4096 }).expect_err("no such file");
    assert!(matches!(other, OpenError::Platform(PlatformError::NoDevice { .. })), "{other}");
}

#[cfg(feature = "emulation")]
#[test]
fn an_emulated_board_takes_no_other_memory() {
    let memory = MemoryChoice::Uio { node: "pgs-memory".to_owned() };
    let nothing = System::under(std::path::Path::new("/nonexistent"));
    let refused = find_in(&nothing, &BoardChoice::Automatic, &memory).expect_err("no board");
    assert!(matches!(refused, OpenError::EmulatedMemory), "{refused}");
}

#[test]
fn without_a_node_the_emulated_board_says_why_it_was_taken() {
    let system = System::under(std::path::Path::new("/nonexistent"));
    let found = find_in(&system, &BoardChoice::Automatic, &MemoryChoice::Automatic);
    if cfg!(feature = "emulation") {
        let description = found.expect("the emulated board").description;
        assert_eq!(description.kind, BoardKind::Emulated);
        assert_eq!(description.to_string(), "emulated (there is no UIO node named \"pgs\")");
    } else {
        assert!(matches!(found, Err(OpenError::NoEmulation { .. })));
    }
}

#[test]
fn the_manager_that_is_asked_is_the_logics_own_or_the_callers_choice() {
    let (_root, system) = system_with(bitstream::describe);
    add_memory(&system);
    let open = |manager: &ManagerChoice| {
        find(&uio("pgs"), &MemoryChoice::Automatic, manager, &system).map(|_| ())
    };
    fpga_fake::add_manager(&system, 0, "Xilinx Slave SelectMap FPGA Manager", "unknown");
    fpga_fake::add_manager(&system, 1, ZYNQMP_MANAGER, "operating");
    open(&ManagerChoice::Automatic).expect("fpga1 runs");
    let named = ManagerChoice::Device("fpga0".to_owned());
    let error = open(&named).expect_err("fpga0 does not");
    assert!(matches!(error, OpenError::Platform(PlatformError::NoBitstream { .. })), "{error}");

    fpga_fake::add_manager(&system, 0, ZYNQMP_MANAGER, "operating");
    let error = open(&ManagerChoice::Automatic).expect_err("which?");
    assert!(matches!(error, OpenError::Platform(PlatformError::SeveralManagers { .. })), "{error}");
    open(&named).expect("named");
}

#[test]
fn logic_that_the_kernel_did_not_load_is_opened_by_who_knows_that_it_runs() {
    let (_root, system) = system_with(bitstream::describe);
    add_memory(&system);
    fpga_fake::add_manager(&system, 0, ZYNQMP_MANAGER, "unknown");
    let open = |manager| find(&uio("pgs"), &MemoryChoice::Automatic, &manager, &system).map(|_| ());
    let error = Error::Open(open(ManagerChoice::Automatic).expect_err("unknown"));
    let next = error.next_step().expect("it depends on the state");
    assert!(next.contains("JTAG") && next.contains("--manager none"), "{next}");
    open(ManagerChoice::Unasked).expect("the caller knows");
}

#[test]
fn nodes_of_any_name_are_opened_one_for_all_regions_or_one_for_each() {
    let root = tempfile::tempdir().expect("a directory");
    let system = System::under(root.path());
    add_memory(&system);
    let regions = uio_fake::regions();
    uio_fake::add_node(&system, 0, "pgs@a0000000", &regions);
    uio_fake::add_node(&system, 1, "second-control", &regions[4..]);
    uio_fake::add_node(&system, 2, "second-dma1", &regions[1..2]);
    // A node of another board.
    uio_fake::add_node(&system, 3, "pgs-dma0", &regions[..1]);
    let find = |node: &str| find_in(&system, &uio(node), &MemoryChoice::Automatic);
    let one = find("pgs@a0000000").expect("one node");
    assert_eq!(one.description.to_string(), "pgs@a0000000 (asked for)");
    assert_eq!(one.platform.window(RegisterMap::Control).expect("mapped").bytes(), 0x1000);
    drop(one);
    let each = find("second").expect("two nodes");
    each.platform.window(RegisterMap::Dma(1)).expect("mapped").write32(4, 0x55);
    assert_eq!(fs::read(system.dev.join("uio2")).expect("read")[4], 0x55);
    let error = each.platform.window(RegisterMap::Dma(0)).expect_err("another board's").to_string();
    assert!(error.contains("\"second-dma0\" (found: second-dma1, second-control)"), "{error}");
}

#[test]
fn a_node_that_cannot_be_read_hides_no_board_and_may_be_the_one_that_is_missing() {
    let (_root, system) = system_with(bitstream::describe);
    add_memory(&system);
    let name = system.uio.join("uio0/name");
    fs::remove_file(&name).expect("removed");
    fs::create_dir(&name).expect("a directory is no text");
    let find = || find_in(&system, &BoardChoice::Automatic, &MemoryChoice::Automatic);
    drop(find().expect("pgs is there"));
    fs::remove_dir_all(system.uio.join("uio1")).expect("removed");
    let error = find().expect_err("uio0 may be it").to_string();
    assert!(error.contains("uio0/name"), "{error}");
}

#[cfg(feature = "emulation")]
#[test]
fn a_board_under_another_name_is_named_where_the_emulated_one_stands_in() {
    let root = tempfile::tempdir().expect("a directory");
    let system = System::under(root.path());
    uio_fake::add_node(&system, 4, "pgs@a0000000", &uio_fake::regions());
    let found = find_in(&system, &BoardChoice::Automatic, &MemoryChoice::Automatic);
    let reason = found.expect("the emulated board").description.reason;
    assert!(reason.contains("but uio4 \"pgs@a0000000\" has its regions"), "{reason}");
}
