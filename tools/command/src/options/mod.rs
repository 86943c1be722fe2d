//! Options that several verbs share, and how each is written on the command line.

pub mod bandwidth;
pub mod build;
pub mod memory;
pub mod ordering;
pub mod planned;
pub mod scenes;
pub mod solver;
