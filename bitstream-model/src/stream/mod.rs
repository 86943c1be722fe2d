//! An AXI4-Stream with a FIFO of 128-bit beats: beats, TLAST, back-pressure.
//!
//! A narrower stream carries a beat in several cycles; that is the mover's and the accelerator's
//! business, here a beat is a beat.

use std::collections::VecDeque;
use std::fmt;

use crate::cast::index;
use pgs_interface::record::Beat;

/// A beat of a stream with its marks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StreamBeat {
    /// The beat.
    pub beat: Beat,
    /// TLAST.
    pub last: bool,
    /// Some of its bytes are invalid (TKEEP).
    pub partial: bool,
}

/// A FIFO of beats between a DMA channel and the accelerator.
pub(crate) struct Stream {
    ring: Box<[Beat]>,
    depth: usize,
    /// Beats taken out and put in since reset.
    taken: u64,
    put: u64,
    /// Numbers of the beats with TLAST, and of the beats with invalid bytes (TKEEP).
    lasts: VecDeque<u64>,
    partials: VecDeque<u64>,
}

/// Sum of all words.
fn sum(beats: &[Beat]) -> u32 {
    bytemuck::cast_slice(beats).iter().copied().fold(0, u32::wrapping_add)
}

impl fmt::Debug for Stream {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Stream")
            .field("beats", &self.len())
            .field("space", &self.space())
            .field("next_last", &self.next_last())
            .field("next_partial", &self.next_partial())
            .finish_non_exhaustive()
    }
}

impl Stream {
    pub(crate) fn new(depth: usize) -> Self {
        Self {
            ring: vec![Beat::default(); depth.next_power_of_two()].into(),
            depth,
            taken: 0,
            put: 0,
            lasts: VecDeque::with_capacity(64),
            partials: VecDeque::new(),
        }
    }

    pub(crate) fn clear(&mut self) {
        self.taken = 0;
        self.put = 0;
        self.lasts.clear();
        self.partials.clear();
    }

    /// Beats in the FIFO.
    pub(crate) fn len(&self) -> usize {
        index(self.put - self.taken)
    }

    pub(crate) fn space(&self) -> usize {
        self.depth - self.len()
    }

    fn slot(&self, number: u64) -> usize {
        index(number & (self.ring.len() as u64 - 1))
    }

    /// Puts beats in, for which there must be space.
    pub(crate) fn push(&mut self, beats: &[Beat]) {
        assert!(beats.len() <= self.space(), "the sender looks at the space first");
        self.copy_in(self.put, beats);
        self.put += beats.len() as u64;
    }

    /// Writes beats to the ring, from that number on.
    fn copy_in(&mut self, number: u64, beats: &[Beat]) {
        let at = self.slot(number);
        let first = beats.len().min(self.ring.len() - at);
        self.ring[at..at + first].copy_from_slice(&beats[..first]);
        self.ring[..beats.len() - first].copy_from_slice(&beats[first..]);
    }

    /// A stream whose beats are counted, and whose words are not read.
    pub(crate) fn unread() -> Self {
        Self { depth: usize::MAX, ..Self::new(1) }
    }

    /// Puts a packet of unread beats in.
    pub(crate) fn expect_packet(&mut self, beats: usize) {
        self.put += beats as u64;
        if beats > 0 {
            self.mark_last();
        }
    }

    /// Lets unread beats in and out again.
    pub(crate) fn pass(&mut self, count: usize) {
        self.put += count as u64;
        self.taken = self.put;
    }

    /// Marks the newest beat with TLAST.
    pub(crate) fn mark_last(&mut self) {
        self.lasts.push_back(self.put - 1);
    }

    /// Whether the newest beat carries TLAST.
    pub(crate) fn ends_with_last(&self) -> bool {
        self.lasts.back().is_some_and(|number| number + 1 == self.put)
    }

    /// Marks the newest beat as having invalid bytes.
    pub(crate) fn mark_partial(&mut self) {
        self.partials.push_back(self.put - 1);
    }

    /// The beat `ahead` places behind the front; the FIFO must hold the beat itself.
    #[inline]
    pub(crate) fn peek(&self, ahead: usize) -> Beat {
        debug_assert!(ahead < self.len(), "the receiver looks at the length first");
        self.ring[self.slot(self.taken + ahead as u64)]
    }

    /// The next `beats` beats with their marks; the FIFO must hold the beats themselves.
    pub(crate) fn marked_beats(&self, beats: usize) -> Vec<StreamBeat> {
        let mut marked: Vec<StreamBeat> = (0..beats)
            .map(|ahead| StreamBeat { beat: self.peek(ahead), last: false, partial: false })
            .collect();
        let ahead = |number: &u64| index(number - self.taken);
        for last in self.lasts.iter().map(ahead).filter(|ahead| *ahead < beats) {
            marked[last].last = true;
        }
        for partial in self.partials.iter().map(ahead).filter(|ahead| *ahead < beats) {
            marked[partial].partial = true;
        }
        marked
    }

    /// How far behind the front the next TLAST is.
    pub(crate) fn next_last(&self) -> Option<usize> {
        self.lasts.front().map(|number| index(number - self.taken))
    }

    /// How far behind the front the next beat with invalid bytes is.
    pub(crate) fn next_partial(&self) -> Option<usize> {
        self.partials.front().map(|number| index(number - self.taken))
    }

    /// Takes `beats` beats out, with their marks, and returns the sum of their words.
    pub(crate) fn take_sum(&mut self, beats: usize) -> u32 {
        assert!(beats <= self.len(), "the receiver looks at the length first");
        let at = self.slot(self.taken);
        let first = beats.min(self.ring.len() - at);
        let taken = sum(&self.ring[at..at + first]).wrapping_add(sum(&self.ring[..beats - first]));
        self.pop(beats);
        taken
    }

    /// Takes `beats` beats out, with their marks.
    pub(crate) fn pop(&mut self, beats: usize) {
        assert!(beats <= self.len(), "the receiver looks at the length first");
        self.taken += beats as u64;
        for marks in [&mut self.lasts, &mut self.partials] {
            while marks.front().is_some_and(|number| *number < self.taken) {
                marks.pop_front();
            }
        }
    }

    /// Copies the front beats out and takes them.
    pub(crate) fn pop_into(&mut self, to: &mut [Beat]) {
        let at = self.slot(self.taken);
        let first = to.len().min(self.ring.len() - at);
        let (head, tail) = to.split_at_mut(first);
        head.copy_from_slice(&self.ring[at..at + first]);
        tail.copy_from_slice(&self.ring[..tail.len()]);
        self.pop(to.len());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beat(number: u32) -> Beat {
        Beat([number; 4])
    }

    #[test]
    fn beats_leave_in_the_order_they_came_across_the_ring_end() {
        let mut stream = Stream::new(6);
        let mut next_in = 0;
        let mut next_out = 0;
        for round in 0..50_usize {
            let n = stream.space().min((round % 5) + 1);
            let beats: Vec<_> = (next_in..).take(n).map(beat).collect();
            next_in += u32::try_from(n).expect("at most 5");
            stream.push(&beats);
            let mut out = vec![Beat::default(); stream.len().min(3)];
            stream.pop_into(&mut out);
            for got in out {
                assert_eq!(got, beat(next_out));
                next_out += 1;
            }
        }
        assert!(next_out > 60);
    }

    #[test]
    fn tlast_travels_with_its_beat() {
        let mut stream = Stream::new(8);
        stream.push(&[beat(0), beat(1)]);
        stream.mark_last();
        stream.push(&[beat(2)]);
        assert_eq!(stream.next_last(), Some(1));
        assert_eq!(stream.take_sum(1), 0);
        assert_eq!(stream.next_last(), Some(0));
        assert_eq!(stream.take_sum(1), 4);
        assert_eq!(stream.next_last(), None);
        assert_eq!(stream.peek(0), beat(2));
        assert_eq!(stream.space(), 7);
    }

    #[test]
    fn the_debug_form_is_short() {
        let text = format!("{:?}", Stream::new(512));
        assert_eq!(
            text,
            "Stream { beats: 0, space: 512, next_last: None, next_partial: None, .. }"
        );
    }
}
