//! Options that several verbs share, and how each is written on the command line.

pub(crate) mod bandwidth;
pub(crate) mod build;
pub(crate) mod memory;
pub(crate) mod ordering;
pub(crate) mod planned;
pub(crate) mod scenes;
pub(crate) mod solver;
