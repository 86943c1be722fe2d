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
    /// The thesis' own sixteen bits (§4.6.4): sign, the top and the four low bits of the exponent
    /// and the ten top bits of the mantissa of an f32, cut off.
    ///
    /// With F the five exponent bits, a word means (1 + mantissa / 1024) x 2^(F - 15) for every F:
    /// on 2^-14 up to 2^16 this is binary16 rounded toward zero, but there is no zero, no
    /// subnormal, no infinity. The encoder saturates: a smaller magnitude, zero among them,
    /// becomes the word 0 with its sign, which reads as 2^-15; a magnitude of 2^16 or more,
    /// infinity and NaN become F = 31.
    Thesis16 = 2,
    /// [`Thesis16`](Self::Thesis16) with the encoder taken literally: it cuts three bits out of the
    /// exponent whatever they are. Words are read alike.
    ///
    /// A word keeps the top bit and the four low bits of the biased exponent. From 2^-15 up to 2^17
    /// the format has the words of thesis16. A magnitude below 2^-15 reads as a number from 2^-15 up
    /// to 2: 2^-16 reads as 1, zero as 2^-15. A magnitude of 2^17 or more reads as a number from 2 up
    /// to 2^16, or as overflow (F = 31).
    Thesis16Literal = 3,
}

impl StreamFormat {
    /// All formats.
    pub const ALL: [Self; 4] = [Self::F32, Self::Binary16, Self::Thesis16, Self::Thesis16Literal];

    /// Bits of a word.
    #[must_use]
    pub const fn bits(self) -> u32 {
        match self {
            Self::F32 => 32,
            Self::Binary16 | Self::Thesis16 | Self::Thesis16Literal => 16,
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
            // 0x7BFF; in thesis16 the next word, 65536, reads as overflow.
            Self::Binary16 | Self::Thesis16 | Self::Thesis16Literal => 65_504.0,
        }
    }

    /// Largest unsigned integer that a word carries.
    #[must_use]
    pub const fn largest_index(self) -> u32 {
        match self {
            Self::F32 => u32::MAX,
            Self::Binary16 | Self::Thesis16 | Self::Thesis16Literal => 0xFFFF,
        }
    }

    /// Whether the format has words for zero and for infinity, as IEEE 754 has them.
    #[must_use]
    pub const fn has_zero_and_infinity(self) -> bool {
        matches!(self, Self::F32 | Self::Binary16)
    }

    /// Name on the command line and in reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::Binary16 => "binary16",
            Self::Thesis16 => "thesis16",
            Self::Thesis16Literal => "thesis16-literal",
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
