//! Splits the records of a segment into ranges, and packs or reads the ranges on several threads.
//!
//! A range is whole blocks, but for the last, so that it begins with a group of every stripe: on each
//! channel its beats lie by themselves. Only the last range ends within a group, and is padded.

use std::num::NonZero;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};
use std::thread;

use pgs_interface::address_map::DMA_COUNT_MAX;
use pgs_interface::record::Beat;
use pgs_support::Crew;

use super::stripe_writer::BLOCK;
use crate::beat::stripe::Layout;
use crate::platform::{acquire_from_device, release_to_device};

/// Records of a range: so few that nobody waits long for a thread that took the last one, so many that
/// taking one costs nothing beside it. As many are not worth waking a thread.
pub(crate) const RANGE: usize = 68 * BLOCK;
const _: () = assert!(RANGE.is_multiple_of(BLOCK));
/// Threads that are taken unasked, at most: what several write is soon as much as the memory takes.
const UNASKED: usize = 4;
/// Threads at most.
const MOST: usize = 64;

/// The threads that write records and read results.
#[derive(Debug)]
pub(crate) struct PackPool {
    /// How many there may be, the caller's among them; as many as are worth it, if nobody said it.
    threads: Option<usize>,
    /// They are started when there is something for them.
    crew: Option<Crew>,
}

impl PackPool {
    /// At most so many threads, of which one is the caller's; as many as are worth it for `None`.
    pub(crate) const fn new(threads: Option<usize>) -> Self {
        Self { threads, crew: None }
    }

    /// Nobody but the caller.
    #[cfg(any(test, feature = "bench"))]
    pub(crate) const fn alone() -> Self {
        Self::new(Some(1))
    }

    /// Does the work of `count` records, cut into ranges of as many records as `cut` is told; what
    /// comes of each is joined, in no particular order.
    pub(crate) fn each<T, R, I: Iterator<Item = T> + Send>(
        &mut self,
        count: usize,
        cut: impl FnOnce(usize) -> I,
        work: impl Fn(T) -> R + Sync,
        mut join: impl FnMut(R) + Send,
    ) {
        let Some(crew) = self.crew_for(count) else {
            // All of it is one range.
            let whole = cut(count.next_multiple_of(BLOCK).max(BLOCK));
            return whole.for_each(|range| join(work(range)));
        };
        let join = Mutex::new(join);
        crew.each(cut(RANGE), |range| {
            // The caller's own barriers, after the board has told and before it is told, are of what the caller
            // loads and stores.
            acquire_from_device();
            let done = work(range);
            release_to_device();
            // After a panic nothing that was joined is used.
            join.lock().unwrap_or_else(PoisonError::into_inner)(done);
        });
    }

    /// The threads for so many records; none if the caller does it alone.
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

/// The records of each range.
pub(crate) fn ranges(
    count: usize,
    size: usize,
) -> impl Iterator<Item = Range<usize>> + Send + 'static {
    (0..count).step_by(size).map(move |first| first..count.min(first + size))
}

/// Beats on each channel; none on those that there are not.
type PieceOf<S> = [S; DMA_COUNT_MAX];
/// Those that are written.
pub(crate) type Piece<'a> = PieceOf<&'a mut [Beat]>;
/// Those that are read.
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

/// Beats one behind the other on a channel.
pub(crate) trait Stretch: Default {
    /// So many of them, or as many as there are, and what is behind.
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
    /// Beats of a range.
    beats: [usize; DMA_COUNT_MAX],
    rest: PieceOf<S>,
}

impl<S: Stretch> ChannelChunks<S> {
    /// For ranges of `size` records, whole blocks.
    ///
    /// Shape: each channel is as long as [`Layout::beats_on_channel`] says of all records.
    pub(crate) fn new(layout: &Layout, size: usize, channels: PieceOf<S>) -> Self {
        let beats = std::array::from_fn(|channel| layout.beats_on_channel(size, channel));
        Self { beats, rest: channels }
    }

    /// The next range's; nothing behind the last.
    pub(crate) fn cut(&mut self) -> PieceOf<S> {
        let mut piece = PieceOf::default();
        for ((piece, rest), beats) in piece.iter_mut().zip(&mut self.rest).zip(self.beats) {
            // The last one may be shorter.
            (*piece, *rest) = std::mem::take(rest).parted(beats);
        }
        piece
    }
}
