//! The README's commands print what the README shows, and its figures are theirs.

mod common;

use std::path::{Path, PathBuf};

use common::{pgs, run};
use serde_json::Value;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn readme() -> String {
    std::fs::read_to_string(root().join("README.md")).expect("the README")
}

/// Commands of the README's `console` blocks, and the lines shown for each.
fn transcripts(readme: &str) -> Vec<(Vec<String>, String)> {
    let mut transcripts: Vec<(Vec<String>, String)> = Vec::new();
    let mut inside = false;
    for line in readme.lines() {
        if line.starts_with("```") {
            inside = line == "```console";
        } else if inside {
            if let Some(arguments) = line.strip_prefix("$ cargo run --release -- ") {
                let arguments = arguments.split_whitespace().map(str::to_owned).collect();
                transcripts.push((arguments, String::new()));
            } else {
                let (_, shown) = transcripts.last_mut().expect("a block begins with a command");
                shown.push_str(line);
                shown.push('\n');
            }
        }
    }
    transcripts
}

#[test]
fn the_readmes_commands_print_what_it_shows() {
    let transcripts = transcripts(&readme());
    assert_eq!(transcripts.len(), 3, "solve, model and check");
    for (arguments, shown) in transcripts {
        let ran = pgs()
            .current_dir(root())
            .env("PGS_BOARD", "auto")
            .args(&arguments)
            .output()
            .expect("the command starts");
        let printed = String::from_utf8(ran.stdout).expect("text");
        assert_eq!(printed, shown, "{arguments:?}");
        assert!(ran.status.success(), "{arguments:?}");
    }
}

#[test]
fn a_step_that_fails_prints_what_the_readme_shows() {
    let readme = readme();
    let (_, section) = readme.split_once("\n## When something fails\n").expect("the section");
    let (_, block) = section.split_once("\n```text\n$ cargo run --release -- ").expect("a block");
    let (block, _) = block.split_once("```").expect("its end");
    let (command, shown) = block.split_once('\n').expect("a command");
    let mut pgs = pgs();
    let ran = pgs.current_dir(root()).args(command.split_whitespace()).output();
    let ran = ran.expect("the command starts");
    assert_eq!(String::from_utf8(ran.stderr).expect("text"), shown);
    assert_eq!((ran.status.code(), ran.stdout.len()), (Some(4), 0));
}

/// The cells of the row of that profile in the table of the bitstreams.
fn bitstream<'a>(readme: &'a str, profile: &str) -> Vec<&'a str> {
    let (_, section) = readme.split_once("\n## Which bitstream\n").expect("the section");
    let begins = format!("| `{profile}` (");
    let row = section.lines().find(|line| line.starts_with(&begins)).expect("a row");
    row.trim_matches('|').split('|').map(str::trim).collect()
}

/// A share, as the table has it.
fn percent(share: &Value) -> String {
    format!("{:.1} %", 100.0 * share.as_f64().expect("a share"))
}

#[test]
#[cfg_attr(debug_assertions, ignore = "240 steps of 1,440 cubes, for a release build")]
fn the_readmes_table_of_bitstreams_holds_what_its_commands_measure() {
    let readme = readme();
    let words = readme.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        words.contains("`pgs compare float half --grid 12x10x12 --drop 5 --steps 120`"),
        "the command"
    );
    assert!(words.contains("ends with seven times the kinetic energy"), "what it ends with");
    let last = |profile: &str| {
        let command = format!("compare float {profile} --grid 12x10x12 --drop 5 --steps 120");
        let ran = run(command.split(' ').chain(["--json"]));
        assert_eq!(ran.code, Some(0), "{command}: {}", ran.stderr);
        let document: Value = serde_json::from_str(&ran.stdout).expect("one JSON document");
        document["rows"].as_array().and_then(|rows| rows.last()).expect("rows").clone()
    };
    for profile in ["half", "mixed"] {
        let row = last(profile);
        let velocities = percent(&row["difference"]["linear_velocity"]["within_1_percent_share"]);
        let still = percent(&row["b"]["unmoved_share"]);
        assert_eq!(bitstream(&readme, profile)[5..], [velocities, still], "{profile}");
        let still = percent(&row["a"]["unmoved_share"]);
        assert_eq!(bitstream(&readme, "float")[5..], [String::new(), still], "float");
        if profile == "half" {
            let [a, b] = ["a", "b"].map(|lane| row[lane]["kinetic_energy_j"].as_f64());
            let times = b.expect("J") / a.expect("J");
            assert!((6.5..7.5).contains(&times), "{times}");
        }
    }
}
