//! Scatter-gather: steps on rings, and every mistake in a descriptor.

use bitstream_model::{BoardConfig, Denied, DeviceAccess, Direction, ViolationKind};
use pgs_interface::axi_dma::{CURDESC, CURDESC_MSB, DMACR, DMASR, dmacr, dmasr};
use pgs_interface::descriptor::{CONTROL, STATUS, status};
use pgs_interface::record::Beat;

use crate::common::ring::{EOF, Ring, SOF, WHOLE, halves};
use crate::common::scene::{Body, Step, bits};
use crate::common::sg::{Failure, Flight, LONG, Machine};
use crate::common::{BOTH, CORES, Host, microseconds, numbered};

fn assert_same(found: &[Body], expected: &[Body]) {
    assert_eq!(found.len(), expected.len());
    for (body, (found, expected)) in found.iter().zip(expected).enumerate() {
        assert_eq!(bits(found), bits(expected), "body {body}: {found:?}");
    }
}

#[test]
fn a_step_without_collisions_moves_every_body_as_calculated_by_hand() {
    for bodies in [1, 2, 3, 4, 5, 40] {
        let mut machine = Machine::new(BoardConfig::default());
        let outcome = machine.step(&Step::falling(bodies)).expect("the step completes");
        assert_same(&outcome.bodies, &Step::fallen(bodies));
        machine.host.assert_no_violation();
    }
}

#[test]
fn steps_follow_each_other_on_a_ring_without_stopping() {
    // Two packets a step on five descriptors: every step begins in another slot.
    let mut machine = Machine::with_slots(BoardConfig::default(), 5);
    let (step, expected) = (Step::falling(5), Step::fallen(5));
    let before = machine.host.board.counts();
    for _ in 0..12 {
        let outcome = machine.step(&step).expect("the step completes");
        assert_same(&outcome.bodies, &expected);
    }
    let after = machine.host.board.counts();
    assert_eq!(after.doorbells - before.doorbells, 12 * 9, "8 tails and a start");
    assert_eq!(after.descriptors - before.descriptors, 12 * (4 + 8));
    assert_eq!(after.beats_written - before.beats_written, 12 * 20);
    assert_eq!(after.beats_read - before.beats_read, 12 * 20);
    machine.host.assert_no_violation();
}

#[test]
fn a_step_is_the_same_at_every_address_width_and_length_width() {
    let expected = Step::fallen(40);
    for address_width in [32, 40] {
        for length_width in [8, 9, 14, 26] {
            let config = BoardConfig { address_width, length_width, ..BoardConfig::default() };
            let mut machine = Machine::new(config);
            let outcome = machine.step(&Step::falling(40)).expect("the step completes");
            assert_same(&outcome.bodies, &expected);
            machine.host.assert_no_violation();
        }
    }
}

/// One MM2S channel whose packets are not read: the FIFO takes 512 beats.
fn one_channel(control: u32) -> (Host, Ring) {
    let host = Host::lenient(BoardConfig::default());
    let ring = Ring::new(&host, 0, Direction::Mm2s, 4);
    ring.run(&host, control | dmacr::ERR_IRQ_EN.mask());
    (host, ring)
}

/// Checks that the channel stopped with `error` alone, and that CURDESC points at the descriptor.
fn assert_failed(host: &Host, ring: &Ring, slot: usize, error: u32) {
    host.pause(20);
    let (core, direction) = (ring.core, ring.direction);
    let value = host.status(core, direction);
    let expected = error | dmasr::ERR_IRQ.mask() | dmasr::HALTED.mask() | dmasr::SG_INCLD.mask();
    let counting = dmasr::IRQ_THRESHOLD_STS.mask() | dmasr::IOC_IRQ.mask();
    assert_eq!(value & !counting, expected, "{value:#x}");
    assert!(!dmacr::RS.is_set(host.read(core, direction, DMACR)));
    let [low, high] = halves(ring.at(slot));
    assert_eq!(host.read(core, direction, CURDESC), low);
    assert_eq!(host.read(core, direction, CURDESC_MSB), high);
    assert!(host.port.wait_interrupt(microseconds(1)).is_some(), "the error interrupt stands");
}

#[test]
fn a_stale_descriptor_is_sg_int_err() {
    let (host, mut ring) = one_channel(0);
    let slot = ring.push(host.readable(&numbered(4)), WHOLE | 64);
    ring.set(slot, STATUS, status::CMPLTED.mask());
    ring.doorbell(&host, slot);
    assert_failed(&host, &ring, slot, dmasr::SG_INT_ERR.mask());
    let kind = ViolationKind::StaleDescriptor {
        core: 0,
        direction: Direction::Mm2s,
        address: ring.at(slot),
    };
    assert_eq!(host.violations(), [kind]);
    assert_eq!(host.board.counts().beats_read, 0);
}

#[test]
fn a_reused_descriptor_needs_its_status_cleared() {
    let (host, ring) = one_channel(0);
    let data = host.readable(&numbered(4));
    for slot in 0..4 {
        ring.fill(slot, data, WHOLE | 64);
    }
    ring.doorbell(&host, 3);
    host.pause(20);
    ring.set(0, STATUS, 0);
    ring.doorbell(&host, 1);
    assert_failed(&host, &ring, 1, dmasr::SG_INT_ERR.mask());
    assert_eq!(ring.status(0), status::CMPLTED.mask() | 64);
}

#[test]
fn a_descriptor_of_length_0_is_dma_int_err() {
    let (host, mut ring) = one_channel(0);
    let slot = ring.push(host.readable(&numbered(4)), WHOLE);
    ring.doorbell(&host, slot);
    assert_failed(&host, &ring, slot, dmasr::DMA_INT_ERR.mask());
    assert_eq!(ring.status(slot), status::DMA_INT_ERR.mask());
    let address = ring.at(slot);
    let direction = Direction::Mm2s;
    assert_eq!(host.violations(), [ViolationKind::ZeroLength { core: 0, direction, address }]);
}

#[test]
fn a_length_above_the_width_is_cut_and_a_violation() {
    let config = BoardConfig { length_width: 8, ..BoardConfig::default() };
    let host = Host::lenient(config);
    let mut ring = Ring::new(&host, 0, Direction::Mm2s, 4);
    ring.run(&host, 0);
    let slot = ring.push(host.readable(&numbered(32)), WHOLE | (256 + 48));
    ring.doorbell(&host, slot);
    host.pause(20);
    assert_eq!(ring.status(slot), status::CMPLTED.mask() | 48);
    let (core, direction) = (0, Direction::Mm2s);
    let kind = ViolationKind::LengthTooWide { core, direction, wanted: 304, width: 8 };
    assert_eq!(host.violations(), [kind]);
}

#[test]
fn sof_and_eof_must_pair() {
    for (first, second, wrong) in
        [(WHOLE, EOF, 1), (SOF, WHOLE, 1), (EOF, WHOLE, 0), (WHOLE, 0, 1), (SOF, SOF, 1)]
    {
        let (host, mut ring) = one_channel(0);
        let data = host.readable(&numbered(4));
        ring.push(data, first | 64);
        let tail = ring.push(data, second | 64);
        ring.doorbell(&host, tail);
        host.pause(20);
        let (core, direction, address) = (0, Direction::Mm2s, ring.at(wrong));
        let kind = ViolationKind::UnpairedPacket { core, direction, address };
        assert_eq!(host.violations(), [kind], "{first:#x} {second:#x}");
    }
    let (host, mut ring) = one_channel(0);
    let data = host.readable(&numbered(4));
    for control in [SOF, 0, EOF] {
        ring.push(data, control | 64);
    }
    ring.doorbell(&host, 2);
    host.pause(20);
    host.assert_no_violation();
}

#[test]
fn a_descriptor_outside_memory_is_sg_dec_err() {
    for direction in BOTH {
        let host = Host::lenient(BoardConfig::default());
        let mut ring = Ring::new(&host, 1, direction, 2);
        let buffer = match direction {
            Direction::Mm2s => host.readable(&numbered(4)),
            Direction::S2mm => host.writable(4),
        };
        ring.push(buffer, WHOLE | 64);
        ring.address = 0x1000;
        ring.run(&host, dmacr::ERR_IRQ_EN.mask());
        ring.doorbell(&host, 0);
        assert_failed(&host, &ring, 0, dmasr::SG_DEC_ERR.mask());
        let denied = Denied::Unmapped;
        let kind =
            ViolationKind::OutsideGrant { core: 1, direction, address: 0x1000, bytes: 52, denied };
        assert_eq!(host.violations(), [kind]);
    }
}

#[test]
fn a_descriptor_in_a_data_buffer_is_sg_dec_err() {
    let host = Host::lenient(BoardConfig::default());
    let mut ring = Ring::new(&host, 0, Direction::Mm2s, 2);
    ring.address = host.readable(&numbered(8));
    ring.run(&host, dmacr::ERR_IRQ_EN.mask());
    ring.doorbell(&host, 1);
    assert_failed(&host, &ring, 0, dmasr::SG_DEC_ERR.mask());
    let (core, direction, address) = (0, Direction::Mm2s, ring.address);
    let denied = Denied::Kind;
    let kind = ViolationKind::OutsideGrant { core, direction, address, bytes: 52, denied };
    assert_eq!(host.violations(), [kind]);
}

#[test]
fn a_ring_released_under_the_engine_is_sg_dec_err_and_a_violation() {
    let (host, ring) = one_channel(0);
    // Longer than the FIFO: the engine is still at work when its descriptor is released.
    ring.fill(0, host.readable(&numbered(600)), WHOLE | (600 * 16));
    ring.doorbell(&host, 0);
    host.pause(20);
    host.port.release(ring.address).expect("it was allocated");
    host.reset_accelerator();
    host.pause(20);
    let value = host.status(0, Direction::Mm2s);
    assert_eq!(value & dmasr::ERRORS, dmasr::SG_DEC_ERR.mask());
    assert!(
        matches!(
            host.violations()[..],
            [ViolationKind::OutsideGrant { denied: Denied::Unmapped, .. }]
        ),
        "{:?}",
        host.violations()
    );
}

/// Checks the error and the violation of a channel at a buffer that it may not touch.
fn assert_denied(
    direction: Direction,
    prepare: impl Fn(&Host) -> (u64, u32),
    offset: u64,
    expected: Denied,
) {
    let mut machine = Machine::new(BoardConfig { strict: false, ..BoardConfig::default() });
    let (buffer, bytes) = prepare(&machine.host);
    match direction {
        Direction::Mm2s => {
            let slot = machine.mm2s[2].push(buffer, WHOLE | bytes);
            machine.mm2s[2].doorbell(&machine.host, slot);
        }
        Direction::S2mm => {
            // All other streams have their beats.
            let step = Step::falling(4);
            step.write_arguments(&machine.host);
            let mut flight = Flight::default();
            let slot = machine.s2mm[2].push(buffer, bytes);
            machine.s2mm[2].doorbell(&machine.host, slot);
            machine.start();
            machine.send(&mut flight, &step.lanes());
        }
    }
    machine.host.pause(50);
    let ring = match direction {
        Direction::Mm2s => &machine.mm2s[2],
        Direction::S2mm => &machine.s2mm[2],
    };
    assert_failed(&machine.host, ring, 0, dmasr::DMA_DEC_ERR.mask());
    assert!(status::DMA_DEC_ERR.is_set(ring.status(0)), "the descriptor has the error, too");
    assert!(!status::CMPLTED.is_set(ring.status(0)));
    match machine.host.violations()[..] {
        [ViolationKind::OutsideGrant { core: 2, direction: found, address, denied, .. }] => {
            assert_eq!((found, address, denied), (direction, buffer + offset, expected));
        }
        ref other => panic!("{other:?}"),
    }
}

#[test]
fn a_buffer_of_the_cpu_is_denied() {
    for direction in BOTH {
        let prepare = |host: &Host| (host.port.allocate(4).expect("there is room").0, 64);
        assert_denied(direction, prepare, 0, Denied::CpuOwned);
    }
}

#[test]
fn a_buffer_granted_for_the_other_direction_is_denied() {
    assert_denied(Direction::Mm2s, |host| (host.writable(4), 64), 0, Denied::Direction);
    let prepare = |host: &Host| (host.readable(&numbered(4)), 64);
    assert_denied(Direction::S2mm, prepare, 0, Denied::Direction);
}

#[test]
fn a_released_buffer_is_denied() {
    for direction in BOTH {
        let prepare = |host: &Host| {
            let address = match direction {
                Direction::Mm2s => host.readable(&numbered(4)),
                Direction::S2mm => host.writable(4),
            };
            host.port.release(address).expect("it was allocated");
            (address, 64)
        };
        assert_denied(direction, prepare, 0, Denied::Unmapped);
    }
}

#[test]
fn one_beat_past_the_end_of_a_buffer_is_denied() {
    let prepare = |host: &Host| (host.readable(&numbered(4)), 80);
    assert_denied(Direction::Mm2s, prepare, 0, Denied::PastEnd);
    assert_denied(Direction::S2mm, |host| (host.writable(3), 64), 0, Denied::PastEnd);
}

#[test]
fn room_for_a_packet_past_the_end_of_a_buffer_is_a_violation_even_if_the_packet_ends_before() {
    let mut machine = Machine::new(BoardConfig { strict: false, ..BoardConfig::default() });
    let buffer = machine.host.writable(4);
    let step = Step::falling(4);
    step.write_arguments(&machine.host);
    let mut flight = Flight::default();
    // Four beats come.
    let slot = machine.s2mm[2].push(buffer, 80);
    machine.s2mm[2].doorbell(&machine.host, slot);
    machine.start();
    machine.send(&mut flight, &step.lanes());
    machine.host.pause(50);
    assert!(status::CMPLTED.is_set(machine.s2mm[2].status(slot)));
    assert_eq!(machine.host.status(2, Direction::S2mm) & dmasr::ERRORS, 0);
    let (core, direction, address) = (2, Direction::S2mm, buffer);
    let denied = Denied::PastEnd;
    let kind = ViolationKind::OutsideGrant { core, direction, address, bytes: 80, denied };
    assert_eq!(machine.host.violations(), [kind]);
}

#[test]
fn a_buffer_that_begins_behind_its_end_is_denied() {
    let prepare = |host: &Host| (host.readable(&numbered(4)) + 64, 16);
    assert_denied(Direction::Mm2s, prepare, 0, Denied::Unmapped);
}

#[test]
fn descriptors_are_no_data() {
    for direction in BOTH {
        let prepare = |host: &Host| (host.port.allocate_shared(64).expect("there is room").0, 64);
        assert_denied(direction, prepare, 0, Denied::Kind);
    }
}

#[test]
fn data_off_the_beat_is_a_violation_without_an_error_bit() {
    for (offset, bytes) in [(4, 64), (0, 60)] {
        let (host, mut ring) = one_channel(0);
        let buffer = host.readable(&numbered(8)) + offset;
        // The second of two pieces, so that the first must be whole beats.
        ring.push(buffer, SOF | bytes);
        let tail = ring.push(host.readable(&numbered(4)), EOF | 64);
        ring.doorbell(&host, tail);
        host.pause(20);
        let (core, direction, length) = (0, Direction::Mm2s, bytes);
        let kind = ViolationKind::Misaligned { core, direction, address: buffer, length };
        assert_eq!(host.violations(), [kind]);
        assert_eq!(host.status(0, direction) & dmasr::ERRORS, 0);
        assert!(status::CMPLTED.is_set(ring.status(tail)));
    }
}

#[test]
fn after_an_error_run_does_not_revive_and_a_reset_does() {
    let (host, mut ring) = one_channel(0);
    let slot = ring.push(host.readable(&numbered(4)), WHOLE);
    ring.doorbell(&host, slot);
    assert_failed(&host, &ring, slot, dmasr::DMA_INT_ERR.mask());
    host.write(0, Direction::Mm2s, DMACR, 0x0001_0001);
    host.pause(20);
    assert!(dmasr::HALTED.is_set(host.status(0, Direction::Mm2s)));
    let start = ViolationKind::StartWithError { core: 0, direction: Direction::Mm2s };
    assert_eq!(host.violations().last(), Some(&start));
    host.reset_dma(0);
    ring.restart();
    let slot = ring.push(host.readable(&numbered(4)), WHOLE | 64);
    ring.run(&host, 0);
    ring.doorbell(&host, slot);
    host.pause(20);
    assert_eq!(ring.status(slot), status::CMPLTED.mask() | 64);
}

#[test]
fn ioc_comes_after_threshold_packets_and_counts_packets_not_descriptors() {
    let (host, mut ring) = one_channel(dmacr::IRQ_THRESHOLD.put(dmacr::IOC_IRQ_EN.mask(), 2));
    let data = host.readable(&numbered(4));
    let left = || dmasr::IRQ_THRESHOLD_STS.of(host.status(0, Direction::Mm2s));
    let ioc = || dmasr::IOC_IRQ.is_set(host.status(0, Direction::Mm2s));
    assert_eq!(left(), 2);
    ring.push(data, SOF | 64);
    let tail = ring.push(data, EOF | 64);
    ring.doorbell(&host, tail);
    assert_eq!(host.port.wait_interrupt(microseconds(20)), None, "one packet of two");
    assert_eq!((left(), ioc()), (1, false));
    let tail = ring.push(data, WHOLE | 64);
    ring.doorbell(&host, tail);
    assert_eq!(host.port.wait_interrupt(microseconds(20)), Some(1));
    assert_eq!((left(), ioc()), (2, true));
}

#[test]
fn the_delay_timer_brings_the_packets_that_the_threshold_leaves_over() {
    let control = dmacr::IRQ_THRESHOLD.put(dmacr::DLY_IRQ_EN.mask(), 10);
    let (host, mut ring) = one_channel(dmacr::IRQ_DELAY.put(control, 4));
    assert_eq!(host.port.wait_interrupt(microseconds(100)), None, "not before a packet");
    let data = host.readable(&numbered(4));
    let tail = ring.push(data, WHOLE | 64);
    ring.doorbell(&host, tail);
    host.pause(1);
    let running = host.status(0, Direction::Mm2s);
    assert!((1..=4).contains(&dmasr::IRQ_DELAY_STS.of(running)), "{running:#x}");
    assert_eq!(dmasr::IRQ_THRESHOLD_STS.of(running), 9);
    let start = host.port.now();
    assert_eq!(host.port.wait_interrupt(microseconds(100)), Some(1));
    // Four ticks of 125 clocks at 275 MHz are 1.8 us.
    assert!(host.port.now() - start < microseconds(2));
    let value = host.status(0, Direction::Mm2s);
    assert_eq!(value & dmasr::IRQS, dmasr::DLY_IRQ.mask());
    assert_eq!(dmasr::IRQ_THRESHOLD_STS.of(value), 10, "the timer reloads the count");
}

#[test]
fn each_packet_restarts_the_delay_timer() {
    let control = dmacr::IRQ_THRESHOLD.put(dmacr::DLY_IRQ_EN.mask(), 10);
    // 40 x 125 clocks are 18 us.
    let (host, mut ring) = one_channel(dmacr::IRQ_DELAY.put(control, 40));
    let data = host.readable(&numbered(4));
    for _ in 0..4 {
        let tail = ring.push(data, WHOLE | 64);
        ring.doorbell(&host, tail);
        host.pause(12);
        assert!(!dmasr::DLY_IRQ.is_set(host.status(0, Direction::Mm2s)));
    }
    host.pause(12);
    assert!(dmasr::DLY_IRQ.is_set(host.status(0, Direction::Mm2s)));
}

#[test]
fn a_cyclic_ring_runs_round_whatever_cmplted_says() {
    let (host, ring) = one_channel(dmacr::CYCLIC_BD.mask());
    let data = host.readable(&numbered(4));
    for slot in 0..4 {
        ring.fill(slot, data, WHOLE | 64);
        ring.set(slot, STATUS, status::CMPLTED.mask());
    }
    // This address is not in the chain.
    ring.doorbell_at(&host, 0x50);
    host.pause(20);
    // The stream is not read: the FIFO's 512 beats stop the engine, not the ring's 16.
    assert_eq!(host.board.counts().beats_read, 512);
    let value = host.status(0, Direction::Mm2s);
    assert_eq!(value & (dmasr::ERRORS | dmasr::IDLE.mask() | dmasr::HALTED.mask()), 0);
    host.assert_no_violation();
    host.write(0, Direction::Mm2s, DMACR, 0x0001_0010);
    host.wait_halted(0, Direction::Mm2s, true);
}

#[test]
fn an_interrupt_that_is_unmasked_before_it_is_acknowledged_comes_again() {
    let (host, mut ring) = one_channel(dmacr::IOC_IRQ_EN.mask());
    let tail = ring.push(host.readable(&numbered(4)), WHOLE | 64);
    ring.doorbell(&host, tail);
    let short = microseconds(20);
    assert_eq!(host.port.wait_interrupt(short), Some(1));
    assert_eq!(host.port.wait_interrupt(short), None, "the event masked the line");
    host.port.unmask_interrupt();
    assert_eq!(host.port.wait_interrupt(short), Some(2), "the level still stands");
    host.write(0, Direction::Mm2s, DMASR, dmasr::IOC_IRQ.mask());
    host.port.unmask_interrupt();
    assert_eq!(host.port.wait_interrupt(short), None);
    assert_eq!(host.board.counts().interrupts, 1, "one rising edge");
}

#[test]
fn an_interrupt_that_is_not_enabled_is_latched_and_not_delivered() {
    let (host, mut ring) = one_channel(0);
    let tail = ring.push(host.readable(&numbered(4)), WHOLE | 64);
    ring.doorbell(&host, tail);
    assert_eq!(host.port.wait_interrupt(microseconds(20)), None);
    assert!(dmasr::IOC_IRQ.is_set(host.status(0, Direction::Mm2s)));
    host.write(0, Direction::Mm2s, DMACR, 0x0001_1001);
    assert_eq!(host.port.wait_interrupt(microseconds(20)), Some(1), "enabled afterwards");
}

#[test]
fn idle_says_that_the_tail_is_reached_and_a_new_tail_resumes() {
    let (host, mut ring) = one_channel(0);
    let idle = || dmasr::IDLE.is_set(host.status(0, Direction::Mm2s));
    assert!(!idle(), "nothing was queued yet");
    let data = host.readable(&numbered(4));
    for packet in 0..9 {
        let tail = ring.push(data, WHOLE | 64);
        ring.doorbell(&host, tail);
        assert!(!idle());
        host.pause(5);
        assert!(idle());
        assert_eq!(ring.status(tail), status::CMPLTED.mask() | 64);
        assert_eq!(host.board.counts().descriptors, packet + 1);
    }
    host.assert_no_violation();
}

/// Runs a step of three bodies, three result beats a stream, into buffers of `buffers` beats.
fn results_into(buffers: &[u32]) -> (Machine, Vec<usize>) {
    let mut machine = Machine::new(BoardConfig { strict: false, ..BoardConfig::default() });
    let step = Step::falling(3);
    step.write_arguments(&machine.host);
    let mut flight = Flight::default();
    let mut slots = Vec::new();
    for ring in &mut machine.s2mm {
        slots = buffers
            .iter()
            .map(|beats| ring.push(machine.host.writable(*beats as usize), beats * 16))
            .collect();
        ring.doorbell(&machine.host, *slots.last().expect("at least one"));
    }
    machine.start();
    machine.send(&mut flight, &step.lanes());
    machine.host.pause(50);
    (machine, slots)
}

#[test]
fn results_mark_the_first_and_last_descriptor_and_count_their_bytes() {
    let (cmplted, rxsof, rxeof) =
        (status::CMPLTED.mask(), status::RXSOF.mask(), status::RXEOF.mask());
    let (machine, _) = results_into(&[4]);
    assert_eq!(machine.s2mm[3].status(0), cmplted | rxsof | rxeof | 48);
    let (machine, _) = results_into(&[2, 4]);
    assert_eq!(machine.s2mm[3].status(0), cmplted | rxsof | 32);
    assert_eq!(machine.s2mm[3].status(1), cmplted | rxeof | 16);
    let (machine, _) = results_into(&[1, 1, 1]);
    assert_eq!(machine.s2mm[0].status(0), cmplted | rxsof | 16);
    assert_eq!(machine.s2mm[0].status(1), cmplted | 16);
    assert_eq!(machine.s2mm[0].status(2), cmplted | rxeof | 16);
    let (machine, _) = results_into(&[3, 3]);
    assert_eq!(machine.s2mm[1].status(0), cmplted | rxsof | rxeof | 48);
    assert_eq!(machine.s2mm[1].status(1), 0, "a packet begins in a fresh descriptor");
    machine.host.assert_no_violation();
}

#[test]
fn a_packet_longer_than_its_buffers_is_dma_int_err_and_halts() {
    let (machine, slots) = results_into(&[1, 1]);
    for ring in &machine.s2mm {
        let value = machine.host.status(ring.core, ring.direction);
        assert_eq!(value & dmasr::ERRORS, dmasr::DMA_INT_ERR.mask(), "{value:#x}");
        assert!(dmasr::HALTED.is_set(value), "{value:#x}");
        assert!(!status::RXEOF.is_set(ring.status(slots[1])));
        // An acknowledged interrupt does not come again by itself.
        machine.host.write(ring.core, ring.direction, DMASR, dmasr::IRQS);
        machine.host.pause(5);
        let value = machine.host.status(ring.core, ring.direction);
        assert_eq!(value & dmasr::IRQS, 0, "{value:#x}");
    }
    assert_eq!(machine.host.board.counts().beats_written, 4 * 2);
}

#[test]
fn after_a_failed_step_a_reset_of_everything_makes_the_next_step_right() {
    let mut machine = Machine::new(BoardConfig { strict: false, ..BoardConfig::default() });
    let step = Step::falling(6);
    step.write_arguments(&machine.host);
    let mut flight = Flight::default();
    machine.arm(&mut flight, &[3; CORES]);
    machine.start();
    machine.send(&mut flight, &step.lanes());
    let failure = machine.wait(&flight, LONG).expect_err("half of the room");
    assert!(matches!(failure, Failure::Dma { direction: Direction::S2mm, .. }), "{failure:?}");
    machine.recover();
    let outcome = machine.step(&step).expect("the step completes");
    assert_same(&outcome.bodies, &Step::fallen(6));
}

#[test]
fn a_stop_in_the_middle_halts_and_a_start_begins_at_curdesc() {
    let (host, ring) = one_channel(0);
    ring.fill(0, host.readable(&numbered(600)), WHOLE | (600 * 16));
    ring.doorbell(&host, 0);
    host.pause(20);
    host.write(0, Direction::Mm2s, DMACR, 0x0001_0000);
    host.wait_halted(0, Direction::Mm2s, true);
    assert_eq!(ring.status(0), 0, "it never completed");
    host.reset_accelerator();
    ring.fill(2, host.readable(&numbered(4)), WHOLE | 64);
    ring.point(&host, ring.at(2));
    host.run_channel(0, Direction::Mm2s, 0);
    ring.doorbell(&host, 2);
    host.pause(20);
    assert_eq!(ring.status(2), status::CMPLTED.mask() | 64);
    host.assert_no_violation();
}

#[test]
fn a_tail_moved_while_the_engine_is_busy_moves_the_pause_point_only() {
    let (host, ring) = one_channel(0);
    // More than the FIFO takes.
    ring.fill(0, host.readable(&numbered(600)), WHOLE | (600 * 16));
    ring.fill(1, host.readable(&numbered(4)), WHOLE | 64);
    ring.doorbell(&host, 0);
    host.pause(20);
    ring.doorbell(&host, 1);
    host.pause(20);
    assert_eq!((ring.status(0), ring.status(1)), (0, 0));
    assert_eq!(host.board.counts().beats_read, 512, "nothing was moved twice");
    // Empties the FIFO.
    host.reset_accelerator();
    host.pause(20);
    assert_eq!(ring.status(0), status::CMPLTED.mask() | 9_600);
    assert_eq!(ring.status(1), status::CMPLTED.mask() | 64);
    assert!(dmasr::IDLE.is_set(host.status(0, Direction::Mm2s)));
    assert_eq!(host.board.counts().beats_read, 604);
    host.assert_no_violation();
}

#[test]
fn keyhole_reads_one_address_for_every_beat() {
    let mut machine = Machine::new(BoardConfig::default());
    for ring in &machine.mm2s {
        let host = &machine.host;
        host.write(ring.core, ring.direction, DMACR, 0x0001_0009);
    }
    // Every beat of a body's pose stream is its first one: position and orientation read alike.
    let step = Step { integrate: false, ..Step::falling(4) };
    let outcome = machine.step(&step).expect("the step completes");
    let first: Vec<[u32; 4]> = bits(&outcome.bodies[0]).to_vec();
    assert_eq!(bits(&outcome.bodies[2])[..2], first[..2], "bodies 0 and 2 share streams 0 and 1");
}

#[test]
fn a_descriptor_with_garbage_above_its_length_field_moves_its_length() {
    let (host, ring) = one_channel(0);
    ring.fill(0, host.readable(&numbered(4)), WHOLE | 64);
    ring.set(0, CONTROL, WHOLE | 64 | 0xF000_0000);
    ring.doorbell(&host, 0);
    host.pause(20);
    assert_eq!(ring.status(0), status::CMPLTED.mask() | 64);
}

#[test]
fn a_buffer_changes_hands_only_between_its_owners() {
    let host = Host::new(BoardConfig::default());
    let (address, beats) = host.port.allocate(4).expect("there is room");
    assert!(host.port.take_back(address).is_err(), "the CPU has it");
    let short: Box<[Beat]> = numbered(3).into();
    assert!(host.port.hand_over(address, short, DeviceAccess::Read).is_err());
    host.port.hand_over(address, beats, DeviceAccess::Read).expect("the CPU owns it");
    let again: Box<[Beat]> = numbered(4).into();
    assert!(host.port.hand_over(address, again, DeviceAccess::Write).is_err());
    assert!(host.port.take_back(address + 16).is_err());
    assert_eq!(host.take(address).len(), 4);
    host.port.release(address).expect("it was allocated");
    assert!(host.port.release(address).is_err());
}
