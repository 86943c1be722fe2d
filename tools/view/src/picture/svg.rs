//! Writes a picture as SVG: the faces that are seen, the farthest first.

use std::fmt::Write as _;

use super::Picture;
use super::camera::View;
use super::faces::{Face, Surfaces};
use super::raster::{Raster, byte};
use crate::error::ViewError;

/// Pixels of a face that make it seen.
const SEEN: u32 = 3;
/// Units of a coordinate in a pixel.
const UNITS: u16 = 2;

impl Picture<'_> {
    /// The picture as SVG.
    ///
    /// Hidden faces are left out. The others are painted from far to near, which is exact for
    /// bodies that do not intersect much.
    ///
    /// # Errors
    /// [`ViewError`]: the picture has no pixels or too many, or a geometry has no surface.
    pub fn svg(&self) -> Result<String, ViewError> {
        self.check()?;
        let surfaces = Surfaces::of(self.bodies, self.geometries)?;
        let [width, height] = [self.width, self.height].map(|length| length.saturating_mul(UNITS));
        let view = View::new(self.camera, width, height);
        let mut raster = Raster::new(width, height);
        let mut seen: Vec<Face> = Vec::new();
        let mut number = 0;
        // The first time all faces are drawn, the second time the seen ones are kept.
        surfaces.for_each(&view, |face| {
            number += 1;
            raster.fill(number, &face);
        });
        let mut counts = vec![0_u32; 1 + usize::try_from(number).unwrap_or(0)];
        for pixel in raster.covered() {
            counts[pixel.face as usize] += 1;
        }
        let mut counts = counts.into_iter().skip(1);
        surfaces.for_each(&view, |face| {
            if counts.next().is_some_and(|count| count >= SEEN) {
                seen.push(face);
            }
        });
        seen.sort_by(|one, other| depth(one).total_cmp(&depth(other)));

        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
             stroke-linejoin=\"round\">\n<path fill=\"#dfe3e8\" d=\"M0 0H{width}V{height}H0z\"/>\n",
        );
        for face in &seen {
            path(&mut text, face);
        }
        text.push_str("</svg>\n");
        Ok(text)
    }
}

/// The mean of the corners' inverse distances: small is far.
fn depth(face: &Face) -> f32 {
    let sum = face.corners.iter().fold(0.0, |sum, corner| sum + corner[2]);
    let count = u16::try_from(face.corners.len()).map_or(1.0, f32::from);
    sum / count
}

/// Adds a face: its outline in whole units, relative to the last corner.
fn path(text: &mut String, face: &Face) {
    let count = u16::try_from(face.colours.len()).map_or(1.0, f32::from);
    let mean = [0, 1, 2].map(|k: usize| {
        let sum = face.colours.iter().fold(0.0, |sum, colour| sum + colour[k]);
        byte(sum / count)
    });
    let is_flat = face.colours.iter().all(|colour| colour.map(byte) == mean);
    // Flat faces have an outline; the parts of a round one join without.
    let share = if is_flat { 0.6 } else { 1.0 };
    let [r, g, b] = mean;
    let [sr, sg, sb] = mean.map(|value| byte(share * f32::from(value)));
    let _ = write!(
        text,
        "<path fill=\"#{r:02x}{g:02x}{b:02x}\" stroke=\"#{sr:02x}{sg:02x}{sb:02x}\" d=\""
    );
    let mut last = [0, 0];
    for (index, corner) in face.corners.iter().enumerate() {
        let [x, y] = [unit(corner[0]), unit(corner[1])];
        let [dx, dy] = [x - last[0], y - last[1]];
        let letter = if index == 0 { "M" } else { "l" };
        let space = if dy < 0 { "" } else { " " };
        let _ = write!(text, "{letter}{dx}{space}{dy}");
        last = [x, y];
    }
    text.push_str("z\"/>\n");
}

/// The nearest whole unit.
fn unit(value: f32) -> i32 {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "a number beyond the picture becomes its end"
    )]
    let whole = (value + 0.5).floor().clamp(-1e6, 1e6) as i32;
    whole
}

#[cfg(test)]
mod tests {
    use crate::picture::Picture;
    use scene::{Scene, SceneOptions};

    #[test]
    fn hidden_faces_are_left_out_and_near_ones_come_last() {
        let grid = "5x5x5".parse().expect("a grid");
        let options = SceneOptions { grid, drop: 0.0, ..SceneOptions::default() };
        let scene = Scene::new(&options).expect("a scene");
        let picture = Picture::of_all(scene.bodies(), scene.geometries());
        let text = picture.svg().expect("drawn");
        let faces = text.matches("<path").count() - 1;
        // Three sides of 25 faces, and faces that show through the gaps.
        assert!((75..250).contains(&faces), "{faces}");
        assert!(
            text.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 2400 1440\"")
        );
        assert!(text.ends_with("z\"/>\n</svg>\n"));
        assert_eq!(text, picture.svg().expect("drawn"));
    }
}
