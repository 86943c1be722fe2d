//! This file reads one segment of beats from the streams: which stream the next beat is on, how many
//! whole records have arrived, and whether TLAST comes where it must.

use crate::cast::register;
use crate::interface::control::ErrorCode;
use crate::interface::record::Beat;
use crate::stream::Stream;

/// How a segment's beats lie on the streams.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Striping {
    /// Beat b of every record is on stream b mod N.
    ByRecord,
    /// The running beat number over the whole segment, mod N.
    Running,
}

/// A packet that does not end where it must.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct PacketError {
    pub(super) code: ErrorCode,
    pub(super) channel: usize,
    /// The beat within the channel's packet.
    pub(super) beat: u32,
}

/// The most streams that a profile has.
pub(super) const STREAMS_MAX: usize = 8;

/// A segment while it is being read.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment {
    striping: Striping,
    beats_per_record: usize,
    records: usize,
    streams: usize,
    /// Records read so far.
    pub(super) done: usize,
    /// Beats read so far from each stream.
    taken: [usize; STREAMS_MAX],
    /// Striped by record: the stream of each beat of a record, and its number on that stream.
    place: [(usize, usize); STREAMS_MAX],
    /// Striped by record: beats of a record on each stream.
    share: [usize; STREAMS_MAX],
}

impl Segment {
    pub(super) fn new(
        striping: Striping,
        beats_per_record: usize,
        records: usize,
        streams: usize,
    ) -> Self {
        assert!((1..=STREAMS_MAX).contains(&streams), "a profile has 1 to 8 streams");
        assert!(beats_per_record <= STREAMS_MAX, "a record has at most 8 beats");
        let mut share = [0; STREAMS_MAX];
        for beat in 0..beats_per_record {
            share[beat % streams] += 1;
        }
        Self {
            striping,
            beats_per_record,
            records,
            streams,
            done: 0,
            taken: [0; STREAMS_MAX],
            place: std::array::from_fn(|beat| (beat % streams, beat / streams)),
            share,
        }
    }

    /// Beats on a stream after `records` records.
    fn beats_after(&self, records: usize, stream: usize) -> usize {
        match self.striping {
            Striping::ByRecord => records * self.share[stream],
            Striping::Running => {
                (records * self.beats_per_record + self.streams - 1 - stream) / self.streams
            }
        }
    }

    /// Whole records that have arrived and were not read.
    pub(super) fn available(&self, streams: &[Stream]) -> usize {
        let mut records = self.records;
        for (k, stream) in streams.iter().enumerate().take(self.streams) {
            let arrived = self.taken[k] + stream.len();
            let whole = match self.striping {
                Striping::ByRecord => match self.share[k] {
                    0 => continue,
                    share => arrived / share,
                },
                // All running beats below this stream's next one may have arrived.
                Striping::Running => (arrived * self.streams + k) / self.beats_per_record,
            };
            records = records.min(whole);
        }
        records - self.done
    }

    /// Checks that the next `records` records end packets where they must and nowhere else, with
    /// whole beats.
    pub(super) fn check(&self, records: usize, streams: &[Stream]) -> Result<(), PacketError> {
        for (k, stream) in streams.iter().enumerate().take(self.streams) {
            let packet = self.beats_after(self.records, k);
            let now = self.beats_after(self.done + records, k) - self.taken[k];
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
            if let Some(partial) = stream.next_partial()
                && partial < now
            {
                return Err(error(ErrorCode::PartialBeat, self.taken[k] + partial));
            }
        }
        Ok(())
    }

    /// Beat `beat` of the record `ahead` places after the next one.
    #[inline]
    pub(super) fn beat(&self, ahead: usize, beat: usize, streams: &[Stream]) -> Beat {
        match self.striping {
            Striping::ByRecord => {
                let (stream, number) = self.place[beat];
                streams[stream].peek(ahead * self.share[stream] + number)
            }
            Striping::Running => {
                let running = (self.done + ahead) * self.beats_per_record + beat;
                let stream = running % self.streams;
                streams[stream].peek(running / self.streams - self.taken[stream])
            }
        }
    }

    /// A whole record.
    #[inline]
    pub(super) fn record<const BEATS: usize>(
        &self,
        ahead: usize,
        streams: &[Stream],
    ) -> [Beat; BEATS] {
        std::array::from_fn(|beat| self.beat(ahead, beat, streams))
    }

    /// The next `records` records have been read.
    pub(super) fn advance(&mut self, records: usize, streams: &mut [Stream]) {
        self.done += records;
        for (k, stream) in streams.iter_mut().enumerate().take(self.streams) {
            let taken = self.beats_after(self.done, k);
            stream.pop(taken - self.taken[k]);
            self.taken[k] = taken;
        }
    }

    pub(super) fn finished(&self) -> bool {
        self.done == self.records
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn streams(lengths: [usize; 4]) -> Vec<Stream> {
        lengths
            .iter()
            .map(|length| {
                let mut stream = Stream::new(64);
                stream.push(&vec![Beat::default(); *length]);
                stream
            })
            .collect()
    }

    #[test]
    fn a_collision_is_there_when_all_its_beats_are() {
        let segment = Segment::new(Striping::ByRecord, 7, 10, 4);
        assert_eq!(segment.available(&streams([4, 4, 4, 2])), 2);
        assert_eq!(segment.available(&streams([4, 4, 4, 1])), 1);
        assert_eq!(segment.available(&streams([4, 4, 3, 9])), 1);
    }

    #[test]
    fn running_records_alternate_between_halves_of_the_streams() {
        let segment = Segment::new(Striping::Running, 2, 10, 4);
        assert_eq!(segment.available(&streams([1, 1, 0, 0])), 1);
        assert_eq!(segment.available(&streams([2, 2, 1, 1])), 3);
        assert_eq!(segment.available(&streams([2, 1, 1, 1])), 2);
    }

    #[test]
    fn tlast_must_come_with_the_last_beat_of_each_stream() {
        let mut all = streams([2, 2, 2, 1]);
        let segment = Segment::new(Striping::ByRecord, 7, 1, 4);
        let missing = PacketError { code: ErrorCode::TlastMissing, channel: 0, beat: 1 };
        assert_eq!(segment.check(1, &all), Err(missing));
        for stream in &mut all {
            stream.mark_last();
        }
        assert_eq!(segment.check(1, &all), Ok(()));
        let longer = Segment::new(Striping::ByRecord, 7, 2, 4);
        let early = PacketError { code: ErrorCode::TlastEarly, channel: 0, beat: 1 };
        assert_eq!(longer.check(1, &all), Err(early));
    }
}
