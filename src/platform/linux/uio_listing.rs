//! Lists the UIO nodes of a system; an unreadable node hides no other.

use std::path::Path;

use pgs_interface::address_map::UIO_CONTROL_MAP;

use super::sysfs::{is_gone, numbered, read, read_if_present, read_number};
use crate::platform::{NodePart, PlatformError, Result, UioMap, UioNode};

/// A UIO node whose description cannot be read.
#[derive(Debug)]
#[non_exhaustive]
pub struct UnreadableNode {
    /// The kernel's name, `uio0`.
    pub device: String,
    /// The device tree's name for it, if that can be read.
    pub name: Option<String>,
    /// Why it cannot be read.
    pub error: PlatformError,
}

/// The UIO nodes of a system, by number.
#[derive(Debug, Default)]
#[non_exhaustive]
pub struct UioListing {
    /// Readable nodes.
    pub nodes: Vec<UioNode>,
    /// Nodes whose description cannot be read.
    pub unreadable: Vec<UnreadableNode>,
}

/// The name of the node of one region, where each region of the board `board` has a node.
pub(crate) fn part_name(board: &str, region: &str) -> String {
    format!("{board}-{region}")
}

impl UioListing {
    /// Whether a node has that name, readable or not.
    pub(crate) fn has(&self, name: &str) -> bool {
        let unreadable = self.unreadable.iter().any(|node| node.name.as_deref() == Some(name));
        unreadable || self.nodes.iter().any(|node| node.name == name)
    }

    /// The one node of that name.
    pub(crate) fn node(&mut self, name: &str) -> Result<UioNode> {
        let unreadable = self.unreadable.iter().position(|node| node.name.as_deref() == Some(name));
        if let Some(at) = unreadable {
            return Err(self.unreadable.remove(at).error);
        }
        let named: Vec<_> = self.nodes.iter().filter(|node| node.name == name).collect();
        match named[..] {
            [only] => Ok(only.clone()),
            [] => Err(PlatformError::NoNode { wanted: name.to_owned(), found: self.names() }),
            _ => {
                let devices: Vec<_> = named.iter().map(|node| node.device.as_str()).collect();
                let devices = devices.join(", ");
                Err(PlatformError::SeveralNodes { wanted: name.to_owned(), devices })
            }
        }
    }

    /// The names of all nodes.
    fn names(&self) -> String {
        let unreadable = self.unreadable.iter().map(|node| match &node.name {
            Some(name) => name.clone(),
            None => format!("{}, whose name cannot be read", node.device),
        });
        let names: Vec<_> = self.nodes.iter().map(|n| n.name.clone()).chain(unreadable).collect();
        names.join(", ")
    }

    /// Whether the board `board` has nodes: one of that name, or `<board>-control`.
    ///
    /// # Errors
    /// No node has such a name, but the name of a node cannot be read: it may be that board.
    pub fn has_board(&mut self, board: &str) -> Result<bool, PlatformError> {
        if self.has(board) || self.has(&part_name(board, UIO_CONTROL_MAP)) {
            return Ok(true);
        }
        match self.unreadable.iter().position(|node| node.name.is_none()) {
            Some(at) => Err(self.unreadable.remove(at).error),
            None => Ok(false),
        }
    }

    /// Says that the board `board` has no nodes, and names a node that looks like it.
    #[must_use]
    pub fn without_board(&self, board: &str) -> String {
        let none = format!("there is no UIO node named {board:?}");
        let like = |node: &&UioNode| {
            matches!(
                node.part(),
                Some(NodePart::Accelerator | NodePart::Unnamed | NodePart::Region(_))
            )
        };
        match self.nodes.iter().find(like) {
            Some(UioNode { device, name, .. }) => {
                format!("{none}, but {device} {name:?} has its regions")
            }
            None => none,
        }
    }
}

/// The UIO nodes under `class` (normally [`UIO_CLASS`](crate::platform::UIO_CLASS)). A node that
/// goes away meanwhile is left out; a system without UIO has no nodes.
///
/// # Errors
/// The directory cannot be listed.
pub fn uio_listing(class: &Path) -> Result<UioListing, PlatformError> {
    let mut listing = UioListing::default();
    for (number, path) in numbered(class, "uio")? {
        let device = format!("uio{number}");
        let name = match read(&path.join("name")) {
            Ok(name) => name,
            Err(error) if is_gone(&error) => continue,
            Err(error) => {
                listing.unreadable.push(UnreadableNode { device, name: None, error });
                continue;
            }
        };
        match maps(&path) {
            Ok(maps) => listing.nodes.push(UioNode { device, name, maps }),
            // The kernel removes the name with the node.
            Err(error) if is_gone(&error) && !path.join("name").exists() => {}
            Err(error) => {
                listing.unreadable.push(UnreadableNode { device, name: Some(name), error });
            }
        }
    }
    Ok(listing)
}

/// The readable nodes of [`uio_listing`]; the others are logged.
///
/// # Errors
/// As [`uio_listing`].
pub fn uio_nodes(class: &Path) -> Result<Vec<UioNode>, PlatformError> {
    let UioListing { nodes, unreadable } = uio_listing(class)?;
    for UnreadableNode { device, error, .. } in unreadable {
        log::warn!("UIO node {device} cannot be read: {error}");
    }
    Ok(nodes)
}

/// The regions of a node, by number.
fn maps(node: &Path) -> Result<Vec<UioMap>> {
    let map = |(index, map): (u32, std::path::PathBuf)| {
        Ok(UioMap {
            index,
            // The name is younger than the other files and may be absent.
            name: read_if_present(&map.join("name"))?.unwrap_or_default(),
            address: read_number(&map.join("addr"))?,
            bytes: read_number(&map.join("size"))?,
            offset: read_number(&map.join("offset"))?,
        })
    };
    numbered(&node.join("maps"), "map")?.into_iter().map(map).collect()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::platform::System;
    use crate::platform::uio_fake::{add_node, empty_system, regions};

    fn system() -> (tempfile::TempDir, System) {
        let (root, system) = empty_system();
        add_node(&system, 10, "pgs", &regions());
        add_node(&system, 2, "axi-pmon", &[("pmon", 0xFD0B_0000, 0x1000)]);
        (root, system)
    }

    #[test]
    fn a_system_without_uio_has_no_nodes() {
        assert_eq!(uio_nodes(Path::new("/nonexistent/uio")).expect("no error"), []);
    }

    #[test]
    fn nodes_are_listed_by_number_with_their_regions() {
        let (_root, system) = system();
        fs::write(system.uio.join("uevent"), "").expect("written");
        let mut listing = uio_listing(&system.uio).expect("readable");
        let nodes = &listing.nodes;
        let names: Vec<_> = nodes.iter().map(|n| (n.device.as_str(), n.name.as_str())).collect();
        assert_eq!(names, [("uio2", "axi-pmon"), ("uio10", "pgs")]);
        assert_eq!(nodes[1].maps.len(), 5);
        let control = nodes[1].map("control").expect("named");
        assert_eq!(
            (control.index, control.address, control.bytes, control.offset),
            (4, 0xA004_0000, 0x1000, 0)
        );
        let missing = listing.node("other").expect_err("there is none").to_string();
        assert!(missing.contains("\"other\" (found: axi-pmon, pgs)"), "{missing}");
    }

    #[test]
    fn a_node_that_cannot_be_read_hides_no_other_and_is_named_with_its_path() {
        let (_root, system) = system();
        fs::write(system.uio.join("uio2/maps/map0/size"), "large\n").expect("written");
        let mut listing = uio_listing(&system.uio).expect("listed");
        assert_eq!(listing.node("pgs").expect("readable").device, "uio10");
        assert!(listing.has_board("pgs").expect("no doubt"));
        let error = listing.node("axi-pmon").expect_err("not a number").to_string();
        assert!(error.contains("uio2/maps/map0/size") && error.contains("large"), "{error}");
        assert_eq!(uio_nodes(&system.uio).expect("listed").len(), 1);
    }

    #[test]
    fn a_node_without_a_readable_name_may_be_the_board_that_is_missing() {
        let (_root, system) = system();
        let name = system.uio.join("uio2/name");
        fs::remove_file(&name).expect("removed");
        fs::create_dir(&name).expect("a directory is no text");
        let mut listing = uio_listing(&system.uio).expect("listed");
        assert!(listing.has_board("pgs").expect("there it is"));
        let missing = listing.node("other").expect_err("there is none").to_string();
        assert!(missing.contains("pgs, uio2, whose name cannot be read"), "{missing}");
        let error = listing.has_board("other").expect_err("uio2 may be").to_string();
        assert!(error.contains("uio2/name"), "{error}");
        assert!(!listing.has_board("other").expect("the error was handed out"));
    }

    #[test]
    fn a_node_that_goes_away_is_not_there() {
        let (_root, system) = system();
        // The kernel has removed the name, and the rest is next.
        fs::remove_file(system.uio.join("uio2/name")).expect("removed");
        let listing = uio_listing(&system.uio).expect("listed");
        assert_eq!((listing.nodes.len(), listing.unreadable.len()), (1, 0));
        // A link to a device that is gone.
        std::os::unix::fs::symlink("../nowhere", system.uio.join("uio3")).expect("linked");
        let listing = uio_listing(&system.uio).expect("listed");
        assert_eq!((listing.nodes.len(), listing.unreadable.len()), (1, 0));
        // A node that stays and lacks a file is one that cannot be read.
        fs::remove_file(system.uio.join("uio10/maps/map3/size")).expect("removed");
        let listing = uio_listing(&system.uio).expect("listed");
        assert_eq!((listing.nodes.len(), listing.unreadable.len()), (0, 1));
    }

    #[test]
    fn two_nodes_of_one_name_are_not_told_apart_by_their_numbers() {
        let (_root, system) = system();
        add_node(&system, 3, "pgs", &regions());
        let mut listing = uio_listing(&system.uio).expect("listed");
        let error = listing.node("pgs").expect_err("two").to_string();
        assert!(error.contains("uio3, uio10"), "{error}");
    }
}
