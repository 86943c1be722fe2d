//! This file tells why a step failed: a table for people, a document for programs, a bundle for a bug
//! report.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;

use bitstream_model::EmulatedBoard;
use clap::Args;
use serde_json::{Value, json};
use step_folder::replace::replace;
use zynq_pgs::{Aftermath, ChannelState, Diagnosis, Error, Fault, StepParameters};

use crate::board::Opened;
use crate::failure::{Cause, Failure};
use crate::ordering;
use crate::planned;
use crate::verbs::SCHEMA;

/// What to do when a step fails.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "When a step fails")]
pub(crate) struct FaultArgs {
    /// Take a step again up to N times, if the board is ready for it after its reset
    #[arg(long, value_name = "N", default_value_t = 0)]
    retries: u32,
    /// Write what a bug report needs to FILE: version, board, parameters, registers, last accesses.
    /// Without a fault nothing is written
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

impl FaultArgs {
    /// The same parameters with these retries.
    pub(crate) fn apply(&self, mut parameters: StepParameters) -> StepParameters {
        parameters.retries = self.retries;
        parameters
    }

    /// The failure that an error of a step is; its report is written if one is asked for.
    pub(crate) fn failure(
        &self,
        opened: &Opened,
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

/// The failure of the board that an error is, with all that is known about it.
pub(crate) fn hardware(error: Error) -> Failure {
    let text = error.fault().zip(error.diagnosis()).map(|(fault, found)| text(fault, found));
    let document = to_json(&error);
    let failure = Failure::new(Cause::Hardware, error);
    failure.details(text.unwrap_or_default(), document)
}

/// A table of the channels, and the control block.
fn text(fault: &Fault, diagnosis: &Diagnosis) -> String {
    let Diagnosis { phase, elapsed, channels, .. } = diagnosis;
    let mut text = format!(
        "diagnosis  {} in {phase}, {:.3} ms after the start\n",
        fault.name(),
        elapsed.as_secs_f64() * 1e3
    );
    let rows: Vec<[String; 5]> = channels.iter().map(row).collect();
    let names = ["channel", "descriptors", "bytes moved", "phase", "DMASR"].map(str::to_owned);
    let width = |column: usize| {
        rows.iter().chain([&names]).map(|row| row[column].len()).max().unwrap_or_default()
    };
    let widths = [0, 1, 2, 3].map(width);
    for [channel, descriptors, bytes, phase, status] in [&names].into_iter().chain(&rows) {
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "  {channel:<0$}  {descriptors:>1$}  {bytes:>2$}  {phase:<3$}  {status}",
            widths[0], widths[1], widths[2], widths[3]
        );
    }
    for line in diagnosis.registers().iter().filter(|line| line.starts_with("control ")) {
        let _ = writeln!(text, "  {line}");
    }
    if let Some(reset) = &diagnosis.reset {
        let _ = writeln!(text, "  the reset failed: {reset}");
    }
    text
}

fn row(state: &ChannelState) -> [String; 5] {
    [
        state.channel.to_string(),
        format!("{}/{}", state.complete, state.descriptors),
        format!("{}/{}", state.bytes_moved, state.bytes_expected),
        state.phase.name(),
        state.status.to_string(),
    ]
}

fn hex(word: u32) -> String {
    format!("{word:#010x}")
}

/// The error for programs; null if it is not a step that failed.
fn to_json(error: &Error) -> Value {
    let Error::Step { fault, aftermath, .. } = error else { return Value::Null };
    let mut causes = Vec::new();
    let mut source = std::error::Error::source(fault);
    while let Some(cause) = source {
        causes.push(cause.to_string());
        source = cause.source();
    }
    json!({
        "fault": fault.name(),
        "message": fault.to_string(),
        "causes": causes,
        "channel": fault.channel().map(|channel| channel.to_string()),
        "aftermath": match aftermath {
            Aftermath::Ready => "ready",
            Aftermath::Untouched => "untouched",
            _ => "must-reopen",
        },
        "diagnosis": error.diagnosis().map(diagnosis_json),
    })
}

fn diagnosis_json(diagnosis: &Diagnosis) -> Value {
    let channels: Vec<Value> = diagnosis.channels.iter().map(channel_json).collect();
    json!({
        "phase": diagnosis.phase.name(),
        "elapsed_ms": diagnosis.elapsed.as_secs_f64() * 1e3,
        "channels": channels,
        "control": diagnosis.control.map(|control| json!({
            "ap_ctrl": hex(control.control),
            "error": hex(control.error),
            "error_detail": control.error_detail,
            "identification": hex(control.identification),
        })),
        "reset_failed": diagnosis.reset.as_ref().map(ToString::to_string),
    })
}

fn channel_json(state: &ChannelState) -> Value {
    json!({
        "channel": state.channel.to_string(),
        "phase": state.phase.name(),
        "dmacr": hex(state.control.raw()),
        "dmasr": hex(state.status.raw()),
        "dmasr_decoded": state.status.to_string(),
        "curdesc": format!("{:#x}", state.current),
        "taildesc": format!("{:#x}", state.tail),
        "descriptors": state.descriptors,
        "descriptors_complete": state.complete,
        "bytes_moved": state.bytes_moved,
        "bytes_expected": state.bytes_expected,
        "descriptor": state.descriptor.map(|descriptor| json!({
            "index": descriptor.index,
            "address": format!("{:#x}", descriptor.address),
            "bytes": descriptor.bytes,
            "status": hex(descriptor.status.raw()),
            "status_decoded": descriptor.status.to_string(),
        })),
    })
}

/// Everything that a bug report needs.
fn bundle_json(opened: &Opened, parameters: &StepParameters, error: &Error) -> Value {
    let diagnosis = error.diagnosis();
    let accesses: Vec<Value> = diagnosis
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
        "error": to_json(error),
        "registers": diagnosis.map(Diagnosis::registers),
        "accesses": accesses,
        "misuse_seen_by_the_emulated_board": violations,
        "faults_planned": planned::to_json(opened),
    })
}

fn parameters_json(parameters: &StepParameters) -> Value {
    json!({
        "time_step_s": parameters.time_step,
        "position_drift_m": parameters.position_drift,
        "position_coefficient": parameters.position_coefficient,
        "friction": parameters.friction,
        "angular_damping": parameters.angular_damping,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refused_input_has_no_document() {
        let error = Error::Input(zynq_pgs::InputError::NoBodies);
        assert_eq!(to_json(&error), Value::Null);
        assert_eq!(to_json(&Error::MustReopen), Value::Null);
    }
}
