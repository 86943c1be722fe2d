//! Tests that the widths of length registers and addresses change the descriptors of a step, and
//! nothing else.
//!
//! `cargo test -p zynq-pgs --test it widths:: -- --nocapture` prints the descriptors of each.
#![cfg(feature = "emulation")]
#![allow(clippy::print_stdout, reason = "the counts are the output of the test")]

use crate::common::{bits, open};
use bitstream_model::BoardConfig;
use scene::{Scene, SceneOptions};
use zynq_pgs::{StepParameters, StepReport};

const LENGTH_WIDTHS: [u32; 5] = [8, 14, 16, 23, 26];
const ADDRESS_WIDTHS: [u32; 2] = [32, 40];
const STEPS: usize = 2;
const PASSES: u64 = 8;

/// The first steps of a pile of 1,000 cubes that stands on the ground.
fn steps(config: BoardConfig) -> (Vec<StepReport>, Vec<u32>) {
    let (board, mut accelerator) = open(config);
    let grid = "10x10x10".parse().expect("a grid");
    let options = SceneOptions { grid, drop: 0.0 };
    let mut scene = Scene::new(&options).expect("a small scene");
    accelerator.set_shapes(scene.shapes()).expect("they fit");
    let mut reports = Vec::new();
    for _ in 0..STEPS {
        scene.detect();
        let before = board.counts().descriptors;
        let (bodies, collisions) = scene.parts_mut();
        let report = accelerator.step(bodies, collisions, &StepParameters::default());
        let report = report.unwrap_or_else(|error| panic!("{error}: {:?}", board.violations()));
        // The board completed the number of descriptors that the driver reports.
        assert_eq!(board.counts().descriptors - before, report.descriptors);
        reports.push(report);
    }
    assert_eq!(board.violations(), []);
    (reports, bits(scene.bodies()))
}

/// Descriptors of a step, by the layout of the specification's streams.
fn descriptors(length_width: u32, bodies: u64, collisions: u64) -> u64 {
    // The longest piece: the largest length in whole bursts of 64 bytes that the register holds.
    let largest = ((1_u64 << length_width) - 1) / 64 * 64;
    let pieces = |beats: u64| (16 * beats).div_ceil(largest);
    (0..4)
        .map(|channel| {
            // Velocities and poses: two beats a body, dealt out in turn. Collisions: seven beats,
            // one of them on the last channel. Results: one beat a body.
            let pairs = (2 * bodies - channel).div_ceil(4);
            let of_collision = if channel == 3 { 1 } else { 2 };
            2 * pieces(pairs) + PASSES * pieces(of_collision * collisions) + pieces(bodies)
        })
        .sum()
}

#[test]
fn every_width_gives_the_same_bits_in_as_many_descriptors_as_it_must() {
    let (reports, expected) = steps(BoardConfig::default());
    let sizes: Vec<_> = reports.iter().map(|report| (report.bodies, report.collisions)).collect();
    let (bodies, collisions) = sizes[0];
    assert!(collisions > 2000, "a pile has contacts: {collisions}");
    println!("{bodies} bodies, {collisions} collisions, {PASSES} passes, first step");
    println!("{:>14} {:>14} {:>12}", "length width", "address width", "descriptors");
    for length_width in LENGTH_WIDTHS {
        for address_width in ADDRESS_WIDTHS {
            let config = BoardConfig { length_width, address_width, ..BoardConfig::default() };
            let (reports, found) = steps(config);
            assert!(found == expected, "other bits with {length_width} and {address_width} bits");
            for (report, (bodies, collisions)) in reports.iter().zip(&sizes) {
                assert_eq!((report.bodies, report.collisions), (*bodies, *collisions));
                assert_eq!(
                    report.descriptors,
                    descriptors(length_width, *bodies, *collisions),
                    "{length_width} bits, {bodies} bodies, {collisions} collisions"
                );
            }
            println!("{length_width:>14} {address_width:>14} {:>12}", reports[0].descriptors);
        }
    }
}
