//! The outcome of a step on an accelerator: results and counters.

use bitstream_model::external::{
    ExternalAccelerator, ExternalError, Offer, StreamBeat, same_number,
};
use half::f16;
use pgs_interface::control::{
    self, ANGULAR_DAMPING, AP_CTRL, BODIES, COLLISIONS, CONTACT_ITERATIONS, CYCLES_LO, ERROR,
    ERROR_DETAIL, FLAGS, FRICTION, FRICTION_ITERATIONS, GRAVITY_X, GRAVITY_Y, GRAVITY_Z, HAZARDS,
    IMPULSE_SUM_HI, IMPULSE_SUM_LO, POSITION_COEFFICIENT, POSITION_DRIFT, QUEUE, RESET,
    SHAPE_STRIDE, SHAPE_TABLE, SPIN_DAMPING, SUM_RECEIVED, SUM_SENT, TIME_STEP, WAIT_CYCLES,
    WORK_CYCLES, ap_ctrl, flags,
};
use pgs_interface::number::StreamFormat;
use pgs_interface::register::Register;

use crate::packets::{Beats, STREAMS};
use crate::scene::{Arguments, Scene};

/// Clocks between two exchanges of beats.
const BATCH: u32 = 64;
/// Beats of each stream that are offered at once.
const OFFERED: usize = 128;
/// Beats that each stream takes in an exchange.
pub(crate) const SPACE: usize = 256;
/// Clocks after which a step that has not ended is given up.
const CLOCKS_MAX: u64 = 400_000_000;

/// Results, error and counters of a step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outcome {
    /// The beats of each result stream.
    pub results: [Vec<StreamBeat>; STREAMS],
    /// The format of their words.
    pub format: StreamFormat,
    /// Beats of impulses and numbers that stream 0 has in front of its results.
    pub impulse_beats: usize,
    /// ERROR and `ERROR_DETAIL`.
    pub error: [u32; 2],
    /// Whether the step ended at all.
    pub ended: bool,
    /// Cycles by the formula.
    pub work: u32,
    /// The cycles of waiting for a stream.
    pub waits: u32,
    /// All cycles, bits 31:0.
    pub cycles: u32,
    /// Collisions that met a hazard.
    pub hazards: u32,
    /// Sums of the words received and sent.
    pub sums: [u32; 2],
    /// Sum of the impulses, 2^-20 N s.
    pub impulses: u64,
}

impl Outcome {
    /// Cycles of the interlock.
    #[must_use]
    pub fn stalls(&self) -> u32 {
        self.cycles.wrapping_sub(self.work).wrapping_sub(self.waits)
    }
}

/// Runs a step on an accelerator, which is reset first.
///
/// # Errors
/// The accelerator does not answer.
pub fn run(
    accelerator: &mut dyn ExternalAccelerator,
    scene: &Scene,
    beats: &Beats,
) -> Result<Outcome, ExternalError> {
    run_with(accelerator, scene, beats, &[])
}

/// Runs a step, with these values in these registers instead of the scene's.
///
/// # Errors
/// The accelerator does not answer.
pub fn run_with(
    accelerator: &mut dyn ExternalAccelerator,
    scene: &Scene,
    beats: &Beats,
    registers: &[(Register, u32)],
) -> Result<Outcome, ExternalError> {
    reset(accelerator)?;
    set_up(accelerator, scene)?;
    for (register, value) in registers {
        accelerator.write(register.offset, *value)?;
    }
    accelerator.write(AP_CTRL.offset, ap_ctrl::START.mask())?;
    finish(accelerator, scene, Feed::new(beats))
}

/// Lets a step that has started end.
pub(crate) fn finish(
    accelerator: &mut dyn ExternalAccelerator,
    scene: &Scene,
    mut feed: Feed<'_>,
) -> Result<Outcome, ExternalError> {
    while feed.busy && feed.clocks < CLOCKS_MAX {
        feed.exchange(accelerator)?;
    }
    let Feed { results, busy, .. } = feed;
    let mut read = |offset: u32| accelerator.read(offset);
    Ok(Outcome {
        results,
        format: scene.variant.numbers.poses,
        impulse_beats: scene.impulse_beats(read(QUEUE.offset)? != 0),
        error: [read(ERROR.offset)?, read(ERROR_DETAIL.offset)?],
        ended: !busy,
        work: read(WORK_CYCLES.offset)?,
        waits: read(WAIT_CYCLES.offset)?,
        cycles: read(CYCLES_LO.offset)?,
        hazards: read(HAZARDS.offset)?,
        sums: [read(SUM_RECEIVED.offset)?, read(SUM_SENT.offset)?],
        impulses: u64::from(read(IMPULSE_SUM_HI.offset)?) << 32
            | u64::from(read(IMPULSE_SUM_LO.offset)?),
    })
}

/// The beats of a step on their way, and the results that have come.
#[derive(Debug)]
pub(crate) struct Feed<'a> {
    beats: &'a Beats,
    at: [usize; STREAMS],
    results: [Vec<StreamBeat>; STREAMS],
    /// Beats that each stream takes in an exchange.
    pub(crate) space: usize,
    /// Clocks since the start.
    pub(crate) clocks: u64,
    /// Whether the step is under way.
    pub(crate) busy: bool,
    /// The level of the interrupt.
    pub(crate) interrupt: bool,
}

impl<'a> Feed<'a> {
    pub(crate) fn new(beats: &'a Beats) -> Self {
        let results = Default::default();
        let space = SPACE;
        Self { beats, at: [0; STREAMS], results, space, clocks: 0, busy: true, interrupt: false }
    }

    /// Exchanges beats with the accelerator once.
    pub(crate) fn exchange(
        &mut self,
        accelerator: &mut dyn ExternalAccelerator,
    ) -> Result<(), ExternalError> {
        let offered = |stream: usize| {
            let beats = &self.beats[stream][self.at[stream]..];
            beats[..beats.len().min(OFFERED)].to_vec()
        };
        let offer =
            Offer { beats: (0..STREAMS).map(offered).collect(), space: vec![self.space; STREAMS] };
        let clocked = accelerator.run(BATCH, &offer)?;
        for (at, taken) in self.at.iter_mut().zip(&clocked.taken) {
            *at += taken;
        }
        for (results, sent) in self.results.iter_mut().zip(clocked.sent) {
            results.extend(sent);
        }
        self.busy = clocked.busy;
        self.interrupt = clocked.interrupt;
        self.clocks += u64::from(clocked.clocks);
        Ok(())
    }
}

pub(crate) fn reset(accelerator: &mut dyn ExternalAccelerator) -> Result<(), ExternalError> {
    const EXCHANGES: usize = 100;
    accelerator.write(RESET.offset, control::reset::RESET.mask())?;
    for _ in 0..EXCHANGES {
        accelerator.run(BATCH, &Offer::default())?;
        if accelerator.read(RESET.offset)? == 0 {
            break;
        }
    }
    Ok(())
}

/// The switches of a step.
fn flags_of(arguments: &Arguments) -> u32 {
    let word = flags::INTEGRATE.put(0, arguments.integrate.into());
    let word = flags::KINEMATIC.put(word, arguments.kinematic.into());
    let word = flags::PAIR_FRICTION.put(word, arguments.pair_friction.into());
    let word = flags::WARM_START.put(word, arguments.warm_start.into());
    let word = flags::IMPULSES_OUT.put(word, arguments.impulses_out.into());
    let word = flags::STREAMED_MASSES.put(word, arguments.streamed_masses.into());
    flags::IN_ORDER.put(word, arguments.in_order.into())
}

pub(crate) fn set_up(
    accelerator: &mut dyn ExternalAccelerator,
    scene: &Scene,
) -> Result<(), ExternalError> {
    let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let arguments = &scene.arguments;
    let [time_step, drift, coefficient, friction, damping, spin_damping] = arguments.numbers;
    let [x, y, z] = arguments.gravity;
    let words = [
        (BODIES, count(scene.bodies.len())),
        (COLLISIONS, count(scene.collisions.len())),
        (CONTACT_ITERATIONS, arguments.contact_iterations),
        (FRICTION_ITERATIONS, arguments.friction_iterations),
        (FLAGS, flags_of(arguments)),
        (TIME_STEP, time_step),
        (POSITION_DRIFT, drift),
        (POSITION_COEFFICIENT, coefficient),
        (FRICTION, friction),
        (ANGULAR_DAMPING, damping),
        (GRAVITY_X, x),
        (GRAVITY_Y, y),
        (GRAVITY_Z, z),
        (SPIN_DAMPING, spin_damping),
    ];
    for (register, value) in words {
        accelerator.write(register.offset, value)?;
    }
    for (index, shape) in scene.shapes.iter().enumerate() {
        let at = SHAPE_TABLE + SHAPE_STRIDE * count(index);
        accelerator.write(at + control::SHAPE_INVERSE_MASS, shape.inverse_mass)?;
        accelerator.write(at + control::SHAPE_INVERSE_INERTIA, shape.inverse_inertia)?;
    }
    Ok(())
}

/// The two numbers of binary16 in a word.
fn halves(word: u32) -> [f16; 2] {
    let [a, b, c, d] = word.to_le_bytes();
    [f16::from_le_bytes([a, b]), f16::from_le_bytes([c, d])]
}

fn has_nan(word: u32) -> bool {
    halves(word).iter().any(|number| number.is_nan())
}

/// Whether two words hold the same numbers of binary16: a NaN equals every other NaN.
fn same_halves(a: u32, b: u32) -> bool {
    let same = |(a, b): (f16, f16)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan();
    halves(a).into_iter().zip(halves(b)).all(same)
}

/// How the beats came.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arrival {
    /// As fast as they were taken: every counter is determined.
    Steady,
    /// With gaps: a collision that comes late may find its hazard over.
    Disturbed,
}

/// The first difference between two outcomes of one step, if there is one. A NaN equals any other
/// NaN, and with one of them in the results their sum means nothing.
#[must_use]
pub fn difference(expected: &Outcome, found: &Outcome, arrival: Arrival) -> Option<String> {
    let differs = |what: &str, expected: &dyn std::fmt::Debug, found: &dyn std::fmt::Debug| {
        Some(format!("{what}: expected {expected:x?}, found {found:x?}"))
    };
    if !found.ended {
        return Some("the step does not end".into());
    }
    if expected.error != found.error {
        return differs("error and detail", &expected.error, &found.error);
    }
    if expected.error[0] != 0 {
        return None;
    }
    let mut nan = false;
    let format = expected.format;
    let impulse_beats = [expected.impulse_beats, 0, 0, 0];
    for (stream, (expected, found)) in expected.results.iter().zip(&found.results).enumerate() {
        if expected.len() != found.len() {
            let what = format!("beats of results on stream {stream}");
            return differs(&what, &expected.len(), &found.len());
        }
        for (beat, (expected, found)) in expected.iter().zip(found).enumerate() {
            let place = match beat.checked_sub(impulse_beats[stream]) {
                Some(number) if format == StreamFormat::Binary16 => {
                    format!("beat {number} of the results on stream {stream}")
                }
                Some(body) => format!("body {body} on stream {stream}"),
                None => format!("beat {beat} of the impulses"),
            };
            if expected.last != found.last {
                return differs(&format!("TLAST of {place}"), &expected.last, &found.last);
            }
            let halves = beat >= impulse_beats[stream] && format == StreamFormat::Binary16;
            for (word, (e, f)) in expected.beat.0.into_iter().zip(found.beat.0).enumerate() {
                nan |= if halves { has_nan(e) } else { f32::from_bits(e).is_nan() };
                if !(if halves { same_halves(e, f) } else { same_number(e, f) }) {
                    return differs(&format!("word {word} of {place}"), &e, &f);
                }
            }
        }
    }
    let [received, sent] = expected.sums;
    let pairs = [
        ("sum of the words received", received, found.sums[0]),
        ("sum of the words sent", if nan { found.sums[1] } else { sent }, found.sums[1]),
        ("cycles by the formula", expected.work, found.work),
    ];
    let determined = [
        ("hazards", expected.hazards, found.hazards),
        ("stalls", expected.stalls(), found.stalls()),
    ];
    let determined = determined.into_iter().filter(|_| arrival == Arrival::Steady);
    for (what, expected, found) in pairs.into_iter().chain(determined) {
        if expected != found {
            return differs(what, &expected, &found);
        }
    }
    if expected.impulses != found.impulses {
        return differs("sum of the impulses", &expected.impulses, &found.impulses);
    }
    None
}
