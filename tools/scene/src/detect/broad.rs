//! This file finds the pairs of bodies that may touch, and keeps them from one time to the next.
//!
//! What is searched for are bodies up to [`SKIN`] farther apart than a pair may be. As long as no two
//! bodies have come nearer to each other by more than that, every pair is among the candidates found
//! then: nothing is searched, and each candidate is looked at once. How far two bodies can have come
//! is known without looking at pairs: each has moved by something between the least and the most that
//! any has, and of a pile that falls as a whole these are the same.

use pgs_support::Crew;

use super::bounds::{Bounds, GAP};
use super::cells::{Cells, GAP_MAX};
use super::shares;

/// How much farther apart than a pair candidates may be, m.
const SKIN: f32 = 0.35;
/// Up to where candidates are kept: the rest is for rounding.
const KEPT: f32 = SKIN - 1e-3;
/// Up to where bodies may have moved, m: rounding of that is far below what is left for it.
const WAY: f32 = 100.0;

const _: () = assert!(GAP + SKIN <= GAP_MAX, "candidates are in neighbouring cells");

/// Fewest bodies to be searched for which a further thread pays.
const SEARCHED_PER_THREAD: usize = 2048;

/// By how much bodies have moved and grown, along each axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Drift {
    /// The lower ends, least of all, m.
    low: [f32; 3],
    /// The upper ends, most of all, m.
    high: [f32; 3],
    /// Whether all that take part did before.
    same: bool,
}

impl Drift {
    /// That of no bodies.
    pub(super) const NONE: Self =
        Self { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3], same: true };

    /// Takes in a body that had other bounds.
    #[inline]
    pub(super) fn add(&mut self, then: &Bounds, now: &Bounds) {
        if !now.exist() {
            // Its pairs are none: it is near to nothing.
            return;
        }
        self.same &= then.exist();
        for axis in 0..3 {
            let way = now.centre[axis] - then.centre[axis];
            let growth = now.reach[axis] - then.reach[axis];
            let growth = if growth > 0.0 { growth } else { 0.0 };
            let (low, high) = (way - growth, way + growth);
            self.low[axis] = if low < self.low[axis] { low } else { self.low[axis] };
            self.high[axis] = if high > self.high[axis] { high } else { self.high[axis] };
        }
    }

    /// That of these bodies and those.
    pub(super) fn and(mut self, other: &Self) -> Self {
        for axis in 0..3 {
            self.low[axis] = self.low[axis].min(other.low[axis]);
            self.high[axis] = self.high[axis].max(other.high[axis]);
        }
        self.same &= other.same;
        self
    }

    /// Whether no two have come nearer than candidates are kept for.
    fn is_small(&self) -> bool {
        // Of no bodies the difference is below all; that of infinities is NaN.
        let axis = |axis: usize| {
            let (low, high) = (self.low[axis], self.high[axis]);
            low > high || low >= -WAY && high <= WAY && high - low <= KEPT
        };
        self.same && (0..3).all(axis)
    }
}

/// The broad phase.
#[derive(Debug, Default)]
pub(super) struct Broad {
    /// Where the bodies were when they were searched.
    then: Vec<Bounds>,
    candidates: Vec<(u32, u32)>,
    cells: Cells,
    /// What each thread has found, as the cells have it.
    found: Vec<Vec<(u32, u32)>>,
    /// Where the candidates of each body end.
    ends: Vec<usize>,
    /// How often bodies were searched.
    #[cfg(test)]
    pub(super) searches: u64,
}

impl Broad {
    /// Where each of so many bodies was when they were searched.
    pub(super) fn then(&mut self, bodies: usize) -> &[Bounds] {
        if self.then.len() != bodies {
            // Of other bodies nothing is known, so that they will be searched.
            self.then.clear();
            self.then.resize(bodies, Bounds::NONE);
            self.candidates.clear();
        }
        &self.then
    }

    /// Pairs among which are all whose boxes are not farther apart than [`GAP`], lower index first,
    /// sorted; `drift` is how far the bodies have moved from [where they were](Self::then).
    pub(super) fn candidates(
        &mut self,
        bounds: &[Bounds],
        drift: &Drift,
        crew: &mut Crew,
    ) -> &[(u32, u32)] {
        if !drift.is_small() {
            self.search(bounds, crew);
        }
        &self.candidates
    }

    /// Finds the candidates anew.
    fn search(&mut self, bounds: &[Bounds], crew: &mut Crew) {
        #[cfg(test)]
        {
            self.searches += 1;
        }
        // Until there are candidates, no bodies are known: a panic leaves nothing half done.
        self.then.clear();
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
        self.then.extend_from_slice(bounds);
    }
}

/// Writes the pairs that were found, sorted.
///
/// By their lower body they are counted into place: that one has few partners, which are sorted
/// among themselves.
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
        // Until its pairs are in place, where the next one goes.
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

/// Sorts the pairs of one body, which in a pile are few.
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

    /// What happens to a body from one step to the next.
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

    /// The broad phase as it is used, with what it keeps.
    #[derive(Default)]
    struct Kept {
        broad: Broad,
        crew: Crew,
    }

    impl Kept {
        fn pairs(&mut self, bounds: &[Bounds]) -> Vec<(u32, u32)> {
            let mut drift = Drift::NONE;
            for (then, now) in self.broad.then(bounds.len()).iter().zip(bounds) {
                drift.add(then, now);
            }
            let near = |&&(a, b): &&(u32, u32)| bounds[a as usize].near(&bounds[b as usize], GAP);
            let candidates = self.broad.candidates(bounds, &drift, &mut self.crew);
            candidates.iter().filter(near).copied().collect()
        }
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
            // How all of them fall, and in some steps what happens to each.
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
                // More than there are bodies appear, fewer leave as many.
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
                        Event::Turn(reach) if body.exist() => body.reach = reach,
                        Event::Turn(_) => {}
                    }
                }
                prop_assert_eq!(kept.pairs(&bounds), every_pair(&bounds));
            }
        }
    }

    /// Bodies in a row, not quite touching.
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
        // Farther than where rounding is of no account.
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
