//! The scenes of the examples, stepped by the driver.

use zynq_pgs::{
    Accelerator, Body, Collision, Contact, Impulses, OpenOptions, Pose, Shape, StepParameters,
    Velocity, WarmCollisions,
};

fn at(y: f32, shape: u32, x_speed: f32) -> Body {
    Body {
        pose: Pose { position: [0.0, y, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] },
        velocity: Velocity { linear: [x_speed, 0.0, 0.0], angular: [0.0; 3] },
        shape,
    }
}

fn board(cube: Shape) -> Accelerator {
    let board = OpenOptions::emulated("float").expect("a build");
    let mut board = Accelerator::open(board).expect("a board");
    board.set_shapes(&[Shape::STATIC, cube]).expect("shapes");
    board
}

fn digest(bodies: &[Body]) -> String {
    format!("{:016x}", step_folder::digest::of_bodies(bodies))
}

/// The digest of `cube.c`.
pub(crate) fn cube() -> String {
    let mut board = board(Shape::isotropic(1.0, 1.5));
    let mut bodies = [at(-1.0, 0, 0.0), at(2.0, 1, 0.5)];
    let parameters = StepParameters::default().with_friction(0.5);
    for _ in 0..90 {
        let collision = on_the_ground(&bodies[1]);
        board.step(&mut bodies[..], &[collision][..], &parameters).expect("a step");
    }
    let height = bodies[1].pose.position[1];
    assert!((0.9..1.1).contains(&height), "the cube lies on the ground: {height}");
    digest(&bodies)
}

fn on_the_ground(cube: &Body) -> Collision {
    let [x, y, z] = cube.pose.position;
    let depth = y - 1.0;
    let corner = |dx, dz| Contact { point: [x + dx, depth, z + dz], distance: depth };
    let contacts = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
    let count = if depth < 0.0 { 4 } else { 0 };
    Collision { body_a: 0, body_b: 1, normal: [0.0, -1.0, 0.0], count, contacts }
}

/// The digest of `tower.cpp`.
pub(crate) fn tower() -> String {
    let mut board = board(Shape::isotropic(1.0, 6.0));
    let heights = [0.5, 1.625, 2.75, 3.875];
    let mut bodies = vec![at(-0.5, 0, 0.0)];
    bodies.extend(heights.map(|height| at(height, 1, 0.0)));
    bodies[4].velocity.linear[0] = 0.25;
    let parameters = StepParameters::default().with_warm_start(true).with_impulses_out(true);
    let mut impulses = [Impulses::ZERO; 4];
    let mut touched = [false; 4];
    for _ in 0..90 {
        let collisions = [0, 1, 2, 3].map(|below| one_on_the_other(&bodies, below));
        impulses = impulses.map(|Impulses { normal, friction }| Impulses {
            normal: normal.map(|impulse| impulse * 0.85),
            friction: friction.map(|impulse| impulse * 0.85),
        });
        let warm = WarmCollisions { collisions: &collisions[..], impulses: &impulses };
        board.step(&mut bodies, &warm, &parameters).expect("a step");
        impulses.copy_from_slice(board.impulses());
        for (touched, impulses) in touched.iter_mut().zip(&impulses) {
            *touched |= impulses.normal[0] > 0.0;
        }
    }
    assert_eq!(touched, [true; 4], "each cube has met the one below");
    let height = bodies[4].pose.position[1];
    assert!((3.4..3.6).contains(&height), "the cubes stand on each other: {height}");
    digest(&bodies)
}

fn one_on_the_other(bodies: &[Body], below: u32) -> Collision {
    let [lower, upper] = [below, below + 1].map(|body| bodies[body as usize].pose.position);
    let distance = upper[1] - lower[1] - 1.0;
    let corner =
        |dx, dz| Contact { point: [upper[0] + dx, lower[1] + 0.5, upper[2] + dz], distance };
    let contacts = [corner(-0.5, -0.5), corner(-0.5, 0.5), corner(0.5, -0.5), corner(0.5, 0.5)];
    let count = if distance < 0.0 { 4 } else { 0 };
    Collision { body_a: below + 1, body_b: below, normal: [0.0, 1.0, 0.0], count, contacts }
}
