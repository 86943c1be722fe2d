//! The gain of packing the next step while one is on the board, on the board's own clock.
//!
//! ```sh
//! cargo bench --bench overlap
//! cargo bench --bench overlap -- --input tests/golden/pile5_step60 --pack-ms 0.01
//! ```
//!
//! The emulated board's clock advances with register accesses and waits; it stands still while this
//! host computes, since a board has another host. So an option gives the time of packing there
//! (`--pack-ms`, by default 7 ms for the thesis' step), and the scene lets this time pass on the
//! board's clock while the driver reads it. Storing the results takes as long per byte. The step is always the same, of a standing scene or of a folder. The steps run
//! one after the other (serial), and each packed while the one before it is on the board
//! (overlapped).

#![forbid(unsafe_code)]
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command")]

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use bench::milliseconds;
use bench::options::{Common, Pile};
use bench::step::Step;
use bitstream_model::{BoardConfig, CpuPort, EmulatedBoard};
use clap::Parser;
use scene::Grid;
use zynq_pgs::order::Order;
use zynq_pgs::{
    Accelerator, BoardChoice, Bodies, Body, Collision, Collisions, InFlight, OpenOptions, Pose,
    StepParameters, StepReport, Velocity,
};

/// Compares overlapping steps with the longer of packing and the board, on the board's clock.
#[derive(Debug, Parser)]
#[command(name = "cargo bench --bench overlap --")]
struct Options {
    /// Cubes along each axis, standing; y is up
    #[arg(long, value_name = "NXxNYxNZ", default_value_t, conflicts_with = "input")]
    grid: Grid,
    /// Take the step from this folder of arrays instead of a pile
    #[arg(long, value_name = "DIR")]
    input: Option<PathBuf>,
    /// Time of packing a step on the board's processor, ms
    #[arg(long, value_name = "MS", default_value = "7", value_parser = time)]
    pack_ms: Duration,
    #[command(flatten)]
    common: Common,
}

fn time(text: &str) -> Result<Duration, String> {
    let ms: f64 = text.parse().map_err(|_| "expected a number of milliseconds".to_owned())?;
    Duration::try_from_secs_f64(ms / 1e3).map_err(|error| error.to_string())
}

/// Parts in which the host's time passes.
const PIECES: u32 = 100;

/// Bodies or collisions that take `time` on the board's clock to read or store.
struct TimedReads<'a, T: ?Sized> {
    inner: &'a T,
    port: &'a CpuPort,
    time: Duration,
    left: AtomicU32,
}

impl<'a, T: ?Sized> TimedReads<'a, T> {
    fn new(inner: &'a T, port: &'a CpuPort, time: Duration) -> Self {
        Self { inner, port, time, left: AtomicU32::new(PIECES) }
    }

    /// Lets a piece of the time pass, `PIECES` times over the first `count` indices.
    fn pass(&self, index: usize, count: usize) {
        let take = |left: u32| left.checked_sub(1);
        if index.is_multiple_of((count / PIECES as usize).max(1))
            && self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take).is_ok()
        {
            self.port.pause(self.time / PIECES);
        }
    }
}

/// Bodies that are stored separately from their source: every step starts from the first state.
struct SeparateOutput<'a> {
    timed: TimedReads<'a, [Body]>,
    stored: Vec<Body>,
}

impl Bodies for SeparateOutput<'_> {
    fn len(&self) -> usize {
        self.timed.inner.len()
    }

    fn body(&self, index: usize) -> Body {
        self.timed.inner[index]
    }

    fn commit(&mut self, index: usize, pose: Pose, velocity: Velocity) {
        self.timed.pass(index, self.len());
        self.stored.commit(index, pose, velocity);
    }
}

impl Collisions for TimedReads<'_, [Collision]> {
    fn len(&self) -> usize {
        self.inner.len()
    }

    fn collision(&self, index: usize) -> Collision {
        self.pass(index, self.inner.len());
        self.inner[index]
    }
}

/// A scene to step, and the assumed times of its host.
struct Job<'a> {
    bodies: &'a [Body],
    collisions: &'a [Collision],
    parameters: StepParameters,
    pack: Duration,
    unpack: Duration,
    port: CpuPort,
}

impl Job<'_> {
    fn bodies(&self) -> SeparateOutput<'_> {
        let timed = TimedReads::new(self.bodies, &self.port, self.unpack);
        SeparateOutput { timed, stored: self.bodies.to_vec() }
    }

    fn collisions(&self) -> TimedReads<'_, [Collision]> {
        TimedReads::new(self.collisions, &self.port, self.pack)
    }

    fn submit<'a>(
        &self,
        accelerator: &'a mut Accelerator,
    ) -> Result<InFlight<'a>, zynq_pgs::Error> {
        accelerator.submit(&self.bodies(), &self.collisions(), &self.parameters)
    }

    /// Takes steps one after the other; returns the time of each on the board's clock, and the
    /// report of the last one.
    fn serial(
        &self,
        accelerator: &mut Accelerator,
        steps: u32,
    ) -> Result<(Duration, StepReport), zynq_pgs::Error> {
        let begun = self.port.now();
        let mut report = self.submit(accelerator)?.wait(&mut self.bodies())?;
        for _ in 1..steps {
            report = self.submit(accelerator)?.wait(&mut self.bodies())?;
        }
        Ok(((self.port.now() - begun) / steps, report))
    }

    /// Packs each step while the one before it is on the board; returns the time from the start of
    /// the first step to that of the last.
    fn overlapped(
        &self,
        accelerator: &mut Accelerator,
        steps: u32,
    ) -> Result<Duration, zynq_pgs::Error> {
        let mut flight = self.submit(accelerator)?;
        let begun = self.port.now();
        for _ in 0..steps {
            let next = flight.prepare(&self.bodies(), &self.collisions(), &self.parameters)?;
            let (ended, started) = flight.wait_and_start(&mut self.bodies(), &next);
            ended?;
            flight = started?;
        }
        let each = (self.port.now() - begun) / steps;
        flight.wait(&mut self.bodies())?;
        Ok(each)
    }
}

fn main() -> ExitCode {
    bench::exit_code(run(&Options::parse()))
}

fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    let step = match &options.input {
        Some(path) => Step::load(path)?,
        None => Step::of_pile(&Pile::standing(options.grid, 1), BoardConfig::default())?,
    };
    let Step { name, shapes, bodies, collisions, mut parameters } = step;
    let steps = u32::try_from(options.common.runs())?;
    let emulated = EmulatedBoard::new(BoardConfig::default())?;
    let board = BoardChoice::Emulated(emulated.cpu_port());
    let mut accelerator = Accelerator::open(OpenOptions { board, ..Default::default() })?;
    accelerator.set_shapes(&shapes)?;
    parameters.order = Some(Order::HazardFree);
    let mut job = Job {
        bodies: &bodies,
        collisions: &collisions,
        parameters,
        pack: Duration::ZERO,
        unpack: Duration::ZERO,
        port: emulated.cpu_port(),
    };
    // First without the assumed host times; the first step allocates all memory.
    let (_, alone) = job.serial(&mut accelerator, 2)?;
    let on_board = alone.modelled_time();
    job.pack = options.pack_ms;
    // The collisions are packed once, however often they are streamed.
    let passes = u64::from(alone.passes).max(1);
    let packed = alone.bytes_to_device.saturating_sub(alone.bytes_from_device) / passes
        + alone.bytes_from_device;
    job.unpack = options.pack_ms.mul_f64(alone.bytes_from_device as f64 / packed.max(1) as f64);
    let (serial, _) = job.serial(&mut accelerator, steps)?;
    let each = job.overlapped(&mut accelerator, steps)?;
    let host = job.pack + job.unpack;
    let longer = host.max(on_board);
    let ratio = each.as_secs_f64() / longer.as_secs_f64();
    let ms = milliseconds;
    println!(
        "{name}: {} bodies, {} collisions, {} steps, on the board's clock\n",
        job.bodies.len(),
        job.collisions.len(),
        steps
    );
    println!("pack      {:>8.3} ms  given", ms(job.pack));
    println!("unpack    {:>8.3} ms  as packing, by bytes", ms(job.unpack));
    println!("board     {:>8.3} ms  {} cycles", ms(on_board), alone.cycles.total);
    println!("serial    {:>8.3} ms  a step", ms(serial));
    println!("overlapped{:>8.3} ms  a step, {ratio:.3} of the longer of the two", ms(each));
    Ok(())
}
