//! The fence of a board: every DMA master meets a decode error outside it, and touches no memory
//! there.

use bitstream_model::{
    BoardConfig, Denied, DeviceAccess, Direction, Master, Quirks, ViolationKind,
};
use pgs_interface::axi_dma::{dmacr, dmasr};
use pgs_interface::control::{FENCE_BASE, FENCE_SIZE};
use pgs_interface::descriptor::{WORDS, status};
use pgs_interface::fence::Fence;
use pgs_interface::record::Beat;

use crate::common::ring::{Ring, WHOLE};
use crate::common::scene::Step;
use crate::common::sg::{Flight, Machine};
use crate::common::{Host, numbered};

const GUARD: u64 = 0x5400_0000;

fn fenced(unfenced: &'static [(usize, Master)]) -> BoardConfig {
    let quirks = Quirks { unfenced, ..Quirks::default() };
    BoardConfig { fence: Some(Fence::default()), quirks, ..BoardConfig::default() }
}

#[test]
fn a_board_reports_its_fence_and_allocates_inside_it() {
    let host = Host::new(BoardConfig::default());
    assert_eq!([host.control(FENCE_BASE), host.control(FENCE_SIZE)], [0, 0]);
    assert_eq!(host.port.guard(), None);
    let host = Host::new(fenced(&[]));
    assert_eq!([host.control(FENCE_BASE), host.control(FENCE_SIZE)], [0x5000, 0x400]);
    for beats in [1, 1000, 100_000] {
        let (address, _) = host.port.allocate(beats).expect("there is room");
        assert!(Fence::default().contains(address, beats as u64 * 16), "{address:#x}");
    }
    host.port.allocate(4 << 20).expect_err("64 MiB, of which some are in use");
    assert_eq!(host.port.guard(), Some(GUARD..GUARD + 0x1_0000));
    let (address, _) = host.port.allocate_guard(4).expect("there is room");
    assert_eq!(address, GUARD);
    host.port.allocate_guard_shared(4).expect_err("one at a time");
    host.port.release(address).expect("allocated");
    host.port.allocate_guard(4097).expect_err("longer than the guard");
    host.assert_no_violation();
}

/// A ring in the guard, whose descriptor reads a buffer in the fence.
fn fetch_from_guard(config: BoardConfig) -> (u32, Host, Ring) {
    let host = Host::new(config);
    let words = host.port.allocate_guard_shared(2 * WORDS).expect("there is room");
    let mut ring = Ring::on(words, 1, Direction::Mm2s);
    ring.push(host.readable(&numbered(4)), WHOLE | 64);
    ring.run(&host, dmacr::ERR_IRQ_EN.mask());
    ring.doorbell(&host, 0);
    host.pause(20);
    (host.status(1, Direction::Mm2s) & dmasr::ERRORS, host, ring)
}

#[test]
fn a_descriptor_outside_the_fence_is_sg_dec_err_and_stays_as_it_is() {
    let (errors, host, ring) = fetch_from_guard(fenced(&[(0, Master::Sg)]));
    assert_eq!((errors, ring.status(0)), (dmasr::SG_DEC_ERR.mask(), 0));
    host.assert_no_violation();
    let (errors, host, ring) = fetch_from_guard(fenced(&[(1, Master::Sg)]));
    assert_eq!((errors, status::CMPLTED.is_set(ring.status(0))), (0, true));
    host.assert_no_violation();
}

/// A step whose channel 2 has its buffer of that direction in the guard.
fn move_through_guard(config: BoardConfig, direction: Direction) -> (u32, u32, Machine) {
    let mut machine = Machine::new(config);
    let (address, mut buffer) = machine.host.port.allocate_guard(4).expect("there is room");
    buffer.fill(Beat([0x5A5A_5A5A; 4]));
    let access = match direction {
        Direction::Mm2s => DeviceAccess::Read,
        Direction::S2mm => DeviceAccess::Write,
    };
    machine.host.port.hand_over(address, buffer, access).expect("the CPU owns it");
    let ring = match direction {
        Direction::Mm2s => {
            let slot = machine.mm2s[2].push(address, WHOLE | 64);
            machine.mm2s[2].doorbell(&machine.host, slot);
            &machine.mm2s[2]
        }
        Direction::S2mm => {
            let step = Step::falling(4);
            step.write_arguments(&machine.host);
            let mut flight = Flight::default();
            let slot = machine.s2mm[2].push(address, 64);
            machine.s2mm[2].doorbell(&machine.host, slot);
            machine.start();
            machine.send(&mut flight, &step.lanes());
            &machine.s2mm[2]
        }
    };
    machine.host.pause(50);
    let errors = machine.host.status(2, direction) & dmasr::ERRORS;
    (errors, ring.status(0), machine)
}

#[test]
fn data_outside_the_fence_is_dma_dec_err_and_stays_as_it_is() {
    for direction in [Direction::Mm2s, Direction::S2mm] {
        let (errors, word, machine) = move_through_guard(fenced(&[]), direction);
        assert_eq!(errors, dmasr::DMA_DEC_ERR.mask(), "{direction}");
        assert!(status::DMA_DEC_ERR.is_set(word) && !status::CMPLTED.is_set(word));
        machine.host.assert_no_violation();
        assert_eq!(machine.host.take(GUARD)[..], [Beat([0x5A5A_5A5A; 4]); 4], "{direction}");
    }
    const OPEN: [(usize, Master); 2] =
        [(2, Master::Data(Direction::Mm2s)), (2, Master::Data(Direction::S2mm))];
    for (k, direction) in [Direction::Mm2s, Direction::S2mm].into_iter().enumerate() {
        let (errors, word, machine) = move_through_guard(fenced(&OPEN[k..=k]), direction);
        assert_eq!((errors, status::CMPLTED.is_set(word)), (0, true), "{direction}");
        machine.host.assert_no_violation();
    }
}

/// The checker of grants is the same with a fence as without.
#[test]
fn an_access_outside_the_fence_that_is_not_granted_is_a_violation_too() {
    let host = Host::lenient(fenced(&[]));
    let mut ring = Ring::new(&host, 0, Direction::Mm2s, 2);
    ring.push(0x1000, WHOLE | 64);
    ring.run(&host, dmacr::ERR_IRQ_EN.mask());
    ring.doorbell(&host, 0);
    host.pause(20);
    assert_eq!(host.status(0, Direction::Mm2s) & dmasr::ERRORS, dmasr::DMA_DEC_ERR.mask());
    let (core, direction, denied) = (0, Direction::Mm2s, Denied::Unmapped);
    let kind = ViolationKind::OutsideGrant { core, direction, address: 0x1000, bytes: 64, denied };
    assert_eq!(host.violations(), [kind]);
}
