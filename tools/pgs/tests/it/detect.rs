//! `pgs detect`: times of the detection, and Bullet's collisions beside ours.

use std::fs;
use std::process::Command;

use serde_json::Value;

use crate::common::{Ran, copy, golden, number, patch, pgs, run, text, variable, write};

/// Runs `pgs detect --input FOLDER OPTIONS`.
fn detect(folder: &std::path::Path, options: &[&str]) -> Ran {
    run([&["detect", "--input", text(folder)], options].concat())
}

/// Asserts that our detection finds the folder's collisions, and that every difference has a cause.
fn assert_agrees(folder: &std::path::Path) -> Value {
    let ran = detect(folder, &["--compare", "--json", "--runs", "1"]);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let document = ran.json();
    let comparison = &document["comparison"];
    assert_eq!(comparison["agrees"], true, "{document}");
    // Stricter than the verb: we miss none of Bullet's collisions, and none of our extra ones is deep.
    assert_eq!(comparison["missing"]["collisions"], 0, "{document}");
    assert_eq!(comparison["extra"]["deep"], 0, "{document}");
    for kind in ["normals_degrees", "points_m"] {
        assert_eq!(comparison[kind]["unknown"]["number"], 0, "{document}");
    }
    let deep = &comparison["normals_degrees"]["deep"];
    assert!(number(&deep["largest"]) < 0.01, "{document}");
    let same = |kind: &str| number(&comparison[kind]["same"]["number"]);
    assert!(same("normals_degrees") > 0.9 * number(&comparison["folder_collisions"]), "{document}");
    assert!(same("points_m") > 0.6 * number(&comparison["our_points"]), "{document}");
    document
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

#[test]
fn both_phases_print_their_times_from_nothing_and_with_everything_kept() {
    let ran = detect(&golden("pile5_step62"), &[]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let lines: Vec<&str> =
        ran.stdout.lines().filter(|line| line.starts_with("detection ")).collect();
    assert!(lines.len() == 2 && lines[0].contains("from nothing"), "{}", ran.stdout);
    assert!(lines.iter().all(|line| line.contains("broad phase") && line.contains("narrow phase")));
    assert!(!ran.stdout.contains("missing"), "{}", ran.stdout);
}

#[test]
fn a_scene_is_detected_without_a_folder() {
    for options in ["--grid 4x3x4 --drop 0", "--scene shapes --grid 4x4x4 --threads 2"] {
        let words = ["detect", "--json"].into_iter().chain(options.split(' '));
        let ran = run(words);
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        let document = ran.json();
        // Nothing moves yet.
        assert_eq!(document["first"]["pairs"], document["next"]["pairs"], "{document}");
        assert_eq!(document["comparison"], Value::Null);
    }
    let document = run(["detect", "--json", "--grid", "4x3x4", "--drop", "0"]).json();
    // 16 on the ground; a layer of 4 x 4 lies on the next in 7 x 7 pairs.
    assert_eq!(document["ground_collisions"], 16);
    assert_eq!(document["collisions"], 16 + 2 * 49);
    assert_eq!(document["points"], 4 * (16 + 2 * 49));
}

#[test]
fn a_missing_and_an_extra_pair_are_differences() {
    // The first cube lifted off the ground: Bullet's pair is missing.
    let folder = copy("one_cube");
    patch(&folder, "body_pos.npy", 4, 1.5_f32.to_le_bytes());
    let ran = detect(folder.path(), &["--compare"]);
    assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    assert!(ran.stdout.contains("missing    1, 1 of them deeper"), "{}", ran.stdout);
    // The second cube pressed into the ground beside the first one.
    let folder = copy("two_cubes");
    for (index, value) in [(6, 9.0_f32), (7, 0.9)] {
        patch(&folder, "body_pos.npy", index, value.to_le_bytes());
    }
    let ran = detect(folder.path(), &["--compare"]);
    assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    assert!(ran.stdout.contains("extra      1, 1 of them deeper"), "{}", ran.stdout);
    // Without a comparison there is nothing to differ.
    assert_eq!(detect(folder.path(), &[]).code, Some(0));
}

#[test]
fn folders_that_cannot_be_compared_are_refused_with_the_reason() {
    let refused = |name: &str, change: &dyn Fn(&tempfile::TempDir), parts: &[&str]| {
        let folder = copy(name);
        change(&folder);
        let ran = detect(folder.path(), &["--compare"]);
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
        &["body 1", "a finite position", "NaN", "pgs detect --help"],
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
        &|folder| patch(folder, "body_inv_mass.npy", 0, bits(1.0)),
        &["body_inv_mass.npy", "body 0 to be static"],
    );
    refused(
        "two_cubes",
        &|folder| patch(folder, "body_inv_mass.npy", 2, bits(0.0)),
        &["body_inv_mass.npy", "one static body", "body 2"],
    );
    refused(
        "two_cubes",
        &|folder| patch(folder, "contact_bodies.npy", 1, 3_u32.to_le_bytes()),
        &["contact_bodies.npy", "collision 0", "below 3", "0 and 3"],
    );
    refused(
        "two_cubes",
        &|folder| {
            patch(folder, "contact_bodies.npy", 2, 1_u32.to_le_bytes());
            patch(folder, "contact_bodies.npy", 3, 0_u32.to_le_bytes());
        },
        &["contact_bodies.npy", "collision 1", "1 and 0", "earlier collision"],
    );
    refused(
        "two_cubes",
        &|folder| patch(folder, "contact_npoints.npy", 1, 5_u32.to_le_bytes()),
        &["contact_npoints.npy", "at most 4", "found 5"],
    );
    refused(
        "two_cubes",
        &|folder| patch(folder, "contact_normal.npy", 4, bits(0.5)),
        &["contact_normal.npy", "collision 1", "length 1"],
    );
    refused(
        "two_cubes",
        &|folder| patch(folder, "contact_points.npy", 3, bits(f32::INFINITY)),
        &["contact_points.npy", "collision 0, point 0", "finite", "inf"],
    );
}

#[test]
fn wrong_usage_is_refused() {
    for (options, part) in [
        (&["--compare"][..], "--input"),
        (&["--input", "x", "--grid", "3x3x3"], "--grid"),
        (&["--broad-phase", "sweep"], "--broad-phase"),
        (&["--grid", "180x1000x180"], "give a smaller --grid"),
        (&["--accelerator", "model"], "--accelerator"),
    ] {
        let ran = run([&["detect"], options].concat());
        assert_eq!(ran.code, Some(2), "{options:?}: {}", ran.stdout);
        assert!(ran.stderr.contains(part), "{options:?}: {}", ran.stderr);
    }
    let help = run(["detect", "--help"]);
    assert_eq!(help.code, Some(0));
    assert!(help.stdout.contains("pgs detect --input tests/golden/pile5_step60 --compare"));
}

/// Without the refusal the program aborts at the allocation that finds no memory.
#[test]
fn a_grid_that_finds_no_memory_ends_in_a_sentence() {
    let command = pgs();
    let mut shell = Command::new("sh");
    shell.args(["-c", "ulimit -v 500000; exec \"$0\" \"$@\""]);
    shell.arg(command.get_program()).args(command.get_args());
    let ran: Ran = shell.args(["detect", "--grid", "60x100x60"]).output().expect("a shell").into();
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("60x100x60 takes about 921600000 bytes"), "{}", ran.stderr);
}
