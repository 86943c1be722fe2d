//! This file finds UIO nodes and their register maps, and maps them.
//!
//! The kernel numbers the nodes as it meets them; what stays is the name (`linux,uio-name` of the
//! device tree). A node says where its regions lie in `maps/map*/{name,addr,size,offset}`.
//!
//! Source: Linux `Documentation/driver-api/uio-howto.rst`.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::mapped::MappedWindow;
use super::{PlatformError, RegisterWindow};

/// Where Linux lists the UIO nodes.
pub const UIO_CLASS: &str = "/sys/class/uio";

/// One register region of a UIO node.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct UioMap {
    /// Number of the map, which selects it in `mmap`.
    pub index: u32,
    /// Name, as the device tree's `reg-names` give it; empty if there is none.
    pub name: String,
    /// Physical address.
    pub address: u64,
    /// Length, bytes.
    pub bytes: u64,
    /// Where the region begins in its first page, bytes.
    pub offset: u64,
}

/// A UIO node.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct UioNode {
    /// The kernel's name, `uio0`.
    pub device: String,
    /// The device tree's name for it.
    pub name: String,
    /// Its register regions, by number.
    pub maps: Vec<UioMap>,
}

impl UioNode {
    /// Maps the region of that name; `dev` is where the device files lie.
    pub(crate) fn open_map(
        &self,
        dev: &Path,
        name: &str,
    ) -> Result<Option<Box<dyn RegisterWindow>>, PlatformError> {
        let Some(map) = self.maps.iter().find(|map| map.name == name) else {
            return Ok(None);
        };
        let page = page_bytes(dev)?;
        let short = |_| PlatformError::ShortRegion {
            region: name.to_owned(),
            expected: u32::MAX,
            found: map.bytes,
        };
        let window = MappedWindow::open(
            &dev.join(&self.device),
            u64::from(map.index) * page,
            usize::try_from(map.offset).map_err(short)?,
            usize::try_from(map.bytes).map_err(short)?,
        )?;
        Ok(Some(Box::new(window)))
    }
}

fn page_bytes(dev: &Path) -> Result<u64, PlatformError> {
    let bytes = nix::unistd::sysconf(nix::unistd::SysconfVar::PAGE_SIZE);
    let source = match bytes {
        Ok(Some(bytes)) if bytes > 0 => return Ok(bytes.unsigned_abs()),
        Ok(_) => io::Error::new(io::ErrorKind::Unsupported, "the system gives no page size"),
        Err(errno) => errno.into(),
    };
    Err(PlatformError::File { act: "find the page size for", path: dev.to_owned(), source })
}

/// The UIO nodes under `class` (normally [`UIO_CLASS`]), by number. A system without UIO has none.
///
/// # Errors
/// A node whose description cannot be read or is not a number where one belongs; the path is in
/// the error.
pub fn uio_nodes(class: &Path) -> Result<Vec<UioNode>, PlatformError> {
    let mut nodes = Vec::new();
    for (number, path) in numbered(class, "uio")? {
        let mut maps = Vec::new();
        for (index, map) in numbered(&path.join("maps"), "map")? {
            // The name is younger than the other files and may be absent.
            let name = map.join("name");
            let name = if name.exists() { read(&name)? } else { String::new() };
            maps.push(UioMap {
                index,
                name,
                address: read_number(&map.join("addr"))?,
                bytes: read_number(&map.join("size"))?,
                offset: read_number(&map.join("offset"))?,
            });
        }
        nodes.push(UioNode {
            device: format!("uio{number}"),
            name: read(&path.join("name"))?,
            maps,
        });
    }
    Ok(nodes)
}

/// The entries `<prefix><number>` of a directory, by number; none if there is no such directory.
fn numbered(directory: &Path, prefix: &str) -> Result<Vec<(u32, PathBuf)>, PlatformError> {
    let error = |source| PlatformError::File { act: "list", path: directory.to_owned(), source };
    let entries = match fs::read_dir(directory) {
        Err(source) if source.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(error)?,
    };
    let mut found = Vec::new();
    for entry in entries {
        let entry = entry.map_err(error)?;
        let name = entry.file_name();
        let number = name.to_str().and_then(|name| name.strip_prefix(prefix)?.parse().ok());
        if let Some(number) = number {
            found.push((number, entry.path()));
        }
    }
    found.sort_unstable();
    Ok(found)
}

fn read(path: &Path) -> Result<String, PlatformError> {
    let text = fs::read_to_string(path).map_err(|source| PlatformError::File {
        act: "read",
        path: path.to_owned(),
        source,
    })?;
    Ok(text.trim().to_owned())
}

fn read_number(path: &Path) -> Result<u64, PlatformError> {
    let text = read(path)?;
    let number = match text.strip_prefix("0x") {
        Some(digits) => u64::from_str_radix(digits, 16),
        None => text.parse(),
    };
    number.map_err(|_| PlatformError::NotANumber { path: path.to_owned(), found: text })
}

#[cfg(test)]
pub(crate) mod fake {
    //! A system with UIO nodes, made of files.

    use super::*;
    use bitstream_model::interface::address_map;

    /// Adds the node `uio<number>` with the accelerator's regions.
    pub(crate) fn add_node(class: &Path, number: u32, name: &str) {
        let node = class.join(format!("uio{number}"));
        let write = |path: PathBuf, text: &str| {
            fs::create_dir_all(path.parent().expect("below the class")).expect("made");
            fs::write(path, format!("{text}\n")).expect("written");
        };
        write(node.join("name"), name);
        let dma = address_map::UIO_DMA_MAPS.iter().enumerate().map(|(core, name)| {
            (*name, address_map::dma_base(core), u64::from(address_map::DMA_BYTES))
        });
        let control = (
            address_map::UIO_CONTROL_MAP,
            address_map::CONTROL_BASE,
            u64::from(address_map::CONTROL_BYTES),
        );
        for (index, (name, address, bytes)) in dma.chain([control]).enumerate() {
            let map = node.join(format!("maps/map{index}"));
            write(map.join("name"), name);
            write(map.join("addr"), &format!("{address:#x}"));
            write(map.join("size"), &format!("{bytes:#x}"));
            write(map.join("offset"), "0x0");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_without_uio_has_no_nodes() {
        assert_eq!(uio_nodes(Path::new("/nonexistent/uio")).expect("no error"), []);
    }

    #[test]
    fn nodes_are_listed_by_number_with_their_regions() {
        let class = tempfile::tempdir().expect("a directory");
        fake::add_node(class.path(), 10, "pgs");
        fake::add_node(class.path(), 2, "axi-pmon");
        fs::write(class.path().join("uevent"), "").expect("written");
        let nodes = uio_nodes(class.path()).expect("readable");
        let names: Vec<_> =
            nodes.iter().map(|node| (node.device.as_str(), node.name.as_str())).collect();
        assert_eq!(names, [("uio2", "axi-pmon"), ("uio10", "pgs")]);
        assert_eq!(nodes[1].maps.len(), 5);
        let control = &nodes[1].maps[4];
        assert_eq!(
            (control.name.as_str(), control.address, control.bytes, control.offset),
            ("control", 0xA004_0000, 0x1000, 0)
        );
    }

    #[test]
    fn a_size_that_is_no_number_is_an_error_with_its_path() {
        let class = tempfile::tempdir().expect("a directory");
        fake::add_node(class.path(), 0, "pgs");
        fs::write(class.path().join("uio0/maps/map3/size"), "large\n").expect("written");
        let error = uio_nodes(class.path()).expect_err("not a number").to_string();
        assert!(error.contains("uio0/maps/map3/size") && error.contains("large"), "{error}");
    }

    #[test]
    fn a_map_is_found_at_its_number_of_pages_in_the_device_file() {
        let root = tempfile::tempdir().expect("a directory");
        fake::add_node(root.path(), 0, "pgs");
        let page = usize::try_from(page_bytes(root.path()).expect("a page size")).expect("fits");
        let node = uio_nodes(root.path()).expect("readable").remove(0);
        let mut device = vec![0; 5 * page];
        device[4 * page..4 * page + 4].copy_from_slice(&[0x31, 0x53, 0x47, 0x50]);
        let dev = tempfile::tempdir().expect("a directory");
        fs::write(dev.path().join("uio0"), device).expect("written");
        let control = node.open_map(dev.path(), "control").expect("mapped").expect("named");
        assert_eq!(control.read32(0), 0x5047_5331);
        assert!(node.open_map(dev.path(), "other").expect("no error").is_none());
    }
}
