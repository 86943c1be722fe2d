//! The packets of a whole step, found by the descriptors of all channels.

use super::block::Records;
use crate::accelerator::Accelerator;
use crate::accelerator::records::array::{Array, Row};
use crate::accelerator::records::decode::number;
use crate::accelerator::records::segment::Reader;
use crate::accelerator::records::striping::{PerStream, STREAMS_MAX};
use crate::axi_dma::Core;
use crate::axi_dma::chain::Piece;
use crate::memory::Memory;
use crate::stream::Stream;
use pgs_interface::axi_dma::Direction;
use pgs_interface::number::StreamFormat;
use pgs_interface::record::{BEAT_BYTES, Beat, LANES, WORD_LANE, collision};
use pgs_support::lanes::Quad;

/// The number of a pass that surely is not warm: a step has fewer passes.
const COLD: u32 = u32::MAX - 1;
/// The kinds of passes by the packets that they bring: collisions alone, with normal impulses, and
/// with impulses of friction.
pub(super) const KINDS: usize = 3;

/// A packet in memory: its address and its beats.
type Place = (u64, usize);
/// The beats of an array, stream by stream.
pub(super) type Views<'a> = [&'a [Beat]; STREAMS_MAX];

/// Where the packets of a step are.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Packets {
    velocities: [Place; STREAMS_MAX],
    collisions: [Option<[Place; STREAMS_MAX]>; KINDS],
    poses: [Place; STREAMS_MAX],
    /// The buffers of each receiver.
    pub(super) receivers: [Vec<Piece>; STREAMS_MAX],
    /// Beats that have moved on each input.
    pub(super) moved: PerStream,
    /// Beats of all packets on each stream, in and out.
    pub(super) beats: [PerStream; 2],
    /// The chain of a channel; kept for its memory.
    chain: Vec<Piece>,
}

/// The kind of a pass.
pub(super) fn kind(accelerator: &Accelerator, pass: u32) -> usize {
    match accelerator.arguments.is_warm(pass) {
        false => 0,
        true if pass < accelerator.arguments.contact_passes() => 1,
        true => 2,
    }
}

/// A pass of a kind.
pub(super) fn pass_of(accelerator: &Accelerator, kind: usize) -> u32 {
    [COLD, 0, accelerator.arguments.contact_passes()][kind]
}

/// Takes the pieces of the next packet, which lie one behind the other; `None` if they do not.
fn packet(pieces: &mut impl Iterator<Item = Piece>, beats: usize) -> Option<Place> {
    let mut place = (0, 0);
    while place.1 < beats {
        let piece = pieces.next()?;
        let first = place.1 == 0;
        if first {
            place.0 = piece.at;
        }
        place.1 += piece.beats;
        let ends = place.1 == beats;
        let behind = place.0 + ((place.1 - piece.beats) * BEAT_BYTES) as u64;
        if piece.at != behind || piece.begins != first || piece.ends != ends {
            return None;
        }
    }
    (place.1 == beats).then_some(place)
}

impl Packets {
    /// Finds the packets of a step during its load. `outgoing` are the
    /// beats that go out on each stream. `None` if a channel lacks a descriptor, or anything could
    /// happen on it but that beats move.
    pub(super) fn find(
        &mut self,
        accelerator: &Accelerator,
        cores: &[Core],
        outgoing: &PerStream,
        memory: &mut Memory,
    ) -> Option<()> {
        let arrays = [accelerator.velocities_in(), accelerator.poses_in()];
        let [velocities, poses] = arrays.each_ref().map(|segment| &segment.array().packets);
        let passes = accelerator.arguments.passes();
        let of_kind: [_; KINDS] = std::array::from_fn(|kind| {
            accelerator.collisions_in(pass_of(accelerator, kind)).array().packets
        });
        let Self { receivers, chain, .. } = std::mem::take(self);
        *self = Self { receivers, ..Self::default() };
        let mut chain = chain;
        for (k, core) in cores.iter().enumerate() {
            chain.clear();
            let per_pass = (0..passes).map(|pass| of_kind[kind(accelerator, pass)][k]);
            self.beats[0][k] = velocities[k] + per_pass.sum::<usize>() + poses[k];
            self.beats[1][k] = outgoing[k];
            if self.beats[0][k] > 0 {
                self.moved[k] = core.chain(Direction::Mm2s, memory, &mut chain)?;
            } else {
                core.rests(Direction::Mm2s).then_some(())?;
            }
            let mut pieces = chain.iter().copied();
            self.velocities[k] = packet(&mut pieces, velocities[k])?;
            for pass in 0..passes {
                let kind = kind(accelerator, pass);
                let place = packet(&mut pieces, of_kind[kind][k])?;
                let places = self.collisions[kind].get_or_insert_default();
                if places[k].1 == 0 {
                    places[k] = place;
                }
                (places[k] == place).then_some(())?;
            }
            self.poses[k] = packet(&mut pieces, poses[k])?;
            pieces.next().is_none().then_some(())?;
            let receiver = &mut self.receivers[k];
            receiver.clear();
            if outgoing[k] > 0 {
                let moved = core.chain(Direction::S2mm, memory, receiver)?;
                let room: usize = receiver.iter().map(|piece| piece.beats).sum();
                let writable = receiver.iter().all(|p| memory.may_write(p.at, p.beats));
                (moved == 0 && room == outgoing[k] && writable).then_some(())?;
            } else {
                core.rests(Direction::S2mm).then_some(())?;
            }
        }
        chain.clear();
        self.chain = chain;
        Some(())
    }

    /// Beats that have moved beyond the load on each input; `None` unless the FIFOs hold all of
    /// them.
    pub(super) fn ahead(&self, inputs: &[Stream]) -> Option<PerStream> {
        let mut ahead = PerStream::default();
        for (k, ahead) in ahead.iter_mut().enumerate().filter(|(k, _)| self.beats[0][*k] > 0) {
            *ahead = self.moved[k].checked_sub(self.velocities[k].1)?;
            (*ahead == inputs.get(k).map_or(0, Stream::len)).then_some(())?;
        }
        Some(ahead)
    }

    /// The velocities, the poses, and the collisions of each kind of pass.
    pub(super) fn views<'a>(&self, memory: &'a Memory) -> Option<Input<'a>> {
        let view = |places: &[Place; STREAMS_MAX]| {
            let mut views: Views<'a> = [&[]; STREAMS_MAX];
            for (view, (at, beats)) in views.iter_mut().zip(places) {
                if *beats > 0 {
                    *view = memory.view(*at, *beats)?;
                }
            }
            Some(views)
        };
        let mut collisions = [None; KINDS];
        for (views, places) in collisions.iter_mut().zip(&self.collisions) {
            if let Some(places) = places {
                *views = Some(view(places)?);
            }
        }
        Some(Input { velocities: view(&self.velocities)?, collisions, poses: view(&self.poses)? })
    }
}

/// The beats of a step's packets.
#[derive(Debug, Clone, Copy)]
pub(super) struct Input<'a> {
    pub(super) velocities: Views<'a>,
    pub(super) collisions: [Option<Views<'a>>; KINDS],
    pub(super) poses: Views<'a>,
}

/// The sum of all words.
pub(super) fn sum(views: &Views<'_>) -> u32 {
    let of = |beats: &[Beat]| {
        let words: &[u32] = bytemuck::cast_slice(beats);
        words.iter().copied().fold(0, u32::wrapping_add)
    };
    views.iter().map(|beats| of(beats)).fold(0, u32::wrapping_add)
}

/// Records whose rows are at constant distances on their streams.
#[derive(Debug, Clone, Copy)]
struct Rows<'a> {
    views: Views<'a>,
    /// The stream and the number there of each row of the first record.
    places: [(usize, usize); collision::WARM_ROWS],
    /// Beats of a record on each stream.
    strides: PerStream,
}

impl<'a> Rows<'a> {
    fn new(array: &Array, views: Views<'a>) -> Option<Self> {
        let whole = array.rows_per_beat == 1 && array.rows.is_multiple_of(array.striping.group());
        let mut walk = array.striping.places(0);
        let places = std::array::from_fn(|_| walk.take());
        whole.then(|| Self { views, places, strides: array.striping.counts(array.rows) })
    }

    /// Widened rows.
    fn widened(rows: &'a [Beat]) -> Self {
        let mut views: Views<'a> = [&[]; STREAMS_MAX];
        views[0] = rows;
        let places = std::array::from_fn(|row| (0, row));
        Self { views, places, strides: [collision::WARM_ROWS; STREAMS_MAX] }
    }

    #[inline(always)]
    fn row(&self, record: usize, row: usize) -> Beat {
        let (stream, number) = self.places[row];
        self.views[stream][record * self.strides[stream] + number]
    }

    /// Whether a row of `records` records is the same as other records' row.
    fn has_row_of(&self, other: &Self, records: usize, row: usize) -> bool {
        let (stream, _) = self.places[row];
        let same_place = self.places[row] == other.places[row]
            && self.strides[stream] == other.strides[stream]
            && std::ptr::eq(self.views[stream], other.views[stream]);
        same_place || (0..records).all(|at| self.row(at, row) == other.row(at, row))
    }
}

/// Collisions of sixteen-bit words as they would come in f32, for each kind of pass: the rows of a
/// warm pass, one after the other.
pub(super) type Widened = [Vec<Beat>; KINDS];

/// Widens the collisions of a kind of pass.
fn widen(accelerator: &Accelerator, kind: usize, views: Views<'_>, to: &mut Vec<Beat>) {
    let together = accelerator.variant.profile.collisions_per_issue as usize;
    let segment = accelerator.collisions_in(pass_of(accelerator, kind));
    let mut reader = Reader::new(segment.array(), 0, views);
    let widened = |mut row: Row, numbers: usize| {
        for word in &mut row[..numbers] {
            *word = number(StreamFormat::Binary16, *word).to_bits();
        }
        Beat(row)
    };
    to.clear();
    for _ in 0..segment.array().records.div_ceil(together) {
        let first = to.len();
        for _ in 0..together {
            let rows: [Row; collision::ROWS] = reader.rows();
            let numbers = |row| if row < collision::CONTACTS { WORD_LANE } else { LANES };
            to.extend(rows.iter().enumerate().map(|(row, words)| widened(*words, numbers(row))));
            to.push(Beat::default());
        }
        // Behind the records of an issue.
        for record in 0..if kind > 0 { together } else { 0 } {
            let [impulses] = reader.rows();
            let at = first + record * collision::WARM_ROWS + collision::IMPULSES;
            to[at] = widened(impulses, LANES);
        }
    }
}

/// Collisions in f32 and world coordinates, and the impulses that come in with them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Collisions<'a> {
    rows: Rows<'a>,
    warm: [Option<Rows<'a>>; 2],
}

impl<'a> Collisions<'a> {
    /// The collisions of a step. `None` if the passes bring different ones.
    pub(super) fn new(
        accelerator: &Accelerator,
        input: &Input<'a>,
        widened: &'a mut Widened,
    ) -> Option<Self> {
        let records = accelerator.arguments.collisions as usize;
        let mut kinds = [None; KINDS];
        for (kind, to) in widened.iter_mut().enumerate() {
            let Some(views) = input.collisions[kind] else { continue };
            kinds[kind] = match accelerator.variant.numbers.collisions {
                StreamFormat::F32 => {
                    let segment = accelerator.collisions_in(pass_of(accelerator, kind));
                    Some(Rows::new(segment.array(), views)?)
                }
                StreamFormat::Binary16 => {
                    widen(accelerator, kind, views, to);
                    Some(Rows::widened(to))
                }
            };
        }
        let mut different = kinds.iter().flatten();
        let rows = *different.next()?;
        let same =
            |kind: &Rows<'_>| (0..collision::ROWS).all(|row| kind.has_row_of(&rows, records, row));
        different.all(same).then_some(())?;
        let [_, warm @ ..] = kinds;
        Some(Self { rows, warm })
    }

    /// Whether impulses come in with them.
    pub(super) fn are_warm(&self) -> bool {
        self.warm.iter().any(Option::is_some)
    }

    /// The word beside a row's three numbers.
    #[inline(always)]
    pub(super) fn word(&self, collision: usize, row: usize) -> u32 {
        self.rows.row(collision, row).0[WORD_LANE]
    }
}

impl Records for Collisions<'_> {
    #[inline(always)]
    fn row(&self, collision: usize, row: usize) -> Quad {
        bytemuck::cast(self.rows.row(collision, row))
    }

    #[inline(always)]
    fn given(&self, collision: usize) -> [Quad; 2] {
        self.warm.map(|rows| {
            let beat = rows.map(|rows| rows.row(collision, collision::IMPULSES));
            bytemuck::cast(beat.unwrap_or_default())
        })
    }
}
