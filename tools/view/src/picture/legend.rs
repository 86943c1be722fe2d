//! The legend of a picture: the colours of the kinds, the grid of the ground, the time.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};
use scene::Geometry;

use super::faces::{HIGH, LOW, mixed};
use crate::kinds::COLOURS;

/// Colour of the letters.
const INK: [f32; 3] = [40.0, 46.0, 56.0];
/// How light the band behind them is.
const PANEL: f32 = 0.9;
/// The letters' size, and the width of each, pixels.
const SIZE: RasterHeight = RasterHeight::Size16;
const LETTER: usize = get_raster_width(FontWeight::Regular, SIZE);
/// Distance from the edge, and between two parts, pixels; and the side of a patch of colour.
const GAP: usize = 12;
const PATCH: usize = 11;

/// A picture under construction: red, green and blue, row by row.
#[derive(Debug)]
pub(super) struct Canvas<'a> {
    pub(super) width: usize,
    pub(super) pixels: &'a mut [[f32; 3]],
}

impl Canvas<'_> {
    /// Mixes a colour into a pixel; does nothing beyond the picture.
    fn mix(&mut self, (x, y): (usize, usize), share: f32, colour: [f32; 3]) {
        let inside = x < self.width;
        let pixel = self.pixels.get_mut(y * self.width + x).filter(|_| inside);
        if let Some(pixel) = pixel {
            *pixel = mixed(share, *pixel, colour);
        }
    }

    /// Writes a line from its upper left; returns where it ends.
    fn write(&mut self, text: &str, (left, top): (usize, usize)) -> usize {
        for (place, letter) in text.chars().enumerate() {
            let Some(raster) = get_raster(letter, FontWeight::Regular, SIZE) else { continue };
            for (y, row) in raster.rows().enumerate() {
                for (x, ink) in row.iter().enumerate() {
                    let at = (left + LETTER * place + x, top + y);
                    self.mix(at, f32::from(*ink) / 255.0, INK);
                }
            }
        }
        left + LETTER * text.chars().count()
    }

    /// A patch of two colours, from left to right, beside a line; returns where it ends.
    fn patch(
        &mut self,
        (left, top): (usize, usize),
        width: usize,
        colours: [[f32; 3]; 2],
    ) -> usize {
        let top = top + (SIZE.val() - PATCH) / 2 + 1;
        let number = |count: usize| u16::try_from(count).map_or(0.0, f32::from);
        for (x, y) in (0..width).flat_map(|x| (0..PATCH).map(move |y| (x, y))) {
            let colour = mixed(number(x) / number(width), colours[0], colours[1]);
            self.mix((left + x, top + y), 1.0, colour);
        }
        left + width
    }

    /// Makes the band behind the letters light.
    fn panel(&mut self) {
        let rows = self.width * (2 * GAP + SIZE.val()).min(self.pixels.len() / self.width.max(1));
        self.pixels[..rows].iter_mut().for_each(|pixel| *pixel = mixed(PANEL, *pixel, [255.0; 3]));
    }

    /// Draws the meaning of the colours of these kinds, and the distance of the ground's lines, m.
    pub(super) fn legend(&mut self, kinds: &[Geometry], spacing: f32) {
        self.panel();
        let mut left = GAP;
        match kinds {
            [] => {}
            [_] => {
                left = self.write("low ", (left, GAP));
                left = self.patch((left, GAP), 5 * PATCH, [LOW, HIGH]);
                left = self.write(" high at the start", (left, GAP)) + GAP;
            }
            _ => {
                for (geometry, colour) in kinds.iter().zip(COLOURS.iter().cycle()) {
                    left = self.patch((left, GAP), PATCH, [*colour; 2]);
                    left = self.write(geometry.name(), (left + LETTER / 2, GAP)) + GAP;
                }
            }
        }
        self.write(&format!("grid {spacing} m"), (left, GAP));
    }

    /// Writes the simulated time, s, at the upper right.
    pub(super) fn time(&mut self, time: f32) {
        let text = format!("{time:.2} s");
        let left = self.width.saturating_sub(GAP + LETTER * text.len());
        self.write(&text, (left, GAP));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: [f32; 3] = [255.0; 3];

    #[test]
    fn a_legend_has_a_patch_of_each_kind_and_dark_letters() {
        let mut pixels = vec![WHITE; 400 * 40];
        let kinds = [Geometry::CUBE, Geometry::Sphere { radius: 1.0 }];
        Canvas { width: 400, pixels: &mut pixels }.legend(&kinds, 2.0);
        for (kind, colour) in COLOURS.iter().enumerate() {
            let is_near = |pixel: &&[f32; 3]| (0..3).all(|k| (pixel[k] - colour[k]).abs() < 0.1);
            let count = pixels.iter().filter(is_near).count();
            assert_eq!(count, if kind < 2 { PATCH * PATCH } else { 0 }, "{kind}");
        }
        assert!(pixels.iter().filter(|pixel| pixel[0] < 60.0).count() > 50, "letters");
    }

    #[test]
    fn letters_beyond_the_edge_do_not_come_back_at_the_other() {
        let mut pixels = vec![WHITE; 40 * 60];
        Canvas { width: 40, pixels: &mut pixels }.legend(&[Geometry::CUBE], 1.0);
        let left = pixels.chunks(40).filter(|row| row[..GAP].iter().any(|pixel| *pixel != WHITE));
        assert_eq!(left.count(), 0);
    }
}
