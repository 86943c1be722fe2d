//! The velocities of bodies as the passes read and write them.

use bytemuck::{Pod, Zeroable};

use super::kernel::BodyRow;
use crate::accelerator::solver::{Mass, Velocity};

/// Rows of velocities: two to a cache line. A row is the linear velocity and the inverse mass, then
/// the angular velocity and the inverse inertia, if that is one number.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C, align(64))]
pub(crate) struct Line([BodyRow; 2]);

impl Line {
    pub(crate) fn put(&mut self, second: bool, velocity: &Velocity, mass: &Mass) {
        let ([x, y, z], [p, q, r]) = (velocity.linear, velocity.angular);
        let row = [[x, y, z, mass.inverse_mass], [p, q, r, mass.inverse_inertia[0]]];
        self.0[usize::from(second)] = row;
    }

    pub(crate) fn velocity(&self, second: bool) -> Velocity {
        let [[x, y, z, _], [p, q, r, _]] = self.0[usize::from(second)];
        Velocity { linear: [x, y, z], angular: [p, q, r] }
    }

    /// Whether a body moves.
    pub(crate) fn moves(&self, second: bool) -> bool {
        self.0[usize::from(second)][0][3] != 0.0
    }
}
