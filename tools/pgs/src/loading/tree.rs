//! Judges a compiled overlay by its content, before the kernel gets it.
//!
//! Source: Devicetree Specification 0.4, chapter 5; Linux,
//! `Documentation/devicetree/overlay-notes.rst`.

use std::path::Path;

use super::bitstream::{Format, format};
use super::system::read_plain;
use super::{LoadError, Request, has_registers, is_ours_by_name};

/// The largest overlay that the kernel takes.
const BYTES_MAX: u64 = 1 << 20;

/// First bytes of every compiled device tree.
pub(super) const MAGIC: [u8; 4] = [0xD0, 0x0D, 0xFE, 0xED];
/// Tokens of the structure block.
const BEGIN: u32 = 1;
const END_NODE: u32 = 2;
const PROPERTY: u32 = 3;
const NOP: u32 = 4;
const END: u32 = 9;
/// The node of a fragment that holds what is added to the fragment's target.
const CONTENT: &str = "__overlay__";
/// Nodes inside each other; real trees have fewer than ten.
const DEPTH_MAX: usize = 64;
/// Number of the PL clock 0 (`PL0_REF`) in the bindings of the chip's clock controller.
const PL_CLOCK_0: u32 = 71;

/// A property: the path of its node, its name, its value.
type Found<'a> = (String, &'a str, &'a [u8]);

/// The effects of an overlay.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Overlay {
    pub(super) fragments: usize,
    /// Bitstreams that the kernel loads because the overlay names them.
    pub(super) firmware: Vec<String>,
    /// The rate that it sets for the PL clock 0, Hz.
    pub(super) clock_hz: Option<u32>,
    /// Whether it has a node for the accelerator's registers.
    pub(super) has_accelerator: bool,
}

/// Judges the overlay of a request for a bitstream that asks for a rate of the PL clock 0; returns
/// it with its bytes.
pub(super) fn judge(
    request: &Request,
    path: &Path,
    wanted_mhz: Option<u32>,
) -> Result<(Overlay, Vec<u8>), LoadError> {
    let wrong = |found: String| LoadError::Overlay { path: path.to_owned(), found };
    let tree = read_plain(path, BYTES_MAX)?.map_err(wrong)?;
    if !tree.starts_with(&MAGIC) {
        return Err(wrong(match format(&tree) {
            _ if tree.starts_with(b"/dts-v1/") => "the source of a device tree".to_owned(),
            Format::Other("a text", _) => "a text: a source, perhaps".to_owned(),
            Format::Other(found, _) => found.to_owned(),
            Format::Bitstream(_) => "a bitstream".to_owned(),
            Format::Unknown => "something else".to_owned(),
        }));
    }
    let overlay = read(&tree).map_err(wrong)?;
    let given = request.bitstream.file_name().unwrap_or_default().to_string_lossy();
    let named = |name: &str| Path::new(name).file_name().is_some_and(|name| *name == *given);
    if let Some(firmware) = overlay.firmware.iter().find(|name| !named(name)) {
        return Err(LoadError::own_firmware(path, firmware, &given));
    }
    if !overlay.has_accelerator {
        let found = "one without a node for the accelerator's registers".to_owned();
        request.unless_overridden(wrong(found))?;
    }
    if let (Some(wanted), Some(sets_hz)) = (wanted_mhz, overlay.clock_hz) {
        // The kernel takes the nearest that its dividers give, as 99999001 Hz.
        let wanted_hz = u64::from(wanted) * 1_000_000;
        if u64::from(sets_hz).abs_diff(wanted_hz) > wanted_hz / 100 {
            let path = path.to_owned();
            request.unless_overridden(LoadError::OtherClock { path, sets_hz, wanted })?;
        }
    }
    Ok((overlay, tree))
}

/// Reads an overlay; otherwise says what the file is.
fn read(tree: &[u8]) -> Result<Overlay, String> {
    let length = word(tree, 4).ok_or("the first bytes of one")? as usize;
    if length > tree.len() {
        return Err(format!("the first {} bytes of one of {length}", tree.len()));
    }
    let properties = properties(tree).ok_or("a damaged one")?;
    let of = |path: &str, wanted: &str| {
        let found = properties.iter().find(|(at, name, _)| at == path && *name == wanted);
        found.map(|(.., value)| *value)
    };
    let mut overlay = Overlay::default();
    for (path, name, value) in &properties {
        let Some((_, inside)) = path.split_once(&format!("/{CONTENT}")) else {
            // A fragment has a target, and stands below the root.
            let is_fragment =
                path.matches('/').count() == 1 && matches!(*name, "target" | "target-path");
            overlay.fragments += usize::from(is_fragment);
            continue;
        };
        let node = path.rsplit('/').next().unwrap_or_default();
        match *name {
            // Other devices load firmware, too.
            "firmware-name"
                if inside.is_empty()
                    || of(path, "compatible").is_some_and(|kind| kind == b"fpga-region\0") =>
            {
                let names = value.split(|byte| *byte == 0).filter(|name| !name.is_empty());
                overlay
                    .firmware
                    .extend(names.map(|name| String::from_utf8_lossy(name).into_owned()));
            }
            "assigned-clock-rates" => {
                let clocks = of(path, "assigned-clocks").unwrap_or_default();
                // A clock is a reference and a number.
                let pl = clocks.chunks_exact(8).position(|c| word(c, 4) == Some(PL_CLOCK_0));
                overlay.clock_hz = pl.and_then(|at| word(value, 4 * at)).or(overlay.clock_hz);
            }
            "reg" => {
                let (own, address) = node.split_once('@').unwrap_or((node, ""));
                let address = u64::from_str_radix(address, 16);
                let there = address.is_ok_and(has_registers);
                overlay.has_accelerator |= there || is_ours_by_name(own);
            }
            _ => {}
        }
    }
    match overlay.fragments {
        0 => Err("a base tree: it has no fragments".to_owned()),
        _ => Ok(overlay),
    }
}

/// The big-endian word at an offset.
fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let word = bytes.get(at..at.checked_add(4)?)?;
    Some(word.iter().fold(0, |word, byte| word << 8 | u32::from(*byte)))
}

/// The text that begins at an offset and ends with a zero.
fn text(bytes: &[u8], at: usize) -> Option<&str> {
    let rest = bytes.get(at..)?;
    let end = rest.iter().position(|byte| *byte == 0)?;
    std::str::from_utf8(&rest[..end]).ok()
}

/// All properties of a tree; `None` if it is no tree.
fn properties(tree: &[u8]) -> Option<Vec<Found<'_>>> {
    let (structure, strings) = (word(tree, 8)? as usize, word(tree, 12)? as usize);
    let (nodes, names) = (tree.get(structure..)?, tree.get(strings..)?);
    let (mut at, mut path, mut found) = (0, Vec::new(), Vec::new());
    loop {
        let token = word(nodes, at)?;
        at += 4;
        match token {
            BEGIN => {
                let name = text(nodes, at)?;
                at = (at + name.len() + 1).next_multiple_of(4);
                path.push(name);
                if path.len() > DEPTH_MAX {
                    return None;
                }
            }
            END_NODE => drop(path.pop()?),
            PROPERTY => {
                let length = word(nodes, at)? as usize;
                let name = text(names, word(nodes, at + 4)? as usize)?;
                let value = nodes.get(at + 8..(at + 8).checked_add(length)?)?;
                at = (at + 8 + length).next_multiple_of(4);
                found.push((path.join("/"), name, value));
            }
            NOP => {}
            END => return path.is_empty().then_some(found),
            _ => return None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::files::{Node, Property, overlay, tree};
    use super::{Overlay, read};

    #[test]
    fn an_overlay_tells_its_clock_its_bitstream_and_its_node() {
        let found = read(&overlay(Some(100_000_000), Some("x.bit.bin"))).expect("an overlay");
        let firmware = vec!["x.bit.bin".to_owned()];
        let clock_hz = Some(100_000_000);
        assert_eq!(found, Overlay { fragments: 1, firmware, clock_hz, has_accelerator: true });
        let found = read(&overlay(None, None)).expect("an overlay");
        assert_eq!((found.clock_hz, found.firmware.len()), (None, 0));

        // Another clock, the firmware of a coprocessor, registers outside of the logic.
        let device: &[Property<'_>] = &[
            ("firmware-name", b"elf\0"),
            ("reg", &[0; 8]),
            ("assigned-clocks", &[0, 0, 0, 1, 0, 0, 0, 72]),
            ("assigned-clock-rates", &[5; 4]),
        ];
        let file = Node("", &[], &[Node("rpu@ff9a0000", device, &[])]).overlay();
        assert_eq!(read(&file), Ok(Overlay { fragments: 1, ..Overlay::default() }));
    }

    #[test]
    fn a_base_tree_and_a_file_that_breaks_off_or_is_damaged_are_none() {
        let refused = |tree: &[u8]| read(tree).expect_err("refused");
        let base = tree(Node("", &[("compatible", b"board\0")], &[Node("chosen", &[], &[])]));
        assert!(refused(&base).contains("base tree"));
        let file = overlay(Some(1), Some("x"));
        for bytes in 8..file.len() {
            assert!(refused(&file[..bytes]).contains("the first"), "{bytes}");
        }
        assert!(refused(&file[..4]).contains("the first bytes"));
        // Any byte that is wrong is an answer, not a panic.
        for at in 8..file.len() {
            for byte in [0, 0x7F, 0xFF] {
                let mut wrong = file.clone();
                wrong[at] = byte;
                let _ = read(&wrong);
            }
        }
        let mut token = file.clone();
        token[56 + 3] = 7;
        assert_eq!(refused(&token), "a damaged one");
    }
}
