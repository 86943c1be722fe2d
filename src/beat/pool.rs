//! Splits the records of a segment into ranges, and packs or reads the ranges on several threads.
//!
//! Every range except the last consists of whole blocks. Each range therefore begins with a group
//! of every stripe, and its beats are one piece of each channel. Only the last range ends within a
//! group, and is padded.

use std::num::NonZero;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};
use std::thread;

use pgs_interface::address_map::DMA_COUNT_MAX;
use pgs_interface::record::Beat;
use pgs_support::Crew;

use super::stripe::{BLOCK, Layout};
use crate::platform::{acquire_from_device, release_to_device};

/// Records of a range. A range is short enough that the last thread does not keep the others
/// waiting, and long enough that handing it out costs next to nothing. A segment of one range is
/// not worth another thread.
pub(crate) const RANGE: usize = 34 * BLOCK;
const _: () = assert!(RANGE.is_multiple_of(BLOCK));
/// Limit of the default number of threads: a few threads saturate the memory.
const UNASKED: usize = 4;
/// Limit of the number of threads.
const MOST: usize = 64;

/// The threads that write records and read results.
#[derive(Debug)]
pub(crate) struct PackPool {
    /// Number of threads at most, the caller's thread included; `None` for the default.
    threads: Option<usize>,
    /// The other threads, which start with the first segment of more than one range.
    crew: Option<Crew>,
}

impl PackPool {
    /// At most `threads` threads, the caller's thread included; `None` for the default.
    pub(crate) const fn new(threads: Option<usize>) -> Self {
        Self { threads, crew: None }
    }

    /// The caller's thread alone.
    #[cfg(test)]
    pub(crate) const fn alone() -> Self {
        Self::new(Some(1))
    }

    /// Cuts `count` records into ranges of the size that `cut` receives, does the work of each
    /// range, and joins the results in no particular order.
    pub(crate) fn each<T, R, I: Iterator<Item = T> + Send>(
        &mut self,
        count: usize,
        cut: impl FnOnce(usize) -> I,
        work: impl Fn(T) -> R + Sync,
        mut join: impl FnMut(R) + Send,
    ) {
        let Some(crew) = self.crew_for(count) else {
            // The whole segment is one range.
            let whole = cut(count.next_multiple_of(BLOCK).max(BLOCK));
            return whole.for_each(|range| join(work(range)));
        };
        let join = Mutex::new(join);
        crew.each(cut(RANGE), |range| {
            // The caller has barriers of its own, but they order only the loads and stores of its
            // own thread.
            acquire_from_device();
            let done = work(range);
            release_to_device();
            // After a panic no joined result is used.
            join.lock().unwrap_or_else(PoisonError::into_inner)(done);
        });
    }

    /// The threads for `count` records; `None` if the caller works alone.
    fn crew_for(&mut self, count: usize) -> Option<&mut Crew> {
        if count <= RANGE || self.threads == Some(1) {
            return None;
        }
        let threads = self.threads;
        let crew = self.crew.get_or_insert_with(|| start(threads));
        (!crew.is_alone()).then_some(crew)
    }
}

/// Starts the threads.
fn start(threads: Option<usize>) -> Crew {
    let found = || thread::available_parallelism().map_or(1, NonZero::get).min(UNASKED);
    let crew = Crew::new("pack", threads.unwrap_or_else(found).clamp(1, MOST) - 1);
    if let Some(error) = crew.refused() {
        log::warn!("no thread to help with packing and reading results: {error}");
    }
    crew
}

/// The record indices of each range.
pub(crate) fn ranges(
    count: usize,
    size: usize,
) -> impl Iterator<Item = Range<usize>> + Send + 'static {
    (0..count).step_by(size).map(move |first| first..count.min(first + size))
}

/// Beats of each channel; empty for a channel that the board does not have.
type PieceOf<S> = [S; DMA_COUNT_MAX];
/// Beats to write.
pub(crate) type Piece<'a> = PieceOf<&'a mut [Beat]>;
/// Beats to read.
pub(crate) type PieceRead<'a> = PieceOf<&'a [Beat]>;

/// All beats of a segment, to be written.
pub(crate) fn whole<'a>(channels: &'a mut [&mut [Beat]]) -> Piece<'a> {
    let mut whole = Piece::default();
    for (to, channel) in whole.iter_mut().zip(channels) {
        *to = channel;
    }
    whole
}

/// All beats of a segment, to be read.
pub(crate) fn whole_read<'a>(channels: &[&'a [Beat]]) -> PieceRead<'a> {
    let mut whole = PieceRead::default();
    for (to, channel) in whole.iter_mut().zip(channels) {
        *to = channel;
    }
    whole
}

/// Consecutive beats of a channel.
pub(crate) trait Stretch: Default {
    /// The first `beats` beats, or all if there are fewer; and the rest.
    fn parted(self, beats: usize) -> (Self, Self);
}

impl Stretch for &mut [Beat] {
    fn parted(self, beats: usize) -> (Self, Self) {
        self.split_at_mut(beats.min(self.len()))
    }
}

impl Stretch for &[Beat] {
    fn parted(self, beats: usize) -> (Self, Self) {
        self.split_at(beats.min(self.len()))
    }
}

/// The channels of a segment, cut into ranges.
#[derive(Debug)]
pub(crate) struct ChannelChunks<S> {
    /// Beats of a range on each channel.
    beats: [usize; DMA_COUNT_MAX],
    rest: PieceOf<S>,
}

impl<S: Stretch> ChannelChunks<S> {
    /// Cuts the channels into ranges of `size` records, which are whole blocks.
    ///
    /// Shape: each channel is as long as [`Layout::beats_on_channel`] says of all records.
    pub(crate) fn new(layout: &Layout, size: usize, channels: PieceOf<S>) -> Self {
        let beats = std::array::from_fn(|channel| layout.beats_on_channel(size, channel));
        Self { beats, rest: channels }
    }

    /// The beats of the next range; empty after the last range.
    pub(crate) fn cut(&mut self) -> PieceOf<S> {
        let mut piece = PieceOf::default();
        for ((piece, rest), beats) in piece.iter_mut().zip(&mut self.rest).zip(self.beats) {
            // The last range may be shorter.
            (*piece, *rest) = std::mem::take(rest).parted(beats);
        }
        piece
    }
}
