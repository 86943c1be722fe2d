//! Finds the pairs of bodies that may touch, and keeps them from one detection to the next.
//!
//! The search finds candidates: bodies up to [`SKIN`] farther apart than a pair may be. As long as
//! no two bodies have approached each other by more than that, every pair is among the candidates,
//! and detection only tests each candidate. A bound on the approach needs no look at pairs: every
//! body has moved by something between the least and the greatest movement of all bodies, and these
//! are equal for a pile that falls as a whole.

use pgs_support::Crew;

use super::bounds::{Bounds, GAP};
use super::cells::{Cells, GAP_MAX};
use super::shares;

/// Extra distance of candidates beyond that of a pair, m.
const SKIN: f32 = 0.35;
/// Approach up to which candidates are kept; the remainder is for rounding.
const KEPT: f32 = SKIN - 1e-3;
/// Movement up to which candidates are kept, m: its rounding is far below that remainder.
const WAY: f32 = 100.0;

const _: () = assert!(GAP + SKIN <= GAP_MAX, "candidates are in neighbouring cells");

/// Smallest number of bodies for which a further thread speeds up the search.
const SEARCHED_PER_THREAD: usize = 2048;

/// The range of the bodies' movement and growth, along each axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Drift {
    /// The least movement of all lower ends, m.
    low: [f32; 3],
    /// The greatest movement of all upper ends, m.
    high: [f32; 3],
    /// Whether every body that takes part did so before.
    same: bool,
}

impl Drift {
    /// The drift of no bodies.
    pub(super) const NONE: Self =
        Self { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3], same: true };

    /// Includes a body with its earlier bounds.
    #[inline]
    pub(super) fn add(&mut self, before: &Bounds, now: &Bounds) {
        if !now.takes_part() {
            // It has no pairs, since it is near to nothing.
            return;
        }
        self.same &= before.takes_part();
        for axis in 0..3 {
            let way = now.centre[axis] - before.centre[axis];
            let growth = now.reach[axis] - before.reach[axis];
            let growth = if growth > 0.0 { growth } else { 0.0 };
            let (low, high) = (way - growth, way + growth);
            self.low[axis] = if low < self.low[axis] { low } else { self.low[axis] };
            self.high[axis] = if high > self.high[axis] { high } else { self.high[axis] };
        }
    }

    /// The drift of both sets of bodies.
    pub(super) fn union(mut self, other: &Self) -> Self {
        for axis in 0..3 {
            self.low[axis] = self.low[axis].min(other.low[axis]);
            self.high[axis] = self.high[axis].max(other.high[axis]);
        }
        self.same &= other.same;
        self
    }

    /// Whether no two bodies have approached by more than the candidates allow.
    fn keeps_candidates(&self) -> bool {
        // The difference is below the limit without bodies, and NaN with infinities.
        let axis = |axis: usize| {
            let (low, high) = (self.low[axis], self.high[axis]);
            low > high || low >= -WAY && high <= WAY && high - low <= KEPT
        };
        self.same && (0..3).all(axis)
    }
}

/// The broad phase.
#[derive(Debug, Default, Clone)]
pub(super) struct Broad {
    /// The bounds at the time of the search.
    searched: Vec<Bounds>,
    candidates: Vec<(u32, u32)>,
    cells: Cells,
    /// The pairs that each thread found, in the order of the cells.
    found: Vec<Vec<(u32, u32)>>,
    /// The end of each body's candidates.
    ends: Vec<usize>,
    /// The number of searches.
    #[cfg(test)]
    pub(super) searches: u64,
}

impl Broad {
    /// The bounds of each body at the time of the search.
    pub(super) fn searched_bounds(&mut self, bodies: usize) -> &[Bounds] {
        if self.searched.len() != bodies {
            // Other bodies have no known bounds, so they are searched.
            self.searched.clear();
            self.searched.resize(bodies, Bounds::NONE);
            self.candidates.clear();
        }
        &self.searched
    }

    /// Searches for candidates if any two bodies may have come too near; returns whether it did.
    /// `drift` is the bodies' movement since [the search](Self::searched_bounds).
    pub(super) fn update(&mut self, bounds: &[Bounds], drift: &Drift, crew: &mut Crew) -> bool {
        let anew = !drift.keeps_candidates();
        if anew {
            self.search(bounds, crew);
        }
        anew
    }

    /// Candidates, which include all pairs of boxes at most [`GAP`] apart; lower index first,
    /// sorted.
    pub(super) fn candidates(&self) -> &[(u32, u32)] {
        &self.candidates
    }

    /// Searches for candidates.
    fn search(&mut self, bounds: &[Bounds], crew: &mut Crew) {
        #[cfg(test)]
        {
            self.searches += 1;
        }
        // No bounds count as known until the candidates are complete: a panic leaves no half-done
        // state.
        self.searched.clear();
        self.candidates.clear();
        self.cells.sort(bounds);
        let (cells, bodies) = (&self.cells, self.cells.len());
        let (count, share) = shares(bodies, crew, SEARCHED_PER_THREAD);
        self.found.resize_with(count.max(self.found.len()), Vec::new);
        let work = (0..).step_by(share).zip(&mut self.found);
        crew.each(work.take(count), |(begin, found)| {
            found.clear();
            cells.find(begin..bodies.min(begin + share), GAP + SKIN, found);
        });
        let found = self.found.get(..count).unwrap_or_default();
        sort(found, &mut self.ends, bounds.len(), &mut self.candidates);
        self.searched.extend_from_slice(bounds);
    }
}

/// Writes the found pairs, sorted.
///
/// A counting sort places them by their lower body. Each lower body has few partners, which are
/// sorted one by one.
fn sort(
    found: &[Vec<(u32, u32)>],
    ends: &mut Vec<usize>,
    bodies: usize,
    pairs: &mut Vec<(u32, u32)>,
) {
    ends.clear();
    ends.resize(bodies, 0);
    for (a, _) in found.iter().flatten() {
        ends[*a as usize] += 1;
    }
    let mut begin = 0;
    for end in &mut *ends {
        // Holds the place of the body's next pair until all pairs are placed.
        begin += std::mem::replace(end, begin);
    }
    pairs.clear();
    pairs.resize(begin, (0, 0));
    for pair in found.iter().flatten() {
        let next = &mut ends[pair.0 as usize];
        pairs[*next] = *pair;
        *next += 1;
    }
    let mut begin = 0;
    for end in &*ends {
        sort_few(&mut pairs[begin..*end]);
        begin = *end;
    }
}

/// Sorts the pairs of one body, which are few in a pile.
fn sort_few(pairs: &mut [(u32, u32)]) {
    const FEW: usize = 24;
    if pairs.len() > FEW {
        pairs.sort_unstable();
        return;
    }
    for sorted in 1..pairs.len() {
        let pair = pairs[sorted];
        let mut at = sorted;
        while at > 0 && pairs[at - 1].1 > pair.1 {
            pairs[at] = pairs[at - 1];
            at -= 1;
        }
        pairs[at] = pair;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A change of a body from one step to the next.
    #[derive(Debug, Clone, Copy)]
    enum Event {
        Rest,
        Move([f32; 3]),
        Jump([f32; 3]),
        Vanish,
        Turn([f32; 3]),
    }

    fn event() -> impl Strategy<Value = Event> {
        let way = |most: f32| prop::array::uniform3(-most..most);
        prop_oneof![
            8 => Just(Event::Rest),
            8 => way(0.2).prop_map(Event::Move),
            1 => way(9.0).prop_map(Event::Jump),
            1 => prop::array::uniform3(-1e8_f32..1e8).prop_map(Event::Jump),
            1 => Just(Event::Vanish),
            1 => prop::array::uniform3(0.2_f32..1.73).prop_map(Event::Turn),
        ]
    }

    /// The broad phase under test, with its kept candidates.
    #[derive(Default)]
    struct Kept {
        broad: Broad,
        crew: Crew,
    }

    impl Kept {
        fn pairs(&mut self, bounds: &[Bounds]) -> Vec<(u32, u32)> {
            let mut drift = Drift::NONE;
            for (before, now) in self.broad.searched_bounds(bounds.len()).iter().zip(bounds) {
                drift.add(before, now);
            }
            self.broad.update(bounds, &drift, &mut self.crew);
            near(bounds, self.broad.candidates())
        }
    }

    fn near(bounds: &[Bounds], candidates: &[(u32, u32)]) -> Vec<(u32, u32)> {
        let near = |&&(a, b): &&(u32, u32)| bounds[a as usize].near(&bounds[b as usize], GAP);
        candidates.iter().filter(near).copied().collect()
    }

    fn every_pair(bounds: &[Bounds]) -> Vec<(u32, u32)> {
        let mut pairs = Vec::new();
        for (a, one) in (0..).zip(bounds) {
            let after = (a + 1..).zip(&bounds[a as usize + 1..]);
            pairs.extend(after.filter(|(_, other)| one.near(other, GAP)).map(|(b, _)| (a, b)));
        }
        pairs
    }

    proptest! {
        #[test]
        fn the_pairs_are_those_of_a_comparison_of_all_with_all(
            bodies in prop::collection::vec(
                (prop::array::uniform3(-6.0_f32..6.0), prop::array::uniform3(0.2_f32..1.73)), 0..40
            ),
            // The fall of all bodies, and in some steps a change of each.
            steps in prop::collection::vec(
                (prop::array::uniform3(-0.5_f32..0.5), prop::collection::vec(event(), 0..50)), 1..20
            ),
        ) {
            let mut bounds = vec![Bounds::NONE];
            bounds.extend(bodies.into_iter().map(|(centre, reach)| Bounds { centre, reach }));
            let mut kept = Kept::default();
            for (fall, events) in steps {
                for body in &mut bounds {
                    body.centre = std::array::from_fn(|axis| body.centre[axis] + fall[axis]);
                }
                // An event past the last body can add one; bodies without an event stay.
                for (index, event) in events.into_iter().enumerate() {
                    if index + 1 >= bounds.len() {
                        if let Event::Jump(centre) = event {
                            bounds.push(Bounds { centre, reach: [1.0; 3] });
                        }
                        continue;
                    }
                    let body = &mut bounds[index + 1];
                    match event {
                        Event::Rest => {}
                        Event::Move(way) => {
                            body.centre = std::array::from_fn(|axis| body.centre[axis] + way[axis]);
                        }
                        Event::Jump(centre) => *body = Bounds { centre, reach: [1.0; 3] },
                        Event::Vanish if index % 2 == 0 => *body = Bounds::NONE,
                        Event::Vanish => bounds.truncate(index + 1),
                        Event::Turn(reach) if body.takes_part() => body.reach = reach,
                        Event::Turn(_) => {}
                    }
                }
                let expected = every_pair(&bounds);
                prop_assert_eq!(kept.pairs(&bounds), expected);
            }
        }
    }

    /// Bodies in a row that do not quite touch.
    fn row(bodies: u8) -> Vec<Bounds> {
        let at = |k: u8| Bounds { centre: [2.1 * f32::from(k), 0.0, 0.0], reach: [1.0; 3] };
        std::iter::once(Bounds::NONE).chain((0..bodies).map(at)).collect()
    }

    #[test]
    fn what_falls_as_a_whole_is_searched_once_and_what_comes_nearer_again() {
        let (mut bounds, mut kept) = (row(20), Kept::default());
        for _ in 0..100 {
            assert_eq!(kept.pairs(&bounds), []);
            bounds.iter_mut().for_each(|body| body.centre[1] -= 0.9);
        }
        assert_eq!(kept.broad.searches, 1);
        bounds[7].centre[0] += 0.09;
        assert_eq!(kept.pairs(&bounds), [(7, 8)]);
        assert_eq!(kept.broad.searches, 1, "less than the skin");
        bounds[7].centre[1] += 0.5;
        assert_eq!(kept.pairs(&bounds), [(7, 8)]);
        assert_eq!(kept.broad.searches, 2, "more than the skin");
        // Beyond the distance for which rounding is negligible.
        bounds.iter_mut().for_each(|body| body.centre[1] -= 2.0 * WAY);
        assert_eq!(kept.pairs(&bounds), [(7, 8)]);
        assert_eq!(kept.broad.searches, 3);
    }

    #[test]
    fn bodies_beyond_the_last_cell_are_still_compared() {
        let mut bounds = vec![Bounds::NONE];
        let far = [[9e6, 0.0, 0.0], [9e6, 2.0, 0.0], [-9e30, 0.0, 9e30]];
        bounds.extend(far.map(|centre| Bounds { centre, reach: [1.0; 3] }));
        assert_eq!(Kept::default().pairs(&bounds), [(1, 2)]);
    }

    #[test]
    fn a_body_without_a_place_has_no_pairs_and_gets_them_back() {
        let (mut bounds, mut kept) = (row(4), Kept::default());
        bounds[3].centre[0] -= 0.1;
        assert_eq!(kept.pairs(&bounds), [(2, 3)]);
        let there = std::mem::replace(&mut bounds[3], Bounds::NONE);
        assert_eq!(kept.pairs(&bounds), []);
        bounds[3] = there;
        assert_eq!(kept.pairs(&bounds), [(2, 3)]);
        assert_eq!(kept.pairs(&[]), []);
        assert_eq!(kept.pairs(&bounds[..1]), []);
        assert_eq!(kept.pairs(&bounds), [(2, 3)]);
    }
}
