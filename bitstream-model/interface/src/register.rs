//! The form of a register row: name, offset, access, reset value, fields.
//!
//! The rows themselves stand in [`axi_dma`](super::axi_dma) and [`control`](super::control).
//! The driver's value types, the model's side effects and register dumps take their constants
//! from the rows; each has its own logic.

/// How a register or a field reacts to reads and writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Access {
    /// Writes have no effect.
    ReadOnly,
    /// Reads return what was written.
    ReadWrite,
    /// Writing 1 to a bit clears it; writing 0 leaves it.
    WriteOneToClear,
    /// Writing 1 starts something; the bit reads 1 until that is done.
    SelfClearing,
    /// Reading returns the value and clears it.
    ClearOnRead,
    /// Writing 1 to a bit inverts it.
    ToggleOnWrite,
}

/// A run of bits within a 32-bit register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Field {
    /// The manual's name.
    pub name: &'static str,
    /// Lowest bit.
    pub lsb: u32,
    /// Width in bits, 1 to 32.
    pub width: u32,
    /// Effect of reads and writes.
    pub access: Access,
}

impl Field {
    /// A single bit.
    #[must_use]
    pub const fn bit(name: &'static str, lsb: u32, access: Access) -> Self {
        Self::bits(name, lsb, 1, access)
    }

    /// `width` bits from `lsb` upward.
    ///
    /// # Panics
    /// If the bits do not lie within 32. The rows are constants, so that this is a compile error.
    #[must_use]
    pub const fn bits(name: &'static str, lsb: u32, width: u32, access: Access) -> Self {
        assert!(width >= 1 && lsb + width <= 32, "a field lies inside 32 bits");
        Self { name, lsb, width, access }
    }

    /// The field's bits, in place.
    #[must_use]
    pub const fn mask(&self) -> u32 {
        (u32::MAX >> (32 - self.width)) << self.lsb
    }

    /// The field's value in a register value.
    #[must_use]
    pub const fn of(&self, register: u32) -> u32 {
        (register & self.mask()) >> self.lsb
    }

    /// Whether any bit of the field is set in a register value.
    #[must_use]
    pub const fn is_set(&self, register: u32) -> bool {
        register & self.mask() != 0
    }

    /// A register value with the field's bits replaced by `value` (cut to the field's width).
    #[must_use]
    pub const fn put(&self, register: u32, value: u32) -> u32 {
        (register & !self.mask()) | ((value << self.lsb) & self.mask())
    }
}

/// One 32-bit register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Register {
    /// The manual's name.
    pub name: &'static str,
    /// Byte offset in its region (for a DMA: in the MM2S half).
    pub offset: u32,
    /// Effect of reads and writes on bits without a field.
    pub access: Access,
    /// Value after reset.
    pub reset: u32,
    /// Named bits; empty where the register is one number.
    pub fields: &'static [Field],
    /// Where the row comes from.
    pub source: &'static str,
}
