//! Loading a bitstream and an overlay, and the errors if the kernel fails.

use std::os::unix::fs::symlink;

use super::*;

#[test]
fn an_installed_bitstream_is_loaded_by_its_name_and_the_overlay_follows() {
    let kernel = FakeKernel::vendor();
    let loaded = kernel.load(&kernel.installed(), true).expect("loaded");
    assert_eq!(loaded.firmware, "xilinx/zynq-pgs.bit.bin");
    assert!(!loaded.copied);
    assert_eq!((loaded.state_before.as_str(), loaded.state.as_str()), ("unknown", OPERATING));
    assert_eq!(loaded.overlay, Some("pgs"));
    assert_eq!(loaded.nodes.len(), 1);
    assert_eq!(loaded.nodes[0].device, "uio4");
    let written = kernel.written();
    assert_eq!(written[0], pair("sys/class/fpga_manager/fpga0/flags", "0"));
    let firmware = "sys/class/fpga_manager/fpga0/firmware";
    assert_eq!(written[1], pair(firmware, "xilinx/zynq-pgs.bit.bin"));
    assert_eq!(written[2].0, format!("{OVERLAYS}/pgs/dtbo"));
    assert_eq!(kernel.writes.borrow()[2].1, tree());
    assert_eq!(written.len(), 3);
}

#[test]
fn a_bitstream_from_elsewhere_is_copied_while_it_is_loaded() {
    let kernel = FakeKernel::vendor();
    let file = kernel.elsewhere();
    // The fake kernel loads only a file that it finds under the name.
    let loaded = kernel.load(&file, false).expect("loaded");
    assert!(loaded.copied);
    let left = fs::read_dir(kernel.path("lib/firmware")).expect("the folder").count();
    assert_eq!(left, 0, "the copy goes");
    assert!(file.exists());

    kernel.state_after.set("write error");
    kernel.load(&file, false).expect_err("failed");
    let left = fs::read_dir(kernel.path("lib/firmware")).expect("the folder").count();
    assert_eq!(left, 0, "the copy goes, too, when loading fails");
}

#[test]
fn a_firmware_folder_behind_a_link_is_the_firmware_folder() {
    let kernel = FakeKernel::vendor();
    kernel.remove("lib");
    let file = kernel.bytes("usr/lib/firmware/zynq-pgs.bit.bin", &bitstream());
    symlink("usr/lib", kernel.path("lib")).expect("linked");
    let loaded = kernel.load(&file, false).expect("loaded");
    assert_eq!((loaded.firmware.as_str(), loaded.copied), ("zynq-pgs.bit.bin", false));
}

#[test]
fn the_flag_of_a_partial_bitstream_is_cleared_and_a_manager_without_flags_loads_too() {
    let kernel = FakeKernel::vendor();
    kernel.load(&kernel.installed(), false).expect("loaded");
    assert_eq!(kernel.written()[0], pair("sys/class/fpga_manager/fpga0/flags", "0"));

    let kernel = FakeKernel::vendor();
    kernel.remove("sys/class/fpga_manager/fpga0/flags");
    kernel.load(&kernel.installed(), false).expect("loaded");
}

#[test]
fn a_state_that_is_not_operating_is_a_hardware_failure_and_ends_it() {
    for (state, message) in [
        ("write error", "refused the bitstream; its state is \"write error\""),
        ("unknown", "its state is \"unknown\" instead of \"operating\""),
    ] {
        let kernel = FakeKernel::vendor();
        kernel.state_after.set(state);
        kernel.file("sys/class/fpga_manager/fpga0/status", "reconfig CRC error");
        let error = kernel.load(&kernel.installed(), true).expect_err("failed");
        assert_eq!(error.at_fault(), AtFault::Logic);
        let text = error.to_string();
        assert!(text.contains(message) && text.contains("(reconfig CRC error)"), "{text}");
        assert_eq!(kernel.written().len(), 2, "no overlay on logic that does not run");
    }
}

#[test]
fn an_overlay_that_the_kernel_drops_is_removed_and_said() {
    let kernel = FakeKernel::vendor();
    kernel.status_after.set("unapplied");
    let error = kernel.load(&kernel.installed(), true).expect_err("not applied");
    assert_eq!(error.at_fault(), AtFault::System);
    assert!(error.to_string().contains("found \"unapplied\""), "{error}");
    assert!(!kernel.path(&format!("{OVERLAYS}/pgs")).exists());

    let kernel = FakeKernel::vendor();
    kernel.binds.set(false);
    let error = kernel.load(&kernel.installed(), true).expect_err("no node");
    assert!(error.to_string().contains("no UIO node \"pgs\""), "{error}");
    assert!(error.next().contains("of_id=generic-uio"), "{}", error.next());
}

#[test]
fn the_folder_that_the_kernel_looks_into_first_is_a_firmware_folder() {
    let kernel = FakeKernel::vendor();
    kernel.file("sys/module/firmware_class/parameters/path", "/data/firmware");
    let file = kernel.bytes("data/firmware/zynq-pgs.bit.bin", &bitstream());
    let loaded = kernel.load(&file, false).expect("loaded");
    assert_eq!((loaded.firmware.as_str(), loaded.copied), ("zynq-pgs.bit.bin", false));
    let loaded = kernel.load(&kernel.elsewhere(), false).expect("loaded");
    assert!(loaded.copied, "into that folder, where the kernel finds it");
    // The kernel would load another file of the same name.
    let hidden = kernel.bytes("lib/firmware/zynq-pgs.bit.bin", &bitstream());
    kernel.bytes("data/firmware/zynq-pgs.bit.bin", b"another");
    assert!(kernel.load(&hidden, false).expect("loaded").copied);
}
