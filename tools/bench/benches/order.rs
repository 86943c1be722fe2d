//! The time of ordering a step's collisions, relative to packing them in that order.
//!
//! ```sh
//! cargo bench --bench order
//! cargo bench --bench order -- --grid 10x10x10 --steps 4
//! cargo bench --bench order -- --order interleaved
//! ```
//!
//! The thesis' cubes, standing on the ground, are stepped on the emulated board. The first step
//! shows what ordering costs with no memory of its own yet; on the following ones ordering, its
//! verification, and packing run in turn. Ordering includes reading the caller's bodies and
//! collisions; packing is that of four channels and f32 records.

#![forbid(unsafe_code)]
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command")]

use std::error::Error;
use std::hint::black_box;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use bench::options::{Common, Pile, Sent};
use bench::{Run, medians, milliseconds, ratio};
use bitstream_model::interface::profile::FLOAT;
use bitstream_model::{BoardConfig, EmulatedBoard};
use clap::Parser;
use scene::{Scene, SceneOptions};
use zynq_pgs::bench::CollisionPacker;
use zynq_pgs::order::{Checker, InputBuffers, IssueWindow, Order, Ordered, Orderer};
use zynq_pgs::{Accelerator, BoardChoice, OpenOptions, StepParameters};

/// Compares ordering the collisions of a step with packing them in that order.
#[derive(Debug, Parser)]
#[command(name = "cargo bench --bench order --")]
struct Options {
    #[command(flatten)]
    pile: Pile,
    /// The order to make, one without hazards
    #[arg(long, value_enum, default_value_t = Sent::HazardFree)]
    order: Sent,
    #[command(flatten)]
    common: Common,
}

/// Times of one step.
struct Row {
    step: u32,
    collisions: usize,
    empty: usize,
    first: bool,
    order: Duration,
    verify: Duration,
    pack: Duration,
    pack_as_given: Duration,
}

impl Row {
    fn ratio(&self) -> f64 {
        ratio(self.order, self.pack)
    }

    fn print(&self) {
        println!(
            "{:>5} {:>10} {:>6} {:>9.3} {:>9.3} {:>9.3} {:>9.3} {:>7.2}{}",
            self.step,
            self.collisions,
            self.empty,
            milliseconds(self.order),
            milliseconds(self.verify),
            milliseconds(self.pack),
            milliseconds(self.pack_as_given),
            self.ratio(),
            if self.first { "  (once, without memory of its own)" } else { "" },
        );
    }
}

/// The order, and the buffers that a step keeps for the next.
struct Kept {
    order: Order,
    buffers: InputBuffers,
    orderer: Orderer,
    checker: Checker,
    packer: CollisionPacker,
}

impl Kept {
    fn new(order: Order) -> Self {
        Self {
            order,
            buffers: InputBuffers::new(),
            orderer: Orderer::new(),
            checker: Checker::new(),
            packer: CollisionPacker::new(FLOAT.default_variant()),
        }
    }
}

fn main() -> ExitCode {
    bench::exit_code(run(&Options::parse()))
}

fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    let (Pile { grid, drop, steps }, runs) = (options.pile, options.common.runs());
    let scene = SceneOptions { grid, drop, ..Default::default() };
    let mut scene = Scene::new(&scene)?;
    let emulated = EmulatedBoard::new(BoardConfig::default())?;
    let board = BoardChoice::Emulated(emulated.cpu_port());
    let mut accelerator = Accelerator::open(OpenOptions { board, ..Default::default() })?;
    accelerator.set_shapes(scene.shapes())?;
    let window = IssueWindow::of(accelerator.capabilities())?;
    let order = options.order.name();
    println!(
        "{grid} cubes dropped from {drop} m, {order}, depth {} issue slots, medians of {runs} \
         runs in turn\n",
        window.depth(),
    );
    println!(" step collisions  empty     order    verify      pack      pack   order");
    println!("                               ms        ms  in order  as given by pack");
    let mut kept = Kept::new(options.order.made()?);
    for step in 1..=steps {
        scene.detect();
        measure(step, runs, &scene, &mut kept, window)?.print();
        let (bodies, collisions) = scene.parts_mut();
        accelerator.step(bodies, collisions, &StepParameters::default())?;
    }
    Ok(())
}

/// Orders, verifies and packs the collisions of one step.
fn measure(
    step: u32,
    runs: usize,
    scene: &Scene,
    kept: &mut Kept,
    window: IssueWindow,
) -> Result<Row, Box<dyn Error>> {
    let (bodies, collisions, shapes) = (scene.bodies(), scene.collisions(), scene.shapes());
    let Kept { order: wanted, buffers, orderer, checker, packer } = kept;
    let wanted = *wanted;
    let first = step == 1;
    let begin = Instant::now();
    buffers.gather(bodies, collisions, shapes);
    let schedule = orderer.order(&buffers.input(), wanted, window)?.clone();
    let once = begin.elapsed();
    let input = buffers.input();
    if wanted.is_hazard_free() {
        checker.verify(&schedule, &input, window)?;
    }
    let empty = schedule.empty();

    let ordered = Ordered { collisions, schedule: &schedule };
    let mut as_given = CollisionPacker::new(FLOAT.default_variant());
    let mut again = InputBuffers::new();
    let mut contestants: [Run<'_>; 4] = [
        Box::new(|| {
            let input = again.gather(bodies, collisions, shapes);
            let _ = black_box(orderer.order(&input, wanted, window));
        }),
        Box::new(|| {
            let _ = black_box(checker.verify(&schedule, &input, window));
        }),
        Box::new(|| {
            black_box(packer.pack(bodies, &ordered, shapes));
        }),
        Box::new(|| {
            black_box(as_given.pack(bodies, collisions, shapes));
        }),
    ];
    // Once without measuring, so that all memory is allocated.
    medians(1, &mut contestants);
    let medians = medians(runs, &mut contestants);
    let [order, verify, pack, pack_as_given] = medians[..] else {
        return Err("a time for each".into());
    };
    let order = if first { once } else { order };
    let collisions = collisions.len();
    Ok(Row { step, collisions, empty, first, order, verify, pack, pack_as_given })
}
