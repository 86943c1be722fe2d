//! The workflows run every stage of the check, and name each action by its commit.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

const WORKFLOWS: [&str; 2] = [".github/workflows/check.yml", ".github/workflows/scheduled.yml"];

fn text(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn every_stage_of_the_check_stands_in_a_workflow() {
    let words = |text: &str| -> BTreeSet<String> {
        let word = |c: char| !(c.is_ascii_alphanumeric() || c == '-');
        text.split(word).map(str::to_owned).collect()
    };
    let mut known = BTreeSet::new();
    for workflow in WORKFLOWS {
        let text = text(workflow);
        known.extend(text.lines().filter(|line| line.contains("stages: ")).flat_map(words));
    }
    let check = text(".ci/run");
    let lists = ["always=(", "while_time=(", "scheduled=(", "by_name=("].map(|list| {
        let line = check.lines().find_map(|line| line.strip_prefix(list)).expect(list);
        words(line.trim_end_matches(')'))
    });
    let stages: BTreeSet<_> = lists.into_iter().flatten().collect();
    assert!(stages.len() > 25, "{stages:?}");
    let missing: Vec<_> = stages.difference(&known).collect();
    assert_eq!(missing, Vec::<&String>::new());
}

#[test]
fn every_action_is_named_by_its_commit_and_its_version() {
    let mut actions = 0;
    for workflow in WORKFLOWS {
        for line in text(workflow).lines() {
            let Some((_, action)) = line.split_once("uses: ") else { continue };
            let (commit, version) = action
                .split_once('@')
                .and_then(|(_, commit)| commit.split_once(" # v"))
                .expect(line);
            assert!(commit.len() == 40 && commit.chars().all(|c| c.is_ascii_hexdigit()), "{line}");
            assert_eq!(version.split('.').filter(|part| part.parse::<u32>().is_ok()).count(), 3);
            actions += 1;
        }
    }
    assert_eq!(actions, 3);
}
