//! Writes the number of live bodies in each slot, as a table or as a picture.
//!
//! The picture shows the maximum of each of a few hundred ranges of slots, on a logarithmic axis:
//! orders differ by two powers of ten.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use step_folder::replace::replace;
use zynq_pgs::order::{IssueWindow, live_curve};

use super::rows::Measured;
use super::source::Source;
use crate::failure::Failure;
use crate::output::files::unwritten;

/// Parses the path of a table or a picture, which its extension tells apart.
pub(super) fn path(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match is_picture(&path) {
        Some(_) => Ok(path),
        None => Err("expected a file that ends with .csv or .svg".to_owned()),
    }
}

fn is_picture(path: &Path) -> Option<bool> {
    match path.extension()?.to_str()? {
        "svg" => Some(true),
        "csv" => Some(false),
        _ => None,
    }
}

/// The live bodies in each slot of one order.
struct Curve {
    name: String,
    alive: Vec<u32>,
}

/// Writes the curves of all orders.
pub(super) fn write(
    path: &Path,
    source: &Source,
    measured: &Measured,
    window: IssueWindow,
) -> Result<(), Failure> {
    let curves = measured.last.iter().map(|(name, schedule)| {
        let alive = live_curve(schedule, &source.input(), window)?;
        Ok(Curve { name: name.clone(), alive })
    });
    let curves = curves.collect::<Result<Vec<_>, _>>().map_err(super::refused)?;
    let text = match is_picture(path) {
        Some(true) => picture(&curves, window),
        _ => table(&curves),
    };
    replace(path, |file| file.write_all(text.as_bytes())).map_err(unwritten)
}

/// One line a slot, one column an order; empty where an order has no such slot.
fn table(curves: &[Curve]) -> String {
    let mut text = "slot".to_owned();
    for curve in curves {
        text.push(',');
        text.push_str(&curve.name.replace(',', ""));
    }
    text.push('\n');
    let slots = curves.iter().map(|curve| curve.alive.len()).max().unwrap_or(0);
    for slot in 0..slots {
        text.push_str(&slot.to_string());
        for curve in curves {
            text.push(',');
            if let Some(alive) = curve.alive.get(slot) {
                text.push_str(&alive.to_string());
            }
        }
        text.push('\n');
    }
    text
}

const WIDTH: usize = 800;
const HEIGHT: f64 = 400.0;
/// Space for the numbers at the left and below.
const MARGIN: f64 = 50.0;
/// Space for the names at the right.
const NAMES: f64 = 190.0;
/// Colours that colour-blind people can tell apart (Okabe and Ito).
const COLOURS: [&str; 8] =
    ["#000000", "#999999", "#56B4E9", "#E69F00", "#F0E442", "#D55E00", "#CC79A7", "#009E73"];

/// A chart of all curves.
fn picture(curves: &[Curve], window: IssueWindow) -> String {
    let slots = curves.iter().map(|curve| curve.alive.len()).max().unwrap_or(0).max(1);
    let most = curves.iter().flat_map(|curve| &curve.alive).copied().max().unwrap_or(1);
    let mut decades = 1;
    while 10_u32.checked_pow(decades).is_some_and(|power| power < most) {
        decades += 1;
    }
    // A whole number of decades; the lowest line is one body.
    let y = |alive: u32| {
        let up = f64::from(alive.max(1)).log10() / f64::from(decades);
        20.0 + HEIGHT * (1.0 - up)
    };
    let (width, bottom) = (MARGIN + WIDTH as f64, HEIGHT + 20.0);
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n",
        width + NAMES,
        bottom + MARGIN,
    );
    for decade in 0..=decades {
        let level = y(10_u32.saturating_pow(decade));
        let _ = writeln!(
            text,
            "<path d=\"M{MARGIN} {level:.1}H{width}\" stroke=\"#dddddd\"/>\
             <text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            MARGIN - 6.0,
            level + 4.0,
            10_u32.saturating_pow(decade),
        );
    }
    let _ = writeln!(
        text,
        "<text x=\"{MARGIN}\" y=\"{}\">bodies alive, by issue slot 0 to {slots} \
         (depth {} slots)</text>",
        bottom + 25.0,
        window.depth(),
    );
    for (place, (curve, colour)) in curves.iter().zip(COLOURS.iter().cycle()).enumerate() {
        let mut line = String::new();
        for column in 0..WIDTH {
            let from = column * slots / WIDTH;
            let to = ((column + 1) * slots / WIDTH).max(from + 1).min(curve.alive.len());
            let Some(range) = curve.alive.get(from..to) else { break };
            let Some(alive) = range.iter().copied().max() else { break };
            let _ = write!(line, "{:.1},{:.1} ", MARGIN + column as f64, y(alive));
        }
        let (name, level) = (&curve.name, 40.0 + 18.0 * place as f64);
        let (mark, text_at) = (width + 10.0, width + 40.0);
        let _ = writeln!(
            text,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\"/>\n\
             <path d=\"M{mark} {level}h24\" stroke=\"{colour}\" stroke-width=\"3\"/>\
             <text x=\"{text_at}\" y=\"{}\">{name}</text>",
            line.trim_end(),
            level + 4.0,
        );
    }
    text.push_str("</svg>\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curves() -> [Curve; 2] {
        let curve = |name: &str, alive: &[u32]| Curve { name: name.into(), alive: alive.into() };
        [curve("as given", &[1, 2, 30]), curve("thesis, oldest", &[1, 1])]
    }

    #[test]
    fn a_table_has_a_line_a_slot() {
        assert_eq!(table(&curves()), "slot,as given,thesis oldest\n0,1,1\n1,2,1\n2,30,\n");
    }

    #[test]
    fn a_picture_has_a_line_an_order_and_a_level_a_decade() {
        let text = picture(&curves(), IssueWindow::new(16, 1).expect("a window"));
        assert_eq!(text.matches("<polyline").count(), 2);
        for level in [">1<", ">10<", ">100<"] {
            assert!(text.contains(level), "{level}");
        }
        assert!(!text.contains(">1000<"));
        // 30 on two decades: log10(30) / 2 = 0.7386 up from the bottom at 420.
        assert!(text.contains("849.0,124.6"), "{text}");
    }

    #[test]
    fn other_files_than_tables_and_pictures_are_refused() {
        assert!(path("a/live.csv").is_ok() && path("live.svg").is_ok());
        assert!(path("live").is_err() && path("live.png").is_err());
    }
}
