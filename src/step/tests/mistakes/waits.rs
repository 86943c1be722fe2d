//! Plants mistakes with waiting: for interrupts, for status bits, for resets, and with its limits.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use bitstream_model::{BoardConfig, Direction};
use pgs_interface::axi_dma::{DMASR, S2MM_OFFSET, dmasr};
use pgs_interface::descriptor::status;

use super::kinds::{ChannelId, Event, Mistake, Trouble};
use super::planted::Endless;
use super::{Bench, Verdict, assert_reported, bits, chain_of, scene};
use crate::StepParameters;

const BOTH: [Direction; 2] = [Direction::Mm2s, Direction::S2mm];

fn within(deadline: Duration) -> StepParameters {
    StepParameters { deadline: Some(deadline), ..StepParameters::default() }
}

/// A time in which no step ends.
const NO_TIME: Duration = Duration::from_nanos(1);
/// A time that no step here takes.
const LONG: Duration = Duration::from_millis(30);

#[test]
fn mistake_05_reset_of_one_direction() {
    assert_reported(
        Mistake::OneDirectionReset,
        "dma0 S2MM has its first descriptor at 0x0",
        |mistake| {
            let mut bench = Bench::open(BoardConfig::default(), mistake, None)?;
            bench.step(20)?;
            let (result, bodies) = bench.step_with(20, &within(NO_TIME));
            let error = result.expect_err("no time");
            assert!(error.may_retry(), "{error}");
            assert_eq!(bits(&bodies), bits(&scene(20).0));
            bench.step(20)?;
            bench.step(9)?;
            bench.close()
        },
    );
}

/// Checks that a step in trouble ends with an error, in time on the board's clock.
fn ends(mistake: Option<Mistake>, trouble: Trouble, deadline: Duration) -> Verdict {
    let mut bench = Bench::open(BoardConfig::default(), mistake, Some(trouble))?;
    let before = bench.planted.time();
    let ended = catch_unwind(AssertUnwindSafe(|| bench.step_with(20, &within(deadline))));
    let took = bench.planted.time() - before;
    let (result, bodies) = ended.map_err(|thrown| {
        assert!(thrown.is::<Endless>(), "another panic");
        format!("no end after {took:?}")
    })?;
    let error = result.err().ok_or("no error")?;
    assert_eq!(bits(&bodies), bits(&scene(20).0), "{error}");
    // The deadline, and a recovery of four cores and the accelerator.
    let limit = deadline + Duration::from_millis(70);
    if took > limit {
        return Err(format!("{took:?} where {limit:?} is the limit: {error}"));
    }
    bench.planted.end_trouble();
    if error.must_reopen() {
        return Ok(());
    }
    bench.step(20)?;
    Ok(())
}

/// Checks that a reset in trouble ends with an error.
fn reset_ends(mistake: Option<Mistake>, trouble: Trouble) -> Verdict {
    let mut bench = Bench::open(BoardConfig::default(), mistake, Some(trouble))?;
    let device = &mut bench.accelerator.device;
    let ended = catch_unwind(AssertUnwindSafe(|| device.reset()));
    let reset = ended.map_err(|thrown| {
        assert!(thrown.is::<Endless>(), "another panic");
        "no end after a reset".to_owned()
    })?;
    reset.err().ok_or("no error").map_err(str::to_owned).map(drop)
}

#[test]
fn mistake_06_unbounded_wait() {
    for trouble in [
        Trouble::DoorbellLost((1, Direction::Mm2s)),
        Trouble::DoorbellLost((2, Direction::S2mm)),
        Trouble::NeverRuns((0, Direction::S2mm)),
        Trouble::NeverRuns((3, Direction::Mm2s)),
        Trouble::NeverDone,
    ] {
        assert_reported(Mistake::NoDeadline, "no end after", |mistake| {
            ends(mistake, trouble, Duration::from_millis(20))
        });
    }
    for trouble in [Trouble::NeverOutOfReset(2), Trouble::AcceleratorInReset] {
        assert_reported(Mistake::NoDeadline, "no end after", |mistake| {
            reset_ends(mistake, trouble)
        });
        // At the end of a step that had no time.
        ends(None, trouble, NO_TIME).expect("it ends");
    }
}

#[test]
fn mistake_07_only_completion_awaited() {
    let unseen = Mistake::StatusUnseen(dmasr::ERRORS | dmasr::ERR_IRQ.mask());
    for channel in [(0, Direction::Mm2s), (2, Direction::Mm2s), (3, Direction::S2mm)] {
        assert_reported(unseen, "only after", |mistake| {
            // The board goes on after the trouble's effects, because they are no mistake of the
            // driver.
            let config = BoardConfig { strict: false, length_width: 8, ..BoardConfig::default() };
            let mut bench = Bench::open(config, mistake, Some(Trouble::StaleDescriptor(channel)))?;
            let before = bench.planted.time();
            let (result, _) = bench.step_with(90, &within(LONG));
            // Without the error bits the line stays high: a storm, until the deadline.
            let took = bench.planted.time() - before;
            let error = chain_of(&result.expect_err("a descriptor error"));
            if took > LONG / 10 {
                return Err(format!("{error}: reported only after {took:?}"));
            }
            let (core, direction) = channel;
            assert!(error.contains(&format!("dma{core} {direction}")), "{error}");
            assert!(error.contains("SGIntErr"), "{error}");
            bench.planted.end_trouble();
            bench.step(90).map(drop)
        });
    }
}

/// Checks that the driver reports an error that one bit of a register or descriptor shows.
fn reported(mistake: Option<Mistake>, trouble: Trouble, channel: ChannelId, name: &str) -> Verdict {
    let mut bench = Bench::open(BoardConfig::default(), mistake, Some(trouble))?;
    let (result, bodies) = bench.step_with(9, &StepParameters::default());
    let Err(error) = result else { return Err("an error taken as success".to_owned()) };
    let (text, (core, direction)) = (chain_of(&error), channel);
    assert!(text.contains(&format!("dma{core} {direction}")) && text.contains(name), "{text}");
    assert_eq!(bits(&bodies), bits(&scene(9).0));
    bench.planted.end_trouble();
    bench.step(9)?;
    bench.close()
}

#[test]
fn mistake_08_error_bit_missing_from_the_mask() {
    let registers = [
        dmasr::DMA_INT_ERR,
        dmasr::DMA_SLV_ERR,
        dmasr::DMA_DEC_ERR,
        dmasr::SG_INT_ERR,
        dmasr::SG_SLV_ERR,
        dmasr::SG_DEC_ERR,
    ];
    let descriptors = [status::DMA_INT_ERR, status::DMA_SLV_ERR, status::DMA_DEC_ERR];
    for channel in BOTH.map(|direction| (1, direction)) {
        for bit in registers {
            assert_reported(Mistake::StatusUnseen(bit.mask()), "taken as success", |mistake| {
                reported(mistake, Trouble::Status(channel, bit.mask()), channel, bit.name)
            });
        }
        for bit in descriptors {
            assert_reported(Mistake::DescriptorUnseen(bit.mask()), "taken as success", |mistake| {
                reported(mistake, Trouble::Descriptor(channel, bit.mask()), channel, bit.name)
            });
        }
    }
}

#[test]
fn mistake_10_threshold_above_the_packets() {
    assert_reported(Mistake::ThresholdRaised, "ended without its interrupt", |mistake| {
        let mut bench = Bench::open(BoardConfig::default(), mistake, None)?;
        for cubes in [20, 9, 20, 20, 9] {
            let before = bench.planted.time();
            let report = bench.step(cubes)?;
            let took = bench.planted.time() - before;
            if report.interrupts != 1 || took > Duration::from_millis(5) {
                return Err(format!("a step of {took:?} ended without its interrupt"));
            }
        }
        bench.close()
    });
}

/// Checks the driver's answer to a wake-up: acknowledge, unmask, read the status again.
fn wakes(mistake: Option<Mistake>) -> Verdict {
    // The second interrupt belongs to the step; the first comes before the board has done anything.
    let mut bench = Bench::open(BoardConfig::default(), mistake, Some(Trouble::Spurious(1)))?;
    let completion = (3, S2MM_OFFSET + DMASR.offset);
    for _ in 0..2 {
        bench.step(20)?;
        let events = bench.planted.events();
        let mut woken = 0;
        // From each wake-up to the next wait, or to the end of the step.
        for lap in events.split(|event| *event == Event::Wait) {
            let Some(woke) = lap.iter().position(|event| *event == Event::Woke) else { continue };
            woken += 1;
            let unmask = lap.iter().position(|event| matches!(event, Event::Unmask(_)));
            let unmask = unmask.ok_or("an interrupt was not let through again")?;
            let looks =
                |events: &[Event]| events.contains(&Event::Read(completion.0, completion.1));
            if !looks(&lap[woke..unmask]) || !looks(&lap[unmask..]) {
                return Err("no look between unmask and sleep".to_owned());
            }
            if lap[unmask] == Event::Unmask(true) {
                return Err("let through while the line is high".to_owned());
            }
        }
        if woken == 0 {
            return Err("no interrupt".to_owned());
        }
    }
    bench.close()
}

#[test]
fn mistake_11_unmasked_before_acknowledged_or_not_looked_at_again() {
    assert_reported(Mistake::UnmaskedFirst, "let through while the line is high", wakes);
    assert_reported(Mistake::NoSecondLook, "no look between unmask and sleep", wakes);
}

/// Runs steps whose waits end too early, and which must not end with them.
fn early(mistake: Option<Mistake>, trouble: Trouble) -> Verdict {
    // A strict board would die of the mistake's effects, and hide it.
    let config = BoardConfig { strict: false, ..BoardConfig::default() };
    let mut bench = Bench::open(config, mistake, Some(trouble))?;
    let stepped = bench.step(90);
    let events = bench.planted.events();
    if events.contains(&Event::TakeBack(false)) {
        return Err("a buffer was taken back while an engine runs".to_owned());
    }
    stepped?;
    // The trouble was there: the step waited more than once.
    assert!(events.iter().filter(|event| **event == Event::Wait).count() > 1);
    bench.step(20)?;
    bench.close()
}

#[test]
fn mistake_12_interrupt_taken_for_completion() {
    for interrupts in [1, 3] {
        assert_reported(Mistake::InterruptBelieved, "taken back while an engine runs", |mistake| {
            early(mistake, Trouble::Spurious(interrupts))
        });
    }
}

#[test]
fn mistake_18_idle_senders_taken_for_the_end() {
    assert_reported(Mistake::IdleBelieved, "taken back while an engine runs", |mistake| {
        early(mistake, Trouble::SendersIdle)
    });
}
