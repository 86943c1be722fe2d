//! Finds out whether the compiler knows AVX-512.

use std::env;
use std::process::Command;

/// The minor version of Rust 1 with which its intrinsics became stable.
const AVX512: u32 = 89;

fn main() {
    println!("cargo::rustc-check-cfg=cfg(avx512)");
    println!("cargo::rerun-if-changed=build.rs");
    // Where the version is unknown, the lanes do without AVX-512: no result depends on it.
    if minor_version().is_some_and(|minor| minor >= AVX512) {
        println!("cargo::rustc-cfg=avx512");
    }
}

fn minor_version() -> Option<u32> {
    let ran = Command::new(env::var_os("RUSTC")?).arg("--version").output().ok()?;
    let text = String::from_utf8(ran.stdout).ok()?;
    // rustc 1.89.0 (29483883e 2025-08-04)
    let version = text.split_whitespace().nth(1)?;
    version.strip_prefix("1.")?.split('.').next()?.parse().ok()
}
