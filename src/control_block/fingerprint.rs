//! Checks that the bitstream is still the one that was identified at opening.

use pgs_interface::control::{
    BODY_CAPACITY, CHANNELS, CLOCK_KHZ, COLLISION_CAPACITY, CONTACT_DEPTH, DMA, FEATURES,
    FRICTION_DEPTH, IDENTIFICATION, ISSUE, MEMORY_BYTES, MEMORY_PER_RECORD, MM2S_WIDTHS, NUMBERS,
    PROFILE, QUEUE, S2MM_WIDTHS, SHAPE_CAPACITY, VERSION,
};
use pgs_interface::register::Register;

use super::Control;

/// The identification and capability registers, which never change while a bitstream is loaded.
const CONSTANTS: [&Register; 19] = [
    &IDENTIFICATION,
    &VERSION,
    &PROFILE,
    &FEATURES,
    &CHANNELS,
    &MM2S_WIDTHS,
    &S2MM_WIDTHS,
    &ISSUE,
    &CONTACT_DEPTH,
    &FRICTION_DEPTH,
    &CLOCK_KHZ,
    &BODY_CAPACITY,
    &COLLISION_CAPACITY,
    &SHAPE_CAPACITY,
    &MEMORY_BYTES,
    &MEMORY_PER_RECORD,
    &DMA,
    &NUMBERS,
    &QUEUE,
];

/// The constant registers of one bitstream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Fingerprint([u32; CONSTANTS.len()]);

/// The first register whose value differs under another bitstream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Changed {
    pub(crate) register: &'static str,
    pub(crate) expected: u32,
    pub(crate) found: u32,
}

impl Fingerprint {
    /// IDENTIFICATION, which tells one design from another.
    pub(crate) fn identification(&self) -> u32 {
        self.0[0]
    }

    /// The first register that differs between this fingerprint and `found`.
    pub(crate) fn difference(&self, found: &Self) -> Option<Changed> {
        let pairs = self.0.iter().zip(&found.0).zip(CONSTANTS);
        pairs.filter(|((expected, found), _)| expected != found).map(changed).next()
    }
}

fn changed(((expected, found), register): ((&u32, &u32), &Register)) -> Changed {
    Changed { register: register.name, expected: *expected, found: *found }
}

impl Control {
    /// Reads the fingerprint of the loaded bitstream, IDENTIFICATION last: it then tells of a power
    /// that was lost, or of another bitstream that was loaded, at any of these reads.
    pub(crate) fn fingerprint(&self) -> Fingerprint {
        let mut words = [0; CONSTANTS.len()];
        for (word, register) in words.iter_mut().zip(CONSTANTS).rev() {
            *word = self.read(register);
        }
        Fingerprint(words)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control_block::fake;
    use crate::platform::RegisterMap;
    use crate::platform::fake::FakeRegisters;

    #[test]
    fn every_capability_register_is_compared() {
        let registers = FakeRegisters::default();
        fake::describe(&registers);
        let control = Control::new(registers.window(RegisterMap::Control));
        let before = control.fingerprint();
        assert_eq!(before.identification(), 0x5047_5331);
        assert_eq!(before.difference(&control.fingerprint()), None);
        // The capabilities lie between IDENTIFICATION and QUEUE (interface specification).
        for offset in (0x100..=0x148).step_by(4) {
            let was = registers.with(|state| state.values.insert(offset, 0xABCD));
            let changed = before.difference(&control.fingerprint()).expect("it differs");
            assert_eq!((changed.found, changed.expected), (0xABCD, was.unwrap_or(0)));
            registers.with(|state| state.values.insert(offset, was.unwrap_or(0)));
        }
        assert_eq!(before.difference(&control.fingerprint()), None);
    }
}
