//! Draws bodies: one picture of one moment, as PNG.
//!
//! ```
//! use scene::Geometry;
//! use zynq_pgs::{Body, Pose, Velocity};
//! use zynq_pgs_view::picture::{Camera, Picture};
//!
//! let pose = Pose { position: [0.0, 1.0, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] };
//! let bodies = [Body { pose, velocity: Velocity::default(), shape: 0 }];
//! let camera = Camera::around([pose].iter(), 1.8, 1.5);
//! let cubes = Picture::new(&bodies, &[Some(Geometry::CUBE)], camera);
//! let picture = Picture { width: 300, height: 200, ..cubes };
//! assert!(picture.png()?.starts_with(b"\x89PNG"));
//! # Ok::<(), zynq_pgs_view::ViewError>(())
//! ```

mod camera;
mod faces;
mod raster;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use scene::Geometry;
use zynq_pgs::Body;

use self::camera::View;
use self::faces::Surfaces;
use self::raster::{Raster, byte};
use crate::error::ViewError;

pub use self::camera::Camera;

/// Pixels along an axis that are averaged to one.
const FINE: u16 = 2;
/// Colours of the sky from above to the horizon, of the ground, and of its lines.
const SKY: [[f32; 3]; 2] = [[214.0, 224.0, 236.0], [240.0, 243.0, 247.0]];
const GROUND: [f32; 3] = [206.0, 209.0, 213.0];
/// Share of a colour that an outline leaves.
const OUTLINE: f32 = 0.55;

/// Most pixels a side, and in all: the finer picture has four times as many, of 16 bytes each.
const SIDE_MOST: u16 = 16_384;
const PIXELS_MOST: u32 = 1 << 24;

/// A picture to draw.
#[derive(Debug, Clone, Copy)]
pub struct Picture<'a> {
    /// The bodies; one whose shape has no geometry is not drawn.
    pub bodies: &'a [Body],
    /// The geometry of each shape.
    pub geometries: &'a [Option<Geometry>],
    /// Where it is taken from.
    pub camera: Camera,
    /// Pixels across.
    pub width: u16,
    /// Pixels down.
    pub height: u16,
}

impl<'a> Picture<'a> {
    /// Pixels of a picture of the usual size.
    const SIZE: [u16; 2] = [1200, 720];

    /// A picture of the usual size.
    #[must_use]
    pub const fn new(
        bodies: &'a [Body],
        geometries: &'a [Option<Geometry>],
        camera: Camera,
    ) -> Self {
        let [width, height] = Self::SIZE;
        Self { bodies, geometries, camera, width, height }
    }

    /// A picture of the usual size that shows all bodies.
    #[must_use]
    pub fn of_all(bodies: &'a [Body], geometries: &'a [Option<Geometry>]) -> Self {
        let drawn = bodies.iter().filter_map(|body| {
            let geometry = geometries.get(usize::try_from(body.shape).ok()?)?.as_ref()?;
            Some((&body.pose, geometry))
        });
        let radius = drawn.clone().map(|(_, geometry)| geometry.bounding_radius());
        let radius = radius.fold(0.0, |most, radius| if radius > most { radius } else { most });
        let [width, height] = Self::SIZE.map(f32::from);
        let camera = Camera::around(drawn.map(|(pose, _)| pose), radius, width / height);
        Self::new(bodies, geometries, camera)
    }

    /// Refuses a picture without pixels, or with too many.
    fn check(&self) -> Result<(), ViewError> {
        let Self { width, height, .. } = *self;
        let sides = [width, height].iter().all(|length| (1..=SIDE_MOST).contains(length));
        if sides && u32::from(width) * u32::from(height) <= PIXELS_MOST {
            return Ok(());
        }
        Err(ViewError::Size { width, height, side: SIDE_MOST, pixels: PIXELS_MOST })
    }

    /// The picture as PNG.
    ///
    /// # Errors
    /// [`ViewError`]: the picture has no pixels or too many, or a geometry has no surface.
    pub fn png(&self) -> Result<Vec<u8>, ViewError> {
        let pixels = self.pixels()?;
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width.into(), self.height.into());
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        let written = encoder.write_header().and_then(|mut writer| {
            writer.write_image_data(&pixels)?;
            writer.finish()
        });
        written.map_err(ViewError::Png)?;
        Ok(bytes)
    }

    /// The same inside of an SVG, for pages that take no other picture.
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

    /// Red, green and blue of each pixel.
    fn pixels(&self) -> Result<Vec<u8>, ViewError> {
        self.check()?;
        let surfaces = Surfaces::of(self.bodies, self.geometries)?;
        let [width, height] = [self.width, self.height].map(|length| length * FINE);
        let view = View::new(self.camera, width, height);
        let mut raster = Raster::new(width, height);
        let mut number = 0;
        surfaces.for_each(&view, |face| {
            number += 1;
            raster.fill(number, &face);
        });
        let side = usize::from(FINE);
        let mut pixels = Vec::with_capacity(3 * usize::from(self.width) * usize::from(self.height));
        for y in 0..usize::from(self.height) {
            for x in 0..usize::from(self.width) {
                let mut sums = [0.0; 3];
                for (i, j) in (0..side).flat_map(|i| (0..side).map(move |j| (i, j))) {
                    let colour = colour(&raster, &view, side * x + i, side * y + j);
                    sums = [0, 1, 2].map(|k: usize| sums[k] + colour[k]);
                }
                let count = f32::from(FINE * FINE);
                // Steps of four shades: the eye sees no difference, the compression does.
                pixels.extend(sums.map(|sum| byte(sum / count) & 0xFC | 2));
            }
        }
        Ok(pixels)
    }
}

/// The colour of a fine pixel.
fn colour(raster: &Raster, view: &View, x: usize, y: usize) -> [f32; 3] {
    let shade = if raster.is_edge(x, y) { OUTLINE } else { 1.0 };
    let colour = match raster.at(x, y) {
        Some(pixel) => pixel.colour.map(f32::from),
        None => behind(raster, view, x, y),
    };
    colour.map(|value| shade * value)
}

/// The colour of the ground or the sky.
fn behind(raster: &Raster, view: &View, x: usize, y: usize) -> [f32; 3] {
    let number = |index: usize| u16::try_from(index).map_or(0.0, f32::from);
    let share = number(y) / number(raster.height).max(1.0);
    let sky = [0, 1, 2].map(|k: usize| (1.0 - share) * SKY[0][k] + share * SKY[1][k]);
    let Some([right, _, towards]) = view.ground(number(x) + 0.5, number(y) + 0.5) else {
        return sky;
    };
    let [eye_right, _, eye_towards] = view.eye();
    let (across, along) = (right - eye_right, towards - eye_towards);
    // The ground fades to the sky with the distance, in units of the eye's height.
    let distance = (across * across + along * along).sqrt() / view.eye()[1];
    let fade = ((distance - 1.5) / 6.0).clamp(0.0, 1.0);
    [0, 1, 2].map(|k: usize| (1.0 - fade) * GROUND[k] + fade * sky[k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::{Scene, ShapesOptions};

    fn scene() -> Scene {
        let grid = "3x2x3".parse().expect("a grid");
        Scene::of_shapes(&ShapesOptions { grid, drop: 0.0, seed: 2 }).expect("a scene")
    }

    #[test]
    fn the_decoded_png_is_the_picture_and_shows_bodies_before_ground_and_sky() {
        let scene = scene();
        let whole = Picture::of_all(scene.bodies(), scene.geometries());
        let picture = Picture { width: 150, height: 90, ..whole };
        let bytes = picture.png().expect("encoded");
        let decoder = png::Decoder::new(std::io::Cursor::new(&bytes));
        let mut reader = decoder.read_info().expect("a header");
        assert_eq!((reader.info().width, reader.info().height), (150, 90));
        let mut pixels = vec![0; 3 * 150 * 90];
        reader.next_frame(&mut pixels).expect("pixels");
        assert_eq!(pixels, picture.pixels().expect("drawn"));
        // Six kinds of bodies in their colours, lit from several sides.
        let colours: std::collections::BTreeSet<&[u8]> = pixels.chunks(3).collect();
        assert!(colours.len() > 100, "{}", colours.len());
        assert_eq!(picture.png().expect("encoded"), bytes);
        let svg = picture.svg().expect("encoded");
        let inside = svg.split("base64,").nth(1).and_then(|text| text.split('"').next());
        assert_eq!(BASE64_STANDARD.decode(inside.expect("a picture")).expect("base64"), bytes);
        assert!(svg.contains("viewBox=\"0 0 150 90\""), "{}", &svg[..80]);
    }

    #[test]
    fn a_picture_without_pixels_or_with_too_many_is_refused() {
        let scene = scene();
        let whole = Picture::of_all(scene.bodies(), scene.geometries());
        for (width, height) in [(0, 720), (1200, 0), (SIDE_MOST + 1, 1), (5000, 5000)] {
            let picture = Picture { width, height, ..whole };
            let said = picture.png().expect_err("png").to_string();
            assert!(said.ends_with(&format!("found {width} by {height}")), "{said}");
        }
    }
}
