//! Integration of one body.
//!
//! ```text
//! w = w * damping;  a = sqrt(dot(w,w));  if a*dt > limit: a = limit / dt     limit = 0.25 * 3.1415925
//! a < 0.001:  h = w * (0.5*dt - ((((dt*dt)*dt) * 0.020833334) * a) * a)
//! otherwise:  h = w * (sin((0.5*a)*dt) / a)
//! r = (h, cos((a*dt)*0.5)) * q;  q = r * (1 / |r|);  p = p + v*dt;  v = v + g*dt
//! ```
//!
//! Numbers that depend on the arguments alone are computed once a step, by the unit `constants`:
//! `half_step` = 0.5*dt, `series` = ((dt*dt)*dt) * 0.020833334, `speed_limit` = limit / dt and the
//! three components of g*dt. A body of inverse mass 0 has a damping of 1 and keeps its velocity; at
//! rest it keeps its pose, too. The arguments of the sine and of the cosine are the same number, for
//! a factor of 0.5 is exact. In binary32 `half_angle_limit` = (`speed_limit`*dt) * 0.5 comes with the
//! other numbers, so that the half angle is there in time, whether the body is too fast or not. In
//! binary16 the factor rounds a subnormal number, which is then its own sine.

use pgs_interface::number::Precision;
use pgs_interface::profile::solver::{ROTATION_LIMIT, SERIES_BELOW};

use crate::graph::{Graph, Operand, Source, Vec3};

/// Below this angle the sine in binary16 is its argument.
const SINE_IS_ARGUMENT_BELOW: f32 = 1.0 / 32.0;

/// The graph of the integration. `integrates` is 0 in a step without integration, where bodies keep
/// their state; `free` is 1 for a body with a mass in a step with integration.
#[must_use]
pub fn integration(precision: Precision) -> Graph {
    let mut graph = Graph::new(precision);
    let g = &mut graph;
    let position = g.input3(Source::Record, "position");
    let orientation = g.input4(Source::Record, "orientation");
    let linear = g.input3(Source::Velocity, "linear");
    let angular = g.input3(Source::Velocity, "angular");
    let damping = g.input(Source::Record, "damping");
    let integrates = g.input(Source::Flag, "integrates");
    let free = g.input(Source::Flag, "free");
    let time_step = g.input(Source::Argument, "time_step");
    let gravity = g.input3(Source::Argument, "gravity_step");

    let damped = g.within("damped", |g| g.scale(angular, damping));
    let rotation = g.within("rotation", |g| rotation(g, damped, time_step));
    let turned = g.within("turned", |g| turned(g, rotation, orientation));

    let way = g.within("way", |g| g.scale(linear, time_step));
    let moved = g.within("moved", |g| g.add3(position, way));
    let fallen = g.within("fallen", |g| g.add3(linear, gravity));
    let moves = g.within("moves", |g| {
        let speeds = linear.0.into_iter().chain(angular.0);
        speeds.fold(free, |moves, speed| {
            let under_way = g.non_zero(integrates, speed);
            g.either(moves, under_way)
        })
    });
    output_if(g, moves, "position", moved.0, position.0);
    output_if(g, moves, "orientation", turned, orientation);
    output_if(g, free, "linear", fallen.0, linear.0);
    output_if(g, free, "angular", damped.0, angular.0);
    graph
}

/// An output: the new values where `changes` is 1, else the old ones.
fn output_if<const N: usize>(
    g: &mut Graph,
    changes: Operand,
    name: &str,
    new: [Operand; N],
    old: [Operand; N],
) {
    let chosen: Vec<_> =
        new.into_iter().zip(old).map(|(new, old)| g.select(changes, new, old)).collect();
    g.output(name, &chosen);
}

/// The rotation of one time step as a quaternion: h, and the cosine of half the angle.
fn rotation(g: &mut Graph, angular: Vec3, time_step: Operand) -> [Operand; 4] {
    let [half_step, series, speed_limit] =
        ["half_step", "series", "speed_limit"].map(|name| g.input(Source::Argument, name));
    let half_angle_limit =
        (g.precision() == Precision::F32).then(|| g.input(Source::Argument, "half_angle_limit"));
    let square = g.dot(angular, angular);
    let speed = g.square_root(square);
    let limit = g.constant(ROTATION_LIMIT);
    let angle = g.multiply(speed, time_step);
    let too_fast = g.less(limit, angle);
    let half = g.constant(0.5);
    let speed = g.select(too_fast, speed_limit, speed);

    let slow_below = g.constant(SERIES_BELOW);
    let slow = g.less(speed, slow_below);
    let term = g.multiply(series, speed);
    let term = g.multiply(term, speed);
    let by_series = g.subtract(half_step, term);

    let (sine, cosine) = match half_angle_limit {
        Some(limit) => {
            let half_angle = g.multiply(angle, half);
            let half_angle = g.select(too_fast, limit, half_angle);
            let [sine, cosine] = g.sine_cosine(half_angle);
            (sine, cosine)
        }
        None => {
            let angle = g.multiply(speed, time_step);
            let half_angle = g.multiply(angle, half);
            let [sine, cosine] = g.sine_cosine(half_angle);
            let half_speed = g.multiply(speed, half);
            let own_angle = g.multiply(half_speed, time_step);
            let is_own_sine = g.constant(SINE_IS_ARGUMENT_BELOW);
            let small = g.less(half_angle, is_own_sine);
            (g.select(small, own_angle, sine), cosine)
        }
    };
    let by_sine = g.divide(sine, speed);
    let scale = g.select(slow, by_series, by_sine);
    let Vec3([x, y, z]) = g.scale(angular, scale);
    [x, y, z, cosine]
}

/// The product of rotation and orientation, normalised.
fn turned(
    g: &mut Graph,
    [x, y, z, c]: [Operand; 4],
    [qx, qy, qz, qw]: [Operand; 4],
) -> [Operand; 4] {
    let mut sum = |terms: [(Operand, Operand); 4]| {
        let [first, rest @ ..] = terms.map(|(a, b)| g.multiply(a, b));
        rest.into_iter().fold(first, |sum, term| g.add(sum, term))
    };
    let r = [
        sum([(c, qx), (x, qw), (y, qz), (z.negated(), qy)]),
        sum([(c, qy), (y, qw), (z, qx), (x.negated(), qz)]),
        sum([(c, qz), (z, qw), (x, qy), (y.negated(), qx)]),
        sum([(c, qw), (x.negated(), qx), (y.negated(), qy), (z.negated(), qz)]),
    ];
    let square = sum(r.map(|part| (part, part)));
    let length = g.square_root(square);
    let one = g.constant(1.0);
    let scale = g.divide(one, length);
    r.map(|part| g.multiply(part, scale))
}
