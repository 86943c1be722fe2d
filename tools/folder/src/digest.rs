//! Computes a digest of the state of all bodies, to compare runs.

use zynq_pgs::Body;

/// Name of the algorithm, printed beside every digest.
pub const ALGORITHM: &str = "fnv1a-64";

const OFFSET_BASIS: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0000_0100_0000_01b3;

/// FNV-1a, 64 bit, over the little-endian f32 bits of position, orientation, linear and angular
/// velocity, body by body.
///
/// Source: Fowler, Noll, Vo; draft-eastlake-fnv.
#[must_use]
pub fn of_bodies(bodies: &[Body]) -> u64 {
    bodies.iter().fold(OFFSET_BASIS, |digest, body| {
        let digest = of_numbers(digest, &body.pose.position);
        let digest = of_numbers(digest, &body.pose.orientation);
        let digest = of_numbers(digest, &body.velocity.linear);
        of_numbers(digest, &body.velocity.angular)
    })
}

fn of_numbers(digest: u64, numbers: &[f32]) -> u64 {
    numbers.iter().fold(digest, |digest, number| of_bytes(digest, &number.to_le_bytes()))
}

fn of_bytes(digest: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(digest, |digest, byte| (digest ^ u64::from(*byte)).wrapping_mul(PRIME))
}

#[cfg(test)]
mod tests {
    use super::*;
    use zynq_pgs::{Pose, Velocity};

    #[test]
    fn published_test_vectors_hold() {
        // draft-eastlake-fnv, 64-bit FNV-1a.
        assert_eq!(of_bytes(OFFSET_BASIS, b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(of_bytes(OFFSET_BASIS, b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(of_bytes(OFFSET_BASIS, b"foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn the_sign_of_a_zero_changes_the_digest() {
        let body = Body {
            pose: Pose { position: [0.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] },
            velocity: Velocity::default(),
            shape: 0,
        };
        let mut other = body;
        other.velocity.angular[2] = -0.0;
        assert_ne!(of_bodies(&[body]), of_bodies(&[other]));
    }
}
