//! This file hands the target `confinement` to libFuzzer.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    if let Some(target) = fuzz::targets::by_name("confinement") {
        (target.run)(data);
    }
});
