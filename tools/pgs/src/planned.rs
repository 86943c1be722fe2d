//! This file lets an emulated board fail as the command line says, and tells what came of it.

use std::str::FromStr;

use bitstream_model::{BoardConfig, EmulatedBoard, FaultPlan};
use clap::Args;
use serde_json::{Value, json};
use zynq_pgs::{BoardKind, StepParameters};

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
    /// The plan for a board, in steps of so many passes.
    pub(crate) fn plan(
        &self,
        config: &BoardConfig,
        parameters: &StepParameters,
    ) -> Option<FaultPlan> {
        let (contact, friction) = (parameters.contact_iterations, parameters.friction_iterations);
        self.fault.as_ref().map(|planned| match planned {
            Planned::Plan(plan) => plan.clone(),
            Planned::Seed(seed) => FaultPlan::random(*seed, config, contact, friction),
        })
    }

    /// Tells the board what to do wrong from its first step on.
    pub(crate) fn inject(
        &self,
        opened: &mut Opened,
        parameters: &StepParameters,
    ) -> Result<(), Failure> {
        if self.fault.is_none() {
            return Ok(());
        }
        let Some(board) = &opened.observer else {
            let next = match opened.accelerator.board().kind {
                BoardKind::Served => "leave out --fault, or give it to the board's `pgs serve`",
                _ => "leave out --fault, or add --board emulated",
            };
            let error = "--fault is for an emulated board of this process";
            return Err(Failure::input(error).next(next));
        };
        if let Some(plan) = self.plan(&board.config(), parameters) {
            board.inject(plan.clone());
            opened.plan = Some(plan);
        }
        Ok(())
    }
}

/// How many of the planned faults have happened.
fn happened(opened: &Opened) -> u64 {
    opened.observer.as_ref().map_or(0, EmulatedBoard::faults)
}

/// What was planned and has happened, for people.
pub(crate) fn text(opened: &Opened) -> Option<String> {
    let plan = opened.plan.as_ref()?;
    let planned: u64 = plan.faults.iter().map(|fault| u64::from(fault.times)).sum();
    Some(format!("faults     {} of {planned} happened: {plan}", happened(opened)))
}

/// What was planned and has happened, for programs.
pub(crate) fn to_json(opened: &Opened) -> Value {
    opened.plan.as_ref().map_or(
        Value::Null,
        |plan| json!({ "plan": plan.to_string(), "happened": happened(opened) }),
    )
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
