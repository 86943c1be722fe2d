//! Draws bodies: one picture of one moment, or one that moves, as PNG.
//!
//! ```
//! use scene::Geometry;
//! use zynq_pgs::{Body, Pose, Velocity};
//! use zynq_pgs_view::Recording;
//! use zynq_pgs_view::picture::Picture;
//!
//! let pose = Pose { position: [0.0, 1.0, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] };
//! let bodies = [Body { pose, velocity: Velocity::default(), shape: 0 }];
//! let mut recording = Recording::new(&bodies, &[Some(Geometry::CUBE)]);
//! recording.add(0, 0.0, &bodies)?;
//! let picture = Picture { width: 300, height: 200, ..Picture::of(&recording) };
//! assert!(picture.png()?.starts_with(b"\x89PNG"));
//! # Ok::<(), zynq_pgs_view::ViewError>(())
//! ```

mod backdrop;
mod camera;
mod faces;
mod legend;
mod moving;
mod raster;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;

use self::backdrop::{backdrop, spacing};
use self::camera::View;
use self::faces::Surfaces;
use self::legend::Canvas;
use self::moving::Pixels;
use self::raster::{Raster, byte};
use crate::error::ViewError;
use crate::recording::{Frame, Recording};

pub use self::camera::Camera;

/// Pixels along an axis that are averaged to one.
const FINE: u16 = 2;
/// Share of a colour that an outline leaves, and one that the darkest shadow leaves.
const OUTLINE: f32 = 0.55;
const SHADOW: f32 = 0.62;

/// Seconds that the last moment of a moving picture stays.
const END: f32 = 1.5;

/// Most pixels a side, and in all: each has four finer ones of 32 bytes.
const SIDE_MOST: u16 = 16_384;
const PIXELS_MOST: u32 = 1 << 23;

/// A picture to draw.
#[derive(Debug, Clone, Copy)]
pub struct Picture<'a> {
    /// The bodies at their moments. Bodies of one kind have the colour of their height at the first.
    pub recording: &'a Recording,
    /// Where it is taken from.
    pub camera: Camera,
    /// Pixels across.
    pub width: u16,
    /// Pixels down.
    pub height: u16,
}

/// The parts of a picture that all moments share.
struct Stage<'a> {
    surfaces: Surfaces<'a>,
    view: View,
    backdrop: Vec<[f32; 3]>,
}

impl<'a> Picture<'a> {
    /// Pixels of a still picture, and of one that moves.
    const STILL: [u16; 2] = [1200, 720];
    const MOVING: [u16; 2] = [640, 360];

    /// A picture of the usual size that shows all bodies of the last frame.
    #[must_use]
    pub fn of(recording: &'a Recording) -> Self {
        let last = recording.frames().len().saturating_sub(1);
        Self::around(recording, last, Self::STILL)
    }

    /// A smaller one that shows all bodies of the frames from the middle on.
    #[must_use]
    pub fn moving(recording: &'a Recording) -> Self {
        Self::around(recording, recording.frames().len() / 2, Self::MOVING)
    }

    fn around(recording: &'a Recording, first: usize, [width, height]: [u16; 2]) -> Self {
        let radii = recording.geometries().iter().map(|geometry| geometry.bounding_radius());
        let radius = radii.fold(0.0, |most, radius| if radius > most { radius } else { most });
        let poses = recording.frames().iter().skip(first).flat_map(|frame| &frame.poses);
        let aspect = f32::from(width) / f32::from(height);
        Self { recording, camera: Camera::around(poses, radius, aspect), width, height }
    }

    /// Refuses a picture without pixels, with too many, or from a place that is not finite.
    fn check(&self) -> Result<(), ViewError> {
        let Self { width, height, camera: Camera { eye, target }, .. } = *self;
        if !eye.iter().chain(&target).all(|value| value.is_finite()) {
            return Err(ViewError::Camera { eye, target });
        }
        let sides = [width, height].iter().all(|length| (1..=SIDE_MOST).contains(length));
        if sides && u32::from(width) * u32::from(height) <= PIXELS_MOST {
            return Ok(());
        }
        Err(ViewError::Size { width, height, side: SIDE_MOST, pixels: PIXELS_MOST })
    }

    /// The last frame as PNG.
    ///
    /// # Errors
    /// [`ViewError`]: the picture has no pixels or too many, its camera is not finite, or a geometry
    /// has no surface.
    pub fn png(&self) -> Result<Vec<u8>, ViewError> {
        let pixels = self.pixels(&self.stage()?, self.recording.frames().last(), None);
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width.into(), self.height.into());
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        let written = encoder.write_header().and_then(|mut writer| {
            writer.write_image_data(pixels.as_flattened())?;
            writer.finish()
        });
        written.map_err(ViewError::Png)?;
        Ok(bytes)
    }

    /// All frames as an animated PNG, at the speed of the simulated time; a program that plays none
    /// shows the last.
    ///
    /// # Errors
    /// As for [`png`](Self::png).
    pub fn apng(&self) -> Result<Vec<u8>, ViewError> {
        let (stage, frames) = (self.stage()?, self.recording.frames());
        let still = self.pixels(&stage, frames.last(), None);
        let ends = frames.iter().skip(1).map(|next| next.time);
        let ends = ends.chain(frames.last().map(|last| last.time + END));
        let moment = |(frame, end): (&Frame, f32)| {
            (self.pixels(&stage, Some(frame), Some(frame.time)), end - frame.time)
        };
        let moments: Vec<_> = frames.iter().zip(ends).map(moment).collect();
        moving::encode((self.width, self.height), &still, &moments)
    }

    /// The last frame inside of an SVG, for pages that take no other picture.
    ///
    /// # Errors
    /// As for [`png`](Self::png).
    pub fn svg(&self) -> Result<String, ViewError> {
        let (png, Self { width, height, .. }) = (BASE64_STANDARD.encode(self.png()?), *self);
        Ok(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\"><image \
             width=\"{width}\" height=\"{height}\" href=\"data:image/png;base64,{png}\"/></svg>\n"
        ))
    }

    fn stage(&self) -> Result<Stage<'a>, ViewError> {
        self.check()?;
        let surfaces = Surfaces::of(self.recording)?;
        let [width, height] = [self.width, self.height].map(|length| length * FINE);
        let view = View::new(self.camera, width, height);
        Ok(Stage { surfaces, view, backdrop: backdrop(&view, width, height) })
    }

    /// The pixels of a frame, with a legend, and with the time of one that moves.
    fn pixels(&self, stage: &Stage, frame: Option<&Frame>, time: Option<f32>) -> Pixels {
        let Stage { surfaces, view, backdrop } = stage;
        let mut raster = Raster::new(self.width * FINE, self.height * FINE);
        if let Some(frame) = frame {
            let mut number = 0;
            surfaces.for_each(frame, view, |face| {
                number += 1;
                raster.fill(number, &face);
            });
            surfaces.shadows(frame, view, |corners, darkness| raster.darken(corners, darkness));
        }
        let (side, width) = (usize::from(FINE), usize::from(self.width));
        let mut pixels = Vec::with_capacity(width * usize::from(self.height));
        for (y, x) in (0..usize::from(self.height)).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let mut sums = [0.0; 3];
            for (i, j) in (0..side).flat_map(|i| (0..side).map(move |j| (i, j))) {
                let colour = colour(&raster, backdrop, side * x + i, side * y + j);
                sums = [0, 1, 2].map(|k: usize| sums[k] + colour[k]);
            }
            pixels.push(sums.map(|sum| sum / f32::from(FINE * FINE)));
        }
        let mut canvas = Canvas { width, pixels: &mut pixels };
        canvas.legend(self.recording.geometries(), spacing(view));
        time.into_iter().for_each(|time| canvas.time(time));
        // Steps of four shades: the eye sees no difference, the compression does.
        pixels.iter().map(|pixel| pixel.map(|part| byte(part) & 0xFC | 2)).collect()
    }
}

/// The colour of a fine pixel.
fn colour(raster: &Raster, backdrop: &[[f32; 3]], x: usize, y: usize) -> [f32; 3] {
    let outline = if raster.is_edge(x, y) { OUTLINE } else { 1.0 };
    let (colour, shade) = match raster.at(x, y) {
        Some(pixel) => (pixel.colour.map(f32::from), outline),
        None => {
            let shadow = 1.0 - (1.0 - SHADOW) * raster.shadow(x, y);
            (backdrop[y * raster.width + x], outline * shadow)
        }
    };
    colour.map(|value| shade * value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::fixture;
    use scene::Geometry;
    use std::collections::BTreeSet;
    use std::io::Cursor;
    use zynq_pgs::{Body, Pose, Velocity};

    #[test]
    fn the_decoded_png_is_the_picture_and_shows_bodies_before_ground_and_sky() {
        let recording = fixture(1);
        let picture = Picture { width: 150, height: 90, ..Picture::of(&recording) };
        let bytes = picture.png().expect("encoded");
        let mut reader = png::Decoder::new(Cursor::new(&bytes)).read_info().expect("a header");
        assert_eq!((reader.info().width, reader.info().height), (150, 90));
        let mut pixels = vec![0; 3 * 150 * 90];
        reader.next_frame(&mut pixels).expect("pixels");
        let stage = picture.stage().expect("surfaces");
        let drawn = picture.pixels(&stage, recording.frames().last(), None);
        assert_eq!(pixels, drawn.as_flattened());
        // Six kinds of bodies in their colours, lit from several sides.
        let colours: BTreeSet<&[u8]> = pixels.chunks(3).collect();
        assert!(colours.len() > 100, "{}", colours.len());
        assert_eq!(picture.png().expect("encoded"), bytes);
        let svg = picture.svg().expect("encoded");
        let inside = svg.split("base64,").nth(1).and_then(|text| text.split('"').next());
        assert_eq!(BASE64_STANDARD.decode(inside.expect("a picture")).expect("base64"), bytes);
        assert!(svg.contains("viewBox=\"0 0 150 90\""), "{}", &svg[..80]);
    }

    #[test]
    fn bodies_on_the_ground_darken_it_beside_them() {
        let recording = fixture(1);
        let picture = Picture { width: 150, height: 90, ..Picture::of(&recording) };
        let stage = picture.stage().expect("surfaces");
        let with = picture.pixels(&stage, recording.frames().last(), None);
        let none = picture.pixels(&stage, None, None);
        let sum = |pixel: &[u8; 3]| pixel.map(u32::from).iter().sum::<u32>();
        let is_grey = |pixel: &[u8; 3]| pixel[0].abs_diff(pixel[2]) < 16;
        let darker = with
            .iter()
            .zip(&none)
            .filter(|(with, none)| is_grey(with) && is_grey(none) && sum(with) + 60 < sum(none));
        assert!(darker.count() > 100, "shadows");
    }

    #[test]
    fn a_picture_without_pixels_or_with_too_many_is_refused() {
        let recording = fixture(1);
        for (width, height) in [(0, 720), (1200, 0), (SIDE_MOST + 1, 1), (5000, 5000)] {
            let picture = Picture { width, height, ..Picture::of(&recording) };
            for found in [picture.png(), picture.apng()] {
                let said = found.expect_err("no picture").to_string();
                assert!(said.ends_with(&format!("found {width} by {height}")), "{said}");
            }
        }
    }

    #[test]
    fn a_camera_that_is_not_finite_is_refused() {
        let recording = fixture(1);
        let picture = Picture { width: 15, height: 9, ..Picture::of(&recording) };
        let camera = picture.camera;
        for camera in [
            Camera { eye: [f32::NAN, 1.0, 0.0], ..camera },
            Camera { target: [0.0, f32::NEG_INFINITY, 0.0], ..camera },
        ] {
            let refused = Picture { camera, ..picture }.png();
            assert!(matches!(refused, Err(ViewError::Camera { .. })), "{refused:?}");
        }
    }

    #[test]
    fn a_body_however_far_away_becomes_a_picture_or_a_refusal() {
        for power in 0..39_u8 {
            let far = libm::powf(10.0, power.into());
            for position in [[far, 0.0, 0.0], [0.0, far, 0.0], [far; 3], [-far, far, 1.0]] {
                let pose = Pose { position, orientation: [0.0, 0.0, 0.0, 1.0] };
                let bodies = [Body { pose, velocity: Velocity::default(), shape: 0 }];
                let mut recording = Recording::new(&bodies, &[Some(Geometry::CUBE)]);
                recording.add(0, 0.0, &bodies).expect("a finite pose");
                let picture = Picture { width: 15, height: 9, ..Picture::of(&recording) };
                let drawn = picture.png();
                let is_refused = matches!(drawn, Err(ViewError::Camera { .. }));
                assert!(drawn.is_ok() || is_refused, "{position:?}");
            }
        }
    }
}
