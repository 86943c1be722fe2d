//! Decodes records into blocks: one thread assigns the blocks in order, and all threads fill them.
//!
//! Sixteen neighbouring records that form a block in their order share it with no others, so that any
//! thread can fill it. All other records are put in when the threads have ended.

use std::mem;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use pgs_support::Crew;

use super::block::{self, Block, LANES, Words};
use super::grouping::Places;
use super::queue::Queue;
use super::records::{Fill, Head, Records, sum};
use super::width::Width;
use super::{Batch, NO_SLOT, Properties};
use crate::accelerator::records::segment::PacketError;
use crate::cast::register;
use pgs_interface::record::Beat;

/// Blocks that a thread fills at once.
const RUN: usize = 16;
/// Up to this number of records, one thread decodes alone.
const FEW: usize = 2 * RUN * LANES;
/// Runs that wait for a thread, at most.
const WAITING: usize = 8;
/// Groups that are put off until the threads have ended, at most.
pub(crate) const PUT_OFF: usize = 256;

/// Neighbouring records that are neighbouring blocks in their order.
#[derive(Debug)]
struct Run<'a> {
    /// The first record on the streams.
    first: usize,
    blocks: &'a mut [Block],
    kinds: [Words<u32>; RUN],
    sums: &'a mut [u32],
}

impl Run<'_> {
    fn fill(self, records: &Records<'_>, width: Width) {
        let Self { first, blocks, kinds, sums } = self;
        let kinds = &kinds[..blocks.len()];
        if let Err(fill) = width.run(Fill { records, first, kinds, blocks, sums }) {
            fill.one_by_one();
        }
    }
}

/// Neighbouring records, as many as a block has empty lanes, or fewer.
#[derive(Debug)]
pub(crate) struct Group {
    /// The first record on the streams, and how many.
    first: usize,
    count: usize,
    /// The slot of the first record.
    slot: usize,
    /// The blocks that begin with them.
    blocks: Range<usize>,
    kinds: Words<u32>,
}

/// The state of the thread that assigns the blocks.
struct Intake<'a, 'b> {
    records: Records<'b>,
    count: usize,
    width: Width,
    places: &'b mut Places,
    slots: &'b mut Vec<u32>,
    put_off: &'b mut Vec<Group>,
    /// Number of records that have their blocks.
    at: usize,
    refused: Option<PacketError>,
    /// The blocks and sums behind the ones given away, and the number of the first block and record.
    blocks: &'a mut [Block],
    first_block: usize,
    sums: &'a mut [u32],
    first_sum: usize,
    /// The run that is being gathered: its first record and block, and its length in blocks.
    run: (usize, usize, usize),
    kinds: [Words<u32>; RUN],
}

impl<'a> Intake<'a, '_> {
    /// Assigns blocks while enough are left, and fills the runs that `give` gives back.
    fn work(&mut self, give: impl Fn(Run<'a>) -> Option<Run<'a>>) {
        let end = self.first_block + self.blocks.len();
        while self.at < self.count
            && self.refused.is_none()
            && self.places.blocks() + LANES <= end
            && self.put_off.len() < PUT_OFF
        {
            let (group, block) = self.group();
            self.at += group.count;
            match block {
                Some(block) => {
                    let (first, begin, blocks) = self.run;
                    let follows = first + blocks * LANES == group.first && begin + blocks == block;
                    if !follows || blocks == RUN {
                        self.give(&give);
                        self.run = (group.first, block, 0);
                    }
                    self.kinds[self.run.2] = group.kinds;
                    self.run.2 += 1;
                }
                None => self.put_off.push(group),
            }
        }
        self.give(&give);
    }

    /// Gives the gathered run away.
    fn give(&mut self, give: impl Fn(Run<'a>) -> Option<Run<'a>>) {
        let (first, block, blocks) = mem::take(&mut self.run);
        if blocks == 0 {
            return;
        }
        let behind = &mut mem::take(&mut self.blocks)[block - self.first_block..];
        let (own, behind) = behind.split_at_mut(blocks);
        (self.blocks, self.first_block) = (behind, block + blocks);
        let behind = &mut mem::take(&mut self.sums)[first - self.first_sum..];
        let (sums, behind) = behind.split_at_mut(blocks * LANES);
        (self.sums, self.first_sum) = (behind, first + blocks * LANES);
        if let Some(run) = give(Run { first, blocks: own, kinds: self.kinds, sums }) {
            run.fill(&self.records, self.width);
        }
    }

    /// Assigns blocks to the next records: in hazard-free order to one for each empty lane of the last
    /// block. Returns the block if the records form one in their order.
    fn group(&mut self) -> (Group, Option<usize>) {
        let last = self.slots.last().filter(|slot| **slot != NO_SLOT);
        let taken = last.map_or(0, |slot| (*slot as usize + 1) % LANES);
        let most = (LANES - taken).min(self.count - self.at);
        let mut group = Group {
            first: self.at,
            count: 0,
            slot: self.slots.len(),
            blocks: self.places.blocks()..0,
            kinds: [0; LANES],
        };
        let records = self.records;
        for head in records.heads(self.at + LANES).take(LANES) {
            self.places.fetch(head.bodies);
        }
        let heads = records.heads(self.at).take(most);
        let number = register(group.slot);
        if let Some((block, lanes)) = self.places.place_together(number, heads, &mut group.kinds) {
            let first = register(block * LANES);
            self.slots.extend(first..first + register(lanes));
            group.count = lanes;
            if lanes == LANES {
                return (group, Some(block));
            }
        }
        for head in records.heads(self.at).take(most).skip(group.count) {
            match self.place(head) {
                Ok(kind) => group.kinds[group.count] = kind,
                Err(error) => {
                    self.refused = Some(error);
                    break;
                }
            }
            group.count += 1;
        }
        group.blocks.end = self.places.blocks();
        (group, None)
    }

    /// Places the next collision; returns the kind of its lane, 0 for a padding entry.
    fn place(&mut self, head: Head) -> Result<u32, PacketError> {
        let Head { count, friction, bodies } = head;
        let index = register(self.slots.len());
        if count == 0 {
            self.slots.push(NO_SLOT);
            return Ok(0);
        }
        let error = |code| PacketError { code, channel: 0, beat: index };
        let moving = self.places.moving(count, bodies).map_err(error)?;
        let place = self.places.place(index, bodies, moving);
        self.slots.push(register(place.block * LANES + place.lane));
        Ok(block::kind::of(count | friction, moving, place.serial))
    }
}

impl Batch {
    /// Decodes the next `count` records, of 2, 2, 2 and 1 beats on the four streams. `sums` receives
    /// the sum of the words of each record.
    ///
    /// # Errors
    ///
    /// The first collision that the decoder refuses; the collisions before it stay.
    pub(crate) fn decode(
        &mut self,
        streams: [&[Beat]; 4],
        count: usize,
        properties: Properties<'_>,
        sums: &mut [u32],
    ) -> Result<(), PacketError> {
        let records = Records { streams, warm: false, pair_friction: self.pair_friction };
        self.decode_records(&records, count, properties, sums)
    }

    /// The same for records of a warm pass, of two beats on each stream: the impulses on the last one are
    /// not read, nor do the sums count them.
    ///
    /// # Errors
    ///
    /// As [`decode`](Self::decode).
    pub(crate) fn decode_warm(
        &mut self,
        streams: [&[Beat]; 4],
        count: usize,
        properties: Properties<'_>,
        sums: &mut [u32],
    ) -> Result<(), PacketError> {
        let records = Records { streams, warm: true, pair_friction: self.pair_friction };
        self.decode_records(&records, count, properties, sums)
    }

    fn decode_records(
        &mut self,
        records: &Records<'_>,
        count: usize,
        properties: Properties<'_>,
        sums: &mut [u32],
    ) -> Result<(), PacketError> {
        let bodies = properties.shape_of.len();
        self.places.bodies(bodies, |body| properties.moves(body));
        self.bodies = self.bodies.max(bodies);
        self.measured = false;
        self.spins = false;
        self.gathered = false;
        let mut at = 0;
        while at < count {
            // A group begins at most one block for each of its records.
            let blocks = self.places.blocks() + (count - at).div_ceil(LANES) + LANES;
            if self.blocks.len() < blocks {
                self.blocks.resize(blocks, Block::EMPTY);
            }
            let first_block = self.places.blocks();
            let mut intake = Intake {
                records: *records,
                count,
                width: self.width,
                places: &mut self.places,
                slots: &mut self.slots,
                put_off: &mut self.put_off,
                at,
                refused: None,
                blocks: &mut self.blocks[first_block..],
                first_block,
                sums: &mut sums[at..],
                first_sum: at,
                run: (0, 0, 0),
                kinds: [[0; LANES]; RUN],
            };
            share(&mut intake, &mut self.crew);
            let refused = intake.refused;
            at = intake.at;
            self.put(records, sums);
            if let Some(error) = refused {
                return Err(error);
            }
        }
        Ok(())
    }

    /// Puts the records into their blocks that were put off.
    fn put(&mut self, records: &Records<'_>, sums: &mut [u32]) {
        for Group { first, count, slot, blocks, kinds } in self.put_off.drain(..) {
            self.blocks[blocks].fill(Block::EMPTY);
            let slots = &self.slots[slot..slot + count];
            for (at, (slot, kind)) in slots.iter().zip(kinds).enumerate() {
                let rows = records.rows(first + at);
                sums[first + at] = sum(&rows);
                if *slot != NO_SLOT {
                    let (block, lane) = (*slot as usize / LANES, *slot as usize % LANES);
                    self.blocks[block].put(lane, &rows, kind);
                }
            }
        }
    }
}

/// Shares the intake among all threads of a crew, if there are enough records to wake them.
fn share(intake: &mut Intake<'_, '_>, crew: &mut Crew) {
    if crew.is_alone() || intake.count - intake.at <= FEW {
        intake.work(Some);
        return;
    }
    let (records, width) = (intake.records, intake.width);
    let queue = Queue::<Run<'_>, WAITING>::new();
    let intake = Mutex::new(intake);
    crew.run(&|thread| {
        if thread == 0 {
            let _ends = queue.ends();
            // The other threads never lock it.
            let mut intake = intake.lock().unwrap_or_else(PoisonError::into_inner);
            intake.work(|run| queue.put(run));
        }
        queue.work(|run| run.fill(&records, width));
    });
}

#[cfg(test)]
mod tests;
