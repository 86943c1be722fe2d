//! This file makes beats of records and records of beats, in each format that a stream may have.

use bitstream_model::interface::record::Beat;
use bytemuck::Pod;

use crate::platform::{Lanes, Vectors};
use crate::record::sixteen::{Row, Sixteen};
use crate::record::{Record, Words};

/// Records on their way.
///
/// `some` is a part of the loop that asks: an `#[inline(always)]` belongs to every implementation.
pub(super) trait Records<const ROWS: usize> {
    /// How many there are.
    fn len(&self) -> usize;

    /// The rows of the `nth` so many of them, of which there are as many ([`Self::len`]). Each is asked for
    /// once, in their order.
    ///
    /// One is done with before the next is begun: more than one in f32 are in want of registers.
    fn some<F: Format, V: Vectors, const N: usize>(
        &mut self,
        vectors: V,
        nth: usize,
    ) -> Option<[[F::Row; ROWS]; N]>;
}

/// What rows become in a stream.
pub(super) trait Format {
    /// Rows of a beat.
    const PER_BEAT: usize;

    type Row: Pod;

    /// The beat of the first of these rows, of which there are as many as it takes. An
    /// `#[inline(always)]` belongs to every implementation.
    fn beat(rows: &[Self::Row]) -> Beat;

    /// The rows of a record. Likewise.
    fn rows<V: Vectors, const ROWS: usize>(
        vectors: V,
        record: Record<ROWS>,
        words: &Words<ROWS>,
    ) -> [Self::Row; ROWS];

    /// The rows that these beats hold, in f32. Likewise.
    fn wide<V: Vectors, const ROWS: usize>(vectors: V, beats: &[Beat]) -> [Lanes; ROWS];
}

/// Words of f32.
pub(super) struct Whole;

impl Format for Whole {
    const PER_BEAT: usize = 1;

    type Row = Beat;

    #[inline(always)]
    fn beat(rows: &[Beat]) -> Beat {
        rows[0]
    }

    #[inline(always)]
    fn rows<V: Vectors, const ROWS: usize>(
        _: V,
        record: Record<ROWS>,
        words: &Words<ROWS>,
    ) -> [Beat; ROWS] {
        let mut rows = [Beat::default(); ROWS];
        for (to, row) in rows.iter_mut().zip(record.whole(words)) {
            *to = row.into();
        }
        rows
    }

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
pub(super) struct Binary16;

/// Words of the thesis' sixteen bits.
pub(super) struct Thesis16;

/// A format of two rows a beat.
macro_rules! sixteen {
    ($format:ident) => {
        impl Format for $format {
            const PER_BEAT: usize = 2;

            type Row = Row;

            #[inline(always)]
            fn beat(rows: &[Row]) -> Beat {
                bytemuck::cast([rows[0], rows[1]])
            }

            #[inline(always)]
            fn rows<V: Vectors, const ROWS: usize>(
                vectors: V,
                record: Record<ROWS>,
                words: &Words<ROWS>,
            ) -> [Row; ROWS] {
                Sixteen::$format.narrow(vectors, record, words)
            }

            #[inline(always)]
            fn wide<V: Vectors, const ROWS: usize>(vectors: V, beats: &[Beat]) -> [Lanes; ROWS] {
                let mut rows = [Lanes::all(0); ROWS];
                for (to, beat) in rows.as_chunks_mut::<2>().0.iter_mut().zip(beats) {
                    *to = Sixteen::$format.widen(vectors, bytemuck::cast(*beat));
                }
                rows
            }
        }
    };
}
sixteen!(Binary16);
sixteen!(Thesis16);
