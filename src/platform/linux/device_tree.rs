//! Reads the lengths of a device's regions from the device tree.
//!
//! `uio_pdrv_genirq` rounds every region up to whole pages; the node's `reg` is exact. The regions
//! are the entries of `reg`, in its order. An entry is an address and a length in big-endian cells,
//! whose numbers are the parent's `#address-cells` and `#size-cells`.
//!
//! Source: Devicetree Specification 0.4, 2.3.5 and 2.3.6; Linux `drivers/of/platform.c`,
//! `drivers/uio/uio_pdrv_genirq.c`.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::platform::{PlatformError, Result};

/// Lengths of the regions in the `reg` of a device-tree node, a folder, by number. `None` without a
/// node or a `reg`: the device does not come from a device tree.
pub(crate) fn region_lengths(node: &Path) -> Result<Option<Vec<u64>>> {
    let path = node.join("reg");
    let Some(reg) = bytes(&path)? else { return Ok(None) };
    // `..` after the link is the parent in the tree.
    let cells = |name: &str, default| -> Result<usize> {
        let path = node.join("..").join(name);
        let Some(found) = bytes(&path)? else { return Ok(default) };
        match <[u8; 4]>::try_from(found.as_slice()).map(u32::from_be_bytes) {
            Ok(cells @ 1..=2) => Ok(cells as usize),
            _ => Err(PlatformError::DeviceTree { path, expected: "one cell of 1 or 2", found }),
        }
    };
    let (address, length) = (4 * cells("#address-cells", 2)?, 4 * cells("#size-cells", 1)?);
    if reg.is_empty() || reg.len() % (address + length) != 0 {
        let expected = "whole entries of an address and a length";
        return Err(PlatformError::DeviceTree { path, expected, found: reg });
    }
    let number = |entry: &[u8]| {
        entry[address..].iter().fold(0_u64, |number, byte| number << 8 | u64::from(*byte))
    };
    Ok(Some(reg.chunks_exact(address + length).map(number).collect()))
}

/// The bytes of a property, if it exists.
fn bytes(path: &Path) -> Result<Option<Vec<u8>>> {
    match fs::read(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(source) if source.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(PlatformError::File { act: "read", path: PathBuf::from(path), source }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A node in a tree, reached through a link as in sysfs.
    fn node(cells: Option<(u32, u32)>, reg: &[u32]) -> (tempfile::TempDir, PathBuf) {
        let root = tempfile::tempdir().expect("a directory");
        let node = root.path().join("tree/axi/pgs@a0000000");
        fs::create_dir_all(&node).expect("made");
        if let Some((address, size)) = cells {
            let axi = root.path().join("tree/axi");
            fs::write(axi.join("#address-cells"), address.to_be_bytes()).expect("written");
            fs::write(axi.join("#size-cells"), size.to_be_bytes()).expect("written");
        }
        let reg: Vec<u8> = reg.iter().flat_map(|cell| cell.to_be_bytes()).collect();
        fs::write(node.join("reg"), reg).expect("written");
        fs::create_dir_all(root.path().join("device")).expect("made");
        let link = root.path().join("device/of_node");
        std::os::unix::fs::symlink("../tree/axi/pgs@a0000000", &link).expect("linked");
        (root, link)
    }

    #[test]
    fn lengths_are_those_of_the_entries_by_the_parents_cells() {
        let two = [0, 0xA000_0000, 0, 0x1_0000, 0, 0xA004_0000, 1, 0x1000];
        let (_root, link) = node(Some((2, 2)), &two);
        let lengths = region_lengths(&link).expect("as it should be");
        assert_eq!(lengths, Some(vec![0x1_0000, 0x1_0000_1000]));
        let (_root, link) = node(Some((1, 1)), &[0xA000_0000, 0x1_0000, 0xA004_0000, 0x1004]);
        assert_eq!(region_lengths(&link).expect("as it should be"), Some(vec![0x1_0000, 0x1004]));
        // The default: two cells of address and one of length.
        let (_root, link) = node(None, &[8, 0, 0x800]);
        assert_eq!(region_lengths(&link).expect("as it should be"), Some(vec![0x800]));
    }

    #[test]
    fn a_device_without_a_node_or_without_regions_has_none() {
        let (root, link) = node(Some((2, 2)), &[0, 0, 0, 0]);
        fs::remove_file(link.join("reg")).expect("removed");
        assert_eq!(region_lengths(&link).expect("no error"), None);
        assert_eq!(region_lengths(&root.path().join("absent")).expect("no error"), None);
    }

    #[test]
    fn what_is_no_list_of_regions_is_an_error_that_names_the_file() {
        for (cells, reg) in
            [((2, 2), &[0, 1, 2][..]), ((2, 2), &[]), ((1, 0), &[0]), ((3, 2), &[0; 5])]
        {
            let (_root, link) = node(Some(cells), reg);
            let error = region_lengths(&link).expect_err("not a list");
            assert!(matches!(error, PlatformError::DeviceTree { .. }), "{error}");
            assert!(error.to_string().contains("of_node"), "{error}");
        }
    }
}
