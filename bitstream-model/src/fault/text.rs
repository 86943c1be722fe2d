//! The text form of a fault plan: parses and prints one line.

use std::fmt;
use std::str::FromStr;

use super::{Fault, FaultKind, FaultPlan, Place, StepPhase, When};
use pgs_interface::address_map::DMA_COUNT_MAX;
use pgs_interface::axi_dma::Direction;
use pgs_interface::control::ErrorCode;

/// The error in a line that is not a fault plan.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FaultError {
    /// No fault has this name.
    #[error("no fault is named {found:?}; expected one of {}", names())]
    Kind {
        /// The name in the line.
        found: String,
    },
    /// No place has this name.
    #[error(
        "no place is named {found:?}; expected dma0.mm2s to dma3.s2mm, dma0 to dma3, or accelerator"
    )]
    Place {
        /// The place in the line.
        found: String,
    },
    /// An unknown key, or not `key=value`.
    #[error("{found:?} is none of phase=, beat=, bd=, access=, n=, step=, times=")]
    Key {
        /// The part of the line.
        found: String,
    },
    /// No phase has this name.
    #[error(
        "no phase is named {found:?}; expected load, contact1.., friction1.., poses or results"
    )]
    Phase {
        /// The phase in the line.
        found: String,
    },
    /// Not a number, or a number out of range.
    #[error("{what} is {found:?}, expected {expected}")]
    Number {
        /// The key or the fault that the number belongs to.
        what: String,
        /// The value in the line.
        found: String,
        /// The expected value.
        expected: &'static str,
    },
    /// The fault cannot happen in this place, phase or step, or at this occasion.
    #[error("{fault} does not happen {found}; {expected}")]
    Elsewhere {
        /// The fault's name.
        fault: &'static str,
        /// The place, phase, step or occasion in the line.
        found: String,
        /// The expected one.
        expected: &'static str,
    },
}

/// One of each kind, with the default of its value.
const KINDS: [FaultKind; 30] = [
    FaultKind::DmaIntErr,
    FaultKind::DmaSlvErr,
    FaultKind::DmaDecErr,
    FaultKind::SgIntErr,
    FaultKind::SgSlvErr,
    FaultKind::SgDecErr,
    FaultKind::SgDecErrWrite,
    FaultKind::BdIntErr,
    FaultKind::BdSlvErr,
    FaultKind::BdDecErr,
    FaultKind::Stall,
    FaultKind::Slow { clocks: 64 },
    FaultKind::ShortPacket,
    FaultKind::LongPacket,
    FaultKind::NoTlast,
    FaultKind::Corrupt { mask: 1 },
    FaultKind::IrqDrop,
    FaultKind::IrqDelay { ns: 100_000 },
    FaultKind::IrqSpurious,
    FaultKind::IrqStorm { count: 1000 },
    FaultKind::LateCmplted { ns: 100_000 },
    FaultKind::HaltDelay { ns: 1_000_000 },
    FaultKind::HaltNever,
    FaultKind::ResetSlow { ns: 1_000_000 },
    FaultKind::ResetNever,
    FaultKind::OtherBitstream { identification: 0 },
    FaultKind::Reloaded,
    FaultKind::AcceleratorHang,
    FaultKind::NoDone,
    FaultKind::PowerLost,
];

/// The one kind whose value has no default.
const ACCELERATOR_ERROR: &str = "accelerator-error";

fn names() -> String {
    let mut names: Vec<_> = KINDS.iter().map(|kind| kind.name()).collect();
    names.push(ACCELERATOR_ERROR);
    names.join(", ")
}

impl FaultKind {
    /// One fault of every kind, with the default of its value, and one for every error code of the
    /// accelerator.
    pub fn all() -> impl Iterator<Item = Self> {
        let errors = ErrorCode::ALL.into_iter().map(|code| Self::AcceleratorError { code });
        KINDS.into_iter().chain(errors)
    }

    /// The name in the text form.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::DmaIntErr => "dma-int-err",
            Self::DmaSlvErr => "dma-slv-err",
            Self::DmaDecErr => "dma-dec-err",
            Self::SgIntErr => "sg-int-err",
            Self::SgSlvErr => "sg-slv-err",
            Self::SgDecErr => "sg-dec-err",
            Self::SgDecErrWrite => "sg-dec-err-write",
            Self::BdIntErr => "bd-int-err",
            Self::BdSlvErr => "bd-slv-err",
            Self::BdDecErr => "bd-dec-err",
            Self::Stall => "stall",
            Self::Slow { .. } => "slow",
            Self::ShortPacket => "short-packet",
            Self::LongPacket => "long-packet",
            Self::NoTlast => "no-tlast",
            Self::Corrupt { .. } => "corrupt",
            Self::IrqDrop => "irq-drop",
            Self::IrqDelay { .. } => "irq-delay",
            Self::IrqSpurious => "irq-spurious",
            Self::IrqStorm { .. } => "irq-storm",
            Self::LateCmplted { .. } => "late-cmplted",
            Self::HaltDelay { .. } => "halt-delay",
            Self::HaltNever => "halt-never",
            Self::ResetSlow { .. } => "reset-slow",
            Self::ResetNever => "reset-never",
            Self::OtherBitstream { .. } => "other-bitstream",
            Self::Reloaded => "reloaded",
            Self::AcceleratorError { .. } => ACCELERATOR_ERROR,
            Self::AcceleratorHang => "accelerator-hang",
            Self::NoDone => "no-done",
            Self::PowerLost => "power-lost",
        }
    }

    fn value(self) -> Option<u64> {
        Some(match self {
            Self::Slow { clocks } => clocks.into(),
            Self::Corrupt { mask } => mask.into(),
            Self::IrqStorm { count } => count.into(),
            Self::IrqDelay { ns }
            | Self::LateCmplted { ns }
            | Self::HaltDelay { ns }
            | Self::ResetSlow { ns } => ns,
            Self::OtherBitstream { identification } => identification.into(),
            Self::AcceleratorError { code } => u64::from(code as u32),
            _ => return None,
        })
    }

    /// The same kind with another value; `None` if the kind has no value, or refuses this one.
    fn with(self, value: u64) -> Option<Self> {
        let narrow = u32::try_from(value).ok();
        Some(match self {
            // A value of 0 would have no effect.
            Self::Slow { .. } => Self::Slow { clocks: narrow.filter(|clocks| *clocks != 0)? },
            Self::Corrupt { .. } => Self::Corrupt { mask: narrow.filter(|mask| *mask != 0)? },
            Self::IrqStorm { .. } => Self::IrqStorm { count: narrow.filter(|count| *count != 0)? },
            Self::IrqDelay { .. } => Self::IrqDelay { ns: value },
            Self::LateCmplted { .. } => Self::LateCmplted { ns: value },
            Self::HaltDelay { .. } => Self::HaltDelay { ns: value },
            Self::ResetSlow { .. } => Self::ResetSlow { ns: value },
            Self::OtherBitstream { .. } => Self::OtherBitstream { identification: narrow? },
            _ => return None,
        })
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Channel(core, Direction::Mm2s) => write!(f, "dma{core}.mm2s"),
            Self::Channel(core, Direction::S2mm) => write!(f, "dma{core}.s2mm"),
            Self::Core(core) => write!(f, "dma{core}"),
            Self::Accelerator => f.write_str("accelerator"),
        }
    }
}

impl FromStr for Place {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Self, FaultError> {
        let parse = || {
            if text == "accelerator" {
                return Some(Self::Accelerator);
            }
            let (core, direction) = match text.strip_prefix("dma")?.split_once('.') {
                Some((core, "mm2s")) => (core, Some(Direction::Mm2s)),
                Some((core, "s2mm")) => (core, Some(Direction::S2mm)),
                Some(_) => return None,
                None => (text.strip_prefix("dma")?, None),
            };
            let core = core.parse().ok().filter(|core| *core < DMA_COUNT_MAX)?;
            Some(direction.map_or(Self::Core(core), |direction| Self::Channel(core, direction)))
        };
        parse().ok_or_else(|| FaultError::Place { found: text.to_owned() })
    }
}

impl fmt::Display for StepPhase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Load => f.write_str("load"),
            Self::Contact(pass) => write!(f, "contact{pass}"),
            Self::Friction(pass) => write!(f, "friction{pass}"),
            Self::Poses => f.write_str("poses"),
            Self::Results => f.write_str("results"),
        }
    }
}

impl FromStr for StepPhase {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Self, FaultError> {
        let pass =
            |name: &str| text.strip_prefix(name)?.parse().ok().filter(|pass: &u32| *pass > 0);
        match text {
            "load" => Some(Self::Load),
            "poses" => Some(Self::Poses),
            "results" => Some(Self::Results),
            _ => pass("contact").map(Self::Contact).or(pass("friction").map(Self::Friction)),
        }
        .ok_or_else(|| FaultError::Phase { found: text.to_owned() })
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind.name())?;
        match (self.kind, self.kind.value()) {
            (FaultKind::Corrupt { .. } | FaultKind::OtherBitstream { .. }, Some(value)) => {
                write!(f, "={value:#x}")?;
            }
            (_, Some(value)) => write!(f, "={value}")?,
            (_, None) => {}
        }
        if let Some(place) = self.place {
            write!(f, "@{place}")?;
        }
        if let Some(phase) = self.phase {
            write!(f, ",phase={phase}")?;
        }
        match self.when {
            Some(When::Beat(number)) => write!(f, ",beat={number}")?,
            Some(When::Descriptor(number)) => write!(f, ",bd={number}")?,
            Some(When::Access(number)) => write!(f, ",access={number}")?,
            Some(When::Occasion(number)) => write!(f, ",n={number}")?,
            None => {}
        }
        if let Some(step) = self.step {
            write!(f, ",step={step}")?;
        }
        if self.times != 1 {
            write!(f, ",times={}", self.times)?;
        }
        Ok(())
    }
}

fn number<T: TryFrom<u64>>(what: &str, text: &str) -> Result<T, FaultError> {
    let parsed = match text.strip_prefix("0x") {
        Some(digits) => u64::from_str_radix(digits, 16),
        None => text.parse(),
    };
    parsed.ok().and_then(|number| T::try_from(number).ok()).ok_or_else(|| FaultError::Number {
        what: what.to_owned(),
        found: text.to_owned(),
        expected: "a whole number in range, decimal or hexadecimal after 0x",
    })
}

fn kind(text: &str) -> Result<FaultKind, FaultError> {
    let (name, value) = match text.split_once('=') {
        Some((name, value)) => (name.trim(), Some(value.trim())),
        None => (text, None),
    };
    let wrong = |expected| FaultError::Number {
        what: name.to_owned(),
        found: value.unwrap_or_default().to_owned(),
        expected,
    };
    if name == ACCELERATOR_ERROR {
        let value: u64 = number(name, value.unwrap_or_default())?;
        return ErrorCode::ALL
            .into_iter()
            .find(|code| u64::from(*code as u32) == value)
            .map(|code| FaultKind::AcceleratorError { code })
            .ok_or_else(|| wrong("an error code of the accelerator, 1 to 12"));
    }
    let known = KINDS.into_iter().find(|kind| kind.name() == name);
    let known = known.ok_or_else(|| FaultError::Kind { found: name.to_owned() })?;
    match value {
        None => Ok(known),
        Some(value) => {
            let value = number(name, value)?;
            known.with(value).ok_or_else(|| {
                wrong("no value, or 1 to 0xFFFFFFFF for a fault with clocks, a mask or a count")
            })
        }
    }
}

impl FromStr for Fault {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Self, FaultError> {
        let mut parts = text.split(',').map(str::trim);
        let head = parts.next().unwrap_or_default();
        let (name, place) = match head.split_once('@') {
            Some((name, place)) => (name.trim(), Some(place.trim())),
            None => (head, None),
        };
        let mut fault = Self::new(kind(name)?);
        fault.place = place.map(str::parse).transpose()?;
        for part in parts {
            let unknown = || FaultError::Key { found: part.to_owned() };
            let (key, value) = part.split_once('=').ok_or_else(unknown)?;
            match key {
                "phase" => fault.phase = Some(value.parse()?),
                "beat" => fault.when = Some(When::Beat(number(key, value)?)),
                "bd" => fault.when = Some(When::Descriptor(number(key, value)?)),
                "access" => fault.when = Some(When::Access(number(key, value)?)),
                "n" => fault.when = Some(When::Occasion(number(key, value)?)),
                "step" => fault.step = Some(number(key, value)?),
                "times" => fault.times = number(key, value)?,
                _ => return Err(unknown()),
            }
        }
        fault.check()?;
        Ok(fault)
    }
}

impl fmt::Display for FaultPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, fault) in self.faults.iter().enumerate() {
            let separator = if place == 0 { "" } else { "; " };
            write!(f, "{separator}{fault}")?;
        }
        Ok(())
    }
}

impl FromStr for FaultPlan {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Self, FaultError> {
        let parts = text.split(';').map(str::trim).filter(|part| !part.is_empty());
        Ok(Self { faults: parts.map(str::parse).collect::<Result<_, _>>()? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_read_as_it_is_written() {
        for kind in FaultKind::all() {
            let text = Fault::new(kind).to_string();
            assert_eq!(text.parse(), Ok(Fault::new(kind)), "{text}");
        }
        assert_eq!(FaultKind::all().count(), KINDS.len() + ErrorCode::ALL.len());
    }

    #[test]
    fn a_plan_says_what_where_and_when() {
        let text = "corrupt=0x10@dma2.mm2s,phase=contact2,beat=17,step=3; reset-never@dma1,n=1; \
                    power-lost,access=40,times=2";
        let plan: FaultPlan = text.parse().expect("well formed");
        let corrupt = Fault {
            step: Some(3),
            ..Fault::new(FaultKind::Corrupt { mask: 16 })
                .on(2, Direction::Mm2s)
                .in_phase(StepPhase::Contact(2))
                .when(When::Beat(17))
        };
        assert_eq!(plan.faults[0], corrupt);
        assert_eq!(plan.faults.len(), 3);
        assert_eq!(plan.to_string(), text);
    }

    #[test]
    fn the_error_for_a_wrong_line_names_the_expected_text() {
        for (text, part) in [
            ("stal", "no fault is named \"stal\"; expected one of dma-int-err"),
            ("stall@dma4.mm2s", "no place is named \"dma4.mm2s\""),
            ("stall@dma1", "stall does not happen in dma1; it is in a channel"),
            ("irq-drop@dma1.mm2s", "it is on the one interrupt line"),
            ("reset-slow@dma1.mm2s", "it is in a whole core"),
            ("stall,phase=contact0", "no phase is named \"contact0\""),
            ("stall,beat=x", "beat is \"x\", expected a whole number"),
            ("stall,often=3", "\"often=3\" is none of phase="),
            ("stall=3", "stall is \"3\", expected no value"),
            ("corrupt=0", "corrupt is \"0\""),
            ("slow=0", "slow is \"0\""),
            ("slow=0x100000000", "slow is \"0x100000000\""),
            ("accelerator-error=99", "an error code of the accelerator"),
            ("accelerator-error", "accelerator-error is \"\""),
            ("sg-int-err,beat=1", "sg-int-err does not happen at such an occasion; it has bd="),
            ("irq-drop,phase=load", "irq-drop does not happen in phase load; it has n= or step="),
        ] {
            let error = text.parse::<FaultPlan>().expect_err(text).to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
