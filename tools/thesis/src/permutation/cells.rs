//! Orders collisions as Bullet's GPU solver does: by groups of cells that can be solved at the same
//! time, by cell, and in a cell by batches of pairs without a common body.
//!
//! Bullet's own `gpu_order.npy` of the thesis' scene has 256 cells. This order has the same cells
//! in the same sequence; 223 cells also have the same sequence of collisions.
//!
//! Source: `Bullet3OpenCL`, `b3GpuPgsContactSolver`, `SetSortDataKernel` and
//! `sortConstraintByBatch3`.

use zynq_pgs::Body;
use zynq_pgs::order::OrderInput;

/// Edge of a cell, m.
const EDGE: f32 = 6.0;
/// Cells along x, y and z; positions further out share them.
const CELLS: [u32; 3] = [8, 4, 8];
/// Most collisions that a batch takes before bodies may come again.
const BATCH: usize = 64;

/// The order as indices of collisions, without empty ones.
pub(crate) fn order(input: &OrderInput<'_>, bodies: &[Body]) -> Vec<u32> {
    let mut keyed: Vec<(u32, u32)> = (0..)
        .zip(input.pairs)
        .filter(|(_, pair)| **pair != OrderInput::EMPTY)
        .map(|(index, pair)| (key(input, bodies, *pair), index))
        .collect();
    keyed.sort_unstable();
    let mut order: Vec<u32> = Vec::with_capacity(keyed.len());
    let mut taken = vec![0; input.moving.len()];
    let mut batch = 0;
    for cell in keyed.chunk_by(|one, next| one.0 == next.0) {
        let begin = order.len();
        order.extend(cell.iter().map(|(_, index)| *index));
        batches(input, &mut order[begin..], &mut taken, &mut batch);
    }
    order
}

/// The place of a pair's cell in the sequence: first the parities of its coordinates, z before y
/// before x, then the halves of the coordinates likewise.
fn key(input: &OrderInput<'_>, bodies: &[Body], [a, b]: [u32; 2]) -> u32 {
    let body = if is_moving(input, a) { a } else { b };
    let body = usize::try_from(body).ok();
    let body = body.and_then(|body| bodies.get(body));
    let position = body.map(|body| body.pose.position).unwrap_or_default();
    let [x, y, z] = [0, 1, 2].map(|axis: usize| cell(position[axis]) & (CELLS[axis] - 1));
    let parities = (z & 1) << 2 | (y & 1) << 1 | (x & 1);
    let halves = ((z >> 1) * (CELLS[1] >> 1) + (y >> 1)) * (CELLS[0] >> 1) + (x >> 1);
    parities * CELLS.iter().product::<u32>() + halves
}

/// The number of the cell along an axis, before it is folded.
fn cell(coordinate: f32) -> u32 {
    let shifted = if coordinate < 0.0 { coordinate - 1.0 } else { coordinate };
    #[allow(clippy::cast_possible_truncation, reason = "only the low bits matter")]
    let cell = (shifted / EDGE) as i32;
    cell.cast_unsigned()
}

fn is_moving(input: &OrderInput<'_>, body: u32) -> bool {
    let body = usize::try_from(body).ok();
    body.and_then(|body| input.moving.get(body)).is_some_and(|moving| *moving)
}

/// Brings the collisions of a cell into batches: each round takes the pairs whose bodies are free,
/// and swaps them to the front; the first pair is always free. `taken` has the number of the batch
/// that used each body last.
fn batches(input: &OrderInput<'_>, cell: &mut [u32], taken: &mut [u32], batch: &mut u32) {
    let mut done = 0;
    while done < cell.len() {
        *batch += 1;
        let (mut count, begin) = (0, done);
        for at in begin..cell.len() {
            let pair = usize::try_from(cell[at]).ok().and_then(|index| input.pairs.get(index));
            let moving = pair.into_iter().flatten().filter(|body| is_moving(input, **body));
            let bodies: Vec<usize> =
                moving.filter_map(|body| usize::try_from(*body).ok()).collect();
            if bodies.iter().any(|body| taken[*body] == *batch) {
                continue;
            }
            bodies.iter().for_each(|body| taken[*body] = *batch);
            cell.swap(at, done);
            done += 1;
            count += 1;
            if count == BATCH {
                count = 0;
                *batch += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::path::PathBuf;

    use zynq_pgs::order::InputBuffers;
    use zynq_pgs::{Pose, Velocity};

    use super::super::recorded;
    use super::*;
    use pgs_command::environment::variable;
    use pgs_command::step_input;

    #[test]
    fn the_cells_of_the_full_step_are_those_of_the_gpu() {
        let root = variable("PGS_VECTORS").map(PathBuf::from);
        let Some(path) = root.map(|root| root.join("full_step186")).filter(|path| path.exists())
        else {
            // With stderr closed, the report is lost and the test goes on.
            let _ = writeln!(std::io::stderr(), "skipped: the cells of full_step186");
            return;
        };
        let folder = step_input::load(&path).expect("a folder");
        let theirs = recorded(&path, folder.collisions.len()).expect("an order").expect("the file");
        let mut buffers = InputBuffers::new();
        let input = buffers.gather(&folder.bodies, &folder.collisions[..], &folder.shapes);
        let ours = order(&input, &folder.bodies);
        let cell_of = |index: &u32| {
            let pair = input.pairs[usize::try_from(*index).expect("an index")];
            key(&input, &folder.bodies, pair)
        };
        let cells = |order: &[u32]| -> Vec<Vec<u32>> {
            order.chunk_by(|a, b| cell_of(a) == cell_of(b)).map(<[u32]>::to_vec).collect()
        };
        let (theirs, ours) = (cells(&theirs), cells(&ours));
        let keys =
            |cells: &[Vec<u32>]| cells.iter().map(|cell| cell_of(&cell[0])).collect::<Vec<_>>();
        assert_eq!(keys(&ours), keys(&theirs));
        let same = theirs.iter().zip(&ours).filter(|(theirs, ours)| theirs == ours).count();
        assert_eq!((ours.len(), same), (256, 223));
    }

    /// The order of pairs of bodies at these positions.
    fn ordered(pairs: &[[u32; 2]], moving: &[bool], positions: &[[f32; 3]]) -> Vec<u32> {
        let at = |position: &[f32; 3]| {
            let pose = Pose { position: *position, orientation: [0.0, 0.0, 0.0, 1.0] };
            Body { pose, velocity: Velocity::default(), shape: 0 }
        };
        let bodies: Vec<Body> = positions.iter().map(at).collect();
        order(&OrderInput { pairs, moving }, &bodies)
    }

    #[test]
    fn cells_that_touch_are_in_different_groups() {
        let positions = [[1.0, 1.0, 1.0], [7.0, 1.0, 1.0], [13.0, 1.0, 1.0], [1.0, 1.0, -6.0]];
        let pairs = [[0, 0], [1, 1], [2, 2], [3, 3]];
        let found = ordered(&pairs, &[true; 4], &positions);
        // Along x cell 0, cell 2, and then cell 1; along z cell 0 before cell 7, which is -1
        // folded.
        assert_eq!(found, [0, 2, 1, 3]);
    }

    #[test]
    fn a_batch_takes_each_moving_body_once_and_a_static_one_often() {
        // A chain of bodies 1 to 4 on the ground, body 0.
        let pairs = [[0, 1], [1, 2], [2, 3], [3, 4], [0, 3]];
        let moving = [false, true, true, true, true];
        let found = ordered(&pairs, &moving, &[[0.0; 3]; 5]);
        // 0-1 and 2-3 first; the swap has put 1-2 behind; then 1-2 and 3-4; then 0-3.
        assert_eq!(found, [0, 2, 1, 3, 4]);
    }

    #[test]
    fn sixty_four_collisions_free_the_bodies() {
        let pairs: Vec<[u32; 2]> = (1..=64).chain([1]).map(|body| [0, body]).collect();
        let moving: Vec<bool> = (0..65).map(|body| body > 0).collect();
        let found = ordered(&pairs, &moving, &[[0.0; 3]; 65]);
        assert_eq!(found, (0..65).collect::<Vec<_>>());
    }

    #[test]
    fn an_empty_collision_has_no_place() {
        let pairs = [OrderInput::EMPTY, [0, 1]];
        assert_eq!(ordered(&pairs, &[false, true], &[[0.0; 3]; 2]), [1]);
        assert!(ordered(&[], &[], &[]).is_empty());
    }
}
