//! Maps virtual addresses of the traced program to registers.

use std::path::{Path, PathBuf};

use bitstream_model::interface::address_map::{UIO_CONTROL_NODE, UIO_DMA_NODES, UIO_NODE};
use zynq_pgs::platform::UioNode;

/// A UIO node whose regions are registers of the board.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Node {
    /// Its device file.
    pub path: PathBuf,
    /// Number, physical address of the first page and length of each map.
    maps: Vec<(u32, u64, u64)>,
}

impl Node {
    /// The accelerator's nodes in a system, whose device files lie in `dev`.
    #[must_use]
    pub fn of_the_board(nodes: &[UioNode], dev: &Path) -> Vec<Self> {
        let ours = |node: &&UioNode| {
            let name = node.name.as_str();
            name == UIO_NODE || name == UIO_CONTROL_NODE || UIO_DMA_NODES.contains(&name)
        };
        let node = |node: &UioNode| Self {
            path: dev.join(&node.device),
            maps: node.maps.iter().map(|map| (map.index, map.address, map.bytes)).collect(),
        };
        nodes.iter().filter(ours).map(node).collect()
    }

    /// Physical address and length of the map that begins at `offset` of the device file.
    #[must_use]
    pub fn map_at(&self, offset: u64, page_bytes: u64) -> Option<(u64, u64)> {
        let (_, address, bytes) =
            self.maps.iter().find(|(index, ..)| u64::from(*index) * page_bytes == offset)?;
        Some((*address, *bytes))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Region {
    start: u64,
    end: u64,
    physical: u64,
}

/// The mapped regions of a program.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Regions(Vec<Region>);

impl Regions {
    /// Adds a mapping.
    pub fn add(&mut self, start: u64, bytes: u64, physical: u64) {
        self.remove(start, bytes);
        self.0.push(Region { start, end: start.saturating_add(bytes), physical });
    }

    /// Removes a range that is unmapped, or mapped to something else.
    pub fn remove(&mut self, start: u64, bytes: u64) {
        let end = start.saturating_add(bytes);
        let mut kept = Vec::new();
        for region in self.0.drain(..) {
            let before = Region { end: region.end.min(start), ..region };
            let skipped = end.max(region.start) - region.start;
            let physical = region.physical.saturating_add(skipped);
            let after = Region { start: end.max(region.start), end: region.end, physical };
            kept.extend([before, after].into_iter().filter(|part| part.start < part.end));
        }
        self.0 = kept;
    }

    /// Whether a range overlaps a region.
    #[must_use]
    pub fn touch(&self, start: u64, bytes: u64) -> bool {
        let end = start.saturating_add(bytes);
        self.0.iter().any(|region| region.start < end && start < region.end)
    }

    /// The physical address behind a virtual one.
    #[must_use]
    pub fn physical(&self, address: u64) -> Option<u64> {
        let region = self.0.iter().find(|region| (region.start..region.end).contains(&address))?;
        Some(region.physical + (address - region.start))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn addresses_are_translated_inside_regions_only() {
        let mut regions = Regions::default();
        regions.add(0x7000_0000, 0x1_0000, 0xA000_0000);
        regions.add(0x7001_0000, 0x1000, 0xA004_0000);
        assert_eq!(regions.physical(0x7000_0030), Some(0xA000_0030));
        assert_eq!(regions.physical(0x7000_FFFC), Some(0xA000_FFFC));
        assert_eq!(regions.physical(0x7001_0188), Some(0xA004_0188));
        assert_eq!(regions.physical(0x7001_1000), None);
        assert_eq!(regions.physical(0x6FFF_FFFC), None);
    }

    #[test]
    fn what_is_unmapped_is_forgotten_also_in_the_middle() {
        let mut regions = Regions::default();
        regions.add(0x1_0000, 0x3000, 0xA000_0000);
        regions.remove(0x1_1000, 0x1000);
        assert_eq!(regions.physical(0x1_0FFC), Some(0xA000_0FFC));
        assert_eq!(regions.physical(0x1_1000), None);
        assert_eq!(regions.physical(0x1_2004), Some(0xA000_2004));
        assert!(regions.touch(0x1_1FFF, 2) && !regions.touch(0x1_1000, 0x1000));
        regions.remove(0, u64::MAX);
        assert_eq!(regions, Regions::default());
    }

    #[test]
    fn the_boards_nodes_are_found_by_name_and_their_maps_by_page() {
        let root = tempfile::tempdir().expect("a directory");
        for (number, name) in [(0, "zdma"), (1, "pgs-memory"), (2, "pgs"), (3, "pgs-dma1")] {
            for (map, address) in [(0, 0xA000_0000_u64), (1, 0xA001_0000)] {
                let maps = root.path().join(format!("uio{number}/maps/map{map}"));
                fs::create_dir_all(&maps).expect("made");
                for (file, text) in [("addr", address), ("size", 0x1_0000), ("offset", 0)] {
                    fs::write(maps.join(file), format!("{text:#x}\n")).expect("written");
                }
            }
            fs::write(root.path().join(format!("uio{number}/name")), name).expect("written");
        }
        let nodes = zynq_pgs::platform::uio_nodes(root.path()).expect("readable");
        let nodes = Node::of_the_board(&nodes, Path::new("/dev"));
        let paths: Vec<_> = nodes.iter().map(|node| node.path.as_path()).collect();
        assert_eq!(paths, [Path::new("/dev/uio2"), Path::new("/dev/uio3")]);
        assert_eq!(nodes[0].map_at(0x1000, 0x1000), Some((0xA001_0000, 0x1_0000)));
        assert_eq!(nodes[0].map_at(0x2000, 0x1000), None);
    }
}
