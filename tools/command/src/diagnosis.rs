//! Shows why a step failed: a table for people, a document for programs.

use std::fmt::Write as _;

use serde_json::{Value, json};
use zynq_pgs::diagnosis::{ChannelState, Diagnosis};
use zynq_pgs::error::Aftermath;
use zynq_pgs::{Error, Fault};

use crate::failure::{Cause, Failure};

/// Makes a hardware failure of an error, with its diagnosis.
pub fn hardware(error: Error) -> Failure {
    let text = error.fault().zip(error.diagnosis()).map(|(fault, found)| text(fault, found));
    let document = to_json(&error);
    let failure = Failure::new(Cause::Hardware, error);
    failure.details(text.unwrap_or_default(), document)
}

/// A table of the channels, followed by the control block.
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

/// The error for programs; null unless a step failed.
pub fn to_json(error: &Error) -> Value {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refused_input_has_no_document() {
        let error = Error::Input(zynq_pgs::InputError::NoShapes);
        assert_eq!(to_json(&error), Value::Null);
        assert_eq!(to_json(&Error::MustReopen), Value::Null);
    }
}
