//! Finds the pairs of bodies that may touch by sweep and prune, as the thesis describes it.
//!
//! Source: thesis, section 2.2.1. Each axis has a list of the lower and upper ends of all bounding
//! boxes, sorted by coordinate. Two boxes overlap along an axis unless one ends before the other
//! begins. A pair is active while its boxes overlap along all three.
//!
//! The lists stay from one detection to the next, where an insertion sort moves few ends. When a
//! lower end passes an upper end, the two boxes begin to overlap along that axis; when an upper end
//! passes a lower one, they cease to. One flag per axis and pair would fill 270 MiB for the 38,880
//! cubes of the thesis, so a passing computes the flags of its pair from the six coordinates.
//!
//! The first sort starts from nothing. Then one list is swept: the one along which the fewest boxes
//! overlap.

use super::bounds::{Bounds, GAP};
use super::cells::merge;

/// Widening of a box that covers the rounding of [`Bounds::near`], relative to its size.
const WIDER: f64 = 1.0 + 1e-6;

/// Moves per end up to which the insertion sort goes on; beyond it, starting from nothing is faster.
const MOVES: usize = 512;

/// An end of a box along one axis.
#[derive(Debug, Clone, Copy)]
struct End {
    /// Coordinate, m.
    at: f64,
    body: u32,
    is_upper: bool,
}

impl End {
    /// Whether it belongs behind `other`. Boxes that touch overlap: at one coordinate, lower ends
    /// come first.
    #[inline]
    fn is_behind(&self, other: &Self) -> bool {
        self.order(other).is_gt()
    }

    fn order(&self, other: &Self) -> std::cmp::Ordering {
        self.at.total_cmp(&other.at).then(self.is_upper.cmp(&other.is_upper))
    }
}

/// A box, widened by half of the gap that a pair may have.
#[derive(Debug, Clone, Copy)]
struct Extent {
    low: [f64; 3],
    high: [f64; 3],
}

impl Extent {
    fn of(bounds: &Bounds) -> Self {
        let reach = |axis: usize| (f64::from(bounds.reach[axis]) + 0.5 * f64::from(GAP)) * WIDER;
        let centre = bounds.centre.map(f64::from);
        Self {
            low: std::array::from_fn(|axis| centre[axis] - reach(axis)),
            high: std::array::from_fn(|axis| centre[axis] + reach(axis)),
        }
    }

    #[inline]
    fn overlaps(&self, other: &Self) -> bool {
        (0..3).all(|axis| self.low[axis] <= other.high[axis] && other.low[axis] <= self.high[axis])
    }
}

/// The broad phase by sweep and prune.
#[derive(Debug, Default)]
pub(super) struct Sweep {
    /// The box of each body; none if it takes no part.
    extents: Vec<Option<Extent>>,
    /// The ends along each axis, sorted.
    lists: [Vec<End>; 3],
    /// The active pairs, lower index first, sorted.
    pairs: Vec<(u32, u32)>,
    /// Pairs that have begun to overlap.
    begun: Vec<(u32, u32)>,
    /// The bodies whose lower end was passed and whose upper end was not.
    open: Vec<u32>,
    /// The number of starts from nothing.
    #[cfg(test)]
    starts: u64,
}

impl Sweep {
    /// Candidates, which include all pairs of boxes at most [`GAP`] apart; lower index first,
    /// sorted.
    pub(super) fn candidates(&mut self, bounds: &[Bounds]) -> &[(u32, u32)] {
        if !(self.place(bounds) && self.sort_again()) {
            self.start();
        }
        &self.pairs
    }

    /// The candidates of the last search.
    pub(super) fn kept(&self) -> &[(u32, u32)] {
        &self.pairs
    }

    /// Sets the boxes; returns whether the lists hold the ends of the same bodies.
    fn place(&mut self, bounds: &[Bounds]) -> bool {
        let mut are_same = self.extents.len() == bounds.len();
        self.extents.resize(bounds.len(), None);
        for (extent, bounds) in self.extents.iter_mut().zip(bounds) {
            let now = bounds.takes_part().then(|| Extent::of(bounds));
            are_same &= extent.is_some() == now.is_some();
            *extent = now;
        }
        are_same
    }

    /// Sorts the lists by insertion and updates the active pairs; returns whether it reached the
    /// end.
    fn sort_again(&mut self) -> bool {
        let Self { extents, lists, pairs, begun, .. } = self;
        begun.clear();
        let mut has_ceased = false;
        for (axis, list) in lists.iter_mut().enumerate() {
            for end in &mut *list {
                if let Some(extent) = &extents[end.body as usize] {
                    end.at = if end.is_upper { extent.high[axis] } else { extent.low[axis] };
                }
            }
            let mut moves = 0;
            for index in 1..list.len() {
                let end = list[index];
                let mut place = index;
                while place > 0 && list[place - 1].is_behind(&end) {
                    let passed = list[place - 1];
                    match (end.is_upper, passed.is_upper) {
                        (false, true) if overlap(extents, end.body, passed.body) => {
                            begun.push(ordered(end.body, passed.body));
                        }
                        (true, false) => has_ceased = true,
                        _ => {}
                    }
                    list[place] = passed;
                    place -= 1;
                }
                list[place] = end;
                moves += index - place;
                if moves > MOVES * list.len() {
                    return false;
                }
            }
        }
        if has_ceased {
            pairs.retain(|&(a, b)| overlap(extents, a, b));
        }
        // Two boxes can begin to overlap along more than one axis, and add their pair each time.
        begun.sort_unstable();
        begun.dedup();
        merge(pairs, begun);
        true
    }

    /// Sorts all ends, and sweeps the list along which the fewest boxes overlap.
    fn start(&mut self) {
        #[cfg(test)]
        {
            self.starts += 1;
        }
        let Self { extents, lists, pairs, open, .. } = self;
        pairs.clear();
        let mut best = (u64::MAX, 0);
        for (axis, list) in lists.iter_mut().enumerate() {
            list.clear();
            for (body, extent) in (0..).zip(&*extents) {
                if let Some(Extent { low, high }) = extent {
                    list.push(End { at: low[axis], body, is_upper: false });
                    list.push(End { at: high[axis], body, is_upper: true });
                }
            }
            list.sort_unstable_by(End::order);
            best = best.min((overlaps_along(list), axis));
        }
        open.clear();
        for end in &lists[best.1] {
            if end.is_upper {
                if let Some(place) = open.iter().position(|&body| body == end.body) {
                    // The others stay in the order of their lower ends, which is nearly the
                    // order of their upper ends.
                    open.remove(place);
                }
                continue;
            }
            let begun = open.iter().filter(|&&other| overlap(extents, end.body, other));
            pairs.extend(begun.map(|&other| ordered(end.body, other)));
            open.push(end.body);
        }
        pairs.sort_unstable();
    }
}

/// Whether the boxes of two bodies overlap along all axes.
#[inline]
fn overlap(extents: &[Option<Extent>], a: u32, b: u32) -> bool {
    match (&extents[a as usize], &extents[b as usize]) {
        (Some(a), Some(b)) => a.overlaps(b),
        _ => false,
    }
}

/// The number of pairs of boxes that overlap along the axis of a sorted list.
fn overlaps_along(list: &[End]) -> u64 {
    let (mut open, mut pairs) = (0_u64, 0_u64);
    for end in list {
        if end.is_upper {
            open = open.saturating_sub(1);
        } else {
            pairs = pairs.saturating_add(open);
            open += 1;
        }
    }
    pairs
}

/// The lower index first.
fn ordered(a: u32, b: u32) -> (u32, u32) {
    if a < b { (a, b) } else { (b, a) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BroadPhase, Grid, Scene, SceneOptions, ShapesOptions};

    fn grid(text: &str) -> Grid {
        text.parse().expect("a grid")
    }

    fn scene(text: &str, drop: f32) -> Scene {
        let options = SceneOptions { grid: grid(text), drop, ..SceneOptions::default() };
        Scene::new(&options).expect("a scene")
    }

    /// Cubes of 2 m in a row, 2.1 m from centre to centre.
    fn row(bodies: u8) -> Vec<Bounds> {
        let at = |k: u8| Bounds { centre: [2.1 * f32::from(k), 0.0, 0.0], reach: [1.0; 3] };
        std::iter::once(Bounds::NONE).chain((0..bodies).map(at)).collect()
    }

    #[test]
    fn lists_are_sorted_anew_only_for_other_bodies() {
        let (mut bounds, mut sweep) = (row(20), Sweep::default());
        for _ in 0..50 {
            assert_eq!(sweep.candidates(&bounds), []);
            bounds.iter_mut().for_each(|body| body.centre[1] -= 0.9);
        }
        bounds[7].centre[0] += 0.09;
        assert_eq!(sweep.candidates(&bounds), [(7, 8)]);
        // Past its neighbour, and onto the one behind it.
        bounds[7].centre[0] += 2.1;
        assert_eq!(sweep.candidates(&bounds), [(7, 8), (7, 9)]);
        bounds[7].centre[2] += 9.0;
        assert_eq!(sweep.candidates(&bounds), []);
        assert_eq!(sweep.starts, 1);
        bounds[8] = Bounds::NONE;
        bounds[7].centre[2] -= 9.0;
        assert_eq!(sweep.candidates(&bounds), [(7, 9)]);
        assert_eq!(sweep.starts, 2);
    }

    #[test]
    fn an_order_that_is_turned_round_starts_from_nothing() {
        let line = |first: f32, way: f32| -> Vec<Bounds> {
            let at =
                |k: u16| Bounds { centre: [first + way * f32::from(k), 0.0, 0.0], reach: [1.0; 3] };
            (0..2000).map(at).collect()
        };
        let mut sweep = Sweep::default();
        sweep.candidates(&line(0.0, 2.0));
        assert_eq!(sweep.starts, 1);
        let found = sweep.candidates(&line(4000.0, -2.0));
        assert_eq!(found, (0..1999).map(|k| (k, k + 1)).collect::<Vec<_>>());
        assert_eq!(sweep.starts, 2);
    }

    /// Five scenes: the lattice as it starts, in the air, pressed together, on the ground, and a
    /// pile of several shapes.
    fn five_scenes() -> [Scene; 5] {
        let pressed = |mut scene: Scene, by: f32| {
            for body in &mut scene.bodies_mut()[1..] {
                body.pose.position = body.pose.position.map(|value| value * by);
            }
            scene
        };
        let shapes = ShapesOptions { grid: grid("9x9x9"), drop: 0.0, seed: 5 };
        let shapes = Scene::of_shapes(&shapes).expect("a scene");
        [
            scene("12x10x12", 0.0),
            scene("20x20x20", 5.0),
            pressed(scene("9x12x9", 0.0), 0.9),
            scene("40x1x40", 0.0),
            pressed(shapes, 0.5),
        ]
    }

    #[test]
    fn sweep_and_prune_and_the_grid_find_one_list_in_five_scenes() {
        let found = |broad_phase| -> Vec<_> {
            let lists = |mut scene: Scene| {
                scene.set_broad_phase(broad_phase);
                let mut lists = Vec::new();
                for step in 0..4_u16 {
                    scene.detect();
                    lists.push((scene.pairs().collect::<Vec<_>>(), scene.collisions().to_vec()));
                    // Every third body goes its own way, and past others.
                    let way = 0.4 * f32::from(step);
                    for body in scene.bodies_mut()[1..].iter_mut().step_by(3) {
                        body.pose.position = body.pose.position.map(|value| value - way);
                    }
                }
                lists
            };
            five_scenes().into_iter().map(lists).collect()
        };
        let (by_grid, by_sweep) = (found(BroadPhase::Grid), found(BroadPhase::Sweep));
        let counts: Vec<Vec<usize>> = by_grid
            .iter()
            .map(|scene| scene.iter().map(|(pairs, _)| pairs.len()).collect())
            .collect();
        assert!(counts.iter().flatten().any(|&count| count > 30_000), "{counts:?}");
        assert!(counts.iter().all(|counts| counts.iter().any(|&count| count > 100)), "{counts:?}");
        assert!(by_grid == by_sweep, "{counts:?}");
    }
}
