//! Bullet's own results, bit for bit: `pgs solve --compare` through driver, packed beats, emulated
//! DMA and emulated accelerator.
//!
//! The small scenes are in `tests/golden`. With the environment variable `PGS_VECTORS` every folder
//! below that folder is compared, too; one of them is `full_step186`, the thesis' scene.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use crate::common;
use crate::common::{run, skipped, variable};
use serde_json::Value;

/// The folder of all vectors, if there is one; reports once if there is none.
fn all_vectors() -> Option<PathBuf> {
    static ROOT: LazyLock<Option<PathBuf>> = LazyLock::new(|| {
        let root = variable("PGS_VECTORS").map(PathBuf::from);
        if root.is_none() {
            skipped("the full golden vectors, full_step186 among them (PGS_VECTORS is not set)");
        }
        root
    });
    ROOT.clone()
}

/// Folders of arrays below `root`, by name.
fn folders_below(root: &Path) -> Vec<PathBuf> {
    let mut folders: Vec<_> = std::fs::read_dir(root)
        .unwrap_or_else(|error| panic!("cannot read {}: {error}", root.display()))
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.join("params.npy").exists())
        .collect();
    folders.sort();
    folders
}

fn folders() -> Vec<PathBuf> {
    let mut folders = folders_below(&common::golden(""));
    assert_eq!(folders.len(), 8, "the small scenes of the repository");
    if let Some(root) = all_vectors() {
        let more = folders_below(&root);
        assert!(!more.is_empty(), "PGS_VECTORS={} has no folders of arrays", root.display());
        folders.extend(more);
    }
    folders
}

/// Runs `pgs solve FOLDER --json OPTIONS`; returns its document.
fn solve(folder: &Path, options: &[&str]) -> Value {
    let folder = folder.to_str().expect("a path in UTF-8");
    let ran = run([&["solve", folder, "--json"], options].concat());
    assert_eq!(ran.code, Some(0), "{folder} {options:?}: {}{}", ran.stdout, ran.stderr);
    ran.json()
}

/// Compares one stage of every folder; every array must agree in all bits.
fn compare(options: &[&str], arrays: usize) {
    for (folder, profile) in folders().iter().flat_map(|it| [(it, "float"), (it, "naive")]) {
        let board = format!("emulated:{profile}");
        let all = [&["--compare", "--board", &board], options].concat();
        let document = solve(folder, &all);
        let comparison = document["comparison"].as_array().expect("a list");
        assert_eq!(comparison.len(), arrays, "{document}");
        for array in comparison {
            assert_eq!(array["differing"], 0, "{} {options:?}: {array}", folder.display());
            assert!(array["values"].as_u64().is_some_and(|values| values > 0));
        }
    }
}

#[test]
fn the_state_at_the_end_of_the_step_is_bullets() {
    compare(&[], 4);
}

#[test]
fn the_velocities_after_each_contact_iteration_are_bullets() {
    for k in ["1", "2", "3", "4"] {
        compare(&["--contact-iterations", k, "--friction-iterations", "0", "--no-integrate"], 3);
    }
}

#[test]
fn the_velocities_after_each_friction_iteration_are_bullets() {
    for k in ["1", "2", "3", "4"] {
        compare(&["--contact-iterations", "4", "--friction-iterations", k, "--no-integrate"], 3);
    }
}

/// The digests of the small piles: the same in debug and release builds and on every processor.
#[test]
fn the_digests_of_the_small_piles_do_not_change() {
    let expected = [
        ("pile5_step60", "f2e2a74948eb842d"),
        ("pile5_step61", "ce3b73400724bc82"),
        ("pile5_step62", "1642d53f7a1fd961"),
        ("pile5_step63", "1a231cc2d6a6ac84"),
        ("pile5_step64", "56d9963b5dd9fb8d"),
    ];
    for (folder, digest) in expected {
        let document = solve(&common::golden(folder), &["--order", "as-given"]);
        assert_eq!(document["digest"]["algorithm"], "fnv1a-64");
        assert_eq!(document["digest"]["value"], digest, "{folder}");
    }
}

/// A run gives the same bits every time, everywhere: scene, collision detection, driver and board.
#[test]
fn the_digest_of_a_run_does_not_change() {
    let run = |options: &str| {
        let arguments = ["run", "--grid", "5x5x5", "--steps", "120", "--json"];
        let ran = run(arguments.into_iter().chain(options.split_whitespace()));
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        serde_json::from_str::<Value>(&ran.stdout).expect("a JSON document")
    };
    let as_bullet = "--order as-given --drop 5 --contact-iterations 4 --friction-iterations 4";
    for (options, digest) in [(as_bullet, "f4de4a33a7ed017f"), ("", "1d2a679a4001876f")] {
        for threads in ["--threads 1", "--threads 2", "--board emulated:float,fast=off"] {
            let document = run(&format!("{options} {threads}"));
            assert_eq!(document["digest"]["value"], digest, "{options} {threads}");
        }
    }
}

/// Stale reads and lost updates, as measured outside this project on the same step: 71.8 % of the
/// collisions, and 171.2 kJ where a sequential solve leaves 127.2 kJ.
#[test]
fn unchecked_hardware_adds_energy_to_the_full_step() {
    let Some(folder) = all_vectors().map(|root| root.join("full_step186")) else { return };
    if !folder.exists() {
        skipped(&format!("{} is not there", folder.display()));
        return;
    }
    let energy = |document: &Value, key: &str| document[key].as_f64().expect("J") / 1e3;
    let board = "emulated:float,unchecked,window=64";
    let unchecked = solve(&folder, &["--no-integrate", "--board", board, "--order", "as-given"]);
    let stale = unchecked["hazard_share"].as_f64().expect("a share") * 100.0;
    assert!((stale - 71.8).abs() <= 0.1, "{stale} % stale");
    let lost = energy(&unchecked, "kinetic_energy_j");
    assert!((lost - 171.2).abs() <= 0.3, "{lost} kJ with lost updates");

    let sequential = solve(&folder, &["--no-integrate", "--order", "as-given"]);
    let kept = energy(&sequential, "kinetic_energy_j");
    assert!((kept - 127.2).abs() <= 0.3, "{kept} kJ sequential");
    let before = energy(&sequential, "kinetic_energy_before_j");
    assert!((before - 154.8).abs() <= 0.3, "{before} kJ before the solve");
}
