//! The order of a step's collisions, on the command line and in the texts of `pgs compare`.

use clap::{Args, ValueEnum};
use zynq_pgs::order::{Order, Ties};
use zynq_pgs::{Capabilities, StepParameters};

/// The order of a step's collisions.
#[derive(Debug, Clone, Copy, Default, PartialEq, Args)]
pub(crate) struct OrderingArgs {
    /// Order in which the collisions are sent [default: auto]
    #[arg(long, value_enum)]
    pub(crate) order: Option<OrderName>,
    /// Prove before each step that no moving body recurs within the hazard window; refuse the step
    /// otherwise
    #[arg(long)]
    pub(crate) verify: bool,
}

/// An order of the collisions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum OrderName {
    /// Fewest cycles on the board: hazard-free-nearby (without empty entries if the pipeline waits
    /// on hazards), or as-given if it takes fewer cycles; hazard-free if the chip keeps live bodies
    /// only
    Auto,
    /// As detected, which is Bullet's order: many hazards
    AsGiven,
    /// No hazards, few bodies alive, few empty entries
    HazardFree,
    /// No hazards, near the order as given, few empty entries (otherwise falls back to hazard-free)
    HazardFreeNearby,
    /// The thesis' Algorithm 3, ties by the lowest index: few bodies alive, nearly all hazardous
    BodyByBody,
    /// The same, ties by the body that became active first
    BodyByBodyOldest,
    /// The same, ties by the body that became active last
    BodyByBodyNewest,
    /// Greedy colouring: no hazards if colours are large, nearly all bodies alive
    Colours,
}

impl OrderName {
    /// The driver's order of this name.
    fn order(self) -> Option<Order> {
        match self {
            Self::Auto => None,
            Self::AsGiven => Some(Order::AsGiven),
            Self::HazardFree => Some(Order::HazardFree),
            Self::HazardFreeNearby => Some(Order::HazardFreeNearby),
            Self::BodyByBody => Some(Order::BodyByBody(Ties::LowestIndex)),
            Self::BodyByBodyOldest => Some(Order::BodyByBody(Ties::Oldest)),
            Self::BodyByBodyNewest => Some(Order::BodyByBody(Ties::Newest)),
            Self::Colours => Some(Order::Colours),
        }
    }

    /// The name as written.
    pub(crate) fn text(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }

    /// Parses a word of a text: a name, or a name behind `order=`.
    pub(crate) fn of_word(word: &str) -> Option<Self> {
        Self::from_str(word.strip_prefix("order=").unwrap_or(word), false).ok()
    }

    /// Lists all names.
    pub(crate) fn all() -> String {
        let names: Vec<String> = Self::value_variants().iter().map(|name| name.text()).collect();
        names.join(", ")
    }
}

impl OrderingArgs {
    /// Sets the order.
    pub(crate) fn apply(self, mut parameters: StepParameters) -> StepParameters {
        if let Some(name) = self.order {
            parameters.order = name.order();
        }
        parameters.verify_order |= self.verify;
        parameters
    }

    /// Sets the order of a step whose results are compared. If no order is given, and the board
    /// solves the collisions one after the other, they stay as given: in Bullet's order, which is
    /// the same on every such board.
    pub(crate) fn apply_to_compare(
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
pub(crate) fn is_sequential(capabilities: &Capabilities) -> bool {
    capabilities.interlocked && capabilities.window.is_none()
}

/// The name of an order.
pub(crate) fn name(order: Order) -> String {
    let found = OrderName::value_variants().iter().find(|name| name.order() == Some(order));
    found.map_or_else(|| "another".to_owned(), |name| name.text())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_told_as_it_is_asked_for() {
        for order in OrderName::value_variants() {
            assert_eq!(OrderName::of_word(&order.text()), Some(*order));
            assert_eq!(OrderName::of_word(&format!("order={}", order.text())), Some(*order));
            if let Some(asked) = order.order() {
                assert_eq!(name(asked), order.text());
            }
            assert!(OrderName::all().contains(&order.text()));
        }
        assert_eq!(OrderName::of_word("sorted"), None);
    }

    #[test]
    fn nothing_asked_for_changes_nothing() {
        let parameters = StepParameters::default();
        assert_eq!(OrderingArgs::default().apply(parameters), parameters);
        let asked = OrderingArgs { order: Some(OrderName::Colours), verify: true };
        let asked = asked.apply(parameters);
        assert_eq!((asked.order, asked.verify_order), (Some(Order::Colours), true));
    }
}
