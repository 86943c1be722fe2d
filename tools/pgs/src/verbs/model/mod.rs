//! The verb `model`: what a step costs by formula, without running anything.

use std::io::Write;

use bitstream_model::Bandwidth;
use bitstream_model::interface::profile::{FLOAT, Profile, RecordWords, THESIS_WORDS};
use bitstream_model::timing::{MemoryUse, PassLimit, StepCycles, StepShape, StepTime};
use clap::Args;
use serde_json::{Value, json};

use super::SCHEMA;
use super::table::grouped;
use crate::args::CommonArgs;
use crate::failure::{Failure, Verdict};
use crate::options::{bandwidth, bandwidth_number, bandwidth_text};

const EXAMPLES: &str = "\
Examples:
  pgs model --collisions 127000 --bodies 38880
  pgs model --collisions 127000 --bodies 38880 --bandwidth 8.5 --json";

/// Show what a step costs by formula: cycles, time, on-chip memory.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ModelArgs {
    /// Collisions in the step.
    #[arg(long, value_name = "C")]
    collisions: u32,
    /// Bodies in the step.
    #[arg(long, value_name = "B")]
    bodies: u32,
    /// Memory bandwidth in GB/s, or "unlimited" [default: unlimited, 17.07 and 12.8 in turn]
    #[arg(long, value_name = "GBPS", value_parser = bandwidth)]
    bandwidth: Option<Bandwidth>,
}

/// A step of the thesis, against which the formula is held.
struct ThesisStep {
    bodies: u64,
    collisions: u64,
    cycles: u64,
    source: &'static str,
}

const THESIS_STEP: ThesisStep =
    ThesisStep { bodies: 38_880, collisions: 127_000, cycles: 2_062_697, source: "thesis T6.4" };

const BANDWIDTHS: [Bandwidth; 3] =
    [Bandwidth::Unlimited, Bandwidth::ZCU102_PEAK, Bandwidth::ZCU102_SUSTAINED];

/// Records of one format: cycles, and the time at each bandwidth.
struct Estimate {
    format: &'static str,
    cycles: StepCycles,
    times: Vec<(Bandwidth, StepTime)>,
}

impl Estimate {
    fn new(
        format: &'static str,
        profile: &Profile,
        words: &RecordWords,
        step: &StepShape,
        bandwidths: &[Bandwidth],
    ) -> Self {
        let time =
            |bandwidth: &Bandwidth| (*bandwidth, StepTime::new(profile, words, step, *bandwidth));
        Self {
            format,
            cycles: StepCycles::new(profile, words, step),
            times: bandwidths.iter().map(time).collect(),
        }
    }

    fn print(&self, out: &mut dyn Write, step: &StepShape) -> std::io::Result<()> {
        let cycles = &self.cycles;
        let passes = step.contact_iterations + step.friction_iterations;
        writeln!(out, "{}", self.format)?;
        writeln!(
            out,
            "  cycles     {} = {} load + {passes} x {} passes + {} fill + {} poses in or results out",
            grouped(cycles.total),
            grouped(cycles.load),
            grouped(cycles.pass),
            grouped(cycles.fill),
            grouped(cycles.pose_in.max(cycles.result_out)),
        )?;
        for (bandwidth, time) in &self.times {
            writeln!(
                out,
                "  time       {:.3} ms at {} ({} bytes moved; the {} limits the passes)",
                time.seconds * 1e3,
                bandwidth_text(*bandwidth),
                grouped(time.bytes),
                limit_text(time.limit),
            )?;
        }
        Ok(())
    }

    fn to_json(&self) -> Value {
        let cycles = &self.cycles;
        let times: Vec<Value> = self
            .times
            .iter()
            .map(|(bandwidth, time)| {
                json!({
                    "bandwidth_bytes_per_second": bandwidth_number(*bandwidth),
                    "ms": time.seconds * 1e3,
                    "bytes": time.bytes,
                    "limit": limit_text(time.limit),
                })
            })
            .collect();
        json!({
            "cycles": {
                "total": cycles.total,
                "load": cycles.load,
                "pass": cycles.pass,
                "fill": cycles.fill,
                "pose_in": cycles.pose_in,
                "result_out": cycles.result_out,
            },
            "times": times,
        })
    }
}

fn limit_text(limit: PassLimit) -> &'static str {
    match limit {
        PassLimit::Pipeline => "pipeline",
        PassLimit::Memory => "memory",
    }
}

fn mib(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}

/// Computes and shows the costs.
pub(crate) fn run(
    args: &ModelArgs,
    common: &CommonArgs,
    out: &mut dyn Write,
) -> Result<Verdict, Failure> {
    let profile = &FLOAT;
    let step = StepShape::new(args.bodies.into(), args.collisions.into());
    let bandwidths = args.bandwidth.map_or_else(|| BANDWIDTHS.to_vec(), |one| vec![one]);
    let packed = Estimate::new(
        "records packed as in the thesis",
        profile,
        &THESIS_WORDS,
        &step,
        &bandwidths,
    );
    let streamed = Estimate::new(
        "records as they are streamed",
        profile,
        &profile.default_variant().words(),
        &step,
        &bandwidths,
    );
    let memory = MemoryUse::new(&profile.default_variant(), step.bodies, step.collisions);
    let deviation = (step.bodies == THESIS_STEP.bodies
        && step.collisions == THESIS_STEP.collisions)
        .then(|| packed.cycles.total as f64 / THESIS_STEP.cycles as f64 - 1.0);

    if common.json {
        let document = json!({
            "schema": SCHEMA,
            "verb": "model",
            "profile": profile.name,
            "clock_khz": profile.clock_khz,
            "bodies": step.bodies,
            "collisions": step.collisions,
            "contact_iterations": step.contact_iterations,
            "friction_iterations": step.friction_iterations,
            "thesis_words": packed.to_json(),
            "streamed_words": streamed.to_json(),
            "thesis": deviation.map(|deviation| json!({
                "cycles": THESIS_STEP.cycles,
                "deviation": deviation,
                "source": THESIS_STEP.source,
            })),
            "memory": {
                "velocities": memory.velocities,
                "impulses": memory.impulses,
                "block_ram": memory.block_ram(),
                "capacity": memory.capacity,
                "shape_indices": memory.shape_indices,
                "fits": memory.fits(),
                "collisions_that_fit": MemoryUse::collisions_beside(&profile.default_variant(), step.bodies),
            },
        });
        writeln!(out, "{document:#}")?;
        return Ok(Verdict::Done);
    }

    writeln!(
        out,
        "profile {} at {} kHz: {} bodies, {} collisions, {} contact and {} friction iterations",
        profile.name,
        profile.clock_khz,
        grouped(step.bodies),
        grouped(step.collisions),
        step.contact_iterations,
        step.friction_iterations,
    )?;
    writeln!(out, "By formula: a step that stalls on hazards takes longer.")?;
    writeln!(out)?;
    packed.print(out, &step)?;
    if let Some(deviation) = deviation {
        writeln!(
            out,
            "  recorded   {} cycles ({}), the formula deviates by {:+.2} %",
            grouped(THESIS_STEP.cycles),
            THESIS_STEP.source,
            deviation * 100.0,
        )?;
    }
    streamed.print(out, &step)?;
    writeln!(out, "on-chip memory")?;
    writeln!(
        out,
        "  block RAM  {:.2} MiB of {:.1} MiB: {} bytes of velocities, {} of impulses; {}",
        mib(memory.block_ram()),
        mib(memory.capacity),
        grouped(memory.velocities),
        grouped(memory.impulses),
        if memory.fits() { "fits" } else { "does not fit" },
    )?;
    writeln!(
        out,
        "  beside it  {} bytes of shape indices in distributed RAM, which the thesis does without",
        grouped(memory.shape_indices),
    )?;
    writeln!(
        out,
        "  room for   {} collisions beside so many bodies",
        grouped(MemoryUse::collisions_beside(&profile.default_variant(), step.bodies)),
    )?;
    Ok(Verdict::Done)
}
