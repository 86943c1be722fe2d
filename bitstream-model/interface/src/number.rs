//! Numeric formats: of words on the streams, of arithmetic, of on-chip arrays.

/// How a number lies on a stream.
///
/// With sixteen bits a number a record takes half the beats that it takes with 32: see
/// [`record`](super::record).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum StreamFormat {
    /// IEEE 754 binary32.
    F32 = 0,
    /// IEEE 754 binary16, rounded to nearest even.
    Binary16 = 1,
}

impl StreamFormat {
    /// All formats.
    pub const ALL: [Self; 2] = [Self::F32, Self::Binary16];

    /// Bits of a word.
    #[must_use]
    pub const fn bits(self) -> u32 {
        match self {
            Self::F32 => 32,
            Self::Binary16 => 16,
        }
    }

    /// Rows of a beat.
    #[must_use]
    pub const fn rows_per_beat(self) -> usize {
        // A row of four 32-bit words is a beat.
        (u32::BITS / self.bits()) as usize
    }

    /// Largest magnitude that the format carries; a number beyond it must not be sent.
    #[must_use]
    pub const fn largest(self) -> f32 {
        match self {
            Self::F32 => f32::MAX,
            Self::Binary16 => 65_504.0,
        }
    }

    /// Largest unsigned integer that a word carries.
    #[must_use]
    pub const fn largest_index(self) -> u32 {
        match self {
            Self::F32 => u32::MAX,
            Self::Binary16 => 0xFFFF,
        }
    }

    /// Name on the command line and in reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::Binary16 => "binary16",
        }
    }
}

/// Width of the pipeline's operators or of an on-chip array's words. Every operation rounds on its
/// own, to nearest even.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Precision {
    /// IEEE 754 binary32.
    F32 = 0,
    /// IEEE 754 binary16.
    Binary16 = 1,
}

impl Precision {
    /// Both.
    pub const ALL: [Self; 2] = [Self::F32, Self::Binary16];

    /// Bytes of a word.
    #[must_use]
    pub const fn bytes(self) -> u32 {
        match self {
            Self::F32 => 4,
            Self::Binary16 => 2,
        }
    }

    /// Name in reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::Binary16 => "binary16",
        }
    }
}

/// The formats of one bitstream, place by place; reported in the NUMBERS register.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Numbers {
    /// Collision records.
    pub collisions: StreamFormat,
    /// Velocity records.
    pub bodies: StreamFormat,
    /// Pose and result records.
    pub poses: StreamFormat,
    /// Arithmetic of a constraint row: lever arms, moments, effective mass, bias, tangents.
    pub rows: Precision,
    /// Arithmetic of the changing values: relative speeds, impulses, velocities. The integration
    /// uses it too, unless poses are f32: f32 poses are integrated in f32.
    pub updates: Precision,
    /// Velocities on chip.
    pub velocities: Precision,
    /// Accumulated impulses on chip.
    pub impulses: Precision,
}

impl Numbers {
    /// Single precision throughout.
    pub const F32: Self = Self {
        collisions: StreamFormat::F32,
        bodies: StreamFormat::F32,
        poses: StreamFormat::F32,
        rows: Precision::F32,
        updates: Precision::F32,
        velocities: Precision::F32,
        impulses: Precision::F32,
    };
    /// Sixteen bits throughout, binary16 on the streams.
    pub const BINARY16: Self = Self {
        collisions: StreamFormat::Binary16,
        bodies: StreamFormat::Binary16,
        poses: StreamFormat::Binary16,
        rows: Precision::Binary16,
        updates: Precision::Binary16,
        velocities: Precision::Binary16,
        impulses: Precision::Binary16,
    };
}
