//! This file is the accelerator as a caller sees it, and one step from end to end.
//!
//! Validate, order, reserve, pack, hand over, start, wait, take back, unpack, check, commit: nothing of
//! the caller's changes before the last.

use std::time::{Duration, Instant};

use bitstream_model::interface::address_map::DMA_COUNT_MAX;
use bitstream_model::interface::record::Beat;

use super::board::{self, BoardDescription, Found, OpenOptions};
use super::device::Device;
use super::fault::Fault;
use super::locate::locate;
use super::ordering::{Arranged, Hardware, Ordering};
use super::plan::Plan;
use super::report::{HostTimes, StepCycles, StepReport};
use super::retry::with_retries;
use super::symptom::Symptom;
use crate::accelerator::{Capabilities, Counters};
use crate::axi_dma::Direction;
use crate::beat::pack::{
    Chosen, pack_collisions, pack_marked_collisions, pack_poses, pack_velocities,
};
use crate::beat::stripe::Segment;
use crate::beat::unpack::{Results, sum_of_words};
use crate::error::{Error, OpenError};
use crate::order::{Lives, Order, Ordered};
use crate::platform::{Deadline, System};
use crate::scene::validate::{Limits, validate, validate_shapes};
use crate::scene::{Bodies, Collisions, Pose, Shape, StepParameters, Velocity};

/// Finds the board that the options ask for.
pub(crate) fn find(options: &OpenOptions) -> Result<Found, OpenError> {
    board::find(&options.board, &options.memory, &System::default())
}

/// An open accelerator.
///
/// Dropping it stops the DMA channels and frees their memory.
#[derive(Debug)]
pub struct Accelerator {
    board: BoardDescription,
    pub(super) device: Device,
    limits: Limits,
    pub(super) shapes: Vec<Shape>,
    ordering: Ordering,
    /// Results of a step until all are checked. Kept, so that a step allocates nothing.
    spare: Vec<(Pose, Velocity)>,
}

/// What a step sent, for comparison with what the accelerator received.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sent {
    pub(super) velocities: u32,
    pub(super) collisions: u32,
    pub(super) poses: u32,
}

impl Accelerator {
    /// Opens a board, identifies its bitstream and resets it.
    ///
    /// # Errors
    /// [`Error::Open`]: no such board, not a bitstream that this driver knows, or DMA cores that
    /// do not behave as they should.
    pub fn open(options: OpenOptions) -> Result<Self, Error> {
        Self::on(find(&options)?, options.length_width)
    }

    /// Opens the accelerator of a board that was found.
    pub(super) fn on(found: Found, length_width: Option<u32>) -> Result<Self, Error> {
        let device = Device::open(found.platform, length_width)?;
        Ok(Self::assemble(found.description, device))
    }

    /// The accelerator of a board that was brought up.
    pub(crate) fn assemble(board: BoardDescription, device: Device) -> Self {
        let Capabilities { variant, version, clock_khz, .. } = device.capabilities;
        log::info!(
            "opened {board}: profile {}, interface {}.{}, {clock_khz} kHz",
            variant.profile.name,
            version.0,
            version.1
        );
        let limits = Limits {
            variant,
            flush_subnormals: device.capabilities.flush_subnormals,
            // An index has to name every body, whatever the bitstream says.
            body_capacity: device.capabilities.body_capacity.min(variant.body_capacity()),
            collision_capacity: device.capabilities.collision_capacity,
            shape_capacity: device.capabilities.shape_capacity,
            memory_bytes: device.capabilities.memory_bytes,
            bytes_per_body: device.capabilities.bytes_per_body,
            bytes_per_collision: device.capabilities.bytes_per_collision,
        };
        let ordering = Ordering::default();
        Self { board, device, limits, shapes: Vec::new(), ordering, spare: Vec::new() }
    }

    /// Which board was opened, and why.
    #[must_use]
    pub fn board(&self) -> &BoardDescription {
        &self.board
    }

    /// What the bitstream says of itself.
    #[must_use]
    pub fn capabilities(&self) -> &Capabilities {
        &self.device.capabilities
    }

    /// Loads the shapes that bodies refer to by index, in place of all earlier ones.
    ///
    /// # Errors
    /// [`Error::Input`]: a shape that the bitstream cannot take, or too many; the earlier shapes
    /// stay. [`Error::MustReopen`] after a fault that could not be cleared.
    pub fn set_shapes(&mut self, shapes: &[Shape]) -> Result<(), Error> {
        if self.device.dead {
            return Err(Error::MustReopen);
        }
        validate_shapes(shapes, &self.limits)?;
        self.device.control.load_shapes(shapes, self.limits.variant.inertia);
        self.shapes.clear();
        self.shapes.extend_from_slice(shapes);
        Ok(())
    }

    /// Solves the contacts of one time step and integrates it.
    ///
    /// Collisions are taken in the [order](StepParameters::order) that the parameters ask for.
    /// Static bodies are left as they are. The bodies change only if the step succeeds, and then all
    /// at once.
    ///
    /// Units: metres, kilograms, seconds, radians, world frame.
    ///
    /// # Errors
    /// [`Error::Input`]: the input was refused and nothing was sent. [`Error::Step`]: a fault of
    /// the board; [`Error::may_retry`] and [`Error::must_reopen`] say what to do.
    /// [`Error::MustReopen`] after a fault that could not be cleared.
    pub fn step<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &mut B,
        collisions: &C,
        parameters: &StepParameters,
    ) -> Result<StepReport, Error> {
        if self.device.dead {
            return Err(Error::MustReopen);
        }
        let mut watch = Stopwatch(Instant::now());
        let mut host = HostTimes::default();
        validate(bodies, collisions, &self.shapes, parameters, &self.limits)?;
        host.validate = watch.lap();
        let Self { ordering, device, limits, shapes, .. } = self;
        let on = Hardware { capabilities: &device.capabilities, limits, shapes };
        let arranged = ordering.arrange(bodies, collisions, parameters, on)?;
        host.order = watch.lap();
        let counts = &self.device.counts;
        let before = (counts.reads(), counts.writes());
        let (mut report, retries) = with_retries(parameters.retries, || {
            self.attempt(bodies, collisions, &arranged, parameters, &mut host, &mut watch)
        })?;
        let Arranged { order, verified, live, .. } = arranged;
        (report.collisions, report.retries) = (collisions.len() as u64, retries);
        (report.order, report.verified, report.live) = (order, verified, live);
        for (index, (pose, velocity)) in self.spare.drain(..).enumerate() {
            bodies.commit(index, pose, velocity);
        }
        host.commit = watch.lap();
        report.host = host;
        report.register_reads = self.device.counts.reads() - before.0;
        report.register_writes = self.device.counts.writes() - before.1;
        log::debug!(
            "step: {} bodies, {} collisions and {} empty entries ({:?}), {} passes, {} cycles ({} \
             stalled, {} waiting), {} hazards",
            report.bodies,
            report.collisions,
            report.empty,
            report.order,
            report.passes,
            report.cycles.total,
            report.cycles.stalls,
            report.cycles.waits,
            report.hazards
        );
        Ok(report)
    }

    /// One attempt at a step whose collisions were put in order.
    fn attempt<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &B,
        collisions: &C,
        arranged: &Arranged,
        parameters: &StepParameters,
        host: &mut HostTimes,
        watch: &mut Stopwatch,
    ) -> Result<StepReport, Error> {
        if !arranged.scheduled {
            let ended = self.run(bodies, collisions, None, parameters, host, watch);
            return ended.map_err(|symptom| self.device.fail(symptom, &self.shapes));
        }
        // Lent to the step.
        let ordering = std::mem::take(&mut self.ordering);
        let ordered = Ordered { collisions, schedule: ordering.schedule() };
        let lives = arranged.live.map(|_| ordering.lives());
        let ended = self.run(bodies, &ordered, lives, parameters, host, watch);
        // Those that fill the last issue are of the order's making too.
        let entries = lives.map_or(ordered.len(), |lives| lives.words().len());
        let empty = entries.saturating_sub(ordering.schedule().collisions());
        let ended = ended.map_err(|symptom| {
            let mut error = self.device.fail(symptom, &self.shapes);
            locate(&mut error, ordering.schedule(), lives);
            error
        });
        self.ordering = ordering;
        ended.map(|report| StepReport { empty: empty as u64, ..report })
    }

    /// Everything between validation and commitment; the results are in `spare` afterwards.
    ///
    /// Collisions are sent in the order of their index.
    fn run<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        bodies: &B,
        collisions: &C,
        lives: Option<&Lives>,
        parameters: &StepParameters,
        host: &mut HostTimes,
        watch: &mut Stopwatch,
    ) -> Result<StepReport, Symptom> {
        let plan = &Plan {
            bodies: lives.map_or(bodies.len(), |lives| lives.velocities().len()),
            collisions: lives.map_or(collisions.len(), |lives| lives.words().len()),
            passes: u64::from(parameters.contact_iterations)
                + u64::from(parameters.friction_iterations),
            variant: self.limits.variant,
        };
        if plan.bodies == 0 {
            // Nothing moves, and nothing of it is streamed.
            self.unpack(plan, bodies, lives)?;
            let impulse_sum = self.device.capabilities.impulse_sum.then_some(0.0);
            let counters = Counters { impulse_sum, ..Counters::default() };
            return Ok(self.report(plan, bodies.len(), &counters));
        }
        self.device.reserve_or_reset(plan, &self.shapes)?;
        let sent = self.pack(plan, bodies, collisions, lives);
        host.pack = watch.lap();
        let limit = plan.deadline(parameters, &self.device.capabilities);
        let deadline = Deadline::after(&*self.device.platform, limit);
        let doorbells = self.device.start(plan, parameters)?;
        host.start = watch.lap();
        let interrupts = self.device.wait(plan, &deadline)?;
        let counters = self.device.collect(&deadline)?;
        self.device.take_back()?;
        host.wait = watch.lap();
        self.check_sums(plan, sent, &counters)?;
        self.unpack(plan, bodies, lives)?;
        host.unpack = watch.lap();

        let mut report = self.report(plan, bodies.len(), &counters);
        (report.doorbells, report.interrupts) = (doorbells, interrupts);
        report.descriptors = self.device.descriptors();
        Ok(report)
    }

    /// What a step of so many bodies streamed and counted.
    fn report(&self, plan: &Plan, bodies: usize, counters: &Counters) -> StepReport {
        let (work, waits) = (u64::from(counters.work), u64::from(counters.waits));
        let stalls = counters.cycles.saturating_sub(work).saturating_sub(waits);
        StepReport {
            bodies: bodies as u64,
            collisions: plan.collisions as u64,
            order: Order::AsGiven,
            empty: 0,
            verified: None,
            live: None,
            passes: u32::try_from(plan.passes).unwrap_or(u32::MAX),
            cycles: StepCycles { total: counters.cycles, work, stalls, waits },
            clock_khz: self.device.capabilities.clock_khz,
            bytes_to_device: plan.bytes_to_device(),
            bytes_from_device: plan.bytes_from_device(),
            hazards: u64::from(counters.hazards),
            impulse_sum: counters.impulse_sum,
            register_reads: 0,
            register_writes: 0,
            doorbells: 0,
            interrupts: 0,
            descriptors: 0,
            retries: 0,
            host: HostTimes::default(),
        }
    }

    /// Writes the records of a step into the buffers.
    pub(super) fn pack<B: Bodies + ?Sized, C: Collisions + ?Sized>(
        &mut self,
        plan: &Plan,
        bodies: &B,
        collisions: &C,
        lives: Option<&Lives>,
    ) -> Sent {
        let mut channels: [&mut [Beat]; DMA_COUNT_MAX] = Default::default();
        let lanes = &mut self.device.mm2s;
        // One borrow of each buffer, cut into its three segments.
        let mut later: [(&mut [Beat], &mut [Beat]); DMA_COUNT_MAX] = Default::default();
        for (place, lane) in lanes.iter_mut().enumerate() {
            let segments = plan.segments(place);
            let beats = &mut lane.beats_mut()[..segments.poses.end];
            let (beats, poses) = beats.split_at_mut(segments.poses.start);
            let (beats, collisions) = beats.split_at_mut(segments.collisions.start);
            channels[place] = &mut beats[segments.velocities];
            later[place] = (&mut collisions[..segments.collisions.len()], poses);
        }
        let (variant, count) = (&plan.variant, plan.bodies);
        let active = ..plan.channels();
        let views = &mut channels[active];
        let shapes = &self.shapes;
        let velocities = match lives.map(Lives::velocities) {
            Some(order) => {
                let chosen = Chosen { bodies, order };
                pack_velocities(variant, &chosen, count, shapes, views)
            }
            None => pack_velocities(variant, bodies, count, shapes, views),
        };
        let mut poses_of: [&mut [Beat]; DMA_COUNT_MAX] = Default::default();
        for (place, (collisions, poses)) in later.into_iter().enumerate() {
            channels[place] = collisions;
            poses_of[place] = poses;
        }
        let views = &mut channels[active];
        let collisions = match lives.map(Lives::words) {
            Some(words) => {
                pack_marked_collisions(variant, bodies, collisions, words, shapes, views)
            }
            None => pack_collisions(variant, bodies, collisions, plan.collisions, shapes, views),
        };
        let views = &mut poses_of[active];
        let poses = match lives.map(Lives::results) {
            Some(order) => pack_poses(variant, &Chosen { bodies, order }, count, views),
            None => pack_poses(variant, bodies, count, views),
        };
        Sent { velocities, collisions, poses }
    }

    /// The result beats of each channel.
    pub(super) fn results<'a>(&'a self, plan: &Plan, channels: &mut [&'a [Beat]; DMA_COUNT_MAX]) {
        for (place, lane) in self.device.s2mm.iter().enumerate() {
            channels[place] = &lane.beats()[..plan.results(place)];
        }
    }

    /// Compares the accelerator's sums of words with ours, if it has any.
    fn check_sums(&self, plan: &Plan, sent: Sent, counters: &Counters) -> Result<(), Fault> {
        let Some((received, answered)) = counters.sums else { return Ok(()) };
        #[allow(clippy::cast_possible_truncation, reason = "the sum is one modulo 2^32")]
        let rounds = plan.rounds() as u32;
        let expected = sent
            .velocities
            .wrapping_add(sent.collisions.wrapping_mul(rounds))
            .wrapping_add(sent.poses);
        if received != expected {
            let direction = Direction::Mm2s;
            return Err(Fault::Checksum { direction, expected, found: received });
        }
        let mut channels = Default::default();
        self.results(plan, &mut channels);
        let found = channels.iter().fold(0u32, |sum, beats| sum.wrapping_add(sum_of_words(beats)));
        if found != answered {
            let direction = Direction::S2mm;
            return Err(Fault::Checksum { direction, expected: answered, found });
        }
        Ok(())
    }

    /// Reads the results into the spare.
    fn unpack<B: Bodies + ?Sized>(
        &mut self,
        plan: &Plan,
        bodies: &B,
        lives: Option<&Lives>,
    ) -> Result<(), Fault> {
        let mut spare = std::mem::take(&mut self.spare);
        spare.clear();
        let mut channels = Default::default();
        self.results(plan, &mut channels);
        let layout = Segment::Results.layout(&plan.variant);
        let mut results = Results::new(&layout, &channels[..plan.channels()]);
        let broken = match lives {
            Some(lives) => scatter(&mut results, lives.results(), bodies, &mut spare),
            None => self.in_turn(&mut results, plan.bodies, bodies, &mut spare),
        };
        self.spare = spare;
        match broken {
            Some(body) => Err(Fault::NotFinite { body }),
            None => Ok(()),
        }
    }

    /// Reads the results of all bodies in their order; the first that is not finite.
    fn in_turn<B: Bodies + ?Sized>(
        &self,
        results: &mut Results<'_>,
        count: usize,
        bodies: &B,
        spare: &mut Vec<(Pose, Velocity)>,
    ) -> Option<usize> {
        spare.reserve(count);
        for index in 0..count {
            let (pose, velocity) = results.next();
            let own = bodies.body(index);
            let shape = usize::try_from(own.shape).ok().and_then(|shape| self.shapes.get(shape));
            if shape.is_none_or(|shape| shape.inverse_mass == 0.0) {
                // A static body does not move, whatever comes back for it.
                spare.push((own.pose, own.velocity));
                continue;
            }
            if !finite(&pose, &velocity) {
                return Some(index);
            }
            spare.push((pose, velocity));
        }
        None
    }
}

/// Reads results in the order of these bodies, and leaves all others as they are; the first body
/// that is not finite.
fn scatter<B: Bodies + ?Sized>(
    results: &mut Results<'_>,
    order: &[u32],
    bodies: &B,
    spare: &mut Vec<(Pose, Velocity)>,
) -> Option<usize> {
    spare.extend((0..bodies.len()).map(|index| {
        let own = bodies.body(index);
        (own.pose, own.velocity)
    }));
    let mut broken = None;
    for body in order {
        let (pose, velocity) = results.next();
        let index = *body as usize;
        if !finite(&pose, &velocity) {
            broken = Some(broken.map_or(index, |lowest: usize| lowest.min(index)));
        }
        // Should a caller's bodies have become fewer, there is nothing to be told of the others.
        if let Some(state) = spare.get_mut(index) {
            *state = (pose, velocity);
        }
    }
    broken
}

fn finite(pose: &Pose, velocity: &Velocity) -> bool {
    let all = |numbers: &[f32]| numbers.iter().all(|number| number.is_finite());
    all(&pose.position) && all(&pose.orientation) && all(&velocity.linear) && all(&velocity.angular)
}

/// Host time by laps.
#[derive(Debug)]
struct Stopwatch(Instant);

impl Stopwatch {
    /// Time since the last lap.
    fn lap(&mut self) -> Duration {
        let now = Instant::now();
        now - std::mem::replace(&mut self.0, now)
    }
}
