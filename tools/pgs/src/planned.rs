//! This file lets an emulated board fail as the command line says, and tells what came of it.

use std::str::FromStr;

use bitstream_model::FaultPlan;
use clap::Args;
use serde_json::{Value, json};
use zynq_pgs::StepParameters;

use crate::board::Opened;
use crate::failure::Failure;

/// Faults of the emulated board.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Emulated board")]
pub(crate) struct PlannedArgs {
    /// Let the board fail: `KIND[=VALUE][@PLACE][,phase=,beat=,bd=,access=,n=,step=,times=]`, several
    /// separated by `;`, or `seed:N` for some from a seed. `pgs faults --list` shows thousands
    #[arg(long, value_name = "PLAN")]
    fault: Option<Planned>,
}

/// What is planned.
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
    /// Tells the board what to do wrong from its first step on; the plan, if there is one.
    pub(crate) fn inject(
        &self,
        opened: &Opened,
        parameters: &StepParameters,
    ) -> Result<Option<FaultPlan>, Failure> {
        let Some(planned) = &self.fault else { return Ok(None) };
        let Some(board) = &opened.observer else {
            let error = "--fault is for emulated boards, this one is real";
            return Err(Failure::input(error).next("leave out --fault, or add --board emulated"));
        };
        let plan = match planned {
            Planned::Plan(plan) => plan.clone(),
            Planned::Seed(seed) => FaultPlan::random(
                *seed,
                &board.config(),
                parameters.contact_iterations,
                parameters.friction_iterations,
            ),
        };
        log::info!("faults: {plan}");
        board.inject(plan.clone());
        Ok(Some(plan))
    }
}

/// How many of the planned faults have happened.
fn happened(opened: &Opened) -> u64 {
    opened.observer.as_ref().map_or(0, |board| board.faults())
}

/// For people.
pub(crate) fn text(plan: &FaultPlan, opened: &Opened) -> String {
    let planned: u64 = plan.faults.iter().map(|fault| u64::from(fault.times)).sum();
    format!("faults     {} of {planned} happened: {plan}", happened(opened))
}

/// For programs.
pub(crate) fn to_json(plan: &FaultPlan, opened: &Opened) -> Value {
    json!({ "plan": plan.to_string(), "happened": happened(opened) })
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
