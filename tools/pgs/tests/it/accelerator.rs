//! `--accelerator rtl:PATH`: a program that is no simulator is refused by name. Steps on a real one
//! are in `tools/scripts/rtl-test.sh`, which builds it.

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::Path;
use std::process::{Command, Stdio};

use crate::common::{Ran, Tied, golden, pgs, run};

fn solve(accelerator: &str, more: &[&str]) -> (Option<i32>, String) {
    let folder = golden("one_cube");
    let folder = folder.to_str().expect("a path in UTF-8");
    let arguments = ["solve", folder, "--accelerator", accelerator];
    let ran = run(arguments.iter().chain(more));
    (ran.code, ran.stderr)
}

fn program(folder: &Path, text: &str) -> String {
    let path = folder.join("simulator");
    // Another process writes the file. Written here, a child that another test starts at this
    // moment would inherit the open file, and the kernel refuses to execute a file open for
    // writing.
    let writes = "printf %s \"$1\" > \"$0\" && chmod 755 \"$0\"";
    let written = Command::new("sh").args(["-c", writes]).arg(&path).arg(text).status();
    assert!(written.expect("a shell").success());
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

/// A program that answers the reads of IDENTIFICATION, PROFILE and FEATURES as a `float`.
#[test]
fn a_simulator_of_another_profile_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let words = "1SGP\\001\\000\\000\\000\\000\\000\\000\\000";
    let float = program(folder.path(), &format!("#!/bin/sh\nprintf '{words}'\ncat >/dev/null\n"));
    let (code, stderr) = solve(&float, &["--board", "emulated:half"]);
    assert_eq!(code, Some(2), "{stderr}");
    assert!(stderr.contains("float") && stderr.contains("half"), "{stderr}");
}

/// A program that answers the reads of IDENTIFICATION, PROFILE and FEATURES as an interlocked
/// `float` with isotropic inertia.
#[test]
fn a_simulator_of_another_inertia_is_refused_with_the_next_step() {
    let folder = tempfile::tempdir().expect("a folder");
    let words = "1SGP\\001\\000\\000\\000\\001\\000\\000\\000";
    let isotropic =
        program(folder.path(), &format!("#!/bin/sh\nprintf '{words}'\ncat >/dev/null\n"));
    let (code, stderr) = solve(&isotropic, &["--board", "emulated:float,world"]);
    assert_eq!(code, Some(2), "{stderr}");
    assert!(stderr.contains("built for isotropic inertia, and the board for world"), "{stderr}");
    assert!(
        stderr
            .contains("add the word isotropic to the board, or build the simulator with --inertia"),
        "{stderr}"
    );
}

fn serve(folder: &Path, accelerator: &str, more: &[&str]) -> Command {
    let mut command = pgs();
    command.args(["serve", "--memory-mib", "16", "--accelerator", accelerator]).args(more);
    command.arg("--socket").arg(folder.join("board"));
    command
}

#[test]
fn a_board_is_not_served_without_its_simulator() {
    let folder = tempfile::tempdir().expect("a folder");
    let ran = Ran::from(serve(folder.path(), "rtl:/no/such", &[]).output().expect("it runs"));
    assert_eq!((ran.code, ran.stdout.as_str()), (Some(2), ""), "{}", ran.stderr);
    assert!(ran.stderr.contains("the simulator /no/such cannot be started"), "{}", ran.stderr);
    let left = fs::read_dir(folder.path()).expect("a folder").count();
    assert_eq!(left, 0, "neither a socket nor memory is left");
}

#[test]
fn a_served_board_whose_simulator_ends_says_so_and_is_served_no_more() {
    let folder = tempfile::tempdir().expect("a folder");
    // It answers the first five requests: the identification, the profile, the features of an
    // interlocked accelerator, and no fence.
    let one = "\\001\\000\\000\\000";
    let none = "\\000\\000\\000\\000";
    let five_requests = format!("printf '1SGP{one}{one}{none}{none}'\nhead -c 60 >/dev/null\n");
    let ends = program(folder.path(), &format!("#!/bin/sh\n{five_requests}"));
    let mut command = serve(folder.path(), &ends, &[]);
    let server = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    let mut server = Tied(server);
    let mut lines = BufReader::new(server.0.stdout.as_mut().expect("a pipe")).lines();
    let serving = lines.find(|line| line.as_ref().is_ok_and(|line| line.starts_with("serving ")));
    assert!(serving.is_some(), "a board is served");

    let board = format!("socket:{}", folder.path().join("board").display());
    let ran = run(["--board", &board, "--grid", "2x2x2"]);
    assert_eq!(ran.code, Some(3), "{}", ran.stderr);

    let mut stderr = String::new();
    server.0.stderr.as_mut().expect("a pipe").read_to_string(&mut stderr).expect("text");
    assert_eq!(server.0.wait().expect("it ends").code(), Some(4), "{stderr}");
    let told = "error: the simulator has ended in the middle of a request";
    assert!(stderr.contains(told) && stderr.contains("next: serve the board again"), "{stderr}");
}

#[test]
fn the_accelerator_of_a_comparison_is_board_b() {
    let ran =
        run("thesis compare float float --grid 2x2x2 --steps 1 --accelerator rtl:/no/such"
            .split(' '));
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("board B (float)"), "{}", ran.stderr);
    assert!(ran.stderr.contains("the simulator /no/such cannot be started"), "{}", ran.stderr);
}

#[test]
fn an_experiment_steps_a_scene_on_the_accelerator_and_detection_has_none() {
    let scene = "thesis formats --grid 2x2x2 --step 2 --board emulated --accelerator rtl:/no/such";
    let ran = run(scene.split(' '));
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("the simulator /no/such cannot be started"), "{}", ran.stderr);
    let folder = golden("one_cube");
    let folder = folder.to_str().expect("a path in UTF-8");
    let ran = run(["thesis", "detection", "--input", folder, "--accelerator", "rtl:/no/such"]);
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("unexpected argument '--accelerator'"), "{}", ran.stderr);
}

#[test]
fn an_accelerator_is_the_model_or_a_simulator() {
    let (code, stderr) = solve("fpga", &[]);
    assert_eq!(code, Some(2), "{stderr}");
    assert!(stderr.contains("expected model, rtl:PATH or both:PATH"), "{stderr}");
}
