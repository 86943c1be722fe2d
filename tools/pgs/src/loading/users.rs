//! Finds programs that may use the logic: programs with a device file that reaches it open, mapped
//! or locked.
//!
//! The driver locks every device file that it maps. A lock is seen from every container and without
//! `/proc`; the other users are seen in `/proc` alone.

use std::fs;
use std::io;
use std::os::unix::fs::{FileTypeExt as _, MetadataExt as _};
use std::path::{Path, PathBuf};

use zynq_pgs::platform::PlatformError;
use zynq_pgs::platform::{self, DeviceLock, UioListing, UnreadableNode, u_dma_buf_names};

use super::others::{driver, is_of_logic};
use super::system::{System, read};
use super::{LoadError, is_ours};

/// Reaches every register without a UIO node.
const ALL_MEMORY: &str = "mem";
/// Device number of `/dev/mem`.
const ALL_MEMORY_NUMBER: &str = "1:1";
/// The namespace of process ids in which every process shows; Linux, `include/linux/proc_ns.h`.
const ALL_PROCESSES: &str = "pid:[4026531836]";

/// A device file that reaches the logic.
#[derive(Debug)]
pub(super) struct Device {
    /// Its path, independent of a root: a program in a chroot has it below another one.
    path: PathBuf,
    /// Its device number, as sysfs writes it: the same under every path.
    number: Option<String>,
    /// Its name in a message.
    text: String,
    /// Whether this project's driver opens it, and locks it.
    is_locked: bool,
}

impl Device {
    fn new(file: &str, number: Option<String>, name: Option<&str>, is_locked: bool) -> Self {
        let path = Path::new("dev").join(file);
        let name = name.map(|name| format!(" ({name})")).unwrap_or_default();
        Self { text: format!("/{}{name}", path.display()), path, number, is_locked }
    }
}

/// The device files that reach the logic or memory that it works on.
pub(super) fn devices(system: &dyn System, listing: &UioListing) -> Vec<Device> {
    let names = |folder: &str| {
        let entries = fs::read_dir(system.path(folder)).into_iter().flatten();
        let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        let mut names: Vec<_> = names.collect();
        names.sort_unstable();
        names
    };
    let number = |class: &str, id: &str| read(&system.path(class).join(id).join("dev")).ok();
    let mut devices = Vec::new();
    let mut uio = |id: &str, name: &str| {
        devices.push(Device::new(id, number("sys/class/uio", id), Some(name), true));
    };
    for node in listing.nodes.iter().filter(|node| node.is_in_logic() || is_ours(node)) {
        uio(&node.device, &format!("{:?}", node.name));
    }
    // A node that cannot be read may show the logic.
    for UnreadableNode { device, name, .. } in &listing.unreadable {
        uio(device, &name.as_ref().map_or_else(|| "unreadable".to_owned(), |n| format!("{n:?}")));
    }
    for name in u_dma_buf_names(&platform::System::under(&system.path(""))) {
        let classes = ["sys/class/u-dma-buf", "sys/class/udmabuf"];
        let number = classes.iter().find_map(|class| number(class, &name));
        devices.push(Device::new(&name, number, Some("u-dma-buf"), true));
    }
    for id in names("sys/class/drm") {
        let owner = driver(&system.path("sys/class/drm").join(&id).join("device"));
        if let Some(owner) = owner.filter(|owner| is_of_logic(owner)) {
            let number = number("sys/class/drm", &id);
            devices.push(Device::new(&format!("dri/{id}"), number, Some(&owner), false));
        }
    }
    for file in names("dev").into_iter().filter(|file| is_of_logic(file)) {
        let number = device_number(&system.path("dev").join(&file));
        devices.push(Device::new(&file, number, None, false));
    }
    devices.push(Device::new(ALL_MEMORY, Some(ALL_MEMORY_NUMBER.to_owned()), None, true));
    devices
}

/// Refuses if a program has one of the devices open or mapped; tells which programs do not show.
pub(super) fn refuse_if_open(
    system: &dyn System,
    devices: &[Device],
) -> Result<Vec<String>, LoadError> {
    let (found, unseen) = users(&system.path("proc"), devices)?;
    let Some(first) = found.first() else { return Ok(unseen) };
    let device = first.device.to_owned();
    let of_it = found.iter().filter(|user| user.device == device).map(|user| user.text.as_str());
    Err(LoadError::InUse { users: of_it.collect::<Vec<_>>().join(", "), device })
}

/// Locks the devices, so that no driver takes one up; refuses if a program has locked one.
pub(super) fn lock(system: &dyn System, devices: &[Device]) -> Result<Vec<DeviceLock>, LoadError> {
    let mut locks = Vec::new();
    for Device { path, text, .. } in devices.iter().filter(|device| device.is_locked) {
        match DeviceLock::new(&system.path("").join(path)) {
            Ok(lock) => locks.push(lock),
            Err(PlatformError::Busy { .. }) => {
                return Err(LoadError::Locked { device: text.clone() });
            }
            // Not on every system, and not for every user.
            Err(error) if path.ends_with(ALL_MEMORY) => log::debug!("{error}"),
            Err(error) => log::warn!("whether a program has locked {text} is not known: {error}"),
        }
    }
    Ok(locks)
}

/// A process and its files.
#[derive(Debug)]
struct User<'a> {
    device: &'a str,
    text: String,
}

/// A file of a process.
#[derive(Debug)]
struct HeldFile {
    path: PathBuf,
    number: Option<String>,
}

impl HeldFile {
    /// Reads the kernel's link to the file, which is marked if the name is deleted.
    fn new(shown: &Path, number: Option<String>) -> Self {
        let text = shown.to_string_lossy();
        Self { path: text.strip_suffix(" (deleted)").unwrap_or(&text).into(), number }
    }

    fn is(&self, device: &Device) -> bool {
        match (&self.number, &device.number) {
            (Some(held), Some(number)) => held == number,
            _ => self.path.ends_with(&device.path),
        }
    }
}

/// Processes that hold one of the devices, with the device and the process id, and which ones do
/// not show; a process that ends meanwhile is left out.
fn users<'a>(
    proc: &Path,
    devices: &'a [Device],
) -> Result<(Vec<User<'a>>, Vec<String>), LoadError> {
    let entries = match fs::read_dir(proc) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
        entries => Some(entries.map_err(|source| LoadError::attribute(proc, source))?),
    };
    let own = fs::read_link(proc.join("self")).ok();
    let own = own.and_then(|own| own.to_str()?.parse::<u32>().ok());
    let (mut users, mut hidden, mut seen_any) = (Vec::new(), Vec::new(), false);
    for entry in entries.into_iter().flatten().filter_map(Result::ok) {
        let name = entry.file_name();
        let Some(id) = name.to_str().and_then(|name| name.parse::<u32>().ok()) else { continue };
        seen_any = true;
        if own == Some(id) {
            continue;
        }
        let mut files = Vec::new();
        let seen = add_open(&entry.path(), &mut files);
        let seen = seen.and(add_mapped(&entry.path(), &mut files));
        let text = || {
            let name = read(&entry.path().join("comm")).unwrap_or_default();
            format!("process {id} ({name})")
        };
        if seen.is_err_and(|error| error.kind() == io::ErrorKind::PermissionDenied) {
            hidden.push((id, text()));
        }
        for (place, device) in devices.iter().enumerate() {
            if files.iter().any(|file| file.is(device)) {
                users.push((place, id, User { device: &device.text, text: text() }));
            }
        }
    }
    users.sort_unstable_by_key(|(place, id, _)| (*place, *id));
    hidden.sort_unstable();
    let hidden: Vec<_> = hidden.into_iter().map(|(_, text)| text).collect();
    Ok((users.into_iter().map(|(.., user)| user).collect(), unseen(proc, seen_any, &hidden)))
}

/// Says which programs do not show in `/proc`.
fn unseen(proc: &Path, seen_any: bool, hidden: &[String]) -> Vec<String> {
    let only_locks = "only the locks of its drivers are seen";
    let space = fs::read_link(proc.join("self/ns/pid"));
    let mut unseen = Vec::new();
    if !seen_any {
        unseen.push(format!(
            "no processes in {}: of the logic's users, {only_locks}",
            proc.display()
        ));
    } else if space.is_ok_and(|space| space.as_os_str() != ALL_PROCESSES) {
        unseen.push(format!("in a container: of the logic's users outside, {only_locks}"));
    }
    match hidden {
        [] => {}
        [only] => unseen.push(format!("{only} does not show its open files{HIDDEN}")),
        [first, others @ ..] => {
            let count = others.len();
            unseen.push(format!("{first} and {count} more do not show their open files{HIDDEN}"));
        }
    }
    unseen
}

/// Why a process hides its files.
const HIDDEN: &str = ", as to users who are not root, and to root without CAP_SYS_PTRACE: whether \
                      the logic is in use is not known";

/// Adds the files that a process has open.
fn add_open(process: &Path, files: &mut Vec<HeldFile>) -> io::Result<()> {
    for file in fs::read_dir(process.join("fd"))?.filter_map(Result::ok) {
        let Ok(shown) = fs::read_link(file.path()) else { continue };
        files.push(HeldFile::new(&shown, device_number(&file.path())));
    }
    Ok(())
}

/// The number of a device file.
fn device_number(path: &Path) -> Option<String> {
    let meta = fs::metadata(path).ok().filter(|meta| meta.file_type().is_char_device())?;
    Some(number_text(meta.rdev()))
}

/// Writes a device number of the C library as sysfs does.
fn number_text(number: u64) -> String {
    let major = ((number >> 32) & !0xFFF) | ((number >> 8) & 0xFFF);
    let minor = ((number >> 12) & 0xFFFF_FF00) | (number & 0xFF);
    format!("{major}:{minor}")
}

/// Adds the files that a process has mapped: a mapping outlives the open file.
fn add_mapped(process: &Path, files: &mut Vec<HeldFile>) -> io::Result<()> {
    // Columns: addresses, rights, offset, device, inode, and the file if there is one.
    let file = |line: &str| line.split_ascii_whitespace().nth(5).map(PathBuf::from);
    let maps = fs::read_to_string(process.join("maps"))?;
    files.extend(maps.lines().filter_map(file).map(|path| HeldFile::new(&path, None)));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_is_known_by_its_number_or_else_by_its_place() {
        let device = |number: Option<&str>| Device {
            path: "dev/uio3".into(),
            number: number.map(str::to_owned),
            text: String::new(),
            is_locked: true,
        };
        let held = |path: &str, number: Option<&str>| {
            HeldFile::new(Path::new(path), number.map(str::to_owned))
        };
        for (path, found) in [
            ("/dev/uio3", true),
            ("/srv/jail/dev/uio3", true),
            ("/dev/uio3 (deleted)", true),
            ("/dev/uio33", false),
            ("/dev/uio", false),
        ] {
            assert_eq!(held(path, None).is(&device(None)), found, "{path}");
            assert_eq!(held(path, None).is(&device(Some("240:3"))), found, "{path}");
        }
        assert!(held("/tmp/node", Some("240:3")).is(&device(Some("240:3"))), "another place");
        assert!(!held("/dev/uio3", Some("1:3")).is(&device(Some("240:3"))), "another device");
    }

    #[test]
    fn the_programs_that_do_not_show_are_said_with_the_right_reason() {
        let root = tempfile::tempdir().expect("a directory");
        let proc = root.path();
        let found = |hidden: &[&str]| {
            let hidden: Vec<_> = hidden.iter().map(|&text| text.to_owned()).collect();
            unseen(proc, true, &hidden)
        };
        assert_eq!(found(&[]), Vec::<String>::new());
        assert!(unseen(proc, false, &[])[0].starts_with("no processes in "));
        let one = found(&["process 1 (init)"]).concat();
        assert!(one.starts_with("process 1 (init) does not show"), "{one}");
        assert!(one.contains("root without CAP_SYS_PTRACE"), "{one}");
        let three = found(&["process 1 (init)", "b", "c"]).concat();
        assert!(three.starts_with("process 1 (init) and 2 more do not show their"), "{three}");
        fs::create_dir_all(proc.join("self/ns")).expect("made");
        for (space, texts) in [(ALL_PROCESSES, 0), ("pid:[4026532200]", 1)] {
            let link = proc.join("self/ns/pid");
            let _ = fs::remove_file(&link);
            std::os::unix::fs::symlink(space, &link).expect("linked");
            assert_eq!(found(&[]).len(), texts, "{space}");
        }
    }

    #[test]
    fn a_number_is_written_as_sysfs_writes_it() {
        assert_eq!(number_text(0x0101), "1:1");
        assert_eq!(number_text(0xF003), "240:3");
        assert_eq!(number_text(0x1000_0010_0234_5678), "268436566:16786296");
    }
}
