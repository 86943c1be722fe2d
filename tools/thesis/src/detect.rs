//! Detects the collisions of a folder's poses, and compares them with the folder's own.

use std::collections::BTreeMap;
use std::path::PathBuf;

use bitstream_model::BoardConfig;
use clap::Args;
use scene::{Scene, penetration};
use zynq_pgs::{Collision, Contact};

use crate::experiment::{Boards, Experiment, Measure, Part};
use crate::session::Session;
use crate::study::given::GivenStep;
use crate::table::{Cell, Table, text};
use pgs_command::board;
use pgs_command::failure::{Failure, Result};
use pgs_command::numbers::{grouped, number};
use pgs_command::step_input;

const EXAMPLES: &str = "\
Examples:
  pgs thesis detection --input tests/golden/pile5_step60
  pgs thesis detection --input tests/golden/two_cubes --json

The folder is one for `pgs solve`. Body 0 is the ground, a box of 800 m whose top is y = 0; every
other body is a cube of 2 m, as in Bullet's demo: a folder says nothing of shapes. Two bodies up to
2 cm apart collide.

The exit code is 1 if a pair deeper than 1 mm is missing or extra. Normals are the same up to 0.01
degrees, points up to 1 mm. docs/thesis.md tells where Bullet's have another place, and why.";

/// The experiment.
pub(crate) static DETECTION: Experiment = Experiment::of::<DetectionArgs>(
    "detection",
    "§2.2.2",
    Boards::None,
    "Our collision detection beside a folder's collisions of the same poses",
);

/// Its arguments.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct DetectionArgs {
    /// The folder of .npy arrays with poses and collisions of one step.
    #[arg(long, value_name = "DIR")]
    input: PathBuf,
}

impl Measure for DetectionArgs {
    /// Detects, and compares.
    fn measure(&self, session: &Session) -> Result<Part> {
        let path = self.input.display().to_string();
        let step = GivenStep::folder(&self.input)?;
        let mut scene = Scene::of_cubes(&step.bodies).map_err(|error| {
            Failure::input(error)
                .about(&path)
                .next("`pgs thesis detection --help` tells which bodies it takes")
        })?;
        check(&step, session)?;
        let collisions = step.collisions.iter().filter(|collision| collision.count > 0);
        let theirs: Vec<(Pair, &Collision)> = collisions.map(|each| (pair(each), each)).collect();
        let compared = Comparison::of(scene.detect(), &theirs.iter().copied().collect());
        if compared.theirs < theirs.len() {
            return Err(Failure::input(format!("{path}: two collisions have the same bodies"))
                .next("join the two"));
        }
        let mut part = compared.part();
        part.fact("input", path);
        let depth = penetration(scene.collisions());
        let collisions = format!(
            "{} of {} bodies, {} of them with the ground; {} points, {} of them penetrating, {} mm \
         deep at most",
            grouped(scene.collisions().len() as u64),
            grouped(scene.bodies().len() as u64),
            grouped(scene.ground_pairs() as u64),
            grouped(depth.contacts),
            grouped(depth.penetrating),
            number(depth.largest * 1e3),
        );
        part.fact("collisions", collisions);
        let [unmatched, points] = [compared.unmatched, compared.our_points].map(grouped);
        part.fact("unmatched", format!("{unmatched} of our {points} points"));
        Ok(part)
    }
}

/// Lets the driver refuse collisions that are none. The solution is not used.
fn check(step: &GivenStep, session: &Session) -> Result<()> {
    let mut opened = board::open(&session.emulated(), BoardConfig::default())?;
    let mut solve = || {
        step_input::set_shapes(&mut opened.accelerator, &step.shapes)?;
        let (mut bodies, once) = (step.bodies.clone(), step.parameters.with_contact_iterations(1));
        let once = once.with_friction_iterations(0);
        opened.accelerator.step(&mut bodies, &step.collisions, &once)
    };
    let solved = solve();
    let refused = |error| step_input::failure(step.folder.as_ref(), &opened, error);
    solved.map(|_| ()).map_err(refused)
}

/// A vector, m or without a unit.
type Vector = [f64; 3];

/// Two bodies, the lower index first.
type Pair = (u32, u32);

/// Depth beyond which a missing or extra pair is a difference, m.
const DEEP: f64 = 1e-3;
/// Distance up to which two points are the same, m.
const SAME_POINT: f64 = 1e-3;
/// Angle up to which two directions are the same, degrees.
const SAME_DIRECTION: f64 = 0.01;

/// Differences of one kind, or the depths of pairs.
#[derive(Debug, Default, Clone, Copy)]
struct Tally {
    count: u64,
    sum: f64,
    /// The largest, and its pair.
    largest: Option<(f64, Pair)>,
}

impl Tally {
    fn add(&mut self, value: f64, pair: Pair) {
        self.count += 1;
        self.sum += value;
        if self.largest.is_none_or(|(most, _)| value > most) {
            self.largest = Some((value, pair));
        }
    }

    /// The cells of the largest value and of its pair.
    fn most(&self, scale: f64) -> [Cell; 2] {
        [
            Cell::known(self.largest, |(largest, _)| Cell::Digits(largest * scale)),
            Cell::known(self.largest, |(_, (a, b))| text(format!("{a} and {b}"))),
        ]
    }
}

/// The result of a comparison.
#[derive(Debug, Default)]
struct Comparison {
    /// Collisions of the folder, without empty ones.
    theirs: usize,
    ours: usize,
    /// Depths of the pairs that only the folder has, and that only we have, m.
    missing: Tally,
    extra: Tally,
    /// The numbers of these pairs that are deeper than [`DEEP`].
    deep: [u64; 2],
    /// Angles between normals, degrees: the same, and others.
    normals: [Tally; 2],
    /// The angles of pairs deeper than [`DEEP`] on both sides.
    deep_normals: Tally,
    /// Distances of the folder's points from our nearest, m: the same, and others.
    points: [Tally; 2],
    /// Differences between the depths of points at one place, m.
    depths: Tally,
    our_points: u64,
    /// Our points at whose place the folder has none.
    unmatched: u64,
}

impl Comparison {
    /// Compares our collisions with the folder's.
    fn of(ours: &[Collision], theirs: &BTreeMap<Pair, &Collision>) -> Self {
        let ours: BTreeMap<Pair, &Collision> = ours.iter().map(|each| (pair(each), each)).collect();
        let mut found = Self { theirs: theirs.len(), ours: ours.len(), ..Self::default() };
        for (pair, their) in theirs.iter().filter(|(pair, _)| !ours.contains_key(pair)) {
            found.missing.add(depth(their), *pair);
            found.deep[0] += u64::from(depth(their) > DEEP);
        }
        for (pair, our) in ours {
            match theirs.get(&pair) {
                Some(their) => found.compare(pair, our, their),
                None => {
                    found.extra.add(depth(our), pair);
                    found.deep[1] += u64::from(depth(our) > DEEP);
                }
            }
        }
        found
    }

    fn compare(&mut self, pair: Pair, ours: &Collision, theirs: &Collision) {
        let is_turned = ours.body_a != theirs.body_a;
        let normal = ours.normal.map(|value| f64::from(if is_turned { -value } else { value }));
        let off = angle(normal, theirs.normal.map(f64::from));
        self.normals[usize::from(off > SAME_DIRECTION)].add(off, pair);
        if depth(ours) > DEEP && depth(theirs) > DEEP {
            self.deep_normals.add(off, pair);
        }
        // Our points, on the folder's body B.
        let along = |contact: &Contact| if is_turned { f64::from(contact.distance) } else { 0.0 };
        let place = |contact: &Contact| -> Vector {
            [0, 1, 2]
                .map(|k| f64::from(contact.point[k]) + along(contact) * f64::from(ours.normal[k]))
        };
        for contact in used(theirs) {
            let point = contact.point.map(f64::from);
            let off = |our: &&Contact| distance(point, place(our));
            let nearest = least(used(ours).iter().map(|our| off(&our)));
            self.points[usize::from(nearest > SAME_POINT)].add(nearest, pair);
            if nearest <= SAME_POINT {
                let here = used(ours).iter().filter(|our| off(our) <= SAME_POINT);
                let depths = here.map(|our| f64::from(our.distance) - f64::from(contact.distance));
                self.depths.add(least(depths.map(f64::abs)), pair);
            }
        }
        for our in used(ours).iter().map(place) {
            let each = used(theirs).iter();
            let nearest = least(each.map(|their| distance(our, their.point.map(f64::from))));
            self.our_points += 1;
            self.unmatched += u64::from(nearest > SAME_POINT);
        }
    }

    /// The tables.
    fn part(&self) -> Part {
        let mut pairs = Table::with_columns(
            "pairs",
            "Pairs of bodies in contact",
            &[
                ("side", ""),
                ("collisions", "number"),
                ("deep", "deeper\nthan 1 mm"),
                ("deepest_mm", "deepest\nmm"),
                ("pair", "of bodies"),
            ],
        );
        for (name, count) in [("the folder's", self.theirs), ("ours", self.ours)] {
            let missing = [const { Cell::Missing }; 3];
            pairs.row([text(name), Cell::Whole(count as u64)].into_iter().chain(missing));
        }
        let sides = [("missing", &self.missing), ("extra", &self.extra)];
        for ((name, side), deep) in sides.into_iter().zip(self.deep) {
            let [deepest, pair] = side.most(1e3);
            pairs.row([text(name), Cell::Whole(side.count), Cell::Whole(deep), deepest, pair]);
        }
        let tallies = |id, title: &str, scale: f64, rows: [(&str, &Tally); 3]| {
            let mut table = Table::new(id, title);
            for (name, tally) in rows {
                let mean = tally.largest.map(|_| tally.sum / tally.count as f64 * scale);
                let [largest, pair] = tally.most(scale);
                table.row([
                    ("of", "", text(name)),
                    ("number", "number", Cell::Whole(tally.count)),
                    ("mean", "mean", Cell::known(mean, Cell::Digits)),
                    ("largest", "largest", largest),
                    ("pair", "of bodies", pair),
                ]);
            }
            table
        };
        let normals = [
            ("same: within 0.01 degrees", &self.normals[0]),
            ("others", &self.normals[1]),
            ("all of pairs deeper than 1 mm on both sides", &self.deep_normals),
        ];
        let points = [
            ("same: within 1 mm", &self.points[0]),
            ("others", &self.points[1]),
            ("depth of the same points", &self.depths),
        ];
        let about = "Distances of the folder's points from the nearest of ours, mm";
        let mut part = Part::of(vec![
            pairs,
            tallies("normals", "Angles between normals, degrees", 1.0, normals),
            tallies("points", about, 1e3, points),
        ]);
        part.agrees = self.deep == [0, 0];
        part
    }
}

fn pair(collision: &Collision) -> Pair {
    let (a, b) = (collision.body_a, collision.body_b);
    (a.min(b), a.max(b))
}

/// The contact points in use.
fn used(collision: &Collision) -> &[Contact] {
    let count = usize::try_from(collision.count).unwrap_or(usize::MAX);
    collision.contacts.get(..count).unwrap_or(&collision.contacts)
}

/// The depth of the deepest point, m; negative for a gap.
fn depth(collision: &Collision) -> f64 {
    -least(used(collision).iter().map(|contact| f64::from(contact.distance)))
}

fn least(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::INFINITY, f64::min)
}

/// The angle between two directions, degrees.
fn angle(a: Vector, b: Vector) -> f64 {
    let across = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let along = (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2];
    distance(across, [0.0; 3]).atan2(along).to_degrees()
}

/// The distance between two points, m.
fn distance(a: Vector, b: Vector) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|k| a[k] - b[k]);
    ((x * x + y * y) + z * z).sqrt()
}

#[cfg(test)]
mod tests {
    use scene::SceneOptions;

    use super::*;

    fn scene() -> Vec<Collision> {
        let grid = "3x3x3".parse().expect("a grid");
        let options = SceneOptions { grid, drop: 0.0 };
        let mut scene = Scene::new(&options).expect("a scene");
        for (index, body) in (0_u8..).zip(scene.bodies_mut()).skip(1) {
            body.pose.position[1] -= 0.005 * f32::from((index - 1) / 3 % 3);
        }
        scene.detect().to_vec()
    }

    /// A collision as the other body sees it.
    fn turned(collision: &Collision) -> Collision {
        let mut turned = *collision;
        (turned.body_a, turned.body_b) = (collision.body_b, collision.body_a);
        turned.normal = collision.normal.map(|value| -value);
        for contact in &mut turned.contacts {
            for (coordinate, normal) in contact.point.iter_mut().zip(collision.normal) {
                *coordinate += contact.distance * normal;
            }
        }
        turned
    }

    fn compared(ours: &[Collision], theirs: &[Collision]) -> Comparison {
        Comparison::of(ours, &theirs.iter().map(|each| (pair(each), each)).collect())
    }

    #[test]
    fn a_detection_agrees_with_itself_in_any_order_and_direction() {
        let ours = scene();
        let theirs: Vec<Collision> = ours.iter().rev().map(turned).collect();
        let found = compared(&ours, &theirs);
        assert!(found.deep == [0, 0] && found.theirs > 20 && found.theirs == found.ours);
        assert_eq!((found.missing.count, found.extra.count, found.unmatched), (0, 0, 0));
        assert_eq!(found.normals.map(|each| each.count), [found.theirs as u64, 0]);
        assert_eq!(found.points.map(|each| each.count), [found.our_points, 0]);
        assert!(found.points[0].largest.is_some_and(|(most, _)| most < 1e-5), "{found:?}");
        assert!(found.depths.largest.is_some_and(|(most, _)| most < 1e-6), "{found:?}");
    }

    #[test]
    fn what_only_one_side_has_is_a_difference_if_it_is_deep() {
        let all = scene();
        let deep = all.iter().position(|c| depth(c) > DEEP).expect("a deep pair");
        let shallow = all.iter().position(|c| depth(c) < DEEP).expect("a shallow pair");
        let without = |left_out: usize| {
            let mut some = all.clone();
            some.remove(left_out);
            compared(&all, &some)
        };
        let found = without(deep);
        assert_eq!((found.extra.count, found.deep, found.missing.count), (1, [0, 1], 0));
        assert_eq!(found.extra.largest.map(|(_, at)| at), Some(pair(&all[deep])));
        let found = without(shallow);
        assert_eq!((found.extra.count, found.deep), (1, [0, 0]));
        assert!(found.part().agrees);

        let mut more = all.clone();
        more.push(Collision { body_a: 1, body_b: 27, ..all[deep] });
        let found = compared(&all, &more);
        assert!(found.deep == [1, 0] && !found.part().agrees, "{found:?}");
    }

    #[test]
    fn moved_points_and_turned_normals_are_counted_with_their_places() {
        let ours = scene();
        let mut theirs = ours.clone();
        let last = theirs.len() - 1;
        theirs[last].contacts[0].point[0] += 0.25;
        theirs[last].contacts[1].point[0] += 0.5;
        theirs[0].normal = [0.1_f32.sin(), -(0.1_f32.cos()), 0.0];
        let found = compared(&ours, &theirs);
        assert_eq!((found.points[1].count, found.unmatched), (2, 2));
        assert_eq!(found.points[1].largest.map(|(_, at)| at), Some(pair(&theirs[last])));
        assert_eq!(found.normals[1].count, 1);
        let (off, at) = found.normals[1].largest.expect("one");
        assert!((off - 5.73).abs() < 0.01 && at == (0, 1), "{off}");
    }

    #[test]
    fn a_right_angle_has_ninety_degrees() {
        assert!((angle([1.0, 0.0, 0.0], [1.0, 1.0, 0.0]) - 45.0).abs() < 1e-9);
        assert!((angle([1.0, 0.0, 0.0], [0.0, 0.0, 2.0]) - 90.0).abs() < 1e-9);
    }
}
