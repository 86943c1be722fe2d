//! The operators in Verilog have the reference's bits and latencies, and faults in them are found,
//! if Verilator is installed.
#![allow(clippy::print_stderr, reason = "a skipped test says so")]

use rtlgen::sources::{OPERATORS, Source};
use rtlgen::verify::Error;
use rtlgen::verify::operators::{self, Tally, verify};
use rtlgen::verify::simulation::Simulator;
use rtlgen::verify::vectors::Vectors;

const VECTORS: u64 = 20_000;

/// The wrong results by operator, or nothing if a tool is missing.
fn tallies(sources: &[Source<'_>]) -> Result<Vec<Tally>, Error> {
    match Simulator::build_from(sources) {
        Err(missing @ Error::Missing { .. }) => {
            eprintln!("skipped: {missing}");
            Ok(Vec::new())
        }
        simulator => verify(&simulator?, &operators::OPERATORS, Vectors::new(1), VECTORS, |_| ()),
    }
}

#[test]
fn no_result_is_wrong() -> Result<(), Error> {
    for Tally { operator, wrong, first } in tallies(OPERATORS)? {
        assert_eq!(wrong, 0, "{}: {first:x?}", operator.name);
    }
    Ok(())
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
        wrong: "y <= (a_above_b | (&b[30:22])) ?",
    },
    // A subnormal operand becomes the result.
    Fault {
        operator: "min",
        file: "pgs_fmin.v",
        correct: "b[22:0] & {23{|b[30:23]}}",
        wrong: "b[22:0]",
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
        wrong: "reg [31:0] late;\n\n  always @(posedge clk) begin\n    late <= condition ? a : b;\n\
                y <= late;",
    },
    Fault { operator: "nonzero", file: "pgs_fnonzero.v", correct: "<= flag &", wrong: "<= flag |" },
    Fault { operator: "or", file: "pgs_flogic_or.v", correct: "a | b", wrong: "a ^ b" },
];

#[test]
fn a_fault_in_each_operator_is_found() -> Result<(), Error> {
    let texts: Vec<(&str, String)> = OPERATORS
        .iter()
        .map(|source| {
            let mut text = source.text.to_owned();
            for fault in FAULTS.iter().filter(|fault| fault.file == source.file) {
                assert_eq!(text.matches(fault.correct).count(), 1, "{}", fault.file);
                text = text.replace(fault.correct, fault.wrong);
            }
            (source.file, text)
        })
        .collect();
    let sources: Vec<_> = texts.iter().map(|&(file, ref text)| Source { file, text }).collect();
    let tallies = tallies(&sources)?;
    for Fault { operator, .. } in &FAULTS {
        for tally in tallies.iter().filter(|tally| tally.operator.name == *operator) {
            assert!(tally.wrong > 0, "{operator}");
        }
    }
    Ok(())
}
