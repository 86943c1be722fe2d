//! The options for a failed step: retries, and a report for a bug.

use std::io::Write as _;
use std::path::PathBuf;

use bitstream_model::EmulatedBoard;
use clap::Args;
use serde_json::{Value, json};
use step_folder::replace::replace;
use zynq_pgs::diagnosis::Diagnosis;
use zynq_pgs::{Error, StepParameters};

use pgs_command::board::OpenBoard;
use pgs_command::diagnosis;
use pgs_command::failure::Failure;
use pgs_command::options::ordering;
use pgs_command::output::SCHEMA;
use pgs_command::output::files::Named;

/// The arguments for a failed step.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "When a step fails")]
pub(crate) struct FaultArgs {
    /// Repeat a failed step up to N times, if the board is ready for it after its reset
    #[arg(long, value_name = "N", default_value_t = 0)]
    retries: u32,
    /// Write the data for a bug report to FILE after a fault: version, board, parameters,
    /// registers, last accesses
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

impl FaultArgs {
    /// Sets the number of retries.
    pub(crate) fn apply(&self, mut parameters: StepParameters) -> StepParameters {
        parameters.retries = self.retries;
        parameters
    }

    /// The file of the report, which no other file of the command may be.
    pub(crate) fn named(&self) -> Option<Named> {
        self.report.as_ref().map(|path| Named::option("report", path))
    }

    /// Makes a failure of a step's error, and writes the report if the command line names one.
    pub(crate) fn failure(
        &self,
        opened: &OpenBoard,
        parameters: &StepParameters,
        error: Error,
    ) -> Failure {
        let bundle = self.report.as_ref().filter(|_| error.fault().is_some());
        let Some(path) = bundle else { return opened.failure(error) };
        let document = bundle_json(opened, parameters, &error);
        let said = match replace(path, |file| writeln!(file, "{document:#}")) {
            Ok(()) => format!("for a bug report, see {}", path.display()),
            Err(error) => format!("the report {error}: {}", error.source),
        };
        opened.failure(error).hint(&said)
    }
}

/// The content of a bug report.
fn bundle_json(opened: &OpenBoard, parameters: &StepParameters, error: &Error) -> Value {
    let found = error.diagnosis();
    let accesses: Vec<Value> = found
        .iter()
        .flat_map(|found| &found.accesses)
        .map(|access| json!({ "ns": access.at.as_nanos(), "access": access.to_string() }))
        .collect();
    let violations = opened.observer.as_ref().map(EmulatedBoard::violations).unwrap_or_default();
    let violations: Vec<String> = violations.iter().map(ToString::to_string).collect();
    json!({
        "schema": SCHEMA,
        "report": "pgs",
        "version": env!("CARGO_PKG_VERSION"),
        "host": format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        "arguments": std::env::args().skip(1).collect::<Vec<_>>(),
        "board": opened.to_json(),
        "parameters": parameters_json(parameters),
        "error": diagnosis::to_json(error),
        "registers": found.map(Diagnosis::registers),
        "accesses": accesses,
        "misuse_seen_by_the_emulated_board": violations,
        "faults_planned": opened.faults_json(),
    })
}

fn parameters_json(parameters: &StepParameters) -> Value {
    json!({
        "time_step_s": parameters.time_step,
        "position_drift_m": parameters.position_drift,
        "position_coefficient": parameters.position_coefficient,
        "friction": parameters.friction,
        "angular_damping": parameters.angular_damping,
        "spin_damping": parameters.spin_damping,
        "kinematic": parameters.kinematic,
        "pair_friction": parameters.pair_friction,
        "warm_start": parameters.warm_start,
        "impulses_out": parameters.impulses_out,
        "gravity_m_s2": parameters.gravity,
        "contact_iterations": parameters.contact_iterations,
        "friction_iterations": parameters.friction_iterations,
        "integrate": parameters.integrate,
        "order": parameters.order.map(ordering::name),
        "verify_order": parameters.verify_order,
        "deadline_ms": parameters.deadline.map(|limit| limit.as_secs_f64() * 1e3),
        "retries": parameters.retries,
    })
}
