//! On a terminal lines are as wide as it is, at most 100 columns, and end between words.

use std::process::{Command, Stdio};

use crate::common::{Ran, run, skipped};

/// Runs `pgs` on a terminal of this width, by util-linux's `script`; the lines that it shows.
fn on_terminal(columns: usize, arguments: &str) -> Vec<String> {
    let pgs = env!("CARGO_BIN_EXE_pgs");
    let command = format!("stty rows 24 cols {columns}; exec '{pgs}' {arguments}");
    let mut script = Command::new("script");
    script.args(["-qec", &command, "/dev/null"]).env("RUST_LOG", "error");
    // Words in bold would have more characters than columns.
    script.env("NO_COLOR", "1");
    let ran: Ran = script.stdin(Stdio::null()).output().expect("script runs").into();
    ran.stdout.lines().map(|line| line.trim_end_matches('\r').to_owned()).collect()
}

fn words<'a>(lines: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    lines.into_iter().flat_map(str::split_whitespace).collect()
}

/// The short help of a run fits two screens of 24 lines; `--help` has the rest.
#[test]
fn the_short_help_of_a_run_fits_two_screens() {
    if Command::new("script").arg("--version").output().is_err() {
        return skipped("the width of terminals (script of util-linux is not installed)");
    }
    let lines = on_terminal(80, "run -h");
    assert!((20..=48).contains(&lines.len()), "{} lines: {lines:#?}", lines.len());
    assert!(lines.iter().all(|line| line.chars().count() <= 80), "{lines:#?}");
    let long = on_terminal(80, "run --help");
    for option in ["length-width=BITS", "--manager", "--every", "Examples:"] {
        let has = |lines: &[String]| lines.iter().any(|line| line.contains(option));
        assert!(has(&long) && !has(&lines), "{option}");
    }
}

#[test]
fn lines_fit_the_terminal_and_end_between_words() {
    if Command::new("script").arg("--version").output().is_err() {
        return skipped("the width of terminals (script of util-linux is not installed)");
    }
    let check = "check --board emulated";
    let piped = run(check.split(' ')).stdout;
    for columns in [60, 80, 120] {
        let fits = |lines: &[String]| {
            let wide = lines.iter().find(|line| line.chars().count() > columns.min(100));
            assert_eq!(wide, None, "{columns} columns");
        };
        let lines = on_terminal(columns, check);
        fits(&lines);
        assert_eq!(words(lines.iter().map(String::as_str)), words(piped.lines()), "{columns}");
        let lines = on_terminal(columns, "run --board emulated --grid 3x3x3 --steps 3 2>/dev/null");
        assert!(lines.iter().any(|line| line.starts_with("digest ")), "{lines:?}");
        fits(&lines);
        let lines = on_terminal(columns, "solve tests/nowhere --board emulated");
        assert!(lines.iter().any(|line| line.starts_with("  next: ")), "{lines:?}");
        fits(&lines);
    }
    // Elsewhere errors and checks are whole lines, which programs can search.
    assert!(piped.lines().any(|line| line.len() > 100), "{piped}");
}
