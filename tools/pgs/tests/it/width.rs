//! On a terminal lines are as wide as it is and end between words, in its colours.

use std::process::{Command, Stdio};

use crate::common::{Ran, pgs, run, skipped};

/// Runs `pgs` on a terminal of this width, by util-linux's `script`; the lines that it shows.
fn on_terminal(columns: usize, arguments: &str) -> Vec<String> {
    // Words in colours would have more characters than columns.
    coloured(columns, arguments, false)
}

/// The same; the terminal wants colours or does not.
fn coloured(columns: usize, arguments: &str, wants: bool) -> Vec<String> {
    let pgs = env!("CARGO_BIN_EXE_pgs");
    let command = format!("stty rows 24 cols {columns}; exec '{pgs}' {arguments}");
    let mut script = Command::new("script");
    script.args(["-qec", &command, "/dev/null"]).env("RUST_LOG", "error").env("TERM", "xterm");
    script.env("PGS_BOARD", "emulated").env_remove("NO_COLOR").env_remove("CLICOLOR");
    if !wants {
        script.env("NO_COLOR", "1");
    }
    let ran: Ran = script.stdin(Stdio::null()).output().expect("script runs").into();
    ran.stdout.lines().map(|line| line.trim_end_matches('\r').to_owned()).collect()
}

fn words<'a>(lines: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    lines.into_iter().flat_map(str::split_whitespace).collect()
}

/// Whether terminals can be had here.
fn has_terminals() -> bool {
    let has = Command::new("script").arg("--version").output().is_ok();
    if !has {
        skipped("the width of terminals (script of util-linux is not installed)");
    }
    has
}

/// The lines of a command on a terminal, none of them wider than this.
fn fitting(columns: usize, arguments: &str) -> Vec<String> {
    let lines = on_terminal(columns, arguments);
    let wide: Vec<_> = lines.iter().filter(|line| line.chars().count() > columns).collect();
    assert!(wide.is_empty(), "pgs {arguments}, {columns} columns: {wide:#?}");
    assert!(lines.len() > 1, "pgs {arguments}: {lines:?}");
    lines
}

#[test]
fn the_first_help_fits_a_screen_and_that_of_a_run_two() {
    if !has_terminals() {
        return;
    }
    for (arguments, most) in [("-h", 30), ("run -h", 48)] {
        let lines = fitting(80, arguments);
        assert!((20..=most).contains(&lines.len()), "pgs {arguments}: {lines:#?}");
    }
    let (short, long) = (on_terminal(80, "run -h"), on_terminal(80, "run --help"));
    for option in ["length-width=BITS", "--manager", "--retries", "Examples:"] {
        let has = |lines: &[String]| lines.iter().any(|line| line.contains(option));
        assert!(has(&long) && !has(&short), "{option}");
    }
}

#[test]
fn no_line_of_help_is_broken_within_a_word() {
    if !has_terminals() {
        return;
    }
    for verb in ["", "run", "solve", "list", "check", "faults", "serve", "load", "thesis"] {
        for help in ["-h", "--help"] {
            let arguments = format!("{verb} {help}");
            let piped = run(arguments.split_whitespace()).stdout;
            for columns in [60, 80, 120] {
                let lines = fitting(columns, &arguments);
                let shown = words(lines.iter().map(String::as_str));
                assert_eq!(shown, words(piped.lines()), "pgs {arguments}, {columns} columns");
            }
        }
    }
}

#[test]
fn no_line_of_output_is_broken_within_a_word() {
    if !has_terminals() {
        return;
    }
    let check = run(["check"]).stdout;
    for columns in [60, 80, 120] {
        let shown = |arguments: &str| fitting(columns, &format!("{arguments} 2>/dev/null"));
        let lines = shown("check");
        assert_eq!(words(lines.iter().map(String::as_str)), words(check.lines()), "{columns}");
        let lines = shown("run --grid 3x3x3 --steps 3");
        let end = lines.iter().rposition(|line| line.is_empty()).expect("a blank line");
        let labels = lines[end + 1..].iter().filter(|line| !line.starts_with(' ')).count();
        assert_eq!(labels, 5, "{lines:#?}");
        assert!(columns < 80 || lines.len() - end - 1 == 5, "{lines:#?}");
        shown("run --scene shapes --grid 2x2x2 --steps 2");
        shown("list");
        shown("faults --board emulated:naive");
        shown("faults --list --board emulated:half");
        let lines = fitting(columns, "solve tests/nowhere --board emulated");
        assert!(lines.iter().any(|line| line.starts_with("  next: ")), "{lines:?}");
    }
    // Elsewhere errors and checks are whole lines, which programs can search.
    assert!(check.lines().any(|line| line.len() > 100), "{check}");
}

/// The colours of a verdict: on a terminal, or where they are asked for.
#[test]
fn a_terminal_gets_colours_unless_an_option_or_a_variable_forbids() {
    let shown = |arguments: &str, variables: &[(&str, &str)]| {
        let mut pgs = pgs();
        pgs.env_remove("NO_COLOR").envs(variables.iter().copied());
        Ran::from(pgs.args(arguments.split(' ')).output().expect("it starts"))
    };
    let (green, red) = ("\u{1b}[32mok\u{1b}[0m", "\u{1b}[1m\u{1b}[31m");
    assert!(!shown("check", &[]).stdout.contains('\u{1b}'), "a pipe");
    assert!(shown("check --color always", &[]).stdout.contains(green));
    let failed = shown("check --quirk stale --color=always", &[]).stdout;
    assert!(failed.contains(&format!("{red}FAIL")), "{failed}");
    for wrong in ["--color always solve tests/nowhere", "--color always frobnicate"] {
        let refused = shown(wrong, &[]).stderr;
        assert!(refused.starts_with(&format!("{red}error:")), "{refused:?}");
    }
    if has_terminals() {
        let check = |more: &str, unset: bool| {
            let lines = coloured(80, &format!("check {more}"), unset);
            lines.iter().any(|line| line.contains('\u{1b}'))
        };
        assert!(check("", true) && !check("", false), "NO_COLOR");
        assert!(!check("--color never", true) && check("--color always", false));
    }
}
