//! This file holds the order of the collisions of a step: how it is asked for on the command line
//! and in the texts of `pgs compare`, and how a step's report tells it.

use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use zynq_pgs::order::{Order, Ties};
use zynq_pgs::{Capabilities, OrderChoice, StepParameters, StepReport};

use crate::verbs::table::grouped;

/// How the collisions of a step are ordered.
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
    /// The cheapest on the board: hazard-free-nearby, without empty entries where the pipeline waits
    /// on hazards, or as-given where that takes fewer cycles; hazard-free where only live bodies are
    /// kept on chip
    Auto,
    /// As detected, which is how Bullet sorts them: hazards abound
    AsGiven,
    /// No hazards, few bodies alive, few empty entries
    HazardFree,
    /// No hazards, near to the order as given, few empty entries (hazard-free where they would be many)
    HazardFreeNearby,
    /// The thesis' Algorithm 3, ties by the lowest index: few bodies alive, nearly all hazardous
    BodyByBody,
    /// The same, ties by the body that became active first
    BodyByBodyOldest,
    /// The same, ties by the body that became active last
    BodyByBodyNewest,
    /// By greedy colouring: no hazards if colours are large, nearly all bodies alive
    Colours,
}

impl OrderName {
    /// What the driver is asked for.
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

    /// As it is written.
    pub(crate) fn text(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }

    /// The order that a word of a text names: its name, or its name behind `order=`.
    pub(crate) fn of_word(word: &str) -> Option<Self> {
        Self::from_str(word.strip_prefix("order=").unwrap_or(word), false).ok()
    }

    /// All names, for people.
    pub(crate) fn all() -> String {
        let names: Vec<String> = Self::value_variants().iter().map(|name| name.text()).collect();
        names.join(", ")
    }
}

impl OrderingArgs {
    /// The same parameters with this order.
    pub(crate) fn apply(self, mut parameters: StepParameters) -> StepParameters {
        if let Some(name) = self.order {
            parameters.order = name.order();
        }
        parameters.verify_order |= self.verify;
        parameters
    }

    /// The same for a step that is to be compared with others: where the board solves one collision
    /// after the other, and no order is asked for, the collisions stay as given. That is Bullet's
    /// order, and the same on every such board.
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

/// Whether a board gives what solving one collision after the other gives, in any order.
fn is_sequential(capabilities: &Capabilities) -> bool {
    capabilities.interlocked && capabilities.window.is_none()
}

/// Whether the order of a step is Bullet's, in words; nothing where it is and that does not help.
pub(crate) fn beside_bullet(
    report: &StepReport,
    capabilities: &Capabilities,
) -> Option<&'static str> {
    match report.order {
        Order::AsGiven if is_sequential(capabilities) => Some("Bullet's own, to compare with it"),
        Order::AsGiven => None,
        _ => Some("not Bullet's: results differ by the order alone"),
    }
}

/// The name of an order that was sent.
pub(crate) fn name(order: Order) -> String {
    let found = OrderName::value_variants().iter().find(|name| name.order() == Some(order));
    found.map_or_else(|| "another".to_owned(), |name| name.text())
}

/// The orders that the steps of a run were sent in, and how many each: one may give way to another
/// ([`Order::HazardFreeNearby`]).
#[derive(Debug, Default)]
pub(crate) struct OrdersSent(Vec<(Order, u64)>);

impl OrdersSent {
    /// A step was sent.
    pub(crate) fn see(&mut self, order: Order) {
        match self.0.iter_mut().find(|(taken, _)| *taken == order) {
            Some((_, steps)) => *steps += 1,
            None => self.0.push((order, 1)),
        }
    }

    /// In words, the one met first before the others; nothing if all steps had one order.
    pub(crate) fn text(&self) -> Option<String> {
        let all: u64 = self.0.iter().map(|(_, steps)| steps).sum();
        let each = self.0.iter().map(|(order, steps)| (name(*order), grouped(*steps)));
        let texts: Vec<String> = each.map(|(name, steps)| format!("{name} in {steps}")).collect();
        (texts.len() > 1).then(|| format!("of {} steps {}", grouped(all), texts.join(", ")))
    }
}

/// In which order a step was sent, and why.
pub(crate) fn with_reason(report: &StepReport) -> String {
    match reason(report) {
        Some(reason) => format!("{}: {reason}", name(report.order)),
        None => name(report.order),
    }
}

/// Why an order was taken; nothing where it was asked for.
pub(crate) fn reason(report: &StepReport) -> Option<String> {
    let OrderChoice::Cheapest(costs) = report.order_choice else {
        return match report.order_choice {
            OrderChoice::NoInterlock => Some("this board does not wait on hazards".to_owned()),
            OrderChoice::LiveBodies => Some("this board keeps only live bodies on chip".to_owned()),
            _ => None,
        };
    };
    let as_given = grouped(costs.as_given);
    Some(match costs.reordered.map(|cycles| (grouped(cycles), cycles < costs.as_given)) {
        Some((reordered, true)) => format!(
            "this board waits on hazards; the passes take at most {reordered} cycles, as given \
             they take more than {as_given}"
        ),
        Some((reordered, false)) => format!(
            "this board waits on hazards; the passes take {as_given} cycles, {reordered} without \
             hazards"
        ),
        None => format!("no order takes fewer cycles for the passes than {as_given}"),
    })
}

/// In which order a step was sent, in words.
pub(crate) fn text(report: &StepReport) -> String {
    let mut text = name(report.order);
    if report.empty > 0 {
        let share = report.empty as f64 / (report.collisions as f64).max(1.0);
        text += &format!(", {} empty entries ({:.2} %)", grouped(report.empty), share * 100.0);
    }
    if let Some(live) = &report.live {
        text += &format!(
            ", {} bodies alive and {} in places at most, longest span {} entries",
            grouped(live.most_alive.into()),
            grouped(live.most_held.into()),
            grouped(live.longest_span.into()),
        );
    }
    if let Some(verified) = &report.verified {
        text += &format!(
            ", verified: {} hazards, {} bodies alive at most, longest span {} slots",
            verified.hazards,
            grouped(verified.most_alive as u64),
            grouped(verified.longest_span as u64),
        );
    }
    text
}

/// The same for programs.
pub(crate) fn to_json(report: &StepReport) -> Value {
    json!({
        "name": name(report.order),
        "choice": choice_json(&report.order_choice),
        "empty": report.empty,
        "live": report.live.map(|live| json!({
            "most_alive": live.most_alive,
            "most_held": live.most_held,
            "longest_span": live.longest_span,
        })),
        "verified": report.verified.map(|verified| json!({
            "hazards": verified.hazards,
            "lost_updates": verified.lost_updates,
            "most_alive": verified.most_alive,
            "longest_span": verified.longest_span,
            "mean_span": verified.mean_span,
        })),
    })
}

/// Why an order was taken, for programs.
fn choice_json(choice: &OrderChoice) -> Value {
    let name = match choice {
        OrderChoice::Asked => "asked",
        OrderChoice::NoInterlock => "no_interlock",
        OrderChoice::LiveBodies => "live_bodies",
        OrderChoice::Cheapest(_) => "cheapest",
        _ => "other",
    };
    match choice {
        OrderChoice::Cheapest(costs) => json!({
            "reason": name,
            "as_given_cycles": costs.as_given,
            "reordered_cycles": costs.reordered,
        }),
        _ => json!({ "reason": name }),
    }
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
