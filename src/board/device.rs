//! An open board: its ports and its control block, from opening to closing.

use std::sync::Arc;
use std::time::Duration;

use pgs_interface::address_map::DMA_COUNT_MAX;
use pgs_support::Process;

use super::anomalies::Anomalies;
use super::bank::{Bank, PerBank};
use super::bring_up::{Core, check_given_width, check_memory, connect, drain_interrupt};
use super::cancellation::Cancellation;
use super::outline::Outline;
use super::plan::{Plan, bytes};
use super::port::Port;
use super::symptom::{Symptom, control_block_reset};
use crate::axi_dma::{Dmacr, Dmasr, largest_piece, reset_core};
use crate::beat::pool::PackPool;
use crate::control_block::{Capabilities, Control, Fingerprint, StepArguments, identify};
use crate::error::OpenError;
use crate::fault::Fault;
use crate::platform::{
    Access, AccessCounts, Platform, PlatformError, RegisterMap, Window, release_to_device,
};
use crate::record::body_table::Table;
use crate::scene::StepParameters;

/// Status registers of all channels: S2MM first, then MM2S.
pub(crate) type Statuses = [Dmasr; 2 * DMA_COUNT_MAX];

/// The step that was started last.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Started {
    pub(crate) outline: Outline,
    /// When, on the board's clock.
    pub(crate) at: Duration,
}

/// Whether the DMA engines may access buffers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Activity {
    /// No engine works on a buffer.
    Idle,
    /// A step was begun, and its buffers are not back yet.
    Step,
}

/// An open board.
pub(crate) struct Device {
    pub(crate) mm2s: Vec<Port>,
    pub(crate) s2mm: Vec<Port>,
    pub(crate) control: Control,
    pub(crate) capabilities: Capabilities,
    pub(crate) counts: Arc<AccessCounts>,
    pub(crate) platform: Arc<dyn Platform>,
    /// The identity of the bitstream when the board was opened.
    pub(crate) fingerprint: Fingerprint,
    /// The step that was started last.
    pub(crate) started: Option<Started>,
    /// The time of the last step from start to done, by the accelerator's own cycle counter.
    pub(crate) took: Option<Duration>,
    /// Steps in a row that were complete without an interrupt.
    pub(crate) missed_interrupts: u32,
    /// The anomalies that were logged.
    pub(crate) anomalies: Anomalies,
    /// Whether the board was given up: no register may be accessed any more.
    pub(crate) dead: bool,
    activity: Activity,
    /// The process that has opened the board.
    pub(crate) process: Process,
    /// The caller's way to end a step early.
    pub(crate) cancellation: Option<Cancellation>,
    /// The longest piece that a descriptor carries, bytes.
    pub(crate) largest: u32,
    /// The threads that write records and read results.
    pub(crate) packers: PackPool,
    /// The bodies of the step being packed; kept, so that a step allocates no memory.
    pub(crate) ends: Table,
    /// Indices of the static bodies at rest of the step in each bank, ascending.
    pub(crate) statics: PerBank<Vec<u32>>,
}

impl Device {
    /// Identifies the bitstream, resets everything and checks the DMA cores.
    pub(crate) fn open(
        platform: Arc<dyn Platform>,
        length_width: Option<u32>,
    ) -> Result<Self, OpenError> {
        let opened = Self::identify(Arc::clone(&platform), length_width);
        opened.map_err(|error| platform.lost().map_or(error, OpenError::from))
    }

    fn identify(platform: Arc<dyn Platform>, length_width: Option<u32>) -> Result<Self, OpenError> {
        let counts = Arc::<AccessCounts>::default();
        let window = Window::open(&*platform, RegisterMap::Control, &counts)?;
        let identity = identify(&window)?;
        check_memory(&*platform, &identity)?;
        check_given_width(length_width)?;
        let length_width = length_width.unwrap_or(identity.length_width);
        let capabilities = Capabilities { length_width, ..identity };
        let mut control = Control::new(window);
        let mut cores = connect(&*platform, &capabilities, &counts)?;
        for core in &mut cores {
            core.reset(&*platform)?;
            core.check_mode()?;
            core.check_length_width(capabilities.length_width)?;
        }
        control.reset(&*platform)?;
        drain_interrupt(&*platform)?;
        let device = Self::assemble(platform, control, capabilities, counts, cores);
        // Otherwise the capabilities would be of one bitstream, and the fingerprint of another.
        if identify(device.control.window())? != identity {
            return Err(OpenError::OtherBitstream);
        }
        Ok(device)
    }

    /// Builds the device from parts that were reset and checked.
    pub(crate) fn assemble(
        platform: Arc<dyn Platform>,
        control: Control,
        capabilities: Capabilities,
        counts: Arc<AccessCounts>,
        cores: Vec<Core>,
    ) -> Self {
        let fingerprint = control.fingerprint();
        let (mut mm2s, mut s2mm) = (Vec::new(), Vec::new());
        let last = cores.len().saturating_sub(1);
        for (place, Core { sender, receiver }) in cores.into_iter().enumerate() {
            mm2s.push(Port::new(sender, Access::Read, Dmacr::RUNNING));
            // Every step has results on the last channel, and they end within a beat of the results
            // on the others (three channels: 4 B beats): its interrupt stands for the step's end.
            let completion = place == last;
            let running = if completion { Dmacr::RUNNING_WITH_COMPLETION } else { Dmacr::RUNNING };
            s2mm.push(Port::new(receiver, Access::Write, running));
        }
        Self {
            mm2s,
            s2mm,
            control,
            capabilities,
            counts,
            platform,
            fingerprint,
            started: None,
            took: None,
            missed_interrupts: 0,
            anomalies: Anomalies::default(),
            dead: false,
            activity: Activity::Idle,
            process: Process::this(),
            cancellation: None,
            largest: largest_piece(capabilities.length_width),
            packers: PackPool::new(None),
            ends: Table::default(),
            statics: PerBank::default(),
        }
    }

    /// Makes the buffers of a bank large enough for a step. No engine works on the bank.
    pub(crate) fn reserve_buffers(&mut self, plan: &Plan, bank: Bank) -> Result<(), PlatformError> {
        self.take_back_unused(bank);
        let reach = self.capabilities.reach();
        for (channel, port) in self.mm2s.iter_mut().enumerate() {
            let beats = plan.segments(channel).end();
            port.reserve_beats(&self.platform, bank, beats, reach)?;
        }
        for (channel, port) in self.s2mm.iter_mut().enumerate() {
            port.reserve_beats(&self.platform, bank, plan.results(channel), reach)?;
        }
        Ok(())
    }

    /// Takes back the buffers of a bank that no engine works on. A step that was prepared there can
    /// no longer start.
    pub(crate) fn take_back_unused(&mut self, bank: Bank) {
        for port in self.ports_mut() {
            // The next step allocates another buffer.
            if let Err(error) = port.take_back(bank) {
                log::error!("a buffer was lost: {error}");
            }
        }
    }

    /// Frees the buffers of a bank that no engine works on; returns whether it had any.
    pub(crate) fn release_buffers(&mut self, bank: Bank) -> bool {
        self.take_back_unused(bank);
        // No short circuit: every port frees its buffer.
        self.ports_mut().map(|port| port.drop_buffer(bank)).fold(false, std::ops::BitOr::bitor)
    }

    /// Whether every port has a buffer in the bank, held by the CPU or by the device.
    pub(crate) fn holds(&self, bank: Bank) -> bool {
        self.ports().all(|port| port.has_buffer(bank))
    }

    /// Makes the rings large enough for a step. No step is in flight.
    pub(crate) fn reserve_rings(&mut self, plan: &Plan) -> Result<(), Symptom> {
        self.started = None;
        let reach = self.capabilities.reach();
        for core in 0..self.mm2s.len() {
            let [sent, received] = self.descriptors_of(plan, core);
            for (port, descriptors) in
                [(&mut self.mm2s[core], sent), (&mut self.s2mm[core], received)]
            {
                if !port.ring_takes(descriptors) {
                    self.platform.check_present()?;
                    port.stop(&*self.platform)?;
                    port.replace_ring(&self.platform, descriptors, reach)?;
                }
            }
        }
        Ok(())
    }

    /// Whether the buffers of a bank and the rings are already large enough for a step.
    pub(crate) fn has_room(&self, plan: &Plan, bank: Bank) -> bool {
        (0..self.mm2s.len()).all(|core| {
            let (mm2s, s2mm) = (&self.mm2s[core], &self.s2mm[core]);
            let [sent, received] = self.descriptors_of(plan, core);
            mm2s.beats(bank).len() >= plan.segments(core).end()
                && s2mm.beats(bank).len() >= plan.results(core)
                && mm2s.ring_takes(sent)
                && s2mm.ring_takes(received)
        })
    }

    /// Descriptors of a step on both channels of a core: MM2S, S2MM.
    pub(super) fn descriptors_of(&self, plan: &Plan, core: usize) -> [usize; 2] {
        let received = bytes(plan.results(core)).div_ceil(u64::from(self.largest));
        let received = usize::try_from(received).unwrap_or(usize::MAX);
        [plan.descriptors(core, self.largest), received]
    }

    /// Hands the buffers of a packed step over to the device, unless it already holds them.
    pub(crate) fn hand_over(&mut self, plan: &Plan, bank: Bank) -> Result<(), PlatformError> {
        for (channel, port) in self.s2mm.iter_mut().enumerate() {
            port.hand_over(bank, plan.results(channel))?;
        }
        for (channel, port) in self.mm2s.iter_mut().enumerate() {
            port.hand_over(bank, plan.segments(channel).end())?;
        }
        Ok(())
    }

    /// Hands the buffers over, queues all descriptors and writes the arguments. The doorbells
    /// follow in [`start`](Self::start).
    pub(crate) fn arm(
        &mut self,
        plan: &Plan,
        bank: Bank,
        parameters: &StepParameters,
    ) -> Result<(), Symptom> {
        let largest = self.largest;
        let outline = Outline::new(plan, largest);
        // Comes before the step's first register.
        self.platform.check_present()?;
        self.started = Some(Started { outline, at: self.platform.now() });
        self.activity = Activity::Step;
        self.hand_over(plan, bank)?;
        let mut starts = false;
        for (channel, port) in self.s2mm.iter_mut().enumerate() {
            port.begin();
            port.queue(bank, 0, bytes(plan.results(channel)), largest)?;
            starts |= port.ensure_running(&*self.platform)?;
        }
        for (channel, port) in self.mm2s.iter_mut().enumerate() {
            let segments = plan.segments(channel);
            port.begin();
            let mut queue = |beats: &std::ops::Range<usize>| {
                port.queue(bank, bytes(beats.start), bytes(beats.len()), largest)
            };
            queue(&segments.velocities)?;
            if plan.collisions > 0 {
                for pass in 0..plan.passes.total() {
                    queue(segments.of_pass(pass, plan.passes))?;
                }
            }
            queue(&segments.poses)?;
            starts |= port.ensure_running(&*self.platform)?;
        }
        // Arguments and shapes would be lost. Where no channel starts, a reset has halted one.
        if starts && !self.control.is_set_up() {
            return Err(control_block_reset().into());
        }
        let count = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
        let arguments = StepArguments {
            bodies: count(plan.bodies),
            collisions: count(plan.collisions),
            parameters,
            streamed_masses: plan.streamed_masses,
            in_order: self.capabilities.queue > 0 && !plan.queued,
        };
        self.control.set_arguments(&arguments);
        // Buffers and descriptors must be visible before the first doorbell.
        release_to_device();
        Ok(())
    }

    /// Starts the armed step; returns the number of doorbells.
    pub(crate) fn start(&mut self) -> Result<u64, Symptom> {
        // Receivers first: otherwise the accelerator's output stalls, and with it the input.
        let mut doorbells = 1;
        for port in &mut self.s2mm {
            doorbells += u64::from(port.ring_doorbell()?);
        }
        self.control.start();
        for port in &mut self.mm2s {
            doorbells += u64::from(port.ring_doorbell()?);
        }
        Ok(doorbells)
    }

    /// Takes back the buffers of a step whose chains are complete.
    pub(crate) fn take_back(&mut self, bank: Bank) -> Result<(), Symptom> {
        for port in self.ports_mut() {
            port.take_back(bank)?;
        }
        self.activity = Activity::Idle;
        Ok(())
    }

    /// Fails if the caller has cancelled.
    pub(crate) fn check_cancelled(&self) -> Result<(), Fault> {
        match &self.cancellation {
            Some(cancellation) if cancellation.is_cancelled() => Err(Fault::Cancelled),
            _ => Ok(()),
        }
    }

    /// Whether a step was begun, and its buffers are not back yet.
    pub(crate) fn in_flight(&self) -> bool {
        self.activity == Activity::Step
    }

    /// Records that everything was reset, and takes the buffers back.
    pub(crate) fn was_reset(&mut self) {
        for port in self.ports_mut() {
            // The next step replaces a buffer that does not come back.
            if let Err(error) = port.was_reset() {
                log::error!("a buffer was lost: {error}");
            }
        }
        self.activity = Activity::Idle;
    }

    /// Descriptors in the chains of the step.
    pub(crate) fn descriptors(&mut self) -> u64 {
        self.ports_mut().map(|port| port.ring_mut().used() as u64).sum()
    }

    /// All ports, in the order of [`Statuses`].
    pub(crate) fn ports_mut(&mut self) -> impl Iterator<Item = &mut Port> {
        self.s2mm.iter_mut().chain(&mut self.mm2s)
    }

    /// All ports, in the order of [`Statuses`].
    pub(crate) fn ports(&self) -> impl Iterator<Item = &Port> {
        self.s2mm.iter().chain(&self.mm2s)
    }

    /// Reads every status register once.
    pub(crate) fn statuses(&self) -> Statuses {
        let mut statuses = [Dmasr(0); 2 * DMA_COUNT_MAX];
        for (status, port) in statuses.iter_mut().zip(self.ports()) {
            *status = port.channel.status();
        }
        statuses
    }

    /// Resets all DMA cores, then the accelerator. In the other order, a core that still runs would
    /// send the rest of a packet to the accelerator after its reset.
    pub(crate) fn reset(&mut self) -> Result<(), Fault> {
        // Every part is reset, even if one fails: the others stop moving data.
        let mut result = Ok(());
        for (sender, receiver) in self.mm2s.iter_mut().zip(&mut self.s2mm) {
            let reset = reset_core(&*self.platform, &mut sender.channel, &mut receiver.channel);
            result = result.and(reset.map_err(Fault::from));
        }
        result = result.and(self.control.reset(&*self.platform).map_err(Fault::from));
        result?;
        drain_interrupt(&*self.platform)?;
        Ok(())
    }
}

impl Drop for Device {
    /// Stops the engines before their memory is freed. A channel that cannot be stopped keeps its
    /// memory. In a forked child nothing but memory of its own is freed.
    fn drop(&mut self) {
        if self.dead || !self.process.is_this() {
            return;
        }
        if let Err(error) = self.platform.check_present() {
            self.give_up(&error.into());
            return;
        }
        if self.in_flight() {
            // The caller has forgotten a step, so the accelerator runs, too. Channels that this
            // reset does not stop are stopped one by one below.
            if let Err(error) = self.reset() {
                log::error!("the board could not be reset: {error}");
            } else {
                self.was_reset();
            }
        }
        let Self { mm2s, s2mm, platform, .. } = self;
        for (sender, receiver) in mm2s.iter_mut().zip(s2mm) {
            let stopped = sender.stop(&**platform).and_then(|()| receiver.stop(&**platform));
            let stopped = stopped
                .or_else(|_| reset_core(&**platform, &mut sender.channel, &mut receiver.channel));
            for port in [sender, receiver] {
                if let Err(error) = &stopped {
                    log::error!("a channel could not be stopped: {error}");
                    port.leave_to_device();
                } else if let Err(error) = port.take_all_back() {
                    log::error!("cannot take a buffer back: {error}");
                }
            }
        }
    }
}
