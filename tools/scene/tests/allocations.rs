//! Finding collisions allocates nothing once as many have been found, where one thread is enough for
//! them. Each further thread is started anew, which takes memory.
#![allow(unsafe_code, reason = "an allocator that counts is an unsafe trait")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use scene::{Scene, SceneOptions};

thread_local! {
    static COUNTED: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, counting the calls of each thread.
struct Counting;

fn count() {
    // A thread that is ending has no counter any more.
    let _ = COUNTED.try_with(|counted| counted.set(counted.get() + 1));
}

// SAFETY: every call goes to the system's allocator with the arguments as they came; counting
// itself does not allocate.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promises about `layout` are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are passed on; `alloc` took the memory from `System`.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        count();
        // SAFETY: the caller's promises are passed on; `alloc` took the memory from `System`.
        unsafe { System.realloc(pointer, layout, bytes) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn finding_collisions_again_allocates_nothing() {
    let grid = "8x8x8".parse().expect("a grid");
    let options = SceneOptions { grid, drop: 0.0, ..SceneOptions::default() };
    let mut scene = Scene::new(&options).expect("a scene");
    let mut counted = Vec::with_capacity(10);
    let mut found = Vec::with_capacity(10);
    for _ in 0..10 {
        let before = COUNTED.get();
        found.push(scene.detect().len());
        counted.push(COUNTED.get() - before);
        // Everything moves; each second column sinks into the ground.
        for (index, body) in scene.bodies_mut().iter_mut().enumerate().skip(1) {
            let down = if index % 2 == 0 { -0.001 } else { 0.0 };
            body.pose.position[1] += down;
            body.pose.position[0] += 0.01;
        }
    }
    assert!(found.iter().all(|found| *found > 1000), "{found:?}");
    assert!(counted[0] > 0, "the first time makes buffers: does the allocator count?");
    assert_eq!(counted[1..], [0; 9], "{counted:?}");
}
