//! Writes the accelerator's arguments, starts it and resets it.

use std::time::Duration;

use pgs_interface::control::{
    ANGULAR_DAMPING, AP_CTRL, BODIES, COLLISIONS, CONTACT_ITERATIONS, FLAGS, FRICTION,
    FRICTION_ITERATIONS, GIE, GRAVITY_X, GRAVITY_Y, GRAVITY_Z, IER, POSITION_COEFFICIENT,
    POSITION_DRIFT, RESET, SPIN_DAMPING, TIME_STEP, ap_ctrl, flags, irq, reset,
};
use pgs_interface::register::Register;

use super::ControlError;
use crate::platform::{Deadline, Platform, Window, poll_until};
use crate::scene::StepParameters;

/// How long the accelerator may take to reset.
const RESET_LIMIT: Duration = Duration::from_millis(10);

/// Number of arguments.
const ARGUMENTS: usize = 14;

/// The arguments of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StepArguments<'a> {
    /// Records of bodies.
    pub(crate) bodies: u32,
    /// Records of collisions.
    pub(crate) collisions: u32,
    /// The caller's parameters.
    pub(crate) parameters: &'a StepParameters,
    /// Whether the bodies bring their masses; else the shape table has them.
    pub(crate) streamed_masses: bool,
    /// Whether the collisions pass by the issue queue of a board that has one.
    pub(crate) in_order: bool,
}

/// The argument registers of a step and their values.
fn registers_of(arguments: &StepArguments<'_>) -> [(Register, u32); ARGUMENTS] {
    let StepArguments { bodies, collisions, parameters, .. } = *arguments;
    [
        (BODIES, bodies),
        (COLLISIONS, collisions),
        (CONTACT_ITERATIONS, parameters.contact_iterations),
        (FRICTION_ITERATIONS, parameters.friction_iterations),
        (FLAGS, flags_of(arguments)),
        (TIME_STEP, parameters.time_step.to_bits()),
        (POSITION_DRIFT, parameters.position_drift.to_bits()),
        (POSITION_COEFFICIENT, parameters.position_coefficient.to_bits()),
        (FRICTION, parameters.friction.to_bits()),
        (ANGULAR_DAMPING, parameters.angular_damping.to_bits()),
        (GRAVITY_X, parameters.gravity[0].to_bits()),
        (GRAVITY_Y, parameters.gravity[1].to_bits()),
        (GRAVITY_Z, parameters.gravity[2].to_bits()),
        (SPIN_DAMPING, parameters.spin_damping.to_bits()),
    ]
}

/// The switches of a step.
fn flags_of(arguments: &StepArguments<'_>) -> u32 {
    let StepArguments { parameters, streamed_masses, in_order, .. } = *arguments;
    let word = flags::INTEGRATE.put(0, parameters.integrate.into());
    let word = flags::KINEMATIC.put(word, parameters.kinematic.into());
    let word = flags::PAIR_FRICTION.put(word, parameters.pair_friction.into());
    let word = flags::WARM_START.put(word, parameters.warm_start.into());
    let word = flags::IMPULSES_OUT.put(word, parameters.impulses_out.into());
    let word = flags::STREAMED_MASSES.put(word, streamed_masses.into());
    flags::IN_ORDER.put(word, in_order.into())
}

/// The accelerator's control block.
#[derive(Debug)]
pub(crate) struct Control {
    window: Window,
    /// Values in the argument registers; `None` if unknown.
    written: [Option<u32>; ARGUMENTS],
}

impl Control {
    /// The control block behind a window.
    pub(crate) fn new(window: Window) -> Self {
        Self { window, written: [None; ARGUMENTS] }
    }

    /// Its registers.
    pub(crate) fn window(&self) -> &Window {
        &self.window
    }

    /// Reads one register.
    pub(crate) fn read(&self, register: &Register) -> u32 {
        self.window.read32(register.offset)
    }

    /// Whether the accelerator has not been reset since [`reset`](Self::reset), which enables its
    /// interrupt: arguments and shapes are as they were written.
    pub(crate) fn is_set_up(&self) -> bool {
        self.read(&GIE) & 1 != 0
    }

    /// Writes one word. The offset may lie in the shape table.
    pub(crate) fn write(&mut self, offset: u32, value: u32) {
        self.window.write32(offset, value);
    }

    /// Writes the arguments that differ from the values in the registers.
    pub(crate) fn set_arguments(&mut self, arguments: &StepArguments<'_>) {
        for (place, (register, value)) in registers_of(arguments).into_iter().enumerate() {
            if self.written[place] != Some(value) {
                self.write(register.offset, value);
                self.written[place] = Some(value);
            }
        }
    }

    /// Starts a step.
    pub(crate) fn start(&mut self) {
        self.write(AP_CTRL.offset, ap_ctrl::START.mask());
    }

    /// Whether the step has ended; `None` if the board is gone. Reading clears the flag.
    pub(crate) fn take_done(&mut self) -> Option<bool> {
        let value = self.read(&AP_CTRL);
        (value != u32::MAX).then(|| ap_ctrl::DONE.is_set(value))
    }

    /// Resets the accelerator, and enables the interrupt of its sticky error.
    pub(crate) fn reset(&mut self, platform: &dyn Platform) -> Result<(), ControlError> {
        self.written = [None; ARGUMENTS];
        self.write(RESET.offset, reset::RESET.mask());
        let deadline = Deadline::after(platform, RESET_LIMIT);
        let mut found = 0;
        let done = poll_until(platform, &deadline, || {
            found = self.read(&RESET);
            (found == u32::MAX || !reset::RESET.is_set(found)).then_some(())
        });
        if found == u32::MAX {
            return Err(ControlError::Gone);
        }
        done.ok_or(ControlError::Reset { limit: deadline.limit(), found })?;
        self.write(GIE.offset, 1);
        self.write(IER.offset, irq::ERROR.mask());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::platform::RegisterMap;
    use crate::platform::fake::{FakePlatform, FakeRegisters};

    /// Two bodies and a collision.
    fn step(parameters: &StepParameters) -> StepArguments<'_> {
        let (streamed_masses, in_order) = (false, false);
        StepArguments { bodies: 2, collisions: 1, parameters, streamed_masses, in_order }
    }

    #[test]
    fn only_arguments_that_changed_are_written() {
        let registers = FakeRegisters::default();
        let mut control = Control::new(registers.window(RegisterMap::Control));
        let parameters = StepParameters::default();
        control.set_arguments(&step(&parameters));
        assert_eq!(registers.with(|state| state.writes.len()), ARGUMENTS);
        assert_eq!(registers.with(|state| state.values[&0x38]), (1.0f32 / 60.0).to_bits());
        assert_eq!(registers.with(|state| state.values[&0x30]), 1);
        let more = StepArguments { collisions: 7, ..step(&parameters) };
        control.set_arguments(&more);
        assert_eq!(registers.with(|state| state.writes[ARGUMENTS..].to_vec()), [(0x18, 7)]);
    }

    #[test]
    fn each_switch_has_its_bit() {
        let word = |parameters: StepParameters| flags_of(&step(&parameters));
        let none = StepParameters::default().with_integrate(false);
        assert_eq!(word(none), 0b000);
        assert_eq!(word(StepParameters::default()), 0b001);
        assert_eq!(word(none.with_kinematic(true)), 0b010);
        assert_eq!(word(none.with_pair_friction(true)), 0b100);
        let masses = StepArguments { streamed_masses: true, ..step(&none) };
        assert_eq!(flags_of(&masses), 0b010_0000);
        let in_order = StepArguments { in_order: true, ..step(&none) };
        assert_eq!(flags_of(&in_order), 0b100_0000);
    }

    #[test]
    fn after_a_reset_every_argument_is_written_again() {
        let registers = FakeRegisters::default();
        registers.with(|state| state.kept_bits.insert(0x1C0, 0));
        let mut control = Control::new(registers.window(RegisterMap::Control));
        control.set_arguments(&step(&StepParameters::default()));
        control.reset(&FakePlatform::default()).expect("out of reset");
        assert_eq!(
            registers.with(|state| state.writes[ARGUMENTS..].to_vec()),
            [(0x1C0, 1), (0x04, 1), (0x08, 4)]
        );
        control.set_arguments(&step(&StepParameters::default()));
        assert_eq!(registers.with(|state| state.writes.len()), 2 * ARGUMENTS + 3);
    }

    #[test]
    fn a_reset_that_never_ends_is_an_error() {
        let registers = FakeRegisters::default();
        let mut control = Control::new(registers.window(RegisterMap::Control));
        let error = control.reset(&FakePlatform::default());
        assert!(matches!(error, Err(ControlError::Reset { found: 1, .. })));
    }

    #[test]
    fn all_ones_are_not_taken_for_done() {
        let registers = FakeRegisters::default();
        registers.with(|state| state.scripted.insert(0, vec![u32::MAX, 0b1110, 0b0100]));
        let mut control = Control::new(registers.window(RegisterMap::Control));
        assert_eq!(control.take_done(), None);
        assert_eq!(control.take_done(), Some(true));
        assert_eq!(control.take_done(), Some(false));
    }
}
