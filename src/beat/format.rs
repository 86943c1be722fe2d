//! Joins the rows of records into beats, and splits beats into rows, in each format of a stream.

use std::marker::PhantomData;

use pgs_interface::record::Beat;
use pgs_support::chunks::Chunks;

use crate::record::body_table::{Ends, Lookup, LowEnds};
use crate::record::sixteen::Sixteen;
use crate::record::{Row, Rows};
use crate::simd::{Lanes, Vectors};

/// Records on their way.
///
/// `some` is a part of the loop that asks: an `#[inline(always)]` belongs to every implementation. A loop has
/// a copy of its own, which no pointer leads to: it lies in registers. Whoever takes such a copy puts it back:
/// what was seen of the records on their way is in it.
pub(crate) trait Records<const ROWS: usize>: Copy {
    /// How many there are.
    fn len(&self) -> usize;

    /// Gives the rows of the `nth` so many of them, `ROWS` each, to `to`, one after the other; none if there
    /// are fewer. Each is asked for once, in their order.
    ///
    /// What a row becomes is made before the next record is begun: more than one in f32 are in want of
    /// registers.
    fn some<const N: usize>(&mut self, nth: usize, to: &mut impl Rows) -> Option<()>;
}

/// What beats are made of rows.
pub(crate) trait Join {
    /// Rows of a beat.
    const PER_BEAT: usize;

    /// The beat of so many rows, the first of these. An `#[inline(always)]` belongs to every implementation.
    fn beat<V: Vectors>(vectors: V, rows: [Row; 2]) -> Beat;
}

/// What rows become in a stream.
pub(crate) trait Format: Join {
    /// What its words are, if they have sixteen bits.
    const SIXTEEN: Option<Sixteen>;

    /// Where bodies are looked up whose indices are sent in it.
    type Among<'a>: Lookup<'a>;

    /// The rows that these beats hold, in f32. An `#[inline(always)]` belongs to every implementation.
    fn wide<V: Vectors, const ROWS: usize>(vectors: V, beats: &[Beat]) -> [Lanes; ROWS];
}

/// Rows of which beats are made.
///
/// All of it is a part of the loop that gives them: no row goes through memory.
pub(crate) struct Beats<V, F> {
    vectors: V,
    format: PhantomData<F>,
    /// That which fills no beat alone.
    waiting: Row,
    half: bool,
}

impl<V: Vectors, F: Join> Beats<V, F> {
    #[inline(always)]
    pub(crate) fn new(vectors: V) -> Self {
        Self { vectors, format: PhantomData, waiting: Row::zero(), half: false }
    }

    /// The beat that is full with one more.
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

    /// The last one, if it is not full; zeros are beside its row.
    #[inline(always)]
    pub(crate) fn last(self) -> Option<Beat> {
        self.half.then(|| F::beat(self.vectors, [self.waiting, Row::zero()]))
    }
}

/// Does `$work` in the format that the words of a stream have, which it knows as `$name`.
macro_rules! in_format {
    ($format:expr, $name:ident => $work:expr) => {
        // One loop each, in which nothing is asked of the format.
        match $format {
            None => {
                type $name = $crate::beat::format::Whole;
                $work
            }
            Some($crate::record::sixteen::Sixteen::Binary16) => {
                type $name = $crate::beat::format::Binary16;
                $work
            }
            Some($crate::record::sixteen::Sixteen::Thesis16) => {
                type $name = $crate::beat::format::Thesis16;
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
    const SIXTEEN: Option<Sixteen> = None;

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

/// Words of the thesis' sixteen bits.
pub(crate) struct Thesis16;

/// A format of two rows a beat.
macro_rules! sixteen {
    ($format:ident) => {
        impl Join for $format {
            const PER_BEAT: usize = 2;

            #[inline(always)]
            fn beat<V: Vectors>(vectors: V, rows: [Row; 2]) -> Beat {
                bytemuck::cast(Sixteen::$format.narrow(vectors, rows))
            }
        }

        impl Format for $format {
            const SIXTEEN: Option<Sixteen> = Some(Sixteen::$format);

            type Among<'a> = LowEnds<'a>;

            #[inline(always)]
            fn wide<V: Vectors, const ROWS: usize>(vectors: V, beats: &[Beat]) -> [Lanes; ROWS] {
                let mut rows = [Lanes::all(0); ROWS];
                for (to, beat) in rows.split_arrays_mut::<2>().0.iter_mut().zip(beats) {
                    *to = Sixteen::$format.widen(vectors, bytemuck::cast(*beat));
                }
                rows
            }
        }
    };
}
sixteen!(Binary16);
sixteen!(Thesis16);
