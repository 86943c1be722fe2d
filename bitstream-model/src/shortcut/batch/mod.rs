//! Decodes the collisions of a step once, and runs the passes over many of them at a time.
//!
//! ```text
//! beats -> decode: grouping.rs (which are independent), block.rs (side by side) -> wavefront.rs
//!   convert, if they are records of another design
//! ```
//!
//! Only collisions that share no moving body change places, so that every bit is that of
//! `solver.rs` taking one after the other. It is for arithmetic in f32 with either form of inertia, or in
//! binary16 with isotropic inertia, and for subnormals that are kept.

mod block;
mod convert;
mod decode;
mod given;
mod grouping;
mod inertia;
mod kernel;
mod line;
mod motion;
mod numbers;
mod order;
mod plan;
mod queue;
mod records;
#[cfg(test)]
mod tests;
mod vector;
mod wavefront;
mod width;

use std::ops::Range;

use pgs_support::Crew;

use crate::accelerator::arithmetic::inertia::{Isotropic, World};
use crate::accelerator::arithmetic::number::{Half, Single};
use crate::accelerator::hazards::Entry;
#[cfg(test)]
use crate::accelerator::records::decode::Collision;
use crate::accelerator::solver::{Impulses, Velocity};
use crate::config::THREADS_MAX;
use pgs_interface::number::Precision;
use pgs_interface::profile::Inertia;
use pgs_interface::record::CONTACT_POINTS;

use block::{Block, LANES, ROWS_APART};
use decode::{Group, PUT_OFF};
use given::Given;
use grouping::Places;
use inertia::SideInertias;
use kernel::InertiaRow;
use line::Line;
use plan::Stage;
use wavefront::{Fronts, Passes};
use width::Width;

pub(crate) use convert::Translation;
pub(crate) use motion::ResultPlaces;
pub(crate) use plan::{Plan, Properties};
pub(crate) use records::{IMPULSES, PLACES};

/// The slot of a padding entry.
const NO_SLOT: u32 = u32::MAX;

/// Bodies that a thread copies at once.
const COPIED_TOGETHER: usize = 2048;

/// The collisions of a step.
#[derive(Debug)]
pub(crate) struct Batch {
    /// The blocks of this step, then unused blocks of earlier steps.
    blocks: Vec<Block>,
    places: Places,
    /// Block and lane of each collision.
    slots: Vec<u32>,
    impulse_sum: u64,
    width: Width,
    /// Precision of the arithmetic.
    precision: Precision,
    inertia: Inertia,
    crew: Crew,
    fronts: Fronts,
    /// Whether the fronts are measured for all decoded collisions.
    measured: bool,
    /// Whether the blocks say which spins are damped.
    spins: bool,
    /// Number of bodies.
    bodies: usize,
    lines: Vec<Line>,
    /// With world inertia a row for each row of the lines.
    inertias: Vec<InertiaRow>,
    /// With world inertia the inverse inertias of both sides of each block, from the first pass on.
    kept: Vec<[SideInertias; 2]>,
    /// Whether a pass of this step has gathered them.
    gathered: bool,
    /// Whether the lines have the velocities of all bodies.
    entered: bool,
    /// In a step with a warm start the impulses that came in, for each block.
    given: Vec<Given>,
    /// Records that are put into their blocks when the threads have ended.
    put_off: Vec<Group>,
    /// Whether the records of the step have the friction of their pair above the contact count.
    pair_friction: bool,
}

impl Batch {
    /// Computes on at most `threads` threads, the caller's included, with SIMD lanes if `lanes` is set.
    pub(crate) fn new(threads: usize, lanes: bool) -> Self {
        Self::with_width(threads, if lanes { Width::found() } else { Width::One })
    }

    fn with_width(threads: usize, width: Width) -> Self {
        let crew = Crew::new("board", threads.clamp(1, THREADS_MAX) - 1);
        if let Some(error) = crew.refused() {
            log::warn!("no thread to help the board: {error}");
        }
        Self {
            blocks: Vec::new(),
            places: Places::default(),
            slots: Vec::new(),
            impulse_sum: 0,
            width,
            precision: Precision::F32,
            inertia: Inertia::Isotropic,
            crew,
            fronts: Fronts::default(),
            measured: false,
            spins: false,
            bodies: 0,
            lines: Vec::new(),
            inertias: Vec::new(),
            kept: Vec::new(),
            gathered: false,
            entered: false,
            given: Vec::new(),
            put_off: Vec::with_capacity(PUT_OFF),
            pair_friction: false,
        }
    }

    /// Sets the precision of the arithmetic, and the number of collisions that enter together.
    pub(crate) fn of(mut self, precision: Precision, together: usize) -> Self {
        self.precision = precision;
        self.places = Places::of_issues(together);
        self
    }

    /// Sets the form of inertia: world inertia in f32 alone.
    pub(crate) fn with_inertia(self, inertia: Inertia) -> Self {
        Self { inertia, ..self }
    }

    /// Begins a step: forgets the last step's collisions and makes room for `collisions`, which with
    /// `pair_friction` have the friction of their pair.
    pub(crate) fn begin(&mut self, collisions: usize, pair_friction: bool) {
        self.pair_friction = pair_friction;
        // Each part that is decoded needs some spare blocks at its end.
        let blocks = collisions.div_ceil(LANES) + 2 * LANES;
        self.blocks.reserve(blocks.saturating_sub(self.blocks.len()));
        self.slots.clear();
        self.slots.reserve(collisions);
        self.places.begin(collisions);
        self.impulse_sum = 0;
        self.measured = false;
        self.spins = false;
        self.gathered = false;
        self.bodies = 0;
        self.entered = false;
    }

    /// Forgets the passes that were run: the next one begins with the velocities that are entered then.
    pub(crate) fn restart(&mut self) {
        let blocks = &mut self.blocks[..self.places.blocks()];
        self.crew.each(blocks.chunks_mut(COPIED_TOGETHER / LANES), |blocks| {
            blocks.iter_mut().for_each(Block::forget_impulses);
        });
        self.impulse_sum = 0;
        self.entered = false;
    }

    /// Collisions decoded, padding entries among them.
    pub(crate) fn len(&self) -> usize {
        self.slots.len()
    }

    /// Copies the velocities of all bodies into the lines, unless they are there already.
    pub(crate) fn enter(&mut self, velocities: &[Velocity], properties: Properties<'_>) {
        if self.entered {
            return;
        }
        let lines = (ROWS_APART as usize + self.bodies.max(velocities.len())).div_ceil(2);
        if self.lines.len() < lines {
            self.lines.resize(lines, Line::default());
        }
        let Properties { shape_of, masses, inverse_masses, inertias } = properties;
        let own = &mut self.lines[ROWS_APART as usize / 2..];
        let bodies = velocities.chunks(COPIED_TOGETHER).zip(shape_of.chunks(COPIED_TOGETHER));
        let rounded = self.precision == Precision::Binary16;
        let parts = (0..).step_by(COPIED_TOGETHER).zip(bodies);
        self.crew.each(
            parts.zip(own.chunks_mut(COPIED_TOGETHER / 2)),
            |((first, (velocities, shapes)), lines)| {
                let inverse_masses = inverse_masses.get(first..).unwrap_or_default();
                for (body, (velocity, shape)) in velocities.iter().zip(shapes).enumerate() {
                    let mut mass = masses[usize::from(*shape)];
                    if let Some(inverse_mass) = inverse_masses.get(body) {
                        mass.inverse_mass = *inverse_mass;
                    }
                    let line = &mut lines[body / 2];
                    if rounded {
                        line.put(body % 2 == 1, velocity, &mass.rounded::<Half>());
                    } else {
                        line.put(body % 2 == 1, velocity, &mass);
                    }
                }
            },
        );
        if self.inertia == Inertia::World {
            let rows = 2 * self.lines.len();
            if self.inertias.len() < rows {
                self.inertias.resize(rows, InertiaRow::default());
            }
            let own = &mut self.inertias[ROWS_APART as usize..];
            let parts = inertias.chunks(COPIED_TOGETHER).zip(own.chunks_mut(COPIED_TOGETHER));
            self.crew.each(parts, |(inertias, rows)| {
                for (row, inertia) in rows.iter_mut().zip(inertias) {
                    *row = inertia::row(*inertia);
                }
            });
        }
        self.entered = true;
    }

    /// Calls `with` for each of `things`, on all threads and in no particular order.
    pub(crate) fn share<T>(
        &mut self,
        things: impl Iterator<Item = T> + Send,
        with: impl Fn(T) + Sync,
    ) {
        self.crew.each(things, with);
    }

    /// Block and lane of a collision, or `None` for a padding entry.
    fn slot(&self, index: usize) -> Option<(usize, usize)> {
        let slot = *self.slots.get(index)?;
        (slot != NO_SLOT).then_some((slot as usize / LANES, slot as usize % LANES))
    }

    /// The bodies of a decoded collision and which of them move, or `None` for a padding entry.
    pub(crate) fn entry(&self, index: usize) -> Option<Entry> {
        self.slot(index).map(|(block, lane)| self.blocks[block].entry(lane))
    }

    /// A decoded collision, or `None` for a padding entry.
    #[cfg(test)]
    pub(crate) fn collision(&self, index: usize) -> Option<Collision> {
        self.slot(index).map(|(block, lane)| self.blocks[block].collision(lane))
    }

    /// The smallest distance, in issues, of two that share a moving body; `u32::MAX` without.
    pub(crate) fn distance(&self) -> u32 {
        self.places.distance()
    }

    /// Runs whole passes over all collisions, from the velocities on that were entered before, or else
    /// from `velocities` on, which has an entry for every body. [`leave`](Self::leave) gives the new ones.
    pub(crate) fn run(
        &mut self,
        passes: Range<u32>,
        plan: &Plan<'_>,
        properties: Properties<'_>,
        velocities: &[Velocity],
    ) {
        if passes.is_empty() || self.places.blocks() == 0 {
            return;
        }
        if !self.measured {
            self.fronts.measure(&self.places);
            self.measured = true;
        }
        self.enter(velocities, properties);
        let finding = passes.clone().find(|pass| plan.damps(*pass) && !self.spins);
        if plan.warm && self.given.len() < self.places.blocks() {
            self.given.resize(self.places.blocks(), Given::NONE);
        }
        let (width, precision, inertia) = (self.width, self.precision, self.inertia);
        let rounded;
        let plan = match precision {
            Precision::F32 => *plan,
            Precision::Binary16 => {
                rounded = plan.parameters.rounded::<Half>();
                Plan { parameters: &rounded, ..*plan }
            }
        };
        let given = &self.given[..];
        let numbers = &passes;
        let gathers = !self.gathered;
        let run = Passes { numbers, plan, finding, given, gathers, width, precision, inertia };
        let count = self.places.blocks();
        let world = if inertia == Inertia::World { count } else { 0 };
        if self.kept.len() < world {
            self.kept.resize(world, [SideInertias::ZERO; 2]);
        }
        let blocks = (&mut self.blocks[..count], &mut self.kept[..world]);
        let (lines, inertias) = (&mut self.lines, &self.inertias);
        let sum = self.fronts.run(run, blocks, lines, inertias, &mut self.crew);
        self.impulse_sum = self.impulse_sum.saturating_add(sum);
        self.spins |= finding.is_some();
        self.gathered = true;
    }

    /// Stores the entered velocities as the passes have left them.
    pub(crate) fn leave(&mut self, velocities: &mut [Velocity]) {
        if !self.entered {
            return;
        }
        let own = &self.lines[ROWS_APART as usize / 2..];
        let bodies = velocities.chunks_mut(COPIED_TOGETHER).zip(own.chunks(COPIED_TOGETHER / 2));
        self.crew.each(bodies, |(velocities, lines)| {
            for (body, velocity) in velocities.iter_mut().enumerate() {
                *velocity = lines[body / 2].velocity(body % 2 == 1);
            }
        });
    }

    /// Runs a part of one pass, one collision after the other in the order received.
    pub(crate) fn run_part(
        &mut self,
        pass: u32,
        part: Range<usize>,
        plan: &Plan<'_>,
        properties: Properties<'_>,
        velocities: &mut [Velocity],
    ) {
        let stage = plan.stage(pass);
        self.entered = false;
        for index in part {
            let Some((at, lane)) = self.slot(index) else { continue };
            let block = &mut self.blocks[at];
            let Entry { bodies, moving } = block.entry(lane);
            let sides = bodies.map(|body| body as usize);
            let mut pair = sides.map(|body| velocities[body]);
            let mut impulses = block.impulses(lane);
            let masses = sides.map(|body| properties.mass(body));
            let mut collision = block.collision(lane);
            if let Some(given) = self.given.get(at) {
                collision.impulses = given.of(stage.contact, lane);
            }
            let solve = match (self.precision, self.inertia) {
                (Precision::F32, Inertia::Isotropic) => Stage::solve::<Single, Isotropic>,
                (Precision::F32, Inertia::World) => Stage::solve::<Single, World>,
                (Precision::Binary16, _) => Stage::solve::<Half, Isotropic>,
            };
            let sum = solve(stage, &collision, plan.parameters, &masses, &mut pair, &mut impulses);
            self.impulse_sum = self.impulse_sum.saturating_add(sum);
            block.put_impulses(lane, impulses);
            for side in 0..2 {
                if moving[side] {
                    velocities[sides[side]] = pair[side];
                }
            }
        }
    }

    /// The accumulated impulses of a collision after the passes run so far.
    pub(crate) fn impulses(&self, index: usize) -> Impulses {
        self.slot(index)
            .map_or([0.0; CONTACT_POINTS], |(block, lane)| self.blocks[block].impulses(lane))
    }

    /// The last contact pass's share of the accelerator's impulse sum.
    pub(crate) fn impulse_sum(&self) -> u64 {
        self.impulse_sum
    }
}
