//! Shares the parts of whole-step tests: opening a board, scenes, choosing an order, comparing
//! bits.
#![allow(dead_code, reason = "each test uses its part")]

pub(crate) mod direct;
pub(crate) mod random_scene;

use bitstream_model::{BoardConfig, EmulatedBoard};
use zynq_pgs::order::{InputBuffers, IssueWindow, Order, Orderer};
use zynq_pgs::{
    Accelerator, BoardChoice, Body, Collision, Contact, OpenOptions, Pose, Shape, StepParameters,
    Velocity,
};

pub(crate) fn open(config: BoardConfig) -> (EmulatedBoard, Accelerator) {
    open_with(config, None, &[])
}

/// A board with these shapes, whose steps this number of threads packs.
pub(crate) fn open_with(
    config: BoardConfig,
    pack_threads: Option<usize>,
    shapes: &[Shape],
) -> (EmulatedBoard, Accelerator) {
    let board = EmulatedBoard::new(config).expect("a board that can be built");
    let choice = BoardChoice::Emulated(board.cpu_port());
    let options = OpenOptions { board: choice, pack_threads, ..OpenOptions::default() };
    let mut accelerator = Accelerator::open(options).expect("a board that opens");
    if !shapes.is_empty() {
        accelerator.set_shapes(shapes).expect("shapes that fit");
    }
    (board, accelerator)
}

/// A body at rest, with its axes along the world's.
pub(crate) fn at_rest(position: [f32; 3], shape: u32) -> Body {
    let pose = Pose { position, orientation: [0.0, 0.0, 0.0, 1.0] };
    Body { pose, velocity: Velocity::default(), shape }
}

/// A collision of body A with body B above it, at four corners of a cube of 2 m in the middle of
/// `x`, at height `y`.
pub(crate) fn standing([body_a, body_b]: [u32; 2], x: f32, y: f32, distance: f32) -> Collision {
    let contacts = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]
        .map(|[dx, dz]| Contact { point: [x + dx, y, dz], distance });
    Collision { body_a, body_b, normal: [0.0, -1.0, 0.0], count: 4, contacts }
}

/// Cubes in a row, `pitch` apart, each 1 cm deep in the static ground; `velocity` gives the
/// velocity of the cube at `x`.
pub(crate) fn row(
    cubes: u16,
    pitch: f32,
    velocity: impl Fn(f32) -> Velocity,
) -> (Vec<Body>, Vec<Collision>) {
    let mut bodies = vec![at_rest([0.0, -400.0, 0.0], 0)];
    let mut collisions = Vec::new();
    for cube in 1..=cubes {
        let x = pitch * f32::from(cube);
        bodies.push(Body { velocity: velocity(x), ..at_rest([x, 0.99, 0.0], 1) });
        collisions.push(standing([0, cube.into()], x, -0.01, -0.01));
    }
    (bodies, collisions)
}

pub(crate) fn ordered(order: Order) -> StepParameters {
    StepParameters::default().with_order(order)
}

pub(crate) fn bits(bodies: &[Body]) -> Vec<u32> {
    let numbers = |body: &Body| {
        let Pose { position, orientation } = body.pose;
        let Velocity { linear, angular } = body.velocity;
        [position.to_vec(), orientation.to_vec(), linear.to_vec(), angular.to_vec()].concat()
    };
    bodies.iter().flat_map(numbers).map(f32::to_bits).collect()
}

/// The collisions one by one in an order for a depth of `depth` issue slots.
pub(crate) fn by_hand(
    order: Order,
    bodies: &[Body],
    collisions: &[Collision],
    shapes: &[Shape],
    depth: u32,
) -> Vec<Collision> {
    let window = IssueWindow::new(depth, 1).expect("a window");
    let mut buffers = InputBuffers::new();
    let input = buffers.gather(bodies, collisions, shapes);
    let mut orderer = Orderer::new();
    let schedule = orderer.order(&input, order, window).expect("it can be ordered");
    schedule.iter().flatten().map(|index| collisions[index as usize]).collect()
}
