//! Tests of the command line tool as its users run it.
//!
//! One program, as each more would be linked with all of the crate.

#[path = "../common/mod.rs"]
mod common;
#[path = "../../src/loading/tests/files.rs"]
#[allow(dead_code, reason = "the tests of the parts use more of it")]
mod files_to_load;
#[path = "../../../folder/tests/filter/mod.rs"]
mod filter;

mod accelerator;
mod arrays;
mod bad_input;
mod check;
mod command_line;
mod compare;
mod detect;
mod documents;
mod environment;
mod examples;
mod faults;
mod files;
mod golden;
mod kill;
mod list;
#[cfg(feature = "live")]
mod live;
mod load;
mod model;
mod order;
mod paths;
mod recipes;
mod results;
mod run;
mod saturated;
mod serve;
mod signals;
mod study;
mod study_more;
mod threads;
mod traced;
mod width;
mod workflows;
