//! Gives the shared library its name for the loader: `libzynq_pgs_c.so.` and the version of the
//! binary interface.

use std::env;
use std::fs;

fn main() {
    println!("cargo::rerun-if-changed=src/exports.rs");
    // Linkers of other systems know no such name.
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libzynq_pgs_c.so.{}", abi_version());
    }
}

/// The number in `ZPGS_ABI_VERSION`.
fn abi_version() -> u32 {
    let source = fs::read_to_string("src/exports.rs").expect("the source of the version");
    let (_, rest) = source.split_once("ZPGS_ABI_VERSION: u32 = ").expect("the version");
    let (number, _) = rest.split_once(';').expect("the end of the version");
    number.parse().expect("a number")
}
