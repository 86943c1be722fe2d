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
                check(instructions, numbers, other);
            }
        }
    }
}

#[expect(clippy::float_cmp, reason = "that is what is compared")]
#[inline(always)]
fn check(instructions: impl Instructions, numbers: [f32; LANES], other: f32) {
    let name = format!("{instructions:?}");
    let (a, b) = (F32s::from_array(instructions, &numbers), F32s::splat(instructions, other));
    assert_eq!(a.to_array().map(bits), numbers.map(bits));
    let results: [(F32s<_>, OfTwo<f32>); 11] = [
        (a + b, |a, b| a + b),
        (a - b, |a, b| a - b),
        (a * b, |a, b| a * b),
        (a / b, |a, b| a / b),
        (-a, |a, _| -a),
        (a.sqrt(), |a, _| a.sqrt()),
        (a.abs(), |a, _| a.abs()),
        (a.or(a.above(b), b), |a, b| if a > b { a } else { b }),
        (a.larger(b), |a, b| if a > b { a } else { b }),
        (a.smaller(b), |a, b| if a < b { a } else { b }),
        (b.larger(a), |a, b| if b > a { b } else { a }),
    ];
    let masks: [(u32, OfTwo<bool>); 2] = [(a.above(b), |a, b| a > b), (a.is(b), |a, b| a == b)];
    for (lane, number) in numbers.into_iter().enumerate() {
        for (operation, (found, expected)) in results.iter().enumerate() {
            let (found, expected) = (found.to_array()[lane], expected(number, other));
            let case = format!("{name}: {operation} of {number} and {other}");
            assert_eq!(bits(found), bits(expected), "{case}");
        }
        for (operation, (found, expected)) in masks.iter().enumerate() {
            let (found, expected) = (found >> lane & 1 != 0, expected(number, other));
            assert_eq!(found, expected, "{name}: mask {operation} of {number} and {other}");
        }
    }
    for (mask, _) in masks {
        assert_eq!(mask & !ALL, 0);
    }
}

#[test]
fn every_lane_computes_what_a_number_alone_does() {
    for set in InstructionSet::all() {
        set.run(Operations);
    }
}

/// Tests roundings of all f32 whose low mantissa bits decide them, in every binade.
struct Roundings;

impl Work for Roundings {
    type Output = ();

    #[inline(always)]
    fn run(self, instructions: impl Instructions) {
        const TAILS: [u32; 8] = [0, 1, 0xFFF, 0x1000, 0x1001, 0x1FFF, 0x0800, 0x1800];
        let (zero, one) = (F32s::splat(instructions, -0.0), F32s::splat(instructions, 1.0));
        for high in 0..1_u32 << 19 {
            let numbers = each(|lane| f32::from_bits((high << 13) | TAILS[lane % TAILS.len()]));
            let expected = numbers.map(|number| bits(half::f16::from_f32(number).to_f32()));
            let same = F32s::from_array(instructions, &numbers);
            for kept in [same + zero, same - -zero, same * one, same / one] {
                assert_eq!(kept.to_array().map(bits), expected, "{instructions:?}: {numbers:?}");
            }
            let root = numbers.map(|number| bits(half::f16::from_f32(number.sqrt()).to_f32()));
            assert_eq!(same.sqrt().to_array().map(bits), root, "{instructions:?}: {numbers:?}");
        }
        let third = F32s::splat(instructions, 1.0 / 3.0).to_array().map(bits);
        let expected = bits(half::f16::from_f32(1.0 / 3.0).to_f32());
        assert_eq!(third, [expected; LANES], "{instructions:?}");
    }
}

#[test]
fn results_of_arithmetic_are_rounded_to_binary16_if_asked_for() {
    for set in InstructionSet::all() {
        set.in_binary16(true).run(Roundings);
    }
}

struct Selections;

#[expect(clippy::float_cmp, reason = "the numbers are only moved")]
impl Work for Selections {
    type Output = ();

    #[inline(always)]
    fn run(self, instructions: impl Instructions) {
        let (ones, twos) = (F32s::splat(instructions, 1.0), F32s::splat(instructions, 2.0));
        for bits in 0..=ALL {
            let expected = each(|lane| if bits >> lane & 1 == 0 { 2.0 } else { 1.0 });
            assert_eq!(ones.or(bits, twos).to_array(), expected, "{instructions:?}");
        }
    }
}

#[test]
fn lanes_are_selected_by_any_bits() {
    for set in InstructionSet::all() {
        set.run(Selections);
    }
}

struct Columns;

#[expect(clippy::float_cmp, reason = "the numbers are only moved")]
#[allow(unsafe_code, reason = "rows are named by indices")]
impl Work for Columns {
    type Output = ();

    #[inline(always)]
    fn run(self, instructions: impl Instructions) {
        let number = |row: usize, place: usize| (100 * row + place) as f32;
        let quad = |row: usize| [0, 1, 2, 3].map(|place| number(row, place));
        for (place, column) in F32s::columns(instructions, quad).into_iter().enumerate() {
            assert_eq!(column.to_array(), each(|lane| number(lane, place)), "{instructions:?}");
        }
        let row = |row: usize| [quad(row), quad(row).map(|number| number + 4.0)];
        let from: Vec<_> = (0..32).map(row).collect();
        let indices = each(|lane| [0, 9, 4, 7, 8, 1, 11, 2, 23, 24, 25, 3, 19, 18, 17, 30][lane]);
        // SAFETY: there are more rows than the largest index, and they are this thread's.
        let columns = unsafe { F32s::gather(instructions, from.as_ptr(), &indices) };
        for (place, column) in columns.into_iter().enumerate() {
            let expected = each(|lane| number(indices[lane] as usize, place));
            assert_eq!(column.to_array(), expected, "{instructions:?}");
        }
        let mut to = vec![[[0.0; 4]; 2]; from.len()];
        // SAFETY: there are more rows than the largest index, and they are this thread's.
        unsafe { F32s::scatter(columns, to.as_mut_ptr(), &indices) };
        for (at, (found, from)) in to.iter().zip(&from).enumerate() {
            let named = indices.iter().any(|index| *index as usize == at);
            assert_eq!(*found, if named { *from } else { [[0.0; 4]; 2] }, "{instructions:?}");
        }
    }
}

#[test]
fn rows_become_columns_and_columns_become_rows() {
    for set in InstructionSet::all() {
        set.run(Columns);
    }
}
