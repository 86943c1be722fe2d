//! Command line tool of the zynq-pgs driver.
fn main() {}
