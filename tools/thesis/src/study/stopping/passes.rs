//! Takes one step with several numbers of passes.

use serde::Serialize;
use zynq_pgs::{Body, Impulses};

use super::residual::{Part, Problem, Residuals};
use super::{ORDER, Session};
use crate::study::given::GivenStep;
use pgs_command::board::{self, OpenBoard};
use pgs_command::failure::Result;
use pgs_command::step_input;

/// The state after a number of passes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Pass {
    pub(crate) passes: u32,
    pub(crate) residuals: Residuals,
    /// Largest change of an impulse in the last pass, N s; none before the first.
    pub(crate) largest_change_n_s: Option<f64>,
    /// The largest change as a share of the impulse before the pass; none before the first, and
    /// where an impulse has begun in the pass.
    pub(crate) largest_share: Option<f64>,
}

/// The kind of impulses that the counted passes change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Counted {
    Contact,
    Friction,
}

/// The bodies and the impulses of a solved step.
type Solved = (Vec<Body>, Vec<Impulses>);

/// The step, and the board that takes it.
pub(super) struct Course<'a> {
    pub(super) opened: &'a mut OpenBoard,
    pub(super) session: &'a Session,
    pub(super) step: &'a GivenStep,
    pub(super) problem: &'a Problem,
}

impl Course<'_> {
    /// Takes the step with 0 to `most` passes, each number as contact and friction passes by
    /// `split`; and whether Ctrl-C let all of them end.
    pub(super) fn take(
        &mut self,
        most: u32,
        split: impl Fn(u32) -> [u32; 2],
    ) -> Result<(Vec<Pass>, bool)> {
        let counted = match split(1) {
            [_, 0] => Counted::Contact,
            _ => Counted::Friction,
        };
        let mut passes = Vec::new();
        let mut before: Option<Vec<Impulses>> = None;
        for number in 0..=most {
            let Some((bodies, impulses)) = self.solve(split(number))? else {
                return Ok((passes, false));
            };
            let changes = before.map(|before| self.changes(counted, &before, &impulses));
            passes.push(Pass {
                passes: number,
                residuals: self.problem.residuals(&bodies, &impulses),
                largest_change_n_s: changes.map(|(change, _)| change),
                largest_share: changes.and_then(|(_, share)| share),
            });
            before = Some(impulses);
        }
        Ok((passes, true))
    }

    /// Takes the step once; none if Ctrl-C ended it.
    pub(super) fn once(&mut self, split: [u32; 2]) -> Result<Option<Pass>> {
        Ok(self.solve(split)?.map(|(bodies, impulses)| Pass {
            passes: split[0] + split[1],
            residuals: self.problem.residuals(&bodies, &impulses),
            largest_change_n_s: None,
            largest_share: None,
        }))
    }

    /// The velocities and impulses after the passes. Without a pass nothing has changed, and the
    /// board takes no step.
    fn solve(&mut self, [contact, friction]: [u32; 2]) -> Result<Option<Solved>> {
        let mut bodies = self.step.bodies.clone();
        if contact + friction == 0 {
            self.session.advance();
            return Ok(Some((bodies, vec![Impulses::ZERO; self.step.collisions.len()])));
        }
        let parameters = self
            .step
            .parameters
            .with_integrate(false)
            .with_impulses_out(true)
            .with_contact_iterations(contact)
            .with_friction_iterations(friction)
            .with_order(ORDER);
        let accelerator = &mut self.opened.accelerator;
        match accelerator.step(&mut bodies, &self.step.collisions, &parameters) {
            Ok(_) => {}
            Err(error) if board::is_cancelled(&error) => return Ok(None),
            Err(error) => {
                return Err(step_input::failure(self.step.folder.as_ref(), self.opened, error));
            }
        }
        self.opened.alive()?;
        self.session.advance();
        Ok(Some((bodies, self.opened.accelerator.impulses().to_vec())))
    }

    /// The largest change of an impulse, and the largest share of its value before.
    fn changes(
        &self,
        counted: Counted,
        before: &[Impulses],
        after: &[Impulses],
    ) -> (f64, Option<f64>) {
        let is_counted = |part: Part| match part {
            Part::Point(_) => counted == Counted::Contact,
            Part::Tangent(_) => counted == Counted::Friction,
        };
        let (mut change, mut share) = (0.0_f64, 0.0_f64);
        for row in self.problem.rows.iter().filter(|row| is_counted(row.part)) {
            let (was, is) = (row.impulse(before), row.impulse(after));
            let moved = (is - was).abs();
            if moved > change {
                change = moved;
            }
            // An impulse that begins has an infinite share.
            if moved > 0.0 && moved / was.abs() > share {
                share = moved / was.abs();
            }
        }
        (change, share.is_finite().then_some(share))
    }
}
