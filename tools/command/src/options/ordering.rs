//! The order of a step's collisions, on the command line and in the texts of `pgs thesis compare`.

use std::ffi::OsStr;

use clap::builder::{PossibleValue, StringValueParser, TypedValueParser};
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, Args, Command, ValueEnum};
use zynq_pgs::order::{Order, Ties};
use zynq_pgs::{Capabilities, StepParameters};

use crate::permutation::{Arranger, Permutation};

/// The order of a step's collisions.
#[derive(Debug, Clone, Copy, Default, PartialEq, Args)]
pub struct OrderingArgs {
    /// Order in which the collisions are sent [default: auto]
    #[arg(long, value_name = "ORDER", value_parser = AskedParser)]
    pub order: Option<AskedOrder>,
    /// Prove before each step that no moving body recurs within the hazard window; refuse the step
    /// otherwise
    #[arg(long)]
    pub verify: bool,
}

/// An order of the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AskedOrder {
    /// One that the driver makes.
    Driver(OrderName),
    /// One that the command makes; the driver sends the collisions as given.
    Command(Permutation),
}

/// An order of the driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum OrderName {
    /// Fewest cycles on the board: hazard-free-nearby (without empty entries if the pipeline waits
    /// on hazards), or as-given if it takes fewer cycles
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
    fn text(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }
}

impl AskedOrder {
    /// The driver's order of a step.
    fn order(self) -> Option<Order> {
        match self {
            Self::Driver(name) => name.order(),
            Self::Command(_) => Some(Order::AsGiven),
        }
    }

    /// As it is written.
    pub fn text(self) -> String {
        match self {
            Self::Driver(name) => name.text(),
            Self::Command(permutation) => permutation.text(),
        }
    }

    /// Parses a word of a text: an order, or an order behind `order=`.
    pub fn of_word(word: &str) -> Option<Self> {
        let word = word.strip_prefix("order=").unwrap_or(word);
        let command = || Permutation::of_word(word).map(Self::Command);
        OrderName::from_str(word, false).ok().map(Self::Driver).or_else(command)
    }

    /// Lists all orders as they are written.
    pub fn all() -> String {
        let names = OrderName::value_variants().iter().map(|name| name.text());
        let forms = Permutation::FORMS.iter().map(|(form, _)| (*form).to_owned());
        names.chain(forms).collect::<Vec<_>>().join(", ")
    }
}

/// Parses an order of the command line, and lists all of them in its help.
#[derive(Debug, Clone, Copy)]
struct AskedParser;

impl TypedValueParser for AskedParser {
    type Value = AskedOrder;

    fn parse_ref(
        &self,
        command: &Command,
        argument: Option<&Arg>,
        value: &OsStr,
    ) -> Result<AskedOrder, clap::Error> {
        let text = StringValueParser::new().parse_ref(command, argument, value)?;
        let order = Some(&text).filter(|text| !text.starts_with("order="));
        order.and_then(|text| AskedOrder::of_word(text)).ok_or_else(|| {
            let mut error = clap::Error::new(ErrorKind::InvalidValue).with_cmd(command);
            if let Some(argument) = argument {
                let argument = ContextValue::String(argument.to_string());
                error.insert(ContextKind::InvalidArg, argument);
            }
            error.insert(ContextKind::InvalidValue, ContextValue::String(text.clone()));
            let valid = AskedOrder::all().split(", ").map(str::to_owned).collect();
            error.insert(ContextKind::ValidValue, ContextValue::Strings(valid));
            error
        })
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let names = OrderName::value_variants().iter().filter_map(OrderName::to_possible_value);
        let forms = Permutation::FORMS;
        let forms = forms.into_iter().map(|(form, help)| PossibleValue::new(form).help(help));
        Some(Box::new(names.chain(forms)))
    }
}

impl OrderingArgs {
    /// Sets the order.
    pub fn apply(self, mut parameters: StepParameters) -> StepParameters {
        if let Some(name) = self.order {
            parameters.order = name.order();
        }
        parameters.verify_order |= self.verify;
        parameters
    }

    /// Puts the collisions in order before the driver gets them, if the command does. `recorded` is
    /// the order of Bullet's GPU, where it is known.
    pub fn arranger(self, recorded: Option<Vec<u32>>) -> Option<Arranger> {
        self.permutation().map(|permutation| Arranger::new(permutation, recorded))
    }

    /// The order that the command makes, if it does.
    pub fn permutation(self) -> Option<Permutation> {
        match self.order {
            Some(AskedOrder::Command(permutation)) => Some(permutation),
            Some(AskedOrder::Driver(_)) | None => None,
        }
    }

    /// Sets the order of a step whose results are compared. If no order is given, and the board
    /// solves the collisions one after the other, they stay as given: in Bullet's order, which is
    /// the same on every such board.
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
pub fn is_sequential(capabilities: &Capabilities) -> bool {
    capabilities.interlocked
}

/// The name of an order.
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
            let asked = AskedOrder::Driver(*name);
            assert_eq!(AskedOrder::of_word(&asked.text()), Some(asked));
            assert_eq!(AskedOrder::of_word(&format!("order={}", asked.text())), Some(asked));
            if let Some(order) = asked.order() {
                assert_eq!(super::name(order), asked.text());
            }
            assert!(AskedOrder::all().contains(&asked.text()));
        }
        assert_eq!(AskedOrder::of_word("sorted"), None);
    }

    #[test]
    fn an_order_of_the_command_is_sent_as_given() {
        for permutation in [Permutation::Gpu, Permutation::Random(9)] {
            let asked = AskedOrder::of_word(&permutation.text()).expect("an order");
            assert_eq!(asked, AskedOrder::Command(permutation));
            let ordering = OrderingArgs { order: Some(asked), verify: false };
            assert_eq!(ordering.apply(StepParameters::default()).order, Some(Order::AsGiven));
            assert!(ordering.arranger(None).is_some());
        }
        assert!(OrderingArgs::default().arranger(None).is_none());
    }

    #[test]
    fn nothing_asked_for_changes_nothing() {
        let parameters = StepParameters::default();
        assert_eq!(OrderingArgs::default().apply(parameters), parameters);
        let order = Some(AskedOrder::Driver(OrderName::Colours));
        let asked = OrderingArgs { order, verify: true }.apply(parameters);
        assert_eq!((asked.order, asked.verify_order), (Some(Order::Colours), true));
    }
}
