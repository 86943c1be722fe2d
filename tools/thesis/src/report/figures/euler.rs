//! Figure 2.6: a fall by explicit and symplectic Euler beside the exact one.

use crate::estimate::thesis::euler::{ACCELERATION, SECONDS, exact, explicit};

use crate::experiment::Part;
use crate::figure::Figure;
use crate::figure::{Axis, Drawn, Series, lines};
use crate::index::{Origin, Row};
use pgs_command::failure::Failure;

/// The fall, second by second or finer: positions by both rules.
fn falls(steps_per_second: u32) -> [Vec<(f64, f64)>; 2] {
    let dt = 1.0 / f64::from(steps_per_second);
    let (mut late, mut early, mut speed) = (0.0, 0.0, 0.0);
    let mut falls = [vec![(0.0, 0.0)], vec![(0.0, 0.0)]];
    for step in 1..=SECONDS * steps_per_second {
        late += speed * dt;
        speed += ACCELERATION * dt;
        early += speed * dt;
        let time = f64::from(step) * dt;
        falls[0].push((time, late));
        falls[1].push((time, early));
    }
    falls
}

pub(crate) fn part() -> Result<Part, Failure> {
    let [explicit_1, symplectic_1] = falls(1);
    let [explicit_100, _] = falls(100);
    let ends = (explicit(1), explicit(100), exact());
    let line = |time: u32| (f64::from(time), 0.5 * ACCELERATION * f64::from(time).powi(2));
    let series = [
        Series::new("explicit Euler, dt = 1 s", Drawn::Marked, explicit_1),
        Series::new("symplectic Euler, dt = 1 s", Drawn::Marked, symplectic_1),
        Series::new("explicit Euler, dt = 1/100 s", Drawn::Line, explicit_100),
        Series::new("exact", Drawn::Dashes, (0..=SECONDS).map(line).collect()),
    ];
    let figure = Figure {
        id: "figure-2-6",
        thesis: "§2.1.3, Figure 2.6",
        title: "Position of a falling body with different time steps".to_owned(),
        svg: lines(Axis::linear("time, s"), Axis::linear("position, m"), &series),
        caption: "The acceleration is 10 m/s². The explicit rule moves a body by the speed at the \
                  start of a step, the symplectic rule by the speed at its end: their errors are equal \
                  and opposite. The board moves a body before gravity adds to its speed, which is the \
                  explicit rule for a body in free flight."
            .to_owned(),
        origin: Origin::Modelled,
        playback: None,
    };
    let row = Row {
        thesis: figure.thesis.to_owned(),
        subject: "position after 10 s: dt = 1 s, dt = 1/100 s, exact".to_owned(),
        recorded: "450 m, 499.49 m, 500 m".to_owned(),
        ours: format!("{:.0} m, {:.2} m, {:.0} m", ends.0, ends.1, ends.2),
        origin: Origin::Modelled,
        command: "pgs thesis euler".to_owned(),
        shown: figure.id.to_owned(),
    };
    Ok(Part { figures: vec![figure], rows: vec![row], ..Part::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rules_are_equally_far_from_the_exact_fall() {
        let [late, early] = falls(1);
        let end = |fall: &[(f64, f64)]| fall.last().expect("an end").1;
        assert!((end(&late) - 450.0).abs() < 1e-9 && (end(&early) - 550.0).abs() < 1e-9);
        assert!((end(&late) - explicit(1)).abs() < 1e-9);
    }
}
