//! The operators in Verilog have the reference's bits and latencies, if Verilator is installed.
#![allow(clippy::print_stderr, reason = "a skipped test says so")]

use rtlgen::verify::simulation::Simulator;
use rtlgen::verify::{Error, operators};

#[test]
fn twenty_thousand_vectors_have_no_wrong_result() -> Result<(), Error> {
    let simulator = match Simulator::build() {
        Err(missing @ Error::Missing { .. }) => {
            eprintln!("skipped: {missing}");
            return Ok(());
        }
        built => built?,
    };
    for tally in operators::verify(&simulator, 20_000, 1, |_| ())? {
        assert_eq!(tally.wrong, 0, "{}: {:x?}", tally.operator.name, tally.first);
    }
    Ok(())
}
