//! An experiment: a place of the thesis, arguments, and a run that leads to tables and figures.

use std::io::Write;
use std::path::Path;

use clap::{ArgMatches, Args, Command, FromArgMatches};
use pgs_command::failure::{Failure, Result, Verdict};
use pgs_command::output::facts::fact;
use pgs_command::output::width::{stdout_width, terminal};
use serde_json::{Value, json};

use crate::figure::Figure;
use crate::index::{Row, section_key};
use crate::session::Session;
use crate::table::{Table, text};

/// Version of the JSON documents' layout; it grows when a key changes its meaning or goes.
pub(crate) const SCHEMA: u32 = 5;

/// The figure that opens the page of all experiments.
pub(crate) const PILES: &str = "piles";

/// The last line of an outcome that Ctrl-C has cut short.
pub(crate) const INTERRUPTED: &str = "interrupted: the figures are of the steps before Ctrl-C";

/// The boards that an experiment steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Boards {
    None,
    /// Emulated ones that it builds itself.
    Own,
    /// One that the user names.
    Any,
}

/// An experiment of the thesis part.
pub(crate) struct Experiment {
    /// Its name on the command line.
    pub(crate) id: &'static str,
    /// Its place in the thesis.
    pub(crate) thesis: &'static str,
    /// Its subject, in a line.
    pub(crate) about: &'static str,
    /// The boards that it steps.
    pub(crate) boards: Boards,
    /// Adds its arguments and its help.
    pub(crate) arguments: fn(Command) -> Command,
    /// Measures or computes; the matches are of its arguments.
    pub(crate) run: fn(&ArgMatches, &Session) -> Result<Part>,
}

/// The arguments of an experiment, which run it.
pub(crate) trait Measure: Args {
    fn measure(&self, session: &Session) -> Result<Part>;
}

impl Experiment {
    /// An experiment with these arguments.
    pub(crate) const fn of<A: Measure>(
        id: &'static str,
        thesis: &'static str,
        boards: Boards,
        about: &'static str,
    ) -> Self {
        let run = |matches: &ArgMatches, session: &Session| given::<A>(matches)?.measure(session);
        Self { id, thesis, about, boards, arguments: A::augment_args, run }
    }
}

/// The arguments of an experiment.
pub(crate) fn given<A: FromArgMatches>(matches: &ArgMatches) -> Result<A> {
    A::from_arg_matches(matches).map_err(Failure::input)
}

/// A folder as a figure names it: as it was given, or only its name. A page is passed on, and the
/// folders of its author's machine mean nothing to its readers.
pub(crate) fn shown(folder: &Path) -> String {
    let name = folder.file_name().filter(|_| folder.is_absolute());
    name.map_or(folder, Path::new).display().to_string()
}

/// The findings of an experiment.
#[derive(Debug, Default)]
pub(crate) struct Part {
    /// Whether no Ctrl-C ended it.
    pub(crate) complete: bool,
    /// Whether everything that it compared agrees.
    pub(crate) agrees: bool,
    /// The measured step, behind short labels.
    pub(crate) facts: Vec<(&'static str, String)>,
    pub(crate) tables: Vec<Table>,
    pub(crate) figures: Vec<Figure>,
    /// Rows of the index that lead to them.
    pub(crate) rows: Vec<Row>,
    /// Members for programs beside the tables.
    pub(crate) data: Value,
}

impl Part {
    pub(crate) fn of(tables: Vec<Table>) -> Self {
        Self { complete: true, agrees: true, tables, data: json!({}), ..Self::default() }
    }

    /// The part of an experiment that Ctrl-C ended before its first figure.
    pub(crate) fn interrupted() -> Self {
        Self { agrees: true, data: json!({}), ..Self::default() }
    }

    /// Adds a figure, and the rows of the index that lead to it.
    pub(crate) fn figure(&mut self, figure: Figure, rows: impl IntoIterator<Item = Row>) {
        self.figures.push(figure);
        self.rows.extend(rows);
    }

    /// Names the command that prints the rows, where they name no other.
    pub(crate) fn printed_by(&mut self, command: &str) {
        for row in self.rows.iter_mut().filter(|row| row.command.is_empty()) {
            command.clone_into(&mut row.command);
        }
    }

    /// Adds the figures and rows of another part behind this one's.
    pub(crate) fn append(&mut self, mut other: Self) {
        self.tables.append(&mut other.tables);
        self.figures.append(&mut other.figures);
        self.rows.append(&mut other.rows);
    }

    /// Sorts by the sections of the thesis; within one, figures and rows keep their order. The
    /// piles of the headline come first.
    pub(crate) fn sort(&mut self) {
        self.figures.sort_by_key(|figure| (figure.id != PILES, section_key(figure.thesis)));
        self.rows.sort_by_key(|row| section_key(&row.thesis));
    }

    /// Adds a line for people.
    pub(crate) fn fact(&mut self, label: &'static str, text: impl Into<String>) {
        self.facts.push((label, text.into()));
    }

    /// The end of the command.
    pub(crate) fn verdict(&self) -> Verdict {
        match (self.complete, self.agrees) {
            (_, false) => Verdict::Differs,
            (true, true) => Verdict::Done,
            (false, true) => Verdict::Interrupted,
        }
    }

    /// For programs.
    pub(crate) fn to_json(&self, experiment: &Experiment) -> Value {
        let mut document = self.data.clone();
        document["schema"] = SCHEMA.into();
        document["verb"] = "thesis".into();
        document["experiment"] = experiment.id.into();
        document["thesis"] = experiment.thesis.into();
        document["complete"] = self.complete.into();
        let fact = |(label, text): &(&str, String)| json!({ "label": label, "text": text });
        document["facts"] = self.facts.iter().map(fact).collect();
        document["tables"] = self.tables.iter().map(Table::to_json).collect();
        document["figures"] = self.figures.iter().map(Figure::to_json).collect();
        document["index"] = self.rows.iter().map(Row::to_json).collect();
        document
    }

    /// The rows of the index as a table, of an experiment that has no other.
    fn index(&self) -> Option<Table> {
        let columns =
            [("thesis", "thesis"), ("subject", ""), ("recorded", "its figure"), ("ours", "ours")];
        let mut table = Table::with_columns("index", "Beside the thesis", &columns);
        for Row { thesis, subject, recorded, ours, .. } in &self.rows {
            table.row([thesis, subject, recorded, ours].map(text));
        }
        self.tables.is_empty().then_some(table)
    }

    /// For people.
    pub(crate) fn write_text(&self, out: &mut dyn Write) -> Result<()> {
        for (label, text) in &self.facts {
            fact(out, label, text)?;
        }
        for table in self.tables.iter().chain(&self.index()) {
            write!(out, "\n{}", table.to_text(stdout_width(), terminal()))?;
        }
        if !self.complete && self.agrees {
            writeln!(out, "{INTERRUPTED}")?;
        }
        Ok(())
    }

    /// As Markdown.
    pub(crate) fn write_markdown(
        &self,
        experiment: &Experiment,
        out: &mut dyn Write,
    ) -> Result<()> {
        writeln!(out, "## {}: {}\n", experiment.thesis, experiment.id)?;
        for (_, text) in &self.facts {
            writeln!(out, "{text}\n")?;
        }
        for table in self.tables.iter().chain(&self.index()) {
            write!(out, "{}", table.to_markdown())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_names_no_folder_above_that_of_the_step() {
        let names = ["tests/golden/two_cubes", "/home/somebody/two_cubes/", "/"];
        let found = names.map(|name| shown(Path::new(name)));
        assert_eq!(found, ["tests/golden/two_cubes", "two_cubes", "/"]);
    }
}
