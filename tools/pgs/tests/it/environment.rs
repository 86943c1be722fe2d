//! Variables of the environment: a blank one counts as unset, an error names a wrong one, and the
//! command line overrides them.

use crate::common;
use crate::common::{Ran, golden, pgs};

/// `pgs solve --digest` with these variables.
fn solve(variables: &[(&str, &str)], more: &[&str]) -> Ran {
    let mut command = pgs();
    command.arg("solve").arg(golden("two_cubes")).arg("--digest").args(more);
    command.env_remove("PGS_BOARD").envs(variables.iter().copied());
    command.output().expect("it starts").into()
}

#[test]
fn a_blank_variable_is_unset() {
    for blank in ["", " ", "\t"] {
        let variables = [("PGS_BOARD", blank), ("PGS_MEMORY", blank), ("RUST_LOG", blank)];
        let ran = solve(&variables, &["--board", "emulated"]);
        assert_eq!((ran.code, ran.stderr.as_str()), (Some(0), ""), "{blank:?}");
        let ran = solve(&variables, &["--board", "emulated", "--fault", "irq-drop"]);
        assert_eq!(ran.code, Some(0), "{blank:?}: {}", ran.stderr);
        assert!(ran.stderr.contains("WARN"), "a blank RUST_LOG shows warnings: {}", ran.stderr);
        if std::path::Path::new("/sys/class/uio").exists() {
            common::skipped("this machine has UIO nodes");
            continue;
        }
        let ran = solve(&variables, &[]);
        assert_eq!(ran.code, Some(0), "{blank:?}: {}", ran.stderr);
    }
}

/// Commands that build emulated boards of their own do not run on these without a word.
#[test]
fn a_board_of_the_environment_that_is_not_taken_is_named() {
    let said = |words: &[&str], board: &str| {
        let mut command = pgs();
        command.args(words).env("PGS_BOARD", board).env("RUST_LOG", "warn");
        let ran: Ran = command.output().expect("it starts").into();
        assert_eq!(ran.code, Some(0), "{words:?}: {}", ran.stderr);
        ran.stderr
    };
    let own = "PGS_BOARD is \"uio\": this command builds emulated boards of its own";
    let half = ["thesis", "half", "--grid", "1x1x1", "--steps", "1", "--build", "half"];
    for words in [&["faults", "--list", "--board", "emulated:naive"][..], &half] {
        assert!(said(words, "uio").contains(own), "{words:?}");
        for same in ["", "auto", "emulated"] {
            assert_eq!(said(words, same), "", "{words:?}");
        }
    }
    // No board at all.
    assert_eq!(said(&["thesis", "cycles"], "uio"), "");
}

#[test]
fn a_wrong_variable_is_named_where_it_is_needed_and_nowhere_else() {
    let wrong = [("PGS_BOARD", "abacus"), ("PGS_MEMORY", "drum")];
    let ran = solve(&wrong, &[]);
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("PGS_BOARD is \"abacus\""), "{}", ran.stderr);
    let ran = solve(&wrong, &["--board", "uio"]);
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("PGS_MEMORY is \"drum\""), "{}", ran.stderr);
    let ran = solve(&wrong, &["--board", "emulated"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (Some(0), ""));
}

#[test]
fn memory_of_real_boards_in_the_environment_is_nothing_to_an_emulated_one() {
    let ran = solve(&[("PGS_MEMORY", "uio:pgs-memory")], &["--board", "emulated"]);
    assert_eq!((ran.code, ran.stderr.as_str()), (Some(0), ""));
    let mut compare = pgs();
    compare.args(["thesis", "compare", "float", "half", "--grid", "2x2x2", "--steps", "1"]);
    let ran = Ran::from(compare.env("PGS_MEMORY", "uio").output().expect("it starts"));
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
}
