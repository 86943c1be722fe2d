//! A step by scatter-gather: one ring per channel, started once.

use std::time::Duration;

use bitstream_model::{BoardConfig, Direction};
use pgs_interface::axi_dma::{DMASR, dmacr, dmasr};
use pgs_interface::control::{self, ap_ctrl, irq};
use pgs_interface::descriptor::status;
use pgs_interface::record::{BEAT_BYTES, Beat};

use super::packing::{beats_out, result_beats, unpack};
use super::ring::{EOF, Ring, SOF};
use super::scene::{Body, Lane, Step};
use super::{BOTH, Host, microseconds};

/// Longer than any step of the tests takes.
pub(crate) const LONG: Duration = microseconds(20_000);
/// Descriptors of a ring, where nothing else matters.
const SLOTS: usize = 64;

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Failure {
    Deadline,
    /// All results have arrived, and the accelerator does not set `ap_done`.
    NotDone,
    Dma {
        core: usize,
        direction: Direction,
        errors: u32,
    },
    /// Code, stream, detail.
    Accelerator(u32, u32, u32),
}

/// Results and counters of a step.
#[derive(Debug, Clone)]
pub(crate) struct Outcome {
    pub(crate) bodies: Vec<Body>,
    /// The beats of impulses that went out.
    pub(crate) impulses: Vec<Beat>,
    pub(crate) cycles: u64,
    pub(crate) stalls: u64,
    pub(crate) waits: u64,
    pub(crate) hazards: u32,
    pub(crate) sum_received: u32,
    pub(crate) sum_sent: u32,
    pub(crate) impulse_sum: u64,
    /// Sum of all result words, as the host adds them.
    pub(crate) sum_of_results: u32,
}

/// Buffers that the device owns.
#[derive(Debug, Default)]
pub(crate) struct Flight {
    inputs: Vec<u64>,
    outputs: Vec<u64>,
    /// The last result descriptor of each channel that has results.
    last: Vec<Option<usize>>,
}

impl Flight {
    /// Adds a buffer with input.
    pub(crate) fn input(&mut self, address: u64) {
        self.inputs.push(address);
    }

    /// The buffers with input, stream by stream.
    pub(crate) fn inputs(&self) -> &[u64] {
        &self.inputs
    }

    /// The result buffer of each channel.
    pub(crate) fn outputs(&self) -> &[u64] {
        &self.outputs
    }

    pub(crate) fn is_without_results(&self) -> bool {
        self.outputs.is_empty()
    }
}

#[derive(Debug)]
pub(crate) struct Machine {
    pub(crate) host: Host,
    pub(crate) mm2s: Vec<Ring>,
    pub(crate) s2mm: Vec<Ring>,
    /// The longest wait for an interrupt.
    slice: Duration,
}

impl Machine {
    pub(crate) fn new(config: BoardConfig) -> Self {
        Self::with_slots(config, SLOTS)
    }

    pub(crate) fn with_slots(config: BoardConfig, slots: usize) -> Self {
        let host = Host::new(config);
        let rings = |direction| -> Vec<Ring> {
            (0..host.cores()).map(|core| Ring::new(&host, core, direction, slots)).collect()
        };
        let (mm2s, s2mm) = (rings(Direction::Mm2s), rings(Direction::S2mm));
        let mut machine = Self { host, mm2s, s2mm, slice: microseconds(5_000) };
        machine.recover();
        machine
    }

    /// Waits no longer than that for an interrupt.
    pub(crate) fn looks_every(&mut self, slice: Duration) {
        self.slice = slice;
    }

    /// Resets everything and starts the rings from their first slot.
    pub(crate) fn recover(&mut self) {
        self.host.reset_all();
        for ring in self.mm2s.iter_mut().chain(&mut self.s2mm) {
            ring.restart();
            let done = ring.direction == Direction::S2mm && ring.core == 0;
            let enables = dmacr::IOC_IRQ_EN.put(dmacr::ERR_IRQ_EN.mask(), u32::from(done));
            ring.run(&self.host, enables);
        }
        self.host.set_control(control::GIE, 1);
        self.host.set_control(control::IER, irq::ERROR.mask());
    }

    /// The longest piece of a packet, bytes.
    fn piece(&self) -> usize {
        let longest = (1_usize << self.host.board.config().length_width) - 1;
        longest - longest % BEAT_BYTES
    }

    /// Queues a result buffer of `beats[k]` beats on channel `k`.
    pub(crate) fn arm(&mut self, flight: &mut Flight, beats: &[usize]) {
        let piece = self.piece();
        for (ring, beats) in self.s2mm.iter_mut().zip(beats) {
            let address = self.host.writable(*beats);
            flight.outputs.push(address);
            let mut last = None;
            for (offset, bytes) in pieces(beats * BEAT_BYTES, piece) {
                let control = u32::try_from(bytes).expect("at most 26 bits");
                last = Some(ring.push(address + offset as u64, control));
            }
            if let Some(slot) = last {
                ring.doorbell(&self.host, slot);
            }
            flight.last.push(last);
        }
    }

    pub(crate) fn start(&self) {
        self.host.set_control(control::AP_CTRL, ap_ctrl::START.mask());
    }

    /// Queues the packets of every stream.
    pub(crate) fn send(&mut self, flight: &mut Flight, lanes: &[Lane]) {
        let piece = self.piece();
        for (ring, lane) in self.mm2s.iter_mut().zip(lanes) {
            let host = &self.host;
            let addresses: Vec<_> = lane
                .segments
                .iter()
                .map(|beats| (!beats.is_empty()).then(|| host.readable(beats)))
                .collect();
            flight.inputs.extend(addresses.iter().flatten());
            let mut tail = None;
            for segment in &lane.packets {
                let address = addresses[*segment].expect("a packet has beats");
                let total = lane.segments[*segment].len() * BEAT_BYTES;
                for (offset, bytes) in pieces(total, piece) {
                    let mut control = u32::try_from(bytes).expect("at most 26 bits");
                    if offset == 0 {
                        control |= SOF;
                    }
                    if offset + bytes == total {
                        control |= EOF;
                    }
                    tail = Some(ring.push(address + offset as u64, control));
                }
            }
            if let Some(slot) = tail {
                ring.doorbell(&self.host, slot);
            }
        }
    }

    /// Waits until every result packet is there, with a deadline in virtual time.
    pub(crate) fn wait(&self, flight: &Flight, timeout: Duration) -> Result<(), Failure> {
        let host = &self.host;
        let deadline = host.port.now() + timeout;
        loop {
            let left = deadline.saturating_sub(host.port.now());
            if left.is_zero() {
                return Err(Failure::Deadline);
            }
            // Bounded, so that a lost interrupt does not matter, and longer than most steps.
            let _ = host.port.wait_interrupt(left.min(self.slice));
            for core in 0..host.cores() {
                for direction in BOTH {
                    let value = host.status(core, direction);
                    if value & dmasr::ERRORS != 0 {
                        let errors = value & dmasr::ERRORS;
                        return Err(Failure::Dma { core, direction, errors });
                    }
                    if value & dmasr::IRQS != 0 {
                        host.write(core, direction, DMASR, value & dmasr::IRQS);
                    }
                }
            }
            host.port.unmask_interrupt();
            let (code, channel, detail) = host.error();
            if code != 0 {
                return Err(Failure::Accelerator(code, channel, detail));
            }
            let done = |(ring, slot): (&Ring, &Option<usize>)| {
                slot.is_none_or(|slot| status::CMPLTED.is_set(ring.status(slot)))
            };
            if self.s2mm.iter().zip(&flight.last).all(done) {
                return Ok(());
            }
        }
    }

    /// Takes all buffers back and reads the counters.
    pub(crate) fn collect(&self, flight: &Flight, bodies: usize) -> Outcome {
        let host = &self.host;
        for address in &flight.inputs {
            host.take(*address);
            host.port.release(*address).expect("it was allocated");
        }
        let mut streams: Vec<Box<[Beat]>> =
            flight.outputs.iter().map(|address| host.take(*address)).collect();
        for address in &flight.outputs {
            host.port.release(*address).expect("it was allocated");
        }
        let sum_of_results =
            streams.iter().fold(0, |sum, beats| super::scene::sum_words(sum, beats));
        // They are in front of the results.
        let results = result_beats(&host.variant(), bodies)[0];
        let mut impulses = std::mem::take(&mut streams[0]).into_vec();
        streams[0] = impulses.split_off(impulses.len() - results).into();
        let pair = |low, high| u64::from(host.control(low)) | (u64::from(host.control(high)) << 32);
        let cycles = pair(control::CYCLES_LO, control::CYCLES_HI);
        let work = u64::from(host.control(control::WORK_CYCLES));
        let waits = u64::from(host.control(control::WAIT_CYCLES));
        Outcome {
            bodies: unpack(&host.variant(), &streams, bodies),
            impulses,
            cycles,
            // A board without power reads as all ones.
            stalls: cycles.wrapping_sub(work).wrapping_sub(waits),
            waits,
            hazards: host.control(control::HAZARDS),
            sum_received: host.control(control::SUM_RECEIVED),
            sum_sent: host.control(control::SUM_SENT),
            impulse_sum: pair(control::IMPULSE_SUM_LO, control::IMPULSE_SUM_HI),
            sum_of_results,
        }
    }

    /// Runs a step with the streams `lanes` instead of its own.
    pub(crate) fn step_with(&mut self, step: &Step, lanes: &[Lane]) -> Result<Outcome, Failure> {
        let flight = self.drive(step, lanes)?;
        Ok(self.collect(&flight, step.bodies.len()))
    }

    /// Runs a step until its results are in memory. The board alone computes.
    pub(crate) fn drive(&mut self, step: &Step, lanes: &[Lane]) -> Result<Flight, Failure> {
        let flight = self.begin(step, lanes);
        // The widest window is 65,534 cycles, 0.24 ms.
        let stalls = u32::try_from(step.collisions.len()).expect("some thousands");
        self.wait(&flight, LONG + microseconds(300) * stalls)?;
        match self.is_done() {
            true => Ok(flight),
            false => Err(Failure::NotDone),
        }
    }

    /// Begins a step with the streams `lanes`.
    pub(crate) fn begin(&mut self, step: &Step, lanes: &[Lane]) -> Flight {
        step.write_arguments(&self.host);
        let mut flight = Flight::default();
        let queued = step.is_queued(&self.host.board.config());
        let beats = beats_out(&self.host.variant(), step, queued);
        self.arm(&mut flight, &beats);
        self.start();
        self.send(&mut flight, lanes);
        flight
    }

    /// Whether the accelerator sets `ap_done`, which may come some hundred cycles after the
    /// results.
    pub(crate) fn is_done(&self) -> bool {
        (0..16).any(|_| {
            let done = ap_ctrl::DONE.is_set(self.host.control(control::AP_CTRL));
            if !done {
                let _ = self.host.port.wait_interrupt(microseconds(1));
            }
            done
        })
    }

    pub(crate) fn step(&mut self, step: &Step) -> Result<Outcome, Failure> {
        let variant = self.host.variant();
        self.step_with(step, &step.packed(&variant))
    }
}

/// Offset and length of each piece of a packet.
fn pieces(bytes: usize, piece: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..bytes).step_by(piece).map(move |offset| (offset, piece.min(bytes - offset)))
}
