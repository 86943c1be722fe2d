#![doc = include_str!("README.md")]

pub(crate) mod batch;
mod deferred;
mod flow;

use crate::board::short_cut::ShortCut;
use crate::config::BoardConfig;
use deferred::Deferred;
use deferred::eligible::Layout;
use flow::fast_forward::FastForward;

/// The short cut of a board, if it is to have one and its design is known to it.
pub(crate) fn of(config: &BoardConfig) -> Option<Box<dyn ShortCut>> {
    let layout = Layout::of(config).filter(|_| config.shortcuts)?;
    Some(Box::new(FastForward::new(Deferred::new(config, layout))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use pgs_interface::profile::{FLOAT, HALF, NAIVE};

    #[test]
    fn designs_that_are_known_have_short_cuts_unless_these_are_switched_off() {
        for (profile, known) in [(&FLOAT, true), (&HALF, true), (&NAIVE, false)] {
            let config = BoardConfig { profile, ..BoardConfig::default() };
            assert_eq!(of(&config).is_some(), known, "{}", profile.name);
            assert!(of(&BoardConfig { shortcuts: false, ..config }).is_none(), "{}", profile.name);
        }
    }
}
