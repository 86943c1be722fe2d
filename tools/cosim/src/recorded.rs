//! Recorded steps: a folder's scene, and its results as bits.

use pgs_interface::profile::{Inertia, Variant};
use pgs_interface::record::CONTACT_POINTS;
use step_folder::folder::{Folder, State};
use step_folder::npy::{Dimensions, NpyError, read};
use zynq_pgs::Body as DriverBody;

use crate::outcome::Outcome;
use crate::scene::{Arguments, Body, Collision, Scene, Shape};

/// The scene of a folder, in the order of its arrays and past a queue, for an accelerator. The
/// shapes of the folder have one moment of inertia about every axis; with world inertia each body
/// brings it, and its mass.
#[must_use]
pub fn scene(folder: &Folder, variant: Variant) -> Scene {
    let bits = |vector: [f32; 3]| vector.map(f32::to_bits);
    let position = |body: usize| bits(folder.bodies[body].pose.position);
    let shapes = folder.shapes.iter().map(|shape| Shape {
        inverse_mass: shape.inverse_mass.to_bits(),
        inverse_inertia: shape.inverse_inertia[0].to_bits(),
    });
    let shape_of = |body: &DriverBody| folder.shapes.get(body.shape as usize);
    let world = |body: &DriverBody| {
        let moment = shape_of(body).map_or(0.0, |shape| shape.inverse_inertia[0]);
        [moment, moment, moment, 0.0, 0.0, 0.0].map(f32::to_bits)
    };
    let bodies = folder.bodies.iter().map(|body| Body {
        linear: bits(body.velocity.linear),
        angular: bits(body.velocity.angular),
        position: bits(body.pose.position),
        orientation: body.pose.orientation.map(f32::to_bits),
        shape: body.shape,
        inverse_inertia: world(body),
        inverse_mass: shape_of(body).map_or(0, |shape| shape.inverse_mass.to_bits()),
    });
    let collisions = folder.collisions.iter().map(|collision| {
        let mut points = [[0; 4]; CONTACT_POINTS];
        for (point, contact) in points.iter_mut().zip(&collision.contacts) {
            let [x, y, z] = bits(contact.point);
            *point = [x, y, z, contact.distance.to_bits()];
        }
        let sides = [collision.body_a, collision.body_b];
        Collision {
            bodies: sides,
            positions: sides.map(|side| position(side as usize)),
            normal: bits(collision.normal),
            count: collision.count,
            points,
            impulses: [[0; 4]; 2],
        }
    });
    let parameters = &folder.parameters;
    Scene {
        variant,
        shapes: shapes.collect(),
        bodies: bodies.collect(),
        collisions: collisions.collect(),
        arguments: Arguments {
            contact_iterations: parameters.contact_iterations,
            friction_iterations: parameters.friction_iterations,
            integrate: parameters.integrate,
            kinematic: parameters.kinematic,
            pair_friction: parameters.pair_friction,
            warm_start: false,
            impulses_out: parameters.impulses_out,
            streamed_masses: variant.inertia == Inertia::World,
            in_order: true,
            numbers: [
                parameters.time_step,
                parameters.position_drift,
                parameters.position_coefficient,
                parameters.friction,
                parameters.angular_damping,
                parameters.spin_damping,
            ]
            .map(f32::to_bits),
            gravity: bits(parameters.gravity),
        },
    }
}

/// Values of an outcome that differ in bits from a folder's recorded results, of how many.
///
/// # Errors
/// A file of results is missing or wrong.
pub fn differences(folder: &Folder, outcome: &Outcome) -> Result<(usize, usize), NpyError> {
    let found = bodies(outcome, &folder.bodies);
    let mut differ = 0;
    let mut all = 0;
    for state in State::ALL {
        let shape = Dimensions(vec![Some(found.len()), Some(state.width())]);
        let (_, expected) = read::<f32>(&folder.path.join(state.file()), &shape)?;
        let bits = expected.iter().copied().map(f32::to_bits);
        differ += bits.zip(state.of(&found)).filter(|(e, f)| *e != f.to_bits()).count();
        all += expected.len();
    }
    Ok((differ, all))
}

/// The bodies of an outcome, with the shapes of `before`.
fn bodies(outcome: &Outcome, before: &[DriverBody]) -> Vec<DriverBody> {
    let row = |stream: usize, body: usize| {
        let beats = &outcome.results[stream];
        let body = body + if stream == 0 { outcome.impulse_beats } else { 0 };
        beats.get(body).map_or([f32::NAN; 4], |beat| beat.beat.0.map(f32::from_bits))
    };
    let three = |[x, y, z, _]: [f32; 4]| [x, y, z];
    let with = |(index, body): (usize, &DriverBody)| {
        let mut body = *body;
        body.pose.position = three(row(0, index));
        body.pose.orientation = row(1, index);
        body.velocity.linear = three(row(2, index));
        body.velocity.angular = three(row(3, index));
        body
    };
    before.iter().enumerate().map(with).collect()
}
