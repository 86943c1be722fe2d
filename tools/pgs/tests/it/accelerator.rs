//! `--accelerator rtl:PATH`: a program that is no simulator is refused by name. Steps on a real one are
//! in `tools/scripts/rtl-test.sh`, which builds it.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;

use crate::common::{golden, run};

fn solve(accelerator: &str, more: &[&str]) -> (Option<i32>, String) {
    let folder = golden("one_cube");
    let folder = folder.to_str().expect("a path in UTF-8");
    let arguments = ["solve", folder, "--board", "emulated", "--accelerator", accelerator];
    let ran = run(arguments.iter().chain(more));
    (ran.code, ran.stderr)
}

fn program(folder: &Path, text: &str) -> String {
    let path = folder.join("simulator");
    fs::write(&path, text).expect("a file");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("permissions");
    format!("rtl:{}", path.display())
}

#[test]
fn a_simulator_that_is_not_there_is_named_with_the_next_step() {
    let (code, stderr) = solve("rtl:/no/such/simulator", &[]);
    assert_eq!(code, Some(2), "{stderr}");
    assert!(stderr.contains("the simulator /no/such/simulator cannot be started"), "{stderr}");
    assert!(stderr.contains("rtlgen simulator"), "{stderr}");
}

#[test]
fn a_program_that_ends_or_answers_nonsense_is_no_accelerator() {
    let folder = tempfile::tempdir().expect("a folder");
    let ends = program(folder.path(), "#!/bin/sh\nexit 0\n");
    let (code, stderr) = solve(&ends, &[]);
    assert_eq!(code, Some(2), "{stderr}");
    assert!(stderr.contains("the simulator has ended in the middle of a request"), "{stderr}");

    let nonsense = program(folder.path(), "#!/bin/sh\nprintf 'abcdefgh'\ncat >/dev/null\n");
    let (code, stderr) = solve(&nonsense, &[]);
    assert_eq!(code, Some(2), "{stderr}");
    assert!(stderr.contains("IDENTIFICATION is 0x64636261, expected 0x50475331"), "{stderr}");
}

#[test]
fn another_profile_than_the_generated_one_is_refused() {
    let (code, stderr) = solve("rtl:/no/such/simulator", &["--profile", "half"]);
    assert_eq!(code, Some(2), "{stderr}");
    assert!(stderr.contains("of profile float, not half"), "{stderr}");
}

#[test]
fn an_accelerator_is_the_model_or_a_simulator() {
    let (code, stderr) = solve("fpga", &[]);
    assert_eq!(code, Some(2), "{stderr}");
    assert!(stderr.contains("expected model, rtl:PATH or both:PATH"), "{stderr}");
}
