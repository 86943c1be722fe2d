//! This file brings a step into a bank of buffers: validate, order, reserve, pack.

use std::sync::atomic::{AtomicU64, Ordering as Atomic};

use super::bank::Bank;
use super::fault::Fault;
use super::in_flight::Stopwatch;
use super::ordering::{Arranged, Hardware};
use super::packing::Sent;
use super::plan::Plan;
use super::report::HostTimes;
use super::solver::Accelerator;
use super::symptom::Symptom;
use crate::error::{Aftermath, Error};
use crate::order::Ordered;
use crate::scene::validate::validate;
use crate::scene::{Bodies, Collisions, StepParameters};

/// What tells one packing from all others of this process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Ticket(u64);

impl Ticket {
    /// One that nobody has.
    fn new() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self(NEXT.fetch_add(1, Atomic::Relaxed))
    }
}

/// A step whose records lie in a bank.
#[derive(Debug, Clone, Copy)]
pub(super) struct Load {
    pub(super) ticket: Ticket,
    pub(super) bank: Bank,
    pub(super) plan: Plan,
    /// Nothing, where nothing moves and nothing is streamed.
    pub(super) sent: Option<Sent>,
    pub(super) parameters: StepParameters,
    /// Bodies and collisions as given.
    pub(super) bodies: usize,
    pub(super) collisions: usize,
    /// Entries that the order added.
    pub(super) empty: usize,
    pub(super) arranged: Arranged,
    /// How often shapes had been loaded.
    pub(super) shapes_loaded: u64,
    pub(super) host: HostTimes,
}

/// What the engines are at while a step is packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Engines {
    /// Nothing: they may be stopped and reset, and all memory but the bank's may be freed.
    Idle,
    /// Another step, which nothing may disturb.
    Working,
}

impl Accelerator {
    /// Brings a step into a bank that no engine has in work.
    pub(super) fn load<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        (bank, engines): (Bank, Engines),
        bodies: &B,
        collisions: &C,
        parameters: &StepParameters,
        watch: &mut Stopwatch,
    ) -> Result<Load, Error> {
        let mut host = HostTimes::default();
        validate(bodies, collisions, &self.shapes, parameters, &self.limits)?;
        host.validate = watch.lap();
        // Whatever comes of this one, a caller's panic included: the earlier one is gone.
        self.loads[bank] = None;
        let Self { orderings, device, limits, shapes, .. } = self;
        let ordering = &mut orderings[bank];
        let on = Hardware { capabilities: &device.capabilities, limits, shapes };
        let arranged = ordering.arrange(bodies, collisions, parameters, on)?;
        host.order = watch.lap();

        let lives = arranged.live.map(|_| ordering.lives());
        let entries = match lives {
            Some(lives) => lives.words().len(),
            None if arranged.scheduled => ordering.schedule().len(),
            None => collisions.len(),
        };
        // Those that fill the last issue are of the order's making too.
        let empty = match arranged.scheduled {
            true => entries.saturating_sub(ordering.schedule().collisions()),
            false => 0,
        };
        let plan = Plan {
            bodies: lives.map_or(bodies.len(), |lives| lives.velocities().len()),
            collisions: entries,
            passes: u64::from(parameters.contact_iterations)
                + u64::from(parameters.friction_iterations),
            variant: limits.variant,
        };
        let sent = match self.make_room(&plan, bank, engines) {
            Ok(()) if plan.bodies > 0 => {
                Some(self.pack_in_order(&plan, bank, arranged, bodies, collisions))
            }
            Ok(()) => None,
            Err(symptom) => return Err(self.refuse(symptom, engines)),
        };
        host.pack = watch.lap();
        let load = Load {
            ticket: Ticket::new(),
            bank,
            plan,
            sent,
            parameters: *parameters,
            bodies: bodies.len(),
            collisions: collisions.len(),
            empty,
            arranged,
            shapes_loaded: self.shapes_loaded,
            host,
        };
        self.loads[bank] = Some(load);
        Ok(load)
    }

    /// Makes buffers, and rings if nothing runs on them, large enough.
    fn make_room(&mut self, plan: &Plan, bank: Bank, engines: Engines) -> Result<(), Symptom> {
        if engines == Engines::Idle {
            self.device.check_cancelled()?;
        }
        if plan.bodies == 0 {
            return Ok(());
        }
        match engines {
            Engines::Idle => {
                self.or_free(bank, |this| this.device.reserve_or_reset(plan, bank, &this.shapes))
            }
            Engines::Working => self.device.reserve_buffers(plan, bank).map_err(|error| {
                // A part of them is of no use, and may be what the next step lacks.
                self.device.release_buffers(bank);
                Fault::NoMemory(error).into()
            }),
        }
    }

    /// Tries again with the memory of the other bank, if there is too little: what was prepared
    /// there is lost.
    pub(super) fn or_free(
        &mut self,
        bank: Bank,
        attempt: impl Fn(&mut Self) -> Result<(), Symptom>,
    ) -> Result<(), Symptom> {
        let tried = attempt(self);
        if matches!(tried, Err(Symptom::Known(Fault::NoMemory(_))))
            && self.device.release_buffers(bank.other())
        {
            self.loads[bank.other()] = None;
            log::info!("too little memory for DMA: what was kept for prepared steps was freed");
            return attempt(self);
        }
        tried
    }

    fn pack_in_order<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        plan: &Plan,
        bank: Bank,
        arranged: Arranged,
        bodies: &B,
        collisions: &C,
    ) -> Sent {
        let Self { orderings, device, shapes, .. } = self;
        let ordering = &orderings[bank];
        let lives = arranged.live.map(|_| ordering.lives());
        if arranged.scheduled {
            let ordered = Ordered { collisions, schedule: ordering.schedule() };
            device.pack(plan, bank, bodies, &ordered, lives, shapes)
        } else {
            device.pack(plan, bank, bodies, collisions, lives, shapes)
        }
    }

    /// The error of a step that could not be packed.
    fn refuse(&mut self, symptom: Symptom, engines: Engines) -> Error {
        match (symptom, engines) {
            // The board has no part in it, and is at work.
            (Symptom::Known(fault), Engines::Working) => {
                let fault = Box::new(fault);
                Error::Step { fault, aftermath: Aftermath::Untouched, diagnosis: None }
            }
            (symptom, _) => self.device.fail(symptom, &self.shapes),
        }
    }
}
