//! Sums up a run: the board's time, beside the same step in software, its limit, and whether the
//! pile is at rest.

use std::io::{self, Write};
use std::time::Duration;

use scene::{Scene, moving_mass, penetration};
use serde_json::{Value, json};
use zynq_pgs::report::Limit;

use super::row::Row;
use crate::a53::{Paper, ratio_text};
use pgs_command::output::facts::fact;
use pgs_command::output::{limit_text, milliseconds};

/// Average speed up to which a pile is at rest (root mean square, weighted by mass, rotation
/// included), m/s.
const PILE_AT_REST: f64 = 0.05;

/// Sums over the steps of a run.
#[derive(Debug, Default)]
pub(super) struct Totals {
    steps: u32,
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
    /// The steps on paper, if all of them are counted.
    a53: Option<Paper>,
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
        let before = if self.steps == 0 { Some(Paper::default()) } else { self.a53 };
        self.a53 = before.zip(row.a53).map(|(sum, step)| sum.and(step));
        self.steps += 1;
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
            "{}: {:.1} cm/s ({:.3} kJ), deepest penetration {:.1} mm",
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

/// The summary of a run.
pub(super) struct Summary<'a> {
    totals: &'a Totals,
    /// Whether the times of the board are modelled.
    is_emulated: bool,
    end: FinalState,
}

impl<'a> Summary<'a> {
    /// Measures the scene after its last step.
    pub(super) fn new(
        totals: &'a Totals,
        is_emulated: bool,
        (scene, last): (&mut Scene, &Row),
    ) -> Self {
        Self { totals, is_emulated, end: FinalState::of(scene, last) }
    }

    /// For people.
    pub(super) fn print(&self, out: &mut dyn Write) -> io::Result<()> {
        fact(out, "time", &self.board_times())?;
        fact(out, "ratio", &ratio_text(self.totals.a53, self.totals.steps, self.totals.mean()))?;
        fact(out, "pile", &self.end.text())?;
        fact(out, "host", &self.host())
    }

    fn board_times(&self) -> String {
        let modelled = if self.is_emulated { " (modelled)" } else { "" };
        let limit = self.totals.limit().map_or("unknown", |(limit, _)| limit_text(limit));
        format!("{:.3} ms a step on the board{modelled}, limit: {limit}", self.totals.mean())
    }

    fn host(&self) -> String {
        let HostSums { all, detect, order, pack, board, unpack } = self.totals.host;
        let [all, detect, board] = [all, detect, board].map(|time| time.as_secs_f64());
        let driver = (order + pack + unpack).as_secs_f64();
        let what = if self.is_emulated { "emulates the board" } else { "waits for the board" };
        format!("{all:.2} s: {board:.2} s {what}, {detect:.2} s search, {driver:.2} s driver")
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
            "ratio": totals.a53.map(|a53| a53.ratio(totals.steps, totals.mean())),
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
