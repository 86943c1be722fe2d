//! Layout of the records in 128-bit beats.
//!
//! A record is rows of four words, (vec3, word); lane 0 is bits 31:0, at the lowest address. In f32
//! a row is a beat. In sixteen bits a row is half a beat, the first of two in bits 63:0, and the
//! rows of an array follow each other without a gap: a collision of seven rows takes three beats
//! and a half. In a warm pass the rows of the impulses lie behind all other rows of the collisions
//! that are issued together.
//!
//! ```text
//!                lane 0   lane 1   lane 2   lane 3
//! velocity    0  v.x      v.y      v.z      shape
//!             1  w.x      w.y      w.z      0
//!             2  I.xx     I.yy     I.zz     m or 0     with world inertia only: the inverse
//!             3  I.xy     I.xz     I.yz     0          inertia about world axes, and the inverse
//!                                                      mass where masses are streamed
//! collision   0  n.x      n.y      n.z      count
//!             1  pA.x     pA.y     pA.z     bodyA
//!             2  pB.x     pB.y     pB.z     bodyB
//!             3  c0.x     c0.y     c0.z     distance0
//!             .. 6        up to four contact points
//!             7  L0       L1       L2       L3         in a warm contact pass only
//!             7  G0       G1       0        0          in a warm friction pass only
//! pose        0  p.x      p.y      p.z      0
//!             1  q.x      q.y      q.z      q.w
//! result      0  p.x      p.y      p.z      0
//!             1  q.x      q.y      q.z      q.w
//!             2  v.x      v.y      v.z      0
//!             3  w.x      w.y      w.z      0
//! impulses    0  L0       L1       L2       L3         after the last contact pass, in f32
//!             0  G0       G1       0        0          after the last friction pass, in f32
//! ```
//!
//! Metres, m/s, rad/s, 1/(kg m²), world frame. `n` is the unit normal from B to A; a contact point
//! lies on B's surface; distance is signed, negative is penetration. Indices, shape and count are
//! unsigned integers, everything else is a number in the stream's format. A collision without
//! contact points is padding and has no effect at all.

use bytemuck::{Pod, Zeroable};

/// Bytes of a beat.
pub const BEAT_BYTES: usize = 16;
/// Words of a row, and 32-bit lanes of a beat.
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

/// The velocity record: rows.
pub mod velocity {
    /// Rows of a record.
    pub const ROWS: usize = 2;
    /// Linear velocity; the word beside it is the index into the shape table.
    pub const LINEAR: usize = 0;
    /// Angular velocity; the word beside it is 0.
    pub const ANGULAR: usize = 1;
    /// Rows of a record with world inertia.
    pub const WORLD_ROWS: usize = 4;
    /// Diagonal of the inverse inertia: xx, yy, zz; the word beside it is the inverse mass in steps
    /// with streamed masses, else 0.
    pub const DIAGONAL: usize = 2;
    /// The rest of the inverse inertia: xy, xz, yz; the word beside it is 0.
    pub const OFF_DIAGONAL: usize = 3;
}

/// The collision record: rows.
pub mod collision {
    /// Rows of a record.
    pub const ROWS: usize = 7;
    /// Rows of a record of a warm pass.
    pub const WARM_ROWS: usize = 8;
    /// In a warm pass, the impulses to begin with: four normal ones, or two of friction and zeros.
    pub const IMPULSES: usize = 7;
    /// Normal from B to A; the word beside it is the number of contact points, in steps with a
    /// friction for each pair with the friction above it.
    pub const NORMAL: usize = 0;
    /// Position of body A; the word beside it is its index.
    pub const BODY_A: usize = 1;
    /// Position of body B; the word beside it is its index.
    pub const BODY_B: usize = 2;
    /// The first contact point; the word beside each is its distance.
    pub const CONTACTS: usize = 3;
    /// Bits of the count's word that hold the friction of the pair, a binary16 number that is not
    /// negative: its sign bit counts as a part of the count.
    pub const FRICTION_BITS: u32 = 0x7FFF_0000;
    /// The lowest of these bits.
    pub const FRICTION_SHIFT: u32 = 16;
}

/// The pose record: rows.
pub mod pose {
    /// Rows of a record.
    pub const ROWS: usize = 2;
    /// Position; the word beside it is 0.
    pub const POSITION: usize = 0;
    /// Orientation, a unit quaternion x, y, z, w.
    pub const ORIENTATION: usize = 1;
}

/// The result record: rows.
pub mod result {
    /// Rows of a record.
    pub const ROWS: usize = 4;
    /// Position; the word beside it is 0.
    pub const POSITION: usize = 0;
    /// Orientation, a unit quaternion x, y, z, w.
    pub const ORIENTATION: usize = 1;
    /// Linear velocity; the word beside it is 0.
    pub const LINEAR: usize = 2;
    /// Angular velocity; the word beside it is 0.
    pub const ANGULAR: usize = 3;
}
