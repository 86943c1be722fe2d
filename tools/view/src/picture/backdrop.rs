//! Sky, ground and the lines on the ground: all of a picture that no body moves.

use super::camera::View;
use super::faces::mixed;

/// Colours of the sky from above to the horizon, of the ground, and of its lines.
const SKY: [[f32; 3]; 2] = [[214.0, 224.0, 236.0], [240.0, 243.0, 247.0]];
const GROUND: [f32; 3] = [212.0, 214.0, 217.0];
const LINE: [f32; 3] = [160.0, 165.0, 172.0];
/// Distance, in heights of the eye, from which the ground fades to the sky, and over which.
const FADE: [f32; 2] = [1.6, 4.0];
/// Width of a line, as a share of the distance between two.
const THICKNESS: f32 = 0.025;

/// The distance between two lines of the ground, m: 1, 2 or 5 times a power of ten, from which the
/// eye sees about twenty.
pub(super) fn spacing(view: &View) -> f32 {
    let wanted = view.distance() / 20.0;
    let powers = (-3_i16..=4).map(|power| libm::powf(10.0, f32::from(power)));
    let mut all = powers.flat_map(|power| [power, 2.0 * power, 5.0 * power]);
    all.find(|spacing| *spacing >= wanted).unwrap_or(wanted)
}

/// The colour of each pixel without bodies, row by row.
pub(super) fn backdrop(view: &View, width: u16, height: u16) -> Vec<[f32; 3]> {
    let spacing = spacing(view);
    let all = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let colour = |(x, y): (u16, u16)| {
        let (x, y) = (f32::from(x) + 0.5, f32::from(y) + 0.5);
        let sky = mixed(y / f32::from(height), SKY[0], SKY[1]);
        // The next pixels tell how much of the ground one pixel shows.
        let places = [[x, y], [x + 1.0, y], [x, y + 1.0]].map(|[x, y]| view.ground(x, y));
        let [Some(here), Some(right), Some(below)] = places else { return sky };
        let line = [0, 2].map(|axis: usize| {
            let pixel = (right[axis] - here[axis]).abs() + (below[axis] - here[axis]).abs();
            let at = here[axis] / spacing;
            covered((at - at.round()).abs() * spacing, THICKNESS * spacing, pixel)
        });
        let line = if line[0] > line[1] { line[0] } else { line[1] };
        let eye = view.eye();
        let (across, along) = (here[0] - eye[0], here[2] - eye[2]);
        let distance = (across * across + along * along).sqrt() / eye[1];
        let fade = ((distance - FADE[0]) / FADE[1]).clamp(0.0, 1.0);
        mixed(fade, mixed(line, GROUND, LINE), sky)
    };
    all.map(colour).collect()
}

/// The share of a pixel that a line covers whose middle is `away` from that of the pixel.
fn covered(away: f32, thickness: f32, pixel: f32) -> f32 {
    let most = if thickness < pixel { thickness } else { pixel };
    let across = 0.5 * (thickness + pixel) - away;
    let across = if across > most { most } else { across };
    if across > 0.0 { across / pixel } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::Camera;

    #[test]
    fn a_pixel_of_a_line_is_dark_and_one_between_two_is_not() {
        assert!((covered(0.0, 0.2, 0.1) - 1.0).abs() < 1e-6, "within the line");
        assert!((covered(0.0, 0.05, 0.1) - 0.5).abs() < 1e-6, "half of the pixel");
        assert!(covered(0.3, 0.2, 0.1).abs() < 1e-6);
    }

    #[test]
    fn lines_are_a_round_number_of_metres_apart() {
        for (away, expected) in [(10.0, 0.5), (19.0, 1.0), (35.0, 2.0), (900.0, 50.0)] {
            let camera = Camera { target: [0.0; 3], eye: [0.0, 0.6 * away, 0.8 * away] };
            let found = spacing(&View::new(camera, 100, 100));
            assert!((found - expected).abs() < 1e-4, "{away}: {found}");
        }
    }

    #[test]
    fn lines_of_the_ground_are_seen_from_above() {
        let camera = Camera { target: [0.0; 3], eye: [0.0, 20.0, 0.1] };
        let pixels = backdrop(&View::new(camera, 200, 200), 200, 200);
        let (middle, between) = (pixels[100 * 200 + 100], pixels[94 * 200 + 94]);
        assert!(middle[0] < GROUND[0] - 10.0, "two lines cross there: {middle:?}");
        assert!((between[0] - GROUND[0]).abs() < 1.0, "{between:?}");
    }
}
