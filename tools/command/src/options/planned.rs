//! Plans faults of an emulated board from the command line, and reports which of them happened.

use std::str::FromStr;

use bitstream_model::{BoardConfig, EmulatedBoard, FaultPlan};
use clap::Args;
use serde_json::{Value, json};
use zynq_pgs::StepParameters;

/// Faults of the emulated board.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Emulated board")]
pub struct PlannedArgs {
    /// Make the board fail; `pgs faults --list` prints plans
    ///
    /// `KIND[=VALUE][@PLACE]`, behind it any of `,phase=` `,beat=` `,bd=` `,access=` `,n=` `,step=`
    /// `,times=`; several faults separated by `;`, or `seed:N` for random ones. `pgs faults --list`
    /// prints thousands of plans.
    #[arg(long, value_name = "PLAN")]
    fault: Option<Planned>,
}

/// The faults that the option asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Planned {
    Plan(FaultPlan),
    Seed(u64),
}

impl FromStr for Planned {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.strip_prefix("seed:") {
            Some(seed) => match seed.parse() {
                Ok(seed) => Ok(Self::Seed(seed)),
                Err(_) => Err(format!("the seed is {seed:?}, expected a whole number")),
            },
            None => text.parse().map(Self::Plan).map_err(|error| format!("{error}")),
        }
    }
}

impl PlannedArgs {
    /// The plan for a board whose steps have the passes of `parameters`.
    pub fn plan(&self, config: &BoardConfig, parameters: &StepParameters) -> Option<FaultPlan> {
        let (contact, friction) = (parameters.contact_iterations, parameters.friction_iterations);
        self.fault.as_ref().map(|planned| match planned {
            Planned::Plan(plan) => plan.clone(),
            Planned::Seed(seed) => FaultPlan::random(*seed, config, contact, friction),
        })
    }

    /// Whether the command line requests faults.
    pub fn is_given(&self) -> bool {
        self.fault.is_some()
    }
}

/// Faults given to an emulated board.
#[derive(Debug, Clone)]
pub struct Injected {
    /// The faults.
    pub plan: FaultPlan,
    /// The board that has them.
    pub board: EmulatedBoard,
}

impl Injected {
    /// The plan and the number of faults that have happened, for people.
    pub fn text(&self) -> String {
        let planned: u64 = self.plan.faults.iter().map(|fault| u64::from(fault.times)).sum();
        format!("{} of {planned} happened: {}", self.board.faults(), self.plan)
    }

    /// The same for programs.
    pub fn to_json(&self) -> Value {
        json!({ "plan": self.plan.to_string(), "happened": self.board.faults() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_is_a_line_or_a_seed() {
        assert_eq!("seed:7".parse(), Ok(Planned::Seed(7)));
        let plan = "stall@dma1.mm2s".parse::<Planned>().expect("a plan");
        assert!(matches!(plan, Planned::Plan(plan) if plan.to_string() == "stall@dma1.mm2s"));
        assert!("seed:x".parse::<Planned>().expect_err("no number").contains("\"x\""));
        assert!("stal".parse::<Planned>().expect_err("no fault").contains("expected one of"));
    }
}
