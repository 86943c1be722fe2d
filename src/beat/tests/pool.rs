//! Packs and reads on several threads: their number changes neither records nor results.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use proptest::prelude::*;

use super::{buffers, views};
use crate::beat::Target;
use crate::beat::bodies::{Survey, pack_bodies};
use crate::beat::collisions::{Entries, pack_collisions};
use crate::beat::pool::{ChannelChunks, PackPool, RANGE, ranges, whole};
use crate::beat::results::read_all;
use crate::beat::stripe::{BLOCK, Segment};
use crate::record::body_table::{End, Ends, Table};
use crate::record::result::Record;
use crate::scene::{
    Body, Collision, Collisions, Contact, Pose, Shape, StepParameters, Structures, Velocity,
};
use crate::validate::{Limits, preflight};
use pgs_interface::profile::{Inertia, PROFILES, Variant};
use pgs_interface::record::Beat;

const SHAPES: [Shape; 3] = [Shape::STATIC, Shape::isotropic(1.0, 1.5), Shape::isotropic(2.0, 0.3)];
const SEGMENTS: [Segment; 3] = [Segment::Velocities, Segment::Poses, Segment::Collisions];

/// An endless source of small pseudo-random numbers.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, limit: u16) -> u16 {
        // The upper bits of a linear congruential generator are the good ones.
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        u16::try_from((self.0 >> 48) % u64::from(limit)).expect("below a u16")
    }

    fn number(&mut self) -> f32 {
        f32::from(self.below(2001)) / 1000.0 - 1.0
    }

    fn vec3(&mut self) -> [f32; 3] {
        [self.number(), self.number(), self.number()]
    }

    /// One body in `still_of` is static; none for 0.
    fn body(&mut self, still_of: u16) -> Body {
        let still = still_of > 0 && self.below(still_of) == 0;
        let moving = Velocity { linear: self.vec3(), angular: self.vec3() };
        Body {
            pose: Pose { position: self.vec3(), orientation: [0.0, 0.6, 0.0, 0.8] },
            velocity: if still { Velocity::default() } else { moving },
            shape: if still { 0 } else { 1 + u32::from(self.below(2)) },
        }
    }

    /// One collision in `others` has any number of contact points; the rest have four.
    fn collision(&mut self, bodies: u16, others: u16) -> Collision {
        let body_a = self.below(bodies);
        let body_b = (body_a + 1 + self.below(bodies - 1)) % bodies;
        Collision {
            body_a: body_a.into(),
            body_b: body_b.into(),
            normal: [0.0, -1.0, 0.0],
            count: if self.below(others) == 0 { 1 + u32::from(self.below(4)) } else { 4 },
            contacts: [(); 4].map(|()| Contact { point: self.vec3(), distance: self.number() }),
        }
    }
}

/// The input of one step.
#[derive(Debug)]
struct Input {
    limits: Limits,
    bodies: Vec<Body>,
    collisions: Vec<Collision>,
    /// An order as long as `collisions`. Some of its indices name no collision.
    places: Vec<u32>,
}

/// Collisions in an order, which may name collisions that do not exist.
struct Placed<'a> {
    list: &'a [Collision],
    order: &'a [u32],
}

impl Placed<'_> {
    fn copy(&self, index: usize) -> Collision {
        self.list.get(self.order[index] as usize).copied().unwrap_or(Collision::NOTHING)
    }
}

impl Collisions for Placed<'_> {
    fn len(&self) -> usize {
        self.order.len()
    }

    fn collision(&self, index: usize) -> Collision {
        self.copy(index)
    }

    fn structures(&self) -> Option<Structures<'_>> {
        Some(Structures::Ordered { all: self.list, order: self.order })
    }
}

/// The whole output of packing.
#[derive(Debug, PartialEq)]
struct Packed {
    channels: Vec<Vec<Beat>>,
    sums: [u32; 3],
    good: [bool; 2],
    ends: Table,
    statics: Vec<u32>,
}

impl Input {
    /// Packs the whole input.
    fn pack(&self, packers: &mut PackPool) -> Packed {
        let Self { limits, bodies, collisions, places } = self;
        let parameters = StepParameters::default();
        let scene = preflight(bodies, collisions, &SHAPES, &parameters, limits);
        let scene = &scene.expect("nothing else is wrong");
        let target = Target { scene, streamed_masses: false };
        // An earlier step has left a longer or a shorter table.
        let (mut ends, mut statics) = (Table::default(), vec![7; 3000]);
        ends.anew(3000).fill(End::at([7.0; 3]));

        let [mut velocities, mut poses] = [Segment::Velocities, Segment::Poses]
            .map(|segment| buffers(&limits.variant, segment, bodies.len()));
        let into = Survey { ends: &mut ends, statics: &mut statics };
        let into_channels = (&mut *views(&mut velocities), &mut *views(&mut poses));
        let (of_velocities, of_poses, of_bodies) =
            pack_bodies(target, bodies, bodies.len(), into, into_channels, packers);

        let (records, (of_records, good)) = self.records(target, ends.ends(), collisions, packers);
        // Collisions in an order give the same records as copies in that order.
        let placed = Placed { list: collisions, order: places };
        let copied: Vec<Collision> = (0..places.len()).map(|at| placed.copy(at)).collect();
        let expected = self.records(target, ends.ends(), &copied, packers);
        assert!(self.records(target, ends.ends(), &placed, packers) == expected);
        Packed {
            channels: [velocities, poses, records].concat(),
            sums: [of_velocities, of_poses, of_records],
            good: [of_bodies, good],
            ends,
            statics,
        }
    }

    /// The records of collisions; their sum, and whether they are good.
    fn records<C: Collisions + ?Sized>(
        &self,
        target: Target<'_>,
        ends: Ends<'_>,
        collisions: &C,
        packers: &mut PackPool,
    ) -> (Vec<Vec<Beat>>, (u32, bool)) {
        let count = collisions.len();
        let entries = Entries { collisions, count, added: None };
        let mut records = buffers(&self.limits.variant, Segment::Collisions, count);
        let packed =
            pack_collisions(target, ends, &entries, &mut views(&mut records), None, packers);
        (records, (packed.sum, packed.good))
    }
}

/// Numbers of records: none, few, and some around the ends of blocks and ranges.
fn any_count() -> impl Strategy<Value = usize> {
    let around = |at: usize| at.saturating_sub(2)..at + 3;
    prop_oneof![
        1 => 0_usize..4,
        1 => around(BLOCK),
        3 => around(RANGE),
        2 => around(RANGE + BLOCK),
        3 => around(2 * RANGE),
        3 => 0..4 * RANGE,
    ]
}

fn any_variant() -> impl Strategy<Value = Variant> {
    (prop::sample::select(PROFILES.to_vec()), any::<bool>()).prop_map(|(profile, world)| {
        let inertia =
            profile.world.filter(|_| world).map_or(Inertia::Isotropic, |_| Inertia::World);
        Variant { inertia, ..profile.default_variant() }
    })
}

prop_compose! {
    fn any_input()(
        variant in any_variant(),
        bodies in any_count(),
        collisions in any_count(),
        // The width of the window around its own index that a collision strays in.
        stray in prop::sample::select(vec![1, 900, u16::MAX]),
        still_of in prop::sample::select(vec![0, 1, 2, 50, 3000]),
        others in prop::sample::select(vec![1, 40]),
        // A body and a collision that validation refuses.
        wrong in prop::array::uniform2(prop::option::weighted(0.3, any::<prop::sample::Index>())),
        seed in any::<u64>(),
    ) -> Input {
        let mut numbers = Numbers(seed);
        let mut bodies: Vec<Body> =
            (0..bodies + 2).map(|_| numbers.body(still_of)).collect();
        let few = u16::try_from(bodies.len()).expect("few");
        let mut collisions: Vec<Collision> =
            (0..collisions).map(|_| numbers.collision(few, others)).collect();
        let places = (0_u32..)
            .zip(&collisions)
            .map(|(at, _)| match numbers.below(50) {
                0 => u32::MAX,
                _ => (at + u32::from(numbers.below(stray))).saturating_sub(u32::from(stray / 2)),
            })
            .collect();
        let [body, collision] = wrong;
        if let Some(body) = body {
            body.get_mut(&mut bodies).pose.orientation = [0.0; 4];
        }
        if let Some(collision) = collision.filter(|_| !collisions.is_empty()) {
            collision.get_mut(&mut collisions).normal = [0.5; 3];
        }
        Input { limits: Limits::roomy(variant), bodies, collisions, places }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn several_threads_write_what_one_does(inputs in prop::collection::vec(any_input(), 1..4)) {
        let mut crews = [1, 2, 3].map(|threads| PackPool::new(Some(threads)));
        for input in inputs {
            let expected = input.pack(&mut PackPool::alone());
            let still = (0_u32..).zip(&input.bodies).filter(|(_, body)| body.shape == 0);
            let still: Vec<u32> = still.map(|(at, _)| at).collect();
            prop_assert_eq!(&expected.statics, &still);
            let words: Vec<u32> = expected.channels.iter().flatten().flat_map(|it| it.0).collect();
            let sum = expected.sums.into_iter().fold(0, u32::wrapping_add);
            prop_assert_eq!(sum, words.into_iter().fold(0, u32::wrapping_add));
            for packers in &mut crews {
                // `prop_assert_eq` would print all words.
                prop_assert!(input.pack(packers) == expected, "{packers:?}");
            }
        }
    }
}

/// The property above is not vacuous: packing notices each wrong record.
#[test]
fn one_wrong_record_is_noticed_in_whichever_range() {
    let mut packers = PackPool::new(Some(3));
    let mut numbers = Numbers(1);
    let bodies: Vec<Body> = (0..2 * RANGE + 5).map(|_| numbers.body(0)).collect();
    let collisions = (0..2 * RANGE + 7).map(|_| numbers.collision(4000, 2)).collect();
    for profile in PROFILES {
        let limits = Limits::roomy(profile.default_variant());
        let (bodies, collisions) = (bodies.clone(), Vec::clone(&collisions));
        let mut input = Input { limits, bodies, collisions, places: vec![] };
        assert_eq!(input.pack(&mut packers).good, [true; 2], "{}", profile.name);
        for at in [0, RANGE - 1, RANGE, 2 * RANGE, 2 * RANGE + 4] {
            let right = (input.bodies[at], input.collisions[at]);
            input.bodies[at].pose.position[1] = f32::NAN;
            assert!(!input.pack(&mut packers).good[0], "{} {at}", profile.name);
            input.bodies[at] = right.0;
            input.collisions[at].normal = [0.5; 3];
            assert_eq!(input.pack(&mut packers).good, [true, false], "{}", profile.name);
            input.collisions[at] = right.1;
        }
    }
}

/// The threads take one range each, and the caller alone takes few records.
#[test]
fn ranges_are_for_all_threads_and_few_records_for_the_caller() {
    let caller = thread::current().id();
    let mut packers = PackPool::new(Some(3));
    for few in [0, 1, BLOCK, RANGE] {
        let mut joined = vec![];
        let work = |range| (range, thread::current().id());
        packers.each(few, |size| ranges(few, size), work, |done| joined.push(done));
        let expected = if few == 0 { vec![] } else { vec![(0..few, caller)] };
        assert_eq!(joined, expected);
    }
    let (many, here) = (3 * RANGE - 1, AtomicUsize::new(0));
    let mut joined = vec![];
    let until = Instant::now() + Duration::from_secs(60);
    let work = |range: std::ops::Range<usize>| {
        // The threads wait for each other, so that each takes one of the three ranges.
        here.fetch_add(1, Ordering::Relaxed);
        while here.load(Ordering::Relaxed) < 3 && Instant::now() < until {
            thread::yield_now();
        }
        (range.start, range.end, thread::current().id())
    };
    packers.each(many, |size| ranges(many, size), work, |done| joined.push(done));
    joined.sort_by_key(|(start, ..)| *start);
    let cut: Vec<_> = joined.iter().map(|(start, end, _)| (*start, *end)).collect();
    assert_eq!(cut, [(0, RANGE), (RANGE, 2 * RANGE), (2 * RANGE, many)]);
    let [a, b, c] = [0, 1, 2].map(|at| joined[at].2);
    assert!(a != b && b != c && c != a && [a, b, c].contains(&caller));
}

/// A number that is not finite is found in every range, and padding is counted once.
#[test]
fn results_are_read_the_same_by_any_number_of_threads() {
    let crews = &mut [Some(1), Some(2), Some(3), None].map(PackPool::new);
    for profile in PROFILES {
        let layout = Segment::Results.layout(&profile.default_variant());
        for count in [0, 1, RANGE, RANGE + 1, 3 * RANGE + BLOCK + 1] {
            // The word is finite as one number and as two.
            let word = |at: usize| 0x2000_2000 + u32::try_from(at % 0x1000).expect("few");
            let mut buffers: Vec<Vec<Beat>> = (0..profile.s2mm_widths.len())
                .map(|channel| {
                    let beats = 0..layout.beats_on_channel(count, channel);
                    beats.map(|at| Beat([at, at + 1, channel, 3 * at].map(word))).collect()
                })
                .collect();
            let wrong = [None, Some(0), Some(RANGE), count.checked_sub(1)];
            for wrong in wrong.into_iter().filter(|at| at.is_none_or(|at| at < count)) {
                let spoilt =
                    wrong.map(|record| layout.place(record * layout.rows / layout.rows_per_beat()));
                if let Some(place) = spoilt {
                    buffers[place.channel][place.slot].0[0] |= 0x7FFF_7FFF;
                }
                let channels: Vec<&[Beat]> = buffers.iter().map(Vec::as_slice).collect();
                let mut expected = vec![Record::default(); count];
                let alone = &mut PackPool::alone();
                let (sum, good) = read_all(&layout, &channels, &mut expected, alone);
                assert_eq!(good, wrong.is_none());
                let words = buffers.iter().flatten().flat_map(|beat| beat.0);
                assert_eq!(sum, words.fold(0, u32::wrapping_add));
                for crew in &mut *crews {
                    let mut found = vec![Record::default(); count];
                    let read = read_all(&layout, &channels, &mut found, crew);
                    assert_eq!(read, (sum, wrong.is_none()), "{} {count} {wrong:?}", profile.name);
                    assert!(found == expected, "{} {count} {wrong:?}", profile.name);
                }
                if let Some(place) = spoilt {
                    buffers[place.channel][place.slot].0[0] = word(place.slot);
                }
            }
        }
    }
}

/// Every range begins where the definition of the stripe says, on each channel.
#[test]
fn the_pieces_of_a_segment_are_those_of_its_ranges() {
    for (profile, segment) in PROFILES.iter().flat_map(|it| SEGMENTS.map(|segment| (it, segment))) {
        let layout = segment.layout(&profile.default_variant());
        for count in [0, 1, RANGE - 1, RANGE, RANGE + 1, 2 * RANGE + BLOCK + 1] {
            let beats = layout.beats(count);
            let mut buffers: Vec<Vec<Beat>> = (0..profile.mm2s_widths.len())
                .map(|channel| vec![Beat::default(); layout.beats_on_channel(count, channel)])
                .collect();
            for beat in 0..beats {
                let place = layout.place(beat);
                let number = u32::try_from(beat).expect("few");
                buffers[place.channel][place.slot] = Beat([number; 4]);
            }
            let mut views = views(&mut buffers);
            let mut pieces = ChannelChunks::new(&layout, RANGE, whole(&mut views));
            for range in ranges(count, RANGE) {
                let last = range.end == count;
                let end = if last { beats } else { layout.beats(range.end) };
                let own = layout.beats(range.start)..end;
                let piece = pieces.cut();
                let numbers = piece.iter().flat_map(|channel| channel.iter().map(|beat| beat.0[0]));
                let mut numbers: Vec<usize> = numbers.map(|number| number as usize).collect();
                numbers.sort_unstable();
                assert!(numbers.into_iter().eq(own), "{} {segment:?} {range:?}", profile.name);
            }
            assert!(pieces.cut().iter().all(|rest| rest.is_empty()), "nothing is left over");
        }
    }
}
