//! The time of packing and unpacking a step, relative to `memcpy` of the same bytes.
//!
//! ```sh
//! cargo bench --bench pack
//! cargo bench --bench pack -- --input FOLDER --cpu-time
//! cargo bench --bench pack -- --grid 10x10x10 --runs 31
//! cargo bench --bench pack -- --profile half --thing in-order
//! cargo bench --bench pack -- --threads 2
//! ```
//!
//! The step is one of the thesis' cubes, standing on the ground, or the one in a folder of arrays
//! (`--input`). One thread does everything, unless `--threads` asks for more. Each item is measured
//! alone: it and a `memcpy` from warm memory to warm memory run in turn. The first runs of a
//! stretch fill the caches with the item's buffers and do not count. The output has the bytes
//! written, medians, GB/s of these bytes, and the throughput relative to that of `memcpy`.
//!
//! - `bodies`: velocities and poses, and what collisions need of bodies
//! - `as given`, `in order`: bodies, then collisions in array order and in the order without
//!   hazards, in the window of `float`
//! - `warm`: the same in order, with impulses to begin with
//! - `unpack`: results with their checks, into the driver's own memory, where they are f32
//! - `commit`: from there to the caller's bodies
//!
//! With `--threads` packing and unpacking are also compared with one thread, in the same turns.
//! `memcpy` and the other items use one thread only; the other items are left out.
//!
//! `--cpu-time` measures the time of the running thread instead of the wall time, which is far
//! longer on a busy machine.

#![forbid(unsafe_code)]
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command")]

use std::error::Error;
use std::hint::black_box;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use bench::options::{Common, Pile};
use bench::step::Step;
use bench::{Clock, Run, STRETCH, milliseconds, ratio, warm_medians};
use bitstream_model::BoardConfig;
use bitstream_model::interface::profile::{FLOAT, HALF, Profile};
use bitstream_model::interface::record::{BEAT_BYTES, Beat};
use clap::{Parser, ValueEnum};
use scene::Grid;
use zynq_pgs::bench::{StepPacker, Unpacker};
use zynq_pgs::order::{Ordered, Schedule};
use zynq_pgs::{Collision, Impulses, InputError, StepParameters, WarmCollisions};

/// Compares packing and unpacking with `memcpy` of the same bytes.
#[derive(Debug, Parser)]
#[command(name = "cargo bench --bench pack --")]
struct Options {
    /// Cubes along each axis, standing; y is up
    #[arg(long, value_name = "NXxNYxNZ", default_value_t, conflicts_with = "input")]
    grid: Grid,
    /// Take the step from this folder of arrays instead of a pile
    #[arg(long, value_name = "DIR")]
    input: Option<PathBuf>,
    /// Threads that pack and unpack; several are compared with one, too
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1,
        value_parser = clap::value_parser!(u16).range(1..=64)
    )]
    threads: u16,
    /// Measure the time of the running thread, not the wall time
    #[arg(long, conflicts_with = "threads")]
    cpu_time: bool,
    /// Measure this profile only: float or half
    #[arg(long, value_name = "NAME")]
    profile: Option<String>,
    /// Measure this item only
    #[arg(long, value_enum)]
    thing: Option<Thing>,
    #[command(flatten)]
    common: Common,
}

/// One profile for each set of formats.
const MEASURED: [&Profile; 2] = [&FLOAT, &HALF];

impl Options {
    fn profiles(&self) -> Result<Vec<&'static Profile>, String> {
        let wanted = |profile: &&Profile| self.profile.as_ref().is_none_or(|it| it == profile.name);
        let profiles: Vec<_> = MEASURED.into_iter().filter(wanted).collect();
        if profiles.is_empty() {
            return Err(format!(
                "--profile is one of {}",
                MEASURED.map(|profile| profile.name).join(", ")
            ));
        }
        Ok(profiles)
    }

    fn step(&self) -> Result<Step, Box<dyn Error>> {
        match &self.input {
            Some(folder) => Step::load(folder),
            None => Step::of_pile(&Pile::standing(self.grid, 1), BoardConfig::default()),
        }
    }

    fn things(&self) -> impl Iterator<Item = Thing> {
        let wanted = |thing: &Thing| self.thing.is_none_or(|wanted| wanted == *thing);
        let several = |thing: &Thing| self.threads == 1 || thing.is_shared();
        Thing::value_variants().iter().copied().filter(wanted).filter(several)
    }

    fn clock(&self) -> Clock {
        if self.cpu_time { Clock::Thread } else { Clock::Wall }
    }
}

/// An item to measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Thing {
    Bodies,
    AsGiven,
    InOrder,
    Warm,
    Unpack,
    Commit,
}

impl Thing {
    /// Whether several threads share the work.
    const fn is_shared(self) -> bool {
        !matches!(self, Self::Commit)
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Bodies => "bodies",
            Self::AsGiven => "as given",
            Self::InOrder => "in order",
            Self::Warm => "warm",
            Self::Unpack => "unpack",
            Self::Commit => "commit",
        }
    }
}

/// An item's bytes, its time and that of `memcpy`, and its time on one thread if there are several.
struct Row {
    profile: &'static Profile,
    thing: Thing,
    bytes: usize,
    time: Duration,
    copy: Duration,
    alone: Option<Duration>,
}

impl Row {
    fn rate(&self, time: Duration) -> f64 {
        self.bytes as f64 / time.as_secs_f64() / 1e9
    }

    fn print(&self) {
        print!(
            "{:<8} {:<17} {:>6.2} {:>8.3} {:>6.2} {:>8.3} {:>6.2} {:>7.2}",
            self.profile.name,
            self.thing.name(),
            self.bytes as f64 / 1e6,
            milliseconds(self.time),
            self.rate(self.time),
            milliseconds(self.copy),
            self.rate(self.copy),
            ratio(self.copy, self.time),
        );
        if let Some(alone) = self.alone {
            print!(" {:>8.3} {:>7.2}", milliseconds(alone), ratio(alone, self.time));
        }
        println!();
    }
}

fn main() -> ExitCode {
    bench::exit_code(run(&Options::parse()))
}

fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    let chosen = options.profiles()?;
    let step = options.step()?;
    let schedule = step.schedule(BoardConfig::default())?;
    let clock = if options.cpu_time { "the thread's time" } else { "time that passes" };
    println!(
        "{}: {} bodies, {} collisions; in order is hazard-free, {} empty entries; medians of {} \
         stretches of {STRETCH} runs in turn, {clock}; {} threads\n",
        step.name,
        step.bodies.len(),
        step.collisions.len(),
        schedule.empty(),
        options.common.runs(),
        options.threads,
    );
    print!("{:<27}{:>6} {:>8} {:>6} {:>15} {:>7}", "", "MB", "ms", "GB/s", "memcpy", "of it");
    if options.threads > 1 {
        print!(" {:>8} {:>7}", "1 thread", "as fast");
    }
    println!();
    for profile in chosen {
        for thing in options.things() {
            measure(profile, thing, &step, &schedule, options)?.print();
        }
    }
    Ok(())
}

/// Measures one item beside `memcpy` of its bytes, all in memory of its own.
fn measure(
    profile: &'static Profile,
    thing: Thing,
    step: &Step,
    schedule: &Schedule,
    options: &Options,
) -> Result<Row, Box<dyn Error>> {
    let Step { bodies, collisions, shapes, .. } = step;
    let impulses = vec![Impulses { normal: [1.0; 4], friction: [0.5; 2] }; collisions.len()];
    let warm = &WarmCollisions { collisions, impulses: &impulses };
    let ordered = &Ordered { collisions: warm, schedule };
    let variant = profile.default_variant();
    let mut threads = vec![Some(usize::from(options.threads))];
    if options.threads > 1 {
        threads.push(Some(1));
    }
    let packer = |threads: &Option<usize>| StepPacker::new(variant, *threads);
    let unpacker = |threads: &Option<usize>| Unpacker::new(variant, bodies, shapes, *threads);
    let mut packers: Vec<StepPacker> = threads.iter().map(packer).collect();
    let mut unpackers: Vec<Unpacker> = match thing {
        Thing::Unpack | Thing::Commit => threads.iter().map(unpacker).collect(),
        _ => Vec::new(),
    };
    let mut moved = bodies.clone();
    // The unpacked results are input of a later item. A refused scene stops here: otherwise the
    // benchmark would measure the refusal.
    for unpacker in &mut unpackers {
        unpacker.unpack(bodies).ok_or("the results are refused")?;
    }
    for packer in &mut packers {
        pack(thing, packer, step, ordered)?.ok_or("the step is refused")?;
    }
    let [of_bodies, of_collisions] = packers[0].bytes(bodies.len(), collisions.len());
    let [_, of_entries] = packers[0].bytes(bodies.len(), schedule.len());
    let bytes = match thing {
        Thing::Bodies => of_bodies,
        Thing::AsGiven => of_bodies + of_collisions,
        // The warm passes have few collisions beside the other passes.
        Thing::InOrder | Thing::Warm => of_bodies + of_entries,
        Thing::Unpack | Thing::Commit => Unpacker::bytes(bodies.len()),
    };
    let buffer = || vec![Beat([1; 4]); bytes / BEAT_BYTES];
    let (from, mut to) = (buffer(), buffer());
    let mut contestants: Vec<Run<'_>> = vec![Box::new(|| {
        to.copy_from_slice(black_box(&from));
        black_box(&to);
    })];
    match thing {
        Thing::Unpack => contestants.extend(unpackers.iter_mut().map(|unpacker| -> Run<'_> {
            Box::new(|| {
                black_box(unpacker.unpack(black_box(bodies)));
            })
        })),
        Thing::Commit => contestants.push(Box::new(|| {
            unpackers[0].commit(&mut moved);
            black_box(&moved);
        })),
        _ => contestants.extend(packers.iter_mut().map(|packer| -> Run<'_> {
            Box::new(move || {
                let _ = black_box(pack(thing, packer, black_box(step), ordered));
            })
        })),
    }
    let times = warm_medians(options.common.runs(), options.clock(), &mut contestants);
    let [copy, time, alone @ ..] = &times[..] else { return Err("a time for each".into()) };
    let (copy, time, alone) = (*copy, *time, alone.first().copied());
    Ok(Row { profile, thing, bytes, time, copy, alone })
}

/// Packs an item; the sum of the words, unless something is refused.
fn pack(
    thing: Thing,
    packer: &mut StepPacker,
    step: &Step,
    ordered: &Ordered<'_, WarmCollisions<'_, Vec<Collision>>>,
) -> Result<Option<u32>, InputError> {
    let Step { bodies, collisions, shapes, .. } = step;
    let with = (Some(ordered.schedule.empty()), &StepParameters::thesis());
    match thing {
        Thing::Bodies => packer.pack(bodies, &[][..], shapes, (None, with.1)),
        Thing::AsGiven => packer.pack(bodies, collisions, shapes, (None, with.1)),
        Thing::InOrder => packer.pack(bodies, ordered, shapes, with),
        Thing::Warm => {
            packer.pack(bodies, ordered, shapes, (with.0, &with.1.with_warm_start(true)))
        }
        Thing::Unpack | Thing::Commit => Ok(Some(0)),
    }
}
