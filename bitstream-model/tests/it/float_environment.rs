//! The board's results do not depend on the floating-point environment of the threads that drive
//! it: rounding, flushing, traps.
#![allow(unsafe_code, reason = "Rust does not say what it computes in a foreign environment")]
#![allow(clippy::print_stdout, reason = "what is skipped is said")]

use bitstream_model::BoardConfig;
use pgs_interface::profile::{PROFILES, Profile};
use pgs_support::float_env::foreign::{Environment, environments, under};

use crate::common::fast::{Visible, scene, visible};
use crate::common::scene::{AT_REST, Body, Step};
use crate::common::sg::Machine;

fn boards() -> impl Iterator<Item = BoardConfig> {
    let of = |profile: &'static Profile, inertia| BoardConfig {
        profile,
        inertia,
        ..BoardConfig::default()
    };
    let both =
        move |&profile: &&'static Profile| profile.inertias().iter().map(move |i| of(profile, *i));
    PROFILES.iter().flat_map(both)
}

/// Numbers that have to be rounded, and every ninth body so slow that its velocity is subnormal: a
/// flushing environment would lose it in f32.
fn step() -> Step {
    let mut step = Step { damping: 0.99, gravity: [0.0, -9.8, 0.0], ..scene(300, 500, 11, true) };
    for body in step.bodies.iter_mut().skip(1).step_by(9).filter(|body| body.shape != 0) {
        let Body { linear, angular, .. } = AT_REST;
        (body.linear, body.angular) = (linear, angular);
        (body.linear[0], body.angular[1]) = (1e-39, -3e-40);
    }
    step.collisions.retain(|collision| collision.bodies.iter().all(|body| body % 9 != 1));
    step
}

#[test]
fn a_step_is_the_same_in_every_environment_on_every_number_of_threads() {
    if environments().next().is_none() {
        println!("skipped: nothing is known of this processor's floating-point environment");
    }
    for config in boards() {
        let told = step();
        let lanes = told.packed(&config.variant());
        let bodies = told.bodies.len();
        let drive = |machine: &mut Machine| machine.drive(&told, &lanes).expect("it completes");
        // The results are decoded outside of the environment.
        let collect = |(machine, flight): &(Machine, _)| visible(&machine.collect(flight, bodies));
        let mut expected: Option<Visible> = None;
        for threads in [1, 2] {
            let config = BoardConfig { threads, ..config };
            let begun = || {
                let mut machine = Machine::new(config);
                let flight = drive(&mut machine);
                (machine, flight)
            };
            let plain = collect(&begun());
            let expected = expected.get_or_insert(plain.clone());
            let variant = config.variant();
            assert!(plain == *expected, "{variant:?} on {threads} threads");
            for (name, environment) in environments() {
                let mut other = Machine::new(config);
                let work = || {
                    // One board is built in this environment, the other in the standard one.
                    let same = begun();
                    let flight = drive(&mut other);
                    (same, flight, Environment::current())
                };
                // SAFETY: outside of the board, `work` moves words and computes no floating-point
                // number.
                let (same, flight, left) = unsafe { under(environment, work) };
                assert_eq!(left, environment, "{name}");
                for found in [collect(&same), collect(&(other, flight))] {
                    assert!(found == *expected, "{variant:?}, {name}, {threads} threads");
                }
            }
        }
    }
}
