//! Writes pictures of one size as an animated PNG with 256 colours: a picture of its own for
//! programs that play none, then each moment as its difference from the last.
//!
//! Source: PNG specification (third edition), chunks `PLTE`, `acTL`, `fcTL` and `fdAT`.

use std::collections::HashMap;

use png::{BlendOp, ColorType, Compression, Encoder, EncodingError, Filter};

use crate::error::ViewError;

/// A picture: red, green and blue of each pixel.
pub(super) type Pixels = Vec<[u8; 3]>;

/// A picture, and the seconds that it stays.
pub(super) type Moment = (Pixels, f32);

/// The index of a pixel that stays as it was, and the number of colours beside it.
const SAME: u8 = 0;
const COLOURS: usize = 255;

/// The bytes of a picture, and of the moments that play in its place.
///
/// # Errors
/// [`ViewError::Png`] where there are no moments, or the encoder refuses them.
pub(super) fn encode(
    size: (u16, u16),
    still: &Pixels,
    moments: &[Moment],
) -> Result<Vec<u8>, ViewError> {
    encoded(size, still, moments).map_err(ViewError::Png)
}

fn encoded(
    (width, height): (u16, u16),
    still: &Pixels,
    moments: &[Moment],
) -> Result<Vec<u8>, EncodingError> {
    let pictures = || moments.iter().map(|(pixels, _)| pixels).chain([still]);
    let colours = frequent(pictures().flatten());
    let mut known = HashMap::new();
    let mut index =
        |pixel: &[u8; 3]| *known.entry(*pixel).or_insert_with(|| nearest(&colours, *pixel));
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width.into(), height.into());
    encoder.set_color(ColorType::Indexed);
    encoder.set_palette([&[[0; 3]], &colours[..]].concat().concat());
    encoder.set_trns([0].as_slice());
    encoder.set_compression(Compression::High);
    encoder.set_filter(Filter::NoFilter);
    encoder.set_animated(number(moments.len()), 0)?;
    encoder.set_sep_def_img(true)?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&still.iter().map(&mut index).collect::<Vec<u8>>())?;
    writer.set_blend_op(BlendOp::Over)?;
    let (width, mut last) = (usize::from(width), Vec::new());
    for (pixels, seconds) in moments {
        let now: Vec<u8> = pixels.iter().map(&mut index).collect();
        let is_new = |place: &usize| last.get(*place) != now.get(*place);
        // The smallest rectangle around all pixels that change; one pixel if none does.
        let ends = |all: &mut dyn Iterator<Item = usize>| {
            all.fold(None, |ends: Option<(usize, usize)>, at| {
                let (low, high) = ends.unwrap_or((at, at));
                Some((low.min(at), high.max(at)))
            })
        };
        let changed = || (0..now.len()).filter(is_new);
        let (left, right) = ends(&mut changed().map(|place| place % width)).unwrap_or_default();
        let (top, bottom) = ends(&mut changed().map(|place| place / width)).unwrap_or_default();
        writer.reset_frame_position()?;
        writer.set_frame_dimension(number(right + 1 - left), number(bottom + 1 - top))?;
        writer.set_frame_position(number(left), number(top))?;
        writer.set_frame_delay(milliseconds(*seconds), 1000)?;
        let places = (top..=bottom).flat_map(|y| (left..=right).map(move |x| y * width + x));
        let new = |place: usize| if is_new(&place) { now[place] } else { SAME };
        writer.write_image_data(&places.map(new).collect::<Vec<u8>>())?;
        last = now;
    }
    writer.finish()?;
    Ok(bytes)
}

/// The most frequent colours.
fn frequent<'a>(pixels: impl Iterator<Item = &'a [u8; 3]>) -> Vec<[u8; 3]> {
    let mut counts: HashMap<[u8; 3], u64> = HashMap::new();
    pixels.for_each(|pixel| *counts.entry(*pixel).or_default() += 1);
    let mut all: Vec<_> = counts.into_iter().map(|(colour, count)| (count, colour)).collect();
    // The order of a hash map decides nothing: no two colours are equal.
    all.sort_unstable_by(|one, other| other.cmp(one));
    all.into_iter().map(|(_, colour)| colour).take(COLOURS).collect()
}

/// The index of the nearest colour, behind the one of a pixel that stays.
fn nearest(colours: &[[u8; 3]], wanted: [u8; 3]) -> u8 {
    let away = |colour: &[u8; 3]| {
        let part = |k: usize| u32::from(colour[k].abs_diff(wanted[k])).pow(2);
        (part(0) + part(1)) + part(2)
    };
    let places = colours.iter().map(away).zip(1..=u8::MAX);
    places.min().map_or(SAME, |(_, index)| index)
}

fn number(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

/// A time of at least a millisecond, and of less than a minute.
fn milliseconds(seconds: f32) -> u16 {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the value is between 1 and 60,000, and a NaN becomes 0"
    )]
    let whole = (1000.0 * seconds).round().clamp(1.0, 60_000.0) as u16;
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    const SIZE: (u16, u16) = (4, 3);

    /// A picture of one colour, with another at one place.
    fn picture(place: usize, colour: [u8; 3]) -> Pixels {
        let mut pixels = vec![[200, 210, 220]; 12];
        pixels[place] = colour;
        pixels
    }

    #[test]
    fn a_program_that_plays_none_shows_the_still_and_one_that_plays_only_the_changes() {
        let red = [250, 10, 20];
        let moments = [(picture(1, red), 0.1), (picture(6, red), 0.25), (picture(6, red), 1.5)];
        let bytes = encode(SIZE, &picture(11, red), &moments).expect("encoded");
        let mut decoder = png::Decoder::new(Cursor::new(&bytes));
        decoder.set_transformations(png::Transformations::EXPAND);
        let mut reader = decoder.read_info().expect("a header");
        let animation = reader.info().animation_control.expect("it moves");
        assert_eq!((animation.num_frames, animation.num_plays), (3, 0), "for ever");
        let mut buffer = vec![0; 4 * 12];
        let mut shown: Vec<[u8; 4]> = Vec::new();
        reader.next_frame(&mut buffer).expect("the still");
        assert_eq!(buffer[4 * 11..], [250, 10, 20, 255]);
        for (index, (expected, seconds)) in moments.iter().enumerate() {
            reader.next_frame(&mut buffer).expect("a moment");
            let control = *reader.info().frame_control().expect("its control");
            assert_eq!(control.delay_num, milliseconds(*seconds));
            shown.resize(12, [0; 4]);
            let (width, height) = (control.width as usize, control.height as usize);
            // The second has the rectangle around the places 1 and 6, the third has no change.
            assert_eq!((width, height), [(4, 3), (2, 2), (1, 1)][index]);
            for (place, pixel) in buffer.chunks(4).take(width * height).enumerate() {
                let y = control.y_offset as usize + place / width;
                let x = control.x_offset as usize + place % width;
                if pixel[3] > 0 {
                    shown[4 * y + x] = [pixel[0], pixel[1], pixel[2], pixel[3]];
                }
            }
            let colours: Pixels = shown.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
            assert_eq!(colours, *expected, "{index}");
        }
    }

    #[test]
    fn rare_colours_become_the_nearest_frequent_one() {
        let grey = |k: usize| [u8::try_from(k).expect("a byte"); 3];
        let mut pixels: Pixels = (0..256).flat_map(|k| [grey(k), grey(k)]).collect();
        pixels.push([9, 9, 10]);
        let found = frequent(pixels.iter());
        assert_eq!(found.len(), COLOURS);
        assert_eq!(found[usize::from(nearest(&found, [9, 9, 10])) - 1], [9, 9, 9]);
        assert!(!found.contains(&[9, 9, 10]));
    }

    #[test]
    fn no_moment_is_an_error() {
        assert!(matches!(encode(SIZE, &picture(0, [0; 3]), &[]), Err(ViewError::Png(_))));
    }
}
