//! This folder turns a caller's values into the rows of a record, and a result record back.
//!
//! One file a record kind makes rows of 32-bit words, each of which is a beat of an f32 stream;
//! `sixteen` narrows rows for the streams of sixteen bits and widens what comes back. The layout is
//! that of [`interface::record`](crate::interface::record); which channel a beat travels on is
//! decided elsewhere (`beat`).

pub(crate) mod collision;
pub(crate) mod end;
pub(crate) mod inertia;
pub(crate) mod pose;
pub(crate) mod relative;
pub(crate) mod result;
pub(crate) mod sixteen;
mod thesis16;
pub(crate) mod velocity;

use crate::interface::record::{Beat, WORD_LANE};

/// A vec3 and the word beside it.
fn vec3_and_word([x, y, z]: [f32; 3], word: u32) -> Beat {
    Beat([x.to_bits(), y.to_bits(), z.to_bits(), word])
}

/// Four numbers, one a lane.
fn vec4(value: [f32; 4]) -> Beat {
    Beat(value.map(f32::to_bits))
}

/// The vec3 of a beat, whatever the word beside it.
fn to_vec3(Beat([x, y, z, _]): Beat) -> [f32; 3] {
    [f32::from_bits(x), f32::from_bits(y), f32::from_bits(z)]
}

/// The four numbers of a beat.
fn to_vec4(beat: Beat) -> [f32; 4] {
    beat.0.map(f32::from_bits)
}

// `vec3_and_word` and `to_vec3` spell the lanes out.
const _: () = assert!(WORD_LANE == 3);
