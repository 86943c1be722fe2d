//! Sums up a run: the simulated time, the board's time beside the thesis' figures, its limit, and
//! whether the pile is at rest.

use std::io::{self, Write};
use std::time::Duration;

use pgs_thesis::estimate::thesis::{self, recorded};
use pgs_thesis::estimate::{Records, StepCycles};
use scene::{Scene, moving_mass, penetration};
use serde_json::{Value, json};
use zynq_pgs::StepParameters;
use zynq_pgs::interface::profile::Profile;
use zynq_pgs::report::Limit;

use super::row::Row;
use crate::a53::HostTimes;
use pgs_command::numbers::grouped;
use pgs_command::options::solver::time_step_text;
use pgs_command::output::facts::fact;
use pgs_command::output::{limit_text, milliseconds};

/// Average speed up to which a pile is at rest (root mean square, weighted by mass, rotation
/// included), m/s.
const PILE_AT_REST: f64 = 0.05;

/// Sums over the steps of a run.
#[derive(Debug, Default)]
pub(super) struct Totals {
    steps: u32,
    collisions_most: u64,
    modelled: Duration,
    modelled_most: Duration,
    passes: u32,
    bytes_to_device: u64,
    bytes_from_device: u64,
    cycles: u64,
    stalls: u64,
    waits: u64,
    /// The number of steps that each limit held back.
    limits: Vec<(Limit, u32)>,
    host: HostSums,
    /// The host's time on the processor of a ZCU102, if that of all steps is counted.
    a53: Option<HostTimes>,
}

/// Host time by activity.
#[derive(Debug, Default)]
struct HostSums {
    all: Duration,
    detect: Duration,
    order: Duration,
    pack: Duration,
    board: Duration,
    unpack: Duration,
}

impl Totals {
    /// Adds a step.
    pub(super) fn add(&mut self, row: &Row) {
        let report = &row.report;
        let before = if self.steps == 0 { Some(HostTimes::default()) } else { self.a53 };
        self.a53 = before.zip(row.a53).map(|(sum, step)| sum.and(step));
        self.steps += 1;
        self.collisions_most = self.collisions_most.max(report.collisions);
        self.modelled += report.modelled_time();
        self.modelled_most = self.modelled_most.max(report.modelled_time());
        self.passes = report.passes;
        self.bytes_to_device += report.bytes_to_device;
        self.bytes_from_device += report.bytes_from_device;
        self.cycles += report.cycles.total;
        self.stalls += report.cycles.stalls;
        self.waits += report.cycles.waits;
        let limit = report.limit();
        match self.limits.iter_mut().find(|(known, _)| *known == limit) {
            Some((_, steps)) => *steps += 1,
            None => self.limits.push((limit, 1)),
        }
        let host = &report.host;
        self.host.all += row.host();
        self.host.detect += row.detect;
        self.host.order += host.order;
        self.host.pack += host.validate + host.pack;
        self.host.board += host.start + host.wait;
        self.host.unpack += host.unpack + host.commit;
    }

    /// The limit of most steps, and their number.
    fn limit(&self) -> Option<(Limit, u32)> {
        self.limits.iter().copied().max_by_key(|(_, steps)| *steps)
    }

    /// Mean time of a step on the board, ms.
    pub(super) fn mean(&self) -> f64 {
        milliseconds(self.modelled) / f64::from(self.steps.max(1))
    }

    /// Mean time of a pass over the collisions, with a share of the time around the passes, ms.
    fn per_pass(&self) -> Option<f64> {
        (self.passes > 0).then(|| self.mean() / f64::from(self.passes))
    }

    /// Share of all cycles, percent.
    fn percent(&self, cycles: u64) -> f64 {
        100.0 * cycles as f64 / (self.cycles as f64).max(1.0)
    }
}

/// The thesis' figures beside a run.
#[derive(Debug, Clone, Copy)]
struct Thesis {
    design: &'static recorded::Design,
    /// Cycles of one of its passes.
    pass: u64,
    /// The thesis' time for the run's number of passes, ms.
    same_passes_ms: f64,
}

impl Thesis {
    fn for_run(profile: &Profile, passes: u32) -> Self {
        let half = recorded::HALF_DESIGN.profile.name == profile.name;
        let design = if half { &recorded::HALF_DESIGN } else { &recorded::FLOAT_DESIGN };
        let shape = thesis::step();
        let variant = design.profile.default_variant();
        let pass = StepCycles::new(&variant, Records::Packed, &shape).pass;
        let more = f64::from(passes) - shape.passes() as f64;
        let more_ms = more * pass as f64 / f64::from(design.profile.clock_khz);
        Self { design, pass, same_passes_ms: design.latency_ms + more_ms }
    }

    fn text(self, passes: u32) -> String {
        let Self { design, pass, same_passes_ms } = self;
        let recorded::Design { latency_ms, profile, comparison, .. } = design;
        let (gpu, cpu) = (recorded::GPU, recorded::CPU);
        let step = thesis::step();
        let (collisions, own) = (grouped(step.collisions), step.passes());
        let scaled = if u64::from(passes) == own {
            String::new()
        } else {
            let pass = grouped(pass);
            format!(
                "; {passes} passes are {same_passes_ms:.2} ms by {pass} cycles a pass (modelled)"
            )
        };
        format!(
            "recorded ({comparison}): its {} design {latency_ms} ms, {} {} ms, {} {} ms, for \
             {collisions} collisions (§4.4.1) and {own} passes (inferred from its cycles, not \
             printed){scaled}",
            profile.name, gpu.name, gpu.latency_ms, cpu.name, cpu.latency_ms
        )
    }
}

/// The state of the pile at the end.
#[derive(Debug, Clone, Copy)]
pub(super) struct FinalState {
    /// Kinetic energy without gravity's last addition, J.
    kinetic_energy: f64,
    /// The common speed of all bodies at this energy, m/s.
    speed: f64,
    /// Deepest penetration, m.
    deepest: f64,
}

impl FinalState {
    pub(super) fn of(scene: &mut Scene, last: &Row) -> Self {
        scene.detect();
        let deepest = penetration(scene.collisions()).largest;
        let mass = moving_mass(scene.bodies(), scene.shapes());
        let kinetic_energy = last.before_gravity;
        let speed = if mass > 0.0 { (2.0 * kinetic_energy / mass).sqrt() } else { 0.0 };
        Self { kinetic_energy, speed, deepest }
    }

    fn is_at_rest(&self) -> bool {
        self.speed <= PILE_AT_REST
    }

    pub(super) fn text(&self) -> String {
        format!(
            "{}: {:.1} cm/s on average ({:.3} kJ), deepest penetration {:.1} mm",
            if self.is_at_rest() { "at rest" } else { "not at rest" },
            self.speed * 100.0,
            self.kinetic_energy / 1e3,
            self.deepest * 1e3,
        )
    }

    pub(super) fn to_json(self) -> Value {
        json!({
            "at_rest": self.is_at_rest(),
            "kinetic_energy_before_gravity_j": self.kinetic_energy,
            "speed_m_s": self.speed,
            "deepest_penetration_m": self.deepest,
        })
    }
}

/// The board of a run.
#[derive(Debug)]
pub(super) struct BoardFacts {
    pub(super) profile: &'static Profile,
    /// Whether its times are modelled.
    pub(super) is_emulated: bool,
    /// Its memory bandwidth, if known.
    pub(super) bandwidth: Option<String>,
}

/// The summary of a run.
pub(super) struct Summary<'a> {
    totals: &'a Totals,
    parameters: &'a StepParameters,
    board: BoardFacts,
    /// Whether the scene is the thesis' cubes.
    cubes: bool,
    end: FinalState,
}

impl<'a> Summary<'a> {
    /// Measures the scene after its last step.
    pub(super) fn new(
        totals: &'a Totals,
        parameters: &'a StepParameters,
        board: BoardFacts,
        cubes: bool,
        (scene, last): (&mut Scene, &Row),
    ) -> Self {
        Self { totals, parameters, board, cubes, end: FinalState::of(scene, last) }
    }

    fn thesis(&self) -> Option<Thesis> {
        self.cubes.then(|| Thesis::for_run(self.board.profile, self.totals.passes))
    }

    /// For people.
    pub(super) fn print(&self, out: &mut dyn Write) -> io::Result<()> {
        fact(out, "simulated", &self.simulated())?;
        fact(out, "time", &self.board_times())?;
        if let Some(a53) = &self.totals.a53 {
            // The label's column ends within the words.
            fact(out, "host on an", &a53.text(self.totals.steps, self.totals.mean()))?;
        }
        if let Some(thesis) = self.thesis() {
            fact(out, "thesis", &thesis.text(self.totals.passes))?;
        }
        if let Some(limit) = self.limit() {
            fact(out, "limit", &limit)?;
        }
        fact(out, "bytes", &self.bytes())?;
        fact(out, "pile", &self.end.text())?;
        fact(out, "host", &self.host())
    }

    fn simulated(&self) -> String {
        let Self { totals, parameters, .. } = self;
        let seconds = f64::from(parameters.time_step) * f64::from(totals.steps);
        format!(
            "{seconds:.2} s in {} steps of {} with {} contact and {} friction iterations, up to {} \
             pairs",
            grouped(totals.steps.into()),
            time_step_text(parameters.time_step),
            parameters.contact_iterations,
            parameters.friction_iterations,
            grouped(totals.collisions_most),
        )
    }

    fn board_times(&self) -> String {
        let Self { totals, board, .. } = self;
        let mut text = format!(
            "{:.3} ms a step on the board on average, {:.3} ms at most{}",
            totals.mean(),
            milliseconds(totals.modelled_most),
            if board.is_emulated { " (modelled)" } else { "" },
        );
        if let Some(per_pass) = totals.per_pass() {
            text += &format!(", {per_pass:.3} ms a pass");
        }
        text
    }

    fn limit(&self) -> Option<String> {
        let Self { totals, board, .. } = self;
        let (limit, held) = totals.limit()?;
        let at = match &board.bandwidth {
            Some(bandwidth) => format!(" (bandwidth {bandwidth})"),
            None => String::new(),
        };
        Some(format!(
            "{} in {} of {} steps: {:.1} % of the cycles wait for memory{at}, {:.1} % for \
             velocities (hazards)",
            limit_text(limit),
            grouped(held.into()),
            grouped(totals.steps.into()),
            totals.percent(totals.waits),
            totals.percent(totals.stalls),
        ))
    }

    fn bytes(&self) -> String {
        let totals = self.totals;
        let megabytes = |bytes: u64| bytes as f64 / 1e6 / f64::from(totals.steps.max(1));
        format!(
            "{:.1} MB to the board and {:.1} MB back a step",
            megabytes(totals.bytes_to_device),
            megabytes(totals.bytes_from_device)
        )
    }

    fn host(&self) -> String {
        let HostSums { all, detect, order, pack, board, unpack } = &self.totals.host;
        let seconds = Duration::as_secs_f64;
        format!(
            "{:.2} s: {:.2} s detect collisions, {:.2} s order and {:.2} s pack them, {:.2} s {}, \
             {:.2} s read results",
            seconds(all),
            seconds(detect),
            seconds(order),
            seconds(pack),
            seconds(board),
            if self.board.is_emulated { "emulate the board" } else { "wait for the board" },
            seconds(unpack),
        )
    }

    /// For programs.
    pub(super) fn to_json(&self) -> Value {
        let Self { totals, end, .. } = self;
        json!({
            "modelled_ms": {
                "mean": totals.mean(),
                "most": milliseconds(totals.modelled_most),
                "per_pass": totals.per_pass(),
            },
            "thesis": self.thesis().map(|thesis| json!({
                "design": thesis.design.profile.name,
                "recorded_ms": thesis.design.latency_ms,
                "inferred_passes": thesis::step().passes(),
                "recorded_collisions": thesis::COLLISIONS,
                "same_passes_ms": thesis.same_passes_ms,
                "gpu_ms": recorded::GPU.latency_ms,
                "cpu_ms": recorded::CPU.latency_ms,
            })),
            "limit": totals.limit().map(|(limit, steps)| json!({
                "name": limit_text(limit),
                "steps": steps,
                "wait_percent": totals.percent(totals.waits),
                "stall_percent": totals.percent(totals.stalls),
            })),
            "bytes_to_device": totals.bytes_to_device,
            "bytes_from_device": totals.bytes_from_device,
            "end": end.to_json(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zynq_pgs::interface::profile::{FLOAT, HALF, NAIVE};

    /// 254,000 cycles a pass at 275 MHz are 0.9236 ms; 190,500 at 250 MHz are 0.762 ms.
    #[test]
    fn the_thesis_is_shown_for_as_many_passes() {
        let ms = |profile, passes| Thesis::for_run(profile, passes).same_passes_ms;
        assert!((ms(&FLOAT, 8) - 7.49).abs() < 1e-9);
        assert!((ms(&FLOAT, 20) - (7.49 + 12.0 * 0.923_636)).abs() < 1e-3);
        assert!((ms(&HALF, 9) - (6.23 + 0.762)).abs() < 1e-3);
        assert!((ms(&NAIVE, 8) - 7.49).abs() < 1e-9, "it has no design of its own there");
        let text = Thesis::for_run(&FLOAT, 8).text(8);
        let times = "float design 7.49 ms, GTX 980 13.64 ms, i7-3770 53.01 ms, for 127,000";
        let passes = "and 8 passes (inferred from its cycles, not printed)";
        assert!(text.contains(times) && text.ends_with(passes), "{text}");
        let text = Thesis::for_run(&FLOAT, 20).text(20);
        let scaled = "; 20 passes are 18.57 ms by 254,000 cycles a pass (modelled)";
        assert!(text.ends_with(scaled), "{text}");
    }
}
