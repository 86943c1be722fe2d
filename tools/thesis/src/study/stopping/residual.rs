//! The residual of a step's contact problem, in f64, from the velocities and impulses that a board
//! gave.
//!
//! With L an impulse, m the effective mass and e + b the speed along its row, a solved row has `L =
//! clamp(L - m (e + b))` within the row's bounds: 0 and infinity for a contact, the friction of its
//! contacts for a tangent. The residual is the difference of both sides over m, which is a speed.
//! For a contact it is `min(L / m, e + b)`, the residual of the complementarity problem (thesis,
//! equation 2.19).
//!
//! Source: `bitstream-model/README.md`, the formulae of both passes.

use zynq_pgs::{Body, Collision, Impulses, Shape, StepParameters};

/// Beyond this z the tangents of a normal are made from y and z.
const TANGENT_Z: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The sizes of a residual over all of its rows, m/s.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Residual {
    pub(crate) largest: f64,
    pub(crate) rms: f64,
}

/// Both kinds of residual.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Residuals {
    pub(crate) contact: Residual,
    pub(crate) friction: Residual,
}

/// One row of the problem.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub(super) collision: usize,
    /// The contact point, or behind them the tangent.
    pub(super) part: Part,
    bodies: [usize; 2],
    direction: [f64; 3],
    moments: [[f64; 3]; 2],
    pub(super) mass: f64,
    bias: f64,
}

/// The direction of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Part {
    /// The normal, at this point.
    Point(usize),
    /// This tangent, at the centre of the points.
    Tangent(usize),
}

/// The rows of a step, and the friction of its contacts.
#[derive(Debug)]
pub(super) struct Problem {
    pub(super) rows: Vec<Row>,
    friction: f64,
}

/// The mass properties of a body.
#[derive(Debug, Clone, Copy, Default)]
struct Mass {
    inverse_mass: f64,
    inverse_inertia: [f64; 3],
}

impl Problem {
    /// The problem of a step whose bodies have isotropic inertia; collisions of missing bodies or
    /// shapes, which no board takes, have no rows.
    pub(super) fn new(
        bodies: &[Body],
        shapes: &[Shape],
        collisions: &[Collision],
        parameters: &StepParameters,
    ) -> Self {
        let mut rows = Vec::new();
        for (number, collision) in collisions.iter().enumerate() {
            let found =
                [collision.body_a, collision.body_b].map(|body| place(body, bodies, shapes));
            if let [Some(a), Some(b)] = found {
                add_rows(&mut rows, number, collision, [a, b], parameters);
            }
        }
        Self { rows, friction: parameters.friction.into() }
    }

    /// The residuals of a state.
    pub(super) fn residuals(&self, bodies: &[Body], impulses: &[Impulses]) -> Residuals {
        let (mut contact, mut friction) = (Sum::default(), Sum::default());
        for row in &self.rows {
            let of = impulses.get(row.collision).copied().unwrap_or(Impulses::ZERO);
            let speed = row.speed(bodies) + row.bias;
            match row.part {
                Part::Point(point) => {
                    let other = f64::from(of.normal[point]) / row.mass;
                    contact.add(if speed < other { speed } else { other });
                }
                Part::Tangent(tangent) => {
                    let sum = of.normal.iter().fold(0.0, |sum, impulse| sum + f64::from(*impulse));
                    let limit = self.friction * sum;
                    let impulse = f64::from(of.friction[tangent]);
                    let wanted = impulse - row.mass * speed;
                    friction.add((impulse - wanted.max(-limit).min(limit)) / row.mass);
                }
            }
        }
        Residuals { contact: contact.residual(), friction: friction.residual() }
    }
}

impl Row {
    /// Relative speed along the row, m/s.
    fn speed(&self, bodies: &[Body]) -> f64 {
        let of = |side: usize, sign: f64| {
            bodies.get(self.bodies[side]).map_or(0.0, |body| {
                sign * dot(self.direction, body.velocity.linear.map(f64::from))
                    + dot(self.moments[side], body.velocity.angular.map(f64::from))
            })
        };
        of(0, 1.0) + of(1, -1.0)
    }

    /// The impulse of the row.
    pub(super) fn impulse(&self, impulses: &[Impulses]) -> f64 {
        let of = impulses.get(self.collision).copied().unwrap_or(Impulses::ZERO);
        match self.part {
            Part::Point(point) => of.normal[point].into(),
            Part::Tangent(tangent) => of.friction[tangent].into(),
        }
    }
}

/// A body's place in the array, its position and its mass properties.
fn place(body: u32, bodies: &[Body], shapes: &[Shape]) -> Option<(usize, [f64; 3], Mass)> {
    let index = usize::try_from(body).ok()?;
    let body = bodies.get(index)?;
    let shape = shapes.get(usize::try_from(body.shape).ok()?)?;
    let mass = Mass {
        inverse_mass: shape.inverse_mass.into(),
        inverse_inertia: shape.inverse_inertia.map(f64::from),
    };
    Some((index, body.pose.position.map(f64::from), mass))
}

fn add_rows(
    rows: &mut Vec<Row>,
    number: usize,
    collision: &Collision,
    [a, b]: [(usize, [f64; 3], Mass); 2],
    parameters: &StepParameters,
) {
    let row = |part, at: [f64; 3], direction: [f64; 3], bias| {
        let moments =
            [cross(minus(at, a.1), direction), cross(minus(at, b.1), direction).map(|m| -m)];
        let of = |mass: Mass, moment: [f64; 3]| {
            let turned = [0, 1, 2].map(|k| mass.inverse_inertia[k] * moment[k]);
            mass.inverse_mass + dot(turned, moment)
        };
        let denominator = of(a.2, moments[0]) + of(b.2, moments[1]);
        let bodies = [a.0, b.0];
        Row { collision: number, part, bodies, direction, moments, mass: 1.0 / denominator, bias }
    };
    let normal = collision.normal.map(f64::from);
    let count = usize::try_from(collision.count).unwrap_or(0);
    let used: Vec<_> = collision.contacts.iter().take(count).collect();
    let StepParameters { position_drift, position_coefficient, time_step, .. } = *parameters;
    let mut centre = [0.0; 3];
    for (point, contact) in used.iter().enumerate() {
        let at = contact.point.map(f64::from);
        let removed = f64::from(contact.distance) + f64::from(position_drift);
        let bias = removed * f64::from(position_coefficient) / f64::from(time_step);
        rows.push(row(Part::Point(point), at, normal, bias));
        centre = [0, 1, 2].map(|k| centre[k] + at[k] / used.len() as f64);
    }
    if !used.is_empty() {
        for (tangent, direction) in tangents(normal.map(|n| -n)).into_iter().enumerate() {
            rows.push(row(Part::Tangent(tangent), centre, direction, 0.0));
        }
    }
}

fn tangents(n: [f64; 3]) -> [[f64; 3]; 2] {
    if n[2].abs() > TANGENT_Z {
        let square = n[1] * n[1] + n[2] * n[2];
        let k = 1.0 / square.sqrt();
        let first = [0.0, -n[2] * k, n[1] * k];
        [first, [square * k, -n[0] * first[2], n[0] * first[1]]]
    } else {
        let square = n[0] * n[0] + n[1] * n[1];
        let k = 1.0 / square.sqrt();
        let first = [-n[1] * k, n[0] * k, 0.0];
        [first, [-n[2] * first[1], n[2] * first[0], square * k]]
    }
}

/// The sum of a residual's rows.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    rows: u64,
    squares: f64,
    largest: f64,
}

impl Sum {
    fn add(&mut self, value: f64) {
        self.rows += 1;
        self.squares += value * value;
        if value.abs() > self.largest {
            self.largest = value.abs();
        }
    }

    fn residual(self) -> Residual {
        let rms = (self.squares / (self.rows as f64).max(1.0)).sqrt();
        Residual { largest: self.largest, rms }
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use zynq_pgs::{Contact, Pose, Velocity};

    use super::*;

    /// A body of 1 kg above the ground, with one contact below its centre.
    fn problem(down: f32, sideways: f32) -> (Vec<Body>, Problem) {
        let at = |y, shape, linear| Body {
            pose: Pose { position: [0.0, y, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] },
            velocity: Velocity { linear, angular: [0.0; 3] },
            shape,
        };
        let bodies = vec![at(-1.0, 0, [0.0; 3]), at(1.0, 1, [sideways, -down, 0.0])];
        let shapes = [Shape::STATIC, Shape::isotropic(1.0, 1.5)];
        // The drift cancels the distance: no bias.
        let contact = Contact { point: [0.0; 3], distance: -0.005 };
        let contacts = [contact, Contact::default(), Contact::default(), Contact::default()];
        let pair = Collision { body_a: 0, body_b: 1, normal: [0.0, -1.0, 0.0], count: 1, contacts };
        let problem = Problem::new(&bodies, &shapes, &[pair], &StepParameters::thesis());
        (bodies, problem)
    }

    fn impulse(normal: f32, friction: [f32; 2]) -> [Impulses; 1] {
        [Impulses { normal: [normal, 0.0, 0.0, 0.0], friction }]
    }

    #[test]
    fn a_body_that_falls_into_the_ground_has_its_speed_as_residual() {
        let (bodies, problem) = problem(2.0, 0.0);
        let unsolved = problem.residuals(&bodies, &impulse(0.0, [0.0; 2]));
        assert!((unsolved.contact.largest - 2.0).abs() < 1e-6, "{unsolved:?}");
    }

    #[test]
    fn an_impulse_on_a_body_at_rest_is_a_solution_and_on_one_that_leaves_is_not() {
        let (bodies, resting) = problem(0.0, 0.0);
        let solved = resting.residuals(&bodies, &impulse(3.0, [0.0; 2]));
        assert!(solved.contact.largest < 1e-7 && solved.friction.largest < 1e-7, "{solved:?}");
        let (bodies, leaving) = problem(-2.0, 0.0);
        let pulled = leaving.residuals(&bodies, &impulse(3.0, [0.0; 2]));
        assert!((pulled.contact.largest - 2.0).abs() < 1e-6, "{pulled:?}");
    }

    /// By hand: effective mass 1 / (1 + 1.5) = 0.4 kg at an arm of 1 m, and friction 0.7.
    #[test]
    fn sliding_is_a_solution_at_the_limit_of_friction() {
        let (bodies, problem) = problem(0.0, 5.0);
        let free = problem.residuals(&bodies, &impulse(1.0, [0.0; 2]));
        assert!((free.friction.largest - 0.7 / 0.4).abs() < 1e-6, "{free:?}");
        let limits = [[0.7, 0.0], [-0.7, 0.0], [0.0, 0.7], [0.0, -0.7]];
        let least = limits
            .map(|friction| problem.residuals(&bodies, &impulse(1.0, friction)).friction.largest)
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        assert!(least < 1e-6, "{least}");
    }
}
