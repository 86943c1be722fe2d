//! Charts as SVG text. Their ink takes the colour of the text around it, light or dark.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::failure::{Cause, Failure};

/// Size of a chart, in the units of its view box.
const SIZE: (u32, u32) = (860, 430);
/// Colours that stand for the page's own: plotters writes them, and [`themed`] replaces them.
const INK: RGBColor = RGBColor(1, 2, 3);
const GRID: RGBColor = RGBColor(4, 5, 6);
/// Colours that colour-blind people can tell apart (Okabe and Ito), on light and on dark.
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(230, 159, 0),
    RGBColor(0, 158, 115),
    RGBColor(213, 94, 0),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
];
/// Units of the view box beside the bars: the axis with its numbers, and the margins.
const BESIDE_BARS: u32 = 66 + 2 * 8;
/// Size of the numbers at the axes.
const SMALL: i32 = 13;

/// How an axis is divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scale {
    Linear,
    /// By powers of ten; numbers at or below 0 are left out.
    Log,
}

/// An axis with its caption.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axis<'a> {
    pub(super) caption: &'a str,
    pub(super) scale: Scale,
}

impl<'a> Axis<'a> {
    pub(super) const fn linear(caption: &'a str) -> Self {
        Self { caption, scale: Scale::Linear }
    }

    pub(super) const fn log(caption: &'a str) -> Self {
        Self { caption, scale: Scale::Log }
    }

    /// The place of a number on the axis.
    fn place(self, value: f64) -> Option<f64> {
        let place = match self.scale {
            Scale::Linear => value,
            Scale::Log if value > 0.0 => value.log10(),
            Scale::Log => return None,
        };
        place.is_finite().then_some(place)
    }

    /// The range that shows all places: whole decades of a logarithmic axis, and 0 on a linear one.
    fn range(self, places: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
        let ends = places.fold(None, |ends: Option<(f64, f64)>, place| {
            Some(ends.map_or((place, place), |(low, high)| (low.min(place), high.max(place))))
        });
        let (low, high) = ends.unwrap_or((0.0, 1.0));
        match self.scale {
            Scale::Log => low.floor()..high.ceil().max(low.floor() + 1.0),
            Scale::Linear if high <= low.min(0.0) => low.min(0.0)..1.0,
            Scale::Linear => low.min(0.0)..high * 1.05,
        }
    }

    /// The number at a place, as written at the axis.
    fn label(self, place: f64) -> String {
        let value = match self.scale {
            Scale::Log => 10_f64.powf(place),
            Scale::Linear => place,
        };
        let size = value.abs();
        match size {
            _ if self.scale == Scale::Log && (place - place.round()).abs() > 1e-6 => String::new(),
            _ if size == 0.0 => "0".to_owned(),
            _ if !(1e-3..1e6).contains(&size) => format!("{value:.0e}"),
            _ if size >= 10.0 => format!("{value:.0}"),
            _ => {
                let text = format!("{value:.3}");
                text.trim_end_matches('0').trim_end_matches('.').to_owned()
            }
        }
    }

    /// About how many numbers stand at the axis.
    fn labels(self, range: &std::ops::Range<f64>) -> usize {
        match self.scale {
            // One a decade, as long as a label has room.
            Scale::Log => {
                (1..=14).take_while(|k| f64::from(*k) <= range.end - range.start + 1.0).count()
            }
            Scale::Linear => 8,
        }
    }
}

/// A series of a chart.
#[derive(Debug, Clone)]
pub(super) struct Series {
    pub(super) name: String,
    pub(super) points: Vec<(f64, f64)>,
    pub(super) drawn: Drawn,
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Drawn {
    Line,
    /// A line in dashes: an exact or a recorded one.
    Dashes,
    /// A dot a point.
    Dots,
    /// A line with a dot a point.
    Marked,
}

impl Series {
    pub(super) fn new(name: impl Into<String>, drawn: Drawn, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), points, drawn }
    }
}

fn failed(error: impl std::fmt::Display) -> Failure {
    Failure::new(Cause::Output, format!("a chart cannot be drawn: {error}"))
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// A chart of lines and dots.
pub(super) fn lines(x: Axis<'_>, y: Axis<'_>, series: &[Series]) -> Result<String, Failure> {
    let places: Vec<Vec<(f64, f64)>> = series
        .iter()
        .map(|series| {
            series.points.iter().filter_map(|&(a, b)| Some((x.place(a)?, y.place(b)?))).collect()
        })
        .collect();
    let all = || places.iter().flatten();
    let across = x.range(all().map(|place| place.0));
    let up = y.range(all().map(|place| place.1));
    let names: Vec<&str> = series.iter().map(|series| series.name.as_str()).collect();
    draw(&names, |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(8)
            .x_label_area_size(48)
            .y_label_area_size(76)
            .build_cartesian_2d(across.clone(), up.clone())
            .map_err(failed)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID)
            .axis_style(INK)
            .x_desc(x.caption)
            .y_desc(y.caption)
            .x_labels(x.labels(&across))
            .y_labels(y.labels(&up))
            .x_label_formatter(&|place| x.label(*place))
            .y_label_formatter(&|place| y.label(*place))
            .label_style(("sans-serif", SMALL, &INK))
            .axis_desc_style(("sans-serif", SMALL + 1, &INK))
            .draw()
            .map_err(failed)?;
        for ((series, points), colour) in series.iter().zip(&places).zip(COLOURS.iter().cycle()) {
            let colour = *colour;
            let dots = || points.iter().map(move |&at| Circle::new(at, 3, colour.filled()));
            let stroke = colour.stroke_width(2);
            let drawn = match series.drawn {
                Drawn::Dots => chart.draw_series(
                    points.iter().map(|&at| Circle::new(at, 2, colour.mix(0.6).filled())),
                ),
                Drawn::Dashes => {
                    chart.draw_series(DashedLineSeries::new(points.clone(), 7, 5, stroke))
                }
                Drawn::Line | Drawn::Marked => {
                    chart.draw_series(LineSeries::new(points.clone(), stroke))
                }
            };
            drawn.map_err(failed)?;
            if series.drawn == Drawn::Marked {
                chart.draw_series(dots()).map_err(failed)?;
            }
        }
        Ok(())
    })
}

/// A chart of bars from 0: one group for each of `groups`, a bar in it for each of `names`. A bar
/// without a number is missing.
pub(super) fn bars(
    caption: &str,
    groups: &[String],
    names: &[String],
    values: &[Vec<Option<f64>>],
) -> Result<String, Failure> {
    let most = values.iter().flatten().flatten().copied().fold(0.0, f64::max) * 1.15;
    let slots = groups.len() * (names.len() + 1);
    let wide = f64::from(u32::try_from(slots).unwrap_or(u32::MAX));
    let legend: Vec<&str> = names.iter().map(String::as_str).collect();
    draw(&legend, |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(8)
            .x_label_area_size(34)
            .y_label_area_size(66)
            .build_cartesian_2d(0.0..wide, 0.0..most.max(1e-9))
            .map_err(failed)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID)
            .disable_x_mesh()
            .axis_style(INK)
            .y_desc(caption)
            .x_labels(0)
            .label_style(("sans-serif", SMALL, &INK))
            .axis_desc_style(("sans-serif", SMALL + 1, &INK))
            .draw()
            .map_err(failed)?;
        let centred = ("sans-serif", SMALL, &INK)
            .into_text_style(area)
            .pos(Pos::new(HPos::Center, VPos::Bottom));
        let numbers = ("sans-serif", number_size(slots, &values.concat()), &INK)
            .into_text_style(area)
            .pos(Pos::new(HPos::Center, VPos::Bottom));
        let mut from = 0.5;
        for (group, values) in groups.iter().zip(values) {
            let width = f64::from(u32::try_from(names.len()).unwrap_or(u32::MAX));
            let name = Text::new(group.clone(), (0, 24), centred.clone());
            let below = EmptyElement::at((from + width / 2.0, 0.0)) + name;
            chart.draw_series([below]).map_err(failed)?;
            for (k, value) in values.iter().enumerate() {
                let colour = COLOURS[k % COLOURS.len()];
                if let Some(value) = *value {
                    let bar =
                        Rectangle::new([(from + 0.06, 0.0), (from + 0.94, value)], colour.filled());
                    chart.draw_series([bar]).map_err(failed)?;
                    let number = Text::new(three_digits(value), (0, -3), numbers.clone());
                    let above = EmptyElement::at((from + 0.5, value)) + number;
                    chart.draw_series([above]).map_err(failed)?;
                }
                from += 1.0;
            }
            from += 1.0;
        }
        Ok(())
    })
}

/// The number above a bar.
fn three_digits(value: f64) -> String {
    match value {
        _ if value < 10.0 => format!("{value:.2}"),
        _ if value < 100.0 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

/// Width of a digit, as a share of the size of its letters.
const DIGIT: f64 = 0.6;

/// The size of the numbers above bars, at which none reaches into its neighbour's place.
fn number_size(slots: usize, values: &[Option<f64>]) -> i32 {
    let digits = values.iter().flatten().map(|value| three_digits(*value).len()).max();
    let place = f64::from(SIZE.0 - BESIDE_BARS) / slots.max(1) as f64;
    let fits = |size: &i32| DIGIT * f64::from(*size) * digits.unwrap_or(1) as f64 <= place;
    (1..=SMALL).rev().find(fits).unwrap_or(1)
}

/// Draws a chart below its legend, which one series alone does not need.
fn draw(
    names: &[&str],
    on: impl FnOnce(&Area<'_>) -> Result<(), Failure>,
) -> Result<String, Failure> {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        let names = if names.len() > 1 { names } else { &[] };
        let (legend, chart) = area.split_vertically(legend_height(names.len()));
        draw_legend(&legend, names)?;
        on(&chart)?;
        area.present().map_err(failed)?;
    }
    Ok(themed(&text))
}

/// Names beside each other in a legend, and the space of each.
const IN_A_ROW: usize = 3;
const NAME_WIDTH: i32 = 265;
const ROW_HEIGHT: i32 = 20;

fn legend_height(names: usize) -> i32 {
    let rows = i32::try_from(names.div_ceil(IN_A_ROW)).unwrap_or(i32::MAX);
    if rows == 0 { 0 } else { rows.saturating_mul(ROW_HEIGHT).saturating_add(6) }
}

fn draw_legend(area: &Area<'_>, names: &[&str]) -> Result<(), Failure> {
    let style =
        ("sans-serif", SMALL, &INK).into_text_style(area).pos(Pos::new(HPos::Left, VPos::Center));
    for ((row, names), colours) in
        (0..).zip(names.chunks(IN_A_ROW)).zip(COLOURS.chunks(IN_A_ROW).cycle())
    {
        for ((column, name), colour) in (0..).zip(names).zip(colours) {
            let (x, y) = (70 + column * NAME_WIDTH, 14 + row * ROW_HEIGHT);
            let mark = Rectangle::new([(x, y - 3), (x + 18, y + 3)], colour.filled());
            area.draw(&mark).map_err(failed)?;
            area.draw(&Text::new(*name, (x + 24, y), style.clone())).map_err(failed)?;
        }
    }
    Ok(())
}

/// Makes the chart scale with the page and take its colours.
fn themed(text: &str) -> String {
    let (width, height) = SIZE;
    text.replace("#010203", "currentColor").replace("#040506", "var(--grid, #cccccc)").replacen(
        &format!("width=\"{width}\" height=\"{height}\" "),
        "",
        1,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const PROFILE_NAMES: [&str; 6] = ["naive", "float", "half", "mixed", "windowed", "windowed16"];

    #[test]
    fn a_logarithmic_chart_has_a_label_a_decade_and_leaves_out_zeros() {
        let series = [
            Series::new("one", Drawn::Line, vec![(0.0, 0.0), (1.0, 0.01), (2.0, 10.0)]),
            Series::new("two", Drawn::Dots, vec![(0.5, 1.0)]),
        ];
        let text = lines(Axis::linear("x"), Axis::log("deviation, %"), &series).expect("a chart");
        for label in ["0.01", "0.1", "10", "deviation, %", "one", "two"] {
            assert!(text.contains(&format!("\n{label}\n")), "{label}: {text}");
        }
        assert_eq!(text.matches("<circle").count(), 1);
        assert!(!text.contains("#010203") && text.contains("currentColor"), "{text}");
        assert!(text.contains("viewBox") && !text.contains("width=\"860\" height"), "{text}");
    }

    #[test]
    fn the_numbers_above_bars_do_not_meet() {
        let groups = PROFILE_NAMES.map(str::to_owned);
        let names = ["a", "b", "c", "d"].map(str::to_owned);
        let values = vec![vec![Some(35.724), Some(35.72), Some(64.09), Some(64.0)]; groups.len()];
        let text = bars("times", &groups, &names, &values).expect("a chart");
        let attribute = |tag: &str, name: &str| {
            let (_, value) = tag.split_once(&format!(" {name}=\""))?;
            value.split('"').next()?.parse::<f64>().ok()
        };
        let mut numbers: Vec<(f64, f64)> = Vec::new();
        for tag in text.split("<text").skip(1) {
            let label = tag.split_once('>').and_then(|(_, text)| text.split('<').next());
            let label = label.unwrap_or_default().trim();
            if ["35.7", "64.1", "64.0"].contains(&label) {
                let [x, size] =
                    ["x", "font-size"].map(|name| attribute(tag, name).expect("a number"));
                let half = label.len() as f64 * DIGIT * size / 2.0;
                numbers.push((x - half, x + half));
            }
        }
        assert_eq!(numbers.len(), 24, "{text}");
        assert!(numbers.windows(2).all(|pair| pair[0].1 <= pair[1].0 + 1.0), "{numbers:?}");
    }

    #[test]
    fn bars_have_their_numbers_and_a_missing_one_has_no_bar() {
        let groups = ["float".to_owned(), "half".to_owned()];
        let names = ["thesis".to_owned(), "ours".to_owned()];
        let values = [vec![Some(1.82), Some(1.79)], vec![None, Some(2.17)]];
        let text = bars("times", &groups, &names, &values).expect("a chart");
        for label in ["1.82", "1.79", "2.17", "float", "half", "thesis", "ours"] {
            assert!(text.contains(&format!("\n{label}\n")), "{label}: {text}");
        }
    }
}
