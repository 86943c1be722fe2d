//! Tests how `load` recognises other users of the logic, whatever their names, and the manager that
//! programs it.

use zynq_pgs::platform::DeviceLock;

use super::*;

#[test]
fn a_node_in_the_logic_counts_whatever_its_name() {
    // Each window of the logic, under a foreign name.
    for (name, address) in [
        ("pgs@a0000000", 0xA000_0000),
        ("another-design", 0x8000_0000),
        ("fabric", 0xBFFF_F000),
        ("high", 0x5_0000_0000),
        ("higher", 0x48_0000_0000),
    ] {
        let kernel = FakeKernel::vendor();
        kernel.add_region(5, name, "registers", address);
        kernel.add_region(6, "axi-pmon", "registers", 0xFD0B_0000);
        kernel.add_process(17, "monitor", "/dev/uio6");
        kernel.load(&kernel.installed(), false).expect("another device is no obstacle");
        kernel.writes.borrow_mut().clear();
        kernel.add_process(4711, "game", "/dev/uio5");
        let error = kernel.load(&kernel.installed(), false).expect_err("in use");
        assert_refused(&kernel, &error, &format!("/dev/uio5 ({name:?})"), "stop");
        assert!(error.to_string().contains("process 4711 (game)"), "{error}");
    }
}

#[test]
fn a_node_that_cannot_be_read_may_be_of_the_logic_and_hides_no_other() {
    let kernel = FakeKernel::vendor();
    kernel.add_region(2, "foreign", "registers", 0xFD0B_0000);
    kernel.file("sys/class/uio/uio2/maps/map0/size", "large");
    kernel.add_node(3, "pgs");
    kernel.load(&kernel.installed(), false).expect("nobody has it");
    kernel.writes.borrow_mut().clear();
    kernel.add_process(17, "monitor", "/dev/uio2");
    let error = kernel.load(&kernel.installed(), false).expect_err("in use");
    assert_refused(&kernel, &error, "/dev/uio2 (\"foreign\")", "stop");
}

#[test]
fn a_device_file_in_another_place_is_the_same_device() {
    let kernel = FakeKernel::vendor();
    kernel.add_region(3, "design", "registers", 0xA000_0000);
    // /dev/null stands for the node: 1:3 is its number.
    kernel.file("sys/class/uio/uio3/dev", "1:3");
    kernel.add_process(17, "contained", "/dev/null");
    let error = kernel.load(&kernel.installed(), false).expect_err("in use");
    assert_refused(&kernel, &error, "process 17 (contained)", "stop");

    let kernel = FakeKernel::vendor();
    kernel.add_region(3, "design", "registers", 0xA000_0000);
    kernel.add_process(18, "jailed", "/srv/jail/dev/uio3");
    let error = kernel.load(&kernel.installed(), false).expect_err("in use");
    assert_refused(&kernel, &error, "process 18 (jailed)", "stop");
}

/// Adds an overlay with its status to configfs.
fn add_overlay(kernel: &FakeKernel, mount: &str, name: &str, status: &str) {
    let overlay = format!("{mount}/device-tree/overlays/{name}");
    kernel.file(&format!("{overlay}/status"), status);
    kernel.file(&format!("{overlay}/path"), &format!("{name}.dtbo"));
}

#[test]
fn logic_under_another_overlay_is_not_replaced_unless_that_is_asked_for() {
    for (mount, mounts) in [
        ("sys/kernel/config", ""),
        ("configfs", ""),
        ("mnt/config", "none /mnt/config configfs rw 0 0"),
    ] {
        let kernel = FakeKernel::vendor();
        kernel.remove("sys/kernel/config/device-tree");
        kernel.file("proc/mounts", mounts);
        // An overlay that was never filled, and our own.
        add_overlay(&kernel, mount, "empty", "unapplied");
        add_overlay(&kernel, mount, "pgs", "applied");
        kernel.load(&kernel.installed(), false).expect("no obstacle");
        kernel.writes.borrow_mut().clear();
        add_overlay(&kernel, mount, "k26-starter-kits_image_1", "applied");
        let error = kernel.load(&kernel.installed(), false).expect_err("bound");
        assert_refused(
            &kernel,
            &error,
            "\"k26-starter-kits_image_1\" (applied)",
            "xmutil unloadapp",
        );
        let place = format!("{mount}/device-tree/overlays/k26-starter-kits_image_1");
        assert!(error.next().contains(&place), "{}", error.next());
        assert!(error.next().contains("--replace-others"), "{}", error.next());
        let request = Request { replace_others: true, ..request(&kernel.installed()) };
        kernel.ask(&request).expect("asked for");
    }
}

#[test]
fn an_overlay_whose_status_is_not_known_counts_and_ours_under_another_name_does() {
    let kernel = FakeKernel::vendor();
    fs::create_dir(kernel.path(&format!("{OVERLAYS}/zynq-pgs"))).expect("made");
    let error = kernel.load(&kernel.installed(), false).expect_err("what is it?");
    assert_refused(&kernel, &error, "\"zynq-pgs\" (its status cannot be read", "rmdir");
}

#[test]
fn a_driver_of_the_kernel_that_is_bound_to_the_logic_keeps_it() {
    let kernel = FakeKernel::vendor();
    let bind = |device: &str, driver: &str| bind(&kernel, device, driver);
    bind("ff000000.serial", "xuartps");
    bind("a0000000.pgs", "uio_pdrv_genirq");
    bind("firmware:zynqmp-firmware", "zynqmp_firmware");
    fs::create_dir_all(kernel.path("sys/bus/platform/devices/a0050000.free")).expect("made");
    kernel.load(&kernel.installed(), false).expect("no obstacle");
    kernel.writes.borrow_mut().clear();
    bind("a0010000.dma", "xilinx-vdma");
    let error = kernel.load(&kernel.installed(), false).expect_err("bound");
    assert_refused(&kernel, &error, "xilinx-vdma to a0010000.dma", "--replace-others");
    let request = Request { replace_others: true, ..request(&kernel.installed()) };
    kernel.ask(&request).expect("asked for");
}

/// Binds a driver to a device without an address.
fn bind(kernel: &FakeKernel, device: &str, name: &str) {
    let device = kernel.path(&format!("sys/bus/platform/devices/{device}"));
    fs::create_dir_all(&device).expect("made");
    symlink(format!("../../drivers/{name}"), device.join("driver")).expect("linked");
}

/// Adds a DRM node of a platform device.
fn add_drm(kernel: &FakeKernel, node: &str, device: &str) {
    let class = kernel.path(&format!("sys/class/drm/{node}"));
    fs::create_dir_all(&class).expect("made");
    let device = kernel.path(&format!("sys/bus/platform/devices/{device}"));
    symlink(device, class.join("device")).expect("linked");
}

#[test]
fn a_driver_for_the_logic_whose_device_has_no_address_keeps_it() {
    for (device, name) in [
        ("axi:zyxclmm_drm", "zocl-drm"),
        ("axi:dma-proxy", "dma_proxy_driver"),
        ("axidma_chrdev", "axidma"),
    ] {
        let kernel = FakeKernel::vendor();
        bind(&kernel, "axi:pgs-buffer", "u-dma-buf");
        bind(&kernel, "axi:pgs-clock", "fclk");
        kernel.load(&kernel.installed(), false).expect("what the overlays of this project bind");
        kernel.writes.borrow_mut().clear();
        bind(&kernel, device, name);
        let error = kernel.load(&kernel.installed(), false).expect_err("bound");
        assert_refused(&kernel, &error, &format!("{name} to {device}"), "--replace-others");
    }
}

#[test]
fn whoever_has_another_drivers_device_file_of_the_logic_open_uses_it() {
    for (file, text) in [
        ("/dev/dri/renderD128", "/dev/dri/renderD128 (zocl)"),
        ("/dev/dma_proxy_tx", "/dev/dma_proxy_tx"),
        ("/dev/axidma", "/dev/axidma"),
        ("/dev/udmabuf0", "/dev/udmabuf0 (u-dma-buf)"),
        ("/dev/camera", "/dev/camera (u-dma-buf)"),
    ] {
        let kernel = FakeKernel::vendor();
        bind(&kernel, "axi:zyxclmm_drm", "zocl");
        add_drm(&kernel, "renderD128", "axi:zyxclmm_drm");
        bind(&kernel, "fd4a0000.display", "zynqmp-dpsub");
        add_drm(&kernel, "card0", "fd4a0000.display");
        kernel.file("sys/class/udmabuf/udmabuf0/size", "4096");
        kernel.file("sys/class/u-dma-buf/camera/size", "4096");
        for file in ["dma_proxy_tx", "axidma", "udmabuf0", "camera"] {
            kernel.file(&format!("dev/{file}"), "");
        }
        kernel.add_process(17, "desktop", "/dev/dri/card0");
        // Also where bound drivers are no obstacle.
        let request = Request { replace_others: true, ..request(&kernel.installed()) };
        kernel.ask(&request).expect("a display of the processing system");
        kernel.writes.borrow_mut().clear();
        kernel.add_process(4711, "xrt", file);
        let error = kernel.ask(&request).expect_err("in use");
        assert_refused(&kernel, &error, &format!("{text} is open in process 4711 (xrt)"), "stop");
    }
}

#[test]
fn a_locked_device_file_keeps_the_logic_where_no_process_shows() {
    let kernel = FakeKernel::vendor();
    kernel.add_region(0, "design", "registers", 0xA000_0000);
    kernel.add_region(2, "pmon", "registers", 0xFD0B_0000);
    kernel.add_node(1, "pgs-memory");
    kernel.file("sys/class/u-dma-buf/pgs/size", "4096");
    let file = |name: &str| kernel.file(&format!("dev/{name}"), "");
    for (name, text) in [
        ("uio0", "/dev/uio0 (\"design\")"),
        ("uio1", "/dev/uio1 (\"pgs-memory\")"),
        ("pgs", "/dev/pgs (u-dma-buf)"),
        ("mem", "/dev/mem"),
    ] {
        let held = DeviceLock::new(&file(name)).expect("free");
        let error = kernel.load(&kernel.installed(), false).expect_err("locked");
        assert_refused(&kernel, &error, &format!("{text} is locked"), "fuser /dev/");
        drop(held);
    }
    let _foreign = DeviceLock::new(&file("uio2")).expect("free");
    kernel.load(&kernel.installed(), false).expect("nobody has the logic's");
}

#[test]
fn the_locks_are_held_while_the_logic_is_programmed_and_free_afterwards() {
    let kernel = FakeKernel::vendor();
    kernel.add_region(0, "design", "registers", 0xA000_0000);
    let node = kernel.file("dev/uio0", "");
    kernel.tries.replace(Some(node.clone()));
    kernel.load(&kernel.installed(), false).expect("loaded");
    assert_eq!(kernel.tried.get(), Some(false), "a driver was refused meanwhile");
    kernel.state_after.set("write error");
    kernel.load(&kernel.installed(), false).expect_err("failed");
    kernel.try_device();
    assert_eq!(kernel.tried.get(), Some(true), "free");
}

/// Adds the manager `fpga<number>`.
fn add_manager(kernel: &FakeKernel, number: u32, name: &str) {
    for (file, text) in [("name", name), ("state", "operating"), ("flags", "0"), ("firmware", "")] {
        kernel.file(&format!("sys/class/fpga_manager/fpga{number}/{file}"), text);
    }
}

#[test]
fn the_bitstream_goes_to_the_logics_own_manager_by_its_name() {
    const OWN: &str = "Xilinx ZynqMP FPGA Manager";
    const OTHER: &str = "Xilinx Slave SelectMap FPGA Manager";
    let kernel = FakeKernel::vendor();
    add_manager(&kernel, 0, OTHER);
    add_manager(&kernel, 1, OWN);
    let loaded = kernel.load(&kernel.installed(), false).expect("loaded");
    assert_eq!((loaded.manager.as_str(), loaded.manager_name.as_str()), ("fpga1", OWN));
    let written = kernel.written();
    assert!(written.iter().all(|(path, _)| path.contains("/fpga1/")), "{written:?}");
    kernel.writes.borrow_mut().clear();

    add_manager(&kernel, 0, OWN);
    let error = kernel.load(&kernel.installed(), false).expect_err("which?");
    assert_refused(
        &kernel,
        &error,
        "several FPGA managers",
        "name the one that programs this logic with --manager",
    );
    let to = |manager| Request { manager, ..request(&kernel.installed()) };
    let named = to(ManagerChoice::Device("fpga0".to_owned()));
    assert_eq!(kernel.ask(&named).expect("named").manager, "fpga0");
    kernel.writes.borrow_mut().clear();

    add_manager(&kernel, 0, "Xilinx Versal FPGA Manager");
    add_manager(&kernel, 1, OTHER);
    let error = kernel.load(&kernel.installed(), false).expect_err("none of them");
    assert_refused(&kernel, &error, "no FPGA manager is named \"Xilinx ZynqMP", "pgs list");
    let error = kernel.ask(&to(ManagerChoice::Device("fpga7".to_owned()))).expect_err("absent");
    assert_refused(&kernel, &error, "no FPGA manager \"fpga7\" (found: fpga0", "pgs list");
    let error = kernel.ask(&to(ManagerChoice::Unasked)).expect_err("none");
    assert_eq!(error.at_fault(), AtFault::Caller);
    assert_eq!(kernel.written(), []);
}
