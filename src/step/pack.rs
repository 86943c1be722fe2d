//! This file brings a step into a bank of buffers: validate, order, reserve, pack.

use std::sync::atomic::{AtomicU64, Ordering as Atomic};

use super::accelerator::Accelerator;
use super::in_flight::Stopwatch;
use super::ordering::{Arranged, Hardware};
use super::packing::{Sent, Source};
use super::report::HostTimes;
use crate::board::bank::Bank;
use crate::board::plan::Plan;
use crate::board::symptom::Symptom;
use crate::error::{Aftermath, Error};
use crate::fault::Fault;
use crate::order::Ordered;
use crate::scene::{Bodies, Collisions, StepParameters};
use crate::validate::InputError;
use crate::validate::{Quick, preflight, validate};

/// What tells one packing from all others of this process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct PackId(u64);

impl PackId {
    /// One that nobody has.
    pub(super) fn new() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self(NEXT.fetch_add(1, Atomic::Relaxed))
    }
}

/// A step whose records lie in a bank.
#[derive(Debug, Clone, Copy)]
pub(super) struct PackedStep {
    pub(super) ticket: PackId,
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
    ) -> Result<PackedStep, Error> {
        self.forget(bank);
        let mut host = HostTimes::default();
        preflight(bodies, collisions, &self.shapes, parameters, &self.limits)?;
        host.validate = watch.lap();
        let Self { orderings, device, limits, shapes, .. } = self;
        let ordering = &mut orderings[bank];
        let on = Hardware { capabilities: &device.capabilities, limits, shapes };
        let arranged = match ordering.arrange(bodies, collisions, parameters, on) {
            Ok(arranged) => arranged,
            Err(error) => {
                // What is not right with the input is said before what is not right with its order.
                self.validate(bodies, collisions, parameters)?;
                return Err(error.into());
            }
        };
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
            passes: parameters.passes(),
            variant: limits.variant,
        };
        // All of the input is looked at while it is packed. Where it is not all packed, or something
        // else may end the step before, it is validated first.
        let all = !arranged.scheduled || ordering.schedule().collisions() == collisions.len();
        let cancelled = engines == Engines::Idle && device.check_cancelled().is_err();
        if !all || plan.bodies == 0 || cancelled || !device.has_room(&plan, bank) {
            self.validate(bodies, collisions, parameters)?;
        }
        if let Err(symptom) = self.make_room(&plan, bank, engines) {
            return Err(self.refuse(symptom, engines));
        }
        let mut sent = None;
        if plan.bodies > 0 {
            let (packed, good) =
                self.pack_in_order(&plan, bank, arranged, (bodies, collisions), parameters)?;
            if !good {
                self.validate(bodies, collisions, parameters)?;
                // What was packed is not what was looked at now.
                return Err(InputError::Unsteady.into());
            }
            sent = Some(packed);
        }
        host.pack = watch.lap();
        let load = PackedStep {
            ticket: PackId::new(),
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

    /// Forgets what lies in a bank, and takes its buffers back. Whatever comes of what is packed
    /// into it, a refusal or a caller's panic: the earlier step is gone.
    pub(super) fn forget(&mut self, bank: Bank) {
        self.loads[bank] = None;
        self.device.take_back_unused(bank);
    }

    /// Makes buffers, and rings if nothing runs on them, large enough.
    pub(super) fn make_room(
        &mut self,
        plan: &Plan,
        bank: Bank,
        engines: Engines,
    ) -> Result<(), Symptom> {
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

    /// The whole of validation.
    fn validate<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &self,
        bodies: &B,
        collisions: &C,
        parameters: &StepParameters,
    ) -> Result<(), InputError> {
        validate(bodies, collisions, &self.shapes, parameters, &self.limits)
    }

    /// Packs; whether validation refuses nothing of what was packed.
    fn pack_in_order<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        plan: &Plan,
        bank: Bank,
        arranged: Arranged,
        (bodies, collisions): (&B, &C),
        parameters: &StepParameters,
    ) -> Result<(Sent, bool), InputError> {
        let Self { orderings, device, limits, shapes, .. } = self;
        let quick = Quick::new(preflight(bodies, collisions, shapes, parameters, limits)?);
        let ordering = &orderings[bank];
        let (lives, quick) = (arranged.live.map(|_| ordering.lives()), Some(&quick));
        Ok(if arranged.scheduled {
            let schedule = ordering.schedule();
            let added = Some(plan.collisions.saturating_sub(schedule.collisions()));
            let collisions = &Ordered { collisions, schedule };
            let source = Source { bodies, collisions, added, lives, shapes, quick };
            device.pack(plan, bank, &source)
        } else {
            let source = Source { bodies, collisions, added: None, lives, shapes, quick };
            device.pack(plan, bank, &source)
        })
    }

    /// The error of a step that could not be packed.
    pub(super) fn refuse(&mut self, symptom: Symptom, engines: Engines) -> Error {
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
