//! Reads one side of a comparison: the build of its board, and the order of its collisions.

use std::fmt;
use std::str::FromStr;

use zynq_pgs::emulation::{Build, BuildError};

use pgs_command::options::ordering::{AskedOrder, OrderingArgs};

/// The specification of a side: the build of its board, and the order of its collisions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SideSpec {
    pub(super) build: Build,
    pub(super) ordering: OrderingArgs,
}

impl FromStr for SideSpec {
    type Err = String;

    /// A word for the order may stand anywhere behind the profile.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut order = None;
        let mut rest = Vec::new();
        for (place, word) in text.split(',').enumerate() {
            match AskedOrder::of_word(word) {
                Some(_) if order.is_some() => return Err("order is given twice".to_owned()),
                Some(name) if place > 0 => order = Some(name),
                _ => rest.push(word),
            }
        }
        let build = rest.join(",").parse().map_err(|error: BuildError| {
            format!("{error}; orders of the collisions are {}", AskedOrder::all())
        })?;
        Ok(Self { build, ordering: OrderingArgs { order, verify: false } })
    }
}

impl fmt::Display for SideSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.build)?;
        match self.ordering.order {
            Some(order) => write!(f, ",{}", order.text()),
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
            "half,thesis16,f32,unchecked",
            "float,unchecked,hazard-free",
            "naive,body-by-body-oldest",
            "float,auto",
        ] {
            assert_eq!(text.parse::<SideSpec>().expect(text).to_string(), text);
        }
        let side: SideSpec = "float,order=as-given,unchecked".parse().expect("the same");
        assert_eq!(side.to_string(), "float,unchecked,as-given");
        let error = "float,sorted".parse::<SideSpec>().expect_err("no such word");
        assert!(error.contains("sorted") && error.contains("colours"), "{error}");
        let error = "float,colours,as-given".parse::<SideSpec>().expect_err("two orders");
        assert_eq!(error, "order is given twice");
        "hazard-free".parse::<SideSpec>().expect_err("no profile");
    }
}
