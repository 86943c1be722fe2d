//! Piles, towers and a ramp.

use std::f32::consts::PI;

use rapier3d::prelude::*;

use crate::table::{Limit, Table};
use crate::twister::Twister;
use crate::world::World;

/// A scene.
pub(crate) struct Scene {
    pub(crate) name: &'static str,
    pub(crate) title: &'static str,
    pub(crate) run: fn(&mut Table) -> Result<(), zynq_pgs::Error>,
}

/// All scenes.
pub(crate) const SCENES: [Scene; 3] = [
    Scene { name: "pile", title: "1,000 cubes of 1 kg fall", run: pile },
    Scene { name: "tower", title: "cubes of 1 kg on each other, 10 + 10 passes", run: tower },
    Scene {
        name: "ramp",
        title: "boxes on a ramp of 20 degrees, each with its friction",
        run: ramp,
    },
];

/// The cubes fall from the loose grid of the Bullet client.
fn fallen(world: &mut World) -> Result<[f64; 4], zynq_pgs::Error> {
    world.sets.add_ground();
    let mut random = Twister::new(1);
    for y in 0..10_u8 {
        for (x, z) in (0..10_u8).flat_map(|x| (0..10_u8).map(move |z| (x, z))) {
            let mut shifted = |at| 1.2 * f32::from(at) - 6.0 + random.between(-0.1, 0.1);
            let (x, z) = (shifted(x), shifted(z));
            let at = Vector::new(x, 1.0 + 1.2 * f32::from(y), z);
            world.sets.add_cube(Pose::from_translation(at), 0.5);
        }
    }
    world.step(300)?;
    let [collisions, time] = world.work();
    Ok([world.kinetic_energy(), world.sets.deepest(), collisions, time])
}

fn pile(table: &mut Table) -> Result<(), zynq_pgs::Error> {
    // Chance has a part in the energy: piles from nearly equal places differ by a third of it.
    for (passes, energy, depth) in [(4, 2.0, 30.0), (10, 0.5, 10.0)] {
        let both = table.measure(passes, fallen)?;
        let measures = [
            ("kinetic energy at step 300", "J", Limit::at_most(energy)),
            ("deepest at step 300", "mm", Limit::at_most(depth)),
            ("collisions of step 300", "", Limit::NONE),
            ("the board's time for it (modelled)", "ms", Limit::NONE),
        ];
        for ((measure, unit, limit), values) in
            measures.into_iter().zip(both.rapier.into_iter().zip(both.board))
        {
            table.add(values, format!("{passes} + {passes} passes: {measure}"), unit, limit);
        }
    }
    Ok(())
}

/// 1 if a tower stands after 10 s.
fn stands(world: &mut World, cubes: u8) -> Result<[f64; 1], zynq_pgs::Error> {
    world.sets.add_ground();
    let at = |cube| Pose::from_translation(Vector::new(0.0, 0.5 + f32::from(cube), 0.0));
    let cubes: Vec<_> = (0..cubes).map(|cube| world.sets.add_cube(at(cube), 0.5)).collect();
    world.step(600)?;
    let height = cubes.last().map_or(0.0, |top| world.sets.place(*top).y);
    Ok([f64::from(u8::from(height > cubes.len() as f32 - 1.0))])
}

fn tower(table: &mut Table) -> Result<(), zynq_pgs::Error> {
    let (mut highest, mut standing) = ([0.0; 2], [true; 2]);
    for cubes in [3, 5, 8, 10, 12, 15, 20] {
        let both = table.measure(10, |world| stands(world, cubes))?;
        for ((highest, standing), [stands]) in
            highest.iter_mut().zip(&mut standing).zip([both.rapier, both.board])
        {
            *standing &= stands > 0.0;
            if *standing {
                *highest = f64::from(cubes);
            }
        }
    }
    let [rapier, board] = highest;
    table.add((rapier, board), "cubes of the highest that stands 10 s", "", Limit::at_least(15.0));
    Ok(())
}

const FRICTIONS: [f32; 4] = [0.1, 0.3, 0.5, 0.9];

fn slid(world: &mut World) -> Result<[f64; 4], zynq_pgs::Error> {
    let turn = Rotation::from_rotation_z(20.0 * PI / 180.0);
    world.sets.add_fixed(Vector::new(20.0, 0.5, 20.0), Pose::from_parts(Vector::ZERO, turn), 1.0);
    let mut boxes = Vec::new();
    for (lane, friction) in (0_u8..).zip(FRICTIONS) {
        let start = turn * Vector::new(5.0, 1.0, 2.0 * f32::from(lane));
        boxes.push((world.sets.add_cube(Pose::from_parts(start, turn), friction), start));
    }
    world.step(120)?;
    let mut slid = [0.0; 4];
    for (slid, (cube, start)) in slid.iter_mut().zip(boxes) {
        *slid = f64::from((world.sets.place(cube) - start).length());
    }
    Ok(slid)
}

fn ramp(table: &mut Table) -> Result<(), zynq_pgs::Error> {
    let both = table.measure(10, slid)?;
    // g t^2 (sin 20 - friction cos 20) / 2 is 4.87, 1.18, 0 and 0 m. Steps of 1/60 s and the first
    // penetration add some centimetres.
    let limits = [
        Limit::within(4.62, 5.15),
        Limit::within(1.12, 1.37),
        Limit::at_most(0.02),
        Limit::at_most(0.02),
    ];
    let values = both.rapier.into_iter().zip(both.board);
    for ((friction, limit), values) in FRICTIONS.into_iter().zip(limits).zip(values) {
        table.add(values, format!("slid in 2 s, friction {friction}"), "m", limit);
    }
    Ok(())
}
