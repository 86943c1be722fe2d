//! Packs a step into a bank of buffers: check, order, reserve, pack.

use std::sync::atomic::{AtomicU64, Ordering as Atomic};

use super::accelerator::Accelerator;
use super::ordering::{Arranged, Hardware, Ordering};
use super::packing::{Sent, Source};
use super::report::HostTimes;
use super::reserve::{refuse, reserve};
use super::stopwatch::Stopwatch;
use crate::board::bank::Bank;
use crate::board::device::Device;
use crate::board::plan::Plan;
use crate::error::Error;
use crate::order::Ordered;
use crate::scene::{Bodies, Collisions, Shape, StepParameters};
use crate::validate::{InputError, Limits, Quick, Scene, preflight, validate};

/// Tells one packing from all others of this process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct PackId(u64);

impl PackId {
    /// An id that no other packing has.
    pub(super) fn new() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self(NEXT.fetch_add(1, Atomic::Relaxed))
    }
}

/// A step whose records lie in a bank.
#[derive(Debug, Clone, Copy)]
pub(super) struct PackedStep {
    pub(super) id: PackId,
    pub(super) bank: Bank,
    pub(super) plan: Plan,
    /// The sums of the words sent; `None` if no body moves and nothing is streamed.
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

/// What the engines do while a step is packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Engines {
    /// Nothing: they may be stopped and reset, and all memory but the bank's may be freed.
    Idle,
    /// They work on another step, which nothing may disturb.
    Working,
}

/// A step as the caller gives it.
struct Input<'a, B: ?Sized, C: ?Sized> {
    bodies: &'a B,
    collisions: &'a C,
    parameters: &'a StepParameters,
    shapes: &'a [Shape],
    limits: &'a Limits,
}

impl<'a, B: Bodies + ?Sized, C: Collisions + ?Sized> Input<'a, B, C> {
    /// Refuses what is wrong whatever the bodies and collisions hold.
    fn check(&self) -> Result<Scene<'a>, InputError> {
        preflight(self.bodies, self.collisions, self.shapes, self.parameters, self.limits)
    }

    /// Refuses everything that packing would find, with the words for it.
    fn check_all(&self) -> Result<(), InputError> {
        validate(self.bodies, self.collisions, self.shapes, self.parameters, self.limits)
    }

    /// Orders the collisions.
    fn order(&self, ordering: &mut Ordering, device: &Device) -> Result<Arranged, InputError> {
        let capabilities = &device.capabilities;
        let on = Hardware { capabilities, limits: self.limits, shapes: self.shapes };
        let arranged = ordering.arrange(self.bodies, self.collisions, self.parameters, on);
        // A fault of the input is reported before a fault of its order.
        arranged.or_else(|error| self.check_all().and(Err(error)))
    }

    /// Lays the step out over the channels.
    fn plan(&self, ordering: &Ordering, arranged: &Arranged) -> Plan {
        let lives = arranged.live.map(|_| ordering.lives());
        let collisions = match lives {
            Some(lives) => lives.words().len(),
            None if arranged.scheduled => ordering.schedule().len(),
            None => self.collisions.len(),
        };
        Plan {
            bodies: lives.map_or(self.bodies.len(), |lives| lives.velocities().len()),
            collisions,
            passes: self.parameters.passes(),
            variant: self.limits.variant,
        }
    }

    /// Writes the records into the bank. `false` if the screening doubts the input.
    fn pack(
        &self,
        device: &mut Device,
        (ordering, arranged): (&Ordering, &Arranged),
        (plan, bank): (&Plan, Bank),
        scene: Scene<'a>,
    ) -> (Sent, bool) {
        let Self { bodies, collisions, shapes, .. } = *self;
        let quick = Quick::new(scene);
        let (lives, quick) = (arranged.live.map(|_| ordering.lives()), Some(&quick));
        if arranged.scheduled {
            let schedule = ordering.schedule();
            let added = Some(plan.collisions.saturating_sub(schedule.collisions()));
            let collisions = &Ordered { collisions, schedule };
            let source = Source { bodies, collisions, added, lives, shapes, quick };
            device.pack(plan, bank, &source)
        } else {
            let source = Source { bodies, collisions, added: None, lives, shapes, quick };
            device.pack(plan, bank, &source)
        }
    }
}

impl Accelerator {
    /// Packs a step into a bank that no engine works on: check, order, reserve, pack.
    pub(super) fn pack<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        (bank, engines): (Bank, Engines),
        bodies: &B,
        collisions: &C,
        parameters: &StepParameters,
        watch: &mut Stopwatch,
    ) -> Result<PackedStep, Error> {
        self.forget(bank);
        let mut host = HostTimes::default();
        let Self { orderings, device, limits, shapes, packed, .. } = self;
        let input = Input { bodies, collisions, parameters, shapes, limits };

        let scene = input.check()?;
        host.validate = watch.lap();

        let arranged = input.order(&mut orderings[bank], device)?;
        host.order = watch.lap();

        let ordering = &orderings[bank];
        let plan = input.plan(ordering, &arranged);
        let all_sent = !arranged.scheduled || ordering.schedule().collisions() == collisions.len();
        let cancelled = engines == Engines::Idle && device.check_cancelled().is_err();
        // Packing screens what it sends. What it does not send, or what another error would hide, is
        // checked here.
        if !all_sent || plan.bodies == 0 || cancelled || !device.has_room(&plan, bank) {
            input.check_all()?;
        }
        reserve((&mut *device, packed), shapes, (&plan, bank), engines)
            .map_err(|symptom| refuse(device, shapes, symptom, engines))?;

        let mut sent = None;
        if plan.bodies > 0 {
            let (sums, passed) = input.pack(device, (ordering, &arranged), (&plan, bank), scene);
            if !passed {
                input.check_all()?;
                // The input is right now, and was not when it was packed.
                return Err(InputError::Unsteady.into());
            }
            sent = Some(sums);
        }
        host.pack = watch.lap();

        // Entries that fill the last issue are of the order's making too.
        let empty = match arranged.scheduled {
            true => plan.collisions.saturating_sub(ordering.schedule().collisions()),
            false => 0,
        };
        Ok(self.keep(PackedStep {
            id: PackId::new(),
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
        }))
    }

    /// Remembers what lies in a bank.
    pub(super) fn keep(&mut self, step: PackedStep) -> PackedStep {
        self.packed[step.bank] = Some(step);
        step
    }

    /// Forgets what lies in a bank, and takes its buffers back. Whatever becomes of the next packing,
    /// a refusal or a caller's panic, the earlier step is gone.
    pub(super) fn forget(&mut self, bank: Bank) {
        self.packed[bank] = None;
        self.device.take_back_unused(bank);
    }
}
