//! Numbers of a precision as bits.

use pgs_interface::number::Precision;
use rustc_apfloat::ieee::{Half, Single};
use rustc_apfloat::{Float as _, FloatConvert as _};

/// Bits of a number.
#[must_use]
pub fn width(precision: Precision) -> u32 {
    match precision {
        Precision::F32 => 32,
        Precision::Binary16 => 16,
    }
}

/// The bits of the number nearest to `value`; of two, the even one.
#[must_use]
pub fn bits(precision: Precision, value: f32) -> u32 {
    match precision {
        Precision::F32 => value.to_bits(),
        Precision::Binary16 => {
            let single = Single::from_bits(value.to_bits().into());
            let half: Half = single.convert(&mut false).value;
            (half.to_bits() & 0xFFFF) as u32
        }
    }
}
