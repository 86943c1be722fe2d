//! Properties of every order, in every scene.

mod empty;

use proptest::prelude::*;

use super::*;
use crate::scene::{
    Body, Collision, CollisionArrays, Collisions, Contact, Pose, Shape, Structures, Velocity,
};

/// A scene without geometry: pairs, and which bodies move.
#[derive(Debug, Clone)]
struct Given {
    pairs: Vec<[u32; 2]>,
    moving: Vec<bool>,
}

impl Given {
    fn input(&self) -> OrderInput<'_> {
        OrderInput { pairs: &self.pairs, moving: &self.moving }
    }
}

fn any_given(bodies: u32, pairs: usize) -> impl Strategy<Value = Given> {
    (2..=bodies).prop_flat_map(move |bodies| {
        let size = bodies as usize;
        // The second body differs from the first.
        let pair = (0..bodies, 1..bodies).prop_map(move |(a, b)| [a, (a + b) % bodies]);
        (
            prop::collection::vec(pair, 0..pairs),
            prop::collection::vec(prop::bool::weighted(0.8), size),
        )
            .prop_map(|(pairs, moving)| Given { pairs, moving })
    })
}

fn any_window() -> impl Strategy<Value = IssueWindow> {
    let depth = prop_oneof![1_u32..20, 20_u32..400];
    (depth, 1_u32..4).prop_map(|(depth, per)| IssueWindow::new(depth, per).expect("a window"))
}

const ORDERS: [Order; 3] = [Order::AsGiven, Order::Interleaved, Order::HazardFree];

fn ordered(given: &Given, order: Order, window: IssueWindow) -> Schedule {
    let mut orderer = Orderer::new();
    orderer.order(&given.input(), order, window).expect("an order").clone()
}

proptest! {
    #[test]
    fn every_order_is_a_permutation(given in any_given(60, 300), window in any_window()) {
        for order in ORDERS {
            let schedule = ordered(&given, order, window);
            let mut found: Vec<u32> = schedule.iter().flatten().collect();
            found.sort_unstable();
            let all: Vec<u32> = (0..).zip(&given.pairs).map(|(index, _)| index).collect();
            prop_assert_eq!(found, all);
            prop_assert_eq!(schedule.collisions() + schedule.empty(), schedule.len());
        }
    }

    #[test]
    fn a_hazard_free_order_has_no_hazard(given in any_given(200, 600), window in any_window()) {
        let schedule = ordered(&given, Order::HazardFree, window);
        prop_assert_eq!(Checker::new().verify(&schedule, &given.input(), window), Ok(()));
        prop_assert!(schedule.iter().last().is_none_or(|last| last.is_some()));
    }

    /// Compares every pair of uses with every other.
    #[test]
    fn hazards_are_those_of_the_definition(given in any_given(40, 120), window in any_window()) {
        let input = given.input();
        for order in [Order::AsGiven, Order::HazardFree] {
            let schedule = ordered(&given, order, window);
            let entries: Vec<(usize, [u32; 2])> = schedule
                .iter()
                .enumerate()
                .filter_map(|(entry, index)| Some((entry, given.pairs[index? as usize])))
                .collect();
            let slot = |entry: usize| entry / window.per_issue() as usize;
            let hazards = entries.iter().enumerate().filter(|(k, (entry, pair))| {
                entries[..*k].iter().any(|(before, other)| {
                    slot(*entry) - slot(*before) < window.depth() as usize
                        && pair.iter().any(|b| other.contains(b) && given.moving[*b as usize])
                })
            });
            let hazards = hazards.count();
            let verified = Checker::new().verify(&schedule, &input, window);
            prop_assert_eq!(verified.is_ok(), hazards == 0);
        }
    }

    #[test]
    fn what_was_ordered_before_changes_nothing(
        first in any_given(150, 300),
        second in any_given(80, 200),
        windows in [any_window(), any_window()],
    ) {
        let mut orderer = Orderer::new();
        for order in ORDERS {
            orderer.order(&first.input(), order, windows[0]).expect("an order");
            let again = orderer.order(&second.input(), order, windows[1]).expect("an order");
            prop_assert_eq!(again, &ordered(&second, order, windows[1]));
        }
    }
}

/// A sheet of spheres, each touching its four neighbours and the ground.
fn sheet(side: u32) -> Given {
    let at = |x: u32, z: u32| 1 + x * side + z;
    let mut pairs = Vec::new();
    for x in 0..side {
        for z in 0..side {
            pairs.push([0, at(x, z)]);
            if x + 1 < side {
                pairs.push([at(x, z), at(x + 1, z)]);
            }
            if z + 1 < side {
                pairs.push([at(x, z), at(x, z + 1)]);
            }
        }
    }
    let moving = (0..=side * side).map(|body| body > 0).collect();
    Given { pairs, moving }
}

#[test]
fn a_sheet_is_ordered_with_hardly_an_empty_entry() {
    let given = sheet(60);
    for (depth, per_issue) in [(16, 1), (64, 1), (16, 2)] {
        let window = IssueWindow::new(depth, per_issue).expect("a window");
        let schedule = ordered(&given, Order::HazardFree, window);
        // Emptying the pipeline at the end is the only cost.
        assert!(schedule.empty() <= 4 * window.entries(), "{depth}: {}", schedule.empty());
        let sorted = ordered(&given, Order::AsGiven, window);
        assert!(Checker::new().verify(&sorted, &given.input(), window).is_err());
    }
}

#[test]
fn a_hazard_free_order_moves_hardly_a_collision_far() {
    let given = sheet(160);
    for (depth, per_issue) in [(16, 1), (64, 1), (106, 2)] {
        let window = IssueWindow::new(depth, per_issue).expect("a window");
        let schedule = ordered(&given, Order::HazardFree, window);
        // The open groups, the waiting collisions, and the ones brought forward at the end.
        let reach = 64 * (depth.div_ceil(8) * per_issue) as usize + 256 + 16 * window.entries();
        let places = schedule.iter().enumerate();
        let far = places.filter_map(|(entry, index)| Some(entry.abs_diff(index? as usize)));
        let far = far.max().expect("an entry");
        assert!(far <= reach, "{depth}: {far}");
    }
}

/// The limit applies to the order that was made, and the error names it.
#[test]
fn an_order_longer_than_its_limit_is_refused() {
    let given = sheet(30);
    let window = IssueWindow::new(64, 1).expect("a window");
    let mut orderer = Orderer::new();
    let entries = |orderer: &mut Orderer| {
        orderer.order(&given.input(), Order::HazardFree, window).map(Schedule::len)
    };
    let length = entries(&mut orderer).expect("an order");
    orderer.set_limit(length);
    assert_eq!(entries(&mut orderer), Ok(length));
    let limit = given.pairs.len();
    assert!(length > limit, "it has empty entries");
    orderer.set_limit(limit);
    let refused = OrderError::TooLong { depth: 64, limit, collisions: limit };
    assert_eq!(entries(&mut orderer), Err(refused));
}

#[test]
fn a_body_that_meets_all_others_takes_one_collision_a_window() {
    let pairs: Vec<[u32; 2]> = (1..=40).map(|body| [0, body]).collect();
    let given = Given { pairs, moving: vec![true; 41] };
    let window = IssueWindow::new(24, 1).expect("a window");
    let mut orderer = Orderer::new();
    let schedule = orderer.order(&given.input(), Order::HazardFree, window).expect("an order");
    assert_eq!(Checker::new().verify(schedule, &given.input(), window), Ok(()));
    // 39 windows between 40 uses. A group is three slots, so the distance is never below 27.
    assert!((39 * 24 + 1..=39 * 27 + 1).contains(&schedule.len()), "{}", schedule.len());

    orderer.set_limit(500);
    let refused = orderer.order(&given.input(), Order::HazardFree, window).expect_err("too long");
    assert_eq!(refused, OrderError::TooLong { depth: 24, limit: 500, collisions: 40 });
}

#[test]
fn a_scene_without_collisions_or_bodies_has_an_empty_order() {
    let window = IssueWindow::new(158, 1).expect("a window");
    for bodies in [0, 3] {
        let none = Given { pairs: vec![], moving: vec![true; bodies] };
        for order in ORDERS {
            assert!(ordered(&none, order, window).is_empty());
        }
    }
}

#[test]
fn input_that_cannot_be_ordered_is_refused_by_its_index() {
    let window = IssueWindow::new(4, 1).expect("a window");
    let good = OrderInput { pairs: &[[0, 1], [1, 2]], moving: &[true; 3] };
    let refused = |input: &OrderInput<'_>| {
        let of_order = Orderer::new().order(input, Order::HazardFree, window).map(|_| ());
        let of_check = Checker::new().verify(&Schedule::default(), input, window);
        assert_eq!(of_order, of_check);
        of_order.expect_err("refused")
    };
    let pairs = &[[0, 1], [3, 1]];
    assert_eq!(
        refused(&OrderInput { pairs, ..good }),
        OrderError::NoSuchBody { collision: 1, body: 3, bodies: 3 }
    );
    let pairs = &[[0, 1], [1, 1]];
    assert_eq!(
        refused(&OrderInput { pairs, ..good }),
        OrderError::SelfCollision { collision: 1, body: 1 }
    );
}

#[test]
fn a_wrong_schedule_is_refused_where_it_is_wrong() {
    let input =
        OrderInput { pairs: &[[0, 1], [1, 2], [3, 4]], moving: &[false, true, true, true, true] };
    let window = IssueWindow::new(2, 1).expect("a window");
    let verified = |entries: &[Option<u32>]| {
        Checker::new().verify(&entries.iter().copied().collect(), &input, window)
    };
    assert_eq!(verified(&[Some(0), Some(2), Some(1)]), Ok(()));
    assert_eq!(verified(&[Some(0), None, Some(1), Some(2)]), Ok(()));
    assert_eq!(
        verified(&[Some(2), Some(0), Some(1)]),
        Err(OrderError::Hazard { body: 1, earlier: 1, slot: 2, depth: 2 })
    );
    assert_eq!(verified(&[Some(0), Some(2)]), Err(OrderError::Missing { collision: 1 }));
    assert_eq!(
        verified(&[Some(0), Some(2), Some(0)]),
        Err(OrderError::Repeated { collision: 0, entry: 2 })
    );
    assert_eq!(
        verified(&[Some(3)]),
        Err(OrderError::NoSuchCollision { entry: 0, found: 3, collisions: 3 })
    );
}

#[test]
fn ordered_collisions_are_the_callers_with_padding_between() {
    let body = |shape| Body {
        pose: Pose { position: [shape as f32, 0.0, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] },
        velocity: Velocity::default(),
        shape,
    };
    let collision = |body_a, body_b| Collision {
        body_a,
        body_b,
        normal: [0.0, 1.0, 0.0],
        count: 2,
        contacts: [Contact::default(); 4],
    };
    let bodies = vec![body(0), body(1), body(1), body(7)];
    let collisions = vec![collision(0, 1), collision(2, 1), collision(3, 1)];
    let shapes = [Shape::STATIC, Shape::isotropic(1.0, 1.0)];
    let mut buffers = InputBuffers::new();
    let input = buffers.gather(&bodies, &collisions, &shapes);
    assert_eq!(input.pairs, [[0, 1], [2, 1], [3, 1]]);
    assert_eq!(input.moving, [false, true, true, false]);

    let schedule: Schedule = [Some(2), None, Some(0), Some(1)].into_iter().collect();
    let ordered = Ordered { collisions: &collisions, schedule: &schedule };
    assert_eq!((ordered.len(), ordered.lengths_agree()), (4, true));
    assert_eq!(ordered.collision(0), collisions[2]);
    assert_eq!((ordered.collision(1).count, ordered.collision(9).count), (0, 0));
    assert_eq!(ordered.collision(3), collisions[1]);
}

#[test]
fn collisions_in_order_lie_where_those_as_given_do() {
    /// The collisions in memory, one by one; `None` without structures.
    fn in_memory<C: Collisions + ?Sized>(collisions: &C) -> Option<Vec<Collision>> {
        match collisions.structures()? {
            Structures::Array(all) => Some(all.to_vec()),
            Structures::Ordered { all, order } => {
                let at = |place: &u32| all.get(*place as usize).copied();
                Some(order.iter().map(|place| at(place).unwrap_or(Collision::NOTHING)).collect())
            }
        }
    }

    let collision = |body_b| Collision { body_b, count: 1, ..Collision::NOTHING };
    let all: Vec<Collision> = (1..6).map(collision).collect();
    assert_eq!(in_memory(&all).as_ref(), Some(&all));
    assert_eq!(in_memory(all.as_slice()).as_ref(), Some(&all));
    let schedule: Schedule =
        [Some(4), None, Some(2), Some(1), None, Some(0), Some(3)].into_iter().collect();
    let ordered = Ordered { collisions: &all, schedule: &schedule };
    let each: Vec<_> = (0..ordered.len()).map(|at| ordered.collision(at)).collect();
    assert_eq!(in_memory(&ordered), Some(each));
    assert_eq!(ordered.structures().map(|all| all.len()), Some(7));

    // Collisions without structures, or in an order of their own, have none here either.
    let bodies: Vec<_> = all.iter().map(|collision| [collision.body_a, collision.body_b]).collect();
    let arrays = CollisionArrays {
        bodies: &bodies,
        normals: &[[0.0; 3]; 5],
        counts: &[1; 5],
        contacts: &[[[0.0; 4]; 4]; 5],
    };
    assert!(in_memory(&Ordered { collisions: &arrays, schedule: &schedule }).is_none());
    assert!(in_memory(&Ordered { collisions: &ordered, schedule: &schedule }).is_none());

    /// Collisions whose structures lack the first one.
    struct ButOne(Vec<Collision>);
    impl Collisions for ButOne {
        fn len(&self) -> usize {
            self.0.len()
        }
        fn collision(&self, index: usize) -> Collision {
            self.0[index]
        }
        fn structures(&self) -> Option<Structures<'_>> {
            self.0.get(1..).map(Structures::Array)
        }
    }
    let but_one = ButOne(all.clone());
    assert!(in_memory(&Ordered { collisions: &but_one, schedule: &schedule }).is_none());
}
