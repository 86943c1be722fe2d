//! A scene and its collisions do not depend on the rounding, flushing or trapping of the caller's
//! thread.
#![allow(unsafe_code, reason = "Rust does not say what it computes in a foreign environment")]
#![allow(clippy::print_stdout, reason = "what is skipped is said")]

use pgs_support::float_env::foreign::{Environment, environments, under};
use pgs_support::float_env::standard;
use scene::{Scene, SceneOptions, ShapesOptions};
use zynq_pgs::{Body, Collision};

/// The bodies and collisions of a pile of each kind, found with this many threads.
fn piles(
    grid: &SceneOptions,
    shapes: &ShapesOptions,
    threads: usize,
) -> Vec<(Vec<Body>, Vec<Collision>)> {
    let cubes = Scene::new(grid).expect("a scene");
    let mut several = Scene::of_shapes(shapes).expect("a scene");
    // Halves the distances, so that the bodies touch.
    let halve = |body: &mut Body| body.pose.position = body.pose.position.map(|x| 0.5 * x);
    standard(|| several.bodies_mut().iter_mut().skip(1).for_each(halve));
    let found = [cubes, several].into_iter().map(|mut scene| {
        scene.set_threads(threads);
        let collisions = scene.detect().to_vec();
        (scene.bodies().to_vec(), collisions)
    });
    found.collect()
}

#[test]
fn scenes_and_their_collisions_are_the_same_in_every_environment() {
    if environments().next().is_none() {
        println!("skipped: nothing is known of this processor's floating-point environment");
    }
    // Several threads start from about a thousand bodies, and share the work from some thousands.
    let grid = "20x12x20".parse().expect("a grid");
    let cubes = SceneOptions { grid, drop: 0.013 };
    let shapes = ShapesOptions { grid, drop: 0.0, seed: 5 };
    let expected = piles(&cubes, &shapes, 1);
    assert!(expected.iter().all(|(_, collisions)| collisions.len() > 50));
    // Text tells zeros apart by their sign.
    let expected = format!("{expected:?}");
    for threads in [1, 2] {
        for (name, environment) in environments() {
            let work = || (piles(&cubes, &shapes, threads), Environment::current());
            // SAFETY: `scene` does all the floating-point work of `work`.
            let (found, left) = unsafe { under(environment, work) };
            assert_eq!(left, environment, "{name}");
            assert!(format!("{found:?}") == expected, "{name}, {threads} threads");
        }
    }
}
