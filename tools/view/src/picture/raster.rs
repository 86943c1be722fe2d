//! Fills faces pixel by pixel, the nearest on top.

use super::faces::Face;

/// A picture under construction, row by row from above.
#[derive(Debug)]
pub(super) struct Raster {
    pub(super) width: usize,
    pub(super) height: usize,
    pixels: Vec<Pixel>,
    /// How dark the ground is at each pixel, from 0 to 1.
    shadow: Vec<f32>,
}

/// The nearest face at a pixel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pixel {
    /// The inverse of its distance; 0 without a face.
    inverse: f32,
    /// The number of the face, from 1.
    pub(super) face: u32,
    pub(super) body: u32,
    pub(super) colour: [u8; 3],
}

/// Neighbours of one body belong together, unless the distance jumps by more than this share.
const JUMP: f32 = 0.02;

impl Raster {
    pub(super) fn new(width: u16, height: u16) -> Self {
        let (width, height) = (usize::from(width), usize::from(height));
        let empty = Pixel { inverse: 0.0, face: 0, body: 0, colour: [0; 3] };
        let count = width * height;
        Self { width, height, pixels: vec![empty; count], shadow: vec![0.0; count] }
    }

    /// The pixel, if a face covers it.
    pub(super) fn at(&self, x: usize, y: usize) -> Option<&Pixel> {
        self.pixels.get(y * self.width + x).filter(|pixel| pixel.face > 0)
    }

    /// Whether an outline runs between this pixel and the one to the right or below.
    pub(super) fn is_edge(&self, x: usize, y: usize) -> bool {
        let here = self.at(x, y);
        let differs = |there: Option<&Pixel>| match (here, there) {
            (Some(here), Some(there)) => {
                let apart = (here.inverse - there.inverse).abs() > JUMP * here.inverse;
                here.body != there.body
                    || apart
                    || here.face != there.face && is_crease(here, there)
            }
            (here, there) => here.is_some() != there.is_some(),
        };
        (x + 1 < self.width && differs(self.at(x + 1, y)))
            || (y + 1 < self.height && differs(self.at(x, y + 1)))
    }

    /// Draws a face under its number, from 1.
    pub(super) fn fill(&mut self, number: u32, face: &Face) {
        let Self { width, height, pixels, .. } = self;
        for k in 2..face.corners.len() {
            let [a, b, c] = [0, k - 1, k].map(|index| face.corners[index]);
            let [ca, cb, cc] = [0, k - 1, k].map(|index| face.colours[index]);
            Self::cover([a, b, c], (*width, *height), |place, [wa, wb, wc]| {
                let inverse = (wa * a[2] + wb * b[2]) + wc * c[2];
                let pixel = &mut pixels[place];
                if inverse > pixel.inverse {
                    let colour =
                        [0, 1, 2].map(|k: usize| byte((wa * ca[k] + wb * cb[k]) + wc * cc[k]));
                    *pixel = Pixel { inverse, face: number, body: face.body, colour };
                }
            });
        }
    }

    /// Darkens the ground within these corners.
    pub(super) fn darken(&mut self, corners: &[[f32; 3]], darkness: f32) {
        let Self { width, height, shadow, .. } = self;
        for pair in corners.get(1..).unwrap_or_default().windows(2) {
            let corners = [corners[0], pair[0], pair[1]];
            Self::cover(corners, (*width, *height), |place, _| {
                shadow[place] = if darkness > shadow[place] { darkness } else { shadow[place] };
            });
        }
    }

    /// How dark the ground is at a pixel, from 0 to 1.
    pub(super) fn shadow(&self, x: usize, y: usize) -> f32 {
        self.shadow[y * self.width + x]
    }

    /// Calls `draw` with each pixel of a triangle, and the shares of its corners there.
    fn cover(
        [a, b, c]: [[f32; 3]; 3],
        (width, height): (usize, usize),
        mut draw: impl FnMut(usize, [f32; 3]),
    ) {
        let area = twice_area(a, b, c);
        // The corners run counter-clockwise from outside; with y downwards their area is negative.
        if area >= 0.0 || !area.is_finite() {
            return;
        }
        let columns = Self::span([a[0], b[0], c[0]], width);
        for y in Self::span([a[1], b[1], c[1]], height) {
            for x in columns.clone() {
                let middle = [centre(x), centre(y), 0.0];
                let wa = twice_area(b, c, middle) / area;
                let wb = twice_area(c, a, middle) / area;
                let wc = twice_area(a, b, middle) / area;
                if wa >= 0.0 && wb >= 0.0 && wc >= 0.0 {
                    draw(y * width + x, [wa, wb, wc]);
                }
            }
        }
    }

    /// The pixels along one axis that a triangle may cover.
    fn span(ends: [f32; 3], length: usize) -> std::ops::Range<usize> {
        let low = ends.into_iter().fold(f32::INFINITY, f32::min);
        let high = ends.into_iter().fold(f32::NEG_INFINITY, f32::max);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a number beyond the picture becomes its nearest end"
        )]
        let index = |value: f32| (value.max(0.0) as usize).min(length);
        index(low)..index(high + 1.0)
    }
}

/// Whether two faces of one body meet at an edge that is seen.
fn is_crease(one: &Pixel, other: &Pixel) -> bool {
    one.colour.iter().zip(other.colour).any(|(one, other)| one.abs_diff(other) > 12)
}

/// The centre of a pixel.
fn centre(index: usize) -> f32 {
    // A picture has at most 65,535 pixels along an axis.
    u16::try_from(index).map_or(f32::INFINITY, f32::from) + 0.5
}

/// A part of a colour from 0 to 255.
pub(super) fn byte(value: f32) -> u8 {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the value is between 0 and 255, and a NaN becomes 0"
    )]
    let byte = (value.clamp(0.0, 255.0) + 0.5) as u8;
    byte
}

/// Twice the area of a triangle, positive where its corners run clockwise on the picture.
fn twice_area(a: [f32; 3], b: [f32; 3], c: [f32; 3]) -> f32 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(body: u32, left: f32, inverse: f32, colour: f32) -> Face {
        let right = left + 4.0;
        let at = [[left, 2.0], [left, 6.0], [right, 6.0], [right, 2.0]];
        let corners = at.map(|[x, y]| [x, y, inverse]).to_vec();
        Face { body, corners, colours: vec![[colour; 3]; 4] }
    }

    fn covered(raster: &Raster) -> usize {
        raster.pixels.iter().filter(|pixel| pixel.face > 0).count()
    }

    #[test]
    fn the_nearer_face_covers_the_other_whatever_the_order() {
        for order in [[0, 1], [1, 0]] {
            let faces = [square(1, 1.0, 0.1, 50.0), square(2, 3.0, 0.2, 200.0)];
            let mut raster = Raster::new(10, 8);
            for index in order {
                raster.fill(u32::try_from(index).expect("small") + 1, &faces[index]);
            }
            assert_eq!(raster.at(2, 3).map(|pixel| pixel.colour), Some([50; 3]));
            assert_eq!(raster.at(4, 3).map(|pixel| (pixel.body, pixel.face)), Some((2, 2)));
            assert!(raster.at(8, 3).is_none() && raster.at(2, 1).is_none());
            assert_eq!(covered(&raster), 16 + 16 - 8);
            assert!(raster.is_edge(2, 3) && raster.is_edge(0, 3) && !raster.is_edge(4, 3));
        }
    }

    #[test]
    fn a_face_beyond_the_picture_and_one_from_behind_are_no_pixels() {
        let mut raster = Raster::new(10, 8);
        raster.fill(1, &square(1, -30.0, 0.1, 50.0));
        raster.fill(1, &square(1, 1e9, 0.1, 50.0));
        raster.fill(1, &square(1, f32::NAN, 0.1, 50.0));
        let mut behind = square(1, 1.0, 0.1, 50.0);
        behind.corners.reverse();
        raster.fill(1, &behind);
        assert_eq!(covered(&raster), 0);
    }
}
