//! The operators in Verilog against the reference in software, each with its latency.

use std::iter;

use super::simulation::{BATCH, Outputs, Simulator};
use super::vectors::Vector;
use super::{Error, reference};

/// An operator: what its output is to be, how many cycles after its operands.
#[derive(Debug)]
pub struct Operator {
    /// Name in reports.
    pub name: &'static str,
    /// Register stages.
    pub latency: usize,
    pub(super) expected: fn(&Vector) -> u64,
    pub(super) found: fn(&Outputs) -> u64,
}

/// The longest latency.
const LONGEST: usize = 29;

pub(super) fn pair(low: u32, high: u32) -> u64 {
    u64::from(high) << 32 | u64::from(low)
}

/// The operators of binary32, as in `operators_top.v`.
pub static OPERATORS: [Operator; 16] = [
    Operator {
        name: "add",
        latency: 7,
        expected: |v| reference::add(v.a, v.b).into(),
        found: |outputs| outputs[0].into(),
    },
    Operator {
        name: "mul",
        latency: 5,
        expected: |v| reference::mul(v.a, v.b).into(),
        found: |outputs| outputs[1].into(),
    },
    Operator {
        name: "div",
        latency: 29,
        expected: |v| reference::div(v.a, v.b).into(),
        found: |outputs| outputs[2].into(),
    },
    Operator {
        name: "sqrt",
        latency: 27,
        expected: |v| reference::sqrt(v.radicand).into(),
        found: |outputs| outputs[3].into(),
    },
    Operator {
        name: "sincos",
        latency: 26,
        expected: |v| {
            let (sine, cosine) = reference::sincos(v.argument);
            pair(sine, cosine)
        },
        found: |outputs| pair(outputs[4], outputs[5]),
    },
    Operator {
        name: "max",
        latency: 1,
        expected: |v| reference::max(v.a, v.b).into(),
        found: |outputs| outputs[6].into(),
    },
    Operator {
        name: "min",
        latency: 1,
        expected: |v| reference::min(v.a, v.b).into(),
        found: |outputs| outputs[7].into(),
    },
    Operator {
        name: "less",
        latency: 1,
        expected: |v| reference::less(v.a, v.b).into(),
        found: |outputs| (outputs[11] & 1).into(),
    },
    Operator {
        name: "select",
        latency: 1,
        expected: |v| if v.argument & 1 == 1 { v.a } else { v.b }.into(),
        found: |outputs| outputs[8].into(),
    },
    Operator {
        name: "nonzero",
        latency: 1,
        expected: |v| (v.argument & 1 == 1 && reference::nonzero(v.a)).into(),
        found: |outputs| (outputs[11] >> 1 & 1).into(),
    },
    Operator {
        name: "or",
        latency: 1,
        expected: |v| (v.argument & 3 != 0).into(),
        found: |outputs| (outputs[11] >> 2 & 1).into(),
    },
    Operator {
        name: "and",
        latency: 1,
        expected: |v| (v.argument & 3 == 3).into(),
        found: |outputs| (outputs[11] >> 3 & 1).into(),
    },
    Operator {
        name: "max, or a third",
        latency: 1,
        expected: |v| {
            if v.argument & 1 == 1 { reference::max(v.a, v.b) } else { v.radicand }.into()
        },
        found: |outputs| outputs[12].into(),
    },
    Operator {
        name: "min, or a third",
        latency: 1,
        expected: |v| {
            if v.argument & 1 == 1 { reference::min(v.a, v.b) } else { v.radicand }.into()
        },
        found: |outputs| outputs[13].into(),
    },
    Operator {
        name: "mul, SMALLEST_NORMAL = 0",
        latency: 5,
        expected: |v| reference::mul_unbounded(v.a, v.b).into(),
        found: |outputs| outputs[9].into(),
    },
    Operator {
        name: "div, SMALLEST_NORMAL = 0",
        latency: 29,
        expected: |v| reference::div_unbounded(v.a, v.b).into(),
        found: |outputs| outputs[10].into(),
    },
];

/// Sine and cosine alone.
#[must_use]
pub fn sincos() -> &'static [Operator] {
    &OPERATORS[4..5]
}

/// A result that is not the reference's.
#[derive(Debug, Clone, Copy)]
pub struct Wrong {
    /// The operands of all operators in that cycle.
    pub vector: Vector,
    /// The reference's result.
    pub expected: u64,
    /// The Verilog's.
    pub found: u64,
}

/// The wrong results of one operator.
#[derive(Debug)]
pub struct Tally {
    /// The operator.
    pub operator: &'static Operator,
    /// Results that are wrong.
    pub wrong: u64,
    /// The first of them.
    pub first: Option<Wrong>,
}

/// Feeds the first `count` vectors to the operators and counts the wrong results of each operator
/// in `compared`. `progress` is called with the number of vectors compared so far.
///
/// # Errors
///
/// The simulator ends early.
pub fn verify(
    simulator: &Simulator,
    compared: &'static [Operator],
    vectors: impl Iterator<Item = Vector> + Send,
    count: u64,
    mut progress: impl FnMut(u64),
) -> Result<Vec<Tally>, Error> {
    let mut tallies: Vec<Tally> =
        compared.iter().map(|operator| Tally { operator, wrong: 0, first: None }).collect();
    // More vectors push the last results out, to the end of a batch.
    let batch = BATCH as u64;
    let clocked = (count + LONGEST as u64).next_multiple_of(batch);
    let padded = vectors.chain(iter::repeat(Vector::default()));
    let operands = iter::zip(0..clocked, padded).map(|(_, vector)| vector);
    // The vectors of the batch, behind the last ones of the batch before.
    let mut recent: Vec<Vector> = Vec::new();
    let mut before: u64 = 0;
    simulator.run(operands, |batch, outputs| {
        recent.drain(..recent.len().saturating_sub(LONGEST));
        let kept = recent.len();
        recent.extend(batch);
        for tally in &mut tallies {
            let Operator { latency, expected, found, .. } = tally.operator;
            for (cycle, outputs) in outputs.iter().enumerate() {
                let now = before + cycle as u64;
                let delay = latency - 1;
                if now < delay as u64 || now - delay as u64 >= count {
                    continue;
                }
                let vector = recent[kept + cycle - delay];
                let (expected, found) = (expected(&vector), found(outputs));
                if expected != found {
                    tally.wrong += 1;
                    tally.first.get_or_insert(Wrong { vector, expected, found });
                }
            }
        }
        before += batch.len() as u64;
        progress(before.min(count));
    })?;
    Ok(tallies)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_are_alone() {
        assert_eq!(sincos().iter().map(|operator| operator.name).collect::<Vec<_>>(), ["sincos"]);
    }

    #[test]
    fn the_longest_latency_is_the_longest() {
        assert_eq!(OPERATORS.iter().map(|operator| operator.latency).max(), Some(LONGEST));
    }
}
