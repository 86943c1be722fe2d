//! Runs a target for libFuzzer: the one that the variable `FUZZ_TARGET` names.
#![no_main]

use std::sync::LazyLock;

use fuzz::targets::{self, Target};

static TARGET: LazyLock<&'static Target> = LazyLock::new(|| {
    let name = std::env::var("FUZZ_TARGET").unwrap_or_default();
    targets::by_name(&name).unwrap_or_else(|| panic!("FUZZ_TARGET is {name:?}, and no target"))
});

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    (TARGET.run)(data);
});
