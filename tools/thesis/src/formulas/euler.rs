//! Figure 2.6: a fall of ten seconds by explicit Euler.

use crate::estimate::thesis::euler::{ACCELERATION, SECONDS, exact, explicit, explicit_single};

use super::scene::{Scene, difference};
use crate::experiment::Part;
use crate::figure::{Axis, Drawn, Figure, Series, lines};
use crate::table::{Cell, Kind, Table, text};

pub(super) fn tables(_: &Scene) -> Vec<Table> {
    let mut table = Table::new("euler", "Position after 10 s at 10 m/s², m (Figure 2.6)");
    for (name, ours, thesis) in [
        ("explicit Euler, dt = 1 s", explicit(1), 450.0),
        ("explicit Euler, dt = 1/100 s", explicit(100), 499.49),
        ("the same in single precision", explicit_single(100).into(), 499.49),
        ("exact", exact(), 500.0),
    ] {
        table.row([
            ("integration", "integration", text(name)),
            ("metres", "ours", Cell::Number(ours, 3)),
            ("thesis", "thesis", Cell::Number(thesis, 2)),
            ("difference_percent", "difference", difference(ours, thesis)),
            ("kind", "kind", Kind::Exact.cell()),
        ]);
    }
    table.note(
        "a dt² n (n - 1) / 2 is 499.500 m for dt = 1/100 s; the thesis prints the first digits of \
        the single-precision result.",
    );
    vec![table]
}

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

/// The fall by both rules beside the exact one.
pub(super) fn figures(part: &mut Part) {
    let [explicit_1, symplectic_1] = falls(1);
    let [explicit_100, _] = falls(100);
    let line = |time: u32| (f64::from(time), 0.5 * ACCELERATION * f64::from(time).powi(2));
    let series = [
        Series::new("explicit Euler, dt = 1 s", Drawn::Marked, explicit_1),
        Series::new("symplectic Euler, dt = 1 s", Drawn::Marked, symplectic_1),
        Series::new("explicit Euler, dt = 1/100 s", Drawn::Line, explicit_100),
        Series::new("exact", Drawn::Dashes, (0..=SECONDS).map(line).collect()),
    ];
    let figure = Figure::new(
        ("figure-2-6", "§2.1.3, Figure 2.6"),
        "Position of a falling body with different time steps",
        lines(Axis::linear("time, s"), Axis::linear("position, m"), &series),
        "The acceleration is 10 m/s². The explicit rule moves a body by the speed at the start of \
         a step, the symplectic rule by the speed at its end: their errors are equal and opposite. \
         The board moves a body before gravity adds to its speed, which is the explicit rule for a \
         body in free flight.",
    )
    .modelled();
    let row = figure.row(
        "position after 10 s: dt = 1 s, dt = 1/100 s, exact",
        "450 m, 499.49 m, 500 m",
        format!("{:.0} m, {:.2} m, {:.0} m", explicit(1), explicit(100), exact()),
    );
    part.figure(figure, [row]);
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
