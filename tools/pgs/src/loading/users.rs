//! This file finds the programs that have a UIO node open.

use std::fs;
use std::io;
use std::path::Path;

use zynq_pgs::UioNode;

use super::LoadError;
use super::system::{System, read};

/// Refuses if a program has one of the nodes open.
pub(super) fn refuse_if_open(system: &dyn System, nodes: &[UioNode]) -> Result<(), LoadError> {
    for node in nodes {
        let users = users(&system.path("proc"), &node.device)?;
        if !users.is_empty() {
            let (device, node) = (node.device.clone(), node.name.clone());
            return Err(LoadError::InUse { device, node, users: users.join(", ") });
        }
    }
    Ok(())
}

/// Processes that have the device open, by number; what ends meanwhile does not count.
fn users(proc: &Path, device: &str) -> Result<Vec<String>, LoadError> {
    let device = Path::new("/dev").join(device);
    let entries = match fs::read_dir(proc) {
        Err(source) if source.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(|source| LoadError::file("list", proc, source))?,
    };
    let mut users = Vec::new();
    let mut hidden = 0_usize;
    for entry in entries.filter_map(Result::ok) {
        let name = entry.file_name();
        let Some(id) = name.to_str().and_then(|name| name.parse::<u32>().ok()) else { continue };
        let files = match fs::read_dir(entry.path().join("fd")) {
            Ok(files) => files,
            Err(error) => {
                hidden += usize::from(error.kind() == io::ErrorKind::PermissionDenied);
                continue;
            }
        };
        let is_device =
            |file: fs::DirEntry| fs::read_link(file.path()).is_ok_and(|to| to == device);
        if files.filter_map(Result::ok).any(is_device) {
            let name = read(&entry.path().join("comm")).unwrap_or_default();
            users.push((id, format!("process {id} ({name})")));
        }
    }
    if hidden > 0 {
        log::warn!(
            "whether {hidden} processes of others have {} open is not known",
            device.display()
        );
    }
    users.sort_unstable();
    Ok(users.into_iter().map(|(_, text)| text).collect())
}
