//! The chips that a bitstream may be for, by the IDCODE that the bitstream writes.
//!
//! Source: U-Boot, `drivers/soc/soc_xilinx_zynqmp.c`; UG585 for the Zynq-7000.

use std::fmt;
use std::str::FromStr;

/// The bits of an IDCODE that name the chip; above them stands its revision.
const WITHOUT_REVISION: u32 = 0x0FFF_FFFF;

/// Chips by name. A part without a GPU or video codec has the IDCODE of the one with them.
const CHIPS: &[(&str, u32)] = &[
    ("XCZU1EG", 0x0468_8093),
    ("XCZU2EG", 0x0471_1093),
    ("XCZU3EG", 0x0471_0093),
    ("XCZU4EV", 0x0472_1093),
    ("XCZU5EV", 0x0472_0093),
    ("XCZU6EG", 0x0473_9093),
    ("XCZU7EV", 0x0473_0093),
    ("XCZU9EG", 0x0473_8093),
    ("XCZU11EG", 0x0474_0093),
    ("XCZU15EG", 0x0475_0093),
    ("XCZU17EG", 0x0475_9093),
    ("XCZU19EG", 0x0475_8093),
    ("XCZU28DR", 0x047E_0093),
    ("XCZU48DR", 0x047F_B093),
    ("XCK26", 0x0472_4093),
    ("XC7Z010", 0x0372_2093),
    ("XC7Z020", 0x0372_7093),
    ("XC7Z030", 0x0372_C093),
    ("XC7Z045", 0x0373_1093),
];

/// A chip: its IDCODE without the revision.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Chip(u32);

impl Chip {
    /// The chip of an IDCODE, whatever its revision.
    pub(super) fn of(idcode: u32) -> Self {
        Self(idcode & WITHOUT_REVISION)
    }
}

impl fmt::Display for Chip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = CHIPS.iter().find(|(_, code)| *code == self.0);
        let name = name.map_or("an unknown chip", |(name, _)| name);
        write!(f, "{name} (IDCODE {:#010x})", self.0)
    }
}

/// `XCZU9EG`, `xczu9cg-ffvb1156-2-e`, or an IDCODE as `0x04738093`.
impl FromStr for Chip {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let code = text.strip_prefix("0x").and_then(|code| u32::from_str_radix(code, 16).ok());
        if let Some(code) = code {
            return Ok(Self::of(code));
        }
        let name = text.split('-').next().unwrap_or_default().to_ascii_uppercase();
        let base = |name: &str| name.trim_end_matches(|c: char| c.is_ascii_alphabetic()).to_owned();
        let found = CHIPS.iter().find(|(known, _)| base(known) == base(&name));
        found.map(|(_, code)| Self(*code)).ok_or_else(|| {
            let known: Vec<_> = CHIPS.iter().map(|(name, _)| *name).collect();
            format!("expected an IDCODE, as 0x04738093, or one of {}", known.join(", "))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chip_is_named_by_its_part_in_any_package_or_by_its_idcode_in_any_revision() {
        let chip = Chip::of(0x2473_8093);
        assert_eq!(chip.to_string(), "XCZU9EG (IDCODE 0x04738093)");
        for text in ["XCZU9EG", "xczu9cg", "xczu9eg-ffvb1156-2-e", "0x04738093", "0x24738093"] {
            assert_eq!(text.parse(), Ok(chip), "{text}");
        }
        assert_eq!("xck26-sfvc784-2LV-c".parse(), Ok(Chip::of(0x0472_4093)));
        assert_eq!(Chip::of(0x1234_5093).to_string(), "an unknown chip (IDCODE 0x02345093)");
        for text in ["", "zcu102", "XCZU99EG", "04738093"] {
            assert!(text.parse::<Chip>().expect_err(text).contains("XCZU9EG"), "{text}");
        }
    }
}
