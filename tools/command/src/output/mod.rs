//! Writes results: facts and tables for people, JSON documents for programs.

pub mod facts;
pub mod files;
pub mod order;
pub mod progress;
pub mod rows;
pub mod table;
pub mod width;

use std::time::Duration;

use clap::builder::styling::{AnsiColor, Style};
use serde_json::{Value, json};
use zynq_pgs::StepReport;
use zynq_pgs::report::Limit;

/// Version of the JSON documents' layout; it grows when a key changes its meaning or goes.
pub const SCHEMA: u32 = 1;

/// The colour of a check that passed. A stream without colours leaves it out.
pub const GOOD: Style = AnsiColor::Green.on_default();
/// The colour of a failure.
pub const BAD: Style = AnsiColor::Red.on_default().bold();
/// The colour of a refusal, and of a check that was left out.
pub const REFUSED: Style = AnsiColor::Yellow.on_default();

/// A time in milliseconds.
pub fn milliseconds(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

/// The name of a limit.
pub fn limit_text(limit: Limit) -> &'static str {
    match limit {
        Limit::Pipeline => "pipeline",
        Limit::Hazards => "hazards",
        Limit::Streams => "streams",
        Limit::Unknown => "unknown",
        _ => "other",
    }
}

/// A step's report for programs.
pub fn report_json(report: &StepReport) -> Value {
    let StepReport { cycles, host, saturated, .. } = report;
    // An unknown number is null; the key beside it tells why.
    let known = |saturated: bool, count: u64| (!saturated).then_some(count);
    json!({
        "bodies": report.bodies,
        "collisions": report.collisions,
        "order": order::to_json(report),
        "passes": report.passes,
        "impulse_sum_n_s": report.impulse_sum,
        "impulse_sum_saturated": saturated.impulse_sum,
        "cycles": {
            "total": cycles.total,
            "formula": known(saturated.work, cycles.work),
            "formula_saturated": saturated.work,
            "stalls": known(saturated.stalls(), cycles.stalls),
            "waits": known(saturated.waits, cycles.waits),
            "waits_saturated": saturated.waits,
        },
        "modelled_ms": milliseconds(report.modelled_time()),
        "limit": limit_text(report.limit()),
        "hazards": known(saturated.hazards, report.hazards),
        "hazards_saturated": saturated.hazards,
        "bytes_to_device": report.bytes_to_device,
        "bytes_from_device": report.bytes_from_device,
        "register_reads": report.register_reads,
        "register_writes": report.register_writes,
        "doorbells": report.doorbells,
        "interrupts": report.interrupts,
        "descriptors": report.descriptors,
        "retries": report.retries,
        "host_ms": {
            "validate": milliseconds(host.validate),
            "order": milliseconds(host.order),
            "pack": milliseconds(host.pack),
            "start": milliseconds(host.start),
            "wait": milliseconds(host.wait),
            "unpack": milliseconds(host.unpack),
            "commit": milliseconds(host.commit),
        },
    })
}
