//! A contact pass over one collision.
//!
//! ```text
//! contact pass, for each point i in order, with J != 0:
//!   row(n, x_i - pA, x_i - pB);  b = ((d_i + drift) * coefficient) * (1 / dt)
//!   l = (e + b) * J;  u = max(L_i + l, 0);  l = u - L_i;  L_i = u;  apply
//! ```

use pgs_interface::number::Precision;
use pgs_interface::profile::Inertia;

use super::row::{self, Row};
use crate::graph::{Graph, Source};

/// The graph of a contact pass over a collision of at most `points` contact points.
///
/// `used_i` tells whether the collision has point i. The pass also adds the new impulses up, for
/// the friction passes: `((L_0 + L_1) + L_2) + L_3`, in which an unused point counts -0.
///
/// The impulse of a point with J = 0 stays 0 without a gate, because the wanted impulse is a
/// product with J. The impulse of an unused point means nothing, and its flag keeps it from every
/// sum. Where impulses leave the chip, both are put out as 0.
#[must_use]
pub fn contact(precision: Precision, points: usize, inertia: Inertia) -> Graph {
    let mut graph = Graph::new(precision);
    let g = &mut graph;
    let solves = g.input(Source::Switch, "solves");
    let normal = g.input3(Source::Record, "normal");
    let positions = row::SIDES.map(|side| g.input3(Source::Record, &format!("position_{side}")));
    let masses = row::masses(g, inertia);
    let mut velocities = row::velocities(g);
    let [per_second, drift, coefficient] =
        ["per_second", "drift", "coefficient"].map(|name| g.input(Source::Argument, name));
    let zero = g.constant(0.0);

    let mut sum = None;
    for i in 0..points {
        let point = g.input3(Source::Record, &format!("point{i}"));
        let distance = g.input(Source::Record, &format!("distance{i}"));
        let used = g.input(Source::Flag, &format!("used{i}"));
        let before = g.input(Source::Impulse, &format!("impulse{i}"));
        g.within(&format!("point{i}"), |g| {
            let arms = positions.map(|position| g.within("arm", |g| g.subtract3(point, position)));
            let row = Row::new(g, normal, arms, masses);
            let acts = g.non_zero(used, row.jacobian);
            let bias = g.within("bias", |g| {
                let depth = g.add(distance, drift);
                let depth = g.multiply(depth, coefficient);
                g.multiply(depth, per_second)
            });
            let speed = row.speed(g, &velocities);
            let after = g.within("impulse", |g| {
                let speed = g.add(speed, bias);
                let wanted = g.multiply(speed, row.jacobian);
                let after = g.add(before, wanted);
                g.maximum_or(solves, [after, zero], before)
            });
            let change = g.within("impulse", |g| g.subtract(after, before.only_if(solves)));
            velocities = row.apply(g, change, acts, velocities, masses);
            row::output_impulse(g, &format!("impulse{i}"), after, acts);
            let counted = after.only_if(acts);
            sum = Some(match sum {
                None => after,
                Some(so_far) => g.within("total", |g| g.add(so_far, counted)),
            });
        });
    }
    if let Some(sum) = sum {
        g.output("total", &[sum]);
    }
    row::output_velocities(g, velocities);
    graph
}
