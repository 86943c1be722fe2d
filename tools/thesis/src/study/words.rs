//! Steps bodies in the sixteen-bit words of the thesis (§4.6.4): the numbers of a step are rounded
//! to them on their way to and from the reference solver, which computes in binary16 as `half`
//! does.

use bitstream_model::reference::{self, Parameters};
use pgs_interface::number::{Precision, StreamFormat};
use zynq_pgs::{Body, Collision, Shape, StepParameters};

use crate::narrow::NarrowFormat;

/// Takes a step. A number that the words do not hold ends it in a sentence; nothing has changed
/// then.
pub(crate) fn step(
    format: NarrowFormat,
    bodies: &mut [Body],
    shapes: &[Shape],
    collisions: &[Collision],
    parameters: &StepParameters,
) -> Result<(), String> {
    let mut solved = Vec::with_capacity(bodies.len());
    for (index, body) in bodies.iter().enumerate() {
        let about = |number| format!("body {index}: {number} is beyond the words");
        let read = |numbers| words_in(format, numbers).map_err(about);
        let shape = shapes.get(body.shape as usize);
        let [x, y, z] = read(body.pose.position)?;
        let orientation = words_in(format, body.pose.orientation).map_err(about)?;
        solved.push(reference::Body {
            inverse_mass: shape.map_or(0.0, |shape| shape.inverse_mass),
            inverse_inertia: shape.map_or(0.0, |shape| shape.inverse_inertia[0]),
            position: [x, y, z],
            orientation,
            linear: read(body.velocity.linear)?,
            angular: read(body.velocity.angular)?,
        });
    }
    let mut given = Vec::with_capacity(collisions.len());
    for (index, collision) in collisions.iter().enumerate() {
        let about = |number| format!("collision {index}: {number} is beyond the words");
        let mut contacts = [[0.0; 4]; zynq_pgs::scene::CONTACT_POINTS];
        for (to, contact) in contacts.iter_mut().zip(&collision.contacts) {
            let [x, y, z] = contact.point;
            *to = words_in(format, [x, y, z, contact.distance]).map_err(about)?;
        }
        given.push(reference::Collision {
            bodies: [collision.body_a as usize, collision.body_b as usize],
            normal: words_in(format, collision.normal).map_err(about)?,
            contacts,
            count: collision.points() as usize,
        });
    }
    let step = Parameters {
        contact_iterations: parameters.contact_iterations,
        friction_iterations: parameters.friction_iterations,
        time_step: parameters.time_step,
        position_drift: parameters.position_drift,
        position_coefficient: parameters.position_coefficient,
        friction: parameters.friction,
        spin_damping: parameters.spin_damping,
        angular_damping: parameters.angular_damping,
        gravity: parameters.gravity,
    };
    reference::step(Precision::Binary16, &mut solved, &given, &step);
    for (index, body) in solved.iter_mut().enumerate().filter(|(_, body)| body.inverse_mass != 0.0)
    {
        let about = |()| format!("the result of body {index} is not finite");
        body.position = words_out(format, body.position).map_err(about)?;
        body.orientation = words_out(format, body.orientation).map_err(about)?;
        body.linear = words_out(format, body.linear).map_err(about)?;
        body.angular = words_out(format, body.angular).map_err(about)?;
    }
    for (body, solved) in bodies.iter_mut().zip(solved) {
        if solved.inverse_mass != 0.0 {
            (body.pose.position, body.pose.orientation) = (solved.position, solved.orientation);
            (body.velocity.linear, body.velocity.angular) = (solved.linear, solved.angular);
        }
    }
    Ok(())
}

/// Numbers as the step reads them; the error is the first that the words do not hold.
fn words_in<const N: usize>(format: NarrowFormat, numbers: [f32; N]) -> Result<[f32; N], f32> {
    let beyond = |number: &f32| number.is_nan() || number.abs() > StreamFormat::Binary16.largest();
    if let Some(number) = numbers.iter().copied().find(beyond) {
        return Err(number);
    }
    Ok(numbers.map(|number| format.round_trip(number).unwrap_or(number)))
}

/// Results as the host reads them; an error where one is read as infinite.
fn words_out<const N: usize>(format: NarrowFormat, numbers: [f32; N]) -> Result<[f32; N], ()> {
    const OVERFLOW: f32 = 65_536.0;
    let largest = StreamFormat::Binary16.largest();
    let mut read = numbers;
    for number in &mut read {
        let cut = number.abs() > largest && number.abs() < OVERFLOW;
        let word = if cut { largest.copysign(*number) } else { *number };
        *number = format.round_trip(word).filter(|read| read.abs() < OVERFLOW).ok_or(())?;
    }
    match numbers.iter().all(|number| number.is_finite()) {
        true => Ok(read),
        false => Err(()),
    }
}
