//! Decodes the aarch64 instruction that touched a register: its direction, its address, its data.
//!
//! A volatile access to a 32-bit register is one load or store of a W register. Any other access to
//! a register of the board is an error, because an AXI-Lite slave takes 32 bits at a time.
//!
//! Source: Arm ARM, C4.1 (Loads and Stores), A64 encodings of LDR, STR, LDUR, STUR, LDAR, STLR.

/// The general registers in the kernel's order: X0 to X30, then SP.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Registers {
    /// X0 to X30.
    pub x: [u64; 31],
    /// The stack pointer.
    pub sp: u64,
}

/// The access of an instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemoryAccess {
    /// Its virtual address.
    pub address: u64,
    /// Whether it stores.
    pub store: bool,
    /// Number of the W register; 31 is the zero register.
    pub register: u8,
    /// Base register and its new value, if the instruction changes it.
    pub write_back: Option<(u8, u64)>,
}

/// The register number of zero as data and of SP as base.
const ZERO_OR_SP: u8 = 31;

impl Registers {
    fn base(&self, number: u8) -> u64 {
        self.x.get(usize::from(number)).copied().unwrap_or(self.sp)
    }

    fn data(&self, number: u8) -> u64 {
        self.x.get(usize::from(number)).copied().unwrap_or(0)
    }

    /// The stored value.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, reason = "a W register is the low half")]
    pub fn stored(&self, access: &MemoryAccess) -> u32 {
        self.data(access.register) as u32
    }

    /// Updates the registers after the access; `loaded` is the result of a load.
    pub fn complete(&mut self, access: &MemoryAccess, loaded: u32) {
        match self.x.get_mut(usize::from(access.register)) {
            Some(x) if !access.store => *x = u64::from(loaded),
            _ => {}
        }
        match access.write_back {
            Some((ZERO_OR_SP, value)) => self.sp = value,
            Some((number, value)) => {
                if let Some(x) = self.x.get_mut(usize::from(number)) {
                    *x = value;
                }
            }
            None => {}
        }
    }
}

/// The instruction at `pc`, from the aligned pair around it.
#[must_use]
#[expect(clippy::cast_possible_truncation, reason = "one of the two")]
pub const fn of_pair(pair: u64, pc: u64) -> u32 {
    if pc & 4 == 0 { pair as u32 } else { (pair >> 32) as u32 }
}

fn bits(word: u32, low: u32, width: u32) -> u32 {
    (word >> low) & ((1 << width) - 1)
}

#[expect(clippy::cast_possible_truncation, reason = "five bits")]
fn number(word: u32, low: u32) -> u8 {
    bits(word, low, 5) as u8
}

/// A signed 9-bit offset, as an addend modulo 2^64.
fn signed9(word: u32) -> u64 {
    let value = u64::from(bits(word, 12, 9));
    if value & 0x100 == 0 { value } else { value.wrapping_sub(0x200) }
}

/// Decodes a load or store of a W register; `None` for every other instruction.
#[must_use]
pub fn decode(word: u32, registers: &Registers) -> Option<MemoryAccess> {
    let (data, base_number) = (number(word, 0), number(word, 5));
    let base = registers.base(base_number);
    let made = |address, store, moved: Option<u64>| MemoryAccess {
        address,
        store,
        register: data,
        write_back: moved.map(|value| (base_number, value)),
    };
    // LDAR, STLR: no offset.
    match word & 0xFFFF_FC00 {
        0x88DF_FC00 => return Some(made(base, false, None)),
        0x889F_FC00 => return Some(made(base, true, None)),
        _ => {}
    }
    // LDR, STR with a scaled unsigned offset.
    match word & 0xFFC0_0000 {
        0xB940_0000 | 0xB900_0000 => {
            let address = base.wrapping_add(4 * u64::from(bits(word, 10, 12)));
            return Some(made(address, bits(word, 22, 1) == 0, None));
        }
        _ => {}
    }
    // The rest of the group: bits 23:22 are the direction, 21 and 11:10 the addressing mode.
    let store = match word & 0xFFC0_0000 {
        0xB840_0000 => false,
        0xB800_0000 => true,
        _ => return None,
    };
    let offset = signed9(word);
    match (bits(word, 21, 1), bits(word, 10, 2)) {
        // LDUR, STUR.
        (0, 0b00) => Some(made(base.wrapping_add(offset), store, None)),
        // Post-index.
        (0, 0b01) => Some(made(base, store, Some(base.wrapping_add(offset)))),
        // Pre-index.
        (0, 0b11) => {
            let address = base.wrapping_add(offset);
            Some(made(address, store, Some(address)))
        }
        // A register as offset.
        (1, 0b10) => {
            let index = registers.data(number(word, 16));
            let low = index & 0xFFFF_FFFF;
            let index = match bits(word, 13, 3) {
                0b010 => low,
                0b011 => index,
                0b110 if low & 0x8000_0000 != 0 => low | 0xFFFF_FFFF_0000_0000,
                0b110 => low,
                0b111 => index,
                _ => return None,
            };
            let shift = 2 * bits(word, 12, 1);
            Some(made(base.wrapping_add(index << shift), store, None))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn registers() -> Registers {
        Registers { x: std::array::from_fn(|k| 0x1000 * k as u64), sp: 0xF_0000 }
    }

    fn decoded(word: u32) -> MemoryAccess {
        decode(word, &registers()).expect("a 32-bit load or store")
    }

    fn plain(address: u64, store: bool, register: u8) -> MemoryAccess {
        MemoryAccess { address, store, register, write_back: None }
    }

    // The words were made by GNU as.
    #[test]
    fn of_a_pair_the_instruction_at_the_counter_is_taken() {
        let pair = 0xB940_0001_B900_0002;
        assert_eq!(of_pair(pair, 0x40_0000), 0xB900_0002);
        assert_eq!(of_pair(pair, 0x40_0004), 0xB940_0001);
    }

    #[test]
    fn offsets_of_every_kind_are_added() {
        assert_eq!(decoded(0xB940_0020), plain(0x1000, false, 0)); // ldr w0, [x1]
        assert_eq!(decoded(0xB901_0062), plain(0x3100, true, 2)); // str w2, [x3, #256]
        assert_eq!(decoded(0xB97F_FCA4), plain(0x5000 + 16380, false, 4)); // ldr w4, [x5, #16380]
        assert_eq!(decoded(0xB900_03FF), plain(0xF_0000, true, 31)); // str wzr, [sp]
        assert_eq!(decoded(0xB85F_C020), plain(0xFFC, false, 0)); // ldur w0, [x1, #-4]
        assert_eq!(decoded(0xB800_3020), plain(0x1003, true, 0)); // stur w0, [x1, #3]
        assert_eq!(decoded(0x88DF_FC20), plain(0x1000, false, 0)); // ldar w0, [x1]
        assert_eq!(decoded(0x889F_FC41), plain(0x2000, true, 1)); // stlr w1, [x2]
    }

    #[test]
    fn a_register_as_offset_is_extended_and_scaled() {
        let mut at = registers();
        at.x[2] = 0xFFFF_FFFF_FFFF_FFFC;
        let address = |word| decode(word, &at).expect("a load").address;
        assert_eq!(address(0xB862_6820), 0xFFC); // ldr w0, [x1, x2]
        assert_eq!(address(0xB862_7820), 0x1000 - 16); // ldr w0, [x1, x2, lsl #2]
        assert_eq!(address(0xB862_4820), 0x1_0000_0FFC); // ldr w0, [x1, w2, uxtw]
        assert_eq!(address(0xB862_D820), 0x1000 - 16); // ldr w0, [x1, w2, sxtw #2]
    }

    #[test]
    fn the_base_moves_where_the_instruction_moves_it() {
        let mut at = registers();
        let post = decoded(0xB840_4420); // ldr w0, [x1], #4
        assert_eq!(post, MemoryAccess { write_back: Some((1, 0x1004)), ..plain(0x1000, false, 0) });
        at.complete(&post, 0xFFFF_FFFF);
        assert_eq!((at.x[0], at.x[1]), (0xFFFF_FFFF, 0x1004));
        let pre = decoded(0xB81F_CFE3); // str w3, [sp, #-4]!
        assert_eq!(
            pre,
            MemoryAccess { write_back: Some((31, 0xE_FFFC)), ..plain(0xE_FFFC, true, 3) }
        );
        assert_eq!(at.stored(&pre), 0x3000);
        at.complete(&pre, 7);
        assert_eq!((at.sp, at.x[3]), (0xE_FFFC, 0x3000));
    }

    #[test]
    fn the_zero_register_stores_zero_and_loads_nothing() {
        let mut at = registers();
        let store = decoded(0xB900_03FF); // str wzr, [sp]
        assert_eq!(at.stored(&store), 0);
        let load = decoded(0xB940_003F); // ldr wzr, [x1]
        at.complete(&load, 5);
        assert_eq!(at, registers());
    }

    #[test]
    fn other_widths_and_pairs_are_no_register_accesses() {
        for word in [
            0xF940_0020, // ldr x0, [x1]
            0x7940_0020, // ldrh w0, [x1]
            0x3940_0020, // ldrb w0, [x1]
            0xB980_0020, // ldrsw x0, [x1]
            0x2940_0440, // ldp w0, w1, [x2]
            0xBD40_0020, // ldr s0, [x1]
            0x3DC0_0020, // ldr q0, [x1]
            0x88DF_7C20, // ldlar w0, [x1]
            0xB840_0820, // ldtr w0, [x1]
            0xB820_0020, // ldadd w0, w0, [x1]
            0xD503_201F, // nop
        ] {
            assert_eq!(decode(word, &registers()), None, "{word:#010x}");
        }
    }
}
