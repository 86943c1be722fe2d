//! Refusals before anything is written.

use super::*;

#[test]
fn a_kernel_without_a_manager_or_without_its_firmware_file_is_refused() {
    let kernel = FakeKernel::vendor();
    let file = kernel.installed();
    kernel.remove("sys/class/fpga_manager/fpga0/firmware");
    let error = kernel.load(&file, true).expect_err("mainline");
    assert_refused(&kernel, &error, "mainline", "vendor's kernel");
    kernel.remove("sys/class/fpga_manager/fpga0");
    let error = kernel.load(&file, true).expect_err("no manager");
    assert_refused(&kernel, &error, "no FPGA manager", "CONFIG_FPGA_MGR_ZYNQMP_FPGA");
    kernel.remove("sys/class/fpga_manager");
    let error = kernel.load(&file, true).expect_err("no class");
    assert_refused(&kernel, &error, "no FPGA manager", "CONFIG_FPGA_MGR_ZYNQMP_FPGA");
}

#[test]
fn a_node_that_a_program_has_open_keeps_the_bitstream() {
    let kernel = FakeKernel::vendor();
    let file = kernel.installed();
    kernel.add_node(0, "axi-pmon");
    kernel.add_node(3, "pgs-dma1");
    kernel.add_process(17, "monitor", "/dev/uio0");
    kernel.add_process(18, "shell", "/dev/uio33");
    kernel.load(&file, false).expect("another device is no obstacle");
    kernel.writes.borrow_mut().clear();
    kernel.add_process(4711, "game", "/dev/uio3");
    let error = kernel.load(&file, false).expect_err("in use");
    assert_refused(&kernel, &error, "/dev/uio3 (\"pgs-dma1\")", "stop");
    assert!(error.to_string().contains("process 4711 (game)"), "{error}");
}

#[test]
fn all_memory_that_a_program_has_open_keeps_the_bitstream() {
    let kernel = FakeKernel::vendor();
    let file = kernel.installed();
    // Even where no node exists yet.
    kernel.add_process(4711, "peek", "/dev/mem");
    let error = kernel.load(&file, false).expect_err("in use");
    assert_refused(&kernel, &error, "/dev/mem is open in process 4711 (peek)", "stop");
    kernel.remove("proc/4711");
    kernel.add_process(4711, "peek", "/dev/memory");
    kernel.load(&file, false).expect("another file");
}

#[test]
fn a_mapping_without_an_open_file_keeps_the_bitstream_too() {
    let kernel = FakeKernel::vendor();
    let file = kernel.installed();
    kernel.add_node(3, "pgs");
    let line = |file| format!("ffff8000-ffff9000 rw-s 00004000 00:06 431 {:20}{file}\n", "");
    kernel.add_process(21, "other", "/dev/null");
    kernel.file("proc/21/maps", &(line("/dev/uio33") + &line("")));
    kernel.load(&file, false).expect("another device is no obstacle");
    kernel.writes.borrow_mut().clear();
    for device in ["/dev/uio3", "/dev/mem"] {
        kernel.file("proc/21/maps", &(line("/usr/bin/other") + &line(device)));
        let error = kernel.load(&file, false).expect_err("in use");
        assert_refused(&kernel, &error, "is open in process 21 (other)", "stop");
        assert!(error.to_string().starts_with(device), "{error}");
    }
}

#[test]
fn a_program_that_starts_while_the_bitstream_is_copied_keeps_it() {
    for device in ["/dev/uio3", "/dev/mem"] {
        let kernel = FakeKernel::vendor();
        kernel.add_node(3, "pgs");
        let file = kernel.elsewhere();
        kernel.opened_meanwhile.set(Some(device));
        let error = kernel.load(&file, false).expect_err("in use");
        assert_refused(&kernel, &error, "process 4712 (late)", "stop");
        assert!(error.to_string().starts_with(device), "{error}");
        let left = fs::read_dir(kernel.path("lib/firmware")).expect("the folder").count();
        assert_eq!(left, 0, "the copy goes");
    }
}

#[test]
fn without_rights_the_path_and_root_are_named() {
    for (denied, path, programmed) in [
        ("flags", "fpga0/flags", false),
        ("fpga0/firmware", "fpga0/firmware", false),
        ("lib/firmware", "lib/firmware/pgs-load-", false),
        ("overlays/pgs", "overlays/pgs", true),
    ] {
        let kernel = FakeKernel::vendor();
        kernel.denied.set(denied);
        let file = kernel.elsewhere();
        let error = kernel.load(&file, true).expect_err("denied");
        assert_eq!(error.at_fault(), AtFault::System);
        assert!(error.to_string().contains(path), "{error}");
        assert!(error.next().contains("root"), "{}", error.next());
        let state = fs::read_to_string(kernel.path("sys/class/fpga_manager/fpga0/state"));
        assert_eq!(state.expect("a state").trim() == OPERATING, programmed, "{denied}");
    }
}

#[test]
fn an_overlay_or_a_node_that_is_there_already_is_not_doubled() {
    let kernel = FakeKernel::vendor();
    let file = kernel.installed();
    kernel.load(&file, true).expect("the first time");
    kernel.writes.borrow_mut().clear();
    let error = kernel.load(&file, true).expect_err("the second time");
    assert_refused(&kernel, &error, "is there already, applied", "overlays/pgs`");
    kernel.load(&file, false).expect("the bitstream alone");
    kernel.writes.borrow_mut().clear();

    kernel.remove(&format!("{OVERLAYS}/pgs"));
    let error = kernel.load(&file, true).expect_err("a node of the base tree");
    assert_refused(&kernel, &error, "\"pgs\" (/dev/uio4)", "leave out --overlay");
    kernel.remove("sys/class/uio/uio4");
    kernel.add_node(1, "pgs-memory");
    kernel.add_node(2, "pgs-guard");
    kernel.load(&file, true).expect("memory is in the base tree, and no obstacle");
}

#[test]
fn a_kernel_without_overlays_is_refused_before_the_bitstream_is_touched() {
    let kernel = FakeKernel::vendor();
    let file = kernel.installed();
    kernel.remove("sys/kernel/config/device-tree");
    let error = kernel.load(&file, true).expect_err("not mounted");
    assert_refused(&kernel, &error, "not mounted", "mount -t configfs configfs");
    fs::create_dir(kernel.path("sys/kernel/config/usb_gadget")).expect("made");
    let error = kernel.load(&file, true).expect_err("mainline");
    assert_refused(&kernel, &error, "mainline", "CONFIG_OF_CONFIGFS");
    kernel.load(&file, false).expect("the bitstream alone");
}

#[test]
fn files_of_another_kind_are_wrong_input() {
    let kernel = FakeKernel::vendor();
    let tree = kernel.bytes("tree.dtbo", &tree());
    let program = kernel.path("program");
    fs::write(&program, b"\x7fELF").expect("written");
    let empty = kernel.path("empty");
    fs::write(&empty, "").expect("written");
    for (bitstream, found) in [
        (tree, "a compiled device tree"),
        (program, "no sync word"),
        (empty, "an empty file"),
        (kernel.path("lib"), "no plain file"),
        (kernel.path("absent"), "cannot read"),
    ] {
        let error = kernel.load(&bitstream, false).expect_err("wrong");
        assert_eq!(error.at_fault(), AtFault::Caller, "{error}");
        assert!(error.to_string().contains(found), "{error}");
    }
    let overlay = Some(kernel.file("zynq-pgs.dtso", "/dts-v1/;"));
    let request = Request { overlay, ..request(&kernel.installed()) };
    let error = kernel.ask(&request).expect_err("a source");
    assert_eq!(error.at_fault(), AtFault::Caller, "{error}");
    assert!(error.next().contains("dtc -@"), "{}", error.next());
    assert_eq!(kernel.written(), []);
}

#[test]
fn what_the_kernel_would_misread_is_refused_before_anything_is_written() {
    let kernel = FakeKernel::vendor();
    let bit = b"\x00\x09\x0f\xf0\x0f\xf0\x0f\xf0\x0f\xf0\x00\x00\x01a\x00\x10design_1";
    for (name, bytes, message, next) in [
        ("vivado.bit", &bit[..], "Vivado's .bit", "bootgen -image x.bif -arch zynqmp"),
        ("x.bin", b"\xff\xff\xff\xff\xaa\x99\x55\x66", "not turned", "objcopy"),
        ("x.bit.bin.gz", b"\x1f\x8b\x08", "no sync word", "README"),
        ("zeros", &[0; 2000], "no sync word", "README"),
    ] {
        // Also in the kernel's own folder.
        for folder in ["home", "lib/firmware"] {
            let file = kernel.bytes(&format!("{folder}/{name}"), bytes);
            let error = kernel.load(&file, true).expect_err("wrong");
            assert_eq!(error.at_fault(), AtFault::Caller, "{error}");
            assert!(error.to_string().contains(message), "{error}");
            assert!(error.next().contains(next), "{}", error.next());
        }
    }
    let whole = tree();
    let cut = kernel.bytes("home/cut.dtbo", &whole[..12]);
    let request = Request { overlay: Some(cut), ..request(&kernel.installed()) };
    let error = kernel.ask(&request).expect_err("cut off");
    let length = whole.len();
    assert!(
        error.to_string().contains(&format!("the first 12 bytes of one of {length}")),
        "{error}"
    );
    assert_eq!(kernel.written(), []);
}
