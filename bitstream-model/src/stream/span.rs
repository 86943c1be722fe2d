//! References to beats that are still in their buffers: the beats' numbers on their stream, and where
//! they lie.

use std::collections::VecDeque;

use crate::cast::index;
use crate::memory::Source;

/// Consecutive beats, on the stream as in their buffer.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    /// The number of the first one.
    pub(crate) first: u64,
    pub(crate) count: u64,
    pub(crate) source: Source,
}

impl Span {
    pub(crate) fn end(&self) -> u64 {
        self.first + self.count
    }

    /// Where the beat of that number lies; it must be one of the span.
    pub(crate) fn at(&self, number: u64) -> Source {
        self.source.further(number - self.first)
    }
}

/// Spans in the order of their numbers, with gaps where the stream holds the beats itself.
#[derive(Debug, Default)]
pub(crate) struct Spans(VecDeque<Span>);

impl Spans {
    pub(crate) fn with_capacity(spans: usize) -> Self {
        Self(VecDeque::with_capacity(spans))
    }

    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Adds beats behind all others.
    pub(crate) fn push(&mut self, first: u64, count: u64, source: Source) {
        match self.0.back_mut() {
            Some(back) if back.end() == first && back.at(first) == source => back.count += count,
            _ => self.0.push_back(Span { first, count, source }),
        }
    }

    /// The first piece of the beats from number `first` to `end`: its length, and where it lies if it
    /// lies in a buffer.
    pub(crate) fn piece(&self, first: u64, end: u64) -> (usize, Option<Source>) {
        let place = self.0.partition_point(|span| span.end() <= first);
        let (end, source) = match self.0.get(place) {
            Some(span) if span.first <= first => (end.min(span.end()), Some(span.at(first))),
            Some(span) => (end.min(span.first), None),
            None => (end, None),
        };
        (index(end.saturating_sub(first)), source)
    }

    /// Whether `count` beats from number `first` on lie one after the other from `source` on.
    pub(crate) fn holds(&self, first: u64, count: usize, source: Source) -> bool {
        self.piece(first, first + count as u64) == (count, Some(source))
    }

    /// Forgets the beats before that number.
    pub(crate) fn drop_to(&mut self, number: u64) {
        while let Some(front) = self.0.front_mut() {
            if front.end() > number {
                if front.first < number {
                    let count = front.end() - number;
                    *front = Span { first: number, count, source: front.at(number) };
                }
                break;
            }
            self.0.pop_front();
        }
    }

    /// The first span.
    pub(crate) fn front(&self) -> Option<Span> {
        self.0.front().copied()
    }
}
