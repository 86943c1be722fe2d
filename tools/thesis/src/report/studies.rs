//! The studies behind the report's figures, with the commands that repeat them.

use std::path::Path;

use clap::{Args, Command};
use scene::Grid;

use super::AllArgs;
use super::step::shown;
use crate::figure::{Axis, Drawn, Series, lines};
use crate::histogram::Histogram;
use crate::session::Session;
use crate::study::recorded::RecordedDeviation;
use crate::study::{determinism, half, split, stopping, time_step};
use pgs_command::failure::{Cause, Failure};

/// The outcome of a study.
#[derive(Debug)]
pub(super) struct Studied<T> {
    /// The command that repeats it.
    pub(super) command: String,
    /// The steps that were taken, for people.
    pub(super) subject: String,
    pub(super) outcome: T,
}

/// How much the report measures.
#[derive(Debug)]
pub(super) struct Effort<'a> {
    args: &'a AllArgs,
    session: &'a Session,
}

/// Parses the options of a study, and the command that has them.
fn options<T: Args>(study: &str, words: &[String]) -> Result<(String, T), Failure> {
    let name = "study".to_owned();
    let matches = T::augment_args(Command::new("study"))
        .try_get_matches_from(std::iter::once(&name).chain(words))
        .and_then(|matches| T::from_arg_matches(&matches));
    let named: Vec<String> = words.iter().map(|word| quoted(&shown(Path::new(word)))).collect();
    let command = format!("pgs thesis {study} {}", named.join(" "));
    let options = matches
        .map_err(|error| Failure::new(Cause::Input, format!("{command} is refused: {error}")))?;
    Ok((command, options))
}

/// A word as a shell reads it.
pub(super) fn quoted(word: &str) -> String {
    let plain = |letter: char| letter.is_ascii_alphanumeric() || "_./=,:+-".contains(letter);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

fn words(text: &str) -> Vec<String> {
    text.split_whitespace().map(str::to_owned).collect()
}

impl<'a> Effort<'a> {
    pub(super) fn new(args: &'a AllArgs, session: &'a Session) -> Self {
        Self { args, session }
    }

    /// Refuses to go on after Ctrl-C.
    pub(super) fn go_on(&self) -> Result<(), Failure> {
        interrupted(!self.session.is_interrupted())
    }

    /// The step of the report: the folder's, or one of our own pile.
    fn one_step(&self) -> (Vec<String>, String) {
        let AllArgs { input, step, .. } = self.args;
        match input {
            Some(path) => {
                let subject = format!("the step in {}", shown(path));
                (vec!["--input".to_owned(), path.display().to_string()], subject)
            }
            None => {
                let (grid, from) = (self.args.pile(), step.saturating_sub(1));
                let words = words(&format!("--grid {grid} --from {from} --steps 1"));
                (words, format!("step {step} of our pile of {grid} cubes"))
            }
        }
    }

    /// The grid that the user gave; otherwise this small one in a quick report, and the thesis'.
    fn grid(&self, [x, y, z]: [u16; 3]) -> Grid {
        let small = || Grid::new(x, y, z).ok().filter(|_| self.args.quick);
        self.args.grid.or_else(small).unwrap_or_default()
    }

    /// The pile that is shown: a smaller one in a quick report.
    pub(super) fn pile(&self) -> Grid {
        self.grid([18, 15, 18])
    }

    /// Many steps of our own pile: a small one in a quick report.
    fn many_steps(&self) -> (Vec<String>, String) {
        let grid = self.grid([12, 12, 12]);
        let steps = if self.args.quick { 200 } else { 240 };
        let words = words(&format!("--grid {grid} --drop 5 --steps {steps}"));
        (words, format!("{steps} steps of our pile of {grid} cubes, dropped from 5 m"))
    }

    fn orders(
        &self,
        (mut words, subject): (Vec<String>, String),
        pairs: u32,
    ) -> Result<Studied<determinism::Outcome>, Failure> {
        words.extend(["--pairs".to_owned(), pairs.to_string()]);
        let (command, options) = options::<determinism::Options>("determinism", &words)?;
        let outcome = determinism::measure(&options, self.session)?;
        interrupted(outcome.complete)?;
        Ok(Studied { command, subject, outcome })
    }

    pub(super) fn orders_of_one_step(&self) -> Result<Studied<determinism::Outcome>, Failure> {
        self.orders(self.one_step(), if self.args.quick { 5 } else { 20 })
    }

    pub(super) fn orders_of_many_steps(&self) -> Result<Studied<determinism::Outcome>, Failure> {
        self.orders(self.many_steps(), 1)
    }

    fn half(
        &self,
        (words, subject): (Vec<String>, String),
    ) -> Result<Studied<half::Outcome>, Failure> {
        let (command, options) = options::<half::Options>("half", &words)?;
        let outcome = half::measure(&options, self.session)?;
        interrupted(outcome.complete)?;
        Ok(Studied { command, subject, outcome })
    }

    pub(super) fn half_of_one_step(&self) -> Result<Studied<half::Outcome>, Failure> {
        self.half(self.one_step())
    }

    pub(super) fn half_of_many_steps(&self) -> Result<Studied<half::Outcome>, Failure> {
        self.half(self.many_steps())
    }
}

/// Studies of our own small piles, whatever the step of the report is.
impl Effort<'_> {
    pub(super) fn time_steps(&self) -> Result<Studied<time_step::Outcome>, Failure> {
        let words =
            words(if self.args.quick { "--grid 4x4x4" } else { "--grid 8x8x8 --seconds 4" });
        let (command, options) = options::<time_step::Options>("time-step", &words)?;
        let outcome = time_step::measure(&options, self.session)?;
        interrupted(outcome.complete)?;
        let subject = format!("{} s of a pile of {} cubes", outcome.seconds, outcome.grid);
        Ok(Studied { command, subject, outcome })
    }

    pub(super) fn stopping(&self) -> Result<Studied<stopping::Outcome>, Failure> {
        let words =
            words(if self.args.quick { "--passes 32" } else { "--passes 128 --grid 10x10x10" });
        let (command, options) = options::<stopping::Options>("stopping", &words)?;
        let outcome = stopping::measure(&options, self.session)?;
        interrupted(outcome.complete)?;
        let subject = outcome.step.clone();
        Ok(Studied { command, subject, outcome })
    }

    pub(super) fn split(&self) -> Result<Studied<split::Outcome>, Failure> {
        let grid = self.grid([12, 12, 12]);
        let (command, options) =
            options::<split::Options>("split", &words(&format!("--grid {grid}")))?;
        let outcome = split::measure(&options, self.session)?;
        interrupted(outcome.complete)?;
        let subject = format!("a pile of {} cubes", outcome.grid);
        Ok(Studied { command, subject, outcome })
    }
}

/// Refuses to go on after Ctrl-C, which leaves an outcome incomplete.
fn interrupted(complete: bool) -> Result<(), Failure> {
    if complete {
        return Ok(());
    }
    Err(Failure::new(Cause::Output, "interrupted: no report was written"))
}

/// The share of numbers that deviate by less than each edge of a histogram, percent.
pub(super) fn below(histogram: &Histogram) -> Vec<(f64, f64)> {
    let Histogram { edges_percent, counts, equal, below, above, .. } = histogram;
    let all = equal + below + above + counts.iter().sum::<u64>();
    let share = |count: u64| 100.0 * count as f64 / (all as f64).max(1.0);
    let mut sum = equal + below;
    let mut points = Vec::with_capacity(edges_percent.len());
    for (edge, count) in edges_percent.iter().zip(counts.iter().chain([above])) {
        points.push((*edge, share(sum)));
        if sum == all {
            break;
        }
        sum += count;
    }
    points
}

/// A chart of the shares of positions that deviate by less, with the thesis' point at 1 %.
pub(super) fn spread(mut series: Vec<Series>, recorded: &RecordedDeviation) -> String {
    if let Some(share) = recorded.under_1_percent_share.map(|share| share * 100.0) {
        let name = format!("{share:.2} % below 1 %, recorded");
        series.push(Series::new(name, Drawn::Marked, vec![(1.0, share)]));
    }
    let (x, y) = ("deviation (eq. 4.1), %", "positions that deviate by less, %");
    lines(Axis::log(x), Axis::linear(y), &series)
}

/// A share as percent.
pub(super) fn percent(share: f64) -> String {
    format!("{:.3} %", share * 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_below_rise_to_all_numbers() {
        let pairs = [(1.0, 1.0), (1.0, 1.005), (1.0, 1.5)];
        let points = below(&Histogram::of(pairs));
        assert!(points.windows(2).all(|pair| pair[0].1 <= pair[1].1));
        let at =
            |edge: f64| points.iter().find(|point| point.0 >= edge * 0.999).expect("an edge").1;
        assert!((at(0.1) - 100.0 / 3.0).abs() < 1e-9 && (at(1.0) - 200.0 / 3.0).abs() < 1e-9);
    }

    #[test]
    fn the_commands_of_the_report_are_those_that_it_runs() {
        let words = words("--grid 3x3x3 --steps 2 --pairs 1");
        let (command, parsed) =
            options::<determinism::Options>("determinism", &words).expect("parsed");
        assert_eq!(command, "pgs thesis determinism --grid 3x3x3 --steps 2 --pairs 1");
        assert_eq!(parsed.pairs, Some(1));
        let words = ["--input", "/home/somebody/two_cubes"].map(str::to_owned);
        let (command, _) = options::<determinism::Options>("determinism", &words).expect("parsed");
        assert_eq!(command, "pgs thesis determinism --input two_cubes");
        assert!(options::<determinism::Options>("determinism", &["--no".to_owned()]).is_err());
        assert_eq!(quoted("../a/step_1"), "../a/step_1");
        assert_eq!(quoted("my step's"), "'my step'\\''s'");
    }
}
