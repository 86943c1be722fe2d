//! The verb `formats`: how large the numbers of a step are, and what sixteen bits leave of them.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};
use zynq_pgs::{Body, CONTACT_POINTS, Collision, StepParameters};

use super::SCHEMA;
use super::run::progress_bar;
use super::table::{Column, grouped, heading, line, number};
use crate::args::CommonArgs;
use crate::board;
use crate::deviation::share;
use crate::failure::{Failure, Verdict};
use crate::folder::Folder;
use crate::interrupt::Interrupt;
use crate::options::{BuildArgs, DeadlineArgs};
use crate::scenes::SceneArgs;
use crate::sixteen::Sixteen;

const EXAMPLES: &str = "\
Examples:
  pgs formats --input vectors/full_step186
  pgs formats --grid 10x10x10 --step 70 --json

The numbers are those that a step streams to the board; contact points that are not used, indices and
counts are left out. \"as streamed\" has the positions of both bodies with every collision, \"each once\"
only with the bodies. What is relative is less the position of body A, as the profile mixed streams
it, and in neither sum.

Relative errors are |read back - number| / |number|; zeros are left out of them, and of the share
below 3e-5. The driver refuses a number that a format cannot carry.";

/// What numbers below this are counted by: thesis16 has none, but for 2^-15 = 3.05e-5.
const SMALL: f32 = 3e-5;
/// An error up to which a number counts as the same.
const ONE_PERCENT: f64 = 0.01;

/// Show how large the numbers of a step are, and the errors of 16-bit formats on them.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct FormatsArgs {
    /// The step in this folder of .npy arrays instead of one of a scene.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["SceneArgs", "BuildArgs", "step"])]
    input: Option<PathBuf>,
    /// Which step of the scene; those before it are taken first.
    #[arg(long, value_name = "N", default_value_t = 70, value_parser = clap::value_parser!(u32).range(1..))]
    step: u32,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    deadline: DeadlineArgs,
    #[command(flatten)]
    build: BuildArgs,
}

/// Of which sums numbers are a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    /// Of both.
    Given,
    /// Streamed with every collision, though the bodies have them already.
    Repeated,
    /// Of none: streamed by another profile.
    Relative,
}

/// The two sums: their names, and whether numbers are in them.
const SUMS: [(&str, fn(Part) -> bool); 2] =
    [("as streamed", |part| part != Part::Relative), ("each once", |part| part == Part::Given)];

/// The numbers of one kind.
struct Numbers {
    name: &'static str,
    part: Part,
    values: Vec<f32>,
}

/// What a format leaves of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Loss {
    numbers: u64,
    zeros: u64,
    /// Numbers that it cannot carry.
    refused: u64,
    relative_sum: f64,
    under: u64,
    largest_absolute: f64,
}

impl Loss {
    fn of<'a>(format: Sixteen, values: impl Iterator<Item = &'a f32>) -> Self {
        let mut loss = Self::default();
        for &value in values {
            loss.numbers += 1;
            let Some(back) = format.round_trip(value) else {
                loss.refused += 1;
                continue;
            };
            let error = (f64::from(back) - f64::from(value)).abs();
            if error > loss.largest_absolute {
                loss.largest_absolute = error;
            }
            if value == 0.0 {
                loss.zeros += 1;
                continue;
            }
            let relative = error / f64::from(value).abs();
            loss.relative_sum += relative;
            loss.under += u64::from(relative < ONE_PERCENT);
        }
        loss
    }

    /// Numbers that have a relative error.
    fn counted(&self) -> u64 {
        self.numbers - self.zeros - self.refused
    }

    /// Mean relative error.
    fn mean(&self) -> f64 {
        if self.counted() == 0 { 0.0 } else { self.relative_sum / self.counted() as f64 }
    }

    /// Share of the numbers with an error that is below 1 %.
    fn under_share(&self) -> f64 {
        share(self.under, self.counted())
    }

    fn to_json(self) -> Value {
        json!({
            "refused": self.refused,
            "relative_mean_percent": self.mean() * 100.0,
            "under_1_percent_share": self.under_share(),
            "absolute_largest": self.largest_absolute,
        })
    }
}

/// How large numbers are.
#[derive(Debug, Clone, PartialEq, Default)]
struct Sizes {
    numbers: u64,
    zeros: u64,
    /// Without zeros.
    small: u64,
    smallest: Option<f32>,
    largest: Option<f32>,
    /// By the exponent of ten; zeros are in none.
    decades: BTreeMap<i32, u64>,
}

impl Sizes {
    fn of<'a>(values: impl Iterator<Item = &'a f32>) -> Self {
        let mut sizes = Self::default();
        for size in values.map(|value| value.abs()) {
            sizes.numbers += 1;
            if size == 0.0 {
                sizes.zeros += 1;
                continue;
            }
            sizes.small += u64::from(size < SMALL);
            if sizes.smallest.is_none_or(|smallest| size < smallest) {
                sizes.smallest = Some(size);
            }
            if sizes.largest.is_none_or(|largest| size > largest) {
                sizes.largest = Some(size);
            }
            *sizes.decades.entry(decade(size)).or_default() += 1;
        }
        sizes
    }

    /// Share of the small numbers in those that are not 0.
    fn small_share(&self) -> f64 {
        let others = self.numbers - self.zeros;
        if others == 0 { 0.0 } else { self.small as f64 / others as f64 }
    }

    fn to_json(&self) -> Value {
        let decades: Vec<Value> = self
            .decades
            .iter()
            .map(|(exponent, numbers)| json!({ "exponent": exponent, "numbers": numbers }))
            .collect();
        json!({
            "numbers": self.numbers,
            "zeros": self.zeros,
            "smallest": self.smallest,
            "largest": self.largest,
            "below_3e-5_share_of_others": self.small_share(),
            "decades": decades,
        })
    }
}

/// The exponent of ten of a magnitude above 0, as it is printed: exact where a logarithm rounds.
fn decade(size: f32) -> i32 {
    let text = format!("{size:e}");
    text.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0)
}

/// The numbers of a step, kind by kind.
fn numbers(bodies: &[Body], collisions: &[Collision]) -> Vec<Numbers> {
    let of_bodies = |name, field: fn(&Body) -> &[f32]| Numbers {
        name,
        part: Part::Given,
        values: bodies.iter().flat_map(field).copied().collect(),
    };
    let position = |body: u32| {
        let body = usize::try_from(body).ok().and_then(|index| bodies.get(index));
        body.map_or([f32::NAN; 3], |body| body.pose.position)
    };
    let used = |collision: &Collision| {
        let count = usize::try_from(collision.count).unwrap_or(CONTACT_POINTS);
        count.min(CONTACT_POINTS)
    };
    let of_pairs = |name, part, of: &dyn Fn(&Collision) -> Vec<f32>| Numbers {
        name,
        part,
        values: collisions.iter().flat_map(of).filter(|value| !value.is_nan()).collect(),
    };
    let points = |collision: &Collision, of: &dyn Fn([f32; 3]) -> [f32; 3]| -> Vec<f32> {
        collision.contacts[..used(collision)].iter().flat_map(|c| of(c.point)).collect()
    };
    vec![
        of_bodies("velocity", |body| &body.velocity.linear),
        of_bodies("spin", |body| &body.velocity.angular),
        of_pairs("normal", Part::Given, &|c| c.normal.to_vec()),
        of_pairs("positions of A and B", Part::Repeated, &|c| {
            [position(c.body_a), position(c.body_b)].concat()
        }),
        of_pairs("contact points", Part::Given, &|c| points(c, &|point| point)),
        of_pairs("distances", Part::Given, &|c| {
            c.contacts[..used(c)].iter().map(|contact| contact.distance).collect()
        }),
        of_bodies("position", |body| &body.pose.position),
        of_bodies("orientation", |body| &body.pose.orientation),
        of_pairs("relative: B - A", Part::Relative, &|c| {
            less(position(c.body_b), position(c.body_a)).to_vec()
        }),
        of_pairs("relative: points - A", Part::Relative, &|c| {
            points(c, &|point| less(point, position(c.body_a)))
        }),
    ]
}

/// a - b.
fn less(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Shows the numbers.
pub(crate) fn run(
    args: &FormatsArgs,
    common: &CommonArgs,
    out: &mut dyn Write,
) -> Result<Verdict, Failure> {
    let (bodies, collisions) = match &args.input {
        Some(path) => {
            let folder = Folder::load(path).map_err(|error| {
                Failure::input(error).next("`pgs solve --help` lists the arrays of a folder")
            })?;
            (folder.bodies, folder.collisions)
        }
        None => match stepped(args, common)? {
            Some(found) => found,
            None => return Ok(Verdict::Interrupted),
        },
    };
    let kinds = numbers(&bodies, &collisions);
    if common.json {
        let config = match &args.input {
            Some(path) => json!({ "input": path.display().to_string() }),
            None => {
                let mut config = args.scene.to_json();
                config["step"] = args.step.into();
                config
            }
        };
        let document = json!({
            "schema": SCHEMA,
            "verb": "formats",
            "config": config,
            "bodies": bodies.len(),
            "collisions": collisions.len(),
            "as_streamed": described(sum(&kinds, SUMS[0].1)),
            "each_once": described(sum(&kinds, SUMS[1].1)),
            "kinds": kinds
                .iter()
                .map(|kind| {
                    let mut value = described(kind.values.iter());
                    value["name"] = kind.name.into();
                    value["in_sums"] = SUMS
                        .iter()
                        .filter(|(_, has)| has(kind.part))
                        .map(|(name, _)| *name)
                        .collect();
                    value
                })
                .collect::<Vec<_>>(),
        });
        writeln!(out, "{document:#}")?;
    } else {
        match &args.input {
            Some(path) => writeln!(out, "input      {}", path.display())?,
            None => writeln!(out, "scene      {}, step {}", args.scene.text(), args.step)?,
        }
        print(&kinds, bodies.len(), collisions.len(), out)?;
    }
    Ok(Verdict::Done)
}

/// Bodies and collisions of the scene's step; nothing if Ctrl-C came before it.
fn stepped(
    args: &FormatsArgs,
    common: &CommonArgs,
) -> Result<Option<(Vec<Body>, Vec<Collision>)>, Failure> {
    let mut opened = board::open(common, &args.build)?;
    args.scene.check_size(&opened)?;
    let mut scene = args.scene.build()?;
    opened.accelerator.set_shapes(scene.shapes()).map_err(|error| opened.failure(error))?;
    let parameters = args.deadline.apply(StepParameters::default());
    let interrupt = Interrupt::install();
    let progress = progress_bar(args.step);
    for _ in 1..args.step {
        if interrupt.is_set() {
            progress.finish_and_clear();
            return Ok(None);
        }
        scene.detect();
        let (bodies, collisions) = scene.parts_mut();
        opened
            .accelerator
            .step(bodies, collisions, &parameters)
            .map_err(|error| opened.failure(error))?;
        progress.inc(1);
    }
    progress.finish_and_clear();
    scene.detect();
    Ok(Some((scene.bodies().to_vec(), scene.collisions().to_vec())))
}

/// The numbers of a sum.
fn sum(kinds: &[Numbers], has: fn(Part) -> bool) -> impl Iterator<Item = &f32> + Clone {
    kinds.iter().filter(move |kind| has(kind.part)).flat_map(|kind| &kind.values)
}

fn described<'a>(values: impl Iterator<Item = &'a f32> + Clone) -> Value {
    let mut value = Sizes::of(values.clone()).to_json();
    for format in Sixteen::ALL {
        value["formats"][format.name()] = Loss::of(format, values.clone()).to_json();
    }
    value
}

const COLUMNS: [Column; 14] = [
    Column { name: "", unit: "", width: 20 },
    Column { name: "numbers", unit: "", width: 10 },
    Column { name: "smallest", unit: "not 0", width: 9 },
    Column { name: "largest", unit: "", width: 9 },
    Column { name: "< 3e-5", unit: "%", width: 8 },
    Column { name: "binary16", unit: "mean %", width: 9 },
    Column { name: "binary16", unit: "% < 1 %", width: 8 },
    Column { name: "binary16", unit: "most", width: 9 },
    Column { name: "thesis16", unit: "mean %", width: 9 },
    Column { name: "thesis16", unit: "% < 1 %", width: 8 },
    Column { name: "thesis16", unit: "most", width: 9 },
    Column { name: "literal", unit: "mean %", width: 9 },
    Column { name: "literal", unit: "% < 1 %", width: 8 },
    Column { name: "literal", unit: "most", width: 9 },
];

fn print(
    kinds: &[Numbers],
    bodies: usize,
    collisions: usize,
    out: &mut dyn Write,
) -> io::Result<()> {
    let (bodies, collisions) = (grouped(bodies as u64), grouped(collisions as u64));
    writeln!(out, "step       {bodies} bodies, {collisions} collisions")?;
    writeln!(out)?;
    heading(out, &COLUMNS)?;
    for kind in kinds {
        line(out, &COLUMNS, cells(kind.name, kind.values.iter()))?;
    }
    for (name, has) in SUMS {
        line(out, &COLUMNS, cells(name, sum(kinds, has)))?;
    }

    let streamed = || sum(kinds, SUMS[0].1);
    let sizes = Sizes::of(streamed());
    writeln!(out)?;
    writeln!(out, "{} by size", SUMS[0].0)?;
    let percent = |part: u64| 100.0 * part as f64 / sizes.numbers.max(1) as f64;
    writeln!(out, "  {:<14} {:>11} {:>9.4} %", "0", grouped(sizes.zeros), percent(sizes.zeros))?;
    for (exponent, &count) in &sizes.decades {
        let range = format!("1e{exponent} .. 1e{}", exponent + 1);
        writeln!(out, "  {range:<14} {:>11} {:>9.4} %", grouped(count), percent(count))?;
    }
    for format in Sixteen::ALL {
        let refused = Loss::of(format, streamed()).refused;
        if refused > 0 {
            let name = format.name();
            writeln!(out, "{} of them are beyond what {name} carries", grouped(refused))?;
        }
    }
    Ok(())
}

fn cells<'a>(name: &str, values: impl Iterator<Item = &'a f32> + Clone) -> Vec<String> {
    let sizes = Sizes::of(values.clone());
    let size = |size: Option<f32>| size.map_or_else(|| "-".to_owned(), |size| number(size.into()));
    let mut cells = vec![
        format!("{name:<20}"),
        grouped(sizes.numbers),
        size(sizes.smallest),
        size(sizes.largest),
        number(sizes.small_share() * 100.0),
    ];
    for format in Sixteen::ALL {
        let loss = Loss::of(format, values.clone());
        cells.push(number(loss.mean() * 100.0));
        cells.push(number(loss.under_share() * 100.0));
        cells.push(number(loss.largest_absolute));
    }
    cells
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_counted_by_decade() {
        let sizes = Sizes::of([0.0, 1e-6, -2.9e-5, 3.1e-5, 1.0, -9.99, 10.0, 400.0].iter());
        assert_eq!((sizes.numbers, sizes.zeros, sizes.small), (8, 1, 2));
        assert!((sizes.small_share() - 2.0 / 7.0).abs() < 1e-12);
        assert_eq!((sizes.smallest, sizes.largest), (Some(1e-6), Some(400.0)));
        let decades: Vec<(i32, u64)> = sizes.decades.into_iter().collect();
        assert_eq!(decades, [(-6, 1), (-5, 2), (0, 2), (1, 1), (2, 1)]);
    }

    #[test]
    fn the_numbers_of_a_step_are_those_of_its_records() {
        use zynq_pgs::{Contact, Pose, Velocity};
        let body = |x| Body {
            pose: Pose { position: [x, 0.0, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] },
            velocity: Velocity::default(),
            shape: 0,
        };
        let contacts = [Contact { point: [1.5, 0.5, 0.0], distance: -0.25 }; CONTACT_POINTS];
        let collision =
            Collision { body_a: 0, body_b: 1, normal: [-1.0, 0.0, 0.0], count: 2, contacts };
        let kinds = numbers(&[body(1.0), body(3.0)], &[collision]);
        let of = |name| &kinds.iter().find(|kind| kind.name == name).expect(name).values[..];
        assert_eq!(of("distances"), [-0.25, -0.25]);
        assert_eq!(of("contact points").len(), 6);
        assert_eq!(of("positions of A and B"), [1.0, 0.0, 0.0, 3.0, 0.0, 0.0]);
        assert_eq!(of("relative: B - A"), [2.0, 0.0, 0.0]);
        assert_eq!(of("relative: points - A")[..3], [0.5, 0.5, 0.0]);
        // 13 a body, 3 + 6 + 2 x 4 the collision.
        assert_eq!(sum(&kinds, SUMS[0].1).count(), 2 * 13 + 17);
        assert_eq!(sum(&kinds, SUMS[1].1).count(), 2 * 13 + 11);
    }

    #[test]
    fn powers_of_ten_begin_their_decade() {
        for exponent in -37..=38 {
            let power: f32 = format!("1e{exponent}").parse().expect("a number");
            assert_eq!(decade(power), exponent);
        }
    }

    #[test]
    fn losses_leave_zeros_out_of_what_is_relative() {
        // 100.03 is read back as 100.0, 0 as 2^-15, 1e5 not at all.
        let values = [0.0, 1.0, 100.03, 1e5];
        let loss = Loss::of(Sixteen::Thesis16, values.iter());
        assert_eq!((loss.numbers, loss.zeros, loss.refused, loss.under), (4, 1, 1, 2));
        assert!((loss.mean() - 0.03 / 100.03 / 2.0).abs() < 1e-7, "{loss:?}");
        assert!((loss.largest_absolute - 0.03).abs() < 1e-5, "{loss:?}");
        let zero = Loss::of(Sixteen::Thesis16, [0.0].iter());
        assert!((zero.largest_absolute - 2.0_f64.powi(-15)).abs() < 1e-12);
        assert!((zero.under_share() - 1.0).abs() < 1e-12);
    }
}
