//! Tests every operation against the same one on a number alone, with all instructions that the
//! processor has.

use super::*;

const SAMPLES: [f32; 11] = [
    0.0,
    -0.0,
    1.0,
    -1.5,
    0.1,
    1e-40,
    -3e38,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
    16_777_216.0,
];

/// The bits of a number; the same bits for every NaN, since its sign differs between processors.
fn bits(number: f32) -> u32 {
    if number.is_nan() { f32::NAN.to_bits() } else { number.to_bits() }
}

type OfTwo<R> = fn(f32, f32) -> R;

/// Tests every operation on every two samples, in every lane.
struct Operations;

impl Work for Operations {
    type Output = ();

    #[inline(always)]
    fn run(self, instructions: impl Instructions) {
        for shift in 0..SAMPLES.len() {
            for other in SAMPLES {
                let numbers = each(|lane| SAMPLES[(lane + shift) % SAMPLES.len()]);
                check(&format!("{instructions:?}"), numbers, other);
            }
        }
    }
}

#[expect(clippy::float_cmp, reason = "that is what is compared")]
#[inline(always)]
fn check(name: &str, numbers: [f32; LANES], other: f32) {
    let (a, b) = (F32x16::from_array(numbers), F32x16::splat(other));
    assert_eq!(a.to_array().map(bits), numbers.map(bits));
    let results: [(F32x16, OfTwo<f32>); 13] = [
        (a + b, |a, b| a + b),
        (a - b, |a, b| a - b),
        (a * b, |a, b| a * b),
        (a / b, |a, b| a / b),
        (-a, |a, _| -a),
        (a.sqrt(), |a, _| a.sqrt()),
        (a.abs(), |a, _| a.abs()),
        (a.with_sign(b), f32::copysign),
        (a.or(a.above(b), b), |a, b| if a > b { a } else { b }),
        (a.larger(b), |a, b| if a > b { a } else { b }),
        (a.smaller(b), |a, b| if a < b { a } else { b }),
        (b.larger(a), |a, b| if b > a { b } else { a }),
        (a.with_words(b), |a, b| f32::from_bits(a.to_bits().wrapping_add(b.to_bits()))),
    ];
    let masks: [(Mask, OfTwo<bool>); 6] = [
        (a.above(b), |a, b| a > b),
        (a.at_least(b), |a, b| a >= b),
        (a.is(b), |a, b| a == b),
        (a.above(b).either(a.is(b)), |a, b| a >= b),
        (a.at_least(b).and(b.at_least(a)), |a, b| a == b),
        (a.at_least(b).without(a.is(b)), |a, b| a > b),
    ];
    for (lane, number) in numbers.into_iter().enumerate() {
        for (operation, (found, expected)) in results.iter().enumerate() {
            let (found, expected) = (found.to_array()[lane], expected(number, other));
            let case = format!("{name}: {operation} of {number} and {other}");
            assert_eq!(bits(found), bits(expected), "{case}");
        }
        for (operation, (found, expected)) in masks.iter().enumerate() {
            let (found, expected) = (found.bits() >> lane & 1 != 0, expected(number, other));
            assert_eq!(found, expected, "{name}: mask {operation} of {number} and {other}");
        }
    }
    for (mask, _) in masks {
        let bits = mask.bits();
        assert_eq!(bits >> LANES, 0);
        assert_eq!((mask.any(), mask.all()), (bits != 0, bits == (1 << LANES) - 1), "{name}");
    }
}

#[test]
fn every_lane_computes_what_a_number_alone_does() {
    for set in InstructionSet::all() {
        set.run(Operations);
    }
}

struct Masks;

impl Work for Masks {
    type Output = ();

    #[inline(always)]
    fn run(self, instructions: impl Instructions) {
        for bits in 0..1 << LANES {
            assert_eq!(Mask::from_bits(bits).bits(), bits, "{instructions:?}");
        }
        assert!(!Mask::none().any());
    }
}

#[test]
fn masks_are_made_of_any_bits() {
    for set in InstructionSet::all() {
        set.run(Masks);
    }
}

struct Columns;

#[expect(clippy::float_cmp, reason = "the numbers are only moved")]
impl Work for Columns {
    type Output = ();

    #[inline(always)]
    fn run(self, instructions: impl Instructions) {
        let number = |lane: usize, place: usize| (100 * lane + place) as f32;
        let quads = each(|lane| [0, 1, 2, 3].map(|place| number(lane, place)));
        let columns = instructions.columns(quads);
        for (place, column) in columns.into_iter().enumerate() {
            assert_eq!(column.to_array(), each(|lane| number(lane, place)), "{instructions:?}");
        }
        assert_eq!(instructions.quads(columns), quads, "{instructions:?}");

        let mut apart = [[-1.0; 4]; 3 * LANES - 2];
        instructions.store(columns, &mut apart, 3);
        for (at, quad) in apart.iter().enumerate() {
            let expected = if at % 3 == 0 { quads[at / 3] } else { [-1.0; 4] };
            assert_eq!(*quad, expected, "{instructions:?}");
        }
        let loaded = instructions.load(&apart, 3);
        assert_eq!(instructions.quads(loaded), quads, "{instructions:?}");
    }
}

#[test]
fn quads_become_columns_and_columns_become_quads() {
    for set in InstructionSet::all() {
        set.run(Columns);
    }
}

/// Rounds to binary16 in all lanes, and compares the bits with the bits of [`halves::nearest`].
struct Halves<'a>(&'a [u32]);

impl Work for Halves<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self, instructions: impl Instructions) {
        for words in self.0.chunks(LANES) {
            let numbers = each(|lane| f32::from_bits(words[lane % words.len()]));
            let found = instructions.round_to_halves(F32x16::from_array(numbers)).to_array();
            for (found, number) in found.into_iter().zip(numbers) {
                let (found, expected) = (found.to_bits(), halves::nearest(number).to_bits());
                let number = number.to_bits();
                assert_eq!(found, expected, "{instructions:?}: {number:#010x}");
            }
        }
    }
}

#[test]
fn every_number_is_rounded_to_the_same_half() {
    // Sign, exponent and ten bits of the mantissa say where a number lies between two numbers of
    // binary16 or on one of them; the tails are the lower number, the middle, and their neighbours.
    const TAILS: [u32; 7] = [0, 1, 0x0FFF, 0x1000, 0x1001, 0x1FFE, 0x1FFF];
    // Miri interprets, and takes a few.
    let step = if cfg!(miri) { 4_001 } else { 1 };
    let heads = (0..1_u32 << 19).step_by(step);
    let mut words: Vec<u32> = heads.flat_map(|head| TAILS.map(|tail| head << 13 | tail)).collect();
    // Below 2^-14 the numbers of binary16 are multiples of 2^-24, and the middles are odd
    // multiples of 2^-25.
    for multiple in (0..=1_u32 << 11).step_by(step) {
        let middle = (multiple as f32 * f32::from_bits((127 - 25) << 23)).to_bits();
        let near = [middle.saturating_sub(1), middle, middle + 1];
        words.extend(near.iter().flat_map(|word| [*word, word | 0x8000_0000]));
    }
    // Words without an order: the multiplier is odd, so that none comes twice.
    let scattered = |at: u32| at.wrapping_mul(0x9E37_79B1).rotate_left(9);
    words.extend((0..1 << 20).step_by(step).map(scattered));
    for set in InstructionSet::all() {
        set.run(Halves(&words));
    }
}
