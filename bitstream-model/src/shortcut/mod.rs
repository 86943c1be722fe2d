#![doc = include_str!("README.md")]

pub(crate) mod batch;
mod deferred;
mod flow;

use crate::board::short_cut::ShortCut;
use crate::config::BoardConfig;
use deferred::Deferred;
use deferred::eligible::Layout;

/// The short cut of a board, if it is to have one and its design is known to it.
pub(crate) fn of(config: &BoardConfig) -> Option<Box<dyn ShortCut>> {
    let layout = Layout::of(config).filter(|_| config.shortcuts)?;
    Some(Box::new(Deferred::new(config, layout)))
}
