//! Judges a bitstream file by its content, before the kernel gets it.

use std::path::Path;

use super::chip::Chip;
use super::packets::{End, Stream, follow};
use super::tree;
use super::{LoadError, Request};

/// The largest file that is read; the largest chip of the family takes 45 MB.
pub(super) const BYTES_MAX: u64 = 64 << 20;
/// Bytes that are searched for the sync word of a bitstream.
const HEAD_BYTES: usize = 1024;
/// The sync word of a bitstream, as bootgen byte-swaps it for the processor.
const SYNC: [u8; 4] = [0x66, 0x55, 0x99, 0xAA];
/// The sync word as Vivado writes it, for a configuration port.
const SYNC_UNTURNED: [u8; 4] = [0xAA, 0x99, 0x55, 0x66];
/// The beginning of Vivado's header: nine bytes, a one, and the tag of the design's name.
const BIT_HEADER: [u8; 14] = *b"\x00\x09\x0f\xf0\x0f\xf0\x0f\xf0\x0f\xf0\x00\x00\x01a";

/// Next steps for a file that is no bitstream; `{}` is the file.
const BOOTGEN: &str = "convert it: echo 'all: { {} }' > x.bif && bootgen -image x.bif -arch zynqmp \
                       -process_bitstream bin, and load the .bit.bin that it makes";
const TURN: &str = "convert the .bit of the same design by bootgen (device-tree/README.md), or \
                    turn the bytes of this one: objcopy -I binary -O binary --reverse-bytes=4 {} \
                    {}.bit.bin";
const BOOT_IMAGE: &str = "a boot image is started by the board: copy it to the boot medium; to \
                          load its bitstream from Linux convert the .bit by bootgen with \
                          -process_bitstream bin. An encrypted or authenticated bitstream is \
                          loaded by fpgautil -f, which passes the key's kind on, or as it is with \
                          --unjudged";
const OVERLAY: &str = "give the bitstream (.bit.bin) first, and this file by --overlay";
const FETCH: &str = "fetch the file itself, by `git lfs pull` or once more from where it came \
                     from; or make it as device-tree/README.md shows";
pub(super) const README: &str = "see device-tree/README.md for how the files are made";

/// Formats that are mistaken for bitstreams: offset and bytes of the signature, name, next step.
const SIGNATURES: &[(usize, &[u8], &str, &str)] = &[
    (0, &BIT_HEADER, "Vivado's .bit", BOOTGEN),
    (0, &tree::MAGIC, "a compiled device tree", OVERLAY),
    // Headers of boot images also hold a byte-swapped sync word.
    (0x24, b"XNLX", "a boot image", BOOT_IMAGE),
];

/// A file's format by its first KiB.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Format {
    /// A bitstream as the kernel takes it, whose sync word ends at this offset.
    Bitstream(usize),
    /// Another format, and the next step.
    Other(&'static str, &'static str),
    Unknown,
}

/// Tells a file's format.
pub(super) fn format(bytes: &[u8]) -> Format {
    let head = &bytes[..bytes.len().min(HEAD_BYTES)];
    if head.is_empty() {
        return Format::Other("an empty file", FETCH);
    }
    let mut signatures = SIGNATURES.iter();
    let begins = |(at, bytes, ..): &&(usize, &[u8], _, _)| {
        head.get(*at..).is_some_and(|rest| rest.starts_with(bytes))
    };
    if let Some((.., what, next)) = signatures.find(begins) {
        return Format::Other(what, next);
    }
    let find = |word: [u8; 4]| head.windows(word.len()).position(|bytes| bytes == word);
    match (find(SYNC), find(SYNC_UNTURNED)) {
        (Some(at), unturned) if unturned.is_none_or(|unturned| at < unturned) => {
            Format::Bitstream(at + SYNC.len())
        }
        (_, Some(_)) => Format::Other(UNTURNED, TURN),
        _ if is_text(head) => Format::Other("a text", FETCH),
        _ => Format::Unknown,
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

/// The facts that a bitstream tells.
#[derive(Debug, Default)]
pub(super) struct Bitstream {
    pub(super) chip: Option<Chip>,
    /// The word USR_ACCESS.
    pub(super) user: Option<u32>,
    /// Why it cannot be judged, if that is so.
    pub(super) doubt: Option<LoadError>,
}

/// Judges a bitstream; refuses one that is wrong.
pub(super) fn judge(request: &Request, bytes: &[u8]) -> Result<Bitstream, LoadError> {
    let path = &request.bitstream;
    let doubt = |reason: String| Some(LoadError::Unjudged { path: path.clone(), reason });
    let packets = match format(bytes) {
        // Bitstreams that bootgen encrypts or signs have its header.
        Format::Other(found, BOOT_IMAGE) => {
            request.unless_overridden(other(path, found, BOOT_IMAGE))?;
            return Ok(Bitstream::default());
        }
        Format::Other(found, next) => return Err(other(path, found, next)),
        Format::Unknown => {
            let reason = "no sync word (66 55 99 AA) in its first KiB".to_owned();
            return Ok(Bitstream { doubt: doubt(reason), ..Bitstream::default() });
        }
        Format::Bitstream(packets) => packets,
    };
    let Stream { chip, user, end } = follow(&bytes[packets..]);
    if let Some(found) = chip.filter(|chip| *chip != request.part) {
        let error = LoadError::OtherChip { path: path.clone(), found, part: request.part };
        request.unless_overridden(error)?;
    }
    let cut = match end {
        End::Cut { inside: Some(words) } => Some(format!("inside a packet of {words} words")),
        End::Cut { inside: None } => Some("without the command DESYNC".to_owned()),
        End::Desync | End::Empty if !bytes.len().is_multiple_of(4) => {
            Some("which is no multiple of 4".to_owned())
        }
        _ => None,
    };
    if let Some(how) = cut {
        request.unless_overridden(LoadError::CutOff {
            path: path.clone(),
            bytes: bytes.len(),
            how,
        })?;
    }
    let doubt = match end {
        End::Encrypted => doubt("it is encrypted".to_owned()),
        End::Unknown { at } => doubt(format!("no packet stands at byte {}", packets + at)),
        End::Empty => Some(LoadError::Empty { path: path.clone() }),
        End::Desync if chip.is_none() => doubt("it names no chip".to_owned()),
        End::Desync | End::Cut { .. } => None,
    };
    Ok(Bitstream { chip, user, doubt })
}

fn other(path: &Path, found: &'static str, next: &str) -> LoadError {
    let next = next.replace("{}", &path.display().to_string());
    LoadError::Bitstream { path: path.to_owned(), found: found.to_owned(), next }
}

#[cfg(test)]
mod tests {
    use super::super::tests::files::{self, BODY, DESYNCED, HEAD, noise};
    use super::super::tests::request;
    use super::*;

    fn found(head: &[u8]) -> Option<&'static str> {
        match format(head) {
            Format::Bitstream(_) => None,
            Format::Other(what, _) => Some(what),
            Format::Unknown => Some("unknown"),
        }
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
            assert_eq!(format(&with(at, &SYNC)), Format::Bitstream(at + 4));
            assert_eq!(found(&with(at, &SYNC_UNTURNED)), Some(UNTURNED), "{at}");
        }
        assert_eq!(found(&SYNC), None, "a short one");
        // The first sync word decides.
        let both = |first: [u8; 4], then: [u8; 4]| found(&[first, [0; 4], then].concat());
        assert_eq!(both(SYNC, SYNC_UNTURNED), None);
        assert_eq!(both(SYNC_UNTURNED, SYNC), Some(UNTURNED));
        for nothing in [vec![0; HEAD_BYTES], vec![0xFF; 40], with(0, &SYNC[..3])] {
            assert_eq!(format(&nothing), Format::Unknown);
        }
    }

    #[test]
    fn a_bit_a_boot_image_a_tree_and_a_text_are_named_and_other_formats_are_unknown() {
        let mut bit = BIT_HEADER.to_vec();
        bit.extend(b"\x00\x10design_1;UserID");
        bit.extend(SYNC_UNTURNED);
        // Byte-swapped words may follow a header, too.
        let mut turned_bit = BIT_HEADER.to_vec();
        turned_bit.extend(SYNC);
        let image = with(0x20, &[&SYNC[..], b"XNLX"].concat());
        for (head, what) in [
            (bit, "Vivado's .bit"),
            (turned_bit, "Vivado's .bit"),
            (image, "a boot image"),
            (b"PK\x03\x04\x14".to_vec(), "unknown"),
            (tree::MAGIC.to_vec(), "a compiled device tree"),
            (b"version https://git-lfs.github.com/spec/v1\noid".to_vec(), "a text"),
            (b"<!DOCTYPE html><html>".to_vec(), "a text"),
            (b"all: { a.bit }\n".to_vec(), "a text"),
            ("Gr\u{fc}\u{df}e".as_bytes()[..6].to_vec(), "a text"),
            (Vec::new(), "an empty file"),
        ] {
            assert_eq!(found(&head), Some(what));
        }
    }

    /// Judges words of a bitstream, without this number of bytes at its end.
    fn judged(words: &[&[u32]], without: usize) -> Result<Bitstream, LoadError> {
        let bytes = files::bytes(words);
        judge(&request(Path::new("x.bit.bin")), &bytes[..bytes.len() - without])
    }

    #[test]
    fn another_chip_is_refused_with_both_names_and_loads_where_it_is_asked_for() {
        let stream = |idcode| files::bytes(&[HEAD, &files::chip(idcode), BODY, DESYNCED]);
        for (idcode, name) in [(0x0372_7093, "XC7Z020"), (0x2472_4093, "XCK26"), (5, "unknown")] {
            let mut request = request(Path::new("x.bit.bin"));
            let error = judge(&request, &stream(idcode)).expect_err("another chip").to_string();
            assert!(error.contains(name) && error.contains("XCZU9EG"), "{error}");
            request.part = Chip::of(idcode);
            judge(&request, &stream(idcode)).expect("asked for");
            judge(&request, &stream(0x0473_8093)).expect_err("not asked for");
        }
        for revision in 0..16 {
            let request = request(Path::new("x.bit.bin"));
            let bitstream = judge(&request, &stream(0x0473_8093 | revision << 28));
            assert!(bitstream.expect("in each revision").doubt.is_none());
        }
    }

    #[test]
    fn a_file_that_breaks_off_is_refused_unless_it_is_to_go_unjudged() {
        let zu9 = files::chip(0x0473_8093);
        for (words, without, how) in [
            (&[HEAD, &zu9, BODY][..], 0, "without the command DESYNC"),
            (&[HEAD], 0, "without the command DESYNC"),
            (&[HEAD, &zu9, BODY], 8, "inside a packet of 64 words"),
            (&[HEAD, &zu9, BODY, DESYNCED], 3, "no multiple of 4"),
        ] {
            let error = judged(words, without).expect_err("cut off");
            assert!(matches!(&error, LoadError::CutOff { .. }), "{error}");
            assert!(error.to_string().contains(how), "{error}");
            assert!(error.next().contains("--unjudged"), "{}", error.next());
            let request = Request { unjudged: true, ..request(Path::new("x.bit.bin")) };
            judge(&request, &files::bytes(words)).expect("asked for");
        }
    }

    #[test]
    fn a_bitstream_in_bootgens_header_is_no_bitstream_unless_it_is_to_go_unjudged() {
        let image = with(0x20, &[&SYNC[..], b"XNLX"].concat());
        let asked = request(Path::new("x.bit.bin"));
        let error = judge(&asked, &image).expect_err("a boot image");
        assert!(error.to_string().contains("a boot image"), "{error}");
        assert!(error.next().contains("fpgautil -f"), "{}", error.next());
        let bitstream = judge(&Request { unjudged: true, ..asked }, &image).expect("asked for");
        assert!(bitstream.doubt.is_none());
    }

    #[test]
    fn what_cannot_be_judged_is_doubted_and_not_called_cut_off() {
        let zu9 = files::chip(0x0473_8093);
        let encrypted = files::write(11, &[1, 2, 3, 4]);
        let secret = noise(99);
        for (words, reason) in [
            (&[HEAD, &encrypted, &secret][..], "encrypted"),
            (&[HEAD, &zu9, &secret], "no packet stands at byte 40"),
            (&[HEAD, BODY, DESYNCED], "names no chip"),
            (&[&secret], "no sync word"),
        ] {
            // Nor by a length that is no multiple of 4.
            for without in [0, 1] {
                let Ok(Bitstream { doubt: Some(doubt), .. }) = judged(words, without) else {
                    assert_eq!((reason, without), ("names no chip", 1));
                    continue;
                };
                let text = doubt.to_string();
                assert!(text.contains(reason) && !text.contains("breaks off"), "{text}");
                assert!(doubt.next().contains("--unjudged"), "{}", doubt.next());
            }
        }
    }
}
