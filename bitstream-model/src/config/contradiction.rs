//! Refuses window designs that contradict themselves.

use pgs_interface::profile::{Geometry, Profile, Window};
use pgs_interface::record::live;

/// The contradiction in a profile that streams the collisions once, as the expected state; `None`
/// if the profile is sound.
pub(crate) fn contradiction(profile: &Profile, window: &Window) -> Option<&'static str> {
    let units = 1..=0xFF;
    let stripes = &profile.stripes;
    let inputs = [&stripes.collisions, &stripes.velocities, &stripes.poses];
    let shared = inputs.iter().enumerate().any(|(k, stripe)| {
        let others = inputs[k + 1..].iter().flat_map(|other| other.streams);
        others.into_iter().any(|stream| stripe.streams.contains(stream))
    });
    let wrong = [
        (
            profile.geometry != Geometry::Relative,
            "collisions relative to body A are expected of a design with a window: its marks are in \
             their index words",
        ),
        (
            !units.contains(&window.contact_units) || !units.contains(&window.friction_units),
            "1 to 255 units of each kind are expected of a design with a window",
        ),
        (
            !(2..=live::PLACE + 1).contains(&window.slots),
            "2 to 8192 places are expected of a design with a window: the first is that of static \
             bodies, and 13 bits name one",
        ),
        (
            !(1..=0xFFFF).contains(&window.lag),
            "1 to 65535 collisions between two passes are expected of a design with a window",
        ),
        (
            shared,
            "collisions, velocities and poses on streams of their own are expected of a design with a \
             window: they come at the same time",
        ),
    ];
    wrong.into_iter().find(|(wrong, _)| *wrong).map(|(_, what)| what)
}
