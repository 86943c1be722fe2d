//! A minimal driver for one step: a cube on the ground, solved to Bullet's bits.
//!
//! It shares only the interface module with the driver, so that it can test a guest and its board
//! alone. On the way it checks register bits that plain memory would get wrong: bits that clear
//! when read, when written 1, or by themselves.

use std::fmt;
use std::time::Duration;

use bitstream_model::interface::address_map::{CONTROL_BASE, DMA_COUNT_MAX, dma_base};
use bitstream_model::interface::axi_dma::{
    CURDESC, CURDESC_MSB, DMACR, DMASR, S2MM_OFFSET, TAILDESC, TAILDESC_MSB, dmacr, dmasr,
};
use bitstream_model::interface::control::{self, ap_ctrl};
use bitstream_model::interface::descriptor::{BYTES, control::EOF, control::SOF, status};
use bitstream_model::interface::record::{BEAT_BYTES, Beat};
use bitstream_model::interface::register::Register;

use crate::mailbox::halves;

/// The machine that the step runs on. Memory is addressed by bytes from its beginning.
pub trait Machine {
    /// Its error.
    type Error;

    /// Reads a register.
    ///
    /// # Errors
    /// The machine's.
    fn read(&mut self, address: u64) -> Result<u32, Self::Error>;
    /// Writes a register.
    ///
    /// # Errors
    /// The machine's.
    fn write(&mut self, address: u64, value: u32) -> Result<(), Self::Error>;
    /// The bus address of the memory.
    fn memory(&self) -> u64;
    /// Writes memory.
    ///
    /// # Errors
    /// The machine's.
    fn store(&mut self, at: u64, beats: &[Beat]) -> Result<(), Self::Error>;
    /// Reads memory.
    ///
    /// # Errors
    /// The machine's.
    fn load(&mut self, at: u64, beats: &mut [Beat]) -> Result<(), Self::Error>;
    /// Waits for the interrupt, which masks it; returns whether it came.
    ///
    /// # Errors
    ///
    /// The machine's.
    fn wait_interrupt(&mut self, timeout: Duration) -> Result<bool, Self::Error>;
    /// Unmasks the interrupt.
    ///
    /// # Errors
    ///
    /// The machine's.
    fn unmask_interrupt(&mut self) -> Result<(), Self::Error>;
}

/// Why the step failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StepError<E> {
    /// The machine failed.
    #[error("the machine failed")]
    Machine(#[from] E),
    /// A register or a result has a wrong value.
    #[error("expected {expected}, found {found}")]
    Unexpected {
        /// The expected value.
        expected: String,
        /// The value found.
        found: String,
    },
}

const CORES: usize = DMA_COUNT_MAX;
/// Reads of a register within which every state that changes by time alone must change.
const LOOKS: usize = 1000;
const PASSES: usize = 8;
/// Segments of the memory: data of stream k, its descriptors, its results, their descriptors; then
/// stream k + 1.
const STREAM_BYTES: u64 = 0x1000;
const DESCRIPTORS: u64 = 0x400;
const RESULTS: u64 = 0xC00;
const RESULT_DESCRIPTOR: u64 = 0xE00;

/// Bullet's own cube that rests on the ground, as bits; the ground is body 0.
const VELOCITIES: [[u32; 4]; 4] = [
    [0, 0, 0, 0],
    [0, 0, 0, 0],
    [0xB940_21DF, 0xBE27_42B5, 0x3947_72CA, 1],
    [0x3945_746A, 0x3746_D8B6, 0x393E_3619, 0],
];
const GROUND: [u32; 4] = [0, 0xC3C8_0000, 0, 0];
const UPRIGHT: [u32; 4] = [0, 0, 0, 0x3F80_0000];
const CUBE: [u32; 4] = [0x3E7F_E7F0, 0x3F7E_B861, 0xBF00_0431, 0];
const POSES: [[u32; 4]; 4] =
    [GROUND, UPRIGHT, CUBE, [0xB6DB_A5C8, 0x398F_D07F, 0xB6CD_DEFE, 0x3F80_0000]];
const COLLISION: [[u32; 4]; 7] = [
    [0, 0xBF80_0000, 0, 4],
    [0, 0xC3C8_0000, 0, 0],
    [0x3E7F_E7F0, 0x3F7E_B861, 0xBF00_0431, 1],
    [0x3F9F_FCA5, 0xBBA3_CE42, 0xBF00_F4DA, 0xBBA4_3737],
    [0xBF3F_E2DD, 0xBBA2_FB00, 0x3F00_209D, 0xBBA2_FB00],
    [0xBF40_2AC4, 0xBBA3_D680, 0xBFBF_EFB0, 0xBBA3_D680],
    [0x3FA0_0E91, 0xBBA3_C900, 0x3EFF_B16C, 0xBBA3_C900],
];
/// Bullet's bits after the step.
const RESULT: [[u32; 4]; 8] = [
    GROUND,
    UPRIGHT,
    [0, 0, 0, 0],
    [0, 0, 0, 0],
    [0x3E7F_E9BD, 0x3F7E_B865, 0xBF00_04AA, 0],
    [0xB729_9ED1, 0x3990_00D2, 0xB721_B401, 0x3F80_0000],
    [0x39D8_3474, 0xBE27_3CAA, 0xB9E2_8EF9, 0],
    [0xB9E0_4C29, 0x3835_3825, 0xB9DC_5132, 0],
];
const ARGUMENTS: [(Register, u32); 13] = [
    (control::BODIES, 2),
    (control::COLLISIONS, 1),
    (control::CONTACT_ITERATIONS, 4),
    (control::FRICTION_ITERATIONS, 4),
    (control::FLAGS, 1),
    (control::TIME_STEP, 0x3C88_8889),
    (control::POSITION_DRIFT, 0x3BA3_D70A),
    (control::POSITION_COEFFICIENT, 0x3E4C_CCCD),
    (control::FRICTION, 0x3F33_3333),
    (control::ANGULAR_DAMPING, 0x3F7D_70A4),
    (control::GRAVITY_X, 0),
    (control::GRAVITY_Y, 0xC11C_CCCD),
    (control::GRAVITY_Z, 0),
];
/// Inverse mass and inverse inertia: the ground's, the cube's.
const SHAPES: [[u32; 2]; 2] = [[0, 0], [0x3F80_0000, 0x3EBC_3782]];

/// A channel: its core and its direction.
#[derive(Clone, Copy)]
struct Channel {
    core: usize,
    results: bool,
}

impl Channel {
    fn all() -> impl Iterator<Item = Self> {
        // Receivers first.
        [true, false]
            .into_iter()
            .flat_map(|results| (0..CORES).map(move |core| Self { core, results }))
    }

    fn at(self, register: Register) -> u64 {
        let half = if self.results { S2MM_OFFSET } else { 0 };
        dma_base(self.core) + u64::from(half + register.offset)
    }
}

impl fmt::Display for Channel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "dma{} {}", self.core, if self.results { "S2MM" } else { "MM2S" })
    }
}

fn at(register: Register) -> u64 {
    CONTROL_BASE + u64::from(register.offset)
}

fn stream(core: usize) -> u64 {
    STREAM_BYTES * core as u64
}

/// The beats of a segment on one stream.
fn striped(beats: &[[u32; 4]], core: usize) -> Vec<Beat> {
    beats.iter().skip(core).step_by(CORES).copied().map(Beat).collect()
}

/// A descriptor in four beats.
fn descriptor(next: u64, buffer: u64, control: u32) -> [Beat; 4] {
    let ([next, next_high], [buffer, buffer_high]) = (halves(next), halves(buffer));
    [
        Beat([next, next_high, buffer, buffer_high]),
        Beat([0, 0, control, 0]),
        Beat::default(),
        Beat::default(),
    ]
}

fn length(beats: usize) -> u32 {
    u32::try_from(beats * BEAT_BYTES).unwrap_or(u32::MAX)
}

/// Runs one step, whose interrupt must come within `patience`; returns its clock cycles, as counted
/// by the accelerator.
///
/// # Errors
///
/// [`StepError`]: the machine failed, or a value is wrong.
pub fn run<M: Machine>(machine: &mut M, patience: Duration) -> Result<u32, StepError<M::Error>> {
    let identity = machine.read(at(control::IDENTIFICATION))?;
    expect("the accelerator", control::IDENTIFICATION_VALUE, identity)?;
    reset(machine)?;
    machine.wait_interrupt(Duration::ZERO)?;
    machine.unmask_interrupt()?;

    let mut tails = [[0; 2]; CORES];
    for (core, tail) in tails.iter_mut().enumerate() {
        *tail = lay_out(machine, core)?;
    }
    for channel in Channel::all() {
        let first = if channel.results { RESULT_DESCRIPTOR } else { DESCRIPTORS };
        start(machine, channel, machine.memory() + stream(channel.core) + first)?;
    }
    write_arguments(machine)?;

    // Receivers, the accelerator, senders.
    for channel in Channel::all() {
        if !channel.results && channel.core == 0 {
            machine.write(at(control::AP_CTRL), ap_ctrl::START.mask())?;
        }
        let [low, high] = halves(tails[channel.core][usize::from(channel.results)]);
        machine.write(channel.at(TAILDESC), low)?;
        machine.write(channel.at(TAILDESC_MSB), high)?;
    }
    finish(machine, patience)?;
    check_results(machine)?;

    let done = |value| ap_ctrl::DONE.of(value);
    let first = machine.read(at(control::AP_CTRL))?;
    expect("ap_done at the first look", 1, done(first))?;
    let second = machine.read(at(control::AP_CTRL))?;
    expect("ap_done at the second look, which the first one cleared", 0, done(second))?;
    expect("a sticky error", 0, machine.read(at(control::ERROR))?)?;
    Ok(machine.read(at(control::CYCLES_LO))?)
}

fn expect<E>(what: &str, expected: u32, found: u32) -> Result<(), StepError<E>> {
    if expected == found {
        return Ok(());
    }
    let expected = format!("{what} to be {expected:#010x}");
    Err(StepError::Unexpected { expected, found: format!("{found:#010x}") })
}

/// Reads a register until its value is as expected.
fn poll_until<M: Machine>(
    machine: &mut M,
    address: u64,
    what: impl fmt::Display,
    said: impl Fn(u32) -> bool,
) -> Result<(), StepError<M::Error>> {
    let mut found = 0;
    for _ in 0..LOOKS {
        found = machine.read(address)?;
        if said(found) {
            return Ok(());
        }
    }
    Err(StepError::Unexpected { expected: what.to_string(), found: format!("{found:#010x}") })
}

fn reset<M: Machine>(machine: &mut M) -> Result<(), StepError<M::Error>> {
    for channel in Channel::all().filter(|channel| !channel.results) {
        machine.write(channel.at(DMACR), dmacr::RESET.mask())?;
    }
    for channel in Channel::all() {
        poll_until(machine, channel.at(DMACR), format_args!("{channel} out of reset"), |value| {
            !dmacr::RESET.is_set(value)
        })?;
    }
    machine.write(at(control::RESET), control::reset::RESET.mask())?;
    poll_until(machine, at(control::RESET), "the accelerator out of reset", |value| {
        !control::reset::RESET.is_set(value)
    })
}

/// Writes data and descriptors of a stream; returns the addresses of its last descriptors, of data
/// and of results.
fn lay_out<M: Machine>(machine: &mut M, core: usize) -> Result<[u64; 2], StepError<M::Error>> {
    let base = stream(core);
    let bus = machine.memory() + base;
    let mut data = 0;
    let mut packets = Vec::new();
    for (beats, times) in [(&VELOCITIES[..], 1), (&COLLISION[..], PASSES), (&POSES[..], 1)] {
        let beats = striped(beats, core);
        machine.store(base + data, &beats)?;
        packets.extend(vec![(bus + data, length(beats.len())); times]);
        data += (beats.len() * BEAT_BYTES) as u64;
    }
    let mut place = DESCRIPTORS;
    let mut tail = 0;
    for (buffer, bytes) in packets {
        tail = bus + place;
        let next = tail + BYTES as u64;
        let words = descriptor(next, buffer, bytes | SOF.mask() | EOF.mask());
        machine.store(base + place, &words)?;
        place += BYTES as u64;
    }
    let results = length(striped(&RESULT, core).len());
    let end = bus + RESULT_DESCRIPTOR;
    let words = descriptor(end, bus + RESULTS, results);
    machine.store(base + RESULT_DESCRIPTOR, &words)?;
    Ok([tail, end])
}

fn start<M: Machine>(
    machine: &mut M,
    channel: Channel,
    first: u64,
) -> Result<(), StepError<M::Error>> {
    let [low, high] = halves(first);
    machine.write(channel.at(CURDESC), low)?;
    machine.write(channel.at(CURDESC_MSB), high)?;
    // The last result beat is on the last stream: its completion ends the step.
    let completion = channel.results && channel.core + 1 == CORES;
    let control = dmacr::IRQ_THRESHOLD.put(dmacr::RS.mask(), 1);
    let control = dmacr::IOC_IRQ_EN.put(control, u32::from(completion));
    machine.write(channel.at(DMACR), control)?;
    poll_until(machine, channel.at(DMASR), format_args!("{channel} running"), |value| {
        !dmasr::HALTED.is_set(value)
    })
}

fn write_arguments<M: Machine>(machine: &mut M) -> Result<(), StepError<M::Error>> {
    for (register, value) in ARGUMENTS {
        machine.write(at(register), value)?;
    }
    let mut place = CONTROL_BASE + u64::from(control::SHAPE_TABLE);
    for [mass, inertia] in SHAPES {
        machine.write(place + u64::from(control::SHAPE_INVERSE_MASS), mass)?;
        machine.write(place + u64::from(control::SHAPE_INVERSE_INERTIA), inertia)?;
        place += u64::from(control::SHAPE_STRIDE);
    }
    Ok(())
}

/// Waits for the interrupt, acknowledges it, and checks that it does not return.
fn finish<M: Machine>(machine: &mut M, patience: Duration) -> Result<(), StepError<M::Error>> {
    let completion = Channel { core: CORES - 1, results: true }.at(DMASR);
    if !machine.wait_interrupt(patience)? {
        let found = format!("none within {patience:?}");
        return Err(StepError::Unexpected { expected: "an interrupt".to_owned(), found });
    }
    let status = machine.read(completion)?;
    expect("IOC_Irq after the interrupt", 1, dmasr::IOC_IRQ.of(status))?;
    machine.write(completion, dmasr::IOC_IRQ.mask())?;
    let status = machine.read(completion)?;
    expect("IOC_Irq once it was acknowledged", 0, dmasr::IOC_IRQ.of(status))?;
    machine.unmask_interrupt()?;
    // The line is level-sensitive: an unacknowledged interrupt would return at once.
    let again = machine.wait_interrupt(Duration::from_millis(5))?;
    expect("interrupts after the acknowledged one", 0, again.into())
}

fn check_results<M: Machine>(machine: &mut M) -> Result<(), StepError<M::Error>> {
    for core in 0..CORES {
        let mut second = [Beat::default()];
        machine.load(stream(core) + RESULT_DESCRIPTOR + BEAT_BYTES as u64, &mut second)?;
        let [.., found] = second[0].0;
        let wanted = striped(&RESULT, core);
        let bytes = length(wanted.len());
        let flags = status::CMPLTED.mask() | status::RXSOF.mask() | status::RXEOF.mask();
        expect(&format!("the status of result descriptor {core}"), flags | bytes, found)?;
        let mut beats = vec![Beat::default(); wanted.len()];
        machine.load(stream(core) + RESULTS, &mut beats)?;
        if beats != wanted {
            let expected = format!("Bullet's bits {wanted:08x?} on stream {core}");
            return Err(StepError::Unexpected { expected, found: format!("{beats:08x?}") });
        }
    }
    Ok(())
}
