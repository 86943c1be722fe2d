//! Reads one side of a comparison: the build of its board, and the order of its collisions.

use std::fmt;
use std::str::FromStr;

use clap::ValueEnum;
use pgs_command::options::ordering::{OrderName, OrderingArgs};
use zynq_pgs::emulation::{Build, BuildError};

use crate::permutation::Permutation;

/// The specification of a side: the build of its board, and the order of its collisions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SideSpec {
    pub(super) build: Build,
    pub(super) ordering: OrderingArgs,
    /// The order in which the board gets the collisions as given, if it is one of ours.
    pub(super) permutation: Option<Permutation>,
}

/// All orders, as they are written.
fn orders() -> String {
    let ours = OrderName::value_variants().iter().map(|name| name.text());
    ours.chain(Permutation::forms().map(str::to_owned)).collect::<Vec<_>>().join(", ")
}

impl FromStr for SideSpec {
    type Err = String;

    /// A word for the order may stand anywhere behind the profile.
    fn from_str(text: &str) -> Result<Self, String> {
        let (mut order, mut permutation) = (None, None);
        let mut rest = Vec::new();
        for (place, word) in text.split(',').enumerate() {
            let name = word.strip_prefix("order=").unwrap_or(word);
            let (driver, ours) =
                (OrderName::from_str(name, false).ok(), Permutation::of_word(name));
            match driver.is_some() || ours.is_some() {
                true if order.is_some() => return Err("order is given twice".to_owned()),
                true if place > 0 => {
                    (order, permutation) = (driver.or(Some(OrderName::AsGiven)), ours);
                }
                _ => rest.push(word),
            }
        }
        let build = rest.join(",").parse().map_err(|error: BuildError| {
            format!("{error}; orders of the collisions are {}", orders())
        })?;
        Ok(Self { build, ordering: OrderingArgs { order, verify: false }, permutation })
    }
}

impl fmt::Display for SideSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.build)?;
        let order = self.ordering.order.map(OrderName::text);
        match self.permutation.map(Permutation::text).or(order) {
            Some(order) => write!(f, ",{order}"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_side_is_written_as_it_is_read() {
        for text in [
            "float",
            "half,f32,unchecked",
            "float,unchecked,hazard-free",
            "naive,body-by-body-oldest",
            "float,auto",
        ] {
            assert_eq!(text.parse::<SideSpec>().expect(text).to_string(), text);
        }
        let side: SideSpec = "float,order=as-given,unchecked".parse().expect("the same");
        assert_eq!(side.to_string(), "float,unchecked,as-given");
        let error = "float,sorted".parse::<SideSpec>().expect_err("no such word");
        assert!(error.contains("sorted") && error.contains("gpu"), "{error}");
        let error = "float,gpu,as-given".parse::<SideSpec>().expect_err("two orders");
        assert_eq!(error, "order is given twice");
        "hazard-free".parse::<SideSpec>().expect_err("no profile");
    }
}
