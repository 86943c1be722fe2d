//! Packing and its checks against the specification and against validation.

mod checks;
mod checks_of_any_input;
mod checks_of_bodies;
mod pack;
mod pool;
mod warm;

use super::Target;
use super::bodies::{Survey, pack_bodies};
use super::pool::PackPool;
use super::stripe::Segment;
use crate::record::body_table::Table;
use crate::scene::{Bodies, Shape, StepParameters};
use crate::validate::{Scene, SceneNeeds};
use pgs_interface::profile::Variant;
use pgs_interface::record::Beat;

/// The context of a step whose sizes are not checked.
fn scene<'a>(variant: &'a Variant, shapes: &'a [Shape]) -> Scene<'a> {
    let needs = SceneNeeds { bodies: 0, collisions: 0, inertia: variant.inertia };
    Scene::new(shapes, needs, variant, &StepParameters::default())
}

/// Buffers for `records` records, full of ones, so that a missing beat shows.
fn buffers(variant: &Variant, segment: Segment, records: usize) -> Vec<Vec<Beat>> {
    let layout = segment.layout(variant);
    let beats = |channel| layout.beats_on_channel(records, channel);
    let channels = 0..variant.profile.mm2s_widths.len();
    channels.map(|channel| vec![Beat([u32::MAX; 4]); beats(channel)]).collect()
}

fn views(buffers: &mut [Vec<Beat>]) -> Vec<&mut [Beat]> {
    buffers.iter_mut().map(Vec::as_mut_slice).collect()
}

/// The ends of bodies, and whether validation accepts all bodies.
pub(super) fn surveyed<B: Bodies + ?Sized>(target: Target<'_>, bodies: &B) -> (Table, bool) {
    let (mut ends, mut statics) = (Table::default(), Vec::new());
    let into = Survey { ends: &mut ends, statics: &mut statics };
    let [mut velocities, mut poses] = [Segment::Velocities, Segment::Poses]
        .map(|segment| buffers(target.scene.variant, segment, bodies.len()));
    let into_channels = (&mut *views(&mut velocities), &mut *views(&mut poses));
    let packers = &mut PackPool::alone();
    let (.., good) = pack_bodies(target, bodies, bodies.len(), into, into_channels, packers);
    (ends, good)
}
