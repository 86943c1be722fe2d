//! Joins the rows of records into beats, and splits beats into rows, in each format of a stream.

use std::marker::PhantomData;

use pgs_interface::number::StreamFormat;
use pgs_interface::record::Beat;
use pgs_support::chunks::Chunks;

use crate::record::body_table::{Ends, Lookup, LowEnds};
use crate::record::sixteen;
use crate::record::{Row, Rows};
use crate::simd::{Lanes, Vectors};

/// Records that are made on demand.
///
/// `some` becomes a part of the calling loop: every implementation carries `#[inline(always)]`. A
/// loop works on its own copy of the value. No pointer leads to the copy, so it stays in registers.
/// The copy also collects the checks of the records: the loop must write it back.
pub(crate) trait Records<const ROWS: usize>: Copy {
    /// The number of records.
    fn len(&self) -> usize;

    /// Gives the rows of the `nth` chunk of `N` records to `to`, `ROWS` rows a record, in order.
    /// `None` if the chunk is incomplete. The caller requests each record once, in order.
    ///
    /// The rows of a record become beats before the next record starts: two f32 records at once
    /// need too many registers.
    fn some<const N: usize>(&mut self, nth: usize, to: &mut impl Rows) -> Option<()>;
}

/// How rows become beats.
pub(crate) trait Join {
    /// Rows of a beat.
    const PER_BEAT: usize;

    /// The beat of the first `PER_BEAT` of these rows. Every implementation carries
    /// `#[inline(always)]`.
    fn beat<V: Vectors>(vectors: V, rows: [Row; 2]) -> Beat;
}

/// The format of a stream's words.
pub(crate) trait Format: Join {
    /// The format of the words.
    const WORDS: StreamFormat;

    /// The table for look-ups of the bodies whose indices the stream carries.
    type Among<'a>: Lookup<'a>;

    /// The rows of these beats, as f32. Every implementation carries `#[inline(always)]`.
    fn wide<V: Vectors, const ROWS: usize>(vectors: V, beats: &[Beat]) -> [Lanes; ROWS];
}

/// Joins rows into beats.
///
/// The compiler inlines all of it into the loop that gives the rows: no row goes through memory.
pub(crate) struct Beats<V, F> {
    vectors: V,
    format: PhantomData<F>,
    /// The first row of a beat that waits for its second row.
    waiting: Row,
    half: bool,
}

impl<V: Vectors, F: Join> Beats<V, F> {
    #[inline(always)]
    pub(crate) fn new(vectors: V) -> Self {
        Self { vectors, format: PhantomData, waiting: Row::zero(), half: false }
    }

    /// Adds a row; the beat that it completes.
    #[inline(always)]
    pub(crate) fn with(&mut self, row: Row) -> Option<Beat> {
        const { assert!(F::PER_BEAT <= 2, "one waits at most") };
        if const { F::PER_BEAT == 1 } {
            return Some(F::beat(self.vectors, [row, Row::zero()]));
        }
        self.half = !self.half;
        if self.half {
            self.waiting = row;
            return None;
        }
        Some(F::beat(self.vectors, [self.waiting, row]))
    }

    /// The last beat, if it is half full. Zeros fill its other half.
    #[inline(always)]
    pub(crate) fn last(self) -> Option<Beat> {
        self.half.then(|| F::beat(self.vectors, [self.waiting, Row::zero()]))
    }
}

/// Does `$work` for the format of a stream's words, which is the type `$name` in `$work`.
macro_rules! in_format {
    ($format:expr, $name:ident => $work:expr) => {
        // A loop for each format, so that no loop tests the format.
        match $format {
            pgs_interface::number::StreamFormat::F32 => {
                type $name = $crate::beat::format::Whole;
                $work
            }
            pgs_interface::number::StreamFormat::Binary16 => {
                type $name = $crate::beat::format::Binary16;
                $work
            }
        }
    };
}
pub(crate) use in_format;

/// Words of f32.
pub(crate) struct Whole;

impl Join for Whole {
    const PER_BEAT: usize = 1;

    #[inline(always)]
    fn beat<V: Vectors>(_: V, [row, _]: [Row; 2]) -> Beat {
        row.whole().into()
    }
}

impl Format for Whole {
    const WORDS: StreamFormat = StreamFormat::F32;

    type Among<'a> = Ends<'a>;

    #[inline(always)]
    fn wide<V: Vectors, const ROWS: usize>(_: V, beats: &[Beat]) -> [Lanes; ROWS] {
        let mut rows = [Lanes::all(0); ROWS];
        for (to, beat) in rows.iter_mut().zip(beats) {
            *to = (*beat).into();
        }
        rows
    }
}

/// Words of binary16.
pub(crate) struct Binary16;

impl Join for Binary16 {
    const PER_BEAT: usize = 2;

    #[inline(always)]
    fn beat<V: Vectors>(vectors: V, rows: [Row; 2]) -> Beat {
        bytemuck::cast(sixteen::narrow(vectors, rows))
    }
}

impl Format for Binary16 {
    const WORDS: StreamFormat = StreamFormat::Binary16;

    type Among<'a> = LowEnds<'a>;

    #[inline(always)]
    fn wide<V: Vectors, const ROWS: usize>(vectors: V, beats: &[Beat]) -> [Lanes; ROWS] {
        let mut rows = [Lanes::all(0); ROWS];
        for (to, beat) in rows.split_arrays_mut::<2>().0.iter_mut().zip(beats) {
            *to = sixteen::widen(vectors, bytemuck::cast(*beat));
        }
        rows
    }
}
