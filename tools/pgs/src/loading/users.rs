//! This file finds the programs that may be using the logic: that have one of its UIO nodes, or
//! `/dev/mem`, open or mapped.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use zynq_pgs::UioNode;

use super::LoadError;
use super::system::{System, read};

/// Through it every register is reached past the nodes.
const ALL_MEMORY: &str = "/dev/mem";

/// Refuses if a program has one of the nodes, or all memory.
pub(super) fn refuse_if_open(system: &dyn System, nodes: &[UioNode]) -> Result<(), LoadError> {
    let named = nodes.iter().map(|node| {
        let path = Path::new("/dev").join(&node.device);
        let name = format!("{} ({:?})", path.display(), node.name);
        (path, name)
    });
    let devices: Vec<_> = named.chain([(ALL_MEMORY.into(), ALL_MEMORY.to_owned())]).collect();
    let found = users(&system.path("proc"), &devices)?;
    let Some(first) = found.first() else { return Ok(()) };
    let device = first.device.to_owned();
    let of_it = found.iter().filter(|user| user.device == device).map(|user| user.text.as_str());
    Err(LoadError::InUse { users: of_it.collect::<Vec<_>>().join(", "), device })
}

/// A process, and what it has.
#[derive(Debug)]
struct User<'a> {
    device: &'a str,
    text: String,
}

/// Processes that have one of the devices, by device and number; what ends meanwhile does not count.
fn users<'a>(proc: &Path, devices: &'a [(PathBuf, String)]) -> Result<Vec<User<'a>>, LoadError> {
    let entries = match fs::read_dir(proc) {
        Err(source) if source.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(|source| LoadError::file("list", proc, source))?,
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
        for (place, (path, device)) in devices.iter().enumerate() {
            if files.contains(path) {
                let name = read(&entry.path().join("comm")).unwrap_or_default();
                let text = format!("process {id} ({name})");
                users.push((place, id, User { device, text }));
            }
        }
    }
    if hidden > 0 {
        log::warn!("what {hidden} processes of others have open is not known");
    }
    users.sort_unstable_by_key(|(place, id, _)| (*place, *id));
    Ok(users.into_iter().map(|(.., user)| user).collect())
}

/// Adds the files that a process has open.
fn add_open(process: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    let open = fs::read_dir(process.join("fd"))?.filter_map(Result::ok);
    files.extend(open.filter_map(|file| fs::read_link(file.path()).ok()));
    Ok(())
}

/// Adds the files that it has mapped: a mapping stays when its file is closed.
fn add_mapped(process: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    // Addresses, rights, offset, device, inode, and the file if there is one.
    let file = |line: &str| line.split_ascii_whitespace().nth(5).map(PathBuf::from);
    files.extend(fs::read_to_string(process.join("maps"))?.lines().filter_map(file));
    Ok(())
}
