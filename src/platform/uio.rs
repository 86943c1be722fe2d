//! This file finds UIO nodes by name and says what they have.
//!
//! The kernel numbers the nodes as it meets them; what stays is the name (`linux,uio-name` of the
//! device tree). A node says where its regions lie in `maps/map*/{name,addr,size,offset}`.
//!
//! Source: Linux `Documentation/driver-api/uio-howto.rst`.

use std::path::Path;

use super::PlatformError;
use super::sysfs::{numbered, read, read_if_present, read_number};

/// One region of a UIO node.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct UioMap {
    /// Number of the map, which selects it in `mmap`.
    pub index: u32,
    /// Name, as the device tree's `reg-names` give it; empty if there is none.
    pub name: String,
    /// Physical address of the first page.
    pub address: u64,
    /// Length of the pages, bytes.
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
    /// Its regions, by number.
    pub maps: Vec<UioMap>,
}

impl UioNode {
    /// The region of that name.
    ///
    /// # Errors
    /// [`PlatformError::NoMap`], which lists those that there are.
    pub fn map(&self, name: &str) -> Result<&UioMap, PlatformError> {
        self.maps.iter().find(|map| map.name == name).ok_or_else(|| {
            let names: Vec<_> = self.maps.iter().map(|map| map.name.as_str()).collect();
            PlatformError::NoMap {
                node: self.name.clone(),
                map: name.to_owned(),
                found: names.join(", "),
            }
        })
    }

    /// The region of that name, or the only one that there is, whatever its name.
    pub(crate) fn map_or_only(&self, name: &str) -> Result<&UioMap, PlatformError> {
        match self.maps.as_slice() {
            [only] => Ok(only),
            _ => self.map(name),
        }
    }
}

/// The UIO nodes under `class` (normally [`UIO_CLASS`](super::UIO_CLASS)), by number. A system
/// without UIO has none.
///
/// # Errors
/// A node whose description cannot be read or is not a number where one belongs; the path is in
/// the error.
pub fn uio_nodes(class: &Path) -> Result<Vec<UioNode>, PlatformError> {
    let mut nodes = Vec::new();
    for (number, path) in numbered(class, "uio")? {
        let mut maps = Vec::new();
        for (index, map) in numbered(&path.join("maps"), "map")? {
            maps.push(UioMap {
                index,
                // The name is younger than the other files and may be absent.
                name: read_if_present(&map.join("name"))?.unwrap_or_default(),
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

/// The node of that name among `nodes`.
pub(crate) fn node_named(nodes: &[UioNode], name: &str) -> Result<UioNode, PlatformError> {
    nodes.iter().find(|node| node.name == name).cloned().ok_or_else(|| {
        let names: Vec<_> = nodes.iter().map(|node| node.name.as_str()).collect();
        PlatformError::NoNode { wanted: name.to_owned(), found: names.join(", ") }
    })
}

#[cfg(test)]
pub(crate) mod fake {
    //! A system with UIO nodes, made of files.

    use std::fs;
    use std::path::PathBuf;

    use crate::platform::System;
    use bitstream_model::interface::address_map;

    /// A map: its name, physical address and length.
    pub(crate) type Map<'a> = (&'a str, u64, u64);

    /// The accelerator's regions.
    pub(crate) fn regions() -> Vec<Map<'static>> {
        let dma = address_map::UIO_DMA_MAPS.iter().enumerate().map(|(core, name)| {
            (*name, address_map::dma_base(core), u64::from(address_map::DMA_BYTES))
        });
        let control = (
            address_map::UIO_CONTROL_MAP,
            address_map::CONTROL_BASE,
            u64::from(address_map::CONTROL_BYTES),
        );
        dma.chain([control]).collect()
    }

    pub(crate) fn write(path: PathBuf, text: &str) {
        fs::create_dir_all(path.parent().expect("below the root")).expect("made");
        fs::write(path, format!("{text}\n")).expect("written");
    }

    /// Adds the node `uio<number>` with these regions; its device file is of zeros, and long enough
    /// for pages of up to 64 KiB.
    pub(crate) fn add_node(system: &System, number: u32, name: &str, maps: &[Map<'_>]) {
        let node = system.uio.join(format!("uio{number}"));
        write(node.join("name"), name);
        for (index, (name, address, bytes)) in maps.iter().enumerate() {
            let map = node.join(format!("maps/map{index}"));
            write(map.join("name"), name);
            write(map.join("addr"), &format!("{address:#x}"));
            write(map.join("size"), &format!("{bytes:#x}"));
            write(map.join("offset"), "0x0");
        }
        let device = system.dev.join(format!("uio{number}"));
        write(device.clone(), "");
        let last = maps.last().map_or(0, |(_, _, bytes)| *bytes);
        let length = ((maps.len() as u64) << 16) + last;
        fs::File::create(device).and_then(|file| file.set_len(length)).expect("resized");
    }

    /// Gives the node `uio<number>` these addresses and lengths in the device tree, in two cells
    /// each.
    pub(crate) fn add_reg(system: &System, number: u32, regions: &[(u64, u64)]) {
        let device = system.uio.join(format!("uio{number}/device"));
        let node = device.join("of_node");
        fs::create_dir_all(&node).expect("made");
        for cells in ["#address-cells", "#size-cells"] {
            fs::write(device.join(cells), 2_u32.to_be_bytes()).expect("written");
        }
        let numbers = regions.iter().flat_map(|(address, bytes)| [address, bytes]);
        let reg: Vec<u8> = numbers.flat_map(|number| number.to_be_bytes()).collect();
        fs::write(node.join("reg"), reg).expect("written");
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::platform::System;

    #[test]
    fn a_system_without_uio_has_no_nodes() {
        assert_eq!(uio_nodes(Path::new("/nonexistent/uio")).expect("no error"), []);
    }

    #[test]
    fn nodes_are_listed_by_number_with_their_regions() {
        let root = tempfile::tempdir().expect("a directory");
        let system = System::under(root.path());
        fake::add_node(&system, 10, "pgs", &fake::regions());
        fake::add_node(&system, 2, "axi-pmon", &[]);
        fs::write(system.uio.join("uevent"), "").expect("written");
        let nodes = uio_nodes(&system.uio).expect("readable");
        let names: Vec<_> =
            nodes.iter().map(|node| (node.device.as_str(), node.name.as_str())).collect();
        assert_eq!(names, [("uio2", "axi-pmon"), ("uio10", "pgs")]);
        assert_eq!(nodes[1].maps.len(), 5);
        let control = nodes[1].map("control").expect("named");
        assert_eq!(
            (control.index, control.address, control.bytes, control.offset),
            (4, 0xA004_0000, 0x1000, 0)
        );
        let missing = node_named(&nodes, "other").expect_err("there is none").to_string();
        assert!(missing.contains("\"other\" (found: axi-pmon, pgs)"), "{missing}");
    }

    #[test]
    fn a_region_is_found_by_name_whatever_its_number() {
        let root = tempfile::tempdir().expect("a directory");
        let system = System::under(root.path());
        let mut regions = fake::regions();
        regions.swap(0, 4);
        regions.remove(2);
        fake::add_node(&system, 0, "pgs", &regions);
        let node = uio_nodes(&system.uio).expect("readable").remove(0);
        assert_eq!(node.map("control").expect("named").index, 0);
        assert_eq!(node.map("dma0").expect("named").index, 3);
        let missing = node.map("dma2").expect_err("left out").to_string();
        assert!(missing.contains("found: control, dma1, dma3, dma0"), "{missing}");
        node.map_or_only("memory").expect_err("one of several needs its name");
    }

    #[test]
    fn the_only_region_of_a_node_needs_no_name() {
        let root = tempfile::tempdir().expect("a directory");
        let system = System::under(root.path());
        fake::add_node(&system, 0, "pgs-dma0", &[("dma@a0000000", 0xA000_0000, 0x1_0000)]);
        let node = uio_nodes(&system.uio).expect("readable").remove(0);
        assert_eq!(node.map_or_only("dma0").expect("the only one").address, 0xA000_0000);
    }

    #[test]
    fn a_size_that_is_no_number_is_an_error_with_its_path() {
        let root = tempfile::tempdir().expect("a directory");
        let system = System::under(root.path());
        fake::add_node(&system, 0, "pgs", &fake::regions());
        fs::write(system.uio.join("uio0/maps/map3/size"), "large\n").expect("written");
        let error = uio_nodes(&system.uio).expect_err("not a number").to_string();
        assert!(error.contains("uio0/maps/map3/size") && error.contains("large"), "{error}");
    }
}
