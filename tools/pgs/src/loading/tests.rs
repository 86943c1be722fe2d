//! Loading on a kernel made of files, which reacts to what is written as the vendor's does.

use std::cell::{Cell, RefCell};
use std::io;
use std::os::unix::fs::symlink;

use tempfile::TempDir;

use super::*;
use crate::failure::Cause;

const OVERLAYS: &str = "sys/kernel/config/device-tree/overlays";

/// A kernel that programs logic and applies overlays.
#[derive(Debug)]
struct FakeKernel {
    root: TempDir,
    /// Every write: the path below the root, and what.
    writes: RefCell<Vec<(String, Vec<u8>)>>,
    /// The state after programming; the write itself fails if it is an error.
    state_after: Cell<&'static str>,
    status_after: Cell<&'static str>,
    denied: Cell<&'static str>,
    /// Whether a UIO driver binds to the overlay's node.
    binds: Cell<bool>,
    /// What a program opens while the bitstream is copied.
    opened_meanwhile: Cell<Option<&'static str>>,
}

impl FakeKernel {
    /// The vendor's kernel on a board without a bitstream.
    fn vendor() -> Self {
        let kernel = Self {
            root: tempfile::tempdir().expect("a directory"),
            writes: RefCell::default(),
            state_after: Cell::new(OPERATING),
            status_after: Cell::new("applied"),
            denied: Cell::new("nothing"),
            binds: Cell::new(true),
            opened_meanwhile: Cell::default(),
        };
        for (file, text) in
            [("name", "Xilinx ZynqMP FPGA Manager"), ("state", "unknown"), ("flags", "0")]
        {
            kernel.file(&format!("sys/class/fpga_manager/fpga0/{file}"), text);
        }
        kernel.file("sys/class/fpga_manager/fpga0/firmware", "");
        fs::create_dir_all(kernel.path(OVERLAYS)).expect("made");
        fs::create_dir_all(kernel.path("lib/firmware")).expect("made");
        kernel
    }

    fn file(&self, path: &str, text: &str) -> PathBuf {
        let path = self.path(path);
        fs::create_dir_all(path.parent().expect("below the root")).expect("made");
        fs::write(&path, format!("{text}\n")).expect("written");
        path
    }

    fn remove(&self, path: &str) {
        let path = self.path(path);
        let removed = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
        removed.expect("removed");
    }

    fn add_node(&self, number: u32, name: &str) {
        self.file(&format!("sys/class/uio/uio{number}/name"), name);
    }

    /// A process that has a file open.
    fn add_process(&self, id: u32, comm: &str, open: &str) {
        self.file(&format!("proc/{id}/comm"), comm);
        let files = self.path(&format!("proc/{id}/fd"));
        fs::create_dir_all(&files).expect("made");
        symlink(open, files.join("7")).expect("linked");
    }

    /// Loads a bitstream, with an overlay or without.
    fn load(&self, bitstream: &Path, overlay: bool) -> Result<Loaded, LoadError> {
        let tree = self.path("home/zynq-pgs.dtbo");
        fs::create_dir_all(self.path("home")).expect("made");
        fs::write(&tree, [&DEVICE_TREE_MAGIC[..], b"the rest"].concat()).expect("written");
        let overlay = overlay.then_some(tree);
        load(self, &Request { bitstream: bitstream.to_owned(), overlay, partial: false })
    }

    /// A bitstream in the firmware folder.
    fn installed(&self) -> PathBuf {
        self.file("lib/firmware/xilinx/zynq-pgs.bit.bin", "a bitstream")
    }

    fn written(&self) -> Vec<(String, String)> {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        self.writes.borrow().iter().map(|(path, bytes)| (path.clone(), text(bytes))).collect()
    }

    fn allow(&self, path: &Path) -> io::Result<()> {
        match path.ends_with(self.denied.get()) {
            true => Err(io::ErrorKind::PermissionDenied.into()),
            false => Ok(()),
        }
    }
}

impl System for FakeKernel {
    fn path(&self, path: &str) -> PathBuf {
        self.root.path().join(path)
    }

    fn write(&self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        self.allow(path)?;
        assert!(path.exists(), "{} is not an attribute", path.display());
        let below = path.strip_prefix(self.root.path()).expect("below the root");
        self.writes.borrow_mut().push((below.display().to_string(), bytes.to_owned()));
        if path.ends_with("firmware") {
            let name = std::str::from_utf8(bytes).expect("a name");
            let firmware = self.path("lib/firmware").join(name);
            let found = fs::read_to_string(firmware).is_ok_and(|text| text == "a bitstream\n");
            let state = if found { self.state_after.get() } else { "firmware request error" };
            self.file("sys/class/fpga_manager/fpga0/state", state);
            if state.ends_with("error") {
                return Err(io::Error::other("the manager said no"));
            }
        }
        if path.ends_with("dtbo") {
            self.file(&format!("{OVERLAYS}/pgs/status"), self.status_after.get());
            if self.binds.get() && self.status_after.get() == "applied" {
                self.add_node(4, "pgs");
            }
        }
        Ok(())
    }

    fn make_directory(&self, path: &Path) -> io::Result<()> {
        self.allow(path)?;
        fs::create_dir(path)?;
        fs::write(path.join("dtbo"), "")?;
        fs::write(path.join("status"), "unapplied\n")
    }

    fn remove_directory(&self, path: &Path) -> io::Result<()> {
        // Attributes of the kernel's are no obstacle.
        fs::remove_dir_all(path)
    }

    fn copy(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.allow(to.parent().expect("a folder"))?;
        if let Some(device) = self.opened_meanwhile.get() {
            self.add_process(4712, "late", device);
        }
        Linux { root: PathBuf::new() }.copy(from, to)
    }
}

fn pair(path: &str, text: &str) -> (String, String) {
    (path.to_owned(), text.to_owned())
}

/// Asserts that nothing was touched, and that cause, message and next step are as expected.
fn assert_refused(kernel: &FakeKernel, error: &LoadError, message: &str, next: &str) {
    assert_eq!(kernel.written(), [], "{error}");
    assert_eq!(error.cause(), Cause::NoBoard, "{error}");
    assert!(error.to_string().contains(message), "{error}");
    assert!(error.next().contains(next), "{}", error.next());
}

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
    assert_eq!(kernel.writes.borrow()[2].1, b"\xD0\x0D\xFE\xEDthe rest");
    assert_eq!(written.len(), 3);
}

#[test]
fn a_bitstream_from_elsewhere_is_copied_while_it_is_loaded() {
    let kernel = FakeKernel::vendor();
    let file = kernel.file("home/zynq-pgs.bit.bin", "a bitstream");
    // The fake loads only what it finds under the name.
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
    let file = kernel.file("usr/lib/firmware/zynq-pgs.bit.bin", "a bitstream");
    symlink("usr/lib", kernel.path("lib")).expect("linked");
    let loaded = kernel.load(&file, false).expect("loaded");
    assert_eq!((loaded.firmware.as_str(), loaded.copied), ("zynq-pgs.bit.bin", false));
}

#[test]
fn a_partial_bitstream_sets_the_flag_or_is_refused_without_one() {
    let kernel = FakeKernel::vendor();
    let request = Request { bitstream: kernel.installed(), overlay: None, partial: true };
    load(&kernel, &request).expect("loaded");
    assert_eq!(kernel.written()[0], pair("sys/class/fpga_manager/fpga0/flags", "1"));

    let kernel = FakeKernel::vendor();
    kernel.remove("sys/class/fpga_manager/fpga0/flags");
    let bitstream = kernel.installed();
    let full = Request { bitstream, partial: false, ..request };
    let error = load(&kernel, &Request { partial: true, ..full.clone() }).expect_err("refused");
    assert_refused(&kernel, &error, "no file \"flags\"", "without --partial");
    load(&kernel, &full).expect("a full one needs no flags");
}

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
    // Also where there is no node yet.
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
        let file = kernel.file("home/zynq-pgs.bit.bin", "a bitstream");
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
        let file = kernel.file("home/zynq-pgs.bit.bin", "a bitstream");
        let error = kernel.load(&file, true).expect_err("denied");
        assert_eq!(error.cause(), Cause::NoBoard);
        assert!(error.to_string().contains(path), "{error}");
        assert!(error.next().contains("root"), "{}", error.next());
        let state = fs::read_to_string(kernel.path("sys/class/fpga_manager/fpga0/state"));
        assert_eq!(state.expect("a state").trim() == OPERATING, programmed, "{denied}");
    }
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
        assert_eq!(error.cause(), Cause::Hardware);
        let text = error.to_string();
        assert!(text.contains(message) && text.contains("(reconfig CRC error)"), "{text}");
        assert_eq!(kernel.written().len(), 2, "no overlay on logic that does not run");
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
fn an_overlay_that_the_kernel_drops_is_removed_and_said() {
    let kernel = FakeKernel::vendor();
    kernel.status_after.set("unapplied");
    let error = kernel.load(&kernel.installed(), true).expect_err("not applied");
    assert_eq!(error.cause(), Cause::NoBoard);
    assert!(error.to_string().contains("found \"unapplied\""), "{error}");
    assert!(!kernel.path(&format!("{OVERLAYS}/pgs")).exists());

    let kernel = FakeKernel::vendor();
    kernel.binds.set(false);
    let error = kernel.load(&kernel.installed(), true).expect_err("no node");
    assert!(error.to_string().contains("no UIO node \"pgs\""), "{error}");
    assert!(error.next().contains("of_id=generic-uio"), "{}", error.next());
}

#[test]
fn files_of_another_kind_are_wrong_input() {
    let kernel = FakeKernel::vendor();
    let tree = kernel.path("tree.dtbo");
    fs::write(&tree, DEVICE_TREE_MAGIC).expect("written");
    let program = kernel.path("program");
    fs::write(&program, b"\x7fELF").expect("written");
    let empty = kernel.path("empty");
    fs::write(&empty, "").expect("written");
    for (bitstream, found) in [
        (tree, "a compiled device tree"),
        (program, "a program"),
        (empty, "an empty file"),
        (kernel.path("lib"), "no plain file"),
        (kernel.path("absent"), "cannot read"),
    ] {
        let error = kernel.load(&bitstream, false).expect_err("wrong");
        assert_eq!(error.cause(), Cause::Input, "{error}");
        assert!(error.to_string().contains(found), "{error}");
    }
    let overlay = Some(kernel.file("zynq-pgs.dtso", "/dts-v1/;"));
    let request = Request { bitstream: kernel.installed(), overlay, partial: false };
    let error = load(&kernel, &request).expect_err("a source");
    assert_eq!(error.cause(), Cause::Input, "{error}");
    assert!(error.to_string().contains("dtc -@"), "{error}");
    assert_eq!(kernel.written(), []);
}
