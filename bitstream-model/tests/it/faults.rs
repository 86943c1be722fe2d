//! Every fault that can be injected, as a driver sees it at registers, descriptors and the
//! interrupt line. After a reset the board works as before.

use bitstream_model::{BoardConfig, Direction, Fault, FaultKind, FaultPlan, StepPhase, When};
use pgs_interface::axi_dma::{CHANNEL_REGISTERS, DMACR, dmacr, dmasr};
use pgs_interface::control::{self, ErrorCode};

use crate::common;
use crate::common::scene::{Step, bits};
use crate::common::sg::{Failure, Machine};
use crate::common::{BOTH, CORES, Host};

fn machine() -> Machine {
    Machine::new(BoardConfig::default())
}

fn scene() -> Step {
    Step::on_ground(30, 200)
}

fn plan(text: &str) -> FaultPlan {
    text.parse().unwrap_or_else(|error| panic!("{text}: {error}"))
}

/// The bodies after a step without a fault.
fn undisturbed() -> Vec<[[u32; 4]; 4]> {
    machine().step(&scene()).expect("no fault").bodies.iter().map(bits).collect()
}

/// Runs a step with a fault, which must happen; after a reset the next step must be right.
fn fails(text: &str) -> Failure {
    let mut machine = machine();
    machine.host.board.inject(plan(text));
    let failure = machine.step(&scene()).map(|_| ()).expect_err(text);
    assert_eq!(machine.host.board.faults(), 1, "{text}");
    machine.recover();
    let outcome = machine.step(&scene()).unwrap_or_else(|error| panic!("{text}: {error:?}"));
    assert!(outcome.bodies.iter().map(bits).eq(undisturbed()), "{text}");
    machine.host.assert_no_violation();
    failure
}

/// Runs a step with a fault, which must happen and change no result; returns the clocks that it
/// adds.
fn survives(text: &str) -> i64 {
    let mut machines = [machine(), machine()];
    machines[1].host.board.inject(plan(text));
    let [without, with] = machines.each_mut().map(|machine| {
        let outcome = machine.step(&scene()).unwrap_or_else(|error| panic!("{text}: {error:?}"));
        assert!(outcome.bodies.iter().map(bits).eq(undisturbed()), "{text}");
        machine.host.assert_no_violation();
        i64::try_from(machine.host.board.counts().cycles).expect("a short run")
    });
    assert_eq!(machines[1].host.board.faults(), 1, "{text}");
    with - without
}

#[test]
fn each_error_bit_of_a_channel_is_set_where_it_is_planned() {
    for (name, bit) in [
        ("dma-int-err", dmasr::DMA_INT_ERR),
        ("dma-slv-err", dmasr::DMA_SLV_ERR),
        ("dma-dec-err", dmasr::DMA_DEC_ERR),
        ("sg-int-err", dmasr::SG_INT_ERR),
        ("sg-slv-err", dmasr::SG_SLV_ERR),
        ("sg-dec-err", dmasr::SG_DEC_ERR),
        ("sg-dec-err-write", dmasr::SG_DEC_ERR),
    ] {
        for (channel, direction) in [("mm2s,phase=friction2", BOTH[0]), ("s2mm", BOTH[1])] {
            for core in 0..CORES {
                let failure = fails(&format!("{name}@dma{core}.{channel}"));
                let errors = bit.mask();
                assert_eq!(failure, Failure::Dma { core, direction, errors }, "{name}");
            }
        }
    }
}

#[test]
fn a_channel_that_stalls_or_a_part_that_hangs_is_a_deadline() {
    for text in [
        "stall@dma3.s2mm",
        "stall@dma0.mm2s,phase=contact3,beat=100",
        "accelerator-hang,phase=friction4,beat=30",
    ] {
        assert_eq!(fails(text), Failure::Deadline, "{text}");
    }
    assert_eq!(fails("no-done"), Failure::NotDone);
}

#[test]
fn a_hanging_part_lets_time_pass_while_another_fault_is_due() {
    for text in ["no-done; dma-dec-err,step=9", "accelerator-hang; accelerator-error=3,step=9"] {
        let mut machine = machine();
        machine.host.board.inject(plan(text));
        machine.step(&scene()).map(|_| ()).expect_err(text);
        assert_eq!(machine.host.board.faults(), 1, "{text}");
    }
}

#[test]
fn the_receiver_detects_packets_of_another_length() {
    let code = |failure| match failure {
        Failure::Accelerator(code, stream, _) => (code, stream),
        other => panic!("{other:?}"),
    };
    let short = fails("short-packet@dma1.mm2s,phase=contact2,beat=7");
    assert_eq!(code(short), (ErrorCode::TlastEarly as u32, 1));
    for text in ["long-packet@dma2.mm2s,phase=load", "no-tlast@dma2.mm2s,phase=poses"] {
        assert_eq!(code(fails(text)), (ErrorCode::TlastMissing as u32, 2), "{text}");
    }
    let errors = dmasr::DMA_INT_ERR.mask();
    let (core, direction) = (1, Direction::S2mm);
    assert_eq!(fails("long-packet@dma1.s2mm"), Failure::Dma { core, direction, errors });
}

#[test]
fn every_error_of_the_accelerator_can_be_had_in_any_phase() {
    for code in ErrorCode::ALL {
        for phase in ["load", "contact1", "friction4", "poses"] {
            let text = format!("accelerator-error={},phase={phase}", code as u32);
            let Failure::Accelerator(found, ..) = fails(&text) else { panic!("{text}") };
            assert_eq!(found, code as u32, "{text}");
        }
    }
}

#[test]
fn a_corrupt_beat_is_in_the_sums_and_nowhere_else() {
    for (text, received) in [
        ("corrupt=0x3F000000@dma0.mm2s,phase=poses,beat=4", true),
        ("corrupt=0x3F000000@dma3.s2mm,beat=5", false),
    ] {
        let mut machine = machine();
        let right = machine.step(&scene()).expect("no fault");
        machine.host.board.inject(plan(text));
        let wrong = machine.step(&scene()).expect("nothing notices");
        assert_eq!(machine.host.board.faults(), 1);
        assert_eq!(wrong.sum_received != right.sum_received, received, "{text}");
        assert!(!wrong.bodies.iter().map(bits).eq(undisturbed()), "{text}");
    }
}

#[test]
fn slow_ports_and_late_words_cost_time_and_change_nothing() {
    // 46 beats or so of a packet, 500 clocks each.
    assert!(survives("slow=500@dma1.mm2s,phase=contact4,beat=20") > 20_000);
    assert!(survives("slow=500@dma0.s2mm") > 10_000);
    // 1 ms at 275 MHz.
    assert!(survives("late-cmplted=1000000@dma2.s2mm") > 200_000);
    survives("late-cmplted=1000@dma2.mm2s,phase=contact1");
    survives("irq-spurious,step=1");
    survives("irq-storm=50,step=1");
}

#[test]
fn an_interrupt_is_lost_or_late_and_the_descriptors_still_complete() {
    for text in ["irq-drop", "irq-delay=300000"] {
        let mut machine = machine();
        machine.looks_every(common::microseconds(50));
        machine.host.board.inject(plan(text));
        machine.step(&scene()).expect("the descriptors are complete");
        assert_eq!(machine.host.board.faults(), 1, "{text}");
        // The host polls the descriptors, and clears the bits that would have raised the line.
        assert_eq!(machine.host.board.counts().interrupts, 0, "{text}");
        machine.step(&scene()).expect("no fault");
        assert_eq!(machine.host.board.counts().interrupts, 1, "{text}");
    }
}

#[test]
fn a_channel_halts_late_or_never_and_a_reset_ends_late_or_never() {
    let halted = |text: &str| {
        let machine = machine();
        machine.host.board.inject(plan(text));
        let control = machine.host.read(1, Direction::Mm2s, DMACR);
        machine.host.write(1, Direction::Mm2s, DMACR, control & !dmacr::RS.mask());
        [10, 2000].map(|microseconds| {
            machine.host.port.pause(common::microseconds(microseconds));
            dmasr::HALTED.is_set(machine.host.status(1, Direction::Mm2s))
        })
    };
    assert_eq!(halted("irq-drop"), [true, true]);
    assert_eq!(halted("halt-delay@dma1.mm2s"), [false, true]);
    assert_eq!(halted("halt-never@dma1.mm2s"), [false, false]);
    let reset = |text: &str| {
        let machine = machine();
        machine.host.board.inject(plan(text));
        machine.host.write(2, Direction::Mm2s, DMACR, dmacr::RESET.mask());
        machine.host.set_control(control::RESET, 1);
        [10, 2000].map(|microseconds| {
            machine.host.port.pause(common::microseconds(microseconds));
            let core = dmacr::RESET.is_set(machine.host.read(2, Direction::S2mm, DMACR));
            (core, machine.host.control(control::RESET) != 0)
        })
    };
    assert_eq!(reset("irq-drop"), [(false, false), (false, false)]);
    assert_eq!(reset("reset-slow@dma2"), [(true, false), (false, false)]);
    assert_eq!(reset("reset-never@dma2"), [(true, false), (true, false)]);
    assert_eq!(reset("reset-slow@accelerator"), [(false, true), (false, false)]);
    assert_eq!(reset("reset-never@accelerator"), [(false, true), (false, true)]);
}

#[test]
fn a_descriptor_can_have_an_error_bit_that_its_channel_lacks() {
    for (name, bit) in [("bd-int-err", 28), ("bd-slv-err", 29), ("bd-dec-err", 30)] {
        let mut machine = machine();
        machine.host.board.inject(plan(&format!("{name}@dma1.mm2s,phase=load")));
        // The sender of this test looks for Cmplted alone.
        machine.step(&scene()).expect("the channel goes on");
        let status = machine.mm2s[1].status(0);
        assert!(status & 1 << bit != 0 && status & 1 << 31 != 0, "{name}: {status:#x}");
        assert_eq!(machine.host.status(1, Direction::Mm2s) & dmasr::ERRORS, 0, "{name}");
    }
}

#[test]
fn without_power_every_register_reads_all_ones() {
    for text in ["power-lost", "power-lost,access=12", "power-lost@dma0.mm2s,phase=contact2"] {
        let mut machine = machine();
        machine.host.board.inject(plan(text));
        machine.step(&scene()).map(|_| ()).expect_err(text);
        assert_eq!(machine.host.control(control::IDENTIFICATION), u32::MAX, "{text}");
        assert_eq!(machine.host.status(3, Direction::S2mm), u32::MAX, "{text}");
    }
}

#[test]
fn another_bitstream_names_itself_and_has_forgotten_the_step() {
    let mut machine = machine();
    machine.host.board.inject(plan("other-bitstream=0x1234@dma3.mm2s,phase=contact2,beat=9"));
    assert_eq!(machine.step(&scene()).map(|_| ()), Err(Failure::Deadline));
    assert_eq!(machine.host.control(control::IDENTIFICATION), 0x1234);
    assert_eq!(machine.host.control(control::VERSION), 0);
    assert!(dmasr::HALTED.is_set(machine.host.status(0, Direction::Mm2s)));
}

#[test]
fn the_same_bitstream_again_has_forgotten_everything_but_memory() {
    let text = "reloaded@dma3.mm2s,phase=contact2,beat=9";
    for text in [text, "reloaded"] {
        assert_eq!(fails(text), Failure::Deadline, "{text}");
    }
    let mut machine = machine();
    machine.host.board.inject(plan(text));
    machine.step(&scene()).map(|_| ()).expect_err(text);
    let new = Host::new(BoardConfig::default());
    for (core, direction) in (0..CORES).flat_map(|core| BOTH.map(|direction| (core, direction))) {
        for register in CHANNEL_REGISTERS {
            let [found, expected] =
                [&machine.host, &new].map(|host| host.read(core, direction, register));
            assert_eq!(found, expected, "dma{core} {direction} {}", register.name);
        }
    }
    for register in control::REGISTERS {
        let [found, expected] = [&machine.host, &new].map(|host| host.control(*register));
        assert_eq!(found, expected, "{}", register.name);
    }
    // The load and the first pass were over.
    assert!([0, 1].iter().all(|slot| machine.mm2s[3].status(*slot) >> 31 == 1));
}

#[test]
fn a_fault_of_a_part_that_does_not_exist_never_happens() {
    let mut machine = machine();
    for direction in BOTH {
        machine.host.board.inject(Fault::new(FaultKind::DmaDecErr).on(4, direction));
        machine.host.board.inject(Fault::new(FaultKind::Stall).on(usize::MAX, direction));
    }
    let late = Fault::new(FaultKind::Stall).on(0, Direction::S2mm).when(When::Beat(1 << 40));
    machine.host.board.inject(late);
    machine.step(&scene()).expect("the step completes");
    assert_eq!(machine.host.board.faults(), 0);
}

#[test]
fn a_fault_waits_for_its_step_and_happens_as_often_as_planned() {
    let mut machine = machine();
    machine.host.board.inject(plan("irq-spurious,step=3; stall@dma1.mm2s,step=2"));
    machine.step(&scene()).expect("the first step");
    assert_eq!(machine.step(&scene()).map(|_| ()), Err(Failure::Deadline));
    machine.recover();
    machine.step(&scene()).expect("the third step");
    assert_eq!(machine.host.board.faults(), 2);
    machine.host.board.inject(plan("accelerator-hang,times=2"));
    for _ in 0..2 {
        assert_eq!(machine.step(&scene()).map(|_| ()), Err(Failure::Deadline));
        machine.recover();
    }
    machine.step(&scene()).expect("that was all");
    machine.host.assert_no_violation();
}

#[test]
fn every_late_status_arrives() {
    let mut machine = machine();
    let late = |pass| format!("late-cmplted=900000@dma1.mm2s,phase=contact{pass}");
    machine.host.board.inject(plan(&format!("{}; {}", late(1), late(2))));
    machine.step(&scene()).expect("nobody waits for senders");
    assert_eq!(machine.host.board.faults(), 2);
    let complete = |machine: &Machine| [1, 2, 3].map(|slot| machine.mm2s[1].status(slot) >> 31);
    assert_eq!(complete(&machine), [0, 0, 1]);
    machine.host.pause(2000);
    assert_eq!(complete(&machine), [1, 1, 1]);
}

#[test]
fn a_receiver_fails_in_each_step_that_is_taken_again() {
    let mut machine = machine();
    machine.host.board.inject(plan("dma-slv-err@dma0.s2mm,times=2; stall@dma1.s2mm,step=3"));
    for _ in 0..2 {
        let failure = machine.step(&scene()).map(|_| ()).expect_err("a slave error");
        assert!(matches!(failure, Failure::Dma { core: 0, .. }), "{failure:?}");
        machine.recover();
    }
    assert_eq!(machine.step(&scene()).map(|_| ()), Err(Failure::Deadline));
    machine.recover();
    machine.step(&scene()).expect("that was all");
    machine.host.assert_no_violation();
}

#[test]
fn the_board_lists_the_packets_of_a_step() {
    let mut machine = machine();
    for _ in 0..2 {
        machine.step(&scene()).expect("no fault");
        let packets = machine.host.board.packets();
        // Velocities, eight passes, poses; results.
        let of = |direction, core| {
            packets.iter().filter(move |p| p.direction == direction && p.core == core)
        };
        for core in 0..CORES {
            assert_eq!(of(Direction::Mm2s, core).count(), 10);
            assert_eq!(of(Direction::S2mm, core).count(), 1);
            // Two beats of each of 200 collisions on channels 0 to 2, one on channel 3.
            let beats = if core == 3 { 200 } else { 400 };
            let pass = of(Direction::Mm2s, core).nth(1).expect("the first pass");
            assert_eq!((pass.beats, pass.descriptors), (beats, 1));
            assert_eq!(pass.phase, Some(StepPhase::Contact(1)));
        }
    }
}
