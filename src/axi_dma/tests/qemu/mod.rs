//! Tests the driver's scatter-gather code against QEMU's own model of the AXI DMA.
//!
//! That model was written by others from the same product guide. Its streams end in an Ethernet
//! MAC, whose cable is a UDP socket of the test: what MM2S sends is read there, and what is put
//! there arrives by S2MM.
//!
//! It does less than PG021 says, so that these tests cannot judge: byte counts (a descriptor's stay
//! 0), RXSOF and RXEOF of a packet in several descriptors (all have both), `SGIncld` (reads 0), a
//! stop (`Halted` stays 0 when RS is cleared), CURDESC after a reset (it stays), a direction held
//! up by the other, addresses above 32 bits.

mod machine;
mod platform;

use std::io::Write as _;
use std::sync::Arc;
use std::time::Duration;

use pgs_interface::axi_dma::dmasr;
use pgs_interface::descriptor::{self, status};

use crate::axi_dma::{
    Channel, Descriptor, Direction, DmaError, Dmacr, Dmasr, Progress, Ring, pieces, reset_core,
};
use crate::platform::{Access, CpuBuffer, DeviceBuffer, Platform, RegisterMap, Window};
use platform::QtestPlatform;

const ADDRESS_WIDTH: u32 = 32;
/// How long an interrupt may take.
const PATIENCE: Duration = Duration::from_secs(20);
/// Addresses, and a type that is free for experiments (IEEE 802, `EtherType` 0x88B5).
const HEADER: [u8; 14] = *b"\x52\x54\x00\x12\x34\x56\x02\x00\x00\x00\x00\x01\x88\xb5";

/// A DMA core of QEMU's that was reset by the driver.
struct Core {
    qemu: Arc<QtestPlatform>,
    platform: Arc<dyn Platform>,
    pub(crate) mm2s: Channel,
    pub(crate) s2mm: Channel,
}

impl Core {
    /// `None`, with a message, if QEMU is not installed.
    fn new() -> Option<Self> {
        let Some(qemu) = QtestPlatform::start() else {
            // Past the harness, which keeps what passing tests print.
            let why = "skipped: QEMU's AXI DMA (qemu-system-microblazeel is not installed)";
            let _ = writeln!(std::io::stderr(), "{why}");
            return None;
        };
        let qemu = Arc::new(qemu);
        let platform: Arc<dyn Platform> = Arc::clone(&qemu) as _;
        let window = Window::open(&*platform, RegisterMap::Dma(0), &Arc::default());
        let window = Arc::new(window.expect("one core"));
        let channel = |direction| Channel::new(Arc::clone(&window), 0, direction, ADDRESS_WIDTH);
        let (mm2s, s2mm) = (channel(Direction::Mm2s), channel(Direction::S2mm));
        let mut core = Self { qemu, platform, mm2s, s2mm };
        core.reset();
        Some(core)
    }

    fn reset(&mut self) {
        reset_core(&*self.platform, &mut self.mm2s, &mut self.s2mm).expect("out of reset");
    }

    fn ring(&self, direction: Direction, chain: usize) -> Ring {
        Ring::new(&self.platform, direction, chain, ADDRESS_WIDTH.into()).expect("enough memory")
    }

    /// A buffer that holds these bytes, with the device.
    fn outgoing(&self, bytes: &[u8]) -> DeviceBuffer {
        let beats = bytes.len().div_ceil(16);
        let mut buffer =
            CpuBuffer::allocate(&self.platform, beats, ADDRESS_WIDTH.into()).expect("memory");
        let mut padded = bytes.to_vec();
        padded.resize(16 * beats, 0);
        let (words, _) = padded.as_chunks::<4>();
        let there = buffer.beats_mut().iter_mut().flat_map(|beat| &mut beat.0);
        for (word, bytes) in there.zip(words) {
            *word = u32::from_le_bytes(*bytes);
        }
        buffer.into_device(beats, Access::Read).expect("handed over")
    }

    /// An empty buffer, with the device.
    fn incoming(&self, bytes: usize) -> DeviceBuffer {
        let beats = bytes.div_ceil(16);
        let buffer =
            CpuBuffer::allocate(&self.platform, beats, ADDRESS_WIDTH.into()).expect("memory");
        buffer.into_device(beats, Access::Write).expect("handed over")
    }

    /// Waits for the interrupt of a channel's completion, and acknowledges it as the driver does.
    fn finish(&mut self, direction: Direction) -> Dmasr {
        let interrupt = self.platform.wait_interrupt(PATIENCE).expect("no error");
        assert!(interrupt.is_some(), "{direction} interrupts");
        let channel = self.channel(direction);
        let seen = channel.status();
        assert!(seen.complete() && seen.errors() == 0, "{direction} {seen}");
        assert_eq!(channel.pending(seen), dmasr::IOC_IRQ.mask(), "{direction} {seen}");
        channel.acknowledge(seen);
        let after = channel.status();
        assert_eq!(after.interrupts(), 0, "{direction} {after}");
        self.platform.unmask_interrupt().expect("no error");
        assert!(!self.qemu.interrupt(), "the line falls");
        seen
    }

    fn channel(&mut self, direction: Direction) -> &mut Channel {
        match direction {
            Direction::Mm2s => &mut self.mm2s,
            Direction::S2mm => &mut self.s2mm,
        }
    }

    fn start(&mut self, direction: Direction, ring: &Ring) {
        let platform = Arc::clone(&self.platform);
        let first = ring.start().expect("inside");
        let control = Dmacr::RUNNING_WITH_COMPLETION;
        self.channel(direction).start(&*platform, first, control).expect("runs");
    }

    fn ring_doorbell(&mut self, direction: Direction, ring: &Ring) {
        let tail = ring.tail().expect("inside").expect("not empty");
        self.channel(direction).ring_doorbell(tail);
    }
}

/// A frame of `bytes` bytes, no two of them alike by accident.
fn frame(bytes: usize, number: usize) -> Vec<u8> {
    let content = (0..).map(|at| u8::try_from((7 * at + 31 * number) % 251).expect("below 251"));
    HEADER.into_iter().chain(content).take(bytes).collect()
}

/// Appends one packet that lies at the start of a buffer, in pieces of at most `largest` bytes.
fn push_packet(ring: &mut Ring, buffer: &DeviceBuffer, bytes: usize, largest: u32) {
    let bytes = bytes as u64;
    for (offset, length) in pieces(bytes, largest) {
        ring.push(&Descriptor {
            address: buffer.range(offset, u64::from(length)).expect("inside"),
            bytes: length,
            starts_packet: offset == 0,
            ends_packet: offset + u64::from(length) == bytes,
        });
    }
}

/// Appends `count` places of `bytes` bytes each, one after the other, for one packet.
fn push_places(ring: &mut Ring, buffer: &DeviceBuffer, bytes: u32, count: u64) {
    for place in 0..count {
        let address = buffer.range(place * u64::from(bytes), u64::from(bytes)).expect("inside");
        ring.push(&Descriptor { address, bytes, starts_packet: false, ends_packet: false });
    }
}

/// The content of a buffer that the device has finished with.
fn received(buffer: DeviceBuffer) -> Vec<u8> {
    let buffer = buffer.into_cpu().expect("handed over before");
    buffer.beats().iter().flat_map(|beat| beat.0).flat_map(u32::to_le_bytes).collect()
}

/// STATUS of a descriptor with a whole packet in it, without the byte count.
const WHOLE: u32 = status::CMPLTED.mask() | status::RXSOF.mask() | status::RXEOF.mask();

/// The STATUS words of the first descriptors of a ring's chain, as they lie in the machine's
/// memory.
fn statuses<const N: usize>(core: &Core, ring: &Ring) -> [u32; N] {
    let mut at = ring.start().expect("inside").raw();
    std::array::from_fn(|_| {
        let word = |index: usize| core.qemu.word(at + 4 * index as u64);
        let status = word(descriptor::STATUS);
        at = word(descriptor::NXTDESC).into();
        status
    })
}

#[test]
fn a_reset_halts_both_directions_and_a_start_makes_one_run() {
    let Some(mut core) = Core::new() else { return };
    let ring = core.ring(Direction::Mm2s, 3);
    for _ in 0..2 {
        assert!(core.mm2s.status().halted() && core.s2mm.status().halted());
        core.start(Direction::Mm2s, &ring);
        assert!(!core.mm2s.status().halted() && core.s2mm.status().halted());
        assert_eq!(core.mm2s.current_descriptor(), u64::from(ring.start().expect("one").low()));
        // It runs: a second start would be ignored, and is refused.
        let first = ring.start().expect("inside");
        let refused = core.mm2s.start(&*core.platform, first, Dmacr::RUNNING);
        assert!(matches!(refused, Err(DmaError::State { awaited: "halted", .. })), "{refused:?}");
        core.start(Direction::S2mm, &ring);
        assert!(!core.s2mm.status().halted());
        core.reset();
    }
}

#[test]
fn a_running_channel_shows_its_first_descriptor_before_the_doorbell_that_fetches_it() {
    let Some(mut core) = Core::new() else { return };
    for direction in [Direction::Mm2s, Direction::S2mm] {
        for _ in 0..2 {
            let ring = core.ring(direction, 3);
            let first = ring.start().expect("inside").raw();
            core.start(direction, &ring);
            let channel = core.channel(direction);
            assert!(!channel.status().halted(), "{direction}");
            assert_eq!(channel.current_descriptor(), first, "{direction}");
            core.reset();
        }
    }
}

#[test]
fn packets_leave_byte_for_byte_chain_after_chain_and_round_the_ring() {
    let Some(mut core) = Core::new() else { return };
    let mut ring = core.ring(Direction::Mm2s, 7);
    for chain in 0..8 {
        ring.begin();
        // Two packets a chain, of two to four and of one to three descriptors: 43 in all, where the
        // ring has 8.
        let frames = [frame(100 + 20 * chain, chain), frame(60 + 15 * chain, 100 + chain)];
        let buffers = frames.each_ref().map(|frame| core.outgoing(frame));
        for (frame, buffer) in frames.iter().zip(&buffers) {
            push_packet(&mut ring, buffer, frame.len(), 64);
        }
        if chain == 0 {
            core.start(Direction::Mm2s, &ring);
        }
        assert_eq!(ring.progress(), Progress::Running);
        core.ring_doorbell(Direction::Mm2s, &ring);
        for frame in &frames {
            assert_eq!(&core.qemu.receive_frame(), frame, "chain {chain}");
        }
        let seen = core.finish(Direction::Mm2s);
        assert!(dmasr::IDLE.is_set(seen.0), "{seen}");
        assert!(matches!(ring.progress(), Progress::Complete { .. }), "{:?}", ring.progress());
        for buffer in buffers {
            drop(buffer.into_cpu().expect("back"));
        }
    }
}

#[test]
fn packets_arrive_byte_for_byte_chain_after_chain_and_round_the_ring() {
    let Some(mut core) = Core::new() else { return };
    let mut ring = core.ring(Direction::S2mm, 3);
    for chain in 0..9 {
        ring.begin();
        let sent = frame(60 + 37 * chain, chain);
        let buffer = core.incoming(512);
        push_places(&mut ring, &buffer, 512, 1);
        if chain == 0 {
            core.start(Direction::S2mm, &ring);
        }
        core.ring_doorbell(Direction::S2mm, &ring);
        assert_eq!(ring.progress(), Progress::Running);
        core.qemu.send_frame(&sent);
        core.finish(Direction::S2mm);
        // PG021 has the byte count here.
        assert_eq!(ring.progress(), Progress::Complete { bytes: 0, packet_ended: true });
        assert_eq!(received(buffer)[..sent.len()], sent, "chain {chain}");
        if chain == 0 {
            assert_eq!(statuses(&core, &ring), [WHOLE]);
        }
    }
}

#[test]
fn a_packet_that_ends_before_its_chain_is_seen_and_a_reset_gets_the_buffer_back() {
    let Some(mut core) = Core::new() else { return };
    let mut ring = core.ring(Direction::S2mm, 3);
    let buffer = core.incoming(3 * 128);
    push_places(&mut ring, &buffer, 128, 3);
    core.start(Direction::S2mm, &ring);
    core.ring_doorbell(Direction::S2mm, &ring);
    let short = frame(100, 1);
    core.qemu.send_frame(&short);
    core.finish(Direction::S2mm);
    assert_eq!(ring.progress(), Progress::Short);
    assert_eq!(statuses(&core, &ring), [WHOLE, 0, 0]);
    core.reset();
    assert_eq!(received(buffer)[..short.len()], short);

    // The next chain begins with the spare descriptor, and goes on with the one that was complete.
    ring.begin();
    let buffer = core.incoming(3 * 128);
    push_places(&mut ring, &buffer, 128, 3);
    core.start(Direction::S2mm, &ring);
    core.ring_doorbell(Direction::S2mm, &ring);
    let long = frame(370, 2);
    core.qemu.send_frame(&long);
    core.finish(Direction::S2mm);
    // All three are filled. This model marks each as start and end, PG021 the first and the last.
    let statuses: [u32; 3] = statuses(&core, &ring);
    assert!(statuses.iter().all(|word| status::CMPLTED.is_set(*word)), "{statuses:x?}");
    assert!(status::RXSOF.is_set(statuses[0]) && status::RXEOF.is_set(statuses[2]));
    assert_eq!(received(buffer)[..long.len()], long);
}

#[test]
fn an_interrupt_that_is_not_acknowledged_comes_again() {
    let Some(mut core) = Core::new() else { return };
    let mut ring = core.ring(Direction::Mm2s, 1);
    let sent = frame(64, 0);
    let buffer = core.outgoing(&sent);
    push_packet(&mut ring, &buffer, sent.len(), 64);
    core.start(Direction::Mm2s, &ring);
    assert!(!core.qemu.interrupt());
    core.ring_doorbell(Direction::Mm2s, &ring);
    for count in 1..=3 {
        let seen = core.platform.wait_interrupt(PATIENCE).expect("no error");
        assert_eq!(seen, Some(count));
        assert!(!core.qemu.interrupt(), "masked");
        core.platform.unmask_interrupt().expect("no error");
        assert!(core.qemu.interrupt(), "still pending");
    }
    core.finish(Direction::Mm2s);
    assert_eq!(core.platform.wait_interrupt(Duration::from_millis(1)).expect("no error"), None);
}
