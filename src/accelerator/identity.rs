//! This file reads what a bitstream says of itself, and refuses what the driver does not know.

use bitstream_model::interface::profile::Depth;

/// What a bitstream says of itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Capabilities {
    /// Identifier of the [profile](bitstream_model::interface::profile::Profile).
    pub profile_id: u32,
    /// Interface version, major and minor.
    pub version: (u32, u32),
    /// Whether the pipeline waits on a hazard; without it, it reads stale velocities.
    pub interlocked: bool,
    /// Whether words received and sent are summed, which detects a corrupted beat.
    pub checksums: bool,
    /// Whether subnormal numbers count as zero.
    pub flush_subnormals: bool,
    /// Whether accumulated normal impulses are summed.
    pub impulse_sum: bool,
    /// Streams into the accelerator.
    pub mm2s_channels: usize,
    /// Streams out of the accelerator.
    pub s2mm_channels: usize,
    /// Cycles from one issue to the next.
    pub initiation_interval: u32,
    /// Collisions that enter the pipeline together.
    pub collisions_per_issue: u32,
    /// Depth of the contact pipeline, cycles.
    pub contact: Depth,
    /// Depth of the friction pipeline, cycles.
    pub friction: Depth,
    /// Clock of the accelerator and its streams, kHz.
    pub clock_khz: u32,
    /// Largest number of bodies.
    pub body_capacity: u32,
    /// Largest number of collisions, were there no bodies.
    pub collision_capacity: u32,
    /// Entries of the shape table.
    pub shape_capacity: u32,
    /// On-chip memory that bodies and collisions share, bytes.
    pub memory_bytes: u32,
    /// What a body takes of it, bytes.
    pub bytes_per_body: u32,
    /// What a collision takes of it, bytes.
    pub bytes_per_collision: u32,
    /// Width of the DMA cores' length registers, bits.
    pub length_width: u32,
    /// Width of memory addresses, bits.
    pub address_width: u32,
}
