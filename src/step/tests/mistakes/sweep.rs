//! Loads the logic anew, or takes its power, at every register access from opening to a step that
//! is taken again. No engine may fetch a descriptor outside the memory that it was granted.

#![allow(clippy::print_stdout, reason = "the counts, which --nocapture shows")]

use std::sync::LazyLock;

use bitstream_model::{BoardConfig, Direction, Fault as Injected, FaultKind, ViolationKind, When};
use pgs_interface::control::IDENTIFICATION_VALUE;

use super::kinds::Mistake;
use super::planted::Planted;
use super::{SHAPES, bits, found, scene, undisturbed};
use crate::{Accelerator, Error, StepParameters};

const CUBES: u32 = 1;
/// The bits of a right step.
static AFTER: LazyLock<Vec<u32>> = LazyLock::new(|| undisturbed(CUBES));

/// The parts of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Open,
    FirstStep,
    SteadyStep,
    /// A step in which a channel fails, and which is taken again.
    Retry,
}

/// A driver on a board from opening on: the parts, then one more step.
struct Run {
    planted: Planted,
    /// Register accesses up to the end of each part.
    ends: Vec<(Part, u64)>,
    /// The error of each attempt at a step that failed.
    errors: Vec<Error>,
    /// Whether the result of a step was wrong, or a failed step touched its bodies.
    wrong: bool,
    /// Whether the last step succeeded.
    completed: bool,
}

impl Run {
    /// Runs with a fault at a register access, counted from the first.
    fn new(fault: Option<(FaultKind, u64)>, mistake: Option<Mistake>) -> Self {
        let config = BoardConfig { strict: false, ..BoardConfig::default() };
        let mut run = Self {
            planted: Planted::new(config, mistake, None),
            ends: Vec::new(),
            errors: Vec::new(),
            wrong: false,
            completed: false,
        };
        let board = run.planted.board().clone();
        if let Some((kind, access)) = fault {
            board.inject(Injected::new(kind).when(When::Access(access)));
        }
        let Ok(mut accelerator) = Accelerator::on(found(&run.planted), None) else { return run };
        accelerator.set_shapes(&SHAPES).expect("they fit");
        run.end(Part::Open);
        run.step(&mut accelerator, 1);
        run.end(Part::FirstStep);
        run.step(&mut accelerator, 1);
        run.end(Part::SteadyStep);
        board.inject(Injected::new(FaultKind::DmaSlvErr).on(0, Direction::S2mm));
        run.step(&mut accelerator, 1);
        run.end(Part::Retry);
        board.clear_faults();
        run.completed = run.step(&mut accelerator, 2);
        run
    }

    fn end(&mut self, part: Part) {
        let counts = self.planted.board().counts();
        self.ends.push((part, counts.register_reads + counts.register_writes));
    }

    /// Takes a step, and takes it again as long as it may be; returns whether it succeeded.
    fn step(&mut self, accelerator: &mut Accelerator, retries: u32) -> bool {
        for _ in 0..=retries {
            let (mut bodies, collisions) = scene(CUBES);
            let before = bits(&bodies);
            match accelerator.step(&mut bodies, &collisions, &StepParameters::default()) {
                Ok(_) => {
                    self.wrong |= bits(&bodies) != *AFTER;
                    return true;
                }
                Err(error) => {
                    self.wrong |= bits(&bodies) != before;
                    let again = error.may_retry();
                    self.errors.push(error);
                    if !again {
                        break;
                    }
                }
            }
        }
        false
    }

    /// Whether an engine fetched something outside its memory.
    fn left_its_memory(&self) -> bool {
        let outside = |kind: &ViolationKind| matches!(kind, ViolationKind::OutsideGrant { .. });
        self.planted.board().violations().iter().any(|violation| outside(&violation.kind))
    }
}

/// Every register access of an undisturbed run, with its part.
fn accesses() -> Vec<(Part, u64)> {
    let run = Run::new(None, None);
    assert!(run.completed && !run.wrong);
    let mut next = 0;
    let mut all = Vec::new();
    for (part, end) in run.ends {
        all.extend((next..end).map(|access| (part, access)));
        next = end;
    }
    all
}

/// Runs with a fault at each access in turn. Every error names `cause`, or the failed channel.
fn sweep(kind: FaultKind, cause: &str) {
    let mut counts = [0; 3];
    for (part, access) in accesses() {
        let run = Run::new(Some((kind, access)), None);
        let what = format!("{} at access {access}, {part:?}: {:?}", kind.name(), run.errors);
        assert!(run.planted.board().faults() > 0, "{what}");
        assert_eq!(run.planted.board().violations(), [], "{what}");
        assert!(!run.wrong, "{what}");
        let names: Vec<_> = run.errors.iter().filter_map(Error::fault).map(|f| f.name()).collect();
        assert!(names.iter().all(|name| [cause, "dma-slave-error"].contains(name)), "{what}");
        if run.ends.is_empty() {
            counts[0] += 1;
        } else if run.completed {
            counts[1] += 1;
        } else {
            counts[2] += 1;
        }
        // Only the same bitstream can go on.
        let stays = kind == FaultKind::Reloaded;
        assert!(!run.completed || stays, "{what}");
        assert!(run.completed || run.ends.is_empty() || !stays, "{what}");
    }
    let [refused, completed, given_up] = counts;
    println!(
        "{}: 0 fetches outside the grants; opening refused {refused} times, board given up \
         {given_up} times, steps completed {completed} times",
        Injected::new(kind)
    );
}

#[test]
fn another_bitstream_at_any_access_moves_no_engine() {
    sweep(FaultKind::OtherBitstream { identification: 0 }, "other-bitstream");
}

#[test]
fn another_bitstream_with_our_identification_moves_no_engine() {
    let identification = IDENTIFICATION_VALUE;
    sweep(FaultKind::OtherBitstream { identification }, "other-bitstream");
}

#[test]
fn the_same_bitstream_again_at_any_access_costs_a_step_at_most() {
    sweep(FaultKind::Reloaded, "logic-reset");
}

#[test]
fn power_that_is_lost_at_any_access_moves_no_engine() {
    sweep(FaultKind::PowerLost, "gone");
}

/// Two accesses of each of eight channels let an engine fetch a descriptor at 0 or at the upper
/// half of its ring's address: the write of the upper half, and the start.
#[test]
fn mistake_20_start_believed_without_a_look() {
    for kind in [FaultKind::OtherBitstream { identification: 0 }, FaultKind::Reloaded] {
        let of = |mistake| {
            let left = accesses()
                .into_iter()
                .filter(|(_, access)| Run::new(Some((kind, *access)), mistake).left_its_memory());
            left.map(|(part, _)| part).collect::<Vec<_>>()
        };
        let left = of(Some(Mistake::StartBelieved));
        let parts = [Part::Open, Part::FirstStep, Part::SteadyStep, Part::Retry];
        let counts = parts.map(|part| left.iter().filter(|found| **found == part).count());
        println!("{}, start believed: {counts:?} accesses", kind.name());
        assert_eq!(counts, [0, 16, 0, 16], "{}", kind.name());
    }
}
