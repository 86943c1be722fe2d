//! The README's commands print what the README shows.

mod common;

use std::path::Path;

use common::pgs;

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
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let readme = std::fs::read_to_string(root.join("README.md")).expect("the README");
    let transcripts = transcripts(&readme);
    assert_eq!(transcripts.len(), 2, "solve and model");
    for (arguments, shown) in transcripts {
        let ran = pgs()
            .current_dir(&root)
            .env("PGS_BOARD", "auto")
            .args(&arguments)
            .output()
            .expect("the command starts");
        let printed = String::from_utf8(ran.stdout).expect("text");
        assert_eq!(printed, shown, "{arguments:?}");
        assert!(ran.status.success(), "{arguments:?}");
    }
}
