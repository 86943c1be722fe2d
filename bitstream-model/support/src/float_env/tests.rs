//! Tests of the environment: what is computed in it, and what is left behind.

use std::hint::black_box;
use std::panic::{AssertUnwindSafe, catch_unwind, panic_any};

use super::foreign::{Environment, environments, under};
use super::{standard, standard_around, without_subnormals};
use crate::Crew;

/// Bits that every environment of a caller changes or does not survive.
fn computed() -> [u32; 4] {
    let [one, three, tiny] = [1.0_f32, 3.0, f32::MIN_POSITIVE].map(black_box);
    [one / three, -one / three, tiny / three, black_box(tiny / 4.0) * 4.0].map(f32::to_bits)
}

/// That of the standard environment, by hand: 1/3 is 0xAAAAAA.AA... 2^-25, the subnormals in units
/// of 2^-149.
const EXPECTED: [u32; 4] = [0x3EAA_AAAB, 0xBEAA_AAAB, 0x002A_AAAB, 0x0080_0000];

/// Does something in the present environment and in every caller's; each must stay as it was.
fn everywhere(work: impl Fn(&str)) {
    work("as it is");
    for (name, environment) in environments() {
        let work = || {
            work(name);
            assert_eq!(Environment::current(), environment, "{name}");
        };
        // SAFETY: what is given here computes in the standard environment alone.
        unsafe { under(environment, work) };
    }
}

#[test]
fn other_environments_compute_something_else() {
    assert_eq!(computed(), EXPECTED);
    for (name, environment) in environments() {
        // A trap would end the test, and no NaN is computed.
        if !["every exception traps", "default NaN"].contains(&name) {
            // SAFETY: the operands of this arithmetic are hidden from the compiler, and whatever
            // comes of it is taken.
            let found = unsafe { under(environment, computed) };
            assert_ne!(found, EXPECTED, "{name}");
        }
    }
}

#[test]
fn work_computes_in_the_standard_environment_and_the_callers_is_restored() {
    everywhere(|name| {
        let outside = Environment::current();
        let inside = standard(|| (Environment::current().is_standard(), computed()));
        assert_eq!(Environment::current(), outside, "{name}");
        assert_eq!(inside, (true, EXPECTED), "{name}");
    });
}

#[test]
fn the_callers_environment_is_restored_when_work_panics() {
    everywhere(|name| {
        let outside = Environment::current();
        let panic = catch_unwind(|| standard(|| panic_any(computed()))).expect_err("a panic");
        assert_eq!(Environment::current(), outside, "{name}");
        assert_eq!(*panic.downcast::<[u32; 4]>().expect("bits"), EXPECTED, "{name}");
    });
}

#[test]
fn a_part_of_the_work_runs_outside_and_what_it_changes_there_stays() {
    everywhere(|name| {
        let outside = Environment::current();
        standard_around(|caller| {
            caller.run(|| assert_eq!(Environment::current(), outside, "{name}"));
            assert_eq!(computed(), EXPECTED, "{name}");
            // Also of a part that panics, in one that is itself inside.
            let panicked = catch_unwind(AssertUnwindSafe(|| {
                caller.run(|| {
                    standard(|| assert_eq!(computed(), EXPECTED, "{name}"));
                    assert_eq!(Environment::current(), outside, "{name}");
                    panic_any(());
                });
            }));
            assert!(panicked.is_err() && computed() == EXPECTED, "{name}");
        });
        assert_eq!(Environment::current(), outside, "{name}");
    });
    for (name, other) in environments() {
        let before = Environment::current();
        // SAFETY: nothing is computed.
        let changed = unsafe {
            under(before, || {
                standard_around(|caller| caller.run(|| other.0.restore()));
                Environment::current()
            })
        };
        assert_eq!(changed, other, "{name}");
        assert_eq!(Environment::current(), before, "{name}");
    }
}

#[test]
fn a_crew_computes_in_the_standard_environment_whoever_started_it_and_calls_it() {
    for helpers in [0, 2] {
        let mut started = Crew::new("test", helpers);
        everywhere(|name| {
            let mut crews = [Crew::new("test", helpers)];
            for crew in &mut crews {
                all_compute_alike(crew, name);
            }
        });
        // Started here, called from elsewhere.
        for (name, environment) in environments() {
            // SAFETY: only the crew computes.
            unsafe { under(environment, || all_compute_alike(&mut started, name)) };
        }
    }
}

/// Whether every share, on whatever thread, computes the same.
fn all_compute_alike(crew: &mut Crew, name: &str) {
    let outside = Environment::current();
    for count in [1, 40] {
        let mut shares = vec![([0; 4], false); count];
        crew.each(shares.iter_mut(), |share| {
            *share = (computed(), Environment::current().is_standard());
        });
        assert_eq!(shares, vec![(EXPECTED, true); count], "{name}");
    }
    crew.run(&|_| assert_eq!(computed(), EXPECTED, "{name}"));
    assert_eq!(Environment::current(), outside, "{name}");
}

#[test]
fn subnormal_operands_and_inexact_results_are_seen_and_nothing_else_is() {
    if environments().next().is_none() {
        // Nothing is certain there.
        assert!(!without_subnormals(true, || ()).1);
        return;
    }
    let tiny = black_box(f32::MIN_POSITIVE);
    let seen = |a: f32, b: f32| !without_subnormals(true, || black_box(black_box(a) * b)).1;
    standard(|| {
        for (a, b, subnormal) in [
            (1.0, 3.0, false),
            (0.0, -3.0, false),
            (f32::INFINITY, 0.0, false),
            (tiny, 2.0, false),
            (tiny, 1.0 / 3.0, true),
            (-tiny / 2.0, 8.0, true),
            (f32::from_bits(1), 1.0, true),
        ] {
            // Twice: the flags of the first time are down again.
            assert_eq!([seen(a, b), seen(a, b)], [subnormal; 2], "{a:e} {b:e}");
            assert!(!seen(1.5, 3.0));
        }
        // An exact one is seen where it is used.
        let used = without_subnormals(true, || black_box(black_box(tiny * black_box(0.5)) + 1.0));
        assert!(!used.1);
        let (_, none) = without_subnormals(false, || black_box(f32::from_bits(1)) * black_box(0.7));
        assert!(none, "nobody watches");
        assert_eq!(computed(), EXPECTED, "the environment is the standard one again");
    });
}
