//! A constraint row, and an impulse along it: the part that contact and friction share.
//!
//! ```text
//! row(t, rA, rB):  aA = cross(rA, t)   aB = -cross(rB, t)
//!                  J = -1 / (((mA + dot(aA*KA, aA)) + mB) + dot(aB*KB, aB))
//!                  e = ((dot(t,vA) + dot(aA,wA)) + dot(-t,vB)) + dot(aB,wB)
//! v*K = (v.x*K, v.y*K, v.z*K), or with world inertia
//!       ((xx*v.x + xy*v.y) + xz*v.z, (xy*v.x + yy*v.y) + yz*v.z, (xz*v.x + yz*v.y) + zz*v.z)
//! apply(row, l):   vA += (t*mA)*l   wA += (aA*KA)*l   vB += ((-t)*mB)*l   wB += (aB*KB)*l
//! ```

use pgs_interface::profile::Inertia;

use crate::graph::{Graph, Operand, Source, Symmetric, Vec3};

/// Inverse inertia K of a body.
#[derive(Debug, Clone, Copy)]
enum InverseInertia {
    /// The same about every axis.
    Number(Operand),
    /// About world axes.
    Matrix(Symmetric),
}

impl InverseInertia {
    fn new(graph: &mut Graph, side: &str, inertia: Inertia) -> Self {
        let name = format!("inverse_inertia_{side}");
        match inertia {
            Inertia::Isotropic => Self::Number(graph.input(Source::Record, &name)),
            Inertia::World => Self::Matrix(graph.input_symmetric(Source::Record, &name)),
        }
    }

    /// v*K
    fn times(self, graph: &mut Graph, v: Vec3) -> Vec3 {
        match self {
            Self::Number(number) => graph.scale(v, number),
            Self::Matrix(matrix) => graph.times(v, matrix),
        }
    }
}

/// Inverse mass m and inverse inertia K of a body.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mass {
    inverse_mass: Operand,
    inverse_inertia: InverseInertia,
}

/// Velocities of a body while a collision is being solved.
#[derive(Debug, Clone, Copy)]
pub(super) struct Velocity {
    pub(super) linear: Vec3,
    pub(super) angular: Vec3,
}

/// Bodies A and B of the collision.
pub(super) const SIDES: [&str; 2] = ["a", "b"];

/// The inputs of the mass properties of both bodies.
pub(super) fn masses(graph: &mut Graph, inertia: Inertia) -> [Mass; 2] {
    SIDES.map(|side| Mass {
        inverse_mass: graph.input(Source::Record, &format!("inverse_mass_{side}")),
        inverse_inertia: InverseInertia::new(graph, side, inertia),
    })
}

/// The inputs of the velocities of both bodies.
pub(super) fn velocities(graph: &mut Graph) -> [Velocity; 2] {
    SIDES.map(|side| Velocity {
        linear: graph.input3(Source::Velocity, &format!("linear_{side}")),
        angular: graph.input3(Source::Velocity, &format!("angular_{side}")),
    })
}

/// Puts an impulse out: 0 where a row does not act.
pub(super) fn output_impulse(graph: &mut Graph, name: &str, impulse: Operand, acts: Operand) {
    let zero = graph.constant(0.0);
    let impulse = graph.select(acts, impulse, zero);
    graph.output(name, &[impulse]);
}

/// The outputs of the velocities of both bodies.
pub(super) fn output_velocities(graph: &mut Graph, velocities: [Velocity; 2]) {
    for (side, velocity) in SIDES.into_iter().zip(velocities) {
        graph.output(&format!("linear_{side}"), &velocity.linear.0);
        graph.output(&format!("angular_{side}"), &velocity.angular.0);
    }
}

/// A constraint row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row {
    direction: Vec3,
    /// aA and aB.
    moments: [Vec3; 2],
    /// aA*KA and aB*KB.
    turned: [Vec3; 2],
    /// J, the negative effective mass.
    pub(super) jacobian: Operand,
}

impl Row {
    /// The row along `direction` with the lever arms rA and rB.
    pub(super) fn new(
        graph: &mut Graph,
        direction: Vec3,
        arms: [Vec3; 2],
        masses: [Mass; 2],
    ) -> Self {
        graph.within("row", |graph| {
            let moment_a = graph.cross(arms[0], direction);
            let moment_b = graph.cross(arms[1], direction).negated();
            let moments = [moment_a, moment_b];
            let turned = [0, 1].map(|i| masses[i].inverse_inertia.times(graph, moments[i]));
            let [spin_a, spin_b] = [0, 1].map(|i| graph.dot(turned[i], moments[i]));
            let sum = graph.add(masses[0].inverse_mass, spin_a);
            let sum = graph.add(sum, masses[1].inverse_mass);
            let sum = graph.add(sum, spin_b);
            let one = graph.constant(1.0);
            let jacobian = graph.divide(one.negated(), sum);
            Self { direction, moments, turned, jacobian }
        })
    }

    /// e, the relative velocity along the row.
    pub(super) fn speed(&self, graph: &mut Graph, [a, b]: &[Velocity; 2]) -> Operand {
        graph.within("speed", |graph| {
            let linear_a = graph.dot(self.direction, a.linear);
            let angular_a = graph.dot(self.moments[0], a.angular);
            let linear_b = graph.dot(self.direction.negated(), b.linear);
            let angular_b = graph.dot(self.moments[1], b.angular);
            let speed = graph.add(linear_a, angular_a);
            let speed = graph.add(speed, linear_b);
            graph.add(speed, angular_b)
        })
    }

    /// The velocities after an impulse l along the row, where `acts` is 1; else unchanged.
    pub(super) fn apply(
        &self,
        graph: &mut Graph,
        impulse: Operand,
        acts: Operand,
        velocities: [Velocity; 2],
        masses: [Mass; 2],
    ) -> [Velocity; 2] {
        let directions = [self.direction, self.direction.negated()];
        [0, 1].map(|i| {
            graph.within(&format!("apply_{}", SIDES[i]), |graph| {
                let push = graph.scale(directions[i], masses[i].inverse_mass);
                let push = graph.scale(push, impulse).only_if(acts);
                let turn = graph.scale(self.turned[i], impulse).only_if(acts);
                Velocity {
                    linear: graph.add3(velocities[i].linear, push),
                    angular: graph.add3(velocities[i].angular, turn),
                }
            })
        })
    }
}
