//! This file says how records lie in 128-bit beats.
//!
//! A record is a row of (vec3, word) beats; lane 0 is bits 31:0, at the lowest address.
//!
//! ```text
//!              lane 0   lane 1   lane 2   lane 3
//! velocity  0  v.x      v.y      v.z      shape
//!           1  w.x      w.y      w.z      0
//! collision 0  n.x      n.y      n.z      count
//!           1  pA.x     pA.y     pA.z     bodyA
//!           2  pB.x     pB.y     pB.z     bodyB
//!           3  c0.x     c0.y     c0.z     distance0
//!           .. 6        up to four contact points
//! pose      0  p.x      p.y      p.z      0
//!           1  q.x      q.y      q.z      q.w
//! result    0  p.x      p.y      p.z      0
//!           1  q.x      q.y      q.z      q.w
//!           2  v.x      v.y      v.z      0
//!           3  w.x      w.y      w.z      0
//! ```
//!
//! Metres, m/s, rad/s, world frame. `n` is the unit normal from B to A; a contact point lies on
//! B's surface; distance is signed, negative is penetration. Indices and counts are unsigned
//! integers, everything else f32. A collision of count 0 is padding and has no effect at all.

use bytemuck::{Pod, Zeroable};

/// Bytes of a beat.
pub const BEAT_BYTES: usize = 16;
/// 32-bit lanes of a beat.
pub const LANES: usize = 4;
/// The lane beside a vec3, which takes lanes 0 to 2.
pub const WORD_LANE: usize = 3;
/// Contact points of a collision, at most.
pub const CONTACT_POINTS: usize = 4;

/// One beat of a 128-bit stream, as it lies in memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct Beat(pub [u32; LANES]);

const _: () = assert!(size_of::<Beat>() == BEAT_BYTES && align_of::<Beat>() == BEAT_BYTES);
#[cfg(not(target_endian = "little"))]
compile_error!("beats and descriptors are little-endian and are accessed as they lie in memory");

/// The velocity record: beat indices.
pub mod velocity {
    /// Beats of a record.
    pub const BEATS: usize = 2;
    /// Linear velocity; the word beside it is the index into the shape table.
    pub const LINEAR: usize = 0;
    /// Angular velocity; the word beside it is 0.
    pub const ANGULAR: usize = 1;
}

/// The collision record: beat indices.
pub mod collision {
    /// Beats of a record.
    pub const BEATS: usize = 7;
    /// Normal from B to A; the word beside it is the number of contact points.
    pub const NORMAL: usize = 0;
    /// Position of body A; the word beside it is its index.
    pub const BODY_A: usize = 1;
    /// Position of body B; the word beside it is its index.
    pub const BODY_B: usize = 2;
    /// The first contact point; the word beside each is its distance.
    pub const CONTACTS: usize = 3;
}

/// The pose record: beat indices.
pub mod pose {
    /// Beats of a record.
    pub const BEATS: usize = 2;
    /// Position; the word beside it is 0.
    pub const POSITION: usize = 0;
    /// Orientation, a unit quaternion x, y, z, w.
    pub const ORIENTATION: usize = 1;
}

/// The result record: beat indices.
pub mod result {
    /// Beats of a record.
    pub const BEATS: usize = 4;
    /// Position; the word beside it is 0.
    pub const POSITION: usize = 0;
    /// Orientation, a unit quaternion x, y, z, w.
    pub const ORIENTATION: usize = 1;
    /// Linear velocity; the word beside it is 0.
    pub const LINEAR: usize = 2;
    /// Angular velocity; the word beside it is 0.
    pub const ANGULAR: usize = 3;
}
