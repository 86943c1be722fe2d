//! This file detects the collisions of a scene: ground, broad phase, narrow phase.
//!
//! The pairs of the broad phase are sorted; the narrow phase looks at each by itself. So it is
//! shared out among threads in ranges of pairs, whose results are joined in their order: the number
//! of threads changes nothing but the time.

mod boxes;
mod broad;
mod ground;
mod narrow;
mod points;
mod reduce;

use std::num::NonZero;
use std::thread;

use zynq_pgs::{Body, Collision};

use broad::Broad;
use narrow::Narrow;

use crate::Geometry;

/// Distance up to which two bodies collide, m (Bullet's contact threshold).
pub const MARGIN: f32 = 0.02;

/// Fewest pairs for which a further thread pays.
const PAIRS_PER_THREAD: usize = 4096;

/// What bodies look like, by their index into the shape table; nothing for the ground.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Geometries<'a>(pub(crate) &'a [Option<Geometry>]);

impl Geometries<'_> {
    /// What a body looks like; `None` if it touches nothing but as the ground.
    fn of(self, body: &Body) -> Option<Geometry> {
        self.0.get(usize::try_from(body.shape).ok()?).copied().flatten()
    }
}

/// Finds collisions, keeping its buffers from one time to the next.
#[derive(Debug)]
pub(crate) struct Detector {
    threads: usize,
    broad: Broad,
    pairs: Vec<(u32, u32)>,
    workers: Vec<Worker>,
}

/// What one thread needs. Aligned so that no two threads write to the same pair of cache lines.
#[derive(Debug, Default)]
#[repr(align(128))]
struct Worker {
    narrow: Narrow,
    found: Vec<Collision>,
}

impl Default for Detector {
    fn default() -> Self {
        Self::with_threads(thread::available_parallelism().map_or(1, NonZero::get))
    }
}

impl Detector {
    fn with_threads(threads: usize) -> Self {
        Self { threads, broad: Broad::default(), pairs: Vec::new(), workers: Vec::new() }
    }

    /// Replaces `collisions` by those of `bodies`, sorted by body A, then body B.
    pub(crate) fn detect(
        &mut self,
        bodies: &[Body],
        geometries: Geometries<'_>,
        collisions: &mut Vec<Collision>,
    ) {
        collisions.clear();
        let placed = (0..).zip(bodies).skip(1);
        collisions.extend(placed.filter_map(|(i, b)| ground::collide(i, b, geometries.of(b)?)));

        self.broad.pairs(bodies, geometries, &mut self.pairs);
        let threads = self.threads.min(self.pairs.len() / PAIRS_PER_THREAD).max(1);
        let share = self.pairs.len().div_ceil(threads).max(1);
        if self.workers.len() < threads {
            self.workers.resize_with(threads, Worker::default);
        }
        let mut work = self.workers.iter_mut().zip(self.pairs.chunks(share));
        let own = work.next();
        // A scope takes memory even without threads.
        if threads > 1 {
            thread::scope(|scope| {
                for (worker, pairs) in work {
                    scope.spawn(|| worker.collide(bodies, geometries, pairs));
                }
                if let Some((worker, pairs)) = own {
                    worker.collide(bodies, geometries, pairs);
                }
            });
        } else if let Some((worker, pairs)) = own {
            worker.collide(bodies, geometries, pairs);
        }
        let used = self.pairs.chunks(share).len();
        for worker in &self.workers[..used] {
            collisions.extend_from_slice(&worker.found);
        }
    }
}

impl Worker {
    fn collide(&mut self, bodies: &[Body], geometries: Geometries<'_>, pairs: &[(u32, u32)]) {
        self.found.clear();
        let narrow = &mut self.narrow;
        self.found
            .extend(pairs.iter().filter_map(|&pair| narrow.collide(bodies, geometries, pair)));
    }
}

#[cfg(test)]
mod tests {
    use zynq_pgs::{Pose, Velocity};

    use super::*;

    const CUBES: Geometries<'static> = Geometries(&[None, Some(Geometry::CUBE)]);

    /// A heap of cubes in all orientations, as deep in each other as a pile never is.
    fn heap(cubes: u32) -> Vec<Body> {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f32::from(u16::try_from(state >> 16).expect("16 bits")) / 65_536.0
        };
        let body = |position, orientation| Body {
            pose: Pose { position, orientation },
            velocity: Velocity::default(),
            shape: 1,
        };
        let mut bodies = vec![body([0.0, -400.0, 0.0], [0.0, 0.0, 0.0, 1.0])];
        for _ in 0..cubes {
            let position = [random() * 60.0, random() * 20.0, random() * 60.0];
            let q = [random() - 0.5, random() - 0.5, random() - 0.5, random() + 0.1];
            let length = (((q[0] * q[0] + q[1] * q[1]) + q[2] * q[2]) + q[3] * q[3]).sqrt();
            bodies.push(body(position, q.map(|value| value / length)));
        }
        bodies
    }

    fn bits(collisions: &[Collision]) -> Vec<u32> {
        let mut bits = Vec::new();
        for c in collisions {
            bits.extend([c.body_a, c.body_b, c.count]);
            bits.extend(c.normal.map(f32::to_bits));
            for contact in c.contacts {
                bits.extend(contact.point.map(f32::to_bits));
                bits.push(contact.distance.to_bits());
            }
        }
        bits
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
        assert!(one.pairs.len() > 3 * PAIRS_PER_THREAD, "{} pairs", one.pairs.len());
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

    #[test]
    fn the_bits_are_the_same_in_every_build_and_on_every_architecture() {
        let mut collisions = Vec::new();
        Detector::default().detect(&heap(4000), CUBES, &mut collisions);
        // FNV-1a, 64 bits, over the words.
        let mut digest = 0xCBF2_9CE4_8422_2325_u64;
        for word in bits(&collisions) {
            digest = (digest ^ u64::from(word)).wrapping_mul(0x0100_0000_01B3);
        }
        assert_eq!(format!("{digest:016x}"), "7d5f4d8395f1ff8a");
    }

    #[test]
    fn no_bodies_have_no_collisions() {
        let mut collisions = Vec::new();
        Detector::default().detect(&[], CUBES, &mut collisions);
        assert!(collisions.is_empty());
    }
}
