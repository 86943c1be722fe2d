//! This file hands the target `faults` to libFuzzer.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    if let Some(target) = fuzz::targets::by_name("faults") {
        (target.run)(data);
    }
});
