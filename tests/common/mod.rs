//! Shares the parts of whole-step tests: opening a board, choosing an order, comparing bits.
#![allow(dead_code, reason = "each test uses its part")]

use bitstream_model::{BoardConfig, EmulatedBoard};
use zynq_pgs::order::{InputBuffers, IssueWindow, Order, Orderer};
use zynq_pgs::{
    Accelerator, BoardChoice, Body, Collision, OpenOptions, Pose, Shape, StepParameters, Velocity,
};

pub(crate) fn open(config: BoardConfig) -> (EmulatedBoard, Accelerator) {
    let board = EmulatedBoard::new(config).expect("a board that can be built");
    let options =
        OpenOptions { board: BoardChoice::Emulated(board.cpu_port()), ..OpenOptions::default() };
    (board, Accelerator::open(options).expect("a board that opens"))
}

pub(crate) fn ordered(order: Order) -> StepParameters {
    let mut parameters = StepParameters::default();
    parameters.order = Some(order);
    parameters
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
