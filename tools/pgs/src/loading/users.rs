//! Finds programs that may use the logic: programs with a UIO node of it, or `/dev/mem`, open or
//! mapped.

use std::fs;
use std::io;
use std::os::unix::fs::{FileTypeExt as _, MetadataExt as _};
use std::path::{Path, PathBuf};

use zynq_pgs::platform::{UioListing, UnreadableNode};

use super::system::{System, read};
use super::{LoadError, is_ours};

/// Reaches every register without a UIO node.
const ALL_MEMORY: &str = "dev/mem";
/// Device number of `/dev/mem`.
const ALL_MEMORY_NUMBER: &str = "1:1";

/// A device file that reaches the logic.
#[derive(Debug)]
struct Device {
    /// Its path, independent of a root: a program in a chroot has it below another one.
    path: PathBuf,
    /// Its device number, as sysfs writes it: the same under every path.
    number: Option<String>,
    /// Its name in a message.
    text: String,
}

/// Refuses if a program has a node of the logic, or all memory, open.
pub(super) fn refuse_if_open(system: &dyn System, listing: &UioListing) -> Result<(), LoadError> {
    let device = |device: &str, name: &str| {
        let path = Path::new("dev").join(device);
        let number = read(&system.path("sys/class/uio").join(device).join("dev")).ok();
        Device { text: format!("/{} ({name})", path.display()), path, number }
    };
    // A node that cannot be read may show the logic.
    let unreadable =
        listing.unreadable.iter().map(|UnreadableNode { device: id, name, .. }| {
            device(id, &name.as_ref().map_or_else(|| "unreadable".to_owned(), |n| format!("{n:?}")))
        });
    let of_logic = listing.nodes.iter().filter(|node| node.is_in_logic() || is_ours(node));
    let nodes = of_logic.map(|node| device(&node.device, &format!("{:?}", node.name)));
    let all = Device {
        path: ALL_MEMORY.into(),
        number: Some(ALL_MEMORY_NUMBER.to_owned()),
        text: format!("/{ALL_MEMORY}"),
    };
    let devices: Vec<_> = nodes.chain(unreadable).chain([all]).collect();
    let found = users(&system.path("proc"), &devices)?;
    let Some(first) = found.first() else { return Ok(()) };
    let device = first.device.to_owned();
    let of_it = found.iter().filter(|user| user.device == device).map(|user| user.text.as_str());
    Err(LoadError::InUse { users: of_it.collect::<Vec<_>>().join(", "), device })
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

/// Processes that hold one of the devices, with the device and the process id; a process that ends
/// meanwhile is left out.
fn users<'a>(proc: &Path, devices: &'a [Device]) -> Result<Vec<User<'a>>, LoadError> {
    let entries = match fs::read_dir(proc) {
        Err(source) if source.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(|source| LoadError::attribute(proc, source))?,
    };
    let mut users = Vec::new();
    let mut hidden = 0_usize;
    for entry in entries.filter_map(Result::ok) {
        let name = entry.file_name();
        let Some(id) = name.to_str().and_then(|name| name.parse::<u32>().ok()) else { continue };
        let mut files = Vec::new();
        let seen = add_open(&entry.path(), &mut files);
        let seen = seen.and(add_mapped(&entry.path(), &mut files));
        let denied = |error: io::Error| error.kind() == io::ErrorKind::PermissionDenied;
        hidden += usize::from(seen.is_err_and(denied));
        for (place, device) in devices.iter().enumerate() {
            if files.iter().any(|file| file.is(device)) {
                let name = read(&entry.path().join("comm")).unwrap_or_default();
                let text = format!("process {id} ({name})");
                users.push((place, id, User { device: &device.text, text }));
            }
        }
    }
    if hidden > 0 {
        log::warn!("{hidden} processes of other users hide their open files");
    }
    users.sort_unstable_by_key(|(place, id, _)| (*place, *id));
    Ok(users.into_iter().map(|(.., user)| user).collect())
}

/// Adds the files that a process has open.
fn add_open(process: &Path, files: &mut Vec<HeldFile>) -> io::Result<()> {
    for file in fs::read_dir(process.join("fd"))?.filter_map(Result::ok) {
        let Ok(shown) = fs::read_link(file.path()) else { continue };
        let meta = fs::metadata(file.path()).ok();
        let meta = meta.filter(|meta| meta.file_type().is_char_device());
        files.push(HeldFile::new(&shown, meta.map(|meta| number_text(meta.rdev()))));
    }
    Ok(())
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
    fn a_number_is_written_as_sysfs_writes_it() {
        assert_eq!(number_text(0x0101), "1:1");
        assert_eq!(number_text(0xF003), "240:3");
        assert_eq!(number_text(0x1000_0010_0234_5678), "268436566:16786296");
    }
}
