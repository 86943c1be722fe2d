//! The design that streams the collisions once: all passes run at the same time, each behind the
//! one before it, and only live bodies are on chip.
//!
//! ```text
//! collisions -> pass 0 -> delay line -> pass 1 -> delay line -> ... -> pass P-1
//! velocities ----^ first use                                            | last use
//!                  places (velocity, mass, scoreboard) <----------------+-> integration -> results
//!                                                                   poses -----^
//! ```
//!
//! `entry.rs` reads the marks of a record, `place.rs` is the table of live bodies with its
//! scoreboard, `flow.rs` decides when each pass issues, and `session.rs` works through the records
//! that have arrived. The arithmetic of one collision in one pass is the same as in every design.

mod entry;
mod flow;
mod place;
mod session;

pub(super) use session::Windowed;

use super::{Accelerator, Phase};
use pgs_interface::control::{COLLISIONS, ErrorCode, window, window_capacity};
use pgs_interface::profile::{Flow, Window};

/// The WINDOW register.
pub(super) fn units(flow: &Flow) -> u32 {
    match flow {
        Flow::Passes => 0,
        Flow::Window(of) => window::FRICTION_UNITS
            .put(window::CONTACT_UNITS.put(0, of.contact_units), of.friction_units),
    }
}

/// The `WINDOW_CAPACITY` register.
pub(super) fn capacity(flow: &Flow) -> u32 {
    match flow {
        Flow::Passes => 0,
        Flow::Window(of) => {
            window_capacity::LAG.put(window_capacity::SLOTS.put(0, of.slots), of.lag)
        }
    }
}

impl Accelerator {
    /// Begins a step whose arguments are in range.
    pub(super) fn start_window(&mut self, design: &Window) {
        if self.arguments.collisions > Window::COLLISIONS_MAX {
            self.fail(ErrorCode::Argument, 0, COLLISIONS.offset);
            return;
        }
        let profile = self.variant.profile;
        let slot = design.slot_cycles(
            self.arguments.contact_iterations,
            self.arguments.friction_iterations,
            profile.initiation_interval,
            profile.collisions_per_issue,
        );
        let windows: Vec<u64> =
            (0..self.arguments.passes()).map(|pass| self.depth(pass).window.into()).collect();
        // The passes of a kind are dealt out to its units in turn.
        let contact = (0..self.arguments.contact_iterations).map(|k| k % design.contact_units);
        let friction = (0..self.arguments.friction_iterations)
            .map(|k| design.contact_units + k % design.friction_units);
        let units = contact.chain(friction).map(|unit| unit as usize).collect();
        let collisions = if windows.is_empty() { 0 } else { self.arguments.collisions as usize };
        let flow = flow::Flow::new(flow::Shape {
            slot: slot.into(),
            interval: profile.initiation_interval.into(),
            per_issue: profile.collisions_per_issue as usize,
            lag: design.lag as usize,
            places: design.slots as usize,
            collisions,
            windows,
            units,
        });
        let windowed = Windowed::new(
            flow,
            self.collisions_in(0),
            self.velocities_in(),
            self.poses_in(),
            self.results_out(),
        );
        self.window = Some(Box::new(windowed));
        self.phase = Phase::Window;
    }
}
