//! Decodes the collisions of a step once, and computes its passes when somebody can see them.
//!
//! `eligible.rs` says which designs these are, `decode_once.rs` decodes collisions and tells whether
//! a later pass brings the same ones, `warm.rs` does so where impulses come with them, `entered.rs`
//! keeps in mind when they entered. `passes.rs` takes passes, `compute.rs` computes them and gives out
//! impulses, `bodies.rs` loads and integrates.

pub(super) mod bodies;
mod compute;
mod decode_once;
pub(super) mod eligible;
mod entered;
mod passes;
mod warm;

use crate::accelerator::Accelerator;
use crate::accelerator::control::{Arguments, Shape};
use crate::accelerator::defer::{ArrivedRecords, Defer};
use crate::accelerator::records::results::Results;
use crate::accelerator::records::segment::{PacketError, Segment};
use crate::accelerator::records::striping::{ROWS_IN, STREAMS_MAX};
use crate::config::BoardConfig;
use crate::stream::Stream;
use decode_once::Decoded;
use eligible::Layout;
use entered::Entered;
use pgs_interface::record::Beat;

pub(super) use bodies::BodyRows;
pub(super) use decode_once::Coming;
pub(super) use passes::Ahead;

/// A step whose collisions are decoded once and whose passes are computed later.
#[derive(Debug)]
pub(super) struct Deferred {
    /// Whether the step under way has brought nothing but decoded collisions so far.
    active: bool,
    decoded: Decoded,
    entered: Entered,
    /// Passes that were computed; the last one may be under way still: see `compute.rs`.
    computed: u32,
    /// Impulses on their way out.
    impulses: Vec<Beat>,
    /// Rows of results on their way to each stream.
    rows: [Vec<Beat>; STREAMS_MAX],
}

impl Deferred {
    pub(super) fn new(config: &BoardConfig, layout: Layout) -> Self {
        Self {
            active: true,
            decoded: Decoded::new(config, layout),
            entered: Entered::new(layout.together, config.profile.initiation_interval.into()),
            computed: 0,
            impulses: Vec::new(),
            rows: Default::default(),
        }
    }
}

impl Defer for Deferred {
    fn begin_step(&mut self, arguments: &Arguments, shapes: &[Shape]) -> bool {
        self.computed = 0;
        // Designs whose impulses lie elsewhere go the long way.
        let impulses = arguments.warm_start || arguments.impulses_out;
        self.active = !impulses || self.decoded.layout.warm_share.is_some();
        if self.active {
            self.decoded.begin_step(arguments, shapes);
        }
        self.active
    }

    fn takes_collisions(&self) -> bool {
        self.active
    }

    fn begin_pass(&mut self, slots: u64) {
        self.entered.begin_pass(slots, self.decoded.distance());
    }

    fn collisions(
        &mut self,
        accelerator: &mut Accelerator,
        pass: u32,
        segment: &mut Segment,
        limit: u64,
        arrived: ArrivedRecords<'_>,
        outputs: &mut [Stream],
    ) -> Result<Option<u64>, PacketError> {
        self.take_collisions(accelerator, pass, segment, limit, arrived, outputs)
    }

    fn compute(&mut self, accelerator: &mut Accelerator, pass: u32, collisions: usize) {
        self.compute_to(accelerator, pass, collisions);
    }

    fn load(
        &mut self,
        accelerator: &mut Accelerator,
        velocities: &mut Segment,
        arrived: &mut ArrivedRecords<'_>,
    ) -> Option<Result<u32, PacketError>> {
        let rows = self.rows_of_next(self.rows_of_velocity(), velocities, arrived)?;
        let sum = self.load_rows(accelerator, arrived.records, rows);
        if sum.is_ok() {
            velocities.skip(arrived.records, arrived.inputs);
        }
        Some(sum)
    }

    fn integrate(
        &mut self,
        accelerator: &mut Accelerator,
        poses: &mut Segment,
        results: &mut Results,
        arrived: &mut ArrivedRecords<'_>,
        outputs: &mut [Stream],
    ) -> Option<[u32; 2]> {
        let rows = self.rows_of_next(ROWS_IN, poses, arrived)?;
        let sums = self.integrate_rows(accelerator, results, arrived.records, rows, outputs);
        poses.skip(arrived.records, arrived.inputs);
        Some(sums)
    }
}
