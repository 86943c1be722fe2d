//! Decodes rows into records and encodes results, from the interface's layouts alone.
//!
//! Every word is decoded by a match on its format. Where the format is known, inlining removes the
//! match.

use super::array::Row;
use crate::accelerator::arithmetic::sixteen;
use crate::accelerator::state::{Pose, Velocity};
use pgs_interface::control::NUMBERS_PER_BEAT;
use pgs_interface::number::StreamFormat;
use pgs_interface::record::{
    Beat, CONTACT_POINTS, LANES, WORD_LANE, collision, pose, result, velocity,
};

/// The number in a word of a format.
#[inline(always)]
pub(crate) fn number(format: StreamFormat, word: u32) -> f32 {
    match format {
        StreamFormat::F32 => f32::from_bits(word),
        StreamFormat::Binary16 => sixteen::from_binary16(word),
    }
}

/// The word of a format nearest to a number.
#[inline(always)]
fn word(format: StreamFormat, number: f32) -> u32 {
    match format {
        StreamFormat::F32 => number.to_bits(),
        StreamFormat::Binary16 => sixteen::to_binary16(number),
    }
}

#[inline(always)]
fn vec3(format: StreamFormat, [x, y, z, _]: Row) -> [f32; 3] {
    [number(format, x), number(format, y), number(format, z)]
}

#[inline(always)]
fn vec4(format: StreamFormat, [x, y, z, w]: Row) -> [f32; 4] {
    [number(format, x), number(format, y), number(format, z), number(format, w)]
}

/// A collision as it comes in. `count` is as received and may be out of range.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Collision {
    pub(crate) body_a: u32,
    pub(crate) body_b: u32,
    pub(crate) count: usize,
    /// The friction of the pair; only in a step in which each pair has one.
    pub(crate) friction: f32,
    pub(crate) normal: [f32; 3],
    pub(crate) position_a: [f32; 3],
    pub(crate) position_b: [f32; 3],
    /// x, y, z and distance.
    pub(crate) contacts: [[f32; 4]; CONTACT_POINTS],
    /// The impulses to begin with: four normal ones, or two of friction. In a warm pass only.
    pub(crate) impulses: [f32; CONTACT_POINTS],
}

impl Collision {
    /// A record.
    #[inline(always)]
    pub(crate) fn of(format: StreamFormat, rows: &[Row; collision::ROWS]) -> Self {
        let contact = |k: usize| vec4(format, rows[collision::CONTACTS + k]);
        Self {
            body_a: rows[collision::BODY_A][WORD_LANE],
            body_b: rows[collision::BODY_B][WORD_LANE],
            count: rows[collision::NORMAL][WORD_LANE] as usize,
            friction: 0.0,
            normal: vec3(format, rows[collision::NORMAL]),
            position_a: vec3(format, rows[collision::BODY_A]),
            position_b: vec3(format, rows[collision::BODY_B]),
            contacts: [contact(0), contact(1), contact(2), contact(3)],
            impulses: [0.0; CONTACT_POINTS],
        }
    }

    /// A record in f32, with the friction of the pair above its count.
    #[inline(always)]
    pub(crate) fn with_friction(rows: &[Row; collision::ROWS]) -> Self {
        let word = rows[collision::NORMAL][WORD_LANE];
        Self {
            count: (word & !collision::FRICTION_BITS) as usize,
            friction: pair_friction(word),
            ..Self::of(StreamFormat::F32, rows)
        }
    }

    /// Its contact points and bodies.
    pub(crate) fn head(&self) -> (usize, [u32; 2]) {
        (self.count, [self.body_a, self.body_b])
    }

    /// The collision with the impulses of a row that a warm pass brings.
    #[inline(always)]
    pub(crate) fn with_impulses(self, format: StreamFormat, impulses: Row) -> Self {
        Self { impulses: vec4(format, impulses), ..self }
    }
}

/// The beat of a collision's impulses.
pub(crate) fn impulses(impulses: [f32; CONTACT_POINTS]) -> Beat {
    Beat(impulses.map(|impulse| word(StreamFormat::F32, impulse)))
}

/// The beat of the numbers of up to four collisions whose impulses went out.
pub(crate) fn numbers(collisions: &[u32]) -> Beat {
    const _: () = assert!(NUMBERS_PER_BEAT as usize == LANES);
    let mut beat = Beat::default();
    for (word, number) in beat.0.iter_mut().zip(collisions) {
        *word = *number;
    }
    beat
}

/// The friction above a contact count.
#[inline(always)]
pub(crate) fn pair_friction(word: u32) -> f32 {
    sixteen::from_binary16((word & collision::FRICTION_BITS) >> collision::FRICTION_SHIFT)
}

/// A velocity record: the velocity and the shape index.
#[inline(always)]
pub(crate) fn velocity(
    format: StreamFormat,
    [linear, angular]: &[Row; velocity::ROWS],
) -> (Velocity, u32) {
    const _: () = assert!(velocity::LINEAR == 0 && velocity::ANGULAR == 1);
    let velocity = Velocity { linear: vec3(format, *linear), angular: vec3(format, *angular) };
    (velocity, linear[WORD_LANE])
}

/// The rows that world inertia adds to a velocity record: xx, yy, zz, xy, xz, yz.
pub(crate) fn world_inertia(format: StreamFormat, rows: &[Row; velocity::WORLD_ROWS]) -> [f32; 6] {
    let [xx, yy, zz] = vec3(format, rows[velocity::DIAGONAL]);
    let [xy, xz, yz] = vec3(format, rows[velocity::OFF_DIAGONAL]);
    [xx, yy, zz, xy, xz, yz]
}

/// The inverse mass in a velocity record of a step with streamed masses.
#[inline(always)]
pub(crate) fn inverse_mass(format: StreamFormat, rows: &[Row; velocity::WORLD_ROWS]) -> f32 {
    number(format, rows[velocity::DIAGONAL][WORD_LANE])
}

/// A pose record.
#[inline(always)]
pub(crate) fn pose(format: StreamFormat, rows: &[Row; pose::ROWS]) -> Pose {
    Pose {
        position: vec3(format, rows[pose::POSITION]),
        orientation: vec4(format, rows[pose::ORIENTATION]),
    }
}

/// The result record of a body.
#[inline(always)]
pub(crate) fn result(
    format: StreamFormat,
    pose: &Pose,
    velocity: &Velocity,
) -> [Row; result::ROWS] {
    let word = |number| word(format, number);
    let row = |[x, y, z]: [f32; 3], w| [word(x), word(y), word(z), w];
    let [x, y, z, w] = pose.orientation;
    let mut rows = [[0; 4]; result::ROWS];
    rows[result::POSITION] = row(pose.position, 0);
    rows[result::ORIENTATION] = row([x, y, z], word(w));
    rows[result::LINEAR] = row(velocity.linear, 0);
    rows[result::ANGULAR] = row(velocity.angular, 0);
    rows
}
