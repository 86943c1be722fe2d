//! A figure: series and axes to SVG. Its ink takes the colour of the text around it, light or dark.

use std::fmt::Write as _;
use std::ops::Range;

use serde_json::{Value, json};

use crate::index::{Origin, Row};

/// A picture with its caption.
#[derive(Debug, Clone)]
pub(crate) struct Figure {
    /// Its anchor, and the name of its file.
    pub(crate) id: &'static str,
    /// Its place in the thesis, section first: "§4.7, Figure 4.13".
    pub(crate) thesis: &'static str,
    pub(crate) title: String,
    /// SVG text.
    pub(crate) svg: String,
    pub(crate) caption: String,
    pub(crate) origin: Origin,
    /// A page of its own that plays the subject.
    pub(crate) playback: Option<String>,
}

impl Figure {
    /// A figure of numbers that were measured.
    pub(crate) fn new(
        (id, thesis): (&'static str, &'static str),
        title: impl Into<String>,
        svg: String,
        caption: impl Into<String>,
    ) -> Self {
        let (title, caption, origin) = (title.into(), caption.into(), Origin::Measured);
        Self { id, thesis, title, svg, caption, origin, playback: None }
    }

    /// The same of numbers that were computed.
    pub(crate) fn modelled(self) -> Self {
        Self { origin: Origin::Modelled, ..self }
    }

    /// A row of the index that leads here: the subject, the thesis' figure and ours.
    pub(crate) fn row(
        &self,
        subject: impl Into<String>,
        recorded: impl Into<String>,
        ours: impl Into<String>,
    ) -> Row {
        let (subject, recorded, ours) = (subject.into(), recorded.into(), ours.into());
        let (thesis, shown) = (self.thesis.to_owned(), self.id.to_owned());
        Row { thesis, subject, recorded, ours, origin: self.origin, command: String::new(), shown }
    }

    pub(crate) fn to_json(&self) -> Value {
        json!({
            "id": self.id,
            "thesis": self.thesis,
            "title": self.title,
            "caption": self.caption,
            "origin": self.origin.word(),
            "file": self.file(),
        })
    }

    /// Path of its file in the report's folder.
    pub(crate) fn file(&self) -> String {
        format!("figures/{}.svg", self.id)
    }
}

/// Size of a chart, in the units of its view box.
const SIZE: [f64; 2] = [860.0, 430.0];
/// Left, right and below the lines: numbers and captions.
const MARGINS: [f64; 3] = [84.0, 16.0, 50.0];
/// Above the lines, below the legend.
const TOP: f64 = 12.0;
/// Colours that colour-blind people can tell apart (Okabe and Ito), on light and on dark.
const COLOURS: [&str; 6] = ["#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9"];
/// Size of the numbers at the axes.
const SMALL: f64 = 13.0;
/// Width of a digit, as a share of the size of its letters.
const DIGIT: f64 = 0.6;
/// Names beside each other in a legend, and the space of each.
const IN_A_ROW: usize = 3;
const NAME: [f64; 2] = [258.0, 20.0];

/// How an axis is divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Scale {
    Linear,
    /// By powers of ten; numbers at or below 0 are left out.
    Log,
}

/// An axis with its caption.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Axis<'a> {
    caption: &'a str,
    scale: Scale,
}

impl<'a> Axis<'a> {
    pub(crate) const fn linear(caption: &'a str) -> Self {
        Self { caption, scale: Scale::Linear }
    }

    pub(crate) const fn log(caption: &'a str) -> Self {
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
    fn range(self, places: impl Iterator<Item = f64>) -> Range<f64> {
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

    /// The marks of a range: the decades, or steps of 1, 2 or 5.
    fn marks(self, range: &Range<f64>) -> Vec<f64> {
        let step = match self.scale {
            Scale::Log => ((range.end - range.start) / 14.0).ceil().max(1.0),
            Scale::Linear => {
                let rough = (range.end - range.start) / 8.0;
                let decade = 10_f64.powf(rough.log10().floor());
                [1.0, 2.0, 5.0, 10.0]
                    .map(|k| k * decade)
                    .into_iter()
                    .find(|s| *s >= rough)
                    .unwrap_or(rough)
            }
        };
        let first = (range.start / step).ceil();
        let marks = std::iter::successors(Some(first), |k| Some(k + 1.0)).map(|k| k * step);
        marks.take_while(|mark| *mark <= range.end + step * 1e-9).take(32).collect()
    }

    /// The number at a place, as written at the axis.
    fn label(self, place: f64) -> String {
        let value = if self.scale == Scale::Log { 10_f64.powf(place) } else { place };
        let size = value.abs();
        match size {
            _ if size == 0.0 => "0".to_owned(),
            _ if !(1e-3..1e6).contains(&size) => format!("{value:.0e}"),
            _ if size >= 10.0 => format!("{value:.0}"),
            _ => {
                let text = format!("{value:.3}");
                text.trim_end_matches('0').trim_end_matches('.').to_owned()
            }
        }
    }
}

/// A series of a chart.
#[derive(Debug, Clone)]
pub(crate) struct Series {
    pub(crate) name: String,
    pub(crate) points: Vec<(f64, f64)>,
    drawn: Drawn,
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Drawn {
    Line,
    /// A line in dashes: an exact or a recorded one.
    Dashes,
    /// A dot a point.
    Dots,
    /// A line with a dot a point.
    Marked,
}

impl Series {
    pub(crate) fn new(name: impl Into<String>, drawn: Drawn, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), points, drawn }
    }
}

/// A chart that grows.
struct Chart {
    text: String,
    /// Top of the lines.
    top: f64,
    x: Range<f64>,
    y: Range<f64>,
}

impl Chart {
    /// Begins a chart below its legend, which one series alone does not need.
    fn new(names: &[&str], x: Range<f64>, y: Range<f64>) -> Self {
        let names = if names.len() > 1 { names } else { &[] };
        let top = TOP + NAME[1] * names.len().div_ceil(IN_A_ROW) as f64;
        let [width, height] = SIZE;
        let text = format!(
            "<svg viewBox=\"0 0 {width} {height}\" xmlns=\"http://www.w3.org/2000/svg\" \
             font-family=\"sans-serif\" font-size=\"{SMALL}\" fill=\"currentColor\">\n"
        );
        let mut chart = Self { text, top, x, y };
        for (k, name) in names.iter().enumerate() {
            let (column, row) = (k % IN_A_ROW, k / IN_A_ROW);
            let (x, y) = (70.0 + column as f64 * NAME[0], 14.0 + row as f64 * NAME[1]);
            let _ = writeln!(
                chart.text,
                "<rect x=\"{x}\" y=\"{}\" width=\"18\" height=\"6\" fill=\"{}\"/>",
                y - 3.0,
                colour(k)
            );
            chart.label([x + 24.0, y + 4.0], "start", SMALL, name);
        }
        chart
    }

    /// Writes text at a point.
    fn label(&mut self, [x, y]: [f64; 2], anchor: &str, size: f64, text: &str) {
        let text = crate::table::escaped(text);
        let _ = writeln!(
            self.text,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" \
             font-size=\"{size}\">{text}</text>"
        );
    }

    /// Draws a thin line.
    fn rule(&mut self, [x, y]: [f64; 2], [to_x, to_y]: [f64; 2], stroke: &str) {
        let _ = writeln!(
            self.text,
            "<path d=\"M{x:.1} {y:.1}L{to_x:.1} {to_y:.1}\" stroke=\"{stroke}\"/>"
        );
    }

    /// The point of two places.
    fn at(&self, x: f64, y: f64) -> [f64; 2] {
        let share = |range: &Range<f64>, place| (place - range.start) / (range.end - range.start);
        let ([left, right, below], [width, height]) = (MARGINS, SIZE);
        let bottom = height - below;
        [
            left + share(&self.x, x) * (width - left - right),
            bottom - share(&self.y, y) * (bottom - self.top),
        ]
    }

    /// Draws the grid, the marks and the captions; without `x` bars stand on the axis.
    fn axes(&mut self, x: Option<Axis<'_>>, y: Axis<'_>) {
        const GRID: &str = "var(--grid, #cccccc)";
        let (across, up) = (self.x.clone(), self.y.clone());
        for mark in y.marks(&up) {
            let [left, level] = self.at(across.start, mark);
            let end = self.at(across.end, mark);
            self.rule([left, level], end, GRID);
            self.label([left - 6.0, level + 4.0], "end", SMALL, &y.label(mark));
        }
        let corner = self.at(across.start, up.start);
        for mark in x.map(|x| x.marks(&across)).unwrap_or_default() {
            let [place, bottom] = self.at(mark, up.start);
            let end = self.at(mark, up.end);
            self.rule([place, bottom], end, GRID);
            let label = x.map(|x| x.label(mark)).unwrap_or_default();
            self.label([place, bottom + 18.0], "middle", SMALL, &label);
        }
        let ends = [self.at(across.end, up.start), self.at(across.start, up.end)];
        ends.into_iter().for_each(|end| self.rule(corner, end, "currentColor"));
        let [middle, _] = self.at((across.start + across.end) / 2.0, up.start);
        if let Some(x) = x {
            self.label([middle, SIZE[1] - 8.0], "middle", SMALL + 1.0, x.caption);
        }
        let [_, half] = self.at(across.start, (up.start + up.end) / 2.0);
        let _ = writeln!(
            self.text,
            "<text transform=\"translate(16 {half:.1}) rotate(-90)\" text-anchor=\"middle\" \
             font-size=\"{}\">{}</text>",
            SMALL + 1.0,
            crate::table::escaped(y.caption)
        );
    }

    fn end(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }
}

fn colour(series: usize) -> &'static str {
    COLOURS[series % COLOURS.len()]
}

/// A chart of lines and dots.
pub(crate) fn lines(x: Axis<'_>, y: Axis<'_>, series: &[Series]) -> String {
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
    let mut chart = Chart::new(&names, across, up);
    chart.axes(Some(x), y);
    for (k, (series, places)) in series.iter().zip(&places).enumerate() {
        let colour = colour(k);
        let points: Vec<[f64; 2]> = places.iter().map(|&(x, y)| chart.at(x, y)).collect();
        if series.drawn != Drawn::Dots {
            let dashes = match series.drawn {
                Drawn::Dashes => " stroke-dasharray=\"7 5\"",
                _ => "",
            };
            let each: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
            let _ = writeln!(
                chart.text,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" \
                 stroke-width=\"2\"{dashes}/>",
                each.join(" ")
            );
        }
        let (radius, opacity) = match series.drawn {
            Drawn::Dots => (2, 0.6),
            Drawn::Marked => (3, 1.0),
            Drawn::Line | Drawn::Dashes => continue,
        };
        for [x, y] in points {
            let _ = writeln!(
                chart.text,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{colour}\" \
                 fill-opacity=\"{opacity}\"/>"
            );
        }
    }
    chart.end()
}

/// A chart of bars from 0: one group for each of `groups`, a bar in it for each of `names`. A bar
/// without a number is missing.
pub(crate) fn bars(
    caption: &str,
    groups: &[String],
    names: &[String],
    values: &[Vec<Option<f64>>],
) -> String {
    let most = values.iter().flatten().flatten().copied().fold(0.0, f64::max) * 1.15;
    let slots = (groups.len() * (names.len() + 1)) as f64;
    let legend: Vec<&str> = names.iter().map(String::as_str).collect();
    let mut chart = Chart::new(&legend, 0.0..slots.max(1.0), 0.0..most.max(1e-9));
    chart.axes(None, Axis::linear(caption));
    let size = number_size(slots, &values.concat());
    let mut from = 0.5;
    for (group, values) in groups.iter().zip(values) {
        let [middle, bottom] = chart.at(from + names.len() as f64 / 2.0, 0.0);
        chart.label([middle, bottom + 20.0], "middle", SMALL, group);
        for (k, value) in values.iter().enumerate() {
            let place = from + k as f64;
            let Some(value) = *value else { continue };
            let ([left, top], [right, _]) =
                (chart.at(place + 0.06, value), chart.at(place + 0.94, 0.0));
            let _ = writeln!(
                chart.text,
                "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" \
                 fill=\"{}\"/>",
                right - left,
                bottom - top,
                colour(k)
            );
            chart.label([(left + right) / 2.0, top - 3.0], "middle", size, &three_digits(value));
        }
        from += names.len() as f64 + 1.0;
    }
    chart.end()
}

/// The number above a bar.
fn three_digits(value: f64) -> String {
    match value {
        _ if value < 10.0 => format!("{value:.2}"),
        _ if value < 100.0 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

/// The size of the numbers above bars, at which none reaches into its neighbour's place.
fn number_size(slots: f64, values: &[Option<f64>]) -> f64 {
    let digits = values.iter().flatten().map(|value| three_digits(*value).len()).max();
    let place = (SIZE[0] - MARGINS[0] - MARGINS[1]) / slots.max(1.0);
    (place / (DIGIT * digits.unwrap_or(1) as f64)).floor().clamp(1.0, SMALL)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_logarithmic_chart_has_a_label_a_decade_and_leaves_out_zeros() {
        let series = [
            Series::new("one", Drawn::Line, vec![(0.0, 0.0), (1.0, 0.01), (2.0, 10.0)]),
            Series::new("two", Drawn::Dots, vec![(0.5, 1.0)]),
        ];
        let text = lines(Axis::linear("x"), Axis::log("deviation, %"), &series);
        for label in ["0.01", "0.1", "1", "10", "deviation, %", "one", "two"] {
            assert!(text.contains(&format!(">{label}</text>")), "{label}: {text}");
        }
        assert_eq!(text.matches("<circle").count(), 1);
        // By hand: 10 is the top of its decade, and 2 of a range to 2.1 is at the right.
        let right = 84.0 + 760.0 * 2.0 / 2.1;
        assert!(text.contains(&format!("{right:.1},32.0\"")), "{text}");
    }

    #[test]
    fn the_numbers_above_bars_do_not_meet() {
        let groups = ["naive", "float", "half", "one", "two", "three"].map(str::to_owned);
        let names = ["a", "b", "c", "d"].map(str::to_owned);
        let values = vec![vec![Some(35.724), Some(35.72), Some(64.09), Some(64.0)]; groups.len()];
        let size = number_size(30.0, &values.concat());
        assert!(4.0 * DIGIT * size <= 760.0 / 30.0 && size > 9.0, "{size}");
        let text = bars("times", &groups, &names, &values);
        assert_eq!(text.matches(&format!("font-size=\"{size}\"")).count(), 24, "{text}");
    }

    #[test]
    fn bars_have_their_numbers_and_a_missing_one_has_no_bar() {
        let groups = ["float".to_owned(), "half".to_owned()];
        let names = ["thesis".to_owned(), "ours".to_owned()];
        let values = [vec![Some(1.82), Some(1.79)], vec![None, Some(2.17)]];
        let text = bars("times", &groups, &names, &values);
        for label in ["1.82", "1.79", "2.17", "float", "half", "thesis", "ours"] {
            assert!(text.contains(&format!(">{label}</text>")), "{label}: {text}");
        }
        assert_eq!(text.matches("<rect").count(), 2 + 3);
    }

    #[test]
    fn marks_are_steps_of_one_two_or_five() {
        let marks = Axis::linear("").marks(&(0.0..33.0));
        assert_eq!(marks, [0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0]);
        assert_eq!(Axis::log("").marks(&(-2.0..1.0)), [-2.0, -1.0, 0.0, 1.0]);
    }
}
