//! Packing and unpacking a step against `memcpy` of the same bytes.
//!
//! ```sh
//! PGS_VECTORS=... cargo bench --bench pack
//! cargo bench --bench pack -- --grid 10x10x10 --runs 31 --cpu-time --json
//! ```
//!
//! The step is `full_step186` of the folder that `PGS_VECTORS` names, or else the thesis' cubes
//! standing on the ground. Each row is one profile; memory is warm, one thread does everything, and
//! what is compared runs in turn: bodies alone, collisions in array order and in the order without
//! hazards alone, everything with validation in both orders, results with their checks. Given are
//! GB/s of what is written (of what is read, for results), and the ratio to `memcpy`.
//!
//! `--cpu-time` counts the time that the thread runs instead of the time that passes: where others
//! want the cores too, these are far apart.

#![forbid(unsafe_code)]
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a command")]

use std::cell::RefCell;
use std::error::Error;
use std::hint::black_box;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use bench::{Run, medians};
use bitstream_model::interface::profile::{FLOAT, HALF, MIXED, Profile};
use bitstream_model::interface::record::{BEAT_BYTES, Beat};
use bitstream_model::{BoardConfig, EmulatedBoard};
use nix::time::{ClockId, clock_gettime};
use scene::{Grid, Scene, SceneOptions};
use serde_json::json;
use step_folder::folder::Folder;
use zynq_pgs::bench::{StepPacker, Unpacker};
use zynq_pgs::order::{InputBuffers, IssueWindow, Order, Ordered, Orderer, Schedule};
use zynq_pgs::{Accelerator, BoardChoice, Body, Collision, OpenOptions, Shape, StepParameters};

/// What the command line asks for.
struct Options {
    grid: Option<Grid>,
    runs: usize,
    cpu_time: bool,
    json: bool,
}

impl Options {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self, Box<dyn Error>> {
        let mut options = Self { grid: None, runs: 21, cpu_time: false, json: false };
        while let Some(argument) = arguments.next() {
            let mut value = || arguments.next().ok_or(format!("{argument} needs a value"));
            match argument.as_str() {
                "--grid" => options.grid = Some(value()?.parse()?),
                "--runs" => options.runs = value()?.parse()?,
                "--cpu-time" => options.cpu_time = true,
                "--json" => options.json = true,
                // What cargo adds.
                "--bench" => {}
                other => {
                    return Err(format!(
                        "unknown {other:?}, expected --grid, --runs, --cpu-time or --json"
                    )
                    .into());
                }
            }
        }
        Ok(options)
    }
}

/// A step.
struct Step {
    name: String,
    bodies: Vec<Body>,
    collisions: Vec<Collision>,
    shapes: Vec<Shape>,
}

impl Step {
    fn of(options: &Options) -> Result<Self, Box<dyn Error>> {
        let vectors = std::env::var_os("PGS_VECTORS").filter(|_| options.grid.is_none());
        if let Some(root) = vectors {
            let folder = Folder::load(&PathBuf::from(root).join("full_step186"))?;
            let Folder { bodies, collisions, shapes, .. } = folder;
            return Ok(Self { name: "full_step186".into(), bodies, collisions, shapes });
        }
        let grid = options.grid.unwrap_or_default();
        let mut scene = Scene::new(&SceneOptions { grid, drop: 0.0, ..Default::default() })?;
        scene.detect();
        Ok(Self {
            name: grid.to_string(),
            bodies: scene.bodies().to_vec(),
            collisions: scene.collisions().to_vec(),
            shapes: scene.shapes().to_vec(),
        })
    }

    /// The order without hazards on the default board.
    fn schedule(&self) -> Result<Schedule, Box<dyn Error>> {
        let emulated = EmulatedBoard::new(BoardConfig::default())?;
        let board = BoardChoice::Emulated(emulated.cpu_port());
        let accelerator = Accelerator::open(OpenOptions { board, ..Default::default() })?;
        let window = IssueWindow::of(accelerator.capabilities(), &StepParameters::default())?;
        let mut buffers = InputBuffers::new();
        let input = buffers.gather(&self.bodies, &self.collisions, &self.shapes);
        Ok(Orderer::new().order(&input, Order::HazardFree, window)?.clone())
    }
}

/// What is measured, and of which of the four sizes it is.
const MEASURED: [(&str, usize); 7] = [
    ("bodies", 0),
    ("as given", 1),
    ("in order", 1),
    ("all, as given", 2),
    ("all, in order", 2),
    ("unpack", 3),
    ("commit", 3),
];

/// One profile's bytes, times of `memcpy` of them, and times of what is measured.
struct Row {
    profile: &'static Profile,
    bytes: [usize; 4],
    copies: [Duration; 4],
    times: [Duration; 7],
}

impl Row {
    fn rate(&self, at: usize) -> f64 {
        self.bytes[MEASURED[at].1] as f64 / self.times[at].as_secs_f64() / 1e9
    }

    fn ratio(&self, at: usize) -> f64 {
        self.copies[MEASURED[at].1].as_secs_f64() / self.times[at].as_secs_f64()
    }

    fn print(&self) {
        print!("{:<8}", self.profile.name);
        for at in 0..MEASURED.len() {
            let ms = self.times[at].as_secs_f64() * 1e3;
            print!(" {ms:>7.3} {:>4.1} {:>4.2}", self.rate(at), self.ratio(at));
        }
        println!();
    }

    fn to_json(&self) -> serde_json::Value {
        let measured = (0..MEASURED.len()).map(|at| {
            let entry = json!({
                "bytes": self.bytes[MEASURED[at].1],
                "ms": self.times[at].as_secs_f64() * 1e3,
                "gb_per_s": self.rate(at),
                "memcpy_ms": self.copies[MEASURED[at].1].as_secs_f64() * 1e3,
                "of_memcpy": self.ratio(at),
            });
            (MEASURED[at].0.to_owned(), entry)
        });
        let measured: serde_json::Map<_, _> = measured.collect();
        json!({ "profile": self.profile.name, "threads": 1, "measured": measured })
    }
}

fn main() -> ExitCode {
    match Options::parse(std::env::args().skip(1)).and_then(|options| run(&options)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

fn run(options: &Options) -> Result<(), Box<dyn Error>> {
    let step = Step::of(options)?;
    let schedule = step.schedule()?;
    let clock = if options.cpu_time { "the thread's time" } else { "time" };
    if !options.json {
        println!(
            "{}: {} bodies, {} collisions, {} empty entries in order; medians of {} runs in turn, \
             {clock}\n",
            step.name,
            step.bodies.len(),
            step.collisions.len(),
            schedule.empty(),
            options.runs,
        );
        print!("        ");
        MEASURED.iter().for_each(|(name, _)| print!(" {name:>17}"));
        print!("\n        ");
        MEASURED.iter().for_each(|_| print!("      ms GB/s of m"));
        println!();
    }
    let mut rows = Vec::new();
    for profile in [&FLOAT, &HALF, &MIXED] {
        let row = measure(profile, &step, &schedule, options)?;
        if !options.json {
            row.print();
        }
        rows.push(row);
    }
    if options.json {
        let rows: Vec<_> = rows.iter().map(Row::to_json).collect();
        let document = json!({
            "schema": 1,
            "bench": "pack",
            "step": step.name,
            "bodies": step.bodies.len(),
            "collisions": step.collisions.len(),
            "empty": schedule.empty(),
            "runs": options.runs,
            "clock": clock,
            "profiles": rows,
        });
        println!("{document:#}");
    }
    Ok(())
}

/// Packs and unpacks the step for one profile.
fn measure(
    profile: &'static Profile,
    step: &Step,
    schedule: &Schedule,
    options: &Options,
) -> Result<Row, Box<dyn Error>> {
    let Step { bodies, collisions, shapes, .. } = step;
    let ordered = Ordered { collisions, schedule };
    let variant = profile.default_variant();
    let packer = || {
        let mut packer = StepPacker::new(variant);
        packer.pack_bodies(bodies, shapes);
        packer
    };
    let (mut of_bodies, mut given, mut permuted) = (packer(), packer(), packer());
    let (mut all_given, mut all_permuted) = (packer(), packer());
    let unpacker = RefCell::new(Unpacker::new(variant, bodies.len()));
    let mut moved = bodies.clone();
    // What one cannot say something of is refused, and would be measured as it is refused.
    all_given.pack(bodies, collisions, shapes, false)?.ok_or("the step is refused")?;
    all_permuted.pack(bodies, &ordered, shapes, true)?.ok_or("the step is refused in order")?;

    let [bodies_bytes, collisions_bytes] = given.bytes(bodies.len(), collisions.len());
    let results = unpacker.borrow().bytes();
    let bytes = [bodies_bytes, collisions_bytes, bodies_bytes + collisions_bytes, results];
    let buffers = || bytes.map(|bytes| vec![Beat([1; 4]); bytes / BEAT_BYTES]);
    let (sources, mut targets) = (buffers(), buffers());
    let mut contestants: Vec<Run<'_>> = Vec::new();
    for (from, to) in sources.iter().zip(&mut targets) {
        contestants.push(Box::new(move || {
            to.copy_from_slice(black_box(from));
            black_box(&to);
        }));
    }
    let measured: [Run<'_>; 7] = [
        Box::new(|| {
            black_box(of_bodies.pack_bodies(bodies, shapes));
        }),
        Box::new(|| {
            black_box(given.pack_collisions(collisions, shapes, false));
        }),
        Box::new(|| {
            black_box(permuted.pack_collisions(&ordered, shapes, true));
        }),
        Box::new(|| {
            let _ = black_box(all_given.pack(bodies, collisions, shapes, false));
        }),
        Box::new(|| {
            let _ = black_box(all_permuted.pack(bodies, &ordered, shapes, true));
        }),
        Box::new(|| {
            black_box(unpacker.borrow_mut().unpack(bodies, shapes));
        }),
        Box::new(|| {
            unpacker.borrow().commit(&mut moved);
            black_box(&moved);
        }),
    ];
    contestants.extend(measured);
    let run = |runs, contestants: &mut [Run<'_>]| match options.cpu_time {
        true => cpu_medians(runs, contestants),
        false => medians(runs, contestants),
    };
    // Once without looking, so that all memory is there.
    run(1, &mut contestants);
    let times = run(options.runs, &mut contestants);
    let (copies, times) = times.split_at(bytes.len());
    Ok(Row { profile, bytes, copies: copies.try_into()?, times: times.try_into()? })
}

/// As [`medians`], of the time that this thread runs.
fn cpu_medians(runs: usize, contestants: &mut [Run<'_>]) -> Vec<Duration> {
    let now =
        || clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID).map_or(Duration::ZERO, Duration::from);
    let mut times = vec![Vec::with_capacity(runs); contestants.len()];
    for _ in 0..runs {
        for (run, times) in contestants.iter_mut().zip(&mut times) {
            let begin = now();
            run();
            times.push(now().saturating_sub(begin));
        }
    }
    times
        .into_iter()
        .map(|mut times| {
            times.sort_unstable();
            times.get(times.len() / 2).copied().unwrap_or_default()
        })
        .collect()
}
