//! The place of a difference between hardware and model, and its words.

use std::fmt;
use std::path::PathBuf;

use super::StreamBeat;
use crate::config::BoardConfig;
use pgs_interface::control::{REGISTERS, SHAPE_TABLE};
use pgs_interface::record::result;
use pgs_interface::stripe::IMPULSES_STREAM;

/// The first difference between the hardware and the model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// The place.
    pub place: DifferencePlace,
    /// Clock cycles from the last start or reset to it, without the clocks of register accesses.
    pub cycle: u64,
    /// The model's value.
    pub model: u32,
    /// The hardware's value.
    pub hardware: u32,
    /// The waveform of the cycles before it.
    pub waveform: Option<PathBuf>,
    /// The reason for a missing waveform.
    pub no_waveform: Option<String>,
}

/// A place at which hardware and model can differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum DifferencePlace {
    /// A word of a result record.
    Word {
        /// The body.
        record: usize,
        /// The row of its record.
        row: usize,
        /// The word of the row, 0 to 3.
        word: usize,
    },
    /// A word of the impulses that go out in front of the results.
    Impulse {
        /// The beat, from 0: one for each collision after the last pass of each kind.
        beat: usize,
        /// The word of the beat, 0 to 3.
        word: usize,
    },
    /// TLAST in the middle of the impulses; the values are 0 and 1.
    ImpulseLast {
        /// The beat.
        beat: usize,
    },
    /// TLAST of a row of a result record; the values are 0 and 1.
    Last {
        /// The body.
        record: usize,
        /// The row of its record.
        row: usize,
    },
    /// The number of beats that the step sent.
    Beats {
        /// The stream.
        stream: usize,
    },
    /// A register.
    Register {
        /// Its offset in the control block.
        offset: u32,
    },
    /// The end of the step: one has ended, and the other has not. The values are 1 for one that is
    /// busy.
    End,
}

impl fmt::Display for DifferencePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let row_name = |row: usize| match row {
            result::POSITION => "position",
            result::ORIENTATION => "orientation",
            result::LINEAR => "linear velocity",
            _ => "angular velocity",
        };
        match *self {
            Self::Word { record, row, word } => {
                write!(f, "results, record {record}, {}, word {word}", row_name(row))
            }
            Self::Impulse { beat, word } => write!(f, "impulses, beat {beat}, word {word}"),
            Self::ImpulseLast { beat } => write!(f, "impulses, beat {beat}, TLAST"),
            Self::Last { record, row } => {
                write!(f, "results, record {record}, {}, TLAST", row_name(row))
            }
            Self::Beats { stream } => write!(f, "results, beats on stream {stream}"),
            Self::Register { offset } => {
                match REGISTERS.iter().find(|register| register.offset == offset) {
                    Some(register) => write!(f, "register {}", register.name),
                    None if offset >= SHAPE_TABLE => {
                        write!(f, "shape table, offset {offset:#x}")
                    }
                    None => write!(f, "register at {offset:#x}"),
                }
            }
            Self::End => write!(f, "the end of the step (busy)"),
        }
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { place, cycle, model, hardware, waveform, no_waveform } = self;
        write!(f, "{place}: the model has {model:#010x}")?;
        let number =
            matches!(place, DifferencePlace::Word { .. } | DifferencePlace::Impulse { .. });
        let float = |bits: u32| f32::from_bits(bits);
        if number {
            write!(f, " ({:e})", float(*model))?;
        }
        write!(f, ", the hardware {hardware:#010x}")?;
        if number {
            write!(f, " ({:e})", float(*hardware))?;
        }
        write!(f, ", {cycle} cycles after the last start or reset")?;
        match (waveform, no_waveform) {
            (Some(path), _) => write!(f, "; waveform: {}", path.display()),
            (None, Some(reason)) => write!(f, "; no waveform: {reason}"),
            (None, None) => Ok(()),
        }
    }
}

/// Whether two words are the same number: a NaN equals every other NaN.
#[must_use]
pub fn same_number(a: u32, b: u32) -> bool {
    a == b || (f32::from_bits(a).is_nan() && f32::from_bits(b).is_nan())
}

/// The first word in which two beats differ, and its values.
fn first_word(model: &StreamBeat, hardware: &StreamBeat) -> Option<(usize, [u32; 2])> {
    let words = model.beat.0.into_iter().zip(hardware.beat.0).enumerate();
    words.map(|(word, (m, h))| (word, [m, h])).find(|(_, [m, h])| !same_number(*m, *h))
}

/// The beats that a step sends.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sent {
    /// Beats of impulses in front of the results, on their stream.
    pub(super) impulses: usize,
}

/// The first difference between the beats number `at` of a stream out.
pub(super) fn first_difference(
    config: &BoardConfig,
    sent: &Sent,
    (stream, at): (usize, usize),
    model: &StreamBeat,
    hardware: &StreamBeat,
) -> Option<(DifferencePlace, [u32; 2])> {
    let impulses = if stream == IMPULSES_STREAM { sent.impulses } else { 0 };
    let lasts = [model.last, hardware.last].map(u32::from);
    let Some(result) = at.checked_sub(impulses) else {
        let word = first_word(model, hardware);
        let differs =
            word.map(|(word, values)| (DifferencePlace::Impulse { beat: at, word }, values));
        return differs.or_else(|| {
            (lasts[0] != lasts[1]).then_some((DifferencePlace::ImpulseLast { beat: at }, lasts))
        });
    };
    let streams = config.profile.stripes.results.streams;
    let turn = streams.iter().position(|of| usize::from(*of) == stream).unwrap_or(0);
    let beat = result * streams.len() + turn;
    let (record, row) = (beat / result::ROWS, beat % result::ROWS);
    if let Some((word, values)) = first_word(model, hardware) {
        return Some((DifferencePlace::Word { record, row, word }, values));
    }
    (lasts[0] != lasts[1]).then_some((DifferencePlace::Last { record, row }, lasts))
}
