//! The study `split`: the shares of collision search and collision response in a step (thesis §4.4:
//! 40 and 60 %), and the gain of the whole step when the response alone becomes faster (equation
//! 6.5).
//!
//! Both shares are measured on this host, in processor time of one thread: the search is the
//! detection of `pgs run`, the response is the yardstick, a sequential solver with Bullet's bits.
//! The time of the board is modelled.

use std::time::Duration;

use crate::estimate::thesis::amdahl;
use crate::estimate::thesis::recorded::{ACCELERATED_SHARE, CPU, DESIGNS, GPU};
use bitstream_model::BoardConfig;
use clap::Args;
use nix::time::{ClockId, clock_gettime};
use scene::{Grid, Scene};
use yardstick::Yardstick;
use zynq_pgs::{StepParameters, StepReport};

use crate::experiment::{Boards, Experiment, Measure, Part};
use crate::figure::{Figure, bars};
use crate::index::Row;
use crate::session::Session;
use crate::table::{Cell, Table, text};
use pgs_command::board;
use pgs_command::failure::{Cause, Failure, Result};
use pgs_command::numbers::grouped;
use pgs_command::output::milliseconds;
use pgs_command::pile;

const EXAMPLES: &str = "\
Examples:
  pgs thesis split                      the thesis' scene
  pgs thesis split --grid 12x12x12 --steps 90 --runs 15 --json

Measured: medians over successive steps of a pile, in processor time of one thread, which a busy
host changes less than time by the clock. Search is the detection of this project (a grid, then \
cubes
against cubes), response the yardstick: a sequential scalar solver with Bullet's bits, that makes \
its
rows, takes the passes and integrates, in memory that an unmeasured run has touched. Driver: time by
the clock around the board's, for checks, order, packing and results. Modelled: the board's time, at
the bandwidth that a ZCU102 sustains.

Whole step: 1 / ((1 - p) + p / s) (thesis eq. 6.5), with s the factor of the response and p its
share: the thesis' 0.6, or the measured one.";

/// The experiment.
pub(crate) static SPLIT: Experiment = Experiment::of::<Options>(
    "split",
    "§4.4, equation 6.5",
    Boards::Any,
    "The shares of collision search and response in a step, and what a faster response \
        gains",
);

/// Its arguments.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Options {
    /// Cubes of the pile along each axis.
    #[arg(long, value_name = "NXxNYxNZ", default_value_t)]
    pub(crate) grid: Grid,
    /// Height of the lowest cubes above the ground at the start, m.
    #[arg(long, value_name = "H", default_value_t = 1.0)]
    pub(crate) drop: f32,
    /// Steps before the first measured one.
    #[arg(long, value_name = "N", default_value_t = 45)]
    pub(crate) steps: u32,
    /// Measured steps.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 9,
        value_parser = clap::value_parser!(u32).range(1..=1000)
    )]
    pub(crate) runs: u32,
}

/// Times of one step, ms.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Times {
    pub(crate) search_ms: f64,
    pub(crate) response_ms: f64,
    /// The driver's host time, by the clock.
    pub(crate) driver_ms: f64,
    /// Modelled.
    pub(crate) board_ms: f64,
}

/// The gain of a whole step.
#[derive(Debug)]
pub(crate) struct Gain {
    pub(crate) response: String,
    /// The factor of the response.
    pub(crate) factor: f64,
    pub(crate) whole_with_recorded_share: f64,
    pub(crate) whole_with_measured_share: f64,
    /// The thesis' own figure.
    pub(crate) recorded: Option<f64>,
}

impl Measure for Options {
    /// Steps the pile, and times each measured step's search and response.
    fn measure(&self, session: &Session) -> Result<Part> {
        let Options { grid, drop, .. } = *self;
        let config = BoardConfig { threads: 1, ..session.common.build().config() };
        let (mut scene, mut opened) = pile::open(grid, drop, &session.common, config)?;
        scene.set_threads(1);
        session.watch(&mut opened);
        let parameters = StepParameters::thesis();
        session.expect(u64::from(self.steps) + u64::from(self.runs));
        let mut samples = Vec::new();
        let mut goes_on = pile::step_to(&mut scene, &mut opened, &parameters, self.steps, || {
            session.advance();
            !session.is_interrupted()
        })?;
        for _ in 0..self.runs {
            goes_on = goes_on && !session.is_interrupted();
            if !goes_on {
                break;
            }
            let search = spent(|| measured_search(&mut scene))?;
            let response = respond(&scene, &parameters)?;
            let (bodies, collisions) = scene.parts_mut();
            let report = match opened.accelerator.step(bodies, collisions, &parameters) {
                Ok(report) => report,
                Err(error) if board::is_cancelled(&error) => break,
                Err(error) => return Err(opened.failure(error)),
            };
            session.advance();
            samples.push(Times {
                search_ms: milliseconds(search),
                response_ms: milliseconds(response),
                driver_ms: milliseconds(driver(&report)),
                board_ms: milliseconds(report.modelled_time()),
            });
        }
        session.end();
        let (bodies, collisions) = (scene.bodies().len() as u64, scene.collisions().len() as u64);
        let mut part = Part::of(Vec::new());
        part.complete = samples.len() as u64 == u64::from(self.runs);
        let pile = format!(
            "{grid} cubes dropped from {drop} m: {} bodies, {} collisions, median of {} steps, one \
         thread",
            grouped(bodies),
            grouped(collisions),
            samples.len()
        );
        part.fact("pile", pile);
        // None if Ctrl-C came before the first measured step.
        let Some(times) = Times::median(&samples) else { return Ok(part) };
        let shares = samples.iter().map(Times::response_share);
        let [least, most] = shares
            .fold([1.0, 0.0], |[least, most]: [f64; 2], share| [least.min(share), most.max(share)]);
        part.tables = vec![times.table(), table_of_gains(&gains(&times))];
        let response = times.response_share();
        let text = format!(
            "response {:.1} % of search and response ({:.1} to {:.1} % in single steps); thesis {:.0} \
         % (recorded)",
            100.0 * response,
            100.0 * least,
            100.0 * most,
            100.0 * ACCELERATED_SHARE,
        );
        part.fact("share", text);
        let (figure, row) = figure(grid, response);
        part.figure(figure, [row]);
        Ok(part)
    }
}

/// The yardstick's time for the step.
fn respond(scene: &Scene, parameters: &StepParameters) -> Result<Duration> {
    let (shapes, bodies) = (scene.shapes(), scene.bodies());
    let mut yardstick = Yardstick::new(shapes, bodies, scene.collisions(), parameters);
    yardstick.solve();
    spent(|| measured_response(&mut yardstick))
}

fn measured_search(scene: &mut Scene) {
    scene.detect();
}

fn measured_response(yardstick: &mut Yardstick) {
    yardstick.solve();
}

/// Processor time that this thread spends.
fn spent(act: impl FnOnce()) -> Result<Duration> {
    let now = || {
        clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID).map(Duration::from).map_err(|error| {
            Failure::new(Cause::Hardware, error)
                .about("the processor time of a thread cannot be read")
                .next("run the study on another system")
        })
    };
    let begin = now()?;
    act();
    Ok(now()?.saturating_sub(begin))
}

/// The driver's host time, without the wait for the board.
fn driver(report: &StepReport) -> Duration {
    let host = &report.host;
    host.validate + host.order + host.pack + host.start + host.unpack + host.commit
}

impl Times {
    fn response_share(&self) -> f64 {
        self.response_ms / (self.search_ms + self.response_ms)
    }

    /// The median of each time; none without samples.
    fn median(samples: &[Self]) -> Option<Self> {
        let of = |time: fn(&Self) -> f64| {
            let mut times: Vec<f64> = samples.iter().map(time).collect();
            times.sort_unstable_by(f64::total_cmp);
            times.get(times.len() / 2).copied()
        };
        Some(Self {
            search_ms: of(|times| times.search_ms)?,
            response_ms: of(|times| times.response_ms)?,
            driver_ms: of(|times| times.driver_ms)?,
            board_ms: of(|times| times.board_ms)?,
        })
    }
}

/// The gains by the thesis' factors, and by the ones of these times.
fn gains(times: &Times) -> Vec<Gain> {
    let share = times.response_share();
    let gain = |response: String, factor: f64, recorded| Gain {
        response,
        factor,
        whole_with_recorded_share: amdahl(ACCELERATED_SHARE, factor),
        whole_with_measured_share: amdahl(share, factor),
        recorded,
    };
    let thesis = DESIGNS.iter().flat_map(|design| {
        [(GPU, Some(design.whole_step)), (CPU, None)].map(|(platform, recorded)| {
            let name = format!("{} instead of {} (recorded)", design.profile.name, platform.name);
            gain(name, platform.latency_ms / design.latency_ms, recorded)
        })
    });
    let board = times.response_ms / times.board_ms;
    let with_driver = times.response_ms / (times.board_ms + times.driver_ms);
    let ours = [
        gain("float (modelled) instead of this host".to_owned(), board, None),
        gain("the same with the driver's time".to_owned(), with_driver, None),
    ];
    thesis.chain(ours).collect()
}

/// The shares beside the thesis'.
fn figure(grid: Grid, response: f64) -> (Figure, Row) {
    let both = |response: f64| [100.0 - 100.0 * response, 100.0 * response];
    let (recorded, ours) = (both(ACCELERATED_SHARE), both(response));
    let figure = Figure::new(
        ("figure-shares", "§4.4"),
        "Shares of collision search and collision response",
        bars(
            "% of both",
            &["search", "response"].map(str::to_owned),
            &["recorded", "measured"].map(str::to_owned),
            &[0, 1].map(|part| vec![Some(recorded[part]), Some(ours[part])]),
        ),
        format!(
            "a pile of {grid} cubes, in processor time of one thread of this host. The thesis \
             names neither its processor nor its program for the shares."
        ),
    );
    let shown = |[search, response]: [f64; 2], digits: usize| {
        format!("{search:.digits$} % search, {response:.digits$} % response")
    };
    let on_host = format!("{}, on one core of this host", shown(ours, 1));
    let row = figure.row("shares of a step", shown(recorded, 0), on_host);
    (figure, row)
}

fn table_of_gains(gains: &[Gain]) -> Table {
    let mut table = Table::new("gains", "The whole step by equation 6.5");
    for gain in gains {
        table.row([
            ("response", "response", text(&gain.response)),
            ("factor", "factor\ns", Cell::Number(gain.factor, 2)),
            (
                "whole_with_recorded_share",
                "whole\np = 0.6",
                Cell::Number(gain.whole_with_recorded_share, 2),
            ),
            (
                "whole_with_measured_share",
                "whole\nmeasured",
                Cell::Number(gain.whole_with_measured_share, 2),
            ),
            ("recorded", "thesis", Cell::known(gain.recorded, |gain| Cell::Number(gain, 2))),
        ]);
    }
    table
}

impl Times {
    fn table(&self) -> Table {
        let columns = [("part", "one step"), ("ms", "time\nms"), ("share_percent", "share\n%")];
        let mut table = Table::with_columns("shares", "Times of one step", &columns);
        let whole = self.search_ms + self.response_ms;
        for (name, time, shared) in [
            ("search (measured)", self.search_ms, true),
            ("response (measured, yardstick)", self.response_ms, true),
            ("driver of the board (measured)", self.driver_ms, false),
            ("board (modelled)", self.board_ms, false),
        ] {
            let share = shared.then_some(100.0 * time / whole);
            let share = Cell::known(share, |share| Cell::Number(share, 1));
            table.row([text(name), Cell::Number(time, 2), share]);
        }
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(search_ms: f64, response_ms: f64) -> Times {
        Times { search_ms, response_ms, driver_ms: 5.0, board_ms: 10.0 }
    }

    #[test]
    fn the_thesis_shares_give_the_thesis_gains() {
        let gains = gains(&times(40.0, 60.0));
        for (gain, expected) in [(&gains[0], 1.37), (&gains[2], 1.48)] {
            assert!((gain.whole_with_measured_share - expected).abs() < 0.005, "{gain:?}");
            assert_eq!(gain.recorded, Some(expected));
        }
        // By hand: 60 ms become 10, and 15 with the driver's time.
        let whole: Vec<f64> =
            gains[4..].iter().map(|gain| gain.whole_with_measured_share).collect();
        assert!((whole[0] - 100.0 / 50.0).abs() < 1e-12 && (whole[1] - 100.0 / 55.0).abs() < 1e-12);
    }

    #[test]
    fn each_time_has_a_median_of_its_own() {
        let samples = [times(1.0, 9.0), times(2.0, 8.0), times(3.0, 7.0)];
        let median = Times::median(&samples).expect("samples");
        assert_eq!((median.search_ms, median.response_ms), (2.0, 8.0));
        assert!(Times::median(&[]).is_none());
    }
}
