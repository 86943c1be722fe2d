//! Steps that integrate nothing and have no poses.

use bitstream_model::BoardConfig;
use pgs_interface::extension::Extensions;
use pgs_interface::profile::{FLOAT, HALF, NAIVE};

use crate::common::scene::{Step, bits, result_beats};
use crate::common::sg::{Flight, LONG, Machine};

/// A step without poses gives the velocities of the same step with poses. It takes no poses in, and sends
/// half the beats.
#[test]
fn a_step_without_poses_gives_out_velocities_alone() {
    for profile in [&FLOAT, &NAIVE, &HALF] {
        let config = BoardConfig { profile, ..BoardConfig::default() };
        let variant = config.variant();
        let mut machine = Machine::new(config);
        for bodies in [1, 2, 5, 300] {
            let falling = Step::falling(bodies);
            let with_poses = Step { integrate: false, ..falling };
            let step = Step { velocities_only: true, ..with_poses.clone() };
            let expected = machine.step(&with_poses).expect("nothing fails");
            let found = machine.step(&step).expect("nothing fails");
            for (expected, found) in expected.bodies.iter().zip(&found.bodies) {
                assert_eq!(bits(found)[2..], bits(expected)[2..], "{}", profile.name);
            }
            assert_eq!(found.bodies.len(), usize::from(bodies));
            assert_eq!(found.cycles - found.waits, step.cycles(&variant), "{}", profile.name);
            assert_eq!(found.sum_received, step.sum_of_input(&variant));
            assert_eq!(found.sum_sent, found.sum_of_results);
        }
    }
}

/// With FLAGS.integrate the switch has no effect, and a board without the extension ignores it.
#[test]
fn a_step_keeps_its_poses_where_the_switch_has_no_effect() {
    let step = Step { velocities_only: true, ..Step::falling(5) };
    let lanes = Step::falling(5).lanes();
    let boards = [
        (BoardConfig::default(), step.clone()),
        (
            BoardConfig { extensions: Extensions::NONE, ..BoardConfig::default() },
            Step { integrate: false, ..step },
        ),
    ];
    for (config, step) in boards {
        let mut machine = Machine::new(config);
        step.write_arguments(&machine.host);
        let mut flight = Flight::default();
        machine.arm(&mut flight, &result_beats(5));
        machine.start();
        machine.send(&mut flight, &lanes);
        machine.wait(&flight, LONG).expect("nothing fails");
        let found = machine.collect(&flight, 5);
        assert!(found.bodies.iter().any(|body| bits(body)[0] != [0; 4]), "poses come back");
    }
}
