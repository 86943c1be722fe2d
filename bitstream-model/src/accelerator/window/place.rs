//! The table of live bodies: the state of each, and the cycle from which it can be read.

use super::super::solver::{Mass, Velocity};

/// A place and its body.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Place {
    pub(super) velocity: Velocity,
    pub(super) mass: Mass,
    /// From its first use to its integration.
    pub(super) occupied: bool,
    /// From its first to its last use, in the order of the stream.
    pub(super) alive: bool,
    /// The pass in which its next use is.
    pub(super) pass: usize,
    /// Whether it was used in that pass.
    pub(super) used: bool,
    /// The cycle from which its velocity can be read.
    pub(super) ready: u64,
}

impl Place {
    /// The place of a body whose velocity has just come in.
    pub(super) fn new(velocity: Velocity, mass: Mass) -> Self {
        Self { velocity, mass, occupied: true, alive: true, ..Self::default() }
    }

    /// A use of the body was issued to pass `pass`; it is written back at cycle `ready`.
    pub(super) fn issued(&mut self, pass: usize, last: bool, ready: u64) {
        self.ready = ready;
        self.used = !last;
        if last {
            self.pass = pass + 1;
            self.alive = false;
        }
    }
}

/// A body after its last pass, on its way to the integration.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leaving {
    pub(super) place: usize,
    /// The cycle from which its velocity can be read.
    pub(super) ready: u64,
}
