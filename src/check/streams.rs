//! Tests the properties that only streaming shows: data arrives, is the newest, and is announced.

use std::time::Duration;

use pgs_interface::record::Beat;

use super::bring_up::chain;
use super::fence::fence;
use super::judge::{Difference, Origin, Run, judge};
use super::pattern::{Pattern, SHAPES};
use super::queue::queue;
use super::report::{Line, Lines, Outcome};
use crate::axi_dma::{Direction, DmaError};
use crate::beat::deal::sum_of_words;
use crate::board::BoardKind;
use crate::error::Error;
use crate::fault::{ChannelState, Fault};
use crate::step::{Accelerator, ECHO_LIMIT, Echo, EchoResult};

/// Numbers of bodies of the echoes: the smallest; odd numbers that give channels different lengths;
/// and one that fills a length register of 14 bits more than once.
const SIZES: [u32; 4] = [1, 7, 101, 4099];
/// Up to this size the packets are cut into short pieces.
const SHORT_PIECES_UP_TO: u32 = 101;
/// Number of bodies in a round of the coherency test: more than the lines of a first-level cache.
const COHERENCY_BODIES: u32 = 1501;
const COHERENCY_ROUNDS: u32 = 3;
const INTERRUPT_STEPS: u64 = 3;
/// Time in which no interrupt may come without a cause.
const QUIET: Duration = Duration::from_millis(2);

/// Runs the lines that stream.
pub(super) fn streams(mut accelerator: Accelerator, lines: &mut Lines) {
    if let Err(error) = accelerator.set_shapes(&SHAPES) {
        let next = "load the bitstream again";
        lines.stop(Line::Echo, Outcome::failed(chain(&error), "shapes that can be loaded", next));
        return;
    }
    let runs = match echoes(&mut accelerator, lines) {
        Ok(runs) => runs,
        Err(outcome) => {
            lines.stop(Line::Echo, outcome);
            return;
        }
    };
    lines.set(Line::Sums, sums(&runs));
    let outcome = coherency(&mut accelerator).unwrap_or_else(|outcome| outcome);
    let newest = matches!(outcome, Outcome::Ok { .. });
    lines.set(Line::Coherency, outcome);
    let outcome = interrupt(&mut accelerator).unwrap_or_else(|outcome| outcome);
    lines.set(Line::Interrupt, outcome);
    let outcome = match newest {
        true => queue(&mut accelerator),
        false => Outcome::skipped("needs the line \"coherency\""),
    };
    lines.set(Line::Queue, outcome);
    let outcome = fence(&mut accelerator);
    lines.set(Line::Fence, outcome);
}

/// A number of bodies for which the bitstream has room, at most `bodies`.
fn fitting(accelerator: &Accelerator, bodies: u32) -> u32 {
    let capabilities = accelerator.capabilities();
    let room = capabilities.memory_bytes / capabilities.bytes_per_body.max(1);
    bodies.min(capabilities.body_capacity).min(room).max(1)
}

/// The outcome of a step that failed.
fn step_failed(error: &Error) -> Outcome {
    let (found, next) = match error {
        Error::Step { fault, diagnosis, .. } => match &**fault {
            Fault::Deadline { .. } => (
                format!(
                    "no end after {ECHO_LIMIT:?}: {}",
                    still_moving(diagnosis.as_ref().map_or(&[], |found| &found.channels))
                ),
                "check whether the stream of the named channel is connected to the accelerator and \
                 its memory port is enabled",
            ),
            Fault::NoMemory(error) | Fault::Platform(error) => (
                chain(error),
                "give the board memory for DMA that its cores can reach, 1 MiB for this test",
            ),
            Fault::LogicReset { .. } | Fault::Core(DmaError::FirstDescriptor { .. }) => (
                chain(fault),
                "see that nothing else loads, resets or drives the logic meanwhile, and test again",
            ),
            fault => (
                chain(fault),
                "check whether the addresses of the buffers are mapped for the channel in the \
                 block design, and whether streams are exchanged",
            ),
        },
        error => (chain(error), "load the bitstream again"),
    };
    let expected = format!("a step without collisions to end within {ECHO_LIMIT:?}");
    Outcome::failed(found, expected, next)
}

/// The channels that hold a step up: senders that have data left, or else receivers that wait.
fn still_moving(channels: &[ChannelState]) -> String {
    let busy = |direction: Direction| -> Vec<_> {
        channels
            .iter()
            // A halted channel had nothing to do in this step.
            .filter(|state| !state.status.idle() && !state.status.halted())
            .filter(|state| state.channel.direction == direction)
            .map(|state| format!("{} {}", state.channel, state.status))
            .collect()
    };
    let (senders, receivers) = (busy(Direction::Mm2s), busy(Direction::S2mm));
    match (senders.is_empty(), receivers.is_empty()) {
        (false, _) => format!("{} has data left to send", senders.join(", ")),
        (true, false) => format!("{} waits for results", receivers.join(", ")),
        (true, true) => "every channel is idle, the accelerator is not done".to_owned(),
    }
}

/// Sends patterns of several sizes through fresh buffers. The error is a step that failed.
fn echoes(accelerator: &mut Accelerator, lines: &mut Lines) -> Result<Vec<EchoResult>, Outcome> {
    let variant = accelerator.capabilities().variant;
    let (pattern, channels) = (Pattern::of(&variant), variant.profile.s2mm_widths.len());
    let mut sizes = SIZES.map(|size| fitting(accelerator, size)).to_vec();
    sizes.dedup();
    let mut runs = Vec::new();
    let mut failure = None;
    for (seed, size) in (1..).zip(&sizes) {
        let bodies = pattern.bodies(seed, *size);
        let echo = Echo {
            bodies: &bodies,
            short_pieces: *size <= SHORT_PIECES_UP_TO,
            fresh_buffers: true,
            filler: None,
            guarded: None,
        };
        let echoed = accelerator.echo(&echo).map_err(|error| step_failed(&error))?;
        let expected = pattern.results(&bodies, channels);
        let run =
            Run { variant: &variant, bodies: bodies.len(), expected: &expected, before: None };
        if let Some(difference) = judge(&run, &echoed) {
            let expected = format!("a pattern of {size} bodies back bit for bit");
            let next = advice(&difference);
            failure.get_or_insert(Outcome::failed(difference.to_string(), expected, next));
        }
        runs.push(echoed);
    }
    let descriptors: u64 = runs.iter().map(|run| run.descriptors).sum();
    let detail = || {
        let sizes: Vec<_> = sizes.iter().map(u32::to_string).collect();
        format!(
            "patterns of {} bodies came back bit for bit through {channels} + {channels} channels, \
             {descriptors} descriptors",
            sizes.join(", ")
        )
    };
    lines.set(Line::Echo, failure.unwrap_or_else(|| Outcome::ok(detail())));
    Ok(runs)
}

/// The advice for wrong data.
fn advice(difference: &Difference) -> &'static str {
    match difference.origin {
        Origin::StaleRead | Origin::StaleResult => {
            "do not map the buffers as coherent: let the driver synchronise them, or make the path \
             coherent (a coherent port, its cache attributes and snooping, and dma-coherent in the \
             device tree, all of them)"
        }
        Origin::Elsewhere(_) => {
            "check whether streams are exchanged between the cores and the accelerator"
        }
        Origin::Unknown => {
            "check whether the widths of the memory ports, which boot software sets, are those of \
             the bitstream, and whether the streams meet timing"
        }
    }
}

/// Compares the accelerator's sums with the driver's.
fn sums(runs: &[EchoResult]) -> Outcome {
    for run in runs {
        let (received, answered) = run.sums;
        let found = run
            .results
            .iter()
            .fold(0u32, |sum, beats: &Vec<Beat>| sum.wrapping_add(sum_of_words(beats)));
        let sides = [
            ("arrived at the accelerator", received, run.sent, "before"),
            ("came back", found, answered, "behind"),
        ];
        for (what, found, expected, side) in sides {
            if found != expected {
                return Outcome::failed(
                    format!("words that add up to {found:#010x} {what}"),
                    format!("{expected:#010x}"),
                    format!("look for the damage {side} the accelerator: memory, port or stream"),
                );
            }
        }
    }
    Outcome::ok(format!("both directions agree in {} steps", runs.len()))
}

/// Sends patterns through the same buffers, one after the other, with filler in between.
fn coherency(accelerator: &mut Accelerator) -> Result<Outcome, Outcome> {
    let variant = accelerator.capabilities().variant;
    let (pattern, channels) = (Pattern::of(&variant), variant.profile.s2mm_widths.len());
    let size = fitting(accelerator, COHERENCY_BODIES);
    let mut before: Option<Vec<Vec<Beat>>> = None;
    for round in 0..COHERENCY_ROUNDS {
        let bodies = pattern.bodies(0x100 + round, size);
        let echo = Echo {
            bodies: &bodies,
            short_pieces: false,
            fresh_buffers: round == 0,
            filler: Some(pattern.filler()),
            guarded: None,
        };
        let echoed = accelerator.echo(&echo).map_err(|error| step_failed(&error))?;
        let expected = pattern.results(&bodies, channels);
        let run = Run {
            variant: &variant,
            bodies: bodies.len(),
            expected: &expected,
            before: before.as_deref(),
        };
        if let Some(difference) = judge(&run, &echoed) {
            return Ok(Outcome::failed(
                difference.to_string(),
                format!("the pattern of round {} of {COHERENCY_ROUNDS}", round + 1),
                advice(&difference),
            ));
        }
        before = Some(expected);
    }
    Ok(Outcome::ok(format!(
        "{COHERENCY_ROUNDS} rounds of {size} bodies through dirtied buffers, nothing stale"
    )))
}

/// Tests that every step's end raises the interrupt, and nothing else does.
fn interrupt(accelerator: &mut Accelerator) -> Result<Outcome, Outcome> {
    if accelerator.board().kind == BoardKind::DevMem {
        return Ok(Outcome::skipped("there is no interrupt through /dev/mem: open the UIO node"));
    }
    let unusable = |error: crate::platform::PlatformError| {
        let next = "check that the device tree gives the node an interrupt";
        Outcome::failed(chain(&error), "an interrupt that can be waited for", next)
    };
    // One event may be pending from before; a second one has no source.
    let mut events = 0;
    while events < 2 && accelerator.interrupt_within(QUIET).map_err(unusable)? {
        events += 1;
    }
    if events == 2 {
        return Err(Outcome::failed(
            "interrupts that come again although nothing asks for one",
            "none while every source is quiet",
            "check that the line's type in the device tree is level, active high (4), and what \
             else drives it",
        ));
    }
    let bodies = Pattern::of(&accelerator.capabilities().variant)
        .bodies(0x200, fitting(accelerator, COHERENCY_BODIES));
    let mut woken = 0;
    for _ in 0..INTERRUPT_STEPS {
        let echo = Echo {
            bodies: &bodies,
            fresh_buffers: false,
            short_pieces: false,
            filler: None,
            guarded: None,
        };
        let echoed = accelerator.echo(&echo).map_err(|error| step_failed(&error))?;
        woken += u64::from(echoed.interrupts > 0);
    }
    if woken < INTERRUPT_STEPS {
        return Err(Outcome::failed(
            format!(
                "{woken} of {INTERRUPT_STEPS} steps ended with an interrupt, the driver found the \
                 others by polling"
            ),
            "an interrupt at the end of every step",
            "check that the interrupt output of the PL is connected and enabled, and that its \
             number in the device tree is right: it is the interrupt controller's less 32",
        ));
    }
    Ok(Outcome::ok(format!("ended each of {INTERRUPT_STEPS} steps, quiet in between")))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run of one beat whose words add up to 10.
    fn run(sent: u32, sums: (u32, u32)) -> EchoResult {
        let results = vec![vec![Beat([1, 2, 3, 4])], Vec::new()];
        EchoResult { results, sent, sums, interrupts: 1, descriptors: 1 }
    }

    #[test]
    fn sums_say_on_which_side_of_the_accelerator_words_were_damaged() {
        let good = || run(7, (7, 10));
        assert!(matches!(sums(&[good(), good()]), Outcome::Ok { .. }));
        for (bad, value, side) in [
            (run(7, (8, 10)), "0x00000008 arrived", "before the accelerator"),
            (run(7, (7, 11)), "0x0000000a came back", "behind the accelerator"),
        ] {
            let outcome = sums(&[good(), bad]);
            assert!(
                matches!(&outcome, Outcome::Failed { found, next, .. }
                    if found.contains(value) && next.contains(side)),
                "{outcome:?}"
            );
        }
    }
}
