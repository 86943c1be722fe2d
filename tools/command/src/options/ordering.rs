//! The order of a step's collisions, on the command line and in the texts of `pgs thesis compare`.

use clap::{Args, ValueEnum};
use zynq_pgs::order::Order;
use zynq_pgs::{Capabilities, StepParameters};

/// The order of a step's collisions.
#[derive(Debug, Clone, Copy, Default, PartialEq, Args)]
pub struct OrderingArgs {
    /// Order in which the collisions are sent [default: auto]
    #[arg(long, value_name = "ORDER", value_enum)]
    pub order: Option<OrderName>,
    /// Prove before each step that no moving body recurs within the hazard window; refuse the step
    /// otherwise
    #[arg(long)]
    pub verify: bool,
}

/// An order of the driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum OrderName {
    /// Fewest cycles on the board: interleaved if it has an issue queue; else hazard-free (without
    /// empty entries if the pipeline waits on hazards), or as-given if it takes fewer cycles
    Auto,
    /// As detected, which is Bullet's order, past the issue queue: many hazards
    AsGiven,
    /// Far places of the list in turn, for an issue queue: few hazards, and no work for the host
    Interleaved,
    /// No hazards, near the order as given, few empty entries
    HazardFree,
}

impl OrderName {
    /// The driver's order of this name.
    fn order(self) -> Option<Order> {
        match self {
            Self::Auto => None,
            Self::AsGiven => Some(Order::AsGiven),
            Self::Interleaved => Some(Order::Interleaved),
            Self::HazardFree => Some(Order::HazardFree),
        }
    }

    /// The name as written.
    #[must_use]
    pub fn text(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }
}

impl OrderingArgs {
    /// Sets the order.
    #[must_use]
    pub fn apply(self, mut parameters: StepParameters) -> StepParameters {
        if let Some(name) = self.order {
            parameters.order = name.order();
        }
        parameters.verify_order |= self.verify;
        parameters
    }

    /// Sets the order of a step whose results are compared. If no order is given, and the board
    /// solves the collisions one after the other, they stay as given: in Bullet's order, which is
    /// the same on every such board.
    #[must_use]
    pub fn apply_to_compare(
        self,
        parameters: StepParameters,
        capabilities: &Capabilities,
    ) -> StepParameters {
        let mut parameters = self.apply(parameters);
        if self.order.is_none() && is_sequential(capabilities) {
            parameters.order = Some(Order::AsGiven);
        }
        parameters
    }
}

/// Whether the board's results equal a solution of one collision after the other, in any order.
#[must_use]
pub fn is_sequential(capabilities: &Capabilities) -> bool {
    capabilities.interlocked
}

/// The name of an order.
#[must_use]
pub fn name(order: Order) -> String {
    let found = OrderName::value_variants().iter().find(|name| name.order() == Some(order));
    found.map_or_else(|| "another".to_owned(), |name| name.text())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_told_as_it_is_asked_for() {
        for name in OrderName::value_variants() {
            assert_eq!(OrderName::from_str(&name.text(), false), Ok(*name));
            if let Some(order) = name.order() {
                assert_eq!(super::name(order), name.text());
            }
        }
    }

    #[test]
    fn nothing_asked_for_changes_nothing() {
        let parameters = StepParameters::default();
        assert_eq!(OrderingArgs::default().apply(parameters), parameters);
        let order = Some(OrderName::HazardFree);
        let asked = OrderingArgs { order, verify: true }.apply(parameters);
        assert_eq!((asked.order, asked.verify_order), (Some(Order::HazardFree), true));
    }
}
