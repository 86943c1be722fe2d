//! The tables of the residuals after each number of passes, and of the passes of each rule.

use super::residual::Residuals;
use super::{Outcome, Pass, Rules};
use crate::estimate::thesis;
use crate::experiment::Part;
use crate::figure::{Axis, Drawn, Figure, Series, lines};
use crate::index::Row;
use crate::table::{Cell, Table};
use pgs_command::numbers::{grouped, number};

/// A table of the residuals after some passes; `heads` are of the passes and of the third residual.
fn residuals(
    (id, title): (&'static str, &str),
    [passes_head, third_head]: [&'static str; 2],
    passes: &[Pass],
    of: impl Fn(&Residuals) -> [f64; 3],
) -> Table {
    let mut table = Table::new(id, title);
    for pass in shown(passes) {
        let [rms, largest, third] = of(&pass.residuals).map(Cell::Digits);
        table.row([
            ("passes", passes_head, Cell::Whole(pass.passes.into())),
            ("rms_m_s", "residual\nrms m/s", rms),
            ("largest_m_s", "largest\nm/s", largest),
            ("third_rms_m_s", third_head, third),
            (
                "largest_change_n_s",
                "change\nN s",
                Cell::known(pass.largest_change_n_s, Cell::Digits),
            ),
            ("largest_share", "share", Cell::known(pass.largest_share, Cell::Digits)),
        ]);
    }
    table
}

/// The thesis' stopping rule; its number of passes is inferred.
fn fixed() -> String {
    let passes = thesis::step().passes();
    format!("a fixed number of passes, not printed; {passes} by its cycles (inferred)")
}

impl Outcome {
    /// The residual after each pass.
    fn figure(&self) -> (Figure, Row) {
        let residuals = |passes: &[Pass], of: fn(&Pass) -> f64| -> Vec<(f64, f64)> {
            passes.iter().map(|pass| (f64::from(pass.passes), of(pass))).collect()
        };
        let contact = residuals(&self.contact, |pass| pass.residuals.contact.rms);
        let friction = residuals(&self.friction, |pass| pass.residuals.friction.rms);
        let behind = format!("friction passes behind {} contact passes", self.contact_iterations);
        let series = [
            Series::new("contact passes", Drawn::Line, contact),
            Series::new(behind, Drawn::Line, friction),
        ];
        let (x, y) = (Axis::linear("passes"), Axis::log("residual (root mean square), m/s"));
        let figure = Figure::new(
            ("figure-stopping", "§2.2.3"),
            "Residual of the contact problem after each pass",
            lines(x, y, &series),
            format!("{}. The thesis stops after {}.", self.step, fixed()),
        );
        let passes = |passes: Option<u32>, all: &[Pass]| {
            let most = all.last().map_or(0, |pass| pass.passes);
            passes.map_or_else(|| format!("more than {most}"), |passes| passes.to_string())
        };
        let ours = self.tolerances.iter().map(|at| {
            let [contact, friction] = [
                passes(at.contact.residual, &self.contact),
                passes(at.friction.residual, &self.friction),
            ];
            format!("{:.0e}: {contact} contact, {friction} friction", at.tolerance)
        });
        let row = figure.row(
            "passes until the residual has fallen to a share of its first value",
            fixed(),
            ours.collect::<Vec<_>>().join("; "),
        );
        (figure, row)
    }

    /// The facts and tables of the outcome.
    pub(super) fn part(&self) -> Part {
        let contact = residuals(
            ("contact", "Contact passes"),
            ["contact\npasses", "Fischer-B.\nrms m/s"],
            &self.contact,
            |Residuals { contact, fischer_burmeister, .. }| {
                [contact.rms, contact.largest, fischer_burmeister.rms]
            },
        );
        let friction = residuals(
            ("friction", "Friction passes behind the step's own contact passes"),
            ["friction\npasses", "contacts\nrms m/s"],
            &self.friction,
            |Residuals { friction, contact, .. }| [friction.rms, friction.largest, contact.rms],
        );
        let mut part = Part::of(vec![contact, friction, self.rules()]).with(self);
        part.complete = self.complete;
        let (figure, row) = self.figure();
        part.figure(figure, [row]);
        let step = format!(
            "{}: {} bodies, {} collisions, spin damping {}",
            self.step,
            grouped(self.bodies as u64),
            grouped(self.collisions as u64),
            self.spin_damping,
        );
        part.fact("step", step);
        if let Some(Pass { residuals: Residuals { contact, friction, .. }, .. }) = &self.fixed {
            let text = format!(
                "{} + {} passes leave {} m/s at the contacts and {} m/s at the tangents (root mean \
                 square), {} and {} m/s at most",
                self.contact_iterations,
                self.friction_iterations,
                number(contact.rms),
                number(friction.rms),
                number(contact.largest),
                number(friction.largest),
            );
            part.fact("fixed", text);
        }
        part
    }

    fn rules(&self) -> Table {
        let mut table = Table::with_columns(
            "rules",
            "Passes until a rule holds",
            &[
                ("tolerance", "tolerance"),
                ("contact_residual", "contact\nresidual"),
                ("contact_change", "contact\nchange"),
                ("contact_each", "contact\neach"),
                ("friction_residual", "friction\nresidual"),
                ("friction_change", "friction\nchange"),
                ("friction_each", "friction\neach"),
            ],
        );
        for tolerance in &self.tolerances {
            let cells = |rules: Rules| {
                [rules.residual, rules.largest_change, rules.each_change]
                    .map(|passes| Cell::known(passes, |passes| Cell::Whole(passes.into())))
            };
            let mut row = vec![Cell::Digits(tolerance.tolerance)];
            row.extend(cells(tolerance.contact));
            row.extend(cells(tolerance.friction));
            table.row(row);
        }
        let most = |passes: &[Pass]| passes.last().map_or(0, |pass| pass.passes);
        table.note(format!(
            "A missing number is above the {} contact and {} friction passes that were measured.",
            most(&self.contact),
            most(&self.friction)
        ));
        table
    }
}

/// The first passes, and later ones ever further apart.
fn shown(passes: &[Pass]) -> impl Iterator<Item = &Pass> {
    let last = passes.last().map_or(0, |pass| pass.passes);
    passes.iter().filter(move |pass| {
        let number = pass.passes;
        number <= 8
            || number == last
            || number.is_power_of_two()
            || number % 3 == 0 && (number / 3).is_power_of_two()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thesis_stops_after_a_number_that_it_does_not_print() {
        let text = fixed();
        assert!(text.contains("not printed; 8 by its cycles (inferred)"), "{text}");
        assert!(!text.contains('4'), "{text}");
    }
}
