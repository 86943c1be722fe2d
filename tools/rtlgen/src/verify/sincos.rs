//! Sine and cosine in fixed point: the definition that `fsincos.v` computes, held against libm.
//!
//! The arguments of a step are `a * dt / 2` of a rotation limited to pi/4, hence at most pi/8: few
//! enough to compare every one of them.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::thread;

use super::reference;
pub use super::vectors::POLYNOMIAL;

/// Fraction bits of the fixed-point numbers.
const FRACTION_BITS: u32 = 48;

/// libm's coefficients times 2^48, rounded: of x^3, x^5, x^7 and x^9 over x.
const SINE: [i64; 4] = [-46_912_496_047_961, 2_345_623_694_815, -55_842_763_109, 765_136_664];

/// The same of x^2, x^4, x^6 and x^8.
const COSINE: [i64; 4] =
    [-140_737_487_581_562, 11_728_111_829_661, -390_877_651_004, 6_865_301_007];

/// Product of two fixed-point numbers, rounded half up.
#[allow(
    clippy::cast_possible_truncation,
    reason = "both numbers are below 1, and so is the product"
)]
fn product(a: i64, b: i64) -> i64 {
    let exact = i128::from(a) * i128::from(b);
    ((exact + (1 << (FRACTION_BITS - 1))) >> FRACTION_BITS) as i64
}

/// `z * (c[0] + z * (c[1] + z * (c[2] + z * c[3])))`.
fn polynomial(z: i64, coefficients: [i64; 4]) -> i64 {
    let [c0, c1, c2, c3] = coefficients;
    product(z, c0 + product(z, c1 + product(z, c2 + product(z, c3))))
}

/// The binary32 number nearest to `value * 2^exponent`, of two the even one. The result is normal.
fn nearest(value: i128, exponent: i32) -> u32 {
    let excess = 128 - 24 - value.leading_zeros();
    let half = 1 << (excess - 1);
    let odd = (value >> excess) & 1;
    let significand = (((value + half - 1 + odd) >> excess) & 0x01FF_FFFF) as u32;
    // A significand that was rounded up to 25 bits raises the exponent by itself.
    let biased = exponent + excess.cast_signed() + 23 + 127;
    ((biased.cast_unsigned() - 1) << 23) + significand
}

/// Sine and cosine of a positive argument up to pi/8, as bits.
#[must_use]
pub fn fixed_point(argument: u32) -> (u32, u32) {
    if argument < *POLYNOMIAL.start() {
        return (argument, 1.0_f32.to_bits());
    }
    let exponent = (argument >> 23).cast_signed() - 127;
    let significand = i64::from(argument & 0x007F_FFFF | 0x0080_0000);
    let shift = -2 * exponent - 2;
    let z = (significand * significand + (1 << (shift - 1))) >> shift;
    let one = 1_i64 << FRACTION_BITS;
    let sine = i128::from(significand) * i128::from(one + polynomial(z, SINE));
    let cosine = i128::from(one + polynomial(z, COSINE));
    (nearest(sine, exponent - 23 - 48), nearest(cosine, -48))
}

/// Arguments for which the fixed-point numbers and libm's differ.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Differences {
    /// Arguments compared.
    pub arguments: u64,
    /// Sines that differ.
    pub sine: u64,
    /// Cosines that differ.
    pub cosine: u64,
}

/// Compares every `step`-th argument from 2^-12 to pi/8, in as many threads as told. `progress` is
/// called with the number of arguments that have been compared since the last call.
///
/// # Panics
///
/// If `step` is 0.
pub fn compare(step: u32, threads: usize, progress: impl Fn(u64) + Sync) -> Differences {
    const SHARE: u32 = 1 << 20;
    let next = AtomicU32::new(*POLYNOMIAL.start());
    let [sines, cosines, arguments] = [const { AtomicU64::new(0) }; 3];
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let first = next.fetch_add(SHARE.next_multiple_of(step), Ordering::Relaxed);
                    if !POLYNOMIAL.contains(&first) {
                        break;
                    }
                    let last = (first + SHARE.next_multiple_of(step) - 1).min(*POLYNOMIAL.end());
                    let (mut compared, mut sine, mut cosine) = (0, 0, 0);
                    for argument in (first..=last).step_by(step as usize) {
                        let found = fixed_point(argument);
                        let expected = reference::sincos(argument);
                        compared += 1;
                        sine += u64::from(found.0 != expected.0);
                        cosine += u64::from(found.1 != expected.1);
                    }
                    arguments.fetch_add(compared, Ordering::Relaxed);
                    sines.fetch_add(sine, Ordering::Relaxed);
                    cosines.fetch_add(cosine, Ordering::Relaxed);
                    progress(compared);
                }
            });
        }
    });
    Differences {
        arguments: arguments.into_inner(),
        sine: sines.into_inner(),
        cosine: cosines.into_inner(),
    }
}

#[cfg(test)]
mod tests {
    use pgs_interface::number::Precision;

    use super::*;

    #[test]
    fn a_sample_has_libms_bits() {
        let found = compare(997, 1, |_| ());
        assert_eq!(found, Differences { arguments: 88_942, sine: 0, cosine: 0 });
    }

    #[test]
    fn the_number_of_arguments_does_not_depend_on_threads() {
        let mut reported = AtomicU64::new(0);
        let found = compare(1_009, 3, |compared| {
            reported.fetch_add(compared, Ordering::Relaxed);
        });
        assert_eq!(found, compare(1_009, 1, |_| ()));
        assert_eq!(*reported.get_mut(), found.arguments);
    }

    #[test]
    fn the_ends_of_the_range_have_libms_bits() {
        for argument in [0, 1, *POLYNOMIAL.start() - 1, *POLYNOMIAL.start(), *POLYNOMIAL.end()] {
            let value = f32::from_bits(argument);
            let expected = (libm::sinf(value).to_bits(), libm::cosf(value).to_bits());
            assert_eq!(fixed_point(argument), expected, "{argument:08x}");
        }
    }

    #[test]
    fn the_coefficients_are_libms() {
        let sine = [
            -1.666_666_664_162_652_4e-1,
            8.333_329_385_889_463e-3,
            -1.983_933_483_609_663_2e-4,
            2.718_311_493_989_822e-6,
        ];
        let cosine = [
            -4.999_999_972_510_31e-1,
            4.166_662_332_373_906e-2,
            -1.388_676_377_460_993e-3,
            2.439_044_879_627_741e-5,
        ];
        for (coefficient, fixed) in sine.into_iter().zip(SINE).chain(cosine.into_iter().zip(COSINE))
        {
            let scaled: f64 = coefficient * (1_u64 << FRACTION_BITS) as f64;
            assert!((scaled - fixed as f64).abs() <= 0.5, "{coefficient}: {fixed}");
        }
    }

    /// The Verilog has the same coefficients.
    #[test]
    fn the_verilogs_coefficients_are_these() {
        let mut sources = crate::sources::operators(Precision::F32).into_iter();
        let source = sources.find(|source| source.file == "pgs_fsincos.v");
        let text = source.map_or("", |source| source.text);
        for (letter, coefficients) in [('S', SINE), ('C', COSINE)] {
            for (index, coefficient) in (1..).zip(coefficients) {
                let sign = if coefficient < 0 { "-" } else { " " };
                let line = text.lines().find(|line| line.contains(&format!(" {letter}{index} = ")));
                let line = line.unwrap_or("no such line");
                assert!(
                    line.contains(&format!("= {sign}"))
                        && line.ends_with(&format!("'sd{};", coefficient.abs())),
                    "{coefficient}: {line}"
                );
            }
        }
    }
}
