//! Compares the results of an echo with the pattern that was sent, and names the source of wrong
//! data.

use std::fmt;

use pgs_interface::profile::Variant;
use pgs_interface::record::{BEAT_BYTES, Beat};

use super::pattern::Pattern;
use crate::axi_dma::Direction;
use crate::beat::stripe::Place;
use crate::step::{EchoResult, source_of};

/// The source of a wrong beat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Origin {
    /// The device read the earlier contents of the buffer.
    StaleRead,
    /// The CPU read the earlier contents of the buffer.
    StaleResult,
    /// The beat belongs to another place of the results.
    Elsewhere(Place),
    /// The driver never wrote this beat.
    Unknown,
}

/// The difference between the results of an echo and the pattern that was sent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Difference {
    /// Number of beats that differ.
    pub(super) wrong: usize,
    /// Number of beats.
    pub(super) total: usize,
    /// Source of the first wrong beat; stale data comes before anything else.
    pub(super) origin: Origin,
    /// Channel of the buffer in question: the sender's for a stale read, else the receiver's.
    pub(super) channel: usize,
    /// Offset in that buffer, bytes.
    pub(super) offset: u64,
    /// Beat found.
    pub(super) found: Beat,
    /// Beat expected.
    pub(super) expected: Beat,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { wrong, total, origin, channel, offset, found, expected } = self;
        match origin {
            Origin::StaleRead => write!(
                f,
                "stale data: dma{channel} MM2S read at byte {offset:#x} of its buffer what the CPU \
                 had written there before"
            )?,
            Origin::StaleResult => write!(
                f,
                "stale data: at byte {offset:#x} of the buffer of dma{channel} S2MM the CPU finds \
                 what was there before the device wrote"
            )?,
            Origin::Elsewhere(place) => write!(
                f,
                "at byte {offset:#x} of the buffer of dma{channel} S2MM is what belongs at byte \
                 {:#x} of dma{} S2MM",
                place.slot * BEAT_BYTES,
                place.channel,
            )?,
            Origin::Unknown => write!(
                f,
                "at byte {offset:#x} of the buffer of dma{channel} S2MM is {}, sent was {}",
                Words(found),
                Words(expected),
            )?,
        }
        write!(f, " ({wrong} of {total} beats differ)")
    }
}

struct Words<'a>(&'a Beat);

impl fmt::Display for Words<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b, c, d] = self.0.0;
        write!(f, "{a:08x} {b:08x} {c:08x} {d:08x}")
    }
}

/// A run to be judged.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run<'a> {
    /// The bitstream's variant.
    pub(super) variant: &'a Variant,
    /// Number of bodies.
    pub(super) bodies: usize,
    /// The right results, by channel.
    pub(super) expected: &'a [Vec<Beat>],
    /// The results of the previous run in the same buffers.
    pub(super) before: Option<&'a [Vec<Beat>]>,
}

/// Compares the results with the pattern. `None` if all beats agree.
pub(super) fn judge(run: &Run<'_>, echoed: &EchoResult) -> Option<Difference> {
    let mut differences = Vec::new();
    let mut total = 0;
    for (channel, expected) in run.expected.iter().enumerate() {
        total += expected.len();
        for (slot, expected) in expected.iter().enumerate() {
            let place = Place { channel, slot };
            let found = at(&echoed.results, place).unwrap_or_default();
            if found != *expected {
                differences.push((place, found, *expected));
            }
        }
    }
    let wrong = differences.len();
    let first = differences
        .into_iter()
        .map(|(place, found, expected)| {
            let origin = stale(run, echoed, place, found);
            let source = match origin {
                Some(Origin::StaleRead) => source_of(run.bodies, run.variant, place),
                _ => None,
            };
            let (channel, offset) =
                source.unwrap_or((place.channel, (place.slot * BEAT_BYTES) as u64));
            (origin, channel, offset, found, expected)
        })
        .min_by_key(|(origin, channel, offset, ..)| (origin.is_none(), *offset, *channel))?;
    let (origin, channel, offset, found, expected) = first;
    let origin = origin.unwrap_or_else(|| elsewhere(run, found));
    Some(Difference { wrong, total, origin, channel, offset, found, expected })
}

fn at(results: &[Vec<Beat>], place: Place) -> Option<Beat> {
    results.get(place.channel)?.get(place.slot).copied()
}

/// The source of a wrong beat, if its buffer held the beat before.
fn stale(run: &Run<'_>, echoed: &EchoResult, place: Place, found: Beat) -> Option<Origin> {
    let pattern = Pattern::of(run.variant);
    let filler = pattern.filler();
    if found == filler(Direction::S2mm, place.channel, place.slot) {
        return Some(Origin::StaleResult);
    }
    // The host does not send padding: the accelerator makes it.
    let (sender, offset) = source_of(run.bodies, run.variant, place)?;
    let slot = usize::try_from(offset).unwrap_or(usize::MAX) / BEAT_BYTES;
    let sent = filler(Direction::Mm2s, sender, slot);
    let returned = pattern.returned();
    if (0..)
        .zip(returned)
        .all(|(lane, bits): (usize, _)| (found.0[lane] ^ sent.0[lane]) & bits == 0)
    {
        return Some(Origin::StaleRead);
    }
    let before = run.before.and_then(|before| at(before, place));
    // The result of the previous run. The accelerator's sum tells whether the host sent it again.
    let arrived = echoed.sums.0 == echoed.sent;
    (before == Some(found)).then_some(if arrived { Origin::StaleResult } else { Origin::StaleRead })
}

fn elsewhere(run: &Run<'_>, found: Beat) -> Origin {
    let places = run.expected.iter().enumerate().flat_map(|(channel, beats)| {
        beats.iter().enumerate().map(move |(slot, beat)| (Place { channel, slot }, *beat))
    });
    let place = places.into_iter().find(|(_, beat)| *beat == found).map(|(place, _)| place);
    place.map_or(Origin::Unknown, Origin::Elsewhere)
}

#[cfg(test)]
mod tests {
    use super::*;
    use pgs_interface::profile::FLOAT;

    const BODIES: u32 = 9;

    fn pattern(seed: u32) -> Vec<Vec<Beat>> {
        let pattern = Pattern::of(&FLOAT.default_variant());
        pattern.results(&pattern.bodies(seed, BODIES), 4)
    }

    fn filler(direction: Direction, channel: usize, slot: usize) -> Beat {
        Pattern::of(&FLOAT.default_variant()).filler()(direction, channel, slot)
    }

    /// The difference after a change in the results of pattern 2, which runs after pattern 1.
    fn difference(sums_agree: bool, change: impl Fn(&mut Vec<Vec<Beat>>)) -> Option<Difference> {
        let (before, expected) = (pattern(1), pattern(2));
        let mut found = expected.clone();
        change(&mut found);
        let received = if sums_agree { 5 } else { 6 };
        let echoed = EchoResult {
            results: found,
            sent: 5,
            sums: (received, 0),
            interrupts: 1,
            descriptors: 1,
        };
        let variant = &FLOAT.default_variant();
        let bodies = BODIES as usize;
        let run = Run { variant, bodies, expected: &expected, before: Some(&before) };
        judge(&run, &echoed)
    }

    #[test]
    fn what_was_sent_is_no_difference() {
        assert_eq!(difference(true, |_| ()), None);
    }

    #[test]
    fn old_data_that_the_device_read_is_named_by_its_place_in_the_senders_buffer() {
        let old = pattern(1);
        let found = difference(false, |results| {
            // Orientation and angular velocity of bodies 1 and 3.
            for (channel, slot) in [(1, 3), (1, 1), (3, 3)] {
                results[channel][slot] = old[channel][slot];
            }
        });
        let found = found.expect("a difference");
        assert_eq!((found.wrong, found.total, found.origin), (3, 36, Origin::StaleRead));
        // The angular velocity of body 3 is beat 7: channel 3, its second beat.
        assert_eq!((found.channel, found.offset), (3, 16));
        assert!(found.to_string().contains("dma3 MM2S read at byte 0x10"), "{found}");
    }

    #[test]
    fn old_data_that_the_device_did_not_read_was_found_by_the_cpu() {
        let old = pattern(1);
        let found = difference(true, |results| results[2][4] = old[2][4]).expect("a difference");
        assert_eq!((found.origin, found.channel, found.offset), (Origin::StaleResult, 2, 64));
    }

    #[test]
    fn filler_is_stale_on_either_side() {
        let found = difference(true, |r| r[2][4] = filler(Direction::S2mm, 2, 4)).expect("differs");
        assert_eq!((found.origin, found.channel, found.offset), (Origin::StaleResult, 2, 64));
        // The position of body 1 is beat 2 of the poses: channel 2, where they begin at beat 4.
        let found =
            difference(false, |r| r[0][1] = filler(Direction::Mm2s, 2, 4)).expect("differs");
        assert_eq!((found.origin, found.channel, found.offset), (Origin::StaleRead, 2, 64));
    }

    #[test]
    fn exchanged_channels_and_broken_bits_are_told_apart() {
        let found = difference(true, |results| results.swap(0, 3)).expect("a difference");
        assert_eq!(found.origin, Origin::Elsewhere(Place { channel: 3, slot: 0 }));
        let found = difference(true, |results| results[1][2].0[3] ^= 1).expect("a difference");
        assert_eq!((found.origin, found.wrong, found.offset), (Origin::Unknown, 1, 32));
        let found = difference(true, |results| results[1].truncate(2)).expect("a difference");
        assert_eq!((found.origin, found.wrong), (Origin::Unknown, 7));
    }

    #[test]
    fn stale_data_is_named_before_other_damage() {
        let old = pattern(1);
        let found = difference(true, |results| {
            results[0][0].0[0] ^= 1;
            results[2][4] = old[2][4];
        });
        assert_eq!(found.expect("a difference").origin, Origin::StaleResult);
    }
}
