//! The operations on lanes, and their form without instructions of one processor.

#![allow(
    clippy::should_implement_trait,
    reason = "the operators of `F32s` are made of these functions of registers"
)]

use std::fmt::Debug;

use super::{LANES, each};

/// Four numbers in memory.
pub type Quad = [f32; 4];

/// Code that computes with lanes.
pub trait Work {
    /// The result.
    type Output;

    /// Does the work. The implementation is `#[inline(always)]`.
    fn run(self, instructions: impl Instructions) -> Self::Output;
}

/// Proof that the processor has a set of instructions, and the operations by them.
pub trait Instructions: Copy + Debug {
    /// Whether [`F32s`](super::F32s) rounds all results of arithmetic to binary16.
    const BINARY16: bool;

    /// A number in each lane.
    type Register: bytemuck::Pod;

    /// The numbers of an array.
    #[inline(always)]
    fn load(self, numbers: &[f32; LANES]) -> Self::Register {
        bytemuck::cast(*numbers)
    }

    /// The array of the numbers.
    #[inline(always)]
    fn store(self, numbers: Self::Register) -> [f32; LANES] {
        bytemuck::cast(numbers)
    }

    /// The same number in each lane.
    #[inline(always)]
    fn splat(self, number: f32) -> Self::Register {
        self.load(&[number; LANES])
    }

    /// A function of the numbers of each lane.
    #[inline(always)]
    fn zip(
        self,
        a: Self::Register,
        b: Self::Register,
        function: impl Fn(f32, f32) -> f32,
    ) -> Self::Register {
        let (a, b) = (self.store(a), self.store(b));
        self.load(&each(|lane| function(a[lane], b[lane])))
    }

    /// One bit for each lane whose numbers satisfy a condition.
    #[inline(always)]
    fn test(
        self,
        a: Self::Register,
        b: Self::Register,
        condition: impl Fn(f32, f32) -> bool,
    ) -> u32 {
        let (a, b) = (self.store(a), self.store(b));
        let bits = each(|lane| u32::from(condition(a[lane], b[lane])) << lane);
        bits.into_iter().fold(0, |all, bit| all | bit)
    }

    /// The results of arithmetic as they are kept. A NaN is one of any bits.
    #[inline(always)]
    fn rounded(self, a: Self::Register) -> Self::Register {
        if Self::BINARY16 { self.zip(a, a, |a, _| nearest_binary16(a)) } else { a }
    }

    /// `a + b`.
    #[inline(always)]
    fn add(self, a: Self::Register, b: Self::Register) -> Self::Register {
        self.zip(a, b, |a, b| a + b)
    }

    /// `a - b`.
    #[inline(always)]
    fn sub(self, a: Self::Register, b: Self::Register) -> Self::Register {
        self.zip(a, b, |a, b| a - b)
    }

    /// `a * b`.
    #[inline(always)]
    fn mul(self, a: Self::Register, b: Self::Register) -> Self::Register {
        self.zip(a, b, |a, b| a * b)
    }

    /// `a / b`.
    #[inline(always)]
    fn div(self, a: Self::Register, b: Self::Register) -> Self::Register {
        self.zip(a, b, |a, b| a / b)
    }

    /// `if a > b { a } else { b }`.
    #[inline(always)]
    fn larger(self, a: Self::Register, b: Self::Register) -> Self::Register {
        self.zip(a, b, |a, b| if a > b { a } else { b })
    }

    /// `if a < b { a } else { b }`.
    #[inline(always)]
    fn smaller(self, a: Self::Register, b: Self::Register) -> Self::Register {
        self.zip(a, b, |a, b| if a < b { a } else { b })
    }

    /// The square root.
    #[inline(always)]
    fn sqrt(self, a: Self::Register) -> Self::Register {
        self.zip(a, a, |a, _| a.sqrt())
    }

    /// `-a`.
    #[inline(always)]
    fn neg(self, a: Self::Register) -> Self::Register {
        self.zip(a, a, |a, _| -a)
    }

    /// The absolute value.
    #[inline(always)]
    fn abs(self, a: Self::Register) -> Self::Register {
        self.zip(a, a, |a, _| a.abs())
    }

    /// One bit per lane: `a > b`.
    #[inline(always)]
    fn above(self, a: Self::Register, b: Self::Register) -> u32 {
        self.test(a, b, |a, b| a > b)
    }

    /// One bit per lane: `a == b`.
    #[inline(always)]
    #[expect(clippy::float_cmp, reason = "equality is what is asked for")]
    fn is(self, a: Self::Register, b: Self::Register) -> u32 {
        self.test(a, b, |a, b| a == b)
    }

    /// `a` in the lanes whose bits are set, and `b` elsewhere.
    #[inline(always)]
    fn select(self, bits: u32, a: Self::Register, b: Self::Register) -> Self::Register {
        let (a, b) = (self.store(a), self.store(b));
        self.load(&each(|lane| if bits >> lane & 1 != 0 { a[lane] } else { b[lane] }))
    }

    /// Exchanges rows and columns of each four lanes.
    #[inline(always)]
    fn transposed(self, rows: [Self::Register; 4]) -> [Self::Register; 4] {
        let rows = rows.map(|row| self.store(row));
        let column = |column: usize| each(|lane| rows[lane % 4][lane - lane % 4 + column]);
        [0, 1, 2, 3].map(|place| self.load(&column(place)))
    }

    /// Some quads one behind the other.
    #[inline(always)]
    fn of_quads(self, quads: [Quad; LANES / 4]) -> Self::Register {
        self.load(&bytemuck::cast(quads))
    }

    /// The numbers of one quad for each lane, by their places in it.
    #[inline(always)]
    fn columns(self, quad: impl Fn(usize) -> Quad) -> [Self::Register; 4] {
        let mut rows = [self.splat(0.0); 4];
        for (at, row) in rows.iter_mut().enumerate() {
            let mut quads = [Quad::default(); LANES / 4];
            for (part, to) in quads.iter_mut().enumerate() {
                *to = quad(4 * part + at);
            }
            *row = self.of_quads(quads);
        }
        self.transposed(rows)
    }

    /// Reads a row of two quads for each lane, by their places in it.
    ///
    /// # Safety
    ///
    /// The rows that the indices name exist from `rows` on, and no other thread writes them during
    /// the call.
    #[inline(always)]
    unsafe fn gather(self, rows: *const [Quad; 2], indices: &[u32; LANES]) -> [Self::Register; 8] {
        let row = |lane: usize| {
            // SAFETY: the caller promises that the row exists.
            let row = unsafe { rows.add(indices[lane] as usize) };
            // SAFETY: the row exists, and by the caller no other thread writes it.
            unsafe { *row }
        };
        let ([a, b, c, d], [e, f, g, h]) =
            (self.columns(|lane| row(lane)[0]), self.columns(|lane| row(lane)[1]));
        [a, b, c, d, e, f, g, h]
    }

    /// Writes a row of two quads for each lane, lane after lane.
    ///
    /// # Safety
    ///
    /// The rows that the indices name exist from `rows` on, and no other thread accesses them
    /// during the call.
    #[inline(always)]
    unsafe fn scatter(
        self,
        [a, b, c, d, e, f, g, h]: [Self::Register; 8],
        rows: *mut [Quad; 2],
        indices: &[u32; LANES],
    ) {
        let quads = |columns| self.transposed(columns).map(|row| self.store(row));
        let (first, second) = (quads([a, b, c, d]), quads([e, f, g, h]));
        for (lane, index) in indices.iter().enumerate() {
            let quad = |rows: &[[f32; LANES]; 4]| -> Quad {
                let part = lane - lane % 4;
                [0, 1, 2, 3].map(|place| rows[lane % 4][part + place])
            };
            // SAFETY: the caller promises that the row exists.
            let row = unsafe { rows.add(*index as usize) };
            // SAFETY: the row exists, and by the caller no other thread accesses it.
            unsafe { *row = [quad(&first), quad(&second)] };
        }
    }
}

/// The number of binary16 nearest to a number; a tie goes to the even one. It has no branch, so
/// that the compiler vectorises it.
#[inline(always)]
fn nearest_binary16(value: f32) -> f32 {
    const EXPONENT: u32 = 0x7F80_0000;
    /// 2^-14, the smallest normal number.
    const SMALLEST_NORMAL: u32 = 0x3880_0000;
    /// Half a step beyond the largest number.
    const TOO_LARGE: f32 = 65_520.0;
    let magnitude = value.abs();
    let binade = (magnitude.to_bits() & EXPONENT).max(SMALLEST_NORMAL);
    // A power of two at which the steps of f32 are those of binary16 at the number.
    let large = f32::from_bits(binade.wrapping_add(13 << 23));
    let near = (magnitude + large) - large;
    let near = if magnitude >= TOO_LARGE { f32::INFINITY } else { near };
    near.copysign(value)
}

/// The instructions that every processor of the target has, as the compiler finds them.
#[cfg_attr(target_arch = "aarch64", allow(dead_code, reason = "all of them have NEON"))]
#[derive(Debug, Clone, Copy)]
pub(super) struct Target<const BINARY16: bool>;

impl<const BINARY16: bool> Instructions for Target<BINARY16> {
    const BINARY16: bool = BINARY16;

    type Register = [f32; LANES];
}

/// Prefetches a value into the cache, on processors with such an instruction. The address may be
/// invalid.
#[inline(always)]
pub fn prefetch<T>(value: *const T) {
    #[cfg(target_arch = "x86_64")]
    for line in (0..size_of::<T>()).step_by(64) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let line = value.cast::<i8>().wrapping_add(line);
        // SAFETY: the instruction is of SSE and reads nothing: any address will do.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(line) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}
