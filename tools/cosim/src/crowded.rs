//! Steps that an issue queue finds hard: collisions that hinder each other all the time.

use pgs_interface::profile::Variant;

use crate::scene::Scene;

/// Collisions of the body that all of them have in common.
const HUB: u16 = 2_000;
/// Pairs on either side of the one that starves: more than its patience takes.
const PAIRS: u32 = 30;

/// All of them: each with its name.
#[must_use]
pub fn scenes(variant: Variant) -> [(&'static str, Scene); 2] {
    [("one body in all collisions", hub(variant)), ("a starving pair", starving(variant))]
}

fn hub(variant: Variant) -> Scene {
    let mut scene = Scene::row(variant, HUB + 1, (1..=u32::from(HUB)).map(|body| [0, body]));
    scene.arguments.contact_iterations = 0;
    scene.arguments.friction_iterations = 1;
    scene
}

/// The pair of bodies 0 and 1 is the oldest one from the slot on in which its other neighbour
/// issues for the first time. After it come pairs of either body, in turn, and they issue in turn:
/// one of them becomes free in the last slot of the patience, and one in the first slot behind it.
#[must_use]
pub fn starving(variant: Variant) -> Scene {
    let alternating = (0..PAIRS).flat_map(|_| [[1, 3], [0, 2]]);
    let pairs = [[0, 2], [0, 1]].into_iter().chain(alternating);
    let mut scene = Scene::row(variant, 5, pairs);
    scene.arguments.contact_iterations = 1;
    scene.arguments.friction_iterations = 1;
    scene
}
