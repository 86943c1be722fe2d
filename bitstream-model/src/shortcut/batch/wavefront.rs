//! Runs the passes over the blocks as wave fronts: a pass takes a block as soon as the pass before it
//! has finished with the bodies of that block.
//!
//! ```text
//! pass 0   ################>            chunks of blocks, in their order
//! pass 1   ##########>                  behind by as far as the bodies of a chunk reach
//! pass 2   ####>
//! ```
//!
//! So the collisions are read from memory once for several passes, and threads take different ones.
//! Each thread takes the next few passes that no thread has. While they have to wait for the pass
//! before them, and when none are left, it helps with the passes of others, the last ones first.

#![allow(unsafe_code, reason = "threads share blocks and rows and take turns by passes")]

use std::marker::PhantomData;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};

use pgs_support::Crew;
use pgs_support::lanes::{Instructions, Work, prefetch};

use super::block::{Block, LANES, kind};
use super::given::Given;
use super::grouping::Places;
use super::inertia::{Form, SideInertias};
use super::kernel::{self, InertiaRow, Pass, Rows};
use super::line::Line;
use super::numbers::Computed;
use super::order::Order;
use super::plan::Plan;
use super::width::Width;
use crate::accelerator::arithmetic::inertia::{Isotropic, World};
use crate::accelerator::arithmetic::number::{Half, Single};
use crate::accelerator::per_record::fixed_impulse;
use crate::accelerator::solver::{Mass, Velocity};
use crate::cast::register;
use pgs_interface::number::Precision;
use pgs_interface::profile::Inertia;

/// Blocks of a chunk.
const CHUNK: usize = 8;
/// Passes that a thread takes at once, at most: the passes of one kind in a usual step with a warm start.
const BUNDLE_MAX: usize = 5;
/// Looks at another thread's front before the processor is given away.
const SPINS: u32 = 200;

/// How far a pass has come, in chunks; alone in its cache lines.
#[derive(Debug, Default)]
#[repr(align(128))]
struct Progress {
    chunks: AtomicUsize,
    /// A thread works on the next one.
    taken: AtomicBool,
}

/// The order, the reach and the progress of the fronts, kept from step to step.
#[derive(Debug, Default)]
pub(crate) struct Fronts {
    order: Order,
    /// For each chunk the last one that must have been left by the pass before.
    needs: Vec<u32>,
    progress: Vec<Progress>,
}

/// The passes of one run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Passes<'a> {
    pub(crate) numbers: &'a Range<u32>,
    pub(crate) plan: Plan<'a>,
    /// The friction pass that finds which spins are damped.
    pub(crate) finding: Option<u32>,
    /// In a step with a warm start the impulses that came in, for each block.
    pub(crate) given: &'a [Given],
    /// With world inertia: whether the first pass gathers the inverse inertias. No pass of this step has done
    /// it before.
    pub(crate) gathers: bool,
    pub(crate) width: Width,
    /// Precision of the arithmetic.
    pub(crate) precision: Precision,
    pub(crate) inertia: Inertia,
}

impl Fronts {
    /// Finds the order of the blocks and how far each chunk's bodies reach in it.
    pub(crate) fn measure(&mut self, places: &Places) {
        self.order.find(places.again());
        let chunk = |block: u32| self.order.places[block as usize] / register(CHUNK);
        self.needs.clear();
        self.needs.extend((0..places.blocks().div_ceil(CHUNK)).map(register));
        for [first, last] in places.uses() {
            let need = &mut self.needs[chunk(first) as usize];
            *need = (*need).max(chunk(last));
        }
    }

    /// Runs passes over all blocks; returns the impulses that the last contact pass counts. The rows
    /// of the blocks are in `lines`; with world inertia each has one in `inertias` too, and `kept` has the
    /// inverse inertias of each block.
    pub(crate) fn run(
        &mut self,
        passes: Passes<'_>,
        (blocks, kept): (&mut [Block], &mut [[SideInertias; 2]]),
        lines: &mut [Line],
        inertias: &[InertiaRow],
        crew: &mut Crew,
    ) -> u64 {
        debug_assert!(kept.is_empty() || kept.len() == blocks.len(), "{} kept", kept.len());
        let count = passes.numbers.len();
        if self.progress.len() < count {
            self.progress.resize_with(count, Progress::default);
        }
        for progress in &mut self.progress {
            *progress = Progress::default();
        }
        let field = Field {
            passes,
            blocks: blocks.as_mut_ptr(),
            // An entry for each block, or none at all.
            kept: (kept.len() == blocks.len()).then_some(kept.as_mut_ptr()),
            order: &self.order.blocks,
            rows: Rows { bodies: lines.as_mut_ptr().cast(), inertias: inertias.as_ptr() },
            needs: &self.needs,
            progress: &self.progress[..count],
            next: AtomicUsize::new(0),
            sum: AtomicU64::new(0),
            broken: AtomicBool::new(false),
            alone: crew.is_alone(),
        };
        crew.run(&|thread| field.work(thread));
        field.sum.into_inner()
    }
}

/// The state that the threads of a run share.
struct Field<'a> {
    passes: Passes<'a>,
    blocks: *mut Block,
    /// With world inertia the inverse inertias of each block.
    kept: Option<*mut [SideInertias; 2]>,
    /// All blocks, each once.
    order: &'a [u32],
    rows: Rows,
    needs: &'a [u32],
    progress: &'a [Progress],
    /// The next bundle of passes that no thread has taken.
    next: AtomicUsize,
    sum: AtomicU64,
    /// A thread has panicked: its fronts stand still.
    broken: AtomicBool,
    /// There is one thread only.
    alone: bool,
}

// SAFETY: blocks, their kept inertias and rows are accessed in `chunk` alone, for the next chunk of a pass
// that one thread has taken. The chunks of the pass before over the same bodies or blocks have ended, and so
// have the earlier chunks of this pass: `progress` tells it with release and acquire.
unsafe impl Sync for Field<'_> {}

/// Marks the field as broken when dropped, unless it was cleared before.
struct Breaks<'a>(Option<&'a AtomicBool>);

impl Drop for Breaks<'_> {
    fn drop(&mut self) {
        if let Some(broken) = self.0 {
            broken.store(true, Ordering::Release);
        }
    }
}

impl Field<'_> {
    /// The impulses that a pass brings for a block.
    #[inline(always)]
    fn given<const WARM: bool>(&self, block: u32) -> Option<&Given> {
        if WARM { self.passes.given.get(block as usize) } else { None }
    }

    /// The work of a thread: takes passes while any are left, then helps.
    fn work(&self, thread: usize) {
        let mut breaks = Breaks(Some(&self.broken));
        let mut own = 0..0;
        let mut idle = 0;
        loop {
            if own.clone().all(|pass| self.ended(pass)) {
                own = self.next_bundle();
            }
            if own.is_empty() && self.ended(self.progress.len() - 1) {
                break;
            }
            if self.bundle(own.clone(), thread) || !self.alone && self.help(thread) {
                idle = 0;
                continue;
            }
            idle += 1;
            if self.broken.load(Ordering::Acquire) {
                break;
            }
            if idle > SPINS {
                std::thread::yield_now();
            } else {
                std::hint::spin_loop();
            }
        }
        breaks.0 = None;
    }

    /// The next passes that no thread has.
    fn next_bundle(&self) -> Range<usize> {
        let count = self.progress.len();
        // As few bundles as possible, and one for each of two threads. Earlier bundles are not longer than
        // later ones: the thread of the first one waits for memory.
        let bundles = count.div_ceil(BUNDLE_MAX).max(if self.alone { 1 } else { 2 });
        let begin = |bundle: usize| bundle.min(bundles) * count / bundles;
        if self.next.load(Ordering::Relaxed) >= bundles {
            return count..count;
        }
        let bundle = self.next.fetch_add(1, Ordering::Relaxed);
        begin(bundle)..begin(bundle + 1)
    }

    /// Whether a pass has come to its end.
    fn ended(&self, pass: usize) -> bool {
        self.progress[pass].chunks.load(Ordering::Acquire) == self.needs.len()
    }

    /// Runs neighbouring passes, the later ones as close behind as they may be: the first by one
    /// chunk, the others as far as they can. Returns whether any went on.
    fn bundle(&self, passes: Range<usize>, thread: usize) -> bool {
        let mut worked = false;
        for pass in passes.clone() {
            while self.go_on(pass, thread) {
                worked = true;
                if pass == passes.start {
                    break;
                }
            }
        }
        worked
    }

    /// Runs a chunk of the last pass that can go on. Returns whether there was one.
    fn help(&self, thread: usize) -> bool {
        (0..self.progress.len()).rev().any(|pass| self.go_on(pass, thread))
    }

    /// Runs the next chunk of a pass if the pass before has left its bodies behind and no other
    /// thread has it. Returns whether it did.
    fn go_on(&self, pass: usize, thread: usize) -> bool {
        let Progress { chunks, taken } = &self.progress[pass];
        let limit = match pass {
            0 => self.needs.len(),
            _ => self.progress[pass - 1].chunks.load(Ordering::Acquire),
        };
        let free = |at: usize| self.needs.get(at).is_some_and(|need| (*need as usize) < limit);
        let mut at = chunks.load(Ordering::Acquire);
        if !free(at) {
            return false;
        }
        if !self.alone {
            if taken.load(Ordering::Relaxed) || taken.swap(true, Ordering::Acquire) {
                return false;
            }
            // It may have gone on until then.
            at = chunks.load(Ordering::Acquire);
        }
        let free = free(at);
        if free {
            self.chunk(pass, at, thread);
            chunks.store(at + 1, Ordering::Release);
        }
        if !self.alone {
            taken.store(false, Ordering::Release);
        }
        free
    }

    /// Runs a pass over a chunk that the pass before has left behind.
    fn chunk(&self, pass: usize, chunk: usize, thread: usize) {
        let number = self.passes.numbers.start + register(pass);
        let stage = self.passes.plan.stage(number);
        let pass = Pass {
            stage,
            finds: self.passes.finding == Some(number),
            gathers: self.passes.gathers && pass == 0,
            parameters: self.passes.plan.parameters,
            spare: 2 * (register(thread) + 1),
        };
        match (self.passes.precision, self.passes.inertia, stage.warm) {
            (Precision::F32, Inertia::Isotropic, false) => {
                self.chunk_in::<Single, Isotropic, false>(pass, chunk);
            }
            (Precision::F32, Inertia::Isotropic, true) => {
                self.chunk_in::<Single, Isotropic, true>(pass, chunk);
            }
            (Precision::F32, Inertia::World, false) => {
                self.chunk_in::<Single, World, false>(pass, chunk);
            }
            (Precision::F32, Inertia::World, true) => {
                self.chunk_in::<Single, World, true>(pass, chunk);
            }
            // No layout has world inertia or a warm start in sixteen bits.
            (Precision::Binary16, ..) => self.chunk_in::<Half, Isotropic, false>(pass, chunk),
        }
    }

    /// The same in a format, with a form of inertia, in a warm pass or another one.
    fn chunk_in<F: Computed, I: Form, const WARM: bool>(&self, pass: Pass<'_>, chunk: usize) {
        let mut sum = 0;
        let (behind, end) = (((chunk + 1) * CHUNK).min(self.order.len()), self.order.len());
        let blocks = &self.order[chunk * CHUNK..behind];
        let ahead = &self.order[(chunk * CHUNK + 1)..(behind + 1).min(end)];
        let format = PhantomData::<(F, I)>;
        let sums = &mut sum;
        let work = ChunkWork::<F, I, WARM> { field: self, pass, blocks, ahead, sum: sums, format };
        if let Err(work) = self.passes.width.run(work) {
            work.one_by_one();
        }
        if sum > 0 {
            let add = |before: u64| Some(before.saturating_add(sum));
            let _ = self.sum.fetch_update(Ordering::Relaxed, Ordering::Relaxed, add);
        }
    }
}

/// A pass over the blocks of a chunk.
struct ChunkWork<'a, F, I, const WARM: bool> {
    field: &'a Field<'a>,
    pass: Pass<'a>,
    blocks: &'a [u32],
    /// The block behind each, which may be of the next chunk.
    ahead: &'a [u32],
    sum: &'a mut u64,
    format: PhantomData<(F, I)>,
}

impl<F: Computed, I: Form, const WARM: bool> Work for ChunkWork<'_, F, I, WARM> {
    type Output = ();

    #[inline(always)]
    fn run(self, instructions: impl Instructions) {
        for (at, &index) in self.blocks.iter().enumerate() {
            if let Some(&ahead) = self.ahead.get(at) {
                prefetch(self.field.blocks.wrapping_add(ahead as usize));
                if let Some(given) = self.field.given::<WARM>(ahead) {
                    prefetch(given);
                }
                if let Some(kept) = self.field.kept {
                    prefetch(kept.wrapping_add(ahead as usize));
                }
            }
            // SAFETY: `order` has numbers of blocks.
            let block = unsafe { self.field.blocks.add(index as usize) };
            // SAFETY: the block is in a chunk that this thread alone has: see `Sync`.
            let block = unsafe { &mut *block };
            let given = self.field.given::<WARM>(index);
            if block.serial() {
                // SAFETY: `Batch::enter` has made a row for every body, with world inertia in both arrays; while the thread
                // has the chunk, the rows of its bodies are its own: see `Sync`.
                let sum = unsafe { one_by_one::<F, I>(&self.pass, block, given, self.field.rows) };
                *self.sum = self.sum.saturating_add(sum);
                continue;
            }
            let arithmetic = F::arithmetic(instructions);
            let kept = self.field.kept.map(|kept| {
                // SAFETY: `order` has numbers of blocks, and `kept` has an entry for each block: `Fronts::run`
                // takes the pointer only if both lengths are equal.
                let kept = unsafe { kept.add(index as usize) };
                // SAFETY: only the thread that has the chunk of a block accesses the entry of this block: see
                // `Sync`.
                unsafe { &mut *kept }
            });
            let rows = self.field.rows;
            // SAFETY: `Batch::enter` has made a row for every body, with world inertia in both arrays, and one to
            // spare for each thread. While the thread has the chunk, the rows of its bodies are its own: see
            // `Sync`.
            unsafe {
                kernel::solve::<_, I>(
                    arithmetic,
                    instructions,
                    &self.pass,
                    block,
                    given,
                    kept,
                    rows,
                );
            }
            if self.pass.stage.contact && self.pass.stage.turning {
                *self.sum = self.sum.saturating_add(counted::<F>(block));
            }
        }
    }
}

impl<F: Computed, I: Form, const WARM: bool> ChunkWork<'_, F, I, WARM> {
    fn one_by_one(self) {
        for &index in self.blocks {
            // SAFETY: `order` has numbers of blocks.
            let block = unsafe { self.field.blocks.add(index as usize) };
            // SAFETY: the block is in a chunk that this thread alone has: see `Sync`.
            let block = unsafe { &mut *block };
            let given = self.field.given::<WARM>(index);
            // SAFETY: `Batch::enter` has made a row for every body, with world inertia in both arrays; while the thread
            // has the chunk, the rows of its bodies are its own: see `Sync`.
            let sum = unsafe { one_by_one::<F, I>(&self.pass, block, given, self.field.rows) };
            *self.sum = self.sum.saturating_add(sum);
        }
    }
}

/// The impulses of a block after the last contact pass; empty lanes have none.
#[inline(always)]
fn counted<F: Computed>(block: &Block) -> u64 {
    (0..LANES).fold(0, |sum, lane| sum.saturating_add(fixed_impulse::<F>(&block.impulses(lane))))
}

/// A pass over the collisions of a block, one after the other.
///
/// # Safety
///
/// The rows of the block exist, with world inertia in both arrays. While this runs, no other thread
/// writes them, and none reads the rows of moving bodies.
unsafe fn one_by_one<F: Computed, I: Form>(
    pass: &Pass<'_>,
    block: &mut Block,
    given: Option<&Given>,
    rows: Rows,
) -> u64 {
    let mut sum = 0_u64;
    for lane in 0..LANES {
        let mut collision = block.collision(lane);
        if collision.count == 0 {
            continue;
        }
        if let Some(given) = given {
            collision.impulses = given.of(pass.stage.contact, lane);
        }
        let mut masses = [Mass::default(); 2];
        let mut velocities = [Velocity::default(); 2];
        let mut beside = [0.0; 2];
        for side in 0..2 {
            let index = block.rows[side][lane] as usize;
            // SAFETY: the caller promises that the row exists.
            let row = unsafe { rows.bodies.add(index) };
            // SAFETY: the caller promises that it can be read.
            let [[x, y, z, m], [p, q, r, k]] = unsafe { row.read() };
            velocities[side] = Velocity { linear: [x, y, z], angular: [p, q, r] };
            let inverse_inertia = I::stored(k, || {
                // SAFETY: the form is about axes: the caller promises that the row exists.
                let row = unsafe { rows.inertias.add(index) };
                // SAFETY: `run` has borrowed the inertias as a shared slice, so that no thread writes them.
                unsafe { row.read() }
            });
            masses[side] = Mass { inverse_mass: m, inverse_inertia };
            beside[side] = k;
        }
        let mut impulses = block.impulses(lane);
        let stage = pass.stage;
        let share = stage.solve::<F, I>(
            &collision,
            pass.parameters,
            &masses,
            &mut velocities,
            &mut impulses,
        );
        sum = sum.saturating_add(share);
        block.put_impulses(lane, impulses);
        for side in 0..2 {
            if block.kind[lane] & kind::MOVES[side] != 0 {
                let (Velocity { linear: [x, y, z], angular: [p, q, r] }, mass) =
                    (velocities[side], masses[side]);
                let row = [[x, y, z, mass.inverse_mass], [p, q, r, beside[side]]];
                // SAFETY: the caller promises that the row exists.
                let at = unsafe { rows.bodies.add(block.rows[side][lane] as usize) };
                // SAFETY: the caller promises that a moving body's can be written.
                unsafe { at.write(row) };
            }
        }
    }
    sum
}
