//! Describes a UIO node: its names, its regions, and the part of the accelerator that they are.
//!
//! The kernel numbers the nodes as it meets them, so that only the name (`linux,uio-name` of the
//! device tree) is stable. The regions of a node lie in `maps/map*/{name,addr,size,offset}`.
//!
//! Source: Linux `Documentation/driver-api/uio-howto.rst`.

use pgs_interface::address_map::{
    CONTROL_BASE, DMA_COUNT_MAX, MEMORY_BASE, UIO_CONTROL_MAP, UIO_DMA_MAPS, UIO_MEMORY_MAP,
    dma_base, is_in_logic,
};

use crate::platform::{PlatformError, Result};

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
    /// [`PlatformError::NoMap`], which lists the names of all regions.
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

    /// The region of that name, or the only region of the node, whatever its name.
    pub(crate) fn map_or_only(&self, name: &str) -> Result<&UioMap> {
        match self.maps.as_slice() {
            [only] => Ok(only),
            _ => self.map(name),
        }
    }
}

/// A part of the accelerator that a node shows by its regions, whatever its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum NodePart {
    /// The control block and DMA cores.
    Accelerator,
    /// The same by their addresses; the regions lack the names that the driver looks for.
    Unnamed,
    /// One region: the control block, or a DMA core.
    Region(&'static str),
    /// The memory that is reserved for DMA.
    Memory,
}

impl UioNode {
    /// Whether any of its regions lies in the programmable logic.
    #[must_use]
    pub fn is_in_logic(&self) -> bool {
        self.maps.iter().any(UioMap::is_in_logic)
    }

    /// The part of the accelerator that its regions are, by their names, else by their addresses.
    #[must_use]
    pub fn part(&self) -> Option<NodePart> {
        let logic: Vec<_> = self.maps.iter().filter(|map| map.is_in_logic()).collect();
        let region = |map: &UioMap| {
            let mut regions = UIO_DMA_MAPS.into_iter().chain([UIO_CONTROL_MAP]);
            let mut bases = (0..DMA_COUNT_MAX).map(dma_base).chain([CONTROL_BASE]);
            let named = regions.clone().find(|name| map.name == *name);
            named.or_else(|| regions.nth(bases.position(|base| map.address == base)?))
        };
        match (logic[..].split_first(), self.maps.as_slice()) {
            (Some((only, [])), _) => Some(NodePart::Region(region(only)?)),
            (Some(_), _) => {
                let named = logic.iter().any(|map| map.name == UIO_CONTROL_MAP);
                let found = logic.iter().any(|map| region(map) == Some(UIO_CONTROL_MAP));
                let unnamed = found.then_some(NodePart::Unnamed);
                if named { Some(NodePart::Accelerator) } else { unnamed }
            }
            (None, [only]) => {
                let memory = only.name == UIO_MEMORY_MAP || only.address == MEMORY_BASE;
                memory.then_some(NodePart::Memory)
            }
            (None, _) => None,
        }
    }
}

impl UioMap {
    /// Whether any of it lies in the programmable logic.
    #[must_use]
    pub fn is_in_logic(&self) -> bool {
        is_in_logic(self.address, self.bytes)
    }
}

#[cfg(test)]
pub(crate) mod fake {
    //! A system with UIO nodes, made of files.

    use std::fs;
    use std::path::PathBuf;

    use crate::platform::System;
    use pgs_interface::address_map;

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

    /// A system without devices; it lasts as long as the folder.
    pub(crate) fn empty_system() -> (tempfile::TempDir, System) {
        let root = tempfile::tempdir().expect("a directory");
        let system = System::under(root.path());
        (root, system)
    }

    /// A system with the accelerator as node `uio3`.
    pub(crate) fn accelerator() -> (tempfile::TempDir, System) {
        let (root, system) = empty_system();
        add_node(&system, 3, "pgs", &regions());
        (root, system)
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
    use super::*;
    use crate::platform::uio_nodes;

    #[test]
    fn a_region_is_found_by_name_whatever_its_number() {
        let (_root, system) = fake::empty_system();
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
        let (_root, system) = fake::empty_system();
        fake::add_node(&system, 0, "pgs-dma0", &[("dma@a0000000", 0xA000_0000, 0x1_0000)]);
        let node = uio_nodes(&system.uio).expect("readable").remove(0);
        assert_eq!(node.map_or_only("dma0").expect("the only one").address, 0xA000_0000);
    }

    #[test]
    fn a_node_is_recognised_by_its_regions_whatever_its_name() {
        let part = |regions: &[fake::Map<'_>]| {
            let map = |(index, (name, address, bytes)): (u32, &fake::Map<'_>)| UioMap {
                index,
                name: (*name).to_owned(),
                address: *address,
                bytes: *bytes,
                offset: 0,
            };
            let maps = (0..).zip(regions).map(map).collect();
            let node = UioNode { device: "uio7".to_owned(), name: "a@b".to_owned(), maps };
            (node.is_in_logic(), node.part())
        };
        let regions = fake::regions();
        assert_eq!(part(&regions), (true, Some(NodePart::Accelerator)));
        // Elsewhere in the logic, by name.
        let moved = [("dma0", 0x8000_0000, 0x1_0000), ("control", 0x4_0000_0000, 0x1000)];
        assert_eq!(part(&moved), (true, Some(NodePart::Accelerator)));
        let nameless: Vec<_> =
            regions.iter().map(|(_, at, bytes)| ("pgs@a", *at, *bytes)).collect();
        assert_eq!(part(&nameless), (true, Some(NodePart::Unnamed)));
        assert_eq!(part(&regions[1..2]), (true, Some(NodePart::Region("dma1"))));
        assert_eq!(part(&nameless[4..]), (true, Some(NodePart::Region("control"))));
        assert_eq!(part(&[("memory", 0x6000_0000, 0x1000)]), (false, Some(NodePart::Memory)));
        assert_eq!(part(&[("m@50000000", 0x5000_0000, 0x1000)]), (false, Some(NodePart::Memory)));
        // Other logic, and names of ours outside the logic.
        assert_eq!(part(&[("ctrl", 0xB000_0000, 0x1000)]), (true, None));
        assert_eq!(part(&[("a", 0xB000_0000, 16), ("b", 0xB001_0000, 16)]), (true, None));
        assert_eq!(part(&[("control", 0xFF00_0000, 0x1000)]), (false, None));
        assert_eq!(part(&[]), (false, None));
    }
}
