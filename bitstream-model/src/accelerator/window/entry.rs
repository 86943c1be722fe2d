//! A collision on its way through the passes, with the marks of its index words.

use super::super::solver::Impulses;
use crate::accelerator::records::decode::Collision;
use crate::accelerator::records::segment::PacketError;
use crate::cast::register;
use pgs_interface::control::ErrorCode;
use pgs_interface::record::{CONTACT_POINTS, live};

/// A collision's use of a place.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Use {
    /// 0 is every static body.
    pub(super) place: usize,
    pub(super) first: bool,
    pub(super) last: bool,
}

impl Use {
    /// Decodes an index word; `None` for a place that does not exist, a bit beyond the marks, or a
    /// mark of a static body.
    fn of(word: u32, places: usize) -> Option<Self> {
        let of = Self {
            place: (word & live::PLACE) as usize,
            first: word & live::FIRST != 0,
            last: word & live::LAST != 0,
        };
        let known = word & !(live::PLACE | live::FIRST | live::LAST) == 0 && of.place < places;
        let marked_static = of.place == 0 && (of.first || of.last);
        (known && !marked_static).then_some(of)
    }

    pub(super) fn moves(&self) -> bool {
        self.place != 0
    }
}

/// A collision in the delay lines.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    pub(super) collision: Collision,
    /// A and B; two static bodies where there is no contact point.
    pub(super) uses: [Use; 2],
    pub(super) impulses: Impulses,
    /// The cycle from which the next pass can read it.
    pub(super) written: u64,
}

impl Entry {
    /// A record that has just come in as entry `number`.
    pub(super) fn new(
        collision: Collision,
        number: usize,
        places: usize,
    ) -> Result<Self, PacketError> {
        let error = |code| PacketError { code, channel: 0, beat: register(number) };
        let mut entry = Self {
            collision,
            uses: [Use::default(); 2],
            impulses: [0.0; CONTACT_POINTS],
            written: 0,
        };
        if collision.count == 0 {
            return Ok(entry);
        }
        for (of, word) in entry.uses.iter_mut().zip([collision.body_a, collision.body_b]) {
            *of = Use::of(word, places).ok_or_else(|| error(ErrorCode::BodyIndex))?;
        }
        let [a, b] = entry.uses;
        if a.place == b.place {
            return Err(error(match a.place {
                0 => ErrorCode::StaticPair,
                _ => ErrorCode::SelfCollision,
            }));
        }
        Ok(entry)
    }

    /// Whether the entry takes a slot and nothing else.
    pub(super) fn is_bubble(&self) -> bool {
        self.collision.count == 0
    }

    /// Velocities that the entry takes from the stream.
    pub(super) fn births(&self) -> usize {
        self.uses.iter().filter(|of| of.first).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(words: [u32; 2], count: usize) -> Result<Entry, ErrorCode> {
        let [body_a, body_b] = words;
        let collision = Collision {
            body_a,
            body_b,
            count,
            friction: 0.0,
            normal: [0.0; 3],
            position_a: [0.0; 3],
            position_b: [0.0; 3],
            contacts: [[0.0; 4]; CONTACT_POINTS],
            impulses: [0.0; CONTACT_POINTS],
        };
        Entry::new(collision, 7, 100).map_err(|error| {
            assert_eq!((error.channel, error.beat), (0, 7));
            error.code
        })
    }

    #[test]
    fn marks_stand_above_the_place() {
        let uses = entry([live::FIRST | 99, live::LAST | 1], 1).expect("it is sound").uses;
        assert_eq!(uses[0], Use { place: 99, first: true, last: false });
        assert_eq!(uses[1], Use { place: 1, first: false, last: true });
    }

    #[test]
    fn invalid_index_words_are_refused_and_a_bubbles_words_are_not_read() {
        use ErrorCode::{BodyIndex, SelfCollision, StaticPair};
        for (words, code) in [
            ([100, 1], BodyIndex),
            ([1, 1 << 15], BodyIndex),
            ([live::FIRST, 1], BodyIndex),
            ([1, live::LAST], BodyIndex),
            ([0, 0], StaticPair),
            ([5, live::LAST | 5], SelfCollision),
        ] {
            assert_eq!(entry(words, 4).map(|entry| entry.uses), Err(code), "{words:x?}");
            let bubble = entry(words, 0).expect("a bubble has no bodies");
            assert!(bubble.is_bubble() && bubble.uses.iter().all(|of| !of.moves()));
        }
    }
}
