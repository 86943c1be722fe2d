//! An accelerator with planted flaws, to show that a board and a lock step name them.

use std::process;
use std::thread;

use bitstream_model::external::{
    Clocked, ExternalAccelerator, ExternalError, ModelAccelerator, Offer,
};
use pgs_interface::control::{AP_CTRL, ap_ctrl};
use pgs_interface::record::result;

/// The flaws of an accelerator.
#[derive(Debug, Clone, Copy, Default)]
pub struct Flaws {
    /// The body whose linear velocity is wrong.
    pub wrong: Option<usize>,
    /// Exchanges of beats after which the process ends.
    pub dies_after: Option<u64>,
    /// Exchanges of beats after which it answers no more.
    pub hangs_after: Option<u64>,
}

/// The model with flaws.
#[derive(Debug)]
pub struct Flawed {
    model: ModelAccelerator,
    flaws: Flaws,
    /// Exchanges of beats in a step.
    exchanges: u64,
    busy: bool,
    /// Linear velocities that the step has sent.
    sent: usize,
}

impl Flawed {
    /// Plants flaws in the model.
    #[must_use]
    pub fn new(model: ModelAccelerator, flaws: Flaws) -> Self {
        Self { model, flaws, exchanges: 0, busy: false, sent: 0 }
    }
}

impl ExternalAccelerator for Flawed {
    fn read(&mut self, offset: u32) -> Result<u32, ExternalError> {
        self.model.read(offset)
    }

    fn write(&mut self, offset: u32, value: u32) -> Result<(), ExternalError> {
        if offset == AP_CTRL.offset && ap_ctrl::START.is_set(value) {
            self.sent = 0;
            self.busy = true;
        }
        self.model.write(offset, value)
    }

    fn run(&mut self, limit: u32, offer: &Offer) -> Result<Clocked, ExternalError> {
        self.exchanges += u64::from(self.busy);
        let reached = |after: Option<u64>| after.is_some_and(|after| self.exchanges > after);
        if reached(self.flaws.dies_after) {
            process::exit(1);
        }
        while reached(self.flaws.hangs_after) {
            thread::park();
        }
        let mut clocked = self.model.run(limit, offer)?;
        self.busy = clocked.busy;
        for beat in clocked.sent.get_mut(result::LINEAR).into_iter().flatten() {
            if self.flaws.wrong == Some(self.sent) {
                beat.beat.0[0] ^= 1;
            }
            self.sent += 1;
        }
        Ok(clocked)
    }
}
