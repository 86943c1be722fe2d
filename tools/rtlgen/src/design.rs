//! One build of the accelerator: its parameters, and the schedules that follow from them.

use pgs_interface::fence::Fence;
use pgs_interface::profile::{Depth, FLOAT, HALF, Inertia, Profile, Variant};
use pgs_interface::record::CONTACT_POINTS;

use crate::equations;
use crate::graph::Graph;
use crate::schedule::Schedule;

/// The choices of a build.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parameters {
    /// The profile that the build is of.
    pub profile: &'static Profile,
    /// Bodies that the memories hold.
    pub bodies: u32,
    /// Collisions that the memories hold.
    pub collisions: u32,
    /// Whether a collision waits for the velocities that it needs; otherwise it reads stale ones,
    /// and HAZARDS counts.
    pub interlocked: bool,
    /// Collisions that wait in the issue queue; 0: none, collisions enter in the order of the
    /// stream.
    pub queue: u32,
    /// Registers in front of the velocities and the impulses.
    pub address_stages: u32,
    /// Registers behind the velocities and the impulses.
    pub output_stages: u32,
    /// Whether products and quotients round up to the smallest normal number, as the specification
    /// says (section 7). A build without that rule gives a zero in some of these places: it is off
    /// the specification.
    pub smallest_normal: bool,
    /// The form of the bodies' inertia. With world inertia the masses can be streamed: FEATURES bit
    /// 1.
    pub inertia: Inertia,
    /// The one address segment of every DMA master in the block design, which `FENCE_BASE` and
    /// `FENCE_SIZE` report.
    pub memory: Fence,
    /// Clock that `CLOCK_KHZ` reports, kHz.
    pub clock_khz: u32,
}

impl Default for Parameters {
    fn default() -> Self {
        Self::of(&FLOAT, Inertia::Isotropic)
    }
}

impl Parameters {
    /// The default choices of `float` with that form of inertia.
    #[must_use]
    pub fn with(inertia: Inertia) -> Self {
        Self::of(&FLOAT, inertia)
    }

    /// The default choices of a profile with that form of inertia. World inertia takes more than
    /// twice the memory a body.
    #[must_use]
    pub fn of(profile: &'static Profile, inertia: Inertia) -> Self {
        let (bodies, collisions) = match inertia {
            Inertia::Isotropic => (40_960, 131_072),
            Inertia::World => (16_384, 65_536),
        };
        Self {
            profile,
            bodies,
            collisions,
            inertia,
            interlocked: true,
            queue: profile.queue.unwrap_or(0),
            address_stages: 2,
            output_stages: 3,
            smallest_normal: true,
            memory: Fence::default(),
            clock_khz: profile.clock_khz,
        }
    }
}

/// A build that the hardware cannot be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum BuildError {
    /// A collision would take the velocities of the one before it.
    #[error(
        "{address_stages} registers in front of the memories and {output_stages} behind them give \
         a read latency of {latency} cycles, expected a multiple of {interval}: a port reads in \
         one cycle of a slot and writes in the others; add registers on either side"
    )]
    ReadLatency {
        /// Registers in front of the memories.
        address_stages: u32,
        /// Registers behind them.
        output_stages: u32,
        /// Cycles from an address to the word.
        latency: u32,
        /// Cycles of a slot.
        interval: u32,
    },
    /// A queue waits for hazards to be over, and an unchecked build does not know of them.
    #[error(
        "an issue queue of {queue} collisions in an unchecked build, expected none: take an \
         interlocked one, or a queue of 0"
    )]
    UncheckedQueue {
        /// The requested depth.
        queue: u32,
    },
    /// More bodies than an index of the profile's words can name.
    #[error("{bodies} bodies, expected at most {most}")]
    Bodies {
        /// The requested number.
        bodies: u32,
        /// The largest number.
        most: u32,
    },
    /// Collisions leave a queue one by one.
    #[error("an issue queue of {queue} collisions in profile {profile}, expected none")]
    NoQueue {
        /// The requested depth.
        queue: u32,
        /// The name of the profile.
        profile: &'static str,
    },
    /// The profile is not built with that form of inertia.
    #[error("profile {profile} with world inertia, expected isotropic inertia")]
    NoInertia {
        /// The name of the profile.
        profile: &'static str,
    },
}

impl Parameters {
    /// The variant of the profile that the build is.
    #[must_use]
    pub fn variant(&self) -> Variant {
        Variant { inertia: self.inertia, ..self.profile.default_variant() }
    }

    /// Refuses parameters that contradict the hand-written modules.
    ///
    /// # Errors
    ///
    /// Every [`BuildError`].
    pub fn check(&self) -> Result<(), BuildError> {
        let latency = self.read_latency();
        let Self { profile, address_stages, output_stages, queue, .. } = *self;
        let interval = profile.initiation_interval;
        if !latency.is_multiple_of(interval) {
            let wrong =
                BuildError::ReadLatency { address_stages, output_stages, latency, interval };
            return Err(wrong);
        }
        if !profile.inertias().contains(&self.inertia) {
            return Err(BuildError::NoInertia { profile: profile.name });
        }
        let most = self.variant().body_capacity();
        if self.bodies > most {
            return Err(BuildError::Bodies { bodies: self.bodies, most });
        }
        if queue > 0 && !profile.has_queue() {
            return Err(BuildError::NoQueue { queue, profile: profile.name });
        }
        if queue > 0 && !self.interlocked {
            return Err(BuildError::UncheckedQueue { queue });
        }
        Ok(())
    }

    /// Cycles from an address to the velocity or the impulses.
    #[must_use]
    pub fn read_latency(&self) -> u32 {
        self.address_stages + 1 + self.output_stages
    }
}

/// A pipeline: its equations and their schedule.
#[derive(Debug)]
pub struct Pipeline {
    /// Its name, which is also the prefix of its values in the Verilog.
    pub name: &'static str,
    /// The equations.
    pub graph: Graph,
    /// Their schedule.
    pub schedule: Schedule,
}

impl Pipeline {
    fn new(name: &'static str, graph: Graph, interval: u32) -> Self {
        let schedule = Schedule::new(&graph, interval);
        Self { name, graph, schedule }
    }
}

/// A build of a profile.
#[derive(Debug)]
pub struct Design {
    /// The choices.
    pub parameters: Parameters,
    /// Contact passes, a collision every initiation interval of the profile. Where two collisions
    /// issue together, each has a pipeline of its own.
    pub contact: Pipeline,
    /// Friction passes, likewise.
    pub friction: Pipeline,
    /// Integration, a body a cycle: in `float` as fast as the streams take results, in `half`, where
    /// they take five bodies in four cycles, one of two.
    pub integration: Pipeline,
}

/// Cycles of the control around the pipelines.
struct Around {
    /// Between the issue of a collision and cycle 0 of its pipeline, and between the results and
    /// the first issue that sees them: record registers, write registers.
    pass: u32,
    /// The cycles of a step in which nothing is loaded, passed or integrated, beside the way of the
    /// last body through the integration.
    step: u32,
}

/// Around a step: set-up in front of the first pass (10), the end of the load (2), the entry into
/// the integration (1), the result FIFOs and their end (5), the sums and the end (3).
const AROUND_FLOAT: Around = Around { pass: 8, step: 21 };
const AROUND_HALF: Around = Around { pass: 9, step: 29 };

impl Parameters {
    fn around(&self) -> &'static Around {
        if self.profile.id == HALF.id { &AROUND_HALF } else { &AROUND_FLOAT }
    }
}

impl Design {
    /// Schedules the three pipelines.
    #[must_use]
    pub fn new(parameters: Parameters) -> Self {
        let interval = parameters.profile.initiation_interval;
        let precision = parameters.profile.numbers.updates;
        let contact = equations::contact(precision, CONTACT_POINTS, parameters.inertia);
        let friction = equations::friction(precision, parameters.inertia);
        Self {
            parameters,
            contact: Pipeline::new("contact", contact, interval),
            friction: Pipeline::new("friction", friction, interval),
            integration: Pipeline::new("integration", equations::integration(precision), 1),
        }
    }

    /// The three pipelines.
    #[must_use]
    pub fn pipelines(&self) -> [&Pipeline; 3] {
        [&self.contact, &self.friction, &self.integration]
    }

    /// Fill and hazard window of a pipeline, if it is one of the passes.
    #[must_use]
    pub fn pass_depth(&self, pipeline: &Pipeline) -> Option<Depth> {
        (pipeline.schedule.velocities_at > 0).then(|| self.depth(pipeline))
    }

    /// Fill and hazard window of a pass, as the capability registers report them.
    ///
    /// The window is the time from the read of the velocities to the first read that sees the
    /// write-back: from the address, a read latency before the velocities are there, to the write,
    /// which passes the same address registers, one interval after the results.
    #[must_use]
    pub fn depth(&self, pass: &Pipeline) -> Depth {
        let schedule = &pass.schedule;
        let after_velocities = unsigned(schedule.depth - schedule.velocities_at);
        Depth {
            fill: unsigned(schedule.depth) + self.parameters.around().pass,
            window: after_velocities + self.parameters.read_latency() + unsigned(schedule.interval),
        }
    }
}

impl Design {
    /// The hazard window of a step through the queue, in slots of issue: the longer one, rounded
    /// up.
    #[must_use]
    pub fn window_slots(&self) -> u32 {
        let windows = [&self.contact, &self.friction].map(|pass| self.depth(pass).window);
        windows[0].max(windows[1]).div_ceil(self.parameters.profile.initiation_interval)
    }

    /// Cycles that every step takes beside load, passes and one cycle a body: the way of the last
    /// body through the integration, and the control around the step.
    #[must_use]
    pub fn step_fill(&self) -> u32 {
        unsigned(self.integration.schedule.depth)
            + self.parameters.read_latency()
            + self.parameters.around().step
    }
}

/// A cycle of a schedule, which is never negative.
fn unsigned(cycle: i32) -> u32 {
    u32::try_from(cycle).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::{Kind, Operation, Source};
    use pgs_interface::number::Precision;

    const FORMS: [Inertia; 2] = [Inertia::Isotropic, Inertia::World];

    /// The table entry of the profile holds the figures of these schedules.
    #[test]
    fn the_profile_has_the_depths_of_the_schedule() {
        let builds = [(&FLOAT, FORMS[0]), (&FLOAT, FORMS[1]), (&HALF, FORMS[0])];
        for (profile, inertia) in builds {
            let parameters = Parameters::of(profile, inertia);
            let (design, variant) = (Design::new(parameters), parameters.variant());
            assert_eq!(design.depth(&design.contact), variant.contact(), "{inertia:?}");
            assert_eq!(design.depth(&design.friction), variant.friction(), "{inertia:?}");
            assert_eq!(design.step_fill(), profile.integration_fill, "{}", profile.name);
        }
    }

    #[test]
    fn a_read_latency_that_ends_in_the_wrong_cycle_of_a_slot_is_refused() {
        let with = |address_stages, output_stages| Parameters {
            address_stages,
            output_stages,
            ..Parameters::default()
        };
        assert_eq!(Parameters::default().check(), Ok(()));
        assert_eq!(with(3, 4).check(), Ok(()));
        let error = with(3, 3).check().expect_err("a latency of 7");
        assert!(error.to_string().contains("a read latency of 7 cycles"), "{error}");
    }

    #[test]
    fn a_queue_in_an_unchecked_build_is_refused() {
        let with = |queue, interlocked| Parameters { queue, interlocked, ..Parameters::default() };
        assert_eq!(with(0, false).check(), Ok(()));
        assert_eq!(with(64, true).check(), Ok(()));
        assert_eq!(with(64, false).check(), Err(BuildError::UncheckedQueue { queue: 64 }));
    }

    /// The queue counts slots in eight bits.
    #[test]
    fn the_window_of_a_queue_fits_its_count_of_slots() {
        assert_eq!(Design::new(Parameters::default()).window_slots(), 162);
        for inertia in FORMS {
            let parameters =
                Parameters { address_stages: 4, output_stages: 5, ..Parameters::with(inertia) };
            assert!(Design::new(parameters).window_slots() <= u8::MAX.into());
        }
    }

    /// Nothing waits for the given impulses of a warm pass either: they pass the address registers
    /// of the memory before a read of them does.
    #[test]
    fn the_given_impulses_are_written_before_a_pipeline_reads_them() {
        // The second cycle of the slot, and the register in front of the memory.
        let written = 1 + 1;
        for inertia in FORMS {
            let parameters =
                Parameters { address_stages: 4, output_stages: 5, ..Parameters::with(inertia) };
            assert_eq!(parameters.check(), Ok(()));
            let design = Design::new(parameters);
            for pass in [&design.contact, &design.friction] {
                let read = unsigned(pass.schedule.impulses_at) - parameters.read_latency();
                assert!(read > written, "{} with {inertia:?}: read at {read}", pass.name);
            }
        }
    }

    /// The product with a matrix lies in front of the velocities.
    #[test]
    fn world_inertia_makes_no_window_longer() {
        let [isotropic, world] = FORMS.map(|inertia| {
            let design = Design::new(Parameters::with(inertia));
            [&design.contact, &design.friction].map(|pass| design.depth(pass))
        });
        for (isotropic, world) in isotropic.into_iter().zip(world) {
            assert_eq!((world.window, world.fill), (isotropic.window, isotropic.fill + 14));
        }
    }

    /// Nothing waits for the numbers that `step/constants.v` computes while bodies load.
    #[test]
    fn the_constants_of_a_step_are_there_before_a_pipeline_reads_one() {
        // The second quotient, with registers before and behind the divider, and two products of it.
        let latency = |operation: Operation| operation.operator(Precision::F32).latency;
        let quotient = latency(Operation::Divide) + 4;
        let half_angle_limit = quotient + 2 * (latency(Operation::Multiply) + 1);
        // One body or pair of them, the set-up, and the registers in front of a pipeline.
        let at_least = 1 + 10 + 2;
        let given = ["time_step", "drift", "coefficient", "friction", "damping"];
        let designs = FORMS.map(|inertia| Design::new(Parameters::with(inertia)));
        let mut computed = 0;
        for Pipeline { graph, schedule, .. } in designs.iter().flat_map(Design::pipelines) {
            for id in graph.ids() {
                for read in graph.node(id).reads() {
                    let node = graph.node(read);
                    let argument = node.kind == Kind::Input(Source::Argument);
                    if argument && !given.contains(&node.name.as_str()) {
                        let at = at_least + schedule.starts[id.index()];
                        let last = node.name == "half_angle_limit";
                        let ready = if last { half_angle_limit } else { quotient };
                        assert!(at >= ready, "{} is read at {at}, there at {ready}", node.name);
                        computed += 1;
                    }
                }
            }
        }
        assert!(
            computed >= 2 * 8,
            "per_second, speed_limit, half_angle_limit, half_step, series and gravity are read"
        );
    }
}
