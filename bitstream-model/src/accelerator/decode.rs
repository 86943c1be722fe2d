//! This file decodes beats into records, from the interface's layouts alone.

use super::integrate::Pose;
use super::solver::Velocity;
use crate::interface::record::{
    Beat, CONTACT_POINTS, WORD_LANE, collision, pose, result, velocity,
};

fn vec3(beat: Beat) -> [f32; 3] {
    let [x, y, z, _] = beat.0;
    [x, y, z].map(f32::from_bits)
}

fn vec4(beat: Beat) -> [f32; 4] {
    beat.0.map(f32::from_bits)
}

fn word(beat: Beat) -> u32 {
    beat.0[WORD_LANE]
}

/// A collision as it comes in. `count` is as received and may be out of range.
#[derive(Debug, Clone, Copy)]
pub(super) struct Collision {
    pub(super) body_a: u32,
    pub(super) body_b: u32,
    pub(super) count: usize,
    pub(super) normal: [f32; 3],
    pub(super) position_a: [f32; 3],
    pub(super) position_b: [f32; 3],
    /// x, y, z and distance.
    pub(super) contacts: [[f32; 4]; CONTACT_POINTS],
}

impl Collision {
    #[inline]
    pub(super) fn from_beats(beats: &[Beat; collision::ROWS]) -> Self {
        let mut contacts = [[0.0; 4]; CONTACT_POINTS];
        for (contact, beat) in contacts.iter_mut().zip(&beats[collision::CONTACTS..]) {
            *contact = vec4(*beat);
        }
        Self {
            body_a: word(beats[collision::BODY_A]),
            body_b: word(beats[collision::BODY_B]),
            count: word(beats[collision::NORMAL]) as usize,
            normal: vec3(beats[collision::NORMAL]),
            position_a: vec3(beats[collision::BODY_A]),
            position_b: vec3(beats[collision::BODY_B]),
            contacts,
        }
    }
}

/// A velocity record: the velocity and the shape index.
pub(super) fn velocity_from_beats(beats: &[Beat; velocity::ROWS]) -> (Velocity, u32) {
    let linear = beats[velocity::LINEAR];
    let angular = vec3(beats[velocity::ANGULAR]);
    (Velocity { linear: vec3(linear), angular }, word(linear))
}

/// A pose record.
pub(super) fn pose_from_beats(beats: &[Beat; pose::ROWS]) -> Pose {
    Pose { position: vec3(beats[pose::POSITION]), orientation: vec4(beats[pose::ORIENTATION]) }
}

/// The result record of a body.
pub(super) fn result_to_beats(pose: &Pose, velocity: &Velocity) -> [Beat; result::ROWS] {
    let row = |[x, y, z]: [f32; 3]| Beat([x.to_bits(), y.to_bits(), z.to_bits(), 0]);
    let mut beats = [Beat::default(); result::ROWS];
    beats[result::POSITION] = row(pose.position);
    beats[result::ORIENTATION] = Beat(pose.orientation.map(f32::to_bits));
    beats[result::LINEAR] = row(velocity.linear);
    beats[result::ANGULAR] = row(velocity.angular);
    beats
}
