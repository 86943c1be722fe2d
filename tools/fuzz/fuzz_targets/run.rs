// Runs the target with the name of the binary: each binary includes this file.
libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    if let Some(target) = fuzz::targets::by_name(env!("CARGO_BIN_NAME")) {
        (target.run)(data);
    }
});
