//! Packs spheres of three sizes into an irregular pile.
//!
//! Spheres start at random places above a square floor with walls, sink, and push each other apart
//! until they lie still; only positions change. The result is a pile as a collision detection would
//! meet it: irregular, with about six contacts per sphere.
//!
//! `SplitMix64` draws the numbers, and every sum is f32 in a written order: a seed gives the same
//! bits everywhere.

use pgs_support::float_env::standard;
use zynq_pgs::{Body, Collision, Contact, Shape};

use crate::build::at_rest;
use crate::{GROUND, GROUND_HALF_EXTENT, MARGIN, SceneError};
use pgs_support::random::SplitMix64;

/// Radii, m; every third sphere has the same one.
pub const RADII: [f32; 3] = [0.5, 0.8, 1.2];
/// Most spheres: the pile stays on the ground, and settles within about a minute.
pub const SPHERES_MAX: u32 = 500_000;

/// Edge of a cell: no two spheres that touch are more than one cell apart.
const CELL: f32 = 2.0 * RADII[2] + MARGIN;
/// The depth by which the spheres sink in a round, m, and the number of such rounds after the fall.
const SETTLING: [(f32, u32); 3] = [(0.05, 60), (0.01, 60), (0.0, 60)];
/// The depth by which they sink in a round of the fall, m.
const FALL: f32 = 0.3;
/// Share of an overlap by which the upper of two spheres moves; the lower one moves by the rest.
/// The share is nearly 1, so that a pile does not sink into itself.
const UPPER: f32 = 0.8;

/// A pile of spheres and its collisions; body 0 is the ground.
#[derive(Debug)]
pub struct Spheres {
    shapes: [Shape; 4],
    bodies: Vec<Body>,
    collisions: Vec<Collision>,
}

impl Spheres {
    /// Packs `count` spheres.
    ///
    /// # Errors
    ///
    /// [`SceneError::Spheres`] if `count` is 0 or above [`SPHERES_MAX`].
    pub fn new(count: u32, seed: u64) -> Result<Self, SceneError> {
        if !(1..=SPHERES_MAX).contains(&count) {
            return Err(SceneError::Spheres { found: count, most: SPHERES_MAX });
        }
        Ok(standard(|| Self::pack(count, seed)))
    }

    fn pack(count: u32, seed: u64) -> Self {
        let mut pile = Pile::new(count, seed);
        pile.settle();
        let shape = |radius: f32| {
            let mass = radius * radius * radius;
            Shape::isotropic(1.0 / mass, 1.0 / (0.4 * mass * radius * radius))
        };
        let [small, middle, large] = RADII.map(shape);
        let mut bodies = vec![at_rest([0.0, -GROUND_HALF_EXTENT, 0.0], 0)];
        let spheres = (0..3).cycle().zip(&pile.centres);
        bodies.extend(spheres.map(|(size, centre)| at_rest(*centre, 1 + size)));
        let collisions = pile.collisions();
        Self { shapes: [Shape::STATIC, small, middle, large], bodies, collisions }
    }

    /// The shape table: static, then the three sizes.
    #[must_use]
    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// The bodies.
    #[must_use]
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// The collisions, sorted by body A, then body B. The ground is always body A.
    #[must_use]
    pub fn collisions(&self) -> &[Collision] {
        &self.collisions
    }
}

/// Spheres, indexed without the ground.
struct Pile {
    centres: Vec<[f32; 3]>,
    /// Edge of the floor, m.
    side: f32,
    height: f32,
    cells: Cells,
}

fn radius(index: usize) -> f32 {
    RADII[index % RADII.len()]
}

impl Pile {
    /// Spheres at random places, so sparse that they hardly overlap.
    fn new(count: u32, seed: u64) -> Self {
        let mut random = SplitMix64::new(seed);
        let count = count as usize;
        // Twice as wide as high when settled, and half as dense before.
        let volume: f32 = (0..count).map(|k| 7.0 * radius(k) * radius(k) * radius(k)).sum();
        let side = cube_root(2.0 * volume).max(2.0 * CELL);
        let height = 2.0 * volume / (side * side);
        let centres = (0..count)
            .map(|k| {
                let (r, room) = (radius(k), side - 2.0 * radius(k));
                [r + room * random.unit(), r + height * random.unit(), r + room * random.unit()]
            })
            .collect();
        Self { centres, side, height, cells: Cells::default() }
    }

    /// Lets the spheres fall, and then settle.
    fn settle(&mut self) {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "the height is positive and below 1,000 m"
        )]
        let fall = (self.height / FALL) as u32;
        for (step, rounds) in std::iter::once((FALL, fall)).chain(SETTLING) {
            for _ in 0..rounds {
                for centre in &mut self.centres {
                    centre[1] -= step;
                }
                self.push_apart();
            }
        }
    }

    /// Once, moves each two overlapping spheres apart until they touch, and all spheres above the
    /// floor.
    fn push_apart(&mut self) {
        let side = self.side;
        self.cells.sort(&self.centres, side);
        let centres = &mut self.centres;
        self.cells.pairs(|i, j| {
            let (a, b) = (centres[i], centres[j]);
            let (normal, distance) = direction(a, b);
            let overlap = radius(i) + radius(j) - distance;
            if overlap > 0.0 {
                let share = if a[1] > b[1] { UPPER } else { 1.0 - UPPER };
                for axis in 0..3 {
                    centres[i][axis] += normal[axis] * (overlap * share);
                    centres[j][axis] -= normal[axis] * (overlap * (1.0 - share));
                }
            }
        });
        for (k, [x, y, z]) in centres.iter_mut().enumerate() {
            let r = radius(k);
            for across in [x, z] {
                *across = across.clamp(r, side - r);
            }
            if *y < r {
                *y = r;
            }
        }
    }

    /// All collisions within the margin.
    fn collisions(&mut self) -> Vec<Collision> {
        let mut found = Vec::new();
        let mut touch = |body_a, body_b, normal, point, distance| {
            let mut contacts = [Contact::default(); 4];
            contacts[0] = Contact { point, distance };
            found.push(Collision { body_a, body_b, normal, count: 1, contacts });
        };
        for (k, (body, [x, y, z])) in (1..).zip(&self.centres).enumerate() {
            let bottom = *y - radius(k);
            if bottom <= MARGIN {
                touch(GROUND, body, [0.0, -1.0, 0.0], [*x, bottom, *z], bottom);
            }
        }
        self.cells.sort(&self.centres, self.side);
        let centres = &self.centres;
        self.cells.pairs(|i, j| {
            let (i, j) = (i.min(j), i.max(j));
            let (normal, distance) = direction(centres[i], centres[j]);
            let gap = distance - (radius(i) + radius(j));
            if gap <= MARGIN {
                let [x, y, z] = centres[j];
                let r = radius(j);
                let point = [x + normal[0] * r, y + normal[1] * r, z + normal[2] * r];
                let body = |k: usize| u32::try_from(k + 1).unwrap_or(u32::MAX);
                touch(body(i), body(j), normal, point, gap);
            }
        });
        found.sort_unstable_by_key(|collision| (collision.body_a, collision.body_b));
        found
    }
}

/// By Newton's method: std's cube root differs between machines.
fn cube_root(number: f32) -> f32 {
    (0..64).fold(1.0, |root, _| (2.0 * root + number / (root * root)) / 3.0)
}

/// The unit vector from `b` to `a`, and their distance; upwards if the points coincide.
fn direction(a: [f32; 3], b: [f32; 3]) -> ([f32; 3], f32) {
    let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let distance = ((x * x + y * y) + z * z).sqrt();
    if distance > 0.0 {
        ([x / distance, y / distance, z / distance], distance)
    } else {
        ([0.0, 1.0, 0.0], 0.0)
    }
}

/// Spheres sorted by the cell of their centre.
#[derive(Debug, Default)]
struct Cells {
    /// Cells along x, y, z, with an empty layer around.
    size: [usize; 3],
    /// The beginning of each cell's spheres in `spheres`.
    starts: Vec<usize>,
    cell_of: Vec<usize>,
    spheres: Vec<usize>,
}

impl Cells {
    fn sort(&mut self, centres: &[[f32; 3]], side: f32) {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "negative numbers become 0, and no coordinate is above 10,000 m"
        )]
        let cell = |x: f32| (x / CELL) as usize + 1;
        let top = centres.iter().fold(0.0, |top: f32, centre| top.max(centre[1]));
        self.size = [cell(side) + 2, cell(top) + 2, cell(side) + 2];
        let [_, height, depth] = self.size;
        let of = |[x, y, z]: [f32; 3]| (cell(x) * height + cell(y)) * depth + cell(z);
        self.cell_of.clear();
        self.cell_of.extend(centres.iter().map(|centre| of(*centre)));
        self.starts.clear();
        self.starts.resize(self.size.iter().product::<usize>() + 1, 0);
        for cell in &self.cell_of {
            self.starts[cell + 1] += 1;
        }
        for cell in 1..self.starts.len() {
            self.starts[cell] += self.starts[cell - 1];
        }
        let mut next = self.starts.clone();
        self.spheres.resize(centres.len(), 0);
        for (sphere, cell) in self.cell_of.iter().enumerate() {
            self.spheres[next[*cell]] = sphere;
            next[*cell] += 1;
        }
    }

    /// Visits each two spheres of the same or of neighbouring cells, once.
    fn pairs(&self, mut each: impl FnMut(usize, usize)) {
        let [_, height, depth] = self.size;
        let (column, sheet) = (depth, height * depth);
        // Cells that come later: within z, the next column, the next sheet.
        let mut later = vec![1, column - 1, column, column + 1];
        for y in [sheet - column, sheet, sheet + column] {
            later.extend([y - 1, y, y + 1]);
        }
        let of = |cell: usize| &self.spheres[self.starts[cell]..self.starts[cell + 1]];
        for cell in 0..self.starts.len() - 1 {
            for (k, i) in of(cell).iter().enumerate() {
                for j in &of(cell)[k + 1..] {
                    each(*i, *j);
                }
                for offset in &later {
                    // The outer cells are empty, so that nothing beyond the last is missed.
                    let other = cell + offset;
                    if other + 1 < self.starts.len() {
                        for j in of(other) {
                            each(*i, *j);
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_root_is_one() {
        for (number, root) in [(1e-3_f32, 0.1_f32), (27.0, 3.0), (3e6, 144.224_96)] {
            assert!((cube_root(number) - root).abs() < 1e-5 * root, "{number}");
        }
    }

    #[test]
    fn a_pile_touches_as_a_pile_does() {
        let pile = Spheres::new(1500, 7).expect("a pile");
        let (spheres, pairs) = (1500.0, pile.collisions().len() as f32);
        let ground = crate::ground_pairs(pile.collisions()) as f32;
        let touched = (2.0 * (pairs - ground) + ground) / spheres;
        assert!((4.5..7.5).contains(&touched), "{touched} contacts a sphere");
        assert!(ground > 50.0 && ground < 400.0, "{ground} on the ground");
        let deepest = pile.collisions().iter().fold(0.0, |d: f32, c| d.min(c.contacts[0].distance));
        assert!(deepest > -0.25 * RADII[0], "{deepest} m deep");
        let order = |c: &Collision| (c.body_a, c.body_b);
        assert!(pile.collisions().is_sorted_by(|a, b| order(a) < order(b)));
        for collision in pile.collisions() {
            let [x, y, z] = collision.normal;
            assert!((((x * x + y * y) + z * z) - 1.0).abs() < 1e-5);
        }
    }

    /// All pairs, compared one by one.
    #[test]
    fn cells_miss_no_pair() {
        let pile = Spheres::new(300, 3).expect("a pile");
        let mut expected = Vec::new();
        let spheres: Vec<(u32, f32, [f32; 3])> = (1..)
            .zip(RADII.into_iter().cycle())
            .zip(&pile.bodies()[1..])
            .map(|((index, radius), body)| (index, radius, body.pose.position))
            .collect();
        for (k, (i, r, a)) in spheres.iter().enumerate() {
            for (j, s, b) in &spheres[k + 1..] {
                let (_, distance) = direction(*a, *b);
                if distance - (r + s) <= MARGIN {
                    expected.push((*i, *j));
                }
            }
        }
        let moving = pile.collisions().iter().filter(|c| c.body_a != GROUND);
        let found: Vec<(u32, u32)> = moving.map(|c| (c.body_a, c.body_b)).collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn a_seed_gives_the_same_bits_and_another_seed_others() {
        let bits = |seed| {
            let pile = Spheres::new(200, seed).expect("a pile");
            let bits = |body: &Body| body.pose.position.map(f32::to_bits);
            pile.bodies().iter().map(bits).collect::<Vec<_>>()
        };
        assert_eq!(bits(1), bits(1));
        assert_ne!(bits(1), bits(2));
    }

    #[test]
    fn no_spheres_or_too_many_are_refused() {
        for found in [0, SPHERES_MAX + 1] {
            let most = SPHERES_MAX;
            assert_eq!(Spheres::new(found, 1).err(), Some(SceneError::Spheres { found, most }));
        }
    }
}
