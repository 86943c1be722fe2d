//! `pgs thesis detection`: Bullet's collisions beside ours.

use std::fs;
use std::process::Command;

use serde_json::Value;

use crate::common::{Ran, copy, golden, number, patch, pgs, run, text, variable, write};

/// Runs `pgs thesis detection --input FOLDER OPTIONS`.
fn detect(folder: &std::path::Path, options: &[&str]) -> Ran {
    run([&["thesis", "detection", "--input", text(folder)], options].concat())
}

/// The row of a table with this cell in its first column.
fn row<'a>(document: &'a Value, table: usize, column: &str, begin: &str) -> &'a Value {
    let rows = document["tables"][table]["rows"].as_array().expect("rows");
    let starts = |row: &&Value| row[column].as_str().is_some_and(|cell| cell.starts_with(begin));
    rows.iter().find(starts).unwrap_or_else(|| panic!("no {begin}: {document:#}"))
}

/// Asserts that our detection finds the folder's collisions, deep ones with the same normals.
fn assert_agrees(folder: &std::path::Path) {
    let ran = detect(folder, &["--json"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let document = &ran.json();
    // Stricter than the command: we miss none of Bullet's collisions, and none of our extra ones is
    // deep.
    let side = |name| row(document, 0, "side", name);
    assert_eq!(side("missing")["collisions"], 0, "{document}");
    assert_eq!(side("extra")["deep"], 0, "{document}");
    let deep = row(document, 1, "of", "all of pairs deeper");
    assert!(number(&deep["largest"]) < 0.01, "{document}");
    let same = |table| number(&row(document, table, "of", "same")["number"]);
    assert!(same(1) > 0.9 * number(&side("the folder's")["collisions"]), "{document}");
    let all = document["tables"][2]["rows"].as_array().expect("rows");
    let points = all[..2].iter().fold(0.0, |sum, row| sum + number(&row["number"]));
    assert!(same(2) > 0.6 * points, "{document}");
}

#[test]
fn the_piles_of_bullet_have_the_collisions_that_we_detect() {
    for name in ["one_cube", "two_cubes", "pile5_step60", "pile5_step61", "pile5_step64"] {
        assert_agrees(&golden(name));
    }
    if let Some(root) = variable("PGS_VECTORS") {
        for name in ["full_step186", "pile10_step90"] {
            let folder = std::path::Path::new(&root).join(name);
            if folder.exists() {
                assert_agrees(&folder);
            }
        }
    }
}

/// Asserts that one deep pair is on one side alone.
fn assert_one(ran: &Ran, side: &str) {
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    let line = ran.stdout.lines().map(words).find(|words| words.first().is_some_and(|w| w == side));
    assert_eq!(line.expect("a row")[1..3], ["1", "1"], "{}", ran.stdout);
}

#[test]
fn a_missing_and_an_extra_pair_are_differences() {
    // The first cube lifted off the ground: Bullet's pair is missing.
    let folder = copy("one_cube");
    patch(&folder, "body_pos.npy", 4, 1.5_f32.to_le_bytes());
    let ran = detect(folder.path(), &[]);
    assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    assert_one(&ran, "missing");
    // The second cube pressed into the ground beside the first one.
    let folder = copy("two_cubes");
    for (index, value) in [(6, 9.0_f32), (7, 0.9)] {
        patch(&folder, "body_pos.npy", index, value.to_le_bytes());
    }
    let ran = detect(folder.path(), &[]);
    assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    assert_one(&ran, "extra");
}

#[test]
fn folders_that_cannot_be_compared_are_refused_with_the_reason() {
    let refused = |name: &str, change: &dyn Fn(&tempfile::TempDir), parts: &[&str]| {
        let folder = copy(name);
        change(&folder);
        let ran = detect(folder.path(), &[]);
        assert_eq!(ran.code, Some(2), "{}{}", ran.stdout, ran.stderr);
        for part in parts {
            assert!(ran.stderr.contains(part), "no {part:?}: {}", ran.stderr);
        }
    };
    let bits = |value: f32| value.to_le_bytes();
    refused(
        "two_cubes",
        &|folder| fs::remove_file(folder.path().join("contact_points.npy")).expect("removed"),
        &["contact_points.npy", "cannot be read", "pgs solve --help"],
    );
    refused(
        "two_cubes",
        &|folder| write(folder, "body_quat.npy", "<f4", &[2, 4], &[bits(1.0)]),
        &["body_quat.npy", "(2, 4)", "(3, 4)"],
    );
    refused(
        "two_cubes",
        &|folder| patch(folder, "body_pos.npy", 4, bits(f32::NAN)),
        &["body 1", "a finite position", "NaN", "pgs thesis detection --help"],
    );
    refused(
        "two_cubes",
        &|folder| patch(folder, "body_quat.npy", 11, bits(0.5)),
        &["body 2", "an orientation of length 1", "0.5"],
    );
    refused(
        "two_cubes",
        &|folder| patch(folder, "body_pos.npy", 1, bits(-1.0)),
        &["expected body 0 to be the ground", "-1.0"],
    );
    refused(
        "two_cubes",
        &|folder| patch(folder, "contact_bodies.npy", 1, 3_u32.to_le_bytes()),
        &["contact_bodies.npy", "collision 0", "is 3, but there are 3 bodies"],
    );
    refused(
        "two_cubes",
        &|folder| {
            patch(folder, "contact_bodies.npy", 2, 1_u32.to_le_bytes());
            patch(folder, "contact_bodies.npy", 3, 0_u32.to_le_bytes());
        },
        &["two collisions have the same bodies"],
    );
    refused(
        "two_cubes",
        &|folder| patch(folder, "contact_npoints.npy", 1, 5_u32.to_le_bytes()),
        &["contact_npoints.npy", "is 5, expected at most 4"],
    );
    refused(
        "two_cubes",
        &|folder| patch(folder, "contact_normal.npy", 4, bits(0.5)),
        &["contact_normal.npy", "collision 1", "length"],
    );
    refused(
        "two_cubes",
        &|folder| patch(folder, "contact_points.npy", 3, bits(f32::INFINITY)),
        &["contact_points.npy", "collision 0", "finite", "inf"],
    );
}

#[test]
fn wrong_usage_is_refused() {
    for (options, part) in [(&[][..], "--input"), (&["--input", "x", "--grid", "3x3x3"], "--grid")]
    {
        let ran = run([&["thesis", "detection"], options].concat());
        assert_eq!(ran.code, Some(2), "{options:?}: {}", ran.stdout);
        assert!(ran.stderr.contains(part), "{options:?}: {}", ran.stderr);
    }
}

/// Without the refusal the program aborts at the allocation that finds no memory.
#[test]
fn a_grid_that_finds_no_memory_ends_in_a_sentence() {
    let command = pgs();
    let mut shell = Command::new("sh");
    shell.args(["-c", "ulimit -v 250000; exec \"$0\" \"$@\""]);
    shell.arg(command.get_program()).args(command.get_args());
    let ran: Ran = shell.args(["run", "--grid", "50x50x50"]).output().expect("a shell").into();
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("50x50x50 takes about 320000000 bytes"), "{}", ran.stderr);
}
