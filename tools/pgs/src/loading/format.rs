//! Recognises a file's format by its first KiB, before the kernel gets it.

use std::fs::{self, File};
use std::io::Read as _;
use std::path::Path;

use super::LoadError;

/// Bytes that are searched for the sync word of a bitstream.
const HEAD_BYTES: usize = 1024;
/// The sync word of a bitstream, as bootgen byte-swaps it for the processor.
const SYNC: [u8; 4] = [0x66, 0x55, 0x99, 0xAA];
/// The sync word as Vivado writes it, for a configuration port.
const SYNC_UNTURNED: [u8; 4] = [0xAA, 0x99, 0x55, 0x66];
/// The beginning of Vivado's header: nine bytes, a one, and the tag of the design's name.
const BIT_HEADER: [u8; 14] = *b"\x00\x09\x0f\xf0\x0f\xf0\x0f\xf0\x0f\xf0\x00\x00\x01a";
/// First bytes of every compiled device tree.
const DEVICE_TREE: [u8; 4] = [0xD0, 0x0D, 0xFE, 0xED];
/// The second word of a compiled device tree is its length.
const TREE_LENGTH: std::ops::Range<usize> = 4..8;

/// Offset and bytes of a format's signature, the name of the format, and the advice if a bitstream
/// is expected.
type Signature = (usize, &'static [u8], &'static str, Advice);

/// The next step for a file that is no bitstream.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Advice {
    /// Convert it with bootgen.
    Bootgen,
    /// Swap the bytes of every word.
    Turn,
    /// Unpack it.
    Unpack,
    /// Put it on the boot medium: it is loaded when the board starts.
    BootImage,
    /// Get a bitstream for this chip.
    OtherChip,
    /// Pass it as the overlay.
    Overlay,
    /// Fetch the file itself.
    Fetch,
    /// Read how the files are made.
    Readme,
}

impl Advice {
    pub(super) fn text(self, path: &Path) -> String {
        let name = path.display();
        let readme = "see device-tree/README.md for how the files are made";
        match self {
            Self::Bootgen => format!(
                "convert it: echo 'all: {{ {name} }}' > x.bif && bootgen -image x.bif -arch zynqmp \
                 -process_bitstream bin, and load the .bit.bin that it makes"
            ),
            Self::Turn => format!(
                "convert the .bit of the same design by bootgen (device-tree/README.md), or turn \
                 the bytes of this one: objcopy -I binary -O binary --reverse-bytes=4 {name} \
                 {name}.bit.bin"
            ),
            Self::Unpack => {
                format!("unpack {name}, and load the .bit.bin in it, or convert its .bit")
            }
            Self::BootImage => "a boot image is started by the board: copy it to the boot medium; \
                                to load its bitstream from Linux convert the .bit by bootgen with \
                                -process_bitstream bin. Bitstreams that are encrypted or \
                                authenticated are loaded by fpgautil -f"
                .to_owned(),
            Self::OtherChip => {
                format!("it is not for the ZynqMP: build the design for this chip, then {readme}")
            }
            Self::Overlay => {
                "give the bitstream (.bit.bin) first, and this file by --overlay".to_owned()
            }
            Self::Fetch => "fetch the file itself: by `git lfs pull`, or once more from where it \
                            came from"
                .to_owned(),
            Self::Readme => readme.to_owned(),
        }
    }
}

/// Formats that are mistaken for bitstreams, by their first bytes.
const SIGNATURES: &[Signature] = &[
    (0, &BIT_HEADER, "Vivado's .bit", Advice::Bootgen),
    (0, &DEVICE_TREE, "a compiled device tree", Advice::Overlay),
    // Headers of boot images also hold a byte-swapped sync word.
    (0x24, b"XNLX", "a boot image", Advice::BootImage),
    (0x14, b"XNLX", "a programmable device image (.pdi) of a Versal", Advice::OtherChip),
    (0, b"\x7fELF", "a program", Advice::Readme),
    (0, b"xclbin2\0", "an xclbin container", Advice::Unpack),
    (0, b"\x1f\x8b", "a gzip archive", Advice::Unpack),
    (0, b"PK\x03\x04", "a zip archive (as an .xsa is)", Advice::Unpack),
    (0, b"\xfd7zXZ\0", "an xz archive", Advice::Unpack),
    (0, b"\x28\xb5\x2f\xfd", "a zstd archive", Advice::Unpack),
    (0, b"\x04\x22\x4d\x18", "an lz4 archive", Advice::Unpack),
    (0, b"BZh", "a bzip2 archive", Advice::Unpack),
    (0, b"7z\xbc\xaf\x27\x1c", "a 7z archive", Advice::Unpack),
    (257, b"ustar", "a tar archive", Advice::Unpack),
    (0, b"!<arch>\n", "a package", Advice::Unpack),
    (0, b"\x27\x05\x19\x56", "a U-Boot image", Advice::Unpack),
    (0, b"version https://git-lfs", "a git-lfs pointer", Advice::Fetch),
    (0, b"<!DOCTYPE", "a web page", Advice::Fetch),
    (0, b"<!doctype", "a web page", Advice::Fetch),
    (0, b"<html", "a web page", Advice::Fetch),
    (0, b"<HTML", "a web page", Advice::Fetch),
];

/// The format of a file that the kernel does not take as a bitstream; `None` if it takes it.
fn other_format(head: &[u8]) -> Option<(&'static str, Advice)> {
    if head.is_empty() {
        return Some(("an empty file", Advice::Fetch));
    }
    let begins =
        |(at, bytes, ..): &&Signature| head.get(*at..).is_some_and(|rest| rest.starts_with(bytes));
    if let Some((.., what, advice)) = SIGNATURES.iter().find(begins) {
        return Some((what, *advice));
    }
    let find = |word: [u8; 4]| head.windows(word.len()).position(|bytes| bytes == word);
    match (find(SYNC), find(SYNC_UNTURNED)) {
        (Some(at), Some(unturned)) if unturned < at => Some((UNTURNED, Advice::Turn)),
        (Some(_), _) => None,
        (None, Some(_)) => Some((UNTURNED, Advice::Turn)),
        (None, None) if is_text(head) => Some(("a text", Advice::Readme)),
        (None, None) => Some(("no sync word (66 55 99 AA) in its first KiB", Advice::Readme)),
    }
}

/// A bitstream for a configuration port, without a header.
const UNTURNED: &str = "a bitstream whose bytes are not turned (sync word AA 99 55 66)";

/// Whether all of it is printable UTF-8; the last character may be cut off.
fn is_text(head: &[u8]) -> bool {
    let text = match std::str::from_utf8(head) {
        Ok(text) => text,
        Err(error) if error.error_len().is_none() => {
            std::str::from_utf8(&head[..error.valid_up_to()]).unwrap_or_default()
        }
        Err(_) => return false,
    };
    !text.is_empty() && text.chars().all(|c| !c.is_control() || c.is_ascii_whitespace())
}

/// The length of a file that the kernel can read; the content is not checked.
pub(super) fn length(path: &Path) -> Result<u64, LoadError> {
    let meta = fs::metadata(path).map_err(|source| LoadError::unreadable(path, source))?;
    if !meta.is_file() {
        return Err(LoadError::bitstream(path, "no plain file", Advice::Readme));
    }
    File::open(path).map_err(|source| LoadError::unreadable(path, source))?;
    Ok(meta.len())
}

/// Refuses a file that the kernel does not take as a bitstream.
pub(super) fn require_bitstream(path: &Path) -> Result<(), LoadError> {
    let mut head = Vec::new();
    File::open(path)
        .and_then(|file| file.take(HEAD_BYTES as u64).read_to_end(&mut head))
        .map_err(|source| LoadError::unreadable(path, source))?;
    match other_format(&head) {
        None => Ok(()),
        Some((found, advice)) => Err(LoadError::bitstream(path, found, advice)),
    }
}

/// Refuses a file that is no compiled device tree, or is truncated.
pub(super) fn require_overlay(path: &Path, tree: &[u8]) -> Result<(), LoadError> {
    let wrong =
        |found: &str| Err(LoadError::Overlay { path: path.to_owned(), found: found.to_owned() });
    if !tree.starts_with(&DEVICE_TREE) {
        let head = &tree[..tree.len().min(HEAD_BYTES)];
        return match other_format(head) {
            _ if head.starts_with(b"/dts-v1/") => wrong("the source of a device tree"),
            Some(("a text", _)) => wrong("a text: a source, perhaps"),
            Some((found, _)) if !found.starts_with("no sync") => wrong(found),
            Some(_) => wrong("something else"),
            None => wrong("a bitstream"),
        };
    }
    let length = tree.get(TREE_LENGTH).and_then(|word| <[u8; 4]>::try_from(word).ok());
    match length.map(u32::from_be_bytes) {
        Some(length) if length as usize > tree.len() => {
            wrong(&format!("the first {} bytes of one of {length}", tree.len()))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(head: &[u8]) -> Option<&'static str> {
        other_format(head).map(|(what, _)| what)
    }

    /// Zeros with `bytes` at offset `at`.
    fn with(at: usize, bytes: &[u8]) -> Vec<u8> {
        let mut head = vec![0; HEAD_BYTES];
        head[at..at + bytes.len()].copy_from_slice(bytes);
        head
    }

    #[test]
    fn a_bitstream_has_the_turned_sync_word_somewhere_in_its_first_kib() {
        for at in [0, 32, 48, HEAD_BYTES - 4] {
            assert_eq!(found(&with(at, &SYNC)), None, "{at}");
            assert_eq!(found(&with(at, &SYNC_UNTURNED)), Some(UNTURNED), "{at}");
        }
        assert_eq!(found(&SYNC), None, "a short one");
        // The first sync word decides.
        let both = |first: [u8; 4], then: [u8; 4]| found(&[first, [0; 4], then].concat());
        assert_eq!(both(SYNC, SYNC_UNTURNED), None);
        assert_eq!(both(SYNC_UNTURNED, SYNC), Some(UNTURNED));
        for nothing in [vec![0; HEAD_BYTES], vec![0xFF; 40], with(0, &SYNC[..3])] {
            assert!(found(&nothing).is_some_and(|what| what.starts_with("no sync word")));
        }
    }

    #[test]
    fn each_format_that_is_mistaken_for_one_is_named() {
        let mut bit = BIT_HEADER.to_vec();
        bit.extend(b"\x00\x10design_1;UserID");
        bit.extend(SYNC_UNTURNED);
        // Byte-swapped words may follow a header, too.
        let mut turned_bit = BIT_HEADER.to_vec();
        turned_bit.extend(SYNC);
        let image = |at| with(at, &[&SYNC[..], b"XNLX"].concat());
        for (head, what) in [
            (bit, "Vivado's .bit"),
            (turned_bit, "Vivado's .bit"),
            (image(0x20), "a boot image"),
            (image(0x10), "a programmable device image (.pdi) of a Versal"),
            (b"\x1f\x8b\x08\0".to_vec(), "a gzip archive"),
            (b"PK\x03\x04\x14".to_vec(), "a zip archive (as an .xsa is)"),
            (with(257, b"ustar"), "a tar archive"),
            (b"\xfd7zXZ\0".to_vec(), "an xz archive"),
            (b"xclbin2\0".to_vec(), "an xclbin container"),
            (b"\x7fELF\x02".to_vec(), "a program"),
            (DEVICE_TREE.to_vec(), "a compiled device tree"),
            (b"version https://git-lfs.github.com/spec/v1\noid".to_vec(), "a git-lfs pointer"),
            (b"<!DOCTYPE html><html>".to_vec(), "a web page"),
            (b"all: { a.bit }\n".to_vec(), "a text"),
            ("Gr\u{fc}\u{df}e".as_bytes()[..6].to_vec(), "a text"),
            (Vec::new(), "an empty file"),
        ] {
            assert_eq!(found(&head), Some(what));
        }
    }

    #[test]
    fn each_piece_of_advice_is_another_and_a_command_names_the_file() {
        let advice = [
            Advice::Bootgen,
            Advice::Turn,
            Advice::Unpack,
            Advice::BootImage,
            Advice::OtherChip,
            Advice::Overlay,
            Advice::Fetch,
            Advice::Readme,
        ];
        let texts = advice.map(|advice| advice.text(Path::new("my.bit")));
        let different: std::collections::BTreeSet<_> = texts.iter().collect();
        assert_eq!(different.len(), advice.len());
        assert!(texts[0].contains("'all: { my.bit }'"), "{}", texts[0]);
        assert!(texts[1].contains("--reverse-bytes=4 my.bit my.bit.bit.bin"), "{}", texts[1]);
    }

    #[test]
    fn an_overlay_is_a_whole_compiled_tree() {
        let found = |tree: &[u8]| {
            let error = require_overlay(Path::new("x.dtbo"), tree).expect_err("wrong");
            error.to_string()
        };
        let tree = |length: u32| [&DEVICE_TREE[..], &length.to_be_bytes(), &[0; 32]].concat();
        require_overlay(Path::new("x.dtbo"), &tree(40)).expect("whole");
        assert!(found(&tree(41)).contains("the first 40 bytes of one of 41"));
        for (bytes, what) in [
            (&b"/dts-v1/;\n/plugin/;"[..], "the source of a device tree"),
            (b"// a comment\n/dts-v1/;", "a text"),
            (b"\x7fELF", "a program"),
            (b"\x1f\x8b\x08", "a gzip archive"),
            (&SYNC, "a bitstream"),
            (&BIT_HEADER, "Vivado's .bit"),
            (b"", "an empty file"),
            (&[0; 64], "something else"),
        ] {
            let found = found(bytes);
            assert!(found.contains(what), "{found}");
        }
    }
}
