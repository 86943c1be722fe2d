//! The seam through which a step's arithmetic can be deferred: a short cut takes the records that have
//! arrived, and computes their results before anybody can see them.
//!
//! The accelerator goes on keeping account of phases, packets and cycles. Without a [`Defer`] it
//! computes every record as it takes it; with one, nothing but the time of the host may differ.

use std::fmt;

use super::Accelerator;
use super::control::{Arguments, Shape};
use super::records::results::Results;
use super::records::segment::{PacketError, Segment};
use crate::memory::Memory;
use crate::stream::Stream;

/// Records of the phase under way that have arrived, and where their beats are.
#[derive(Debug)]
pub(crate) struct ArrivedRecords<'a> {
    /// How many.
    pub(crate) records: usize,
    pub(crate) inputs: &'a mut [Stream],
    pub(crate) memory: &'a Memory,
}

/// Takes records from their buffers, and computes passes later and many at once.
pub(crate) trait Defer: fmt::Debug + Send {
    /// A step begins. Returns whether its collisions are taken, at first.
    fn begin_step(&mut self, arguments: &Arguments, shapes: &[Shape]) -> bool;

    /// Whether the collisions of the step under way are still taken.
    fn takes_collisions(&self) -> bool;

    /// A pass begins, with a hazard window of `slots` issue slots.
    fn begin_pass(&mut self, slots: u64);

    /// Takes collisions of a pass for up to `limit` cycles: the next ones of `segment`. Where their
    /// impulses go out, these fit into `outputs`. Returns the cycles that the collisions take to enter,
    /// stalls included. `None` if it takes no more collisions of this step: the accelerator computes
    /// them from the next one of `segment` on.
    fn collisions(
        &mut self,
        accelerator: &mut Accelerator,
        pass: u32,
        segment: &mut Segment,
        limit: u64,
        arrived: ArrivedRecords<'_>,
        outputs: &mut [Stream],
    ) -> Result<Option<u64>, PacketError>;

    /// Computes everything deferred: the passes before `pass`, and the first `collisions` of `pass`.
    fn compute(&mut self, accelerator: &mut Accelerator, pass: u32, collisions: usize);

    /// Loads the bodies that have arrived, and takes their beats. Returns the sum of the words, or
    /// `None` if the accelerator has to load them.
    fn load(
        &mut self,
        accelerator: &mut Accelerator,
        velocities: &mut Segment,
        arrived: &mut ArrivedRecords<'_>,
    ) -> Option<Result<u32, PacketError>>;

    /// Integrates the bodies that have arrived, takes their beats and sends their results. Returns
    /// the sums of the words received and sent, or `None` if the accelerator has to do it.
    fn integrate(
        &mut self,
        accelerator: &mut Accelerator,
        poses: &mut Segment,
        results: &mut Results,
        arrived: &mut ArrivedRecords<'_>,
        outputs: &mut [Stream],
    ) -> Option<[u32; 2]>;
}

/// The short cut that takes records, if the board has one.
pub(crate) type Deferral<'a> = Option<&'a mut (dyn Defer + 'static)>;
