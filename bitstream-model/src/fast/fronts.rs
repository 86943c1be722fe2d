//! Runs the passes over the blocks as wave fronts: a pass takes a block as soon as the pass before
//! it has finished with the bodies of that block.
//!
//! ```text
//! pass 0   ################>            chunks of blocks, in their order
//! pass 1   ##########>                  behind by as far as the bodies of a chunk reach
//! pass 2   ####>
//! ```
//!
//! So the rows are read from memory once for several passes, and threads take different ones. Each
//! thread takes the next few passes that no thread has. While they have to wait for the pass before
//! them, and when none are left, it helps with the passes of others, the last ones first.

#![allow(unsafe_code, reason = "threads share blocks and rows and take turns by passes")]

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};

use pgs_support::Crew;
use pgs_support::float_env::without_subnormals;
use pgs_support::lanes::{InstructionSet, Instructions, LANES, Work};

use super::Plan;
use super::block::{Beside, Block, BodyRow, Given, Spins};
use super::groups::Groups;
use crate::accelerator::arithmetic::number::{Half, Single};
use crate::accelerator::per_record::fixed_impulse;
use crate::cast::register;

/// Blocks of a chunk.
const CHUNK: usize = 8;
/// Passes that a thread takes at once, at most: the passes of one kind in a usual step with a warm
/// start.
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

/// The reach and the progress of the fronts, kept from step to step.
#[derive(Debug, Default)]
pub(super) struct Fronts {
    /// For each chunk the last one that must have been left by the pass before.
    needs: Vec<u32>,
    progress: Vec<Progress>,
}

/// The outcome of all passes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Solved {
    /// The impulses that the last contact pass counts.
    pub(super) impulse_sum: u64,
    /// Whether a subnormal number may have occurred.
    pub(super) subnormal: bool,
}

impl Fronts {
    /// Runs passes of a plan over all blocks. `bodies` has their rows. The spins have an entry for
    /// each block or none at all, and so have the impulses that came in.
    pub(super) fn run(
        &mut self,
        plan: Plan,
        passes: Range<u32>,
        groups: &Groups,
        (blocks, spins, given): (&mut [Block], &[Spins], &[Given]),
        bodies: &mut [BodyRow],
        crew: &mut Crew,
    ) -> Solved {
        self.needs.clear();
        self.needs.extend((0..blocks.len().div_ceil(CHUNK)).map(register));
        for uses in groups.uses() {
            let [first, last] = uses.map(|block| block / register(CHUNK));
            let need = &mut self.needs[first as usize];
            *need = (*need).max(last);
        }
        let count = passes.len();
        self.progress.clear();
        self.progress.resize_with(count, Progress::default);
        let field = Field {
            plan,
            first: passes.start,
            count: blocks.len(),
            blocks: blocks.as_mut_ptr(),
            spins,
            given,
            bodies: bodies.as_mut_ptr(),
            needs: &self.needs,
            progress: &self.progress,
            next: AtomicUsize::new(0),
            sum: AtomicU64::new(0),
            broken: AtomicBool::new(false),
            subnormal: AtomicBool::new(false),
            alone: crew.is_alone(),
            instructions: InstructionSet::found().in_binary16(plan.binary16),
        };
        if count > 0 && !blocks.is_empty() {
            crew.run(&|thread| {
                let ((), none) = without_subnormals(plan.watches, || field.work(thread));
                if !none {
                    field.subnormal.store(true, Ordering::Relaxed);
                }
            });
        }
        Solved { impulse_sum: field.sum.into_inner(), subnormal: field.subnormal.into_inner() }
    }
}

/// The state that the threads of a run share.
struct Field<'a> {
    plan: Plan,
    /// The number of the first pass.
    first: u32,
    count: usize,
    blocks: *mut Block,
    spins: &'a [Spins],
    given: &'a [Given],
    bodies: *mut BodyRow,
    needs: &'a [u32],
    progress: &'a [Progress],
    /// The next bundle of passes that no thread has taken.
    next: AtomicUsize,
    sum: AtomicU64,
    /// A thread has panicked: its fronts stand still.
    broken: AtomicBool,
    subnormal: AtomicBool,
    /// There is one thread only.
    alone: bool,
    instructions: InstructionSet,
}

// SAFETY: only `chunk` accesses blocks and rows, for the next chunk of a pass that one thread has
// taken. Earlier chunks of this pass have ended, and so have the chunks of the pass before over the
// same bodies or blocks: `progress` orders them by release and acquire. Each thread has a spare row
// of its own. All threads read the rows of static bodies, and no thread writes them.
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
        // As few bundles as possible, and one for each of two threads. Earlier bundles are not
        // longer than later ones: the thread of the first one waits for memory.
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
            self.instructions.run(Chunk { field: self, pass, chunk: at, thread });
            chunks.store(at + 1, Ordering::Release);
        }
        if !self.alone {
            taken.store(false, Ordering::Release);
        }
        free
    }
}

/// A pass over the blocks of a chunk.
struct Chunk<'a> {
    field: &'a Field<'a>,
    pass: usize,
    chunk: usize,
    thread: usize,
}

impl Work for Chunk<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self, instructions: impl Instructions) {
        let Self { field, pass, chunk, thread } = self;
        let stage = field.plan.stage(field.first + register(pass));
        let spare = register(thread) + 1;
        let mut sum = 0_u64;
        for at in chunk * CHUNK..((chunk + 1) * CHUNK).min(field.count) {
            Block::prefetch(field.blocks.wrapping_add(at + 1), stage.contact);
            // SAFETY: `at` is below the number of blocks.
            let block = unsafe { field.blocks.add(at) };
            // SAFETY: the block is in a chunk that this thread alone has: see `Sync`.
            let block = unsafe { &mut *block };
            let given = if stage.warm { field.given.get(at) } else { None };
            let beside = Beside { spins: field.spins.get(at), given };
            // SAFETY: there is a row for every body, and one to spare for each thread. While the
            // thread has the chunk, the rows of its bodies are its own: see `Sync`.
            unsafe {
                block.pass(instructions, stage, field.plan.damping, beside, field.bodies, spare);
            }
            if stage.contact && stage.turning {
                let fixed = match field.plan.binary16 {
                    true => fixed_impulse::<Half>,
                    false => fixed_impulse::<Single>,
                };
                let of = |lane| fixed(&block.impulses_of(lane));
                sum = (0..LANES).fold(sum, |sum, lane| sum.saturating_add(of(lane)));
            }
        }
        if sum > 0 {
            let add = |old: u64| Some(old.saturating_add(sum));
            let _ = field.sum.fetch_update(Ordering::Relaxed, Ordering::Relaxed, add);
        }
    }
}
