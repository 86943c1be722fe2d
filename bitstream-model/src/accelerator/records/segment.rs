//! Reads one segment of records from the streams: finds the rows of the next record, counts the
//! whole records that have arrived, and checks that TLAST comes where it must.

use super::array::{Array, Row, half_of};
use super::striping::{PerStream, Places, STREAMS_MAX};
use crate::cast::register;
use crate::stream::Stream;
use pgs_interface::control::ErrorCode;
use pgs_interface::record::{Beat, LANES};

/// A packet that does not end where it must.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PacketError {
    pub(crate) code: ErrorCode,
    pub(crate) channel: usize,
    /// The beat within the channel's packet.
    pub(crate) beat: u32,
}

/// A segment while it is being read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Segment {
    array: Array,
    /// Records read so far.
    pub(crate) done: usize,
    /// Beats taken so far from each stream.
    taken: PerStream,
}

impl Segment {
    pub(crate) fn new(array: Array) -> Self {
        Self { array, done: 0, taken: [0; STREAMS_MAX] }
    }

    /// Clock cycles that the streams take for the records that were read.
    pub(crate) fn cycles(&self) -> u64 {
        self.array.cycles(self.done)
    }

    /// Clock cycles that the streams take for `records` records alone.
    pub(crate) fn cycles_of(&self, records: usize) -> u64 {
        self.array.cycles(records)
    }

    /// Whole records that have arrived and were not read yet.
    pub(crate) fn available(&self, streams: &[Stream]) -> usize {
        let arrived = self.array.striping.contiguous(|k| self.taken[k] + streams[k].len());
        // A record may begin in a beat that was taken, and end in one that has not arrived.
        self.array.records_in(arrived).saturating_sub(self.done)
    }

    /// Beats of the segment on one stream.
    pub(crate) fn beats_on(&self, stream: usize) -> usize {
        self.array.packets.get(stream).copied().unwrap_or(0)
    }

    /// Records that were not read yet, arrived or not.
    pub(crate) fn left(&self) -> usize {
        self.array.records - self.done
    }

    /// Checks that the next `records` records end packets where they must and nowhere else, with
    /// whole beats.
    pub(crate) fn check(&self, records: usize, streams: &[Stream]) -> Result<(), PacketError> {
        let after = self.array.striping.counts(self.array.beats_of(self.done + records));
        for (k, stream) in streams.iter().enumerate() {
            let packet = self.array.packets[k];
            let now = after[k] - self.taken[k];
            let ends = now > 0 && self.taken[k] + now == packet;
            let error = |code, beat| PacketError { code, channel: k, beat: register(beat) };
            match stream.next_last() {
                Some(last) if last < now && !(ends && last == now - 1) => {
                    return Err(error(ErrorCode::TlastEarly, self.taken[k] + last));
                }
                None if ends => return Err(error(ErrorCode::TlastMissing, packet - 1)),
                Some(last) if ends && last >= now => {
                    return Err(error(ErrorCode::TlastMissing, packet - 1));
                }
                _ => {}
            }
            if let Some(partial) = stream.next_partial().filter(|partial| *partial < now) {
                return Err(error(ErrorCode::PartialBeat, self.taken[k] + partial));
            }
        }
        Ok(())
    }

    /// Checks that no packet has ended in the middle of the next record, whose rest would never
    /// come.
    pub(crate) fn check_waiting(&self, streams: &[Stream]) -> Result<(), PacketError> {
        for (k, stream) in streams.iter().enumerate() {
            // Beats behind the end of this packet belong to the next one.
            let left = self.beats_on(k) - self.taken[k];
            if let Some(last) = stream.next_last().filter(|last| last + 1 < left) {
                let beat = register(self.taken[k] + last);
                return Err(PacketError { code: ErrorCode::TlastEarly, channel: k, beat });
            }
        }
        Ok(())
    }

    /// A reader of records that have arrived: it skips `ahead` records and reads the rest one
    /// after the other. At least one must have arrived behind the skipped ones. All records stay
    /// in the streams until [`advance`](Self::advance).
    pub(crate) fn reader<'a>(
        &'a self,
        ahead: usize,
        streams: &'a [Stream],
    ) -> Reader<'a, Arrived<'a>> {
        let arrived = Arrived { taken: &self.taken, streams };
        Reader::new(&self.array, self.done + ahead, arrived)
    }

    /// How its records lie.
    pub(crate) fn array(&self) -> &Array {
        &self.array
    }

    /// Takes the next `records` records, which have been read, out of the streams. Returns the sum
    /// of their words.
    pub(crate) fn advance(&mut self, records: usize, streams: &mut [Stream]) -> u32 {
        self.done += records;
        let after = self.array.striping.counts(self.array.beats_of(self.done));
        let mut sum = 0_u32;
        for (k, stream) in streams.iter_mut().enumerate() {
            sum = sum.wrapping_add(stream.take_sum(after[k] - self.taken[k]));
        }
        self.taken = after;
        sum
    }

    pub(crate) fn finished(&self) -> bool {
        self.done == self.array.records
    }
}

/// Beats of an array, by their stream and their number on it.
pub(crate) trait Beats {
    fn beat(&self, stream: usize, number: usize) -> Beat;
}

/// Beats that have arrived on the streams.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Arrived<'a> {
    taken: &'a PerStream,
    streams: &'a [Stream],
}

impl Beats for Arrived<'_> {
    #[inline(always)]
    fn beat(&self, stream: usize, number: usize) -> Beat {
        self.streams[stream].peek(number - self.taken[stream])
    }
}

/// All beats of an array, stream by stream.
impl Beats for [&[Beat]; STREAMS_MAX] {
    #[inline(always)]
    fn beat(&self, stream: usize, number: usize) -> Beat {
        self[stream][number]
    }
}

/// Reads one record after the other.
#[derive(Debug)]
pub(crate) struct Reader<'a, B> {
    array: &'a Array,
    beats: B,
    places: Places<'a>,
    /// The second row of a beat whose first row has been read.
    left: Option<Row>,
}

impl<'a, B: Beats> Reader<'a, B> {
    /// Reads from record `first` on, which is there.
    pub(crate) fn new(array: &'a Array, first: usize, beats: B) -> Self {
        let row = first * array.rows;
        let places = array.striping.places(row / array.rows_per_beat);
        let mut reader = Self { array, beats, places, left: None };
        if !row.is_multiple_of(array.rows_per_beat) {
            reader.left = Some(half_of(reader.beat(), 1));
        }
        reader
    }

    #[inline(always)]
    fn beat(&mut self) -> Beat {
        let (stream, number) = self.places.take();
        self.beats.beat(stream, number)
    }

    /// The rows of the next record.
    #[inline]
    pub(crate) fn record<const ROWS: usize>(&mut self) -> [Row; ROWS] {
        debug_assert!(ROWS <= self.array.rows, "the caller knows the record");
        self.rows()
    }

    /// The next rows.
    #[inline]
    pub(crate) fn rows<const ROWS: usize>(&mut self) -> [Row; ROWS] {
        let mut rows = [[0; LANES]; ROWS];
        if self.array.rows_per_beat == 1 {
            for row in &mut rows {
                *row = self.beat().0;
            }
        } else {
            for row in &mut rows {
                *row = match self.left.take() {
                    Some(row) => row,
                    None => {
                        let beat = self.beat();
                        self.left = Some(half_of(beat, 1));
                        half_of(beat, 0)
                    }
                };
            }
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::super::array::Records;
    use super::super::striping::Striping;
    use super::*;
    use pgs_interface::profile::{FLOAT, HALF, Profile};

    fn streams<const N: usize>(lengths: [usize; N]) -> Vec<Stream> {
        lengths
            .iter()
            .map(|length| {
                let mut stream = Stream::new(64);
                stream.push(&vec![Beat::default(); *length]);
                stream
            })
            .collect()
    }

    fn collisions(profile: &'static Profile, count: usize) -> Segment {
        let variant = profile.default_variant();
        let striping = Striping::new(&profile.stripes.collisions, profile.mm2s_widths);
        let format = variant.numbers.collisions;
        let together = profile.collisions_per_issue as usize;
        let rows = pgs_interface::record::collision::ROWS;
        Segment::new(Array::new(striping, Records { format, rows, count, together }))
    }

    fn velocities(profile: &'static Profile, count: usize) -> Segment {
        let variant = profile.default_variant();
        let striping = Striping::new(&profile.stripes.velocities, profile.mm2s_widths);
        let format = variant.numbers.bodies;
        let rows = variant.velocity_rows();
        Segment::new(Array::new(striping, Records { format, rows, count, together: 1 }))
    }

    #[test]
    fn a_collision_is_there_when_all_its_beats_are() {
        let segment = collisions(&FLOAT, 10);
        assert_eq!(segment.available(&streams([4, 4, 4, 2])), 2);
        assert_eq!(segment.available(&streams([4, 4, 4, 1])), 1);
        assert_eq!(segment.available(&streams([4, 4, 3, 9])), 1);
    }

    #[test]
    fn running_records_alternate_between_halves_of_the_streams() {
        let segment = velocities(&FLOAT, 10);
        assert_eq!(segment.available(&streams([1, 1, 0, 0])), 1);
        assert_eq!(segment.available(&streams([2, 2, 1, 1])), 3);
        assert_eq!(segment.available(&streams([2, 1, 1, 1])), 2);
    }

    #[test]
    fn two_collisions_share_a_beat_of_sixteen_bit_words() {
        let mut all: Vec<Stream> = (0..3).map(|_| Stream::new(64)).collect();
        // Rows are numbered through from 0, a word each.
        let mut row = 0;
        for stream in [0, 0, 0, 1, 1, 1, 2] {
            all[stream].push(&[Beat([row, 0, row + 1, 0])]);
            row += 2;
        }
        let mut segment = collisions(&HALF, 4);
        let numbers = |rows: [Row; 7]| rows.map(|[number, ..]| number);
        assert_eq!(segment.available(&all), 2);
        let mut reader = segment.reader(0, &all);
        assert_eq!(numbers(reader.record()), [0, 1, 2, 3, 4, 5, 6]);
        assert_eq!(numbers(reader.record()), [7, 8, 9, 10, 11, 12, 13]);
        assert_eq!(segment.advance(1, &mut all), 1 + 2 + 3 + 4 + 5);
        assert_eq!(numbers(segment.reader(0, &all).record()), [7, 8, 9, 10, 11, 12, 13]);
        segment.advance(1, &mut all);
        assert!(all.iter().all(|stream| stream.len() == 0));
    }

    #[test]
    fn the_last_record_waits_for_the_padding_behind_it() {
        // Three and a half beats of a collision, three and a half of padding.
        let segment = collisions(&HALF, 1);
        assert_eq!(segment.available(&streams([3, 3, 0])), 0);
        let mut all = streams([3, 3, 1]);
        assert_eq!(segment.available(&all), 1);
        let missing = PacketError { code: ErrorCode::TlastMissing, channel: 0, beat: 2 };
        assert_eq!(segment.check(1, &all), Err(missing));
        all.iter_mut().for_each(Stream::mark_last);
        assert_eq!(segment.check(1, &all), Ok(()));
        // Two beats on each wide stream and one on the narrow one for one body.
        let segment = velocities(&HALF, 1);
        assert_eq!(segment.available(&streams([2, 2, 0])), 0);
        assert_eq!(segment.available(&streams([2, 2, 1])), 1);
    }

    #[test]
    fn tlast_must_come_with_the_last_beat_of_each_stream() {
        let mut all = streams([2, 2, 2, 1]);
        let segment = collisions(&FLOAT, 1);
        let missing = PacketError { code: ErrorCode::TlastMissing, channel: 0, beat: 1 };
        assert_eq!(segment.check(1, &all), Err(missing));
        for stream in &mut all {
            stream.mark_last();
        }
        assert_eq!(segment.check(1, &all), Ok(()));
        assert_eq!(segment.check_waiting(&all), Ok(()));
        let longer = collisions(&FLOAT, 2);
        let early = PacketError { code: ErrorCode::TlastEarly, channel: 0, beat: 1 };
        assert_eq!(longer.check(1, &all), Err(early));
        // Half a record: no whole record to check.
        let mut cut = streams([1, 0, 0, 0]);
        cut[0].mark_last();
        assert_eq!(longer.available(&cut), 0);
        let early = PacketError { beat: 0, ..early };
        assert_eq!(longer.check_waiting(&cut), Err(early));
    }
}
