//! Follows the packets of a bitstream from its sync word to its end.
//!
//! ```text
//! sync word | type 1: register, number of words | words ... | command DESYNC | padding
//!           | type 1 of no words, type 2: number of words | words ...
//! ```
//!
//! Compressed and partial bitstreams are made of the same packets. An encrypted one says so in a
//! register, and what follows can be read by the device only.
//!
//! Source: UG570, "Configuration Packets" and "Configuration Registers".

use super::chip::Chip;

/// The sync word, as the device reads it.
const SYNC: u32 = 0xAA99_5566;
const NOP: u32 = 0x2000_0000;
/// Words that are no packet and do nothing.
const PADDING: [u32; 2] = [0, u32::MAX];

/// Bits of a packet's head.
const TYPE_SHIFT: u32 = 29;
const WRITE: u32 = 2;
const REGISTERS: u32 = 32;
const RESERVED: u32 = 3 << 11;
const TYPE_1_WORDS: u32 = 0x7FF;
const TYPE_2_WORDS: u32 = 0x7FF_FFFF;

/// Registers.
const CMD: u32 = 4;
const CTL0: u32 = 5;
const MASK: u32 = 6;
const CBC: u32 = 11;
const IDCODE: u32 = 12;
const AXSS: u32 = 13;
/// The command after which the device waits for another sync word.
const DESYNC: u32 = 13;
/// Bit of CTL0: what follows is encrypted.
const DECRYPT: u32 = 1 << 6;

/// The end of a bitstream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum End {
    /// The command DESYNC.
    Desync,
    /// It breaks off: inside a packet of this number of words, or without DESYNC.
    Cut { inside: Option<u32> },
    /// The rest is encrypted.
    Encrypted,
    /// No packet stands at this byte behind the sync word.
    Unknown { at: usize },
    /// No packet follows the sync word at all.
    Empty,
}

/// The facts that a bitstream tells.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Stream {
    pub(super) chip: Option<Chip>,
    /// The word USR_ACCESS.
    pub(super) user: Option<u32>,
    pub(super) end: End,
}

/// Follows the packets behind the sync word; the bytes of every word are swapped, as bootgen does.
pub(super) fn follow(bytes: &[u8]) -> Stream {
    let words: Vec<u32> = bytes
        .chunks_exact(4)
        .map(|word| word.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte)))
        .collect();
    let mut stream = Stream { chip: None, user: None, end: End::Empty };
    stream.end = walk(&words, &mut stream);
    // A stream of packets that this does not know may have its end all the same.
    if matches!(stream.end, End::Unknown { .. }) && ends_with_desync(&words) {
        stream.end = End::Desync;
    }
    stream
}

fn walk(words: &[u32], stream: &mut Stream) -> End {
    let (mut at, mut synced, mut empty, mut mask) = (0, true, true, 0);
    // The register of a type 1 packet of no words, to which a type 2 packet belongs.
    let mut register = None;
    while let Some(&head) = words.get(at) {
        at += 1;
        if !synced {
            synced = head == SYNC;
            continue;
        }
        if PADDING.contains(&head) {
            continue;
        }
        empty = false;
        if head == NOP {
            continue;
        }
        let address = head >> 13 & 0x3FFF;
        let write = head >> 27 & 3 == WRITE;
        let (to, count) = match (head >> TYPE_SHIFT, register) {
            (1, _) if write && address < REGISTERS && head & RESERVED == 0 => {
                (address, head & TYPE_1_WORDS)
            }
            (2, Some(register)) if write => (register, head & TYPE_2_WORDS),
            _ => return End::Unknown { at: 4 * (at - 1) },
        };
        register = (count == 0).then_some(to);
        let Some(data) = words.get(at..at + count as usize) else {
            return End::Cut { inside: Some(count) };
        };
        at += data.len();
        let Some(&last) = data.last() else { continue };
        match to {
            CMD => synced = last != DESYNC,
            MASK => mask = last,
            IDCODE => stream.chip = Some(Chip::of(last)),
            AXSS => stream.user = Some(last),
            CTL0 if last & mask & DECRYPT != 0 => return End::Encrypted,
            CBC => return End::Encrypted,
            _ => {}
        }
    }
    match (empty, synced) {
        (true, _) => End::Empty,
        (false, true) => End::Cut { inside: None },
        (false, false) => End::Desync,
    }
}

/// Whether nothing but padding follows the last DESYNC.
fn ends_with_desync(words: &[u32]) -> bool {
    const WRITE_CMD: u32 = 1 << TYPE_SHIFT | WRITE << 27 | CMD << 13 | 1;
    let end = words.iter().rposition(|word| *word != NOP && !PADDING.contains(word));
    end.is_some_and(|end| words[..=end].ends_with(&[WRITE_CMD, DESYNC]))
}

#[cfg(test)]
mod tests {
    use super::super::tests::files::{BODY, DESYNCED, HEAD, chip, noise, write};
    use super::*;

    const ZU9EG: u32 = 0x0473_8093;

    fn followed(words: &[&[u32]]) -> Stream {
        let bytes: Vec<u8> = words.concat().iter().flat_map(|word| word.to_le_bytes()).collect();
        // The head without its sync word and what precedes it.
        follow(&bytes[4 * (HEAD.len() - 1)..])
    }

    fn end(words: &[&[u32]]) -> End {
        followed(words).end
    }

    #[test]
    fn a_whole_bitstream_tells_its_chip_and_its_user_word() {
        let user = write(AXSS, &[0x5047_0064]);
        let found = followed(&[HEAD, &chip(0x2473_8093), &user, BODY, DESYNCED]);
        let chip = Some(Chip::of(ZU9EG));
        assert_eq!(found, Stream { chip, user: Some(0x5047_0064), end: End::Desync });
        // Also behind the frames, and in the second of two parts.
        let second = [&[u32::MAX, SYNC][..], &user, DESYNCED].concat();
        let found = followed(&[HEAD, BODY, DESYNCED, &second]);
        assert_eq!((found.user, found.end), (Some(0x5047_0064), End::Desync));
    }

    #[test]
    fn a_compressed_or_partial_bitstream_is_followed_to_its_end() {
        // Frames one by one, each written to several places: FAR, and MFWR of fourteen words.
        let frame = [write(1, &[0x40]), write(10, &[SYNC; 14])].concat();
        assert_eq!(end(&[HEAD, &chip(ZU9EG), &frame, &frame, DESYNCED]), End::Desync);
        // Configuration data may look like anything, also in a packet of type 2.
        let data = [NOP, DESYNC, SYNC, 0xFFFF_FFFF, 0x4000_0003];
        let frames = [&[0x3000_4000, 0x5000_0005][..], &data].concat();
        assert_eq!(end(&[HEAD, &chip(ZU9EG), &frames, DESYNCED]), End::Desync);
        assert_eq!(end(&[HEAD, &frames]), End::Cut { inside: None });
    }

    #[test]
    fn wherever_a_bitstream_breaks_off_that_is_seen() {
        let whole = [HEAD, &chip(ZU9EG), BODY, DESYNCED].concat();
        let last = whole.len() - (DESYNCED.len() - 2);
        for words in HEAD.len()..last {
            let end = end(&[&whole[..words]]);
            assert!(matches!(end, End::Cut { .. }), "{words} words: {end:?}");
        }
        for words in last..whole.len() {
            assert_eq!(end(&[&whole[..words]]), End::Desync, "padding may be missing");
        }
        let frames = BODY.len() - 2;
        let inside = Some(u32::try_from(frames).expect("few"));
        assert_eq!(end(&[&whole[..whole.len() - DESYNCED.len() - 1]]), End::Cut { inside });
    }

    #[test]
    fn what_cannot_be_followed_is_never_called_cut() {
        let secret = noise(500);
        for cipher in [write(CBC, &[1, 2, 3, 4]), [write(MASK, &[64]), write(CTL0, &[64])].concat()]
        {
            assert_eq!(end(&[HEAD, &cipher, &secret]), End::Encrypted);
        }
        // The bit counts only with its mask.
        let masked = [write(MASK, &[1]), write(CTL0, &[0x41])].concat();
        assert_eq!(end(&[HEAD, &masked, DESYNCED]), End::Desync);
        let at = 4 * (chip(ZU9EG).len() + 1);
        assert_eq!(end(&[HEAD, &chip(ZU9EG), &secret]), End::Unknown { at });
        assert_eq!(end(&[HEAD, &chip(ZU9EG), &secret, DESYNCED]), End::Desync, "its end is there");
        assert_eq!(end(&[HEAD, &[0x5000_0005]]), End::Unknown { at: 4 }, "type 2 without type 1");
        assert_eq!(end(&[&HEAD[..HEAD.len() - 1], &[0; 9]]), End::Empty);
    }
}
