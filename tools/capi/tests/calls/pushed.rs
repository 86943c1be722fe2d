//! Collisions that are pushed one after the other give the step of an array of them.

use std::ptr::{from_ref, null, null_mut};

use zynq_pgs_c::*;

use crate::support::*;

impl Open {
    fn begin(&self) -> Status {
        made!(zpgs_begin(self.0))
    }

    fn push(&self, collisions: &[Collision]) -> Status {
        made!(zpgs_push(self.0, collisions.as_ptr(), null(), collisions.len()))
    }

    fn push_warm(&self, collision: &Collision, impulses: &Impulses) -> Status {
        made!(zpgs_push(self.0, from_ref(collision), from_ref(impulses), 1))
    }

    fn end(&self, bodies: &BodyArrays, parameters: &Parameters) -> Status {
        made!(zpgs_end(self.0, from_ref(bodies), from_ref(parameters)))
    }

    fn impulses<const N: usize>(&self) -> [Impulses; N] {
        let mut all = [Impulses::default(); N];
        let out = Strided { data: all.as_mut_ptr().cast(), stride: size_of::<Impulses>() };
        assert_eq!(made!(zpgs_read_impulses(self.0, out, N)), Status::Ok, "{}", self.text());
        all
    }
}

/// A collision without contact points, of bodies that do not exist.
fn empty() -> Collision {
    Collision { body_a: 77, body_b: 77, count: 0, ..Collision::default() }
}

#[test]
fn pushed_collisions_give_the_drivers_bits_and_empty_ones_keep_their_places() {
    let (open, mut crates) = (Open::new("emulated:float"), world());
    let parameters = Parameters { impulses_out: 1, ..defaults() };
    assert_eq!(open.begin(), Status::Ok);
    assert_eq!(open.push(&[empty()]), Status::Ok);
    assert_eq!(open.push(&[empty(), collision()]), Status::Ok);
    assert_eq!(open.push(&[]), Status::Ok);
    assert_eq!(open.push(&[empty()]), Status::Ok);
    assert_eq!(open.end(&arrays(&mut crates), &parameters), Status::Ok, "{}", open.text());
    let mut report = Report { size: size_of::<Report>(), ..Report::default() };
    let bodies = arrays(&mut crates);
    let status = made!(zpgs_wait(open.0, from_ref(&bodies), &raw mut report));
    assert_eq!((status, report.collisions), (Status::Ok, 1), "{}", open.text());
    assert_eq!(crates, stepped());
    let [first, second, third, last] = open.impulses();
    assert_eq!([first, second, last], [Impulses::default(); 3]);
    assert!(third.normal[0] > 0.0, "{third:?}");
}

#[test]
fn many_pushed_collisions_are_ordered_like_an_array_of_them() {
    let (open, mut expected, mut found) = (Open::new("emulated:float"), world(), world());
    // The order matters: each collision differs from the next.
    let all: Vec<_> = (0..700_u16)
        .map(|index| {
            let mut one = collision();
            one.contacts[0].distance = -0.01 - f32::from(index % 7) / 100.0;
            one
        })
        .collect();
    let status = open.step(&arrays(&mut expected), &collisions(&all), &defaults());
    assert_eq!(status, Status::Ok, "{}", open.text());
    assert_eq!(open.begin(), Status::Ok);
    for some in all.chunks(3) {
        assert_eq!(open.push(some), Status::Ok);
    }
    assert_eq!(open.end(&arrays(&mut found), &defaults()), Status::Ok, "{}", open.text());
    assert_eq!(open.wait(&arrays(&mut found)), Status::Ok, "{}", open.text());
    assert_eq!(found, expected);
    assert_ne!(found, stepped());
}

#[test]
fn a_pushed_step_begins_with_the_impulses_of_its_collisions() {
    let (open, mut expected, mut found) = (Open::new("emulated:float"), world(), world());
    let parameters = Parameters { warm_start: 1, impulses_out: 1, ..defaults() };
    let (all, mut kept) = ([collision()], Impulses::default());
    let mut after = [Impulses::default(); 2];
    for impulses in &mut after {
        let mut given = collisions(&all);
        given.impulses =
            StridedConst { data: from_ref(&kept).cast(), stride: size_of::<Impulses>() };
        let status = open.step(&arrays(&mut expected), &given, &parameters);
        assert_eq!(status, Status::Ok, "{}", open.text());
        [kept] = open.impulses();
        *impulses = kept;
    }
    kept = Impulses::default();
    for impulses in after {
        assert_eq!(open.begin(), Status::Ok);
        assert_eq!(open.push_warm(&all[0], &kept), Status::Ok);
        assert_eq!(open.end(&arrays(&mut found), &parameters), Status::Ok, "{}", open.text());
        assert_eq!(open.wait(&arrays(&mut found)), Status::Ok, "{}", open.text());
        [kept] = open.impulses();
        assert_eq!(kept, impulses);
    }
    assert_eq!(found, expected);
    assert_ne!(after[0], after[1]);

    assert_eq!(open.begin(), Status::Ok);
    assert_eq!(open.push_warm(&all[0], &kept), Status::Ok);
    assert_eq!(open.push(&all), Status::Ok);
    assert_eq!(open.end(&arrays(&mut found), &parameters), Status::Argument);
    assert!(open.text().contains("collision 1 was pushed without"), "{}", open.text());
    assert_eq!(found, expected);
}

#[test]
fn a_list_begins_grows_and_ends_in_this_sequence() {
    let (open, mut crates, all) = (Open::new("emulated:float"), world(), [collision()]);
    assert_eq!(open.push(&all), Status::Sequence);
    assert!(open.text().contains("zpgs_begin"), "{}", open.text());
    assert_eq!(open.end(&arrays(&mut crates), &defaults()), Status::Sequence);
    assert!(open.text().contains("zpgs_begin"), "{}", open.text());
    // The second begin forgets the collision of the first, and a step of an array in between.
    assert_eq!(open.begin(), Status::Ok);
    assert_eq!(open.push(&all), Status::Ok);
    assert_eq!(open.begin(), Status::Ok);
    let bodies = arrays(&mut crates);
    assert_eq!(open.submit(&bodies, &collisions(&all)), Status::Ok, "{}", open.text());
    assert_eq!(open.push(&all), Status::Ok, "a step in flight does not matter");
    assert_eq!(open.end(&bodies, &defaults()), Status::Sequence);
    assert!(open.text().contains("zpgs_wait"), "{}", open.text());
    assert_eq!(open.wait(&bodies), Status::Ok, "{}", open.text());
    assert_eq!(crates, stepped());
    // The refused end has left the list as it was.
    crates = world();
    assert_eq!(open.end(&arrays(&mut crates), &defaults()), Status::Ok, "{}", open.text());
    assert_eq!(open.end(&arrays(&mut crates), &defaults()), Status::Sequence, "in flight");
    assert_eq!(open.push(&all), Status::Sequence, "the list has ended");
    assert!(open.text().contains("has ended"), "{}", open.text());
    open.cancel();
    assert_eq!(open.wait(&arrays(&mut crates)), Status::Cancelled);
    assert_eq!(crates, world());
    // The list is there for another try.
    assert_eq!(open.end(&arrays(&mut crates), &defaults()), Status::Ok, "{}", open.text());
    assert_eq!(open.wait(&arrays(&mut crates)), Status::Ok, "{}", open.text());
    assert_eq!(crates, stepped());
}

#[test]
fn a_refused_collision_has_the_index_of_its_push_and_the_bodies_stay() {
    let (open, mut crates) = (Open::new("emulated:float"), world());
    let wrong = Collision { body_b: 5, ..collision() };
    assert_eq!(open.begin(), Status::Ok);
    assert_eq!(open.push(&[collision(), empty()]), Status::Ok);
    assert_eq!(open.push(&[wrong]), Status::Ok);
    assert_eq!(open.end(&arrays(&mut crates), &defaults()), Status::Input);
    assert!(open.text().contains("collision 2"), "{}", open.text());
    assert_eq!(open.wait(&arrays(&mut crates)), Status::Sequence, "nothing is in flight");
    assert_eq!(crates, world());
}

#[test]
fn a_push_that_is_refused_takes_none_of_its_collisions() {
    let (open, mut crates, all) = (Open::new("emulated:float"), world(), [collision()]);
    let impulses = [Impulses::default()];
    let push = |collisions: *const Collision, impulses: *const Impulses, count| {
        made!(zpgs_push(open.0, collisions, impulses, count))
    };
    assert_eq!(open.begin(), Status::Ok);
    assert_eq!(push(null(), null(), 1), Status::NullPointer);
    assert!(open.text().contains("collisions"), "{}", open.text());
    assert_eq!(push(all.as_ptr().wrapping_byte_add(1), null(), 1), Status::Argument);
    assert_eq!(push(all.as_ptr(), impulses.as_ptr().wrapping_byte_add(2), 1), Status::Argument);
    assert!(open.text().contains("impulses"), "{}", open.text());
    assert_eq!(push(all.as_ptr(), null(), usize::MAX), Status::Argument);
    assert_eq!(push(null(), null(), 0), Status::Ok, "no collision, no address");
    assert_eq!(made!(zpgs_begin(null_mut())), Status::NullPointer);
    assert_eq!(made!(zpgs_push(null_mut(), all.as_ptr(), null(), 1)), Status::NullPointer);
    let (bodies, parameters) = (arrays(&mut crates), defaults());
    let (b, p) = (from_ref(&bodies), from_ref(&parameters));
    assert_eq!(made!(zpgs_end(null_mut(), b, p)), Status::NullPointer);
    assert_eq!(made!(zpgs_end(open.0, null(), p)), Status::NullPointer);
    assert_eq!(made!(zpgs_end(open.0, b, null())), Status::NullPointer);
    let mut odd = bodies;
    odd.positions.stride = 13;
    assert_eq!(open.end(&odd, &parameters), Status::Argument);
    assert_eq!(open.push(&all), Status::Ok, "the list is still open");
    assert_eq!(open.end(&bodies, &parameters), Status::Ok, "{}", open.text());
    assert_eq!(open.wait(&bodies), Status::Ok, "{}", open.text());
    assert_eq!(crates, stepped());
}
