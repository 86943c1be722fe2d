//! A step whose streams out are full for a while: the accelerator must stop, lose nothing and go
//! on.
//!
//! The step sends more impulses than all FIFOs behind the passes hold.

use bitstream_model::external::{ExternalAccelerator, ExternalError};
use pgs_interface::control::{AP_CTRL, ap_ctrl};
use pgs_interface::profile::Variant;

use crate::outcome::{self, Arrival, Feed, Outcome, difference};
use crate::packets::{Beats, packets};
use crate::random;
use crate::scene::Scene;

/// More than the FIFO of a sender and the one behind it hold together.
const COLLISIONS: usize = 2_000;
/// Enough that no collision meets a hazard.
const BODIES: usize = 500;
/// Clocks in which nothing takes a beat: longer than a step that ignores it.
const HELD_CLOCKS: u64 = 50_000;

/// The step of a seed, with its bodies and collisions over and over; always another pair of bodies.
fn scene(seed: u64, variant: Variant, warm_start: bool) -> Scene {
    let mut scene = random::case(seed, variant).scene;
    scene.bodies = scene.bodies.iter().cycle().take(BODIES).copied().collect();
    scene.collisions = scene.collisions.iter().cycle().take(COLLISIONS).copied().collect();
    for body in scene.bodies.iter_mut().step_by(2) {
        body.shape = 0;
        body.inverse_mass = 1.0_f32.to_bits();
    }
    for (collision, a) in scene.collisions.iter_mut().zip((0..).step_by(2)) {
        let a = a % u32::try_from(BODIES).unwrap_or(2);
        collision.bodies = [a, a + 1];
    }
    scene.arguments.warm_start = warm_start;
    scene.arguments.impulses_out = true;
    scene.arguments.in_order = warm_start;
    scene.arguments.contact_iterations = 1;
    scene.arguments.friction_iterations = 2;
    scene
}

/// The outcome of a step whose streams out are full in its first clocks.
fn run(
    accelerator: &mut dyn ExternalAccelerator,
    scene: &Scene,
    beats: &Beats,
) -> Result<Outcome, ExternalError> {
    outcome::reset(accelerator)?;
    outcome::set_up(accelerator, scene)?;
    accelerator.write(AP_CTRL.offset, ap_ctrl::START.mask())?;
    let mut feed = Feed::new(beats);
    feed.space = 0;
    while feed.busy && feed.clocks < HELD_CLOCKS {
        feed.exchange(accelerator)?;
    }
    feed.space = outcome::SPACE;
    outcome::finish(accelerator, scene, feed)
}

/// The first step on which the hardware and the model differ, or on which one of them does not
/// wait.
///
/// # Errors
/// An accelerator does not answer.
pub fn first_difference(
    variant: Variant,
    model: &mut dyn ExternalAccelerator,
    rtl: &mut dyn ExternalAccelerator,
) -> Result<Option<String>, ExternalError> {
    for (seed, warm_start) in [(2, true), (4, false)] {
        let scene = scene(seed, variant, warm_start);
        let beats = packets(&scene, None);
        let model = run(model, &scene, &beats)?;
        let rtl = run(rtl, &scene, &beats)?;
        let difference = difference(&model, &rtl, Arrival::Disturbed).or_else(|| {
            let waits = [model.waits, rtl.waits].map(u64::from);
            // Gaps of the other streams add to them.
            let right = HELD_CLOCKS / 2..2 * HELD_CLOCKS;
            let both = waits.iter().all(|waits| right.contains(waits));
            (!both).then(|| format!("waits of model and hardware {waits:?}"))
        });
        if let Some(difference) = difference {
            return Ok(Some(format!("full streams, seed {seed}: {difference}")));
        }
    }
    Ok(None)
}
