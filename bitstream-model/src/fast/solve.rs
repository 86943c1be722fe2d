//! Computes a step: collisions side by side where the design computes in f32, or else one after the
//! other by the reference's own functions; then bodies.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use pgs_support::float_env::without_subnormals;
use pgs_support::lanes::{InstructionSet, Instructions, LANES, Work};

use super::block::{
    Beside, Block, BodyRow, Given, InertiaRow, NONE, ROWS_APART, Scene, Spins, Words,
};
use super::fronts::Fronts;
use super::groups::Groups;
use super::order::Order;
use super::read::{COLD, Collisions, Input, KINDS, Views, kind};
use super::{Fast, Plan};
use crate::accelerator::Accelerator;
use crate::accelerator::records::decode::{self, Collision};
use crate::accelerator::records::segment::Reader;
use crate::accelerator::solver::Impulses;
use crate::accelerator::state::Velocity;
use pgs_interface::control::NUMBERS_PER_BEAT;
use pgs_interface::number::Numbers;
use pgs_interface::profile::Inertia;
use pgs_interface::record::{Beat, CONTACT_POINTS, collision};
use pgs_interface::stripe::IMPULSES_STREAM;

/// Bodies or blocks that a thread takes at once.
const OF_THREAD: usize = 512;

/// The collisions of a step side by side.
#[derive(Debug, Default)]
pub(super) struct Lanes {
    groups: Groups,
    blocks: Vec<Block>,
    spins: Vec<Spins>,
    given: Vec<Given>,
    bodies: Vec<BodyRow>,
    inertias: Vec<InertiaRow>,
    fronts: Fronts,
}

impl Fast {
    /// Reads which bodies the collisions move, and places them side by side if lanes compute them:
    /// then their records are returned. `None` if a collision is wrong.
    pub(super) fn read_collisions<'a>(
        &mut self,
        accelerator: &Accelerator,
        input: &Input<'a>,
    ) -> Option<Option<Collisions<'a>>> {
        let count = accelerator.arguments.collisions as usize;
        let Self { entries, order, lanes: Lanes { groups, .. }, .. } = self;
        entries.clear();
        order.begin(accelerator);
        if accelerator.variant.numbers == Numbers::F32 {
            let records = Collisions::new(accelerator, input)?;
            groups.begin(accelerator.velocities.len());
            let friction = accelerator.arguments.solver.pair_friction;
            let ignored = if friction { collision::FRICTION_BITS } else { 0 };
            for at in 0..count {
                let head = records.word(at, collision::NORMAL) & !ignored;
                let rows = [collision::BODY_A, collision::BODY_B];
                let bodies = rows.map(|row| records.word(at, row));
                let entry = accelerator.entry(head as usize, bodies)?;
                entries.push(entry);
                if let Some(number) = order.enter(entry) {
                    groups.place(number, entries[number as usize]);
                }
            }
            while let Some(number) = order.leave() {
                groups.place(number, entries[number as usize]);
            }
            if !groups.wasteful() {
                return Some(Some(records));
            }
            entries.clear();
            order.begin(accelerator);
        }
        for number in 0..KINDS {
            self.collisions[number].clear();
            let Some(views) = input.collisions[number] else { continue };
            let pass = match number {
                0 => COLD,
                1 => 0,
                _ => accelerator.arguments.contact_passes(),
            };
            let segment = accelerator.collisions_in(pass);
            let mut reader = Reader::new(segment.array(), 0, views);
            let collisions = &mut self.collisions[number];
            accelerator.read_collisions(number > 0, &mut reader, collisions);
        }
        // The same bodies in every pass, so that stalls are counted once.
        let mut kinds = self.collisions.iter().filter(|collisions| !collisions.is_empty());
        let first = kinds.next()?;
        let same = |(one, other): (&Collision, &Collision)| one.head() == other.head();
        kinds.all(|others| others.iter().zip(first).all(same)).then_some(())?;
        for collision in first {
            let (count, bodies) = collision.head();
            let entry = accelerator.entry(count, bodies)?;
            entries.push(entry);
            order.enter(entry);
        }
        while order.leave().is_some() {}
        Some(None)
    }

    /// Solves the collisions one after the other; returns the sum of the normal impulses.
    pub(super) fn solve_one_by_one(&mut self, accelerator: &mut Accelerator, plan: Plan) -> u64 {
        let mut sent = 0;
        let before = accelerator.counters.impulse_sum;
        for pass in 0..plan.passes {
            let collisions = &self.collisions[kind(accelerator, pass)];
            accelerator.compute_pass(pass, collisions, &self.order.numbers);
            if accelerator.arguments.sends_impulses(pass) {
                let impulses = |_, number| match self.entries[number] {
                    Some(_) => accelerator.impulses[number],
                    None => [0.0; CONTACT_POINTS],
                };
                let to = &mut self.results[IMPULSES_STREAM][sent..];
                sent += send(&self.order, pass < plan.contact, impulses, to);
            }
        }
        std::mem::replace(&mut accelerator.counters.impulse_sum, before)
    }

    /// Solves the collisions side by side; returns the sum of the normal impulses, or `None` if a
    /// subnormal number may have occurred on a board that flushes.
    pub(super) fn solve_in_lanes(
        &mut self,
        accelerator: &mut Accelerator,
        records: &Collisions<'_>,
        plan: Plan,
    ) -> Option<u64> {
        let Self { lanes, crew, results, order, .. } = self;
        let Lanes { groups, blocks, spins, given, bodies, inertias, fronts } = lanes;
        bodies.clear();
        bodies.resize(ROWS_APART as usize, BodyRow::default());
        inertias.clear();
        let world = accelerator.variant.inertia == Inertia::World;
        if world {
            inertias.resize(ROWS_APART as usize, InertiaRow::default());
        }
        for (body, velocity) in accelerator.velocities.iter().enumerate() {
            let Velocity { linear: [x, y, z], angular: [p, q, r] } = *velocity;
            let mass = accelerator.mass_of(body);
            let [xx, yy, zz, xy, xz, yz] = mass.inverse_inertia;
            bodies.push([[x, y, z, mass.inverse_mass], [p, q, r, xx]]);
            if world {
                inertias.push([[xx, yy, zz, 0.0], [xy, xz, yz, 0.0]]);
            }
        }
        let count = groups.members.len();
        if blocks.len() < count {
            blocks.resize(count, Block::EMPTY);
        }
        let of_world = if world { count } else { 0 };
        if spins.len() < of_world {
            spins.resize(of_world, Spins::default());
        }
        let of_warm = if records.are_warm() { count } else { 0 };
        if given.len() < of_warm {
            given.resize(of_warm, Given::default());
        }
        let (blocks, spins) = (&mut blocks[..count], &mut spins[..of_world]);
        let given = &mut given[..of_warm];
        let parameters = &accelerator.arguments.solver;
        let scene = Scene { bodies, inertias, parameters };
        let subnormal = AtomicBool::new(false);
        let of_spins = spins.chunks_mut(OF_THREAD).map(Some).chain(std::iter::repeat_with(|| None));
        let of_given = given.chunks_mut(OF_THREAD).map(Some).chain(std::iter::repeat_with(|| None));
        let beside = of_spins.zip(of_given).map(|(spins, given)| Beside { spins, given });
        let parts = groups.members.chunks(OF_THREAD).zip(blocks.chunks_mut(OF_THREAD)).zip(beside);
        let set = InstructionSet::found();
        crew.each(parts, |((members, blocks), beside)| {
            let work = Prepare { records, members, blocks, beside, scene };
            let ((), none) = without_subnormals(plan.watches, || set.run(work));
            if !none {
                subnormal.store(true, Ordering::Relaxed);
            }
        });
        if subnormal.into_inner() {
            return None;
        }
        // The impulses of friction take the place of the normal ones, which go out in between.
        let mut sum = 0_u64;
        let mut sent = 0;
        let mut subnormal = false;
        let ends: &[u32] = match accelerator.arguments.impulses_out {
            true if plan.contact < plan.passes && plan.contact > 0 => &[plan.contact, plan.passes],
            _ => &[plan.passes],
        };
        let mut first = 0;
        for end in ends {
            let solved =
                fronts.run(plan, first..*end, groups, (blocks, spins, given), bodies, crew);
            sum = sum.saturating_add(solved.impulse_sum);
            subnormal |= solved.subnormal;
            first = *end;
            if accelerator.arguments.impulses_out {
                let impulses = |issue: usize, _| {
                    let impulses = match groups.slots[issue] {
                        NONE => [0.0; CONTACT_POINTS],
                        slot => {
                            let slot = slot as usize;
                            blocks[slot / LANES].impulses_of(slot % LANES)
                        }
                    };
                    subnormal |= plan.watches && impulses.into_iter().any(f32::is_subnormal);
                    impulses
                };
                let to = &mut results[IMPULSES_STREAM][sent..];
                sent += send(order, *end <= plan.contact, impulses, to);
            }
        }
        let own = &bodies[ROWS_APART as usize..];
        for (velocity, [[x, y, z, _], [p, q, r, _]]) in accelerator.velocities.iter_mut().zip(own) {
            *velocity = Velocity { linear: [*x, *y, *z], angular: [*p, *q, *r] };
            // An exact one raises no flag until it is used.
            let numbers = [*x, *y, *z, *p, *q, *r];
            subnormal |= plan.watches && numbers.into_iter().any(f32::is_subnormal);
        }
        (!subnormal).then_some(sum)
    }

    /// Integrates the bodies, and puts their records behind the impulses; returns the sum of all
    /// words that go out.
    pub(super) fn integrate(&mut self, accelerator: &Accelerator, poses: &Views<'_>) -> u32 {
        let array = *accelerator.results_out().array();
        let (segment, bodies) = (accelerator.poses_in(), accelerator.velocities.len());
        let impulses = self.results[IMPULSES_STREAM].len() - array.packets[IMPULSES_STREAM];
        let sum = AtomicU32::new(0);
        let mut left = self.results.each_mut().map(Vec::as_mut_slice);
        let (sent, results) = std::mem::take(&mut left[IMPULSES_STREAM]).split_at_mut(impulses);
        left[IMPULSES_STREAM] = results;
        for beat in sent {
            sum.fetch_add(beat.0.into_iter().fold(0, u32::wrapping_add), Ordering::Relaxed);
        }
        let parts = (0..bodies).step_by(OF_THREAD).map(|first| {
            let end = (first + OF_THREAD).min(bodies);
            let [before, after] =
                [first, end].map(|body| array.striping.counts(array.beats_of(body)));
            let mut k = 0;
            let own = left.each_mut().map(|left| {
                let (own, others) = std::mem::take(left).split_at_mut(after[k] - before[k]);
                (*left, k) = (others, k + 1);
                own
            });
            (first..end, own)
        });
        self.crew.each(parts, |(own, mut places)| {
            let mut reader = Reader::new(segment.array(), own.start, *poses);
            let before = array.striping.counts(array.beats_of(own.start));
            let mut walk = array.striping.places(own.start * array.rows / array.rows_per_beat);
            let mut summed = 0_u32;
            for body in own {
                array.each_beat(&accelerator.result(body, &mut reader), |beat| {
                    let (stream, number) = walk.take();
                    places[stream][number - before[stream]] = beat;
                    summed = beat.0.into_iter().fold(summed, u32::wrapping_add);
                });
            }
            sum.fetch_add(summed, Ordering::Relaxed);
        });
        sum.into_inner()
    }
}

/// Sends the impulses behind the last pass of a kind in the order of issue, from the place in this
/// order and the number of each collision, and in a step through the queue the numbers behind each
/// group; returns the number of beats.
fn send(
    order: &Order,
    contact: bool,
    mut impulses: impl FnMut(usize, usize) -> Impulses,
    to: &mut [Beat],
) -> usize {
    let mut sent = 0;
    let mut push = |beat| {
        to[sent] = beat;
        sent += 1;
    };
    let queued = order.slots().is_some();
    for (group, numbers) in order.numbers.chunks(NUMBERS_PER_BEAT as usize).enumerate() {
        for (at, number) in numbers.iter().enumerate() {
            let issue = group * NUMBERS_PER_BEAT as usize + at;
            push(outgoing(contact, impulses(issue, *number as usize)));
        }
        if queued {
            push(decode::numbers(numbers));
        }
    }
    sent
}

/// The beat of a collision's impulses behind the last pass of a kind.
fn outgoing(contact: bool, [normal, first, second, last]: [f32; CONTACT_POINTS]) -> Beat {
    decode::impulses(match contact {
        true => [normal, first, second, last],
        false => [first, second, 0.0, 0.0],
    })
}

/// Makes the rows of some blocks.
struct Prepare<'a, 'b> {
    records: &'a Collisions<'b>,
    members: &'a [Words<u32>],
    blocks: &'a mut [Block],
    beside: Beside<&'a mut [Spins], &'a mut [Given]>,
    scene: Scene<'a>,
}

impl Work for Prepare<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self, instructions: impl Instructions) {
        let Self { records, members, blocks, mut beside, scene } = self;
        for (at, (block, members)) in blocks.iter_mut().zip(members).enumerate() {
            let spins = beside.spins.as_mut().and_then(|spins| spins.get_mut(at));
            let given = beside.given.as_mut().and_then(|given| given.get_mut(at));
            block.prepare(instructions, records, members, scene, Beside { spins, given });
        }
    }
}
