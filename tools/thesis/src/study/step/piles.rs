//! The picture of the headline: both piles after the last step.

use pgs_command::failure::{Failure, Result};
use scene::Scene;
use zynq_pgs::Body;
use zynq_pgs_view::picture::{Camera, Picture};
use zynq_pgs_view::{Recording, ViewError};

use crate::experiment::PILES;
use crate::figure::Figure;

/// Pixels of a pile in the picture.
const SIZE: [u16; 2] = [600, 400];
/// Its distance, of the distance at which our pile fills the picture.
const AWAY: f32 = 1.7;

/// Both piles after `steps` steps beside each other, with their names, seen from one place: the
/// thesis' design, and ours.
pub(super) fn piles(start: &Scene, steps: u32, ends: [(&str, &[Body]); 2]) -> Result<Figure> {
    let recorded = |(_, bodies): (&str, &[Body])| {
        let mut recording = Recording::new(start.bodies(), start.geometries());
        recording.add(0, 0.0, start.bodies())?;
        recording.add(steps, 1.0, bodies)?;
        Ok(recording)
    };
    let recordings: Result<Vec<_>, ViewError> = ends.into_iter().map(recorded).collect();
    let recordings = recordings.map_err(Failure::input)?;
    let [width, height] = SIZE;
    let near = Picture::of(&recordings[1]).camera;
    let back = |axis: usize| near.target[axis] + AWAY * (near.eye[axis] - near.target[axis]);
    let camera = Camera { eye: [0, 1, 2].map(back), ..near };
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" \
         font-family=\"sans-serif\" font-size=\"18\" text-anchor=\"middle\">\n",
        2 * width,
        height + 30
    );
    for (place, (recording, (name, _))) in (0_u16..).zip(recordings.iter().zip(ends)) {
        let picture = Picture { camera, width, height, ..Picture::of(recording) };
        let inner = picture.svg().map_err(Failure::input)?;
        let left = place * width;
        let size = format!("<svg x=\"{left}\" width=\"{width}\" height=\"{height}\"");
        svg += &inner.replacen("<svg", &size, 1);
        svg += &format!(
            "<text x=\"{}\" y=\"{}\" fill=\"#808080\">{}</text>\n",
            left + width / 2,
            height + 22,
            name
        );
    }
    svg += "</svg>\n";
    let title = format!("The pile after {steps} steps on the emulated boards");
    let caption = "Left the thesis' design as it describes itself, with stale reads; right ours. \
                   Both start from one state and take as long a step.";
    Ok(Figure::new((PILES, "§5.4.4"), title, svg, caption).modelled())
}
