//! `pgs thesis order`: its table, on the scenes of the repository and, with `PGS_VECTORS`, on the
//! thesis' scene, whose figures were measured outside this project.

use std::path::PathBuf;

use crate::common;
use crate::common::{golden, number, run, skipped, text, variable};
use serde_json::Value;

/// Runs `pgs thesis order --json`; returns its document.
fn order(arguments: &[&str]) -> Value {
    let ran = run([&["thesis", "order", "--json"], arguments].concat());
    assert_eq!(ran.code, Some(0), "{arguments:?}: {}{}", ran.stdout, ran.stderr);
    ran.json()
}

/// The row of an order at a depth.
fn row<'a>(document: &'a Value, order: &str, depth: u64) -> &'a Value {
    let rows = document["tables"][0]["rows"].as_array().expect("a list");
    let found = rows.iter().find(|row| row["order"] == order && row["depth"] == depth);
    found.unwrap_or_else(|| panic!("no row {order} {depth} in {document:#}"))
}

#[test]
fn every_order_is_shown_at_every_depth_and_ours_has_no_hazard() {
    let folder = golden("pile5_step60");
    let scenes = [
        &["--input", text(&folder), "--depth", "1,4,16,192"][..],
        &["--grid", "4x5x4", "--drop", "0.05", "--steps", "30", "--depth", "1,4,16,192"],
        &["--input", text(&folder), "--depth", "1,4,16,192", "--per-issue", "2"],
    ];
    for arguments in scenes {
        let document = order(arguments);
        let rows = document["tables"][0]["rows"].as_array().expect("a list");
        // As given, random, three of the thesis, two of ours.
        assert_eq!(rows.len(), 4 * 7, "{arguments:?}");
        for depth in [1, 4, 16, 192] {
            let ours = row(&document, "hazard-free", depth);
            assert_eq!((&ours["hazards"], &ours["lost_updates"]), (&0.into(), &0.into()));
        }
        for row in rows.iter().filter(|row| row["order"] != "hazard-free") {
            assert_eq!(row["empty"], 0, "{row:#}");
        }
        assert!(number(&row(&document, "random", 16)["slots"]) > 50.0);
    }
}

#[test]
fn what_cannot_be_ordered_is_refused() {
    let folder = golden("pile5_step60");
    for arguments in [
        &["--depth", "0"][..],
        &["--depth", "16385"],
        &["--per-issue", "0"],
        &["--input", text(&folder), "--grid", "2x2x2"],
        &["--input", "nowhere"],
        &["--grid", "2x2x2", "--drop", "-1"],
    ] {
        let ran = run([&["thesis", "order"], arguments].concat());
        assert_eq!(ran.code, Some(2), "{arguments:?}: {}", ran.stderr);
        assert!(ran.stdout.is_empty() && ran.stderr.contains("error:"), "{arguments:?}");
    }
    let broken = common::copy("pile5_step60");
    common::patch(&broken, "contact_bodies.npy", 5, 126_u32.to_le_bytes());
    let ran = run(["thesis", "order", "--input", text(broken.path())]);
    assert_eq!(ran.code, Some(2));
    assert!(ran.stderr.contains("collision 2 names body 126, there are 126"), "{}", ran.stderr);
}

#[test]
fn a_gpu_order_that_is_no_permutation_is_refused() {
    let folder = common::copy("two_cubes");
    let write = |data: &[[u8; 4]]| common::write(&folder, "gpu_order.npy", "<u4", &[2], data);
    write(&[1_u32.to_le_bytes(), 0_u32.to_le_bytes()]);
    let document = order(&["--input", text(folder.path()), "--depth", "2"]);
    assert_eq!(row(&document, "Bullet's GPU batches", 2)["hazards"], 1);
    for wrong in [1, 2_u32] {
        write(&[wrong.to_le_bytes(), 1_u32.to_le_bytes()]);
        let ran = run(["thesis", "order", "--input", text(folder.path())]);
        assert_eq!(ran.code, Some(2));
        assert!(ran.stderr.contains("each index below 2 once"), "{}", ran.stderr);
    }
}

/// A board without a queue takes the cheaper order of each step, and each step's report names it.
#[test]
fn each_step_of_a_run_says_its_order() {
    let scene = "run --json --board emulated:half --grid 1x3x1 --steps 80 --drop 0.3";
    let ran = run(scene.split(' '));
    let document = ran.json();
    let steps = document["steps"].as_array().expect("steps");
    let mut counted = Vec::<(&str, u32)>::new();
    for name in steps.iter().map(|step| step["order"]["name"].as_str().expect("a name")) {
        match counted.iter_mut().find(|(known, _)| *known == name) {
            Some((_, steps)) => *steps += 1,
            None => counted.push((name, 1)),
        }
    }
    assert!(counted.len() == 2 && counted.iter().all(|(_, steps)| *steps > 0), "{counted:?}");

    let short = ["run", "--board", "emulated:float,unchecked", "--grid", "3x3x3", "--steps", "3"];
    let one = run([&short[..], &["--order", "hazard-free"]].concat()).stdout;
    assert!(one.contains("order      hazard-free\n"), "{one}");
}

/// `full_step186`, if it exists; reports once if it does not.
fn full_step() -> Option<PathBuf> {
    let Some(root) = variable("PGS_VECTORS").map(PathBuf::from) else {
        skipped("the orders of full_step186 (PGS_VECTORS is not set)");
        return None;
    };
    let folder = root.join("full_step186");
    if !folder.exists() {
        skipped(&format!("{} is not there", folder.display()));
        return None;
    }
    Some(folder)
}

/// Measured outside this project on the same step.
#[test]
fn the_full_step_has_the_hazards_and_live_bodies_that_others_measured() {
    let Some(folder) = full_step() else { return };
    let document = order(&["--input", text(&folder)]);
    let percent = |order: &str, depth| number(&row(&document, order, depth)["hazard_percent"]);
    let alive = |order: &str| number(&row(&document, order, 64)["most_alive"]);
    for (order, shares, most) in [
        ("as given", [71.0, 71.8, 80.0], 2_173.0),
        ("Bullet's GPU batches", [4.3, 32.9, 59.6], 13_933.0),
    ] {
        for (depth, share) in [16, 64, 128].into_iter().zip(shares) {
            let found = percent(order, depth);
            assert!((found - share).abs() <= 0.1, "{order} {depth}: {found} %");
        }
        assert_eq!(alive(order).to_bits(), f64::to_bits(most), "{order}");
    }
    for (depth, share) in [(16, 0.15), (64, 0.61), (128, 1.2)] {
        let found = percent("random", depth);
        assert!((found - share).abs() <= 0.1, "random {depth}: {found} %");
    }
    assert!((alive("random") - 34_473.0).abs() <= 100.0);
    for (ties, most) in [("lowest index", 801.0), ("oldest", 1_150.0), ("newest", 2_297.0)] {
        let thesis = format!("thesis, {ties}");
        assert_eq!(alive(&thesis).to_bits(), f64::to_bits(most), "{thesis}");
        for depth in [16, 64, 128] {
            let found = percent(&thesis, depth);
            assert!((95.0..=99.5).contains(&found), "{thesis} {depth}: {found} %");
        }
    }
}

#[test]
fn the_full_step_is_ordered_without_hazards_and_with_hardly_an_empty_slot() {
    let Some(folder) = full_step() else { return };
    let document = order(&["--input", text(&folder)]);
    for (depth, empty) in [(16, 0.1), (32, 0.1), (64, 0.1), (96, 0.2), (128, 0.2), (192, 0.4)] {
        let ours = row(&document, "hazard-free", depth);
        assert_eq!(ours["hazards"], 0, "{depth}");
        assert!(number(&ours["empty_percent"]) <= empty, "{depth}: {ours:#}");
        assert!(number(&ours["most_alive"]) <= 2_300.0, "{depth}: about those as given");
    }
}
