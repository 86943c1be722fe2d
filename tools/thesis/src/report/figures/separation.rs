//! Figure 2.8: two boxes apart and two that touch, with their shadows on the axis between them.

use std::fmt::Write as _;

use crate::experiment::Part;
use crate::figure::Figure;
use crate::index::{Origin, Row};

/// A box in the plane.
struct Square {
    centre: [f64; 2],
    half: f64,
    angle: f64,
}

impl Square {
    fn corners(&self) -> [[f64; 2]; 4] {
        let (sin, cos) = self.angle.sin_cos();
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| {
            let (x, y) = (x * self.half, y * self.half);
            [self.centre[0] + cos * x - sin * y, self.centre[1] + sin * x + cos * y]
        })
    }

    /// Its shadow on an axis: from, to.
    fn shadow(&self, axis: [f64; 2]) -> (f64, f64) {
        self.corners()
            .iter()
            .map(|[x, y]| x * axis[0] + y * axis[1])
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), place| {
                (low.min(place), high.max(place))
            })
    }

    fn axes(&self) -> [[f64; 2]; 2] {
        let (sin, cos) = self.angle.sin_cos();
        [[cos, sin], [-sin, cos]]
    }
}

/// The gap between both shadows on the axis where it is largest; below 0 they overlap on every axis.
fn widest(a: &Square, b: &Square) -> ([f64; 2], f64) {
    let gap = |axis: [f64; 2]| {
        let (a, b) = (a.shadow(axis), b.shadow(axis));
        (b.0 - a.1).max(a.0 - b.1)
    };
    let mut best = (a.axes()[0], gap(a.axes()[0]));
    for axis in a.axes().into_iter().chain(b.axes()) {
        if gap(axis) > best.1 {
            best = (axis, gap(axis));
        }
    }
    best
}

/// Draws a pair around the point `at`.
fn pair(text: &mut String, a: &Square, b: &Square, at: [f64; 2], name: &str) {
    let place = |p: [f64; 2]| format!("{:.1},{:.1}", at[0] + p[0], at[1] - p[1]);
    let (axis, gap) = widest(a, b);
    let across = [-axis[1], axis[0]];
    // The axis of the shadows lies below the boxes.
    let offset = -120.0 * if across[1] > 0.0 { 1.0 } else { -1.0 };
    let on_axis =
        |t: f64| place([t * axis[0] + offset * across[0], t * axis[1] + offset * across[1]]);
    let _ = writeln!(
        text,
        "<polyline points=\"{} {}\" fill=\"none\" stroke=\"currentColor\"/>",
        on_axis(-190.0),
        on_axis(190.0)
    );
    for (square, colour) in [(a, "#0072B2"), (b, "#E69F00")] {
        let corners = square.corners().map(place).join(" ");
        let _ = writeln!(
            text,
            "<polygon points=\"{corners}\" fill=\"{colour}\" fill-opacity=\"0.35\" stroke=\"{colour}\" \
             stroke-width=\"2\"/>"
        );
        let (from, to) = square.shadow(axis);
        let _ = writeln!(
            text,
            "<polyline points=\"{} {}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"7\" \
             stroke-opacity=\"0.7\"/>",
            on_axis(from),
            on_axis(to)
        );
    }
    if gap > 0.0 {
        let middle = {
            let (low, high) = (a.shadow(axis), b.shadow(axis));
            if low.1 < high.0 { (low.1 + high.0) / 2.0 } else { (high.1 + low.0) / 2.0 }
        };
        let on_plane =
            |t: f64| place([middle * axis[0] + t * across[0], middle * axis[1] + t * across[1]]);
        let _ = writeln!(
            text,
            "<polyline points=\"{} {}\" fill=\"none\" stroke=\"#D55E00\" stroke-dasharray=\"7 5\" \
             stroke-width=\"2\"/>",
            on_plane(-140.0),
            on_plane(140.0)
        );
    }
    let _ = writeln!(
        text,
        "<text x=\"{}\" y=\"405\" text-anchor=\"middle\" fill=\"currentColor\">{name}: gap {:+.0} on the \
         best axis</text>",
        at[0], gap
    );
}

pub(crate) fn part() -> Part {
    let square = |x, y, angle| Square { centre: [x, y], half: 55.0, angle };
    let apart = [square(-85.0, -10.0, 0.35), square(85.0, 25.0, 0.9)];
    let touching = [square(-50.0, -10.0, 0.35), square(50.0, 15.0, 0.9)];
    let mut svg = "<svg viewBox=\"0 0 860 420\" xmlns=\"http://www.w3.org/2000/svg\" \
                   font-family=\"sans-serif\" font-size=\"14\">\n"
        .to_owned();
    pair(&mut svg, &apart[0], &apart[1], [215.0, 185.0], "(A) apart");
    pair(&mut svg, &touching[0], &touching[1], [645.0, 185.0], "(B) intersecting");
    svg.push_str("</svg>\n");
    let gaps = [&apart, &touching].map(|pair| widest(&pair[0], &pair[1]).1);
    let figure = Figure {
        id: "figure-2-8",
        thesis: "§2.2.2, Figure 2.8",
        title: "The separating axis of two convex bodies".to_owned(),
        svg,
        caption: "(A) The shadows of both boxes on the axis do not overlap, and a plane (dashed) \
                  separates the boxes. (B) The shadows overlap on every axis, and the boxes intersect. \
                  Axes are the normals of the faces; in space, the cross products of the edges come on \
                  top."
            .to_owned(),
        origin: Origin::Modelled,
        playback: None,
    };
    let row = Row {
        thesis: figure.thesis.to_owned(),
        subject: "separating axis test".to_owned(),
        recorded: "shadows apart: no collision; overlap on every axis: collision".to_owned(),
        ours: format!(
            "gap {:+.0} (apart), {:+.0} (intersecting), drawn to scale",
            gaps[0], gaps[1]
        ),
        origin: Origin::Modelled,
        command: "pgs thesis --all --out report".to_owned(),
        shown: figure.id.to_owned(),
    };
    Part { figures: vec![figure], rows: vec![row], ..Part::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_apart_have_a_gap_and_boxes_that_intersect_have_none() {
        let at = |x| Square { centre: [x, 0.0], half: 1.0, angle: 0.0 };
        assert!((widest(&at(0.0), &at(3.0)).1 - 1.0).abs() < 1e-12);
        assert!((widest(&at(0.0), &at(1.5)).1 + 0.5).abs() < 1e-12);
    }
}
