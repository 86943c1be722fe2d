//! Tests loading on a kernel made of files, which reacts to writes as the vendor's does.

mod bound;
pub(super) mod files;
mod judged;
mod loads;
mod refusals;

use std::cell::{Cell, RefCell};
use std::fs;
use std::io;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use zynq_pgs::platform::DeviceLock;

use super::*;

/// A bitstream that asks for 100 MHz, and an overlay that sets them.
fn bitstream() -> Vec<u8> {
    files::bitstream(Some(100))
}

fn tree() -> Vec<u8> {
    files::overlay(Some(100_000_000), None)
}

const OVERLAYS: &str = "sys/kernel/config/device-tree/overlays";

/// Loads a bitstream alone.
pub(super) fn request(bitstream: &Path) -> Request {
    Request {
        bitstream: bitstream.to_owned(),
        overlay: None,
        part: Chip::of(0x0473_8093),
        unjudged: false,
        manager: ManagerChoice::Automatic,
        replace_others: false,
    }
}

/// A kernel that programs logic and applies overlays.
#[derive(Debug)]
struct FakeKernel {
    root: TempDir,
    /// Every write: the path below the root, and the bytes.
    writes: RefCell<Vec<(String, Vec<u8>)>>,
    /// The state after programming; if it is an error, the write fails, too.
    state_after: Cell<&'static str>,
    status_after: Cell<&'static str>,
    /// The bitstream that it loads.
    expected: RefCell<Vec<u8>>,
    denied: Cell<&'static str>,
    /// Whether a UIO driver binds to the overlay's node.
    binds: Cell<bool>,
    /// A device that a program opens while the bitstream is copied.
    opened_meanwhile: Cell<Option<&'static str>>,
    /// A device file that a driver tries to lock while the logic is programmed.
    tries: RefCell<Option<PathBuf>>,
    /// Whether it could.
    tried: Cell<Option<bool>>,
}

impl FakeKernel {
    /// The vendor's kernel on a board without a bitstream.
    fn vendor() -> Self {
        let kernel = Self {
            root: tempfile::tempdir().expect("a directory"),
            writes: RefCell::default(),
            state_after: Cell::new(OPERATING),
            status_after: Cell::new("applied"),
            expected: RefCell::new(bitstream()),
            denied: Cell::new("nothing"),
            binds: Cell::new(true),
            opened_meanwhile: Cell::default(),
            tries: RefCell::default(),
            tried: Cell::default(),
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
        self.bytes(path, format!("{text}\n").as_bytes())
    }

    fn bytes(&self, path: &str, bytes: &[u8]) -> PathBuf {
        let path = self.path(path);
        fs::create_dir_all(path.parent().expect("below the root")).expect("made");
        fs::write(&path, bytes).expect("written");
        path
    }

    /// A bitstream outside the firmware folder.
    fn elsewhere(&self) -> PathBuf {
        self.bytes("home/zynq-pgs.bit.bin", &bitstream())
    }

    fn remove(&self, path: &str) {
        let path = self.path(path);
        let removed = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
        removed.expect("removed");
    }

    fn add_node(&self, number: u32, name: &str) {
        self.file(&format!("sys/class/uio/uio{number}/name"), name);
    }

    /// Adds a node with one region.
    fn add_region(&self, number: u32, name: &str, region: &str, address: u64) {
        self.add_node(number, name);
        let address = format!("{address:#x}");
        for (file, text) in
            [("name", region), ("addr", &address), ("size", "0x1000"), ("offset", "0x0")]
        {
            self.file(&format!("sys/class/uio/uio{number}/maps/map0/{file}"), text);
        }
    }

    /// Adds a process that has a file open.
    fn add_process(&self, id: u32, comm: &str, open: &str) {
        self.file(&format!("proc/{id}/comm"), comm);
        let files = self.path(&format!("proc/{id}/fd"));
        fs::create_dir_all(&files).expect("made");
        symlink(open, files.join("7")).expect("linked");
    }

    fn ask(&self, request: &Request) -> Result<Loaded, LoadError> {
        load(self, request, &Progress::default())
    }

    /// Loads a bitstream, with or without an overlay.
    fn load(&self, bitstream: &Path, overlay: bool) -> Result<Loaded, LoadError> {
        let tree = self.bytes("home/zynq-pgs.dtbo", &tree());
        self.ask(&Request { overlay: overlay.then_some(tree), ..request(bitstream) })
    }

    /// A bitstream in the firmware folder.
    fn installed(&self) -> PathBuf {
        self.bytes("lib/firmware/xilinx/zynq-pgs.bit.bin", &bitstream())
    }

    /// Starts a driver, which tries to lock the device file.
    fn try_device(&self) {
        if let Some(device) = &*self.tries.borrow() {
            self.tried.set(Some(DeviceLock::new(device).is_ok()));
        }
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
            self.try_device();
            let name = std::str::from_utf8(bytes).expect("a name");
            let first = self.path("sys/module/firmware_class/parameters/path");
            let first = fs::read_to_string(first).unwrap_or_default();
            let folders = [first.trim(), "lib/firmware"]
                .map(|folder| self.path(folder.trim_start_matches('/')));
            let firmware = folders.into_iter().map(|folder| folder.join(name));
            let found = firmware.into_iter().find_map(|file| fs::read(file).ok());
            let found = found.is_some_and(|bytes| bytes == self.expected.borrow().as_slice());
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
        // Attributes of the kernel are no obstacle.
        fs::remove_dir_all(path)
    }

    fn create(&self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        self.allow(path.parent().expect("a folder"))?;
        if let Some(device) = self.opened_meanwhile.get() {
            self.add_process(4712, "late", device);
        }
        Linux { root: PathBuf::new() }.create(path, bytes)
    }
}

fn pair(path: &str, text: &str) -> (String, String) {
    (path.to_owned(), text.to_owned())
}

/// Asserts that nothing was changed, and that the party at fault, the message and the next step are
/// as expected.
fn assert_refused(kernel: &FakeKernel, error: &LoadError, message: &str, next: &str) {
    assert_eq!(kernel.written(), [], "{error}");
    assert_eq!(error.at_fault(), AtFault::System, "{error}");
    assert!(error.to_string().contains(message), "{error}");
    assert!(error.next().contains(next), "{}", error.next());
}
