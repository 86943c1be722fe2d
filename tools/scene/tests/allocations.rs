//! Collision detection allocates nothing once its buffers have grown to the scene, on any thread:
//! with one thread, and with several that share the work.
#![allow(unsafe_code, reason = "an allocator that counts is an unsafe trait")]

#[path = "../../../tests/common/counting_allocator.rs"]
mod counting_allocator;

use std::sync::atomic::{AtomicU64, Ordering};

use counting_allocator::CountingAllocator;
use scene::{Scene, SceneOptions};

/// Counts the calls of all threads. Only detection's threads run in this program: it is a test
/// without a harness, whose threads would count, too.
static COUNTED: AtomicU64 = AtomicU64::new(0);

fn count() {
    COUNTED.fetch_add(1, Ordering::Relaxed);
}

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator(count);

/// Steps of one direction, and of all directions.
const WAY: usize = 6;
const STEPS: usize = 8 * WAY;

/// The number of collisions in each step, and the number of allocations.
fn detect(grid: &str, threads: usize) -> (Vec<usize>, Vec<u64>) {
    let grid = grid.parse().expect("a grid");
    let options = SceneOptions { grid, drop: 0.0 };
    let mut scene = Scene::new(&options).expect("a scene");
    scene.set_threads(threads);
    let mut counted = Vec::with_capacity(STEPS);
    let mut found = Vec::with_capacity(STEPS);
    for step in 0..STEPS {
        let before = COUNTED.load(Ordering::Relaxed);
        found.push(scene.detect().len());
        counted.push(COUNTED.load(Ordering::Relaxed) - before);
        // Everything moves, each second cube down into the others and up again: by more than the
        // candidates allow.
        let way = if (step / WAY).is_multiple_of(2) { -0.0625 } else { 0.0625 };
        for (index, body) in scene.bodies_mut().iter_mut().enumerate().skip(1) {
            body.pose.position[1] += if index % 2 == 0 { way } else { 0.0 };
            body.pose.position[0] += 0.015625;
        }
    }
    (found, counted)
}

fn main() {
    for (grid, threads, least) in
        [("8x8x8", 1, 800), ("21x20x21", 1, 15_000), ("21x20x21", 3, 15_000)]
    {
        let (found, counted) = detect(grid, threads);
        assert!(found.iter().all(|found| *found > least), "{grid}: {found:?}");
        assert!(counted[0] > 0, "the first time makes buffers: does the allocator count?");
        assert_eq!(counted[2 * WAY..], [0; STEPS - 2 * WAY], "{grid}, {threads} threads");
    }
}
