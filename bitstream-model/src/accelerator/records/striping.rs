//! Deals the beats of an array out to streams: the stream of each beat, the beats on each stream,
//! and the cycles that they take.

use pgs_interface::address_map::DMA_COUNT_MAX;
use pgs_interface::stripe::Stripe;

use crate::config::{GROUP_MAX, beat_cycles};

/// Most streams of a profile.
pub(crate) const STREAMS_MAX: usize = DMA_COUNT_MAX;
/// A count for each stream.
pub(crate) type PerStream = [usize; STREAMS_MAX];

/// A stripe over streams of known widths.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Striping {
    /// Beats of a group.
    group: usize,
    padded: bool,
    /// Per beat of a group: its stream, and the beats of the group before it on each stream.
    place: [(u8, [u8; STREAMS_MAX]); GROUP_MAX],
    /// Per stream: the beats of a group that it carries.
    carried: [[u8; GROUP_MAX]; STREAMS_MAX],
    /// Beats of a group on each stream.
    share: [u8; STREAMS_MAX],
    /// Bits of each stream.
    widths: [u32; STREAMS_MAX],
}

impl Striping {
    /// The stripe of a profile that the configuration has checked.
    pub(crate) fn new(stripe: &Stripe, widths: &[u32]) -> Self {
        let mut place = [(0, [0; STREAMS_MAX]); GROUP_MAX];
        let mut carried = [[0; GROUP_MAX]; STREAMS_MAX];
        let mut share = [0; STREAMS_MAX];
        for (beat, (place, stream)) in (0..).zip(place.iter_mut().zip(stripe.streams)) {
            *place = (*stream, share);
            let k = usize::from(*stream);
            carried[k][usize::from(share[k])] = beat;
            share[k] += 1;
        }
        let mut known = [0; STREAMS_MAX];
        for (known, width) in known.iter_mut().zip(widths) {
            *known = *width;
        }
        Self {
            group: stripe.streams.len(),
            padded: stripe.padded,
            place,
            carried,
            share,
            widths: known,
        }
    }

    /// Beats with the padding of the last group, for an array of `beats` beats.
    pub(crate) fn padded(&self, beats: usize) -> usize {
        if self.padded { beats.next_multiple_of(self.group) } else { beats }
    }

    /// Beats of a group.
    pub(crate) fn group(&self) -> usize {
        self.group
    }

    /// Walks over the beats from `beat` on: the stream of each, and its number on it.
    #[inline]
    pub(crate) fn places(&self, beat: usize) -> Places<'_> {
        Places { striping: self, group: beat / self.group, at: beat % self.group }
    }

    /// How many of the first `beats` beats are on each stream.
    pub(crate) fn counts(&self, beats: usize) -> PerStream {
        let (groups, rest) = (beats / self.group, beats % self.group);
        let before = self.place[rest].1;
        std::array::from_fn(|k| groups * usize::from(self.share[k]) + usize::from(before[k]))
    }

    /// Beats from the first one on without a gap, where stream `k` has `on_stream(k)` beats.
    pub(crate) fn contiguous(&self, on_stream: impl Fn(usize) -> usize) -> usize {
        let mut beats = usize::MAX;
        for (k, share) in self.share.into_iter().enumerate() {
            if share > 0 {
                // The first beat that this stream lacks.
                let (have, share) = (on_stream(k), usize::from(share));
                let missing = usize::from(self.carried[k][have % share]);
                beats = beats.min(have / share * self.group + missing);
            }
        }
        beats
    }

    /// Clock cycles that the first `beats` beats take: the cycles of the busiest stream.
    pub(crate) fn cycles(&self, beats: usize) -> u64 {
        let mut cycles = 0;
        for (beats, width) in self.counts(beats).into_iter().zip(self.widths) {
            if width > 0 {
                cycles = cycles.max(beats as u64 * beat_cycles(width));
            }
        }
        cycles
    }
}

/// Walks over the beats of an array: the stream of each, and its number on that stream.
#[derive(Debug, Clone)]
pub(crate) struct Places<'a> {
    striping: &'a Striping,
    group: usize,
    /// Beat of the group.
    at: usize,
}

impl Places<'_> {
    /// Stream and number of the next beat.
    #[inline(always)]
    pub(crate) fn take(&mut self) -> (usize, usize) {
        let (stream, before) = self.striping.place[self.at];
        let stream = usize::from(stream);
        let share = usize::from(self.striping.share[stream]);
        let number = self.group * share + usize::from(before[stream]);
        self.at += 1;
        if self.at == self.striping.group {
            self.at = 0;
            self.group += 1;
        }
        (stream, number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pgs_interface::profile::{FLOAT, HALF, NAIVE, Profile};

    fn collisions(profile: &Profile) -> Striping {
        Striping::new(&profile.stripes.collisions, profile.mm2s_widths)
    }

    fn bodies(profile: &Profile) -> Striping {
        Striping::new(&profile.stripes.results, profile.mm2s_widths)
    }

    #[test]
    fn beats_lie_as_the_tables_of_the_specification_say() {
        let first = |striping: &Striping, beats: usize| -> Vec<_> {
            let mut places = striping.places(0);
            (0..beats).map(|_| places.take()).collect()
        };
        assert_eq!(
            first(&collisions(&FLOAT), 9),
            [(0, 0), (1, 0), (2, 0), (3, 0), (0, 1), (1, 1), (2, 1), (0, 2), (1, 2)]
        );
        assert_eq!(
            first(&collisions(&HALF), 9),
            [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (2, 0), (0, 3), (0, 4)]
        );
        assert_eq!(
            first(&bodies(&HALF), 7),
            [(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (0, 2), (0, 3)]
        );
    }

    #[test]
    fn counts_and_prefixes_agree_with_a_walk() {
        for profile in [&NAIVE, &FLOAT, &HALF] {
            for striping in [collisions(profile), bodies(profile)] {
                let mut walk = striping.places(0);
                let mut counts = [0; STREAMS_MAX];
                for beats in 0..40 {
                    assert_eq!(striping.counts(beats), counts, "{} {beats}", profile.name);
                    assert_eq!(striping.contiguous(|stream| counts[stream]), beats);
                    let (stream, number) = walk.take();
                    assert_eq!(number, counts[stream]);
                    // A beat too early on the other streams changes nothing.
                    let ahead = |k: usize| counts[k] + usize::from(k != stream);
                    if profile.mm2s_widths.len() > 1 {
                        assert_eq!(striping.contiguous(ahead), beats);
                    }
                    counts[stream] += 1;
                }
            }
        }
    }

    #[test]
    fn the_busiest_stream_says_how_long_beats_take() {
        assert_eq!(bodies(&FLOAT).cycles(77_760), 19_440);
        assert_eq!(bodies(&FLOAT).cycles(5), 2);
        // 28 words one after the other.
        assert_eq!(collisions(&NAIVE).cycles(7), 28);
        // Three beats on each wide stream take longer than one on the narrow one.
        assert_eq!(collisions(&HALF).cycles(7), 3);
        assert_eq!(bodies(&HALF).cycles(38_880), 15_552);
    }

    #[test]
    fn only_a_padded_stripe_fills_its_last_group() {
        assert_eq!(bodies(&HALF).padded(6), 10);
        assert_eq!(bodies(&HALF).padded(10), 10);
        assert_eq!(collisions(&HALF).padded(4), 7);
        assert_eq!(bodies(&FLOAT).padded(6), 6);
    }
}
