//! Tests that collisions without contact points change no order of the others, and keep the indices
//! of the others.

use proptest::prelude::*;

use super::super::*;
use crate::scene::{Body, Collision, Contact, Pose, Shape, Velocity};

/// Pairs of bodies, and how many empty collisions stand before each of them and behind the last.
fn scene() -> impl Strategy<Value = (Vec<bool>, Vec<[u32; 2]>, Vec<usize>)> {
    (2_u32..30).prop_flat_map(|count| {
        let moving = prop::collection::vec(prop::bool::weighted(0.9), count as usize);
        let pair = (0..count, 1..count).prop_map(move |(a, by)| [a, (a + by) % count]);
        let gaps = prop::collection::vec(prop_oneof![3 => Just(0), 1 => 1_usize..4], 61);
        (moving, prop::collection::vec(pair, 0..60), gaps)
    })
}

/// The input with empty collisions in between, and the index of each collision in it.
fn spread(pairs: &[[u32; 2]], gaps: &[usize]) -> (Vec<[u32; 2]>, Vec<u32>) {
    let (mut all, mut places) = (Vec::new(), Vec::new());
    for (at, gap) in gaps.iter().take(pairs.len() + 1).enumerate() {
        all.resize(all.len() + gap, OrderInput::EMPTY);
        if let Some(pair) = pairs.get(at) {
            places.push(u32::try_from(all.len()).expect("few"));
            all.push(*pair);
        }
    }
    (all, places)
}

proptest! {
    #[test]
    fn empty_collisions_change_no_order_of_the_others(
        (moving, pairs, gaps) in scene(),
        depth in 1_u32..12,
        per_issue in 1_u32..3,
    ) {
        let input = OrderInput { pairs: &pairs, moving: &moving };
        let (all, places) = spread(&pairs, &gaps);
        let with_empty = OrderInput { pairs: &all, ..input };
        let window = IssueWindow::new(depth, per_issue).expect("a window");
        let named = |schedule: &Schedule| -> Vec<Option<u32>> {
            schedule.iter().map(|at| at.map(|at| places[at as usize])).collect()
        };
        for order in [Order::AsGiven, Order::HazardFree] {
            let (mut one, mut other) = (Orderer::new(), Orderer::new());
            let expected = one.order(&input, order, window).expect("an order");
            let found = other.order(&with_empty, order, window).expect("an order");
            let expected = named(expected);
            if order == Order::AsGiven {
                // Each keeps its place.
                let taken = |(at, pair): (u32, &[u32; 2])| (*pair != OrderInput::EMPTY).then_some(at);
                let in_place: Vec<_> = (0..).zip(&all).map(taken).collect();
                prop_assert_eq!(found.iter().collect::<Vec<_>>(), in_place);
                prop_assert_eq!(found.empty(), all.len() - pairs.len());
                other.as_given_without_empty(&with_empty);
            }
            let found = other.schedule();
            prop_assert_eq!(found.iter().collect::<Vec<_>>(), expected, "{:?}", order);
            prop_assert_eq!(one.schedule().empty(), found.empty());
            let verified = |schedule, input| Checker::new().verify(schedule, input, window).is_ok();
            prop_assert_eq!(verified(found, &with_empty), verified(one.schedule(), &input));
        }
    }
}

#[test]
fn an_entry_may_hold_an_empty_collision_which_uses_no_body() {
    let input = OrderInput { pairs: &[[0, 1], OrderInput::EMPTY, [1, 2]], moving: &[true; 3] };
    let window = IssueWindow::new(2, 1).expect("a window");
    let schedule: Schedule = [Some(0), Some(1), Some(2)].into_iter().collect();
    assert_eq!(Checker::new().verify(&schedule, &input, window), Ok(()));
    let lacks: Schedule = [Some(0)].into_iter().collect();
    let missing = Checker::new().verify(&lacks, &input, window);
    assert_eq!(missing, Err(OrderError::Missing { collision: 2 }));
}

#[test]
fn of_an_empty_collision_the_count_alone_is_read() {
    let body = Body {
        pose: Pose { position: [0.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] },
        velocity: Velocity::default(),
        shape: 0,
    };
    let collision = |body_a, body_b, count| Collision {
        body_a,
        body_b,
        normal: [f32::NAN; 3],
        count,
        contacts: [Contact::default(); 4],
    };
    let collisions = [
        collision(0, 1, 0),
        collision(7, 7, 0),
        collision(u32::MAX, u32::MAX, 0),
        collision(1, 0, 3),
        collision(u32::MAX, u32::MAX, 2),
    ];
    let mut buffers = InputBuffers::new();
    let shapes = [Shape::isotropic(1.0, 1.0)];
    let input = buffers.gather(&[body; 2][..], &collisions[..], &shapes);
    assert_eq!(input.pairs[..3], [OrderInput::EMPTY; 3]);
    assert_eq!((input.pairs[3], input.collisions()), ([1, 0], 2));
    // Bodies that do not exist are no empty collision.
    let window = IssueWindow::new(1, 1).expect("a window");
    let refused = Orderer::new().order(&input, Order::AsGiven, window).map(drop);
    let expected = OrderError::NoSuchBody { collision: 4, body: u32::MAX, bodies: 2 };
    assert_eq!(refused, Err(expected));
}
