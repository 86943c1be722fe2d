//! Computes the extra data for a design that keeps only live bodies: the place of each body, its
//! first and last use, and the orders in which velocities go in and results come out.
//!
//! ```text
//! entry          0        1        2        3        4
//! bodies         1  2     3  0     -        1  3     2  4
//! places         1  2     3  0     0  0     1  3     2  4      body 0 is static: place 0
//! first use      F  F     F                                F
//! last use                                  L  L     L  L
//! velocities     1, 2, 3, 4, then the unused ones
//! poses, results 1, 3, 2, 4, then the same
//! ```
//!
//! All passes run side by side. A pass issues entry `n` when the pass before it has issued entry
//! `reach(n)`: the last of the last uses of all bodies in entries 0 to `n`. Two rules follow; where
//! one of them does not hold, the accelerator waits for ever:
//!
//! - `reach(n) - n` is at most the longest span of a body, which must be less than the delay lines
//!   between the passes are long;
//! - a body whose last use is entry `m` leaves its place once pass P - 1 has issued `m`, for which
//!   pass 0 must have issued `reach(reach(...(m)))`, P - 1 times: only behind that entry may
//!   another body take the place.
//!
//! Source: interface specification, the windowed flow.

use pgs_interface::profile::Window;
use pgs_interface::record::live::{FIRST, LAST, PLACE};

use super::{OrderInput, Schedule};

/// The first use of a body that has none.
const NEVER: u32 = u32::MAX;

/// The capacity of a design for one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Room {
    /// Places for moving bodies.
    pub(crate) places: u32,
    /// Entries between one pass and the next: more than the longest span.
    pub(crate) lag: u32,
    /// Contact and friction passes.
    pub(crate) passes: u32,
    /// Entries that enter together. The number of entries is a multiple of it.
    pub(crate) per_issue: u32,
}

impl Room {
    /// The capacity of a design in a step of `passes` passes.
    pub(crate) fn of(window: &Window, passes: u32, per_issue: u32) -> Self {
        let places = window.slots.saturating_sub(1).min(PLACE);
        Self { places, lag: window.lag, passes, per_issue }
    }
}

/// The reason why a schedule cannot be sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LiveError {
    /// A body lives too long.
    SpanTooLong { body: u32, first: u32, last: u32 },
    /// The schedule needs `held` places, more than the design has.
    TooFewPlaces { held: u32 },
}

/// The number of bodies that a schedule keeps on chip, and the length of their lives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct LiveReport {
    /// Most moving bodies between their first and their last use.
    pub most_alive: u32,
    /// Most moving bodies that hold a place: from their first use to the end of their last use in
    /// the last pass.
    pub most_held: u32,
    /// Longest span of a moving body, from its first use to its last, entries.
    pub longest_span: u32,
}

/// Lives of the bodies of a step. The memory is kept from step to step.
#[derive(Debug, Default)]
pub(crate) struct Lives {
    words: Vec<[u32; 2]>,
    velocities: Vec<u32>,
    results: Vec<u32>,
    report: LiveReport,
    /// First and last entry of each body.
    uses: Vec<(u32, u32)>,
    /// For each entry the last entry that pass 0 must have issued before the last pass can issue
    /// it.
    reach: Vec<u32>,
    /// The entry behind the last use of the body in each place.
    occupied: Vec<u32>,
    /// The place of each body.
    places: Vec<u32>,
}

impl Lives {
    /// The words beside normal and offset of each entry's record: place and marks. Entries behind
    /// the end of the schedule are empty.
    pub(crate) fn words(&self) -> &[[u32; 2]] {
        &self.words
    }

    /// Moving bodies in the order of their first use, then the unused ones.
    pub(crate) fn velocities(&self) -> &[u32] {
        &self.velocities
    }

    /// Moving bodies in the order of their last use, then the unused ones.
    pub(crate) fn results(&self) -> &[u32] {
        &self.results
    }

    /// The demand of the schedule.
    pub(crate) fn report(&self) -> LiveReport {
        self.report
    }

    /// Gives every moving body its place and marks its uses, for a schedule of the input's
    /// collisions.
    ///
    /// # Errors
    /// [`LiveError`]: a body that lives too long, or too few places.
    pub(crate) fn assign_places(
        &mut self,
        schedule: &Schedule,
        input: &OrderInput<'_>,
        room: Room,
    ) -> Result<(), LiveError> {
        self.find_uses(schedule, input);
        self.order_bodies(schedule, input);
        self.report = LiveReport::default();
        let spans = (0..).zip(&self.uses).filter(|(_, (first, _))| *first != NEVER);
        let longest = spans.max_by_key(|(_, (first, last))| last - first);
        if let Some((body, (first, last))) = longest {
            self.report.longest_span = last - first;
            if last - first >= room.lag {
                return Err(LiveError::SpanTooLong { body, first: *first, last: *last });
            }
        }
        self.find_reach(schedule, input, room.passes);
        self.count(schedule, input);
        if self.report.most_held > room.places {
            return Err(LiveError::TooFewPlaces { held: self.report.most_held });
        }
        self.mark(schedule, input, room.places);
        let issues = self.words.len().next_multiple_of(room.per_issue.max(1) as usize);
        self.words.resize(issues, [0; 2]);
        Ok(())
    }

    fn find_uses(&mut self, schedule: &Schedule, input: &OrderInput<'_>) {
        self.uses.clear();
        self.uses.resize(input.moving.len(), (NEVER, 0));
        for (entry, bodies) in moving_bodies(schedule, input) {
            for body in bodies.into_iter().flatten() {
                let (first, last) = &mut self.uses[body as usize];
                *first = entry.min(*first);
                *last = entry;
            }
        }
    }

    fn order_bodies(&mut self, schedule: &Schedule, input: &OrderInput<'_>) {
        self.velocities.clear();
        self.results.clear();
        for (entry, bodies) in moving_bodies(schedule, input) {
            for body in bodies.into_iter().flatten() {
                let (first, last) = self.uses[body as usize];
                if first == entry {
                    self.velocities.push(body);
                }
                if last == entry {
                    self.results.push(body);
                }
            }
        }
        let unused = (0..).zip(input.moving).zip(&self.uses);
        for ((body, moves), (first, _)) in unused {
            if *moves && *first == NEVER {
                self.velocities.push(body);
                self.results.push(body);
            }
        }
    }

    /// For each entry finds the entry that pass 0 must have issued before the last pass can issue
    /// it.
    fn find_reach(&mut self, schedule: &Schedule, input: &OrderInput<'_>, passes: u32) {
        self.reach.clear();
        let mut furthest = 0;
        for (entry, bodies) in moving_bodies(schedule, input) {
            furthest = furthest.max(entry);
            for body in bodies.into_iter().flatten() {
                furthest = furthest.max(self.uses[body as usize].1);
            }
            self.reach.push(furthest);
        }
        // `passes - 1` steps on. A step never leads back, so the entries ahead still hold the first
        // step.
        for entry in 0..self.reach.len() {
            let mut reached = self.reach[entry];
            for _ in 2..passes {
                let next = self.reach[reached as usize];
                if next == reached {
                    break;
                }
                reached = next;
            }
            self.reach[entry] = match passes {
                0 | 1 => u32::try_from(entry).unwrap_or(NEVER),
                _ => reached,
            };
        }
    }

    /// Counts the bodies that are alive, and the bodies that hold a place.
    fn count(&mut self, schedule: &Schedule, input: &OrderInput<'_>) {
        let LiveReport { most_alive, most_held, .. } = &mut self.report;
        let mut done = moving_bodies(schedule, input).peekable();
        let (mut alive, mut held) = (0, 0);
        for (entry, bodies) in moving_bodies(schedule, input) {
            while let Some((earlier, bodies)) =
                done.next_if(|(earlier, _)| self.reach[*earlier as usize] < entry)
            {
                let gone = |body: &u32| self.uses[*body as usize].1 == earlier;
                held -= bodies.iter().flatten().filter(|body| gone(body)).count();
            }
            let uses = || bodies.iter().flatten().map(|body| self.uses[*body as usize]);
            let born = uses().filter(|(first, _)| *first == entry).count();
            (alive, held) = (alive + born, held + born);
            let counts = [alive, held].map(|count| u32::try_from(count).unwrap_or(u32::MAX));
            (*most_alive, *most_held) = ((*most_alive).max(counts[0]), (*most_held).max(counts[1]));
            alive -= uses().filter(|(_, last)| *last == entry).count();
        }
    }

    /// Writes the words of each entry. The number of places was checked before.
    fn mark(&mut self, schedule: &Schedule, input: &OrderInput<'_>, places: u32) {
        self.words.clear();
        self.places.clear();
        self.places.resize(input.moving.len(), 0);
        self.occupied.clear();
        self.occupied.resize(places as usize + 1, 0);
        // Places are taken in turn, so that bodies that live at the same time lie next to each
        // other.
        let mut next = 0;
        // The places that are free after this entry have been released.
        let mut done = 0_u32;
        for (entry, bodies) in moving_bodies(schedule, input) {
            while self.reach.get(done as usize).is_some_and(|reached| *reached < entry) {
                done += 1;
            }
            self.words.push(bodies.map(|body| {
                let Some(body) = body else { return 0 };
                let (first, last) = self.uses[body as usize];
                if first == entry {
                    let mut place = next % places + 1;
                    while self.occupied[place as usize] > done {
                        place = place % places + 1;
                    }
                    next = place;
                    self.occupied[place as usize] = last + 1;
                    self.places[body as usize] = place;
                }
                let mark = |marked, mark| if marked { mark } else { 0 };
                self.places[body as usize] | mark(first == entry, FIRST) | mark(last == entry, LAST)
            }));
        }
    }
}

/// The moving bodies of each entry.
fn moving_bodies<'a>(
    schedule: &'a Schedule,
    input: &'a OrderInput<'a>,
) -> impl Iterator<Item = (u32, [Option<u32>; 2])> + 'a {
    (0..).zip(schedule.iter()).map(|(entry, collision)| {
        let pair = collision.and_then(|index| input.pairs.get(index as usize));
        let moving = |body: u32| input.moving.get(body as usize) == Some(&true);
        let bodies = pair.map_or([None; 2], |pair| pair.map(|body| moving(body).then_some(body)));
        (entry, bodies)
    })
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use proptest::prelude::*;

    use super::*;

    fn schedule(entries: &[Option<u32>]) -> Schedule {
        entries.iter().copied().collect()
    }

    const WIDE: Room = Room { places: 8191, lag: 2816, passes: 8, per_issue: 1 };

    /// The picture at the head of this file.
    #[test]
    fn marks_and_orders_are_those_of_the_picture() {
        let input = OrderInput {
            pairs: &[[1, 2], [3, 0], [1, 3], [2, 4]],
            moving: &[false, true, true, true, true, true],
            positions: &[[0.0; 3]; 6],
        };
        let order = schedule(&[Some(0), Some(1), None, Some(2), Some(3)]);
        let mut lives = Lives::default();
        lives.assign_places(&order, &input, WIDE).expect("there is room");
        let words = [
            [1 | FIRST, 2 | FIRST],
            [3 | FIRST, 0],
            [0, 0],
            [1 | LAST, 3 | LAST],
            [2 | LAST, 4 | FIRST | LAST],
        ];
        assert_eq!(lives.words(), words);
        assert_eq!(lives.velocities(), [1, 2, 3, 4, 5]);
        assert_eq!(lives.results(), [1, 3, 2, 4, 5]);
        let report = LiveReport { most_alive: 3, most_held: 4, longest_span: 4 };
        assert_eq!(lives.report(), report);
        // One pass: bodies 1 and 3 are done when 4 comes, before they have left.
        lives
            .assign_places(&order, &input, Room { passes: 1, places: 3, lag: 5, ..WIDE })
            .expect("just enough");
        assert_eq!(lives.words()[4], [2 | LAST, 1 | FIRST | LAST]);
        assert_eq!(lives.report(), LiveReport { most_held: 3, ..report });
        // Two passes: the second issues entry 3 once the first has issued entry 4.
        let two = Room { passes: 2, places: 3, lag: 5, ..WIDE };
        assert_eq!(
            lives.assign_places(&order, &input, two),
            Err(LiveError::TooFewPlaces { held: 4 })
        );
        let span = LiveError::SpanTooLong { body: 2, first: 0, last: 4 };
        assert_eq!(lives.assign_places(&order, &input, Room { lag: 4, ..WIDE }), Err(span));
    }

    #[test]
    fn without_collisions_every_body_comes_in_its_turn() {
        let moving = [false, true, false, true, true];
        let input = OrderInput { pairs: &[], moving: &moving, positions: &[[0.0; 3]; 5] };
        let mut lives = Lives::default();
        lives.assign_places(&Schedule::default(), &input, WIDE).expect("there is room");
        assert_eq!((lives.velocities(), lives.results()), (&[1, 3, 4][..], &[1, 3, 4][..]));
        assert_eq!(lives.report(), LiveReport::default());
    }

    /// Lets entries issue by the rules of the specification, without time: each pass issues its
    /// next entry as long as any pass can. Bodies must then be in the places that the words name.
    struct Accelerator<'a> {
        words: &'a [[u32; 2]],
        room: Room,
        /// Entries that each pass has issued.
        issued: Vec<usize>,
        pub(crate) velocities: VecDeque<u32>,
        places: Vec<Option<u32>>,
        results: Vec<u32>,
        /// Bodies of each entry, as they were found in their places.
        found: Vec<[Option<u32>; 2]>,
    }

    impl<'a> Accelerator<'a> {
        fn new(words: &'a [[u32; 2]], velocities: &[u32], room: Room) -> Self {
            Self {
                words,
                room,
                issued: vec![0; room.passes as usize],
                velocities: velocities.iter().copied().collect(),
                places: vec![None; room.places as usize + 1],
                results: Vec::new(),
                found: Vec::new(),
            }
        }

        /// The last entry that uses a place as `entry` does.
        fn last_use(&self, entry: usize, place: u32) -> Option<usize> {
            let uses = |words: &[u32; 2]| words.iter().any(|w| w & PLACE == place && w & LAST != 0);
            (entry..self.words.len()).find(|at| uses(&self.words[*at]))
        }

        fn may_issue(&self, pass: usize) -> bool {
            let entry = self.issued[pass];
            if entry == self.words.len() {
                return false;
            }
            let behind = self.issued.get(pass + 1).copied();
            if behind.is_some_and(|behind| entry - behind >= self.room.lag as usize) {
                return false;
            }
            let moving = self.words[entry].into_iter().filter(|word| word & PLACE != 0);
            moving.into_iter().all(|word| {
                let place = word & PLACE;
                if pass == 0 {
                    return word & FIRST == 0 || self.places[place as usize].is_none();
                }
                let before = self.issued[pass - 1];
                self.last_use(entry, place).is_some_and(|last| last < before)
            }) && (pass == 0 || entry < self.issued[pass - 1])
        }

        fn issue(&mut self, pass: usize) {
            let entry = self.issued[pass];
            if pass == 0 {
                let found = self.words[entry].map(|word| {
                    let place = word & PLACE;
                    if place == 0 {
                        assert_eq!(word, 0, "what is static has no marks");
                        return None;
                    }
                    if word & FIRST != 0 {
                        let body = self.velocities.pop_front().expect("a velocity");
                        self.places[place as usize] = Some(body);
                    }
                    Some(self.places[place as usize].expect("a body in its place"))
                });
                self.found.push(found);
            }
            if pass + 1 == self.issued.len() {
                for word in self.words[entry] {
                    if word & LAST != 0 {
                        let body = self.places[(word & PLACE) as usize].take();
                        self.results.push(body.expect("a body in its place"));
                    }
                }
            }
            self.issued[pass] += 1;
        }

        /// Whether every pass issues every entry.
        fn run(&mut self) -> bool {
            while let Some(pass) = (0..self.issued.len()).find(|pass| self.may_issue(*pass)) {
                self.issue(pass);
            }
            self.issued.iter().all(|issued| *issued == self.words.len())
        }
    }

    /// A line of bodies, each in touch with some near it: entries in a random order.
    fn scene() -> impl Strategy<Value = (Vec<bool>, Vec<[u32; 2]>, Vec<Option<u32>>)> {
        (2_u32..40).prop_flat_map(|count| {
            let pairs = prop::collection::vec((0..count, 1..6_u32), 0..60);
            let moving = prop::collection::vec(prop::bool::weighted(0.9), count as usize);
            (moving, pairs, any::<u64>()).prop_map(move |(moving, pairs, seed)| {
                let pairs: Vec<[u32; 2]> = pairs
                    .into_iter()
                    .map(|(a, step)| [a, (a + step) % count])
                    .filter(|[a, b]| a != b && (moving[*a as usize] || moving[*b as usize]))
                    .collect();
                let mut entries: Vec<Option<u32>> =
                    (0..).zip(&pairs).map(|(index, _)| Some(index)).collect();
                let mut state = seed | 1;
                let mut random = |below: usize| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    usize::try_from(state >> 33).expect("31 bits") % below.max(1)
                };
                // Now and then far from the old place, now and then an empty entry.
                for at in 0..entries.len() {
                    let other = (at + random(5)).min(entries.len() - 1);
                    entries.swap(at, other);
                }
                for _ in 0..random(6) {
                    entries.insert(random(entries.len() + 1), None);
                }
                (moving, pairs, entries)
            })
        })
    }

    proptest! {
        /// Where the driver finds room, the accelerator never waits for ever, finds every body in
        /// its place, and receives and sends each body exactly once. Where the driver finds none,
        /// the accelerator has none.
        #[test]
        fn marks_decode_back_and_never_lock_up(
            (moving, pairs, entries) in scene(),
            passes in 1_u32..6,
            per_issue in 1_u32..3,
            tight in any::<[bool; 2]>(),
        ) {
            let positions = vec![[0.0; 3]; moving.len()];
            let input = OrderInput { pairs: &pairs, moving: &moving, positions: &positions };
            let order = schedule(&entries);
            let mut lives = Lives::default();
            let wide = Room { places: 40, lag: 100, passes, per_issue };
            lives.assign_places(&order, &input, wide).expect("40 bodies, 66 entries");
            let needs = lives.report();
            let room = Room {
                places: if tight[0] { needs.most_held.max(1) } else { wide.places },
                lag: if tight[1] { needs.longest_span + 1 } else { wide.lag },
                passes,
                per_issue,
            };
            lives.assign_places(&order, &input, room).expect("what it needs is enough");
            prop_assert_eq!(lives.report(), needs);
            let mut accelerator = Accelerator::new(lives.words(), lives.velocities(), room);
            prop_assert!(accelerator.run(), "stuck at {:?}", accelerator.issued);
            prop_assert_eq!(lives.words().len() as u64 % u64::from(per_issue), 0);
            prop_assert!(lives.words().len() < entries.len() + per_issue as usize);
            for (entry, found) in accelerator.found.iter().enumerate() {
                let index = entries.get(entry).copied().flatten();
                let pair = index.map(|index| pairs[index as usize]);
                let expected = pair.map_or([None; 2], |pair| {
                    pair.map(|body| moving[body as usize].then_some(body))
                });
                prop_assert_eq!(*found, expected);
            }
            let used = accelerator.results.len();
            prop_assert_eq!(&accelerator.results[..], &lives.results()[..used]);
            let unused: Vec<u32> = accelerator.velocities.into_iter().collect();
            prop_assert_eq!(&unused[..], &lives.results()[used..]);
            let mut all = lives.results().to_vec();
            all.sort_unstable();
            let expected: Vec<u32> =
                (0..).zip(&moving).filter(|(_, moves)| **moves).map(|(body, _)| body).collect();
            prop_assert_eq!(all, expected);
            // The same marks in delay lines that are an entry too short.
            if passes > 1 && needs.longest_span > 0 {
                let short = Room { lag: needs.longest_span, ..room };
                let refused = Lives::default().assign_places(&order, &input, short);
                let too_long = matches!(refused, Err(LiveError::SpanTooLong { .. }));
                prop_assert!(too_long, "{:?}", refused);
                let mut accelerator = Accelerator::new(lives.words(), lives.velocities(), short);
                prop_assert!(!accelerator.run(), "it would have gone");
            }
            if needs.most_held > 1 {
                let few = Room { places: needs.most_held - 1, ..room };
                prop_assert_eq!(
                    Lives::default().assign_places(&order, &input, few),
                    Err(LiveError::TooFewPlaces { held: needs.most_held })
                );
            }
        }
    }
}
