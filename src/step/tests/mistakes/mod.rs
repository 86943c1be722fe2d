//! The mistakes that drivers of this DMA core commonly make, and one test for each that fails if
//! this driver makes it.
//!
//! Every test runs one check twice: on the driver as it is, which must pass, and with the mistake
//! planted between driver and board ([`planted`]), which must be reported. The second run proves
//! that the check can fail.
//!
//! | # | mistake | test | what reports it |
//! |---|---|---|---|
//! | 1 | length width assumed | [`addresses`]`::mistake_01_length_width_assumed` | the board: a length beyond its register; opening, where bitstream and core disagree |
//! | 2 | upper half of the tail first | [`addresses`]`::mistake_02_upper_half_written_first` | the board: the engine runs past the tail |
//! | 3 | address cut to 32 bits | [`addresses`]`::mistake_03_address_cut_to_32_bits` | the board: an access outside every buffer |
//! | 4 | CURDESC written while running | [`addresses`]`::mistake_04_current_descriptor_written_while_running` | the board |
//! | 5 | one direction reset | [`waits`]`::mistake_05_reset_of_one_direction` | the driver: CURDESC does not read back |
//! | 6 | unbounded wait | [`waits`]`::mistake_06_unbounded_wait` | the board's clock, for each wait of a step |
//! | 7 | only completion awaited | [`waits`]`::mistake_07_only_completion_awaited` | the time until the error is reported |
//! | 8 | decode error missing from the mask | [`waits`]`::mistake_08_error_bit_missing_from_the_mask` | an error of either register taken as success, bit by bit |
//! | 9 | descriptor used with Cmplted set | [`addresses`]`::mistake_09_descriptor_used_again_uncleared` | the board: a stale descriptor |
//! | 10 | threshold above the outstanding packets | [`waits`]`::mistake_10_threshold_above_the_packets` | steps that end without their interrupt |
//! | 11 | UIO: unmasked before acknowledged, or no second look | [`waits`]`::mistake_11_unmasked_before_acknowledged_or_not_looked_at_again` | the level of the line, and the register accesses |
//! | 12 | interrupt counted, status not read | [`waits`]`::mistake_12_interrupt_taken_for_completion` | buffers taken back while engines run |
//! | 13 | caches not maintained | [`buffers`]`::mistake_13_caches_not_maintained` | the sums of words; the self-test |
//! | 14 | received length ignored | [`buffers`]`::mistake_14_received_length_ignored` | a short packet that is taken as whole |
//! | 15 | length spills into the packet marks | [`addresses`]`::mistake_15_length_spills_into_the_packet_marks` | the board: SOF and EOF that do not pair |
//! | 16 | receivers started after senders | [`addresses`]`::mistake_16_receivers_started_after_senders` | the order of the doorbells |
//! | 17 | buffer used again after a time-out | [`buffers`]`::mistake_17_buffer_used_again_after_a_time_out` | the board: an access to a buffer of the CPU |
//! | 18 | idle senders taken for the end | [`waits`]`::mistake_18_idle_senders_taken_for_the_end` | buffers taken back while engines run |
//! | 19 | slices of a buffer that the device writes | [`buffers`]`::mistake_19_slices_of_a_buffer_that_the_device_writes` | the compiler, and the ports |
//! | 20 | start believed without a look | [`sweep`]`::mistake_20_start_believed_without_a_look` | the board: a descriptor fetched outside every buffer |
//!
//! In addition [`confinement`] plants lengths and addresses that are off by one beat, freed buffers
//! and buffers of the CPU.

mod addresses;
mod buffers;
mod chain;
mod confinement;
mod kinds;
mod planted;
mod region;
mod sweep;
mod waits;

use std::sync::Arc;

use bitstream_model::BoardConfig;

use super::{SHAPES, bits, scene, undisturbed};
use crate::board::open::Found;
use crate::{Accelerator, Body, Error, StepParameters, StepReport};
use kinds::{Mistake, Trouble};
use planted::Planted;

/// The outcome of a check; the error tells the mistake.
type Verdict = Result<(), String>;

/// Runs a check on the driver as it is, and with a mistake planted. The second run must fail with a
/// message that contains `message`.
fn assert_reported(
    mistake: Mistake,
    message: &str,
    check: impl Fn(Option<Mistake>) -> Verdict,
) -> String {
    if let Err(found) = check(None) {
        panic!("the driver as it is: {found}");
    }
    match check(Some(mistake)) {
        Ok(()) => panic!("{mistake:?} was planted, and nothing reported"),
        Err(found) => {
            assert!(found.contains(message), "{mistake:?} was reported as {found:?}");
            found
        }
    }
}

/// A driver and a board, with a mistake and a trouble between them.
struct Bench {
    planted: Planted,
    accelerator: Accelerator,
}

fn found(planted: &Planted) -> Found {
    super::found(Arc::new(planted.clone()))
}

impl Bench {
    fn open(
        config: BoardConfig,
        mistake: Option<Mistake>,
        trouble: Option<Trouble>,
    ) -> Result<Self, String> {
        let planted = Planted::new(config, mistake, trouble);
        let mut accelerator =
            Accelerator::on(found(&planted), None).map_err(|error| chain_of(&error))?;
        accelerator.set_shapes(&SHAPES).map_err(|error| chain_of(&error))?;
        planted.opened();
        Ok(Self { planted, accelerator })
    }

    fn step_with(
        &mut self,
        cubes: u32,
        parameters: &StepParameters,
    ) -> (Result<StepReport, Error>, Vec<Body>) {
        let (mut bodies, collisions) = scene(cubes);
        (self.accelerator.step(&mut bodies, &collisions, parameters), bodies)
    }

    /// Runs one step, which must be undisturbed.
    fn step(&mut self, cubes: u32) -> Result<StepReport, String> {
        let (result, bodies) = self.step_with(cubes, &StepParameters::default());
        let report = result.map_err(|error| self.with_violations(&chain_of(&error)))?;
        if bits(&bodies) != undisturbed(cubes) {
            return Err(self.with_violations("other bits than undisturbed"));
        }
        Ok(report)
    }

    fn with_violations(&self, found: &str) -> String {
        let violations = self.planted.board().violations();
        let kinds: Vec<_> = violations.iter().map(|violation| violation.kind.to_string()).collect();
        format!("{found}; violations: {}", kinds.join(", "))
    }

    /// Closes the board, and checks that nothing went wrong.
    fn close(self) -> Verdict {
        let Self { planted, accelerator } = self;
        drop(accelerator);
        match planted.board().violations().first() {
            Some(violation) => Err(violation.kind.to_string()),
            None => Ok(()),
        }
    }
}

/// An error and its causes.
fn chain_of(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        text.push_str(": ");
        text.push_str(&error.to_string());
        cause = error.source();
    }
    text
}

/// Whether steps of these sizes are undisturbed.
fn clean(config: BoardConfig, mistake: Option<Mistake>, sizes: &[u32]) -> Verdict {
    clean_in(None, config, mistake, sizes)
}

/// As [`clean`], with a trouble that no step should feel.
fn clean_in(
    trouble: Option<Trouble>,
    config: BoardConfig,
    mistake: Option<Mistake>,
    sizes: &[u32],
) -> Verdict {
    let mut bench = Bench::open(config, mistake, trouble)?;
    for cubes in sizes {
        bench.step(*cubes)?;
    }
    bench.close()
}
