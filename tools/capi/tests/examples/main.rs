//! The examples, built by the system's compilers against the committed header and both kinds of
//! library, give the bits of the same scenes in Rust.

mod compiled;
mod scenes;

use std::ffi::OsString;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use compiled::{Example, runner};

const CUBE: Example = Example {
    language: "C",
    source: "cube.c",
    standard: "-std=c99",
    compiler: ("CC", "cc"),
    own_library: None,
};

const TOWER: Example = Example {
    language: "C++",
    source: "tower.cpp",
    standard: "-std=c++17",
    compiler: ("CXX", "c++"),
    own_library: Some("-static-libstdc++"),
};

/// The folder of the libraries that cargo has built for the tests.
fn libraries() -> PathBuf {
    let test = std::env::current_exe().expect("the path of the test");
    test.parent().expect("the folder of the test").to_owned()
}

/// The arguments that link the static library.
fn with_static() -> Vec<OsString> {
    let library = libraries().join("libzynq_pgs_c.a");
    let system = ["-lpthread", "-ldl", "-lm"].map(OsString::from);
    let mut arguments: Vec<_> = [library.into_os_string()].into_iter().chain(system).collect();
    if runner().is_some() {
        // Then the loader has no part in it.
        arguments.push("-static".into());
    }
    arguments
}

/// The file name of an installed shared library.
fn shared_name() -> String {
    format!("libzynq_pgs_c.so.{}", zynq_pgs_c::ZPGS_ABI_VERSION)
}

/// Installs the shared library as docs/engines.md says; the arguments that link it. The loader looks for
/// the name with the version.
fn with_shared(folder: &Path, example: Example) -> Vec<OsString> {
    let named = folder.join(shared_name());
    fs::copy(libraries().join("libzynq_pgs_c.so"), &named).expect("the shared library");
    symlink(&named, folder.join("libzynq_pgs_c.so")).expect("a link");
    let mut path = OsString::from("-Wl,-rpath,");
    path.push(folder);
    let mut arguments = vec!["-L".into(), folder.into(), "-lzynq_pgs_c".into(), path];
    if runner().is_some() {
        // The loader finds the C library of the emulated processor, and no other.
        arguments.extend(example.own_library.map(OsString::from));
    }
    arguments
}

/// Compares the digest of an example, built with either library, with that of the scene in Rust.
fn compare(example: Example, scene: impl Fn() -> String) {
    if !example.can_compile() {
        return;
    }
    let (folder, expected) = (tempfile::tempdir().expect("a folder"), scene());
    let folder = folder.path();
    assert_eq!(example.digest(folder, "static", &with_static()), expected);
    if cfg!(target_feature = "crt-static") {
        // A build whose C library is static has no shared library.
        return;
    }
    assert_eq!(example.digest(folder, "shared", &with_shared(folder, example)), expected);
    let program = fs::read(folder.join("shared")).expect("the program");
    let named = format!("{}\0", shared_name());
    let holds = program.windows(named.len()).any(|bytes| bytes == named.as_bytes());
    assert!(holds, "the program asks for {named:?}");
}

#[test]
fn the_c_example_gives_the_drivers_bits_with_the_static_and_the_shared_library() {
    compare(CUBE, scenes::cube);
}

#[test]
fn the_cpp_example_gives_the_drivers_bits_with_the_static_and_the_shared_library() {
    compare(TOWER, scenes::tower);
}

#[test]
fn a_compiler_of_older_c_is_told_what_the_header_needs() {
    if !CUBE.can_compile() {
        return;
    }
    let refused = |standard: &str| CUBE.messages(standard);
    let found = refused("-std=c89").expect_err("too old");
    assert!(found.contains("needs C99 or newer"), "{found}");
    for standard in ["-std=c99", "-std=gnu89", "-std=c11"] {
        refused(standard).expect(standard);
    }
}
