//! Detects the collisions of a scene: ground, broad phase, narrow phase.
//!
//! Threads share bodies and pairs in ranges, and their results are joined in order; the narrow
//! phase handles each pair by itself. So threads change nothing but the time. The broad phase keeps
//! candidates from one detection to the next, which changes no result either; the narrow phase
//! keeps [contacts](narrow) of bodies that hardly move against each other.

mod bounds;
mod broad;
mod cells;
mod ground;
mod narrow;
mod parry;
mod reduce;

use std::num::NonZero;
use std::thread;
use std::time::{Duration, Instant};

use pgs_support::Crew;
use zynq_pgs::{Body, Collision};

use bounds::{Bounds, GAP};
use broad::{Broad, Drift};
use narrow::{Narrow, Touch};

use crate::Geometry;

/// Distance up to which two bodies collide, m (Bullet's contact threshold).
pub const MARGIN: f32 = 0.02;

/// Smallest number of bodies to place, or of candidates, for which a further thread saves time.
const PLACED_PER_THREAD: usize = 4096;
const PAIRS_PER_THREAD: usize = 4096;
/// Largest default number of threads: the work that stays on the calling thread, such as sorting
/// candidates, leaves little to more of them.
const THREADS_UNASKED: usize = 8;
/// Smallest number of bodies for which threads are started.
const BODIES_FOR_THREADS: usize = 1024;

/// The time of each part of a detection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DetectionTimes {
    /// Bounding boxes, and contacts with the ground.
    pub bounds: Duration,
    /// Search for pairs of bodies.
    pub broad: Duration,
    /// Contacts of the pairs.
    pub narrow: Duration,
}

/// The geometry of bodies, by index into the shape table; none for the ground.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Geometries<'a>(pub(crate) &'a [Option<Geometry>]);

impl Geometries<'_> {
    /// The geometry of a body; `None` if it touches nothing but as the ground.
    fn of(self, body: &Body) -> Option<Geometry> {
        self.0.get(usize::try_from(body.shape).ok()?).copied().flatten()
    }
}

/// Detects collisions, and keeps its threads and buffers from one detection to the next.
#[derive(Debug)]
pub(crate) struct Detector {
    /// The limit on threads.
    threads: usize,
    crew: Crew,
    bounds: Vec<Bounds>,
    broad: Broad,
    /// What is known of each candidate.
    touches: Vec<Touch>,
    times: DetectionTimes,
    workers: Vec<Worker>,
}

/// The buffers of one share of the work, aligned so that no two threads write to the same pair of
/// cache lines.
#[derive(Debug)]
#[repr(align(128))]
struct Worker {
    drift: Drift,
    /// Collisions with the ground.
    ground: Vec<Collision>,
    narrow: Narrow,
    found: Vec<Collision>,
}

impl Default for Worker {
    fn default() -> Self {
        let (ground, found) = Default::default();
        Self { drift: Drift::NONE, ground, narrow: Narrow::default(), found }
    }
}

impl Default for Detector {
    fn default() -> Self {
        let threads = thread::available_parallelism().map_or(1, NonZero::get);
        Self::with_threads(threads.min(THREADS_UNASKED))
    }
}

impl Clone for Detector {
    /// Keeps what is known of the bodies; the threads start anew.
    fn clone(&self) -> Self {
        let (bounds, broad, touches) =
            (self.bounds.clone(), self.broad.clone(), self.touches.clone());
        Self { bounds, broad, touches, times: self.times, ..Self::with_threads(self.threads) }
    }
}

impl Detector {
    /// Limits the threads; the caller's is one of them.
    pub(crate) fn with_threads(threads: usize) -> Self {
        Self {
            threads,
            crew: Crew::default(),
            bounds: Vec::new(),
            broad: Broad::default(),
            touches: Vec::new(),
            times: DetectionTimes::default(),
            workers: Vec::new(),
        }
    }

    /// Limits the threads of later detections, which keep nothing from earlier ones.
    pub(crate) fn set_threads(&mut self, threads: usize) {
        *self = Self::with_threads(threads);
    }

    /// The times of the last detection.
    pub(crate) fn times(&self) -> DetectionTimes {
        self.times
    }

    /// The pairs whose bounding boxes were near in the last detection.
    pub(crate) fn pairs(&self) -> impl Iterator<Item = (u32, u32)> {
        let is_near = |pair: &(u32, u32)| near(&self.bounds, *pair);
        self.broad.candidates().iter().copied().filter(is_near)
    }

    /// Replaces `collisions` by the collisions of `bodies`, sorted by body A, then body B. Body 0
    /// is the ground and takes no part in pairs.
    pub(crate) fn detect(
        &mut self,
        bodies: &[Body],
        geometries: Geometries<'_>,
        collisions: &mut Vec<Collision>,
    ) {
        if self.crew.threads() < self.threads && bodies.len() >= BODIES_FOR_THREADS {
            self.crew = Crew::new("scene", self.threads - 1);
            // No further attempts once the system gives no more threads.
            self.threads = self.crew.threads();
        }
        self.workers.resize_with(self.crew.threads(), Worker::default);
        let begin = Instant::now();
        let drift = self.compute_bounds(bodies, geometries);
        collisions.clear();
        for worker in &self.workers {
            collisions.extend_from_slice(&worker.ground);
        }

        let placed = Instant::now();
        let Self { crew, bounds, broad, touches, workers, .. } = self;
        let anew = broad.update(bounds, &drift, crew);
        let searched = Instant::now();
        let candidates = broad.candidates();
        if anew {
            narrow::follow(touches, candidates);
        }
        let (count, share) = shares(candidates.len(), crew, PAIRS_PER_THREAD);
        let workers = &mut workers[..count];
        for worker in &mut *workers {
            worker.found.clear();
        }
        // The first share is added in place.
        if let [first, ..] = workers {
            std::mem::swap(&mut first.found, collisions);
        }
        let known = candidates.chunks(share).zip(touches.chunks_mut(share));
        crew.each(workers.iter_mut().zip(known), |(worker, (candidates, touches))| {
            let Worker { narrow, found, .. } = worker;
            let known = candidates.iter().zip(touches).filter(|(pair, _)| near(bounds, **pair));
            found.extend(known.filter_map(|(_, touch)| narrow.collide(bodies, geometries, touch)));
        });
        if let [first, others @ ..] = workers {
            std::mem::swap(&mut first.found, collisions);
            for worker in others {
                collisions.extend_from_slice(&worker.found);
            }
        }
        self.times = DetectionTimes {
            bounds: placed - begin,
            broad: searched - placed,
            narrow: searched.elapsed(),
        };
    }

    /// Computes the bounds of all bodies and collides them with the ground; returns their drift
    /// since the last search.
    fn compute_bounds(&mut self, bodies: &[Body], geometries: Geometries<'_>) -> Drift {
        let Self { crew, bounds, broad, workers, .. } = self;
        bounds.resize(bodies.len(), Bounds::NONE);
        let searched = broad.searched_bounds(bodies.len());
        let (count, share) = shares(bodies.len(), crew, PLACED_PER_THREAD);
        for worker in &mut *workers {
            worker.drift = Drift::NONE;
            worker.ground.clear();
        }
        let work = (0..).step_by(share).zip(bounds.chunks_mut(share)).zip(&mut workers[..count]);
        crew.each(work, |((first, bounds), worker)| {
            let range = first..first + bounds.len();
            let placed = (first..).zip(&bodies[range.clone()]).zip(&searched[range]).zip(bounds);
            for (((index, body), before), bounds) in placed {
                *bounds = worker.place(index, body, geometries.of(body), before);
            }
        });
        workers.iter().fold(Drift::NONE, |drift, worker| drift.union(&worker.drift))
    }
}

impl Worker {
    /// Computes the bounds of a body, and adds its collision with the ground if there is one.
    #[inline]
    fn place(
        &mut self,
        index: usize,
        body: &Body,
        geometry: Option<Geometry>,
        before: &Bounds,
    ) -> Bounds {
        let (Some(geometry), Ok(number @ 1..)) = (geometry, u32::try_from(index)) else {
            return Bounds::NONE;
        };
        let bounds = Bounds::of(body, geometry);
        self.drift.add(before, &bounds);
        if !bounds.off_the_ground() {
            self.ground.extend(ground::collide(number, body, geometry));
        }
        bounds
    }
}

/// Whether the boxes of two bodies are near enough for a pair.
fn near(bounds: &[Bounds], (a, b): (u32, u32)) -> bool {
    bounds[a as usize].near(&bounds[b as usize], GAP)
}

/// The number of shares and the size of each: one share per thread, none smaller than `least`.
fn shares(things: usize, crew: &Crew, least: usize) -> (usize, usize) {
    let count = crew.threads().min(things / least).max(1);
    (count, things.div_ceil(count).max(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{LEVEL, bits, body, digest};

    const CUBES: Geometries<'static> = Geometries(&[None, Some(Geometry::CUBE)]);

    /// Cubes in all orientations, deeper inside each other than in any pile.
    fn heap(cubes: u32) -> Vec<Body> {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f32::from(u16::try_from(state >> 16).expect("16 bits")) / 65_536.0
        };
        let mut bodies = vec![body([0.0, -400.0, 0.0], LEVEL)];
        for _ in 0..cubes {
            let position = [random() * 60.0, random() * 20.0, random() * 60.0];
            let q = [random() - 0.5, random() - 0.5, random() - 0.5, random() + 0.1];
            let length = (((q[0] * q[0] + q[1] * q[1]) + q[2] * q[2]) + q[3] * q[3]).sqrt();
            bodies.push(body(position, q.map(|value| value / length)));
        }
        bodies
    }

    #[test]
    fn collisions_are_what_a_step_takes() {
        let bodies = heap(4000);
        let mut collisions = Vec::new();
        Detector::default().detect(&bodies, CUBES, &mut collisions);
        let grounded = crate::ground_pairs(&collisions);
        assert!(grounded > 100 && collisions.len() > 4000, "{grounded} of {}", collisions.len());

        assert!(collisions.is_sorted_by_key(|c| (c.body_a, c.body_b)));
        assert!(collisions[..grounded].iter().all(|c| c.body_a == crate::GROUND));
        for c in &collisions {
            assert!(c.body_a < c.body_b, "{c:?}");
            assert!((1..=4).contains(&c.count), "{c:?}");
            let [x, y, z] = c.normal;
            assert!((((x * x + y * y) + z * z).sqrt() - 1.0).abs() < 1e-3, "{c:?}");
            for contact in &c.contacts[..usize::try_from(c.count).expect("small")] {
                assert!(contact.point.iter().all(|value| value.is_finite()), "{c:?}");
                assert!(contact.distance <= MARGIN && contact.distance.is_finite(), "{c:?}");
            }
        }
    }

    #[test]
    fn neither_buffers_nor_threads_change_a_bit() {
        let bodies = heap(6000);
        let mut one = Detector::with_threads(1);
        let mut found = Vec::new();
        one.detect(&bodies, CUBES, &mut found);
        let candidates = one.broad.candidates().len();
        assert!(candidates > 3 * PAIRS_PER_THREAD, "{candidates} pairs");
        let expected = bits(&found);

        for threads in [1, 2, 3, 7] {
            let mut detector = Detector::with_threads(threads);
            let mut found = Vec::new();
            // The second time with used buffers, after another scene.
            for cubes in [bodies.len(), 3000, bodies.len()] {
                detector.detect(&bodies[..cubes], CUBES, &mut found);
            }
            assert_eq!(bits(&found), expected, "{threads} threads");
        }
    }

    /// Cubes in pairs, half of them on the ground: no cube touches another one, some partners are
    /// near enough to be candidates, and all others are far.
    fn couples(count: u16) -> Vec<Body> {
        let mut bodies = heap(0);
        for couple in 0..count {
            let (x, z) = (8.0 * f32::from(couple % 80), 8.0 * f32::from(couple / 80));
            let y = if couple % 2 == 0 { 1.0 } else { 1.1 };
            let way = if couple % 4 < 2 { 2.1 } else { 2.6 };
            for x in [x, x + way] {
                bodies.push(body([x, y, z], LEVEL));
            }
        }
        bodies
    }

    #[test]
    fn what_moves_in_one_share_alone_is_found_in_kept_candidates_and_anew() {
        let start = couples(6300);
        // With two and with three shares, these bodies are in the last one.
        let moved = start.len() - 4000..start.len();
        // Offsets in each step: towards the partners by less than the candidates allow, then by
        // more, which makes pairs of earlier non-candidates; on the ground and above it.
        let ways =
            [[0.0, 0.0], [-0.15, 0.0], [-0.15, -0.1], [-0.65, -0.1], [-0.6, 0.1], [0.0, 0.0]];
        let steps = ways.map(|[x, y]| {
            let mut bodies = start.clone();
            for body in bodies[moved.clone()].iter_mut().skip(1).step_by(2) {
                body.pose.position[0] += x;
                body.pose.position[1] += y;
            }
            let mut found = Vec::new();
            Detector::with_threads(1).detect(&bodies, CUBES, &mut found);
            (bodies, crate::ground_pairs(&found), bits(&found))
        });
        assert!(steps.windows(2).all(|two| two[0].2 != two[1].2), "a step without a change");

        for threads in [1, 2, 3, 7] {
            let mut detector = Detector::with_threads(threads);
            let mut found = Vec::new();
            for (step, (bodies, grounded, expected)) in steps.iter().enumerate() {
                detector.detect(bodies, CUBES, &mut found);
                assert_eq!(
                    crate::ground_pairs(&found),
                    *grounded,
                    "{threads} threads, step {step}"
                );
                assert!(bits(&found) == *expected, "{threads} threads, step {step}");
            }
            let (count, _) = shares(start.len(), &detector.crew, PLACED_PER_THREAD);
            assert_eq!(count, threads.min(3));
            assert_eq!(detector.broad.searches, 3, "{threads} threads");
        }
    }

    #[test]
    fn the_bits_are_the_same_in_every_build_and_on_every_architecture() {
        let mut collisions = Vec::new();
        Detector::default().detect(&heap(4000), CUBES, &mut collisions);
        assert_eq!(digest(bits(&collisions)), "5a459d4dedca5f87");
    }

    #[test]
    fn no_bodies_have_no_collisions() {
        let mut collisions = Vec::new();
        Detector::default().detect(&[], CUBES, &mut collisions);
        assert!(collisions.is_empty());
    }
}
