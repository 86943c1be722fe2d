//! Registers of the control block, and the effects of reads and writes.

use crate::cast::{high, low, register};
use crate::config::{BoardConfig, Hazards};
use pgs_interface::control::{
    ANGULAR_DAMPING, AP_CTRL, BODIES, BODY_CAPACITY, CHANNELS, CLOCK_KHZ, COLLISION_CAPACITY,
    COLLISIONS, CONTACT_DEPTH, CONTACT_ITERATIONS, COUNTER_MAX, CYCLES_HI, CYCLES_LO, DMA, ERROR,
    ERROR_DETAIL, ErrorCode, FEATURES, FENCE_BASE, FENCE_SIZE, FLAGS, FRICTION, FRICTION_DEPTH,
    FRICTION_ITERATIONS, GIE, GRAVITY_X, GRAVITY_Y, GRAVITY_Z, HAZARDS, IDENTIFICATION, IER,
    IMPULSE_SUM_HI, IMPULSE_SUM_LO, IMPULSE_SUM_MAX, ISR, ISSUE, MEMORY_BYTES, MEMORY_PER_RECORD,
    MM2S_WIDTHS, NUMBERS, POSITION_COEFFICIENT, POSITION_DRIFT, PROFILE, QUEUE, RESET, S2MM_WIDTHS,
    SHAPE_CAPACITY, SHAPE_INVERSE_INERTIA, SHAPE_INVERSE_MASS, SHAPE_STRIDE, SHAPE_TABLE,
    SPIN_DAMPING, SUM_RECEIVED, SUM_SENT, TIME_STEP, VERSION, WAIT_CYCLES, WORK_CYCLES, ap_ctrl,
    channels, depth, dma, error, features, flags, irq, issue, memory_per_record, numbers,
};
use pgs_interface::fence::Fence;
use pgs_interface::number::Numbers;
use pgs_interface::profile::{Depth, Inertia, Variant};

use super::integrate::Integration;
use super::solver::SolverParameters;

/// The bits of IER and ISR.
const CAUSES: u32 = irq::DONE.mask() | irq::READY.mask() | irq::ERROR.mask();

/// A counter of 32 bits, which saturates.
fn counter(count: u64) -> u32 {
    register(count.min(COUNTER_MAX.into()))
}

// The sum of the impulses has 64 bits and stops at the largest number.
const _: () = assert!(IMPULSE_SUM_MAX == u64::MAX);

/// The NUMBERS register.
fn formats(of: &Numbers) -> u32 {
    let word = numbers::COLLISIONS.put(0, of.collisions as u32);
    let word = numbers::BODIES.put(word, of.bodies as u32);
    let word = numbers::ROWS.put(word, of.rows as u32);
    let word = numbers::UPDATES.put(word, of.updates as u32);
    let word = numbers::VELOCITIES.put(word, of.velocities as u32);
    let word = numbers::POSES.put(word, of.poses as u32);
    numbers::IMPULSES.put(word, of.impulses as u32)
}

/// An entry of the shape table.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Shape {
    pub(crate) inverse_mass: f32,
    /// Isotropic; unused with world inertia.
    pub(crate) inverse_inertia: f32,
}

/// The accelerator's counters of a step.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Counters {
    pub(super) cycles: u64,
    pub(crate) stalls: u64,
    pub(crate) waits: u64,
    pub(crate) hazards: u64,
    pub(crate) sum_received: u32,
    pub(crate) sum_sent: u32,
    pub(crate) impulse_sum: u64,
}

/// The arguments of a step, latched at its start.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Arguments {
    pub(super) bodies: u32,
    pub(crate) collisions: u32,
    pub(crate) contact_iterations: u32,
    pub(super) friction_iterations: u32,
    pub(crate) integrate: bool,
    /// Whether bodies of inverse mass 0 have the velocity of their record.
    pub(crate) kinematic: bool,
    /// Whether each body brings its inverse mass, in place of its shape's.
    pub(crate) streamed_masses: bool,
    /// Whether impulses come in with the collisions, in a pass in front of the others of each kind.
    pub(crate) warm_start: bool,
    /// Whether the impulses go out in front of the results.
    pub(crate) impulses_out: bool,
    /// Whether the step passes by the issue queue.
    pub(crate) in_order: bool,
    pub(crate) solver: SolverParameters,
    pub(crate) integration: Integration,
}

impl Arguments {
    /// Passes of one kind that iterates that often.
    fn passes_of(&self, iterations: u32) -> u32 {
        iterations.saturating_add(u32::from(self.warm_start && iterations > 0))
    }

    /// Contact passes, with the warm one.
    pub(crate) fn contact_passes(&self) -> u32 {
        self.passes_of(self.contact_iterations)
    }

    /// All passes of the step; without collisions there is none.
    pub(crate) fn passes(&self) -> u32 {
        match self.collisions {
            0 => 0,
            _ => self.contact_passes().saturating_add(self.passes_of(self.friction_iterations)),
        }
    }

    /// Whether impulses come in with the collisions of a pass.
    pub(crate) fn is_warm(&self, pass: u32) -> bool {
        self.warm_start && (pass == 0 || pass == self.contact_passes())
    }

    /// Whether the impulses after a pass go out.
    pub(crate) fn sends_impulses(&self, pass: u32) -> bool {
        self.impulses_out && (pass + 1 == self.contact_passes() || pass + 1 == self.passes())
    }
}

/// Writable words between AP_CTRL and the capabilities.
const ARGUMENT_WORDS: usize = 32;

/// The action that a register write starts in the accelerator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Request {
    None,
    Start,
    Reset,
}

/// The register file.
#[derive(Debug)]
pub(super) struct Registers {
    variant: Variant,
    arguments: [u32; ARGUMENT_WORDS],
    gie: bool,
    ier: u32,
    isr: u32,
    done: bool,
    ready: bool,
    pub(super) error: u32,
    pub(super) error_detail: u32,
    shapes: Vec<Shape>,
    pub(super) counters: Counters,
}

/// Offsets of the arguments. `Registers::arguments` holds each at a quarter of its offset.
const ARGUMENTS: [u32; 14] = [
    BODIES.offset,
    COLLISIONS.offset,
    CONTACT_ITERATIONS.offset,
    FRICTION_ITERATIONS.offset,
    FLAGS.offset,
    TIME_STEP.offset,
    POSITION_DRIFT.offset,
    POSITION_COEFFICIENT.offset,
    FRICTION.offset,
    ANGULAR_DAMPING.offset,
    GRAVITY_X.offset,
    GRAVITY_Y.offset,
    GRAVITY_Z.offset,
    SPIN_DAMPING.offset,
];

const _: () = assert!(SPIN_DAMPING.offset as usize / 4 < ARGUMENT_WORDS);

/// The arguments after a reset.
const ARGUMENTS_AT_RESET: [u32; ARGUMENT_WORDS] = {
    let mut words = [0; ARGUMENT_WORDS];
    words[SPIN_DAMPING.offset as usize / 4] = SPIN_DAMPING.reset;
    words
};

impl Registers {
    pub(super) fn new(config: &BoardConfig) -> Self {
        Self {
            variant: config.variant(),
            arguments: ARGUMENTS_AT_RESET,
            gie: false,
            ier: 0,
            isr: 0,
            done: false,
            ready: false,
            error: 0,
            error_detail: 0,
            shapes: vec![Shape::default(); config.profile.shape_capacity as usize],
            counters: Counters::default(),
        }
    }

    /// Resets all registers but the counters of the last step, which stay readable.
    pub(super) fn reset(&mut self) {
        self.arguments = ARGUMENTS_AT_RESET;
        self.gie = false;
        self.ier = 0;
        self.isr = 0;
        self.done = false;
        self.ready = false;
        self.error = 0;
        self.error_detail = 0;
        self.shapes.fill(Shape::default());
    }

    fn argument(&self, offset: u32) -> u32 {
        self.arguments[offset as usize / 4]
    }

    fn number(&self, offset: u32) -> f32 {
        f32::from_bits(self.argument(offset))
    }

    pub(super) fn arguments(&self) -> Arguments {
        let time_step = self.number(TIME_STEP.offset);
        let set = self.argument(FLAGS.offset);
        let variant = &self.variant;
        Arguments {
            bodies: self.argument(BODIES.offset),
            collisions: self.argument(COLLISIONS.offset),
            contact_iterations: self.argument(CONTACT_ITERATIONS.offset),
            friction_iterations: self.argument(FRICTION_ITERATIONS.offset),
            integrate: flags::INTEGRATE.is_set(set),
            kinematic: flags::KINEMATIC.is_set(set),
            streamed_masses: variant.has_streamed_masses() && flags::STREAMED_MASSES.is_set(set),
            warm_start: flags::WARM_START.is_set(set),
            impulses_out: flags::IMPULSES_OUT.is_set(set),
            in_order: flags::IN_ORDER.is_set(set),
            solver: SolverParameters {
                time_step,
                drift: self.number(POSITION_DRIFT.offset),
                coefficient: self.number(POSITION_COEFFICIENT.offset),
                friction: self.number(FRICTION.offset),
                spin_damping: self.number(SPIN_DAMPING.offset),
                pair_friction: variant.has_pair_friction() && flags::PAIR_FRICTION.is_set(set),
            },
            integration: Integration {
                time_step,
                angular_damping: self.number(ANGULAR_DAMPING.offset),
                gravity: [GRAVITY_X, GRAVITY_Y, GRAVITY_Z]
                    .map(|argument| self.number(argument.offset)),
            },
        }
    }

    pub(super) fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// A step has ended.
    pub(super) fn finish(&mut self) {
        self.done = true;
        self.ready = true;
        self.raise(irq::DONE.mask() | irq::READY.mask());
    }

    /// Sets the sticky error; the first one stays.
    pub(super) fn fail(&mut self, code: ErrorCode, channel: usize, detail: u32) {
        if self.error == 0 {
            self.error = error::CHANNEL.put(code as u32, register(channel));
            self.error_detail = detail;
        }
        self.raise(irq::ERROR.mask());
    }

    fn raise(&mut self, bits: u32) {
        self.isr |= bits & self.ier;
    }

    pub(super) fn interrupt(&self) -> bool {
        self.gie && self.isr != 0
    }

    fn control(&mut self, busy: bool) -> u32 {
        let mut value = 0;
        value = ap_ctrl::START.put(value, u32::from(busy));
        value = ap_ctrl::DONE.put(value, u32::from(self.done));
        value = ap_ctrl::IDLE.put(value, u32::from(!busy));
        value = ap_ctrl::READY.put(value, u32::from(self.ready));
        self.done = false;
        self.ready = false;
        value
    }

    pub(super) fn read(
        &mut self,
        config: &BoardConfig,
        offset: u32,
        busy: bool,
        resetting: bool,
    ) -> Option<u32> {
        let profile = config.profile;
        let widths = |streams: &[u32]| {
            streams
                .iter()
                .enumerate()
                .fold(0, |value, (k, bits)| value | ((bits / 8).ilog2() << (4 * register(k))))
        };
        let pipeline = |kind: Depth| {
            let built = config.depth(kind);
            depth::WINDOW.put(depth::FILL.put(0, built.fill), built.window)
        };
        let counters = &self.counters;
        let memory = profile.memory;
        let variant = config.variant();
        if let Some((index, at)) = self.shape_at(offset) {
            let shape = self.shapes[index];
            return Some(match at {
                SHAPE_INVERSE_MASS => shape.inverse_mass.to_bits(),
                SHAPE_INVERSE_INERTIA => shape.inverse_inertia.to_bits(),
                _ => 0,
            });
        }
        Some(match offset {
            _ if offset == AP_CTRL.offset => self.control(busy),
            _ if offset == GIE.offset => u32::from(self.gie),
            _ if offset == IER.offset => self.ier,
            _ if offset == ISR.offset => self.isr,
            _ if ARGUMENTS.contains(&offset) => self.argument(offset),
            _ if offset == IDENTIFICATION.offset => config.quirks.identification,
            _ if offset == VERSION.offset => config.quirks.version,
            _ if offset == PROFILE.offset => profile.id,
            _ if offset == FEATURES.offset => {
                features::INTERLOCKED.put(0, u32::from(config.hazards == Hazards::Interlocked))
                    | features::WORLD_INERTIA.put(0, u32::from(config.inertia == Inertia::World))
            }
            _ if offset == CHANNELS.offset => {
                let mm2s = register(profile.mm2s_widths.len());
                let s2mm = register(profile.s2mm_widths.len());
                channels::S2MM.put(channels::MM2S.put(0, mm2s), s2mm)
            }
            _ if offset == MM2S_WIDTHS.offset => widths(profile.mm2s_widths),
            _ if offset == S2MM_WIDTHS.offset => widths(profile.s2mm_widths),
            _ if offset == ISSUE.offset => issue::COLLISIONS.put(
                issue::INTERVAL.put(0, profile.initiation_interval),
                profile.collisions_per_issue,
            ),
            _ if offset == CONTACT_DEPTH.offset => pipeline(variant.contact()),
            _ if offset == FRICTION_DEPTH.offset => pipeline(variant.friction()),
            _ if offset == CLOCK_KHZ.offset => profile.clock_khz,
            _ if offset == BODY_CAPACITY.offset => variant.body_capacity(),
            _ if offset == COLLISION_CAPACITY.offset => {
                memory.bytes / variant.bytes_per_collision()
            }
            _ if offset == SHAPE_CAPACITY.offset => profile.shape_capacity,
            _ if offset == MEMORY_BYTES.offset => memory.bytes,
            _ if offset == MEMORY_PER_RECORD.offset => memory_per_record::COLLISION.put(
                memory_per_record::BODY.put(0, variant.bytes_per_body()),
                variant.bytes_per_collision(),
            ),
            _ if offset == DMA.offset => dma::ADDRESS_WIDTH
                .put(dma::LENGTH_WIDTH.put(0, config.length_width), config.address_width),
            _ if offset == NUMBERS.offset => formats(&variant.numbers),
            _ if offset == QUEUE.offset => config.quirks.queue.unwrap_or(config.queue_depth()),
            _ if offset == FENCE_BASE.offset => Fence::to_registers(config.fence)[0],
            _ if offset == FENCE_SIZE.offset => Fence::to_registers(config.fence)[1],
            _ if offset == ERROR.offset => self.error,
            _ if offset == ERROR_DETAIL.offset => self.error_detail,
            _ if offset == CYCLES_LO.offset => low(counters.cycles),
            _ if offset == CYCLES_HI.offset => high(counters.cycles),
            _ if offset == WORK_CYCLES.offset => {
                // A step that ends in an error may have counted a whole stall before its end.
                counter(counters.cycles.saturating_sub(counters.stalls + counters.waits))
            }
            _ if offset == WAIT_CYCLES.offset => counter(counters.waits),
            _ if offset == HAZARDS.offset => counter(counters.hazards),
            _ if offset == SUM_RECEIVED.offset => counters.sum_received,
            _ if offset == SUM_SENT.offset => counters.sum_sent,
            _ if offset == IMPULSE_SUM_LO.offset => low(counters.impulse_sum),
            _ if offset == IMPULSE_SUM_HI.offset => high(counters.impulse_sum),
            _ if offset == RESET.offset => u32::from(resetting),
            _ => return None,
        })
    }

    /// The shape and the offset in its entry, if `offset` lies in the table.
    fn shape_at(&self, offset: u32) -> Option<(usize, u32)> {
        let at = offset.checked_sub(SHAPE_TABLE)?;
        let index = (at / SHAPE_STRIDE) as usize;
        (index < self.shapes.len()).then_some((index, at % SHAPE_STRIDE))
    }

    /// Whether a write to this register is an error while a step runs.
    pub(super) fn is_argument(&self, offset: u32) -> bool {
        ARGUMENTS.contains(&offset) || self.shape_at(offset).is_some()
    }

    /// Writes a register; `None` if no register has this offset.
    pub(super) fn write(&mut self, offset: u32, value: u32) -> Option<Request> {
        if let Some((index, at)) = self.shape_at(offset) {
            let (shape, number) = (&mut self.shapes[index], f32::from_bits(value));
            match at {
                SHAPE_INVERSE_MASS => shape.inverse_mass = number,
                SHAPE_INVERSE_INERTIA => shape.inverse_inertia = number,
                _ => {}
            }
            return Some(Request::None);
        }
        match offset {
            _ if offset == AP_CTRL.offset && ap_ctrl::START.is_set(value) => {
                return Some(Request::Start);
            }
            _ if offset == AP_CTRL.offset => {}
            _ if offset == GIE.offset => self.gie = value & 1 != 0,
            _ if offset == IER.offset => self.ier = value & CAUSES,
            _ if offset == ISR.offset => self.isr ^= value & CAUSES,
            _ if ARGUMENTS.contains(&offset) => self.arguments[offset as usize / 4] = value,
            _ if offset == RESET.offset && value & 1 != 0 => return Some(Request::Reset),
            _ => {
                // The rest is read-only or does not exist.
                return pgs_interface::control::REGISTERS
                    .iter()
                    .any(|register| register.offset == offset)
                    .then_some(Request::None);
            }
        }
        Some(Request::None)
    }
}
