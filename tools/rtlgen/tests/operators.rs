//! The operators in Verilog have the reference's bits and latencies, and faults in them are found,
//! if Verilator is installed.
#![allow(clippy::print_stderr, reason = "a skipped test says so")]

use pgs_interface::number::Precision;
use rtlgen::sources::{self, Source};
use rtlgen::verify::operators::{self, Tally, verify};
use rtlgen::verify::simulation::Simulator;
use rtlgen::verify::vectors::Vectors;
use rtlgen::verify::{Error, half};

const VECTORS: u64 = 20_000;
/// Every operand of the operators of binary16 with one, and of the others each stratum 64 times.
const HALF_VECTORS: u64 = 1 << 18;

/// The wrong results by operator, or nothing if a tool is missing.
fn tallies(precision: Precision, sources: &[Source<'_>]) -> Result<Vec<Tally>, Error> {
    let simulator = match Simulator::build_from(precision, sources) {
        Err(missing @ Error::Missing { .. }) => {
            eprintln!("skipped: {missing}");
            return Ok(Vec::new());
        }
        simulator => simulator?,
    };
    match precision {
        Precision::F32 => {
            verify(&simulator, &operators::OPERATORS, Vectors::new(1), VECTORS, |_| ())
        }
        Precision::Binary16 => {
            verify(&simulator, &half::OPERATORS, half::Vectors::new(1), HALF_VECTORS, |_| ())
        }
    }
}

fn assert_right(precision: Precision) -> Result<(), Error> {
    for Tally { operator, wrong, first } in tallies(precision, &sources::operators(precision))? {
        assert_eq!(wrong, 0, "{}: {first:x?}", operator.name);
    }
    Ok(())
}

#[test]
fn no_result_is_wrong() -> Result<(), Error> {
    assert_right(Precision::F32)
}

#[test]
fn no_result_in_binary16_is_wrong() -> Result<(), Error> {
    assert_right(Precision::Binary16)
}

/// A fault in an operator: the text that stands in its file once, and what it becomes.
struct Fault {
    operator: &'static str,
    file: &'static str,
    correct: &'static str,
    wrong: &'static str,
}

/// One in each operator, so that one simulator holds them all.
const FAULTS: [Fault; 11] = [
    // A sticky bit is lost.
    Fault {
        operator: "add",
        file: "pgs_fadd.v",
        correct: "lost_in_2s | lost_in_1;",
        wrong: "lost_in_2s | (lost_in_1 & shifted[1]);",
    },
    // The grid of the subnormal numbers is forgotten.
    Fault { operator: "mul", file: "pgs_fmul.v", correct: "(&fraction)", wrong: "1'b0" },
    Fault { operator: "div", file: "pgs_fdiv.v", correct: "(&fraction)", wrong: "1'b0" },
    // The root is cut off.
    Fault {
        operator: "sqrt",
        file: "pgs_fsqrt.v",
        correct: "{30'd0, root_s26[0]}",
        wrong: "{30'd0, root_s26[0] & zero_s26}",
    },
    // A delay is one stage short.
    Fault {
        operator: "sincos",
        file: "pgs_fsincos.v",
        correct: "zs[46*8 +: 46]",
        wrong: "zs[46*7 +: 46]",
    },
    // NaN gives the first operand.
    Fault {
        operator: "max",
        file: "pgs_fmax.v",
        correct: "y <= a_above_b ?",
        wrong: "y <= (a_above_b | (&b[WIDTH-2:FRACTION-1])) ?",
    },
    // A subnormal operand becomes the result.
    Fault {
        operator: "min",
        file: "pgs_fmin.v",
        correct: "b[FRACTION-1:0] & {FRACTION{b_stays}}",
        wrong: "b[FRACTION-1:0]",
    },
    // A number is less than itself.
    Fault {
        operator: "less",
        file: "pgs_fless.v",
        correct: "y <= a_below_b",
        wrong: "y <= a_below_b | (a == b)",
    },
    // One register more.
    Fault {
        operator: "select",
        file: "pgs_fselect.v",
        correct: "always @(posedge clk) begin\n    y <= condition ? a : b;",
        wrong: "reg [WIDTH-1:0] late;\n\n  always @(posedge clk) begin\n    late <= condition ? a : b;\n\
                y <= late;",
    },
    Fault { operator: "nonzero", file: "pgs_fnonzero.v", correct: "<= flag &", wrong: "<= flag |" },
    Fault { operator: "or", file: "pgs_flogic_or.v", correct: "a | b", wrong: "a ^ b" },
];

/// The same in binary16, where the subnormal numbers are.
const HALF_FAULTS: [Fault; 7] = [
    // A difference is shifted beyond the lowest exponent.
    Fault {
        operator: "add",
        file: "pgs_hadd.v",
        correct: "lowest ? exponent_s3[3:0] :",
        wrong: "1'b0 ? exponent_s3[3:0] :",
    },
    // A subnormal operand is not shifted to its leading one.
    Fault {
        operator: "mul",
        file: "pgs_hmul.v",
        correct: "wire [14:0] lower         = a_is_low ? a[14:0] : b[14:0];",
        wrong: "wire [14:0] lower         = a[14:0];",
    },
    // The remainder is not looked at: a subnormal tie and a little more count as a tie.
    Fault {
        operator: "div",
        file: "pgs_hdiv.v",
        correct: ".sticky(|rest)",
        wrong: ".sticky(1'b0)",
    },
    // The root of a subnormal number has the wrong exponent.
    Fault {
        operator: "sqrt",
        file: "pgs_hsqrt.v",
        correct: "exponent_s1 - {2'd0, leading}",
        wrong: "exponent_s1",
    },
    // One argument alone is wrong: its cosine is rounded twice.
    Fault {
        operator: "sincos",
        file: "pgs_hsincos.v",
        correct: ".sticky(|cosine_s9[11:0])",
        wrong: ".sticky(1'b1)",
    },
    // NaN is a number.
    Fault {
        operator: "less",
        file: "pgs_fbelow.v",
        correct: "~(both_zero | a_is_nan | b_is_nan)",
        wrong: "~(both_zero | a_is_nan)",
    },
    // A subnormal number counts as zero.
    Fault {
        operator: "nonzero",
        file: "pgs_fnonzero.v",
        correct: "(WIDTH == 32) ? 23 : 0",
        wrong: "(WIDTH == 32) ? 23 : 10",
    },
];

fn assert_found(precision: Precision, faults: &[Fault]) -> Result<(), Error> {
    let texts: Vec<(&str, String)> = sources::operators(precision)
        .iter()
        .map(|source| {
            let mut text = source.text.to_owned();
            for fault in faults.iter().filter(|fault| fault.file == source.file) {
                assert_eq!(text.matches(fault.correct).count(), 1, "{}", fault.file);
                text = text.replace(fault.correct, fault.wrong);
            }
            (source.file, text)
        })
        .collect();
    let changed: Vec<_> = texts.iter().map(|&(file, ref text)| Source { file, text }).collect();
    let tallies = tallies(precision, &changed)?;
    for Fault { operator, .. } in faults {
        for tally in tallies.iter().filter(|tally| tally.operator.name == *operator) {
            assert!(tally.wrong > 0, "{operator}");
        }
    }
    Ok(())
}

#[test]
fn a_fault_in_each_operator_is_found() -> Result<(), Error> {
    assert_found(Precision::F32, &FAULTS)
}

#[test]
fn a_fault_in_each_operator_of_binary16_is_found() -> Result<(), Error> {
    assert_found(Precision::Binary16, &HALF_FAULTS)
}
