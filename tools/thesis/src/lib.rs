//! The thesis' tables and figures again, from our own numbers: formulas, and steps of a board.

#![forbid(unsafe_code)]

mod command;
mod compare;
mod detect;
mod deviation;
pub mod estimate;
mod experiment;
mod figure;
mod formats;
mod formulas;
mod index;
mod narrow;
mod order;
mod permutation;
mod report;
mod session;
mod study;
mod table;

pub use self::command::ThesisArgs;
