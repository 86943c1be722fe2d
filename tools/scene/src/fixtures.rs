//! Bodies, and bits of collisions, for the crate's tests.

use zynq_pgs::{Body, Collision, Pose, Velocity};

/// No rotation.
pub(crate) const LEVEL: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// A body of shape 1, at rest.
pub(crate) fn body(position: [f32; 3], orientation: [f32; 4]) -> Body {
    Body { pose: Pose { position, orientation }, velocity: Velocity::default(), shape: 1 }
}

/// The bits of all numbers.
pub(crate) fn bits(collisions: &[Collision]) -> Vec<u32> {
    let mut bits = Vec::new();
    for c in collisions {
        bits.extend([c.body_a, c.body_b, c.count]);
        bits.extend(c.normal.map(f32::to_bits));
        for contact in c.contacts {
            bits.extend(contact.point.map(f32::to_bits));
            bits.push(contact.distance.to_bits());
        }
    }
    bits
}

/// FNV-1a, 64 bits, word by word.
pub(crate) fn digest(words: impl IntoIterator<Item = u32>) -> String {
    let digest = words.into_iter().fold(0xCBF2_9CE4_8422_2325_u64, |digest, word| {
        (digest ^ u64::from(word)).wrapping_mul(0x0100_0000_01B3)
    });
    format!("{digest:016x}")
}
