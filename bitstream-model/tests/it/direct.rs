//! Direct mode: the same steps without descriptors, one transfer a channel at a time.

use std::time::Duration;

use bitstream_model::{BoardConfig, Denied, Direction, ViolationKind};
use pgs_interface::axi_dma::{ADDRESS, ADDRESS_MSB, DMACR, DMASR, LENGTH, dmacr, dmasr};
use pgs_interface::control::{self, ap_ctrl};
use pgs_interface::record::{BEAT_BYTES, Beat};

use crate::common::ring::halves;
use crate::common::scene::{Body, Step, bits, unpack};
use crate::common::sg::{LONG, Machine};
use crate::common::{CORES, Host, microseconds, numbered};

fn without_scatter_gather() -> BoardConfig {
    BoardConfig { scatter_gather: false, ..BoardConfig::default() }
}

fn transfer(host: &Host, core: usize, direction: Direction, address: u64, bytes: usize) {
    let [low, high] = halves(address);
    host.write(core, direction, ADDRESS, low);
    host.write(core, direction, ADDRESS_MSB, high);
    host.write(core, direction, LENGTH, u32::try_from(bytes).expect("at most 26 bits"));
}

/// Acknowledges IOC; returns whether it was set.
fn completed(host: &Host, core: usize, direction: Direction) -> bool {
    let value = host.status(core, direction);
    assert_eq!(value & dmasr::ERRORS, 0, "dma{core} {direction}: {value:#x}");
    let done = dmasr::IOC_IRQ.is_set(value);
    if done {
        host.write(core, direction, DMASR, dmasr::IOC_IRQ.mask());
    }
    done
}

fn run_all(host: &Host) {
    for core in 0..CORES {
        host.run_channel(core, Direction::S2mm, dmacr::IOC_IRQ_EN.mask());
        host.run_channel(core, Direction::Mm2s, dmacr::IOC_IRQ_EN.mask());
    }
}

/// Runs a step; the result buffers are `spare` beats longer than the packets. Returns the bodies
/// and the value of LENGTH on each result channel.
fn step(host: &Host, step: &Step, spare: usize) -> (Vec<Body>, Vec<u32>) {
    step.write_arguments(host);
    let beats = step.bodies.len();
    let outputs: Vec<u64> = (0..CORES)
        .map(|core| {
            let address = host.writable(beats + spare);
            transfer(host, core, Direction::S2mm, address, (beats + spare) * BEAT_BYTES);
            address
        })
        .collect();
    host.set_control(control::AP_CTRL, ap_ctrl::START.mask());
    let lanes = step.lanes();
    let mut queues: Vec<Vec<(u64, usize)>> = lanes
        .iter()
        .map(|lane| {
            let place = |segment: &usize| {
                let beats = &lane.segments[*segment];
                (host.readable(beats), beats.len() * BEAT_BYTES)
            };
            lane.packets.iter().map(place).rev().collect()
        })
        .collect();
    let mut busy = [false; CORES];
    let mut results = [false; CORES];
    let deadline = host.port.now() + LONG;
    while results.contains(&false) {
        assert!(host.port.now() < deadline, "the step takes too long");
        for core in 0..CORES {
            busy[core] &= !completed(host, core, Direction::Mm2s);
            let next = if busy[core] { None } else { queues[core].pop() };
            if let Some((address, bytes)) = next {
                transfer(host, core, Direction::Mm2s, address, bytes);
                busy[core] = true;
            }
            results[core] |= completed(host, core, Direction::S2mm);
        }
    }
    let lengths = (0..CORES).map(|core| host.read(core, Direction::S2mm, LENGTH)).collect();
    let streams: Vec<Box<[Beat]>> = outputs.into_iter().map(|address| host.take(address)).collect();
    (unpack(&streams, beats), lengths)
}

fn assert_same(found: &[Body], expected: &[Body]) {
    assert_eq!(
        found.iter().map(bits).collect::<Vec<_>>(),
        expected.iter().map(bits).collect::<Vec<_>>()
    );
}

#[test]
fn steps_in_direct_mode_give_what_was_calculated_by_hand() {
    for address_width in [32, 40] {
        let config = BoardConfig { address_width, ..without_scatter_gather() };
        let host = Host::new(config);
        run_all(&host);
        for bodies in [1, 3, 40] {
            let (found, _) = step(&host, &Step::falling(bodies), 0);
            assert_same(&found, &Step::fallen(bodies));
        }
        host.assert_no_violation();
    }
}

#[test]
fn direct_mode_and_scatter_gather_give_the_same_bits_with_collisions() {
    let scene = Step { drift: 0.01, coefficient: 0.2, ..Step::on_ground(7, 20) };
    let mut machine = Machine::new(BoardConfig::default());
    let expected = machine.step(&scene).expect("the step completes").bodies;
    let host = Host::new(without_scatter_gather());
    run_all(&host);
    let (found, _) = step(&host, &scene, 0);
    assert_same(&found, &expected);
    // Free fall would end at -5 m/s.
    assert!(found[1..].iter().all(|body| body.linear[1] > -4.1), "{found:?}");
    host.assert_no_violation();
}

#[test]
fn s2mm_length_reads_the_bytes_of_a_packet_shorter_than_its_buffer() {
    let host = Host::new(without_scatter_gather());
    run_all(&host);
    let (found, lengths) = step(&host, &Step::falling(5), 3);
    assert_same(&found, &Step::fallen(5));
    assert_eq!(lengths, [80; CORES]);
    assert_eq!(host.board.counts().beats_written, 20);
}

#[test]
fn idle_and_ioc_come_with_each_transfer_whatever_the_threshold() {
    let host = Host::new(without_scatter_gather());
    let threshold = dmacr::IRQ_THRESHOLD.put(dmacr::IOC_IRQ_EN.mask(), 5);
    host.run_channel(0, Direction::Mm2s, dmacr::IRQ_DELAY.put(threshold, 1));
    assert!(!dmasr::IDLE.is_set(host.status(0, Direction::Mm2s)), "before the first transfer");
    for event in 1..=3 {
        transfer(&host, 0, Direction::Mm2s, host.readable(&numbered(200)), 800);
        assert!(!dmasr::IDLE.is_set(host.status(0, Direction::Mm2s)));
        assert_eq!(host.port.wait_interrupt(microseconds(10)), Some(event));
        let value = host.status(0, Direction::Mm2s);
        assert_eq!(value & dmasr::IRQS, dmasr::IOC_IRQ.mask());
        assert!(dmasr::IDLE.is_set(value));
        host.write(0, Direction::Mm2s, DMASR, value & dmasr::IRQS);
        host.port.unmask_interrupt();
    }
    assert_eq!(host.board.counts().beats_read, 150);
    host.assert_no_violation();
}

#[test]
fn a_length_after_rs_was_cleared_starts_nothing_although_the_channel_has_not_halted() {
    let host = Host::lenient(without_scatter_gather());
    run_all(&host);
    let direction = Direction::Mm2s;
    host.write(0, direction, DMACR, DMACR.reset);
    transfer(&host, 0, direction, host.readable(&numbered(8)), 128);
    assert_eq!(host.violations(), [ViolationKind::DoorbellWhileHalted { core: 0, direction }]);
    host.pause(10);
    assert_eq!(host.board.counts().beats_read, 0);
}

#[test]
fn a_length_while_busy_is_ignored_and_told() {
    let host = Host::lenient(without_scatter_gather());
    run_all(&host);
    let direction = Direction::Mm2s;
    // More than the FIFO takes: it stays busy.
    transfer(&host, 0, direction, host.readable(&numbered(600)), 9_600);
    host.pause(10);
    host.write(0, direction, LENGTH, 64);
    assert_eq!(host.violations(), [ViolationKind::LengthWhileBusy { core: 0, direction }]);
    assert_eq!(host.read(0, direction, LENGTH), 9_600);
    assert!(!completed(&host, 0, direction));
    assert_eq!(host.board.counts().beats_read, 512);
}

#[test]
fn a_length_on_a_scatter_gather_build_is_a_violation() {
    let host = Host::lenient(BoardConfig::default());
    host.run_channel(0, Direction::Mm2s, 0);
    transfer(&host, 0, Direction::Mm2s, host.readable(&numbered(4)), 64);
    host.pause(10);
    assert_eq!(host.violations().len(), 1);
    assert_eq!(host.board.counts().beats_read, 0);
}

#[test]
fn a_misaligned_transfer_is_a_violation_without_an_error_bit() {
    let host = Host::lenient(without_scatter_gather());
    run_all(&host);
    let address = host.readable(&numbered(4)) + 8;
    transfer(&host, 0, Direction::Mm2s, address, 32);
    host.pause(10);
    let result = host.writable(4);
    transfer(&host, 0, Direction::S2mm, result, 60);
    let misaligned = |direction, address, length| ViolationKind::Misaligned {
        core: 0,
        direction,
        address,
        length,
    };
    assert_eq!(
        host.violations(),
        [misaligned(Direction::Mm2s, address, 32), misaligned(Direction::S2mm, result, 60)]
    );
    assert!(completed(&host, 0, Direction::Mm2s), "no error bit, and it ends");
}

#[test]
fn a_packet_longer_than_length_is_dma_int_err_and_the_buffer_is_not_left() {
    let host = Host::lenient(without_scatter_gather());
    run_all(&host);
    let scene = Step::falling(5);
    scene.write_arguments(&host);
    let buffer = host.writable(5);
    transfer(&host, 2, Direction::S2mm, buffer, 3 * BEAT_BYTES);
    host.set_control(control::AP_CTRL, ap_ctrl::START.mask());
    for (core, lane) in scene.lanes().iter().enumerate() {
        for segment in [0, 2] {
            let beats = &lane.segments[segment];
            transfer(&host, core, Direction::Mm2s, host.readable(beats), beats.len() * BEAT_BYTES);
            host.pause(5);
        }
    }
    host.pause(20);
    let value = host.status(2, Direction::S2mm);
    let expected = dmasr::DMA_INT_ERR.mask() | dmasr::ERR_IRQ.mask() | dmasr::HALTED.mask();
    assert_eq!(value & 0xFFFF, expected, "{value:#x}");
    assert!(!dmacr::RS.is_set(host.read(2, Direction::S2mm, DMACR)));
    let beats = host.take(buffer);
    assert_eq!(beats[3..], [Beat::default(); 2]);
    assert_ne!(beats[2], Beat::default());
    host.assert_no_violation();
}

#[test]
fn a_transfer_outside_the_granted_buffers_is_dma_dec_err() {
    let host = Host::lenient(without_scatter_gather());
    run_all(&host);
    let address = host.readable(&numbered(4));
    transfer(&host, 1, Direction::Mm2s, address, 80);
    host.pause(10);
    let value = host.status(1, Direction::Mm2s);
    assert_eq!(value & dmasr::ERRORS, dmasr::DMA_DEC_ERR.mask());
    let (core, direction, denied) = (1, Direction::Mm2s, Denied::PastEnd);
    let kind = ViolationKind::OutsideGrant { core, direction, address, bytes: 80, denied };
    assert_eq!(host.violations(), [kind]);
}

#[test]
fn a_buffer_address_cut_to_32_bits_meets_no_buffer() {
    let host = Host::lenient(without_scatter_gather());
    run_all(&host);
    // Every second buffer stands above 4 GiB.
    let address = [host.readable(&numbered(4)), host.readable(&numbered(4))]
        .into_iter()
        .find(|address| *address >= 1 << 32)
        .expect("one of two");
    transfer(&host, 0, Direction::Mm2s, u64::from(halves(address)[0]), 64);
    host.pause(10);
    let value = host.status(0, Direction::Mm2s);
    assert_eq!(value & dmasr::ERRORS, dmasr::DMA_DEC_ERR.mask());
}

#[test]
fn a_reset_ends_a_transfer_that_waits_for_ever() {
    let host = Host::new(without_scatter_gather());
    run_all(&host);
    transfer(&host, 0, Direction::S2mm, host.writable(4), 64);
    assert_eq!(host.port.wait_interrupt(Duration::from_millis(5)), None);
    host.reset_dma(0);
    let value = host.status(0, Direction::S2mm);
    assert_eq!(value, 0x0001_0001);
    host.assert_no_violation();
}
