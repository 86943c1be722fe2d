//! Options of the solver: iterations, time step and deadline.

use std::time::Duration;

use bitstream_model::interface::control::ITERATIONS_MAX;
use clap::Args;
use zynq_pgs::StepParameters;

/// Iterations, time step and spin damping, in place of the verb's or the folder's own.
#[derive(Debug, Clone, Copy, Default, PartialEq, Args)]
#[command(next_help_heading = "Solver")]
pub struct SolverArgs {
    /// Passes of the contact solver over all collisions
    #[arg(long, value_name = "K", value_parser = iterations())]
    contact_iterations: Option<u32>,
    /// Passes of the friction solver over all collisions
    #[arg(long, value_name = "K", value_parser = iterations())]
    friction_iterations: Option<u32>,
    /// Time step, s: a number, or a fraction as 1/60
    #[arg(long, value_name = "S", value_parser = time_step)]
    dt: Option<f32>,
    /// Share of the spin about the normal that each friction pass takes away, 0 to 1: 0 is off, 0.1
    /// is Bullet's
    #[arg(long, value_name = "SHARE", value_parser = share)]
    spin_damping: Option<f32>,
}

impl SolverArgs {
    /// Sets the parameters that are given.
    pub fn apply(self, mut parameters: StepParameters) -> StepParameters {
        if let Some(iterations) = self.contact_iterations {
            parameters.contact_iterations = iterations;
        }
        if let Some(iterations) = self.friction_iterations {
            parameters.friction_iterations = iterations;
        }
        if let Some(time_step) = self.dt {
            parameters.time_step = time_step;
        }
        if let Some(share) = self.spin_damping {
            parameters.spin_damping = share;
        }
        parameters
    }
}

/// The deadline of a step.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct DeadlineArgs {
    /// Longest time of a step on the board, ms [default: 10, plus four times the time of its
    /// collisions one after the other]
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u32).range(1..=3_600_000))]
    deadline: Option<u32>,
}

impl DeadlineArgs {
    /// Sets the deadline.
    pub fn apply(self, mut parameters: StepParameters) -> StepParameters {
        if let Some(milliseconds) = self.deadline {
            parameters.deadline = Some(Duration::from_millis(milliseconds.into()));
        }
        parameters
    }
}

fn iterations() -> clap::builder::RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(..=i64::from(ITERATIONS_MAX))
}

/// Parses a share.
fn share(text: &str) -> Result<f32, String> {
    match text.trim().parse() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(share),
        _ => Err("expected a number from 0 to 1".to_owned()),
    }
}

/// Longest time step, s. A longer one is a typing error.
const TIME_STEP_MAX: f32 = 1.0;
/// Shortest time step, s: the board computes its reciprocal, which is infinite for a subnormal
/// number.
const TIME_STEP_MIN: f32 = f32::MIN_POSITIVE;

/// Parses a time step.
fn time_step(text: &str) -> Result<f32, String> {
    let number = |text: &str| text.trim().parse::<f32>().ok();
    let seconds = match text.split_once('/') {
        Some((above, below)) => number(above).zip(number(below)).map(|(a, b)| a / b),
        None => number(text),
    };
    match seconds {
        Some(seconds) if (TIME_STEP_MIN..=TIME_STEP_MAX).contains(&seconds) => Ok(seconds),
        _ => Err(format!(
            "expected seconds from {TIME_STEP_MIN:e} to {TIME_STEP_MAX}, as 0.02 or 1/60"
        )),
    }
}

/// The simulated time after a number of steps, s.
pub fn time_of(steps: impl Into<f64>, time_step: f32) -> f32 {
    #[allow(clippy::cast_possible_truncation, reason = "rounding to f32 is meant")]
    let time = (f64::from(time_step) * steps.into()) as f32;
    time
}

/// Formats a time step: as a fraction of a second where it is one.
pub fn time_step_text(seconds: f32) -> String {
    let steps = (1.0 / seconds).round();
    #[expect(clippy::float_cmp, reason = "the number that the fraction is read as, or another")]
    let is_fraction = 1.0 / steps == seconds;
    if is_fraction { format!("1/{steps} s") } else { format!("{seconds} s") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_steps_are_read_as_numbers_and_as_fractions() {
        let bits = |text: &str| time_step(text).map(f32::to_bits);
        assert_eq!(bits("1/60"), Ok(StepParameters::default().time_step.to_bits()));
        assert_eq!(bits("0.02"), Ok(0.02_f32.to_bits()));
        assert_eq!(bits("1.1754944e-38"), Ok(f32::MIN_POSITIVE.to_bits()));
        let wrong =
            ["", "0", "-1", "1/0", "0/1", "2", "nan", "inf", "1/60 s", "1//60", "1e-38", "1e-60"];
        for wrong in wrong {
            let error = time_step(wrong).expect_err(wrong);
            assert!(error.contains("from 1.1754944e-38 to 1"), "{error}");
        }
    }

    #[test]
    fn a_fraction_is_shown_as_one() {
        assert_eq!(time_step_text(1.0 / 60.0), "1/60 s");
        assert_eq!(time_step_text(0.5), "1/2 s");
        assert_eq!(time_step_text(0.03), "0.03 s");
    }

    #[test]
    fn what_is_not_given_stays() {
        let own = StepParameters::default();
        assert_eq!(SolverArgs::default().apply(own), own);
        let given = SolverArgs {
            contact_iterations: Some(7),
            friction_iterations: Some(0),
            dt: Some(0.5),
            spin_damping: Some(0.0),
        };
        let applied = given.apply(own);
        assert_eq!((applied.contact_iterations, applied.friction_iterations), (7, 0));
        assert_eq!(applied.time_step.to_bits(), 0.5_f32.to_bits());
        assert_eq!(applied.spin_damping.to_bits(), 0.0_f32.to_bits());
    }
}
