//! Experiments of `pgs thesis` that step a board: its figures agree with single runs, whose results are compared here by hand, and with
//! `PGS_VECTORS` on the thesis' scene with figures that were measured outside this project.

use std::fs;
use std::path::Path;

use crate::common::{
    DATA, copy, golden, near, number, run, skipped, text, variable, write as write_array,
};
use serde_json::Value;

/// Runs `pgs thesis --json`; returns its document.
fn study(arguments: &[&str]) -> Value {
    let ran = run([&["thesis"], arguments, &["--json"]].concat());
    assert_eq!(ran.code, Some(0), "{arguments:?}: {}{}", ran.stdout, ran.stderr);
    ran.json()
}

/// A cell of the sum "each once" in the table of `formats`.
fn once<'a>(document: &'a Value, format: &str, of: &str) -> &'a Value {
    let rows = document["tables"][0]["rows"].as_array().expect("rows");
    let sum = rows.iter().find(|row| row["kind"] == "each once").expect("the sum");
    &sum[format!("{}_{of}", format.trim_start_matches("thesis16-"))]
}

/// The values of an array of f32.
fn values(folder: &Path, file: &str) -> Vec<f64> {
    let bytes = fs::read(folder.join(file)).expect("the array");
    let words = bytes[DATA..].chunks_exact(4);
    words.map(|word| f32::from_le_bytes(word.try_into().expect("four bytes")).into()).collect()
}

/// The positions of the moving bodies after the step of a folder in an order. Body 0 is static.
fn positions_after(input: &str, order: &str) -> Vec<f64> {
    let results = tempfile::tempdir().expect("a folder");
    let out = text(results.path());
    let ran = run(["solve", input, "--order", order, "--out", out]);
    assert_eq!(ran.code, Some(0), "{order}: {}", ran.stderr);
    values(results.path(), "out_pos.npy").split_off(3)
}

/// The mean of |new - original| / |original|, percent, and the share below 1 %.
fn deviation(original: &[f64], new: &[f64]) -> [f64; 2] {
    let pairs = original.iter().zip(new).filter(|(original, _)| original.abs() > 0.0);
    let each: Vec<f64> = pairs.map(|(o, n)| (n - o).abs() / o.abs() * 100.0).collect();
    let count = each.len() as f64;
    let sum = each.iter().fold(0.0, |sum, one| sum + one);
    [sum / count, each.iter().filter(|one| **one < 1.0).count() as f64 / count]
}

#[test]
fn the_deviation_of_orders_is_that_of_single_steps() {
    let input = golden("pile5_step60");
    let input = text(&input);
    let document = study(&["determinism", "--input", input, "--pairs", "2", "--order-seed", "5"]);
    let named = (&document["verb"], &document["experiment"]);
    assert_eq!(named, (&"thesis".into(), &"determinism".into()));
    assert_eq!((&document["gpu_order"], &document["complete"]), (&"cells".into(), &true.into()));
    let compared = [&document["gpu"], &document["pairs"][0], &document["pairs"][1]];
    let orders = [["gpu", "as-given"], ["random=5", "random=6"], ["random=7", "random=8"]];
    let mut means = Vec::new();
    for (comparison, [original, new]) in compared.into_iter().zip(orders) {
        assert_eq!((&comparison["original"], &comparison["new"]), (&original.into(), &new.into()));
        let point = &comparison["curve"][0];
        let [mean, under] =
            deviation(&positions_after(input, original), &positions_after(input, new));
        assert!(mean > 1e-3, "{original} and {new} differ");
        near(&point["position"]["relative_mean_percent"], mean, 1e-9);
        near(&point["position"]["under_1_percent_share"], under, 1e-9);
        means.push(mean);
        let bins = comparison["position_histogram"]["counts"].as_array().expect("counts");
        let binned = bins.iter().fold(0.0, |sum, count| sum + number(count));
        let others = ["equal", "below", "above", "original_zero"]
            .map(|name| number(&comparison["position_histogram"][name]));
        near(&point["position"]["components"], binned + others.iter().fold(0.0, |a, b| a + b), 0.0);
    }
    let over = &document["over_pairs"][0]["position_mean_percent"];
    near(&over["mean"], f64::midpoint(means[1], means[2]), 1e-9);
    // The deviation over n - 1 of two values is their distance by the root of 2.
    near(&over["standard_deviation"], (means[1] - means[2]).abs() / 2.0_f64.sqrt(), 1e-9);
    near(&document["recorded"][1]["under_1_percent_share"], 0.8429, 0.0);
}

#[test]
fn the_order_of_the_gpu_is_that_of_the_folder_if_it_has_one() {
    let folder = copy("two_cubes");
    let input = text(folder.path());
    let order = [1_u32, 0].map(u32::to_le_bytes);
    write_array(&folder, "gpu_order.npy", "<u4", &[2], &order);
    let document = study(&["determinism", "--input", input, "--pairs", "0"]);
    assert_eq!(document["gpu_order"], "gpu_order.npy");
    // The other order of two collisions moves the cubes otherwise.
    assert!(number(&document["gpu"]["curve"][0]["linear_velocity"]["absolute_largest"]) > 0.0);
    assert_eq!(document["over_pairs"], Value::Array(Vec::new()));

    write_array(&folder, "gpu_order.npy", "<u4", &[2], &[1_u32.to_le_bytes()]);
    for verb in [&["thesis", "determinism", "--input"][..], &["solve", "--order", "gpu"]] {
        let ran = run([verb, &[input]].concat());
        assert_eq!(ran.code, Some(2), "{}", ran.stderr);
        assert!(ran.stderr.contains("each index below 2 once"), "{}", ran.stderr);
    }
}

#[test]
fn orders_lead_further_apart_step_by_step_and_the_same_way_every_time() {
    let scene =
        ["determinism", "--grid", "4x4x4", "--steps", "70", "--pairs", "2", "--drop", "0.1"];
    let document = study(&scene);
    assert_eq!(document["over_pairs"].as_array().map(Vec::len), Some(70));
    let apart =
        |step: usize| number(&document["gpu"]["curve"][step - 1]["position"]["absolute_mean"]);
    // Free fall has no collisions.
    assert!(apart(5) <= 0.0, "{}", apart(5));
    assert!(apart(70) > 2.0 * apart(12) && apart(12) > 0.0, "{} {}", apart(12), apart(70));
    let over = |step: usize| number(&document["over_pairs"][step - 1]["position_mean_m"]["mean"]);
    assert!(over(5) <= 0.0 && over(12) > 0.0, "{} {}", over(5), over(12));
    let again = study(&[&scene[..], &["--threads", "1", "--fast", "off"]].concat());
    for part in ["gpu", "pairs", "over_pairs"] {
        assert_eq!(again[part], document[part], "{part}");
    }

    // The state after some steps is the start of others.
    let one = study(&["determinism", "--grid", "4x4x4", "--from", "40", "--steps", "1"]);
    assert_eq!(one["over_pairs"].as_array().map(Vec::len), Some(1));
    assert!(number(&one["over_pairs"][0]["position_mean_percent"]["mean"]) > 0.0);
    near(&one["config"]["from"], 40.0, 0.0);
}

#[test]
fn sixteen_bits_are_compared_with_float_as_compare_does() {
    let input = golden("pile5_step61");
    let input = text(&input);
    let document = study(&["half", "--input", input]);
    for (place, build) in ["half", "half,thesis16", "half,thesis16-literal"].into_iter().enumerate()
    {
        let of_build = &document["builds"][place];
        assert_eq!(of_build["build"], build);
        let compared =
            run(["thesis", "compare", "float", build, "--input", input, "--json"]).json();
        let row = &compared["rows"][1];
        let point = &of_build["curve"][0];
        assert_eq!(point["position"], row["difference"]["position"], "{build}");
        assert_eq!(point["linear_velocity"], row["difference"]["linear_velocity"], "{build}");
        assert_eq!(point["unmoved_share"], row["b"]["unmoved_share"], "{build}");
        let energy = ["a", "b"].map(|side| number(&row[side]["kinetic_energy_j"]));
        near(&point["energy_ratio"], energy[1] / energy[0], 1e-9);
    }
    // `pgs thesis formats` measures the same numbers.
    let formats = run(["thesis", "formats", "--input", input, "--json"]).json();
    for (place, name) in ["binary16", "thesis16", "thesis16-literal"].into_iter().enumerate() {
        let split = &document["splits"][place];
        assert_eq!(split["format"], name);
        let expected = number(once(&formats, name, "mean_percent"));
        near(&split["relative_mean_percent"], expected, 1e-12);
    }
    near(&document["recorded"][0]["under_1_percent_share"], 0.9964, 0.0);
}

#[test]
fn a_pile_in_half_keeps_moving_and_one_in_f32_does_not() {
    let scene = ["--grid", "4x4x4", "--drop", "0.5", "--steps", "150"];
    let arguments = [&["half", "--build", "half", "--build", "naive"], &scene[..]].concat();
    let document = study(&arguments);
    let last = |place: usize| &document["builds"][place]["curve"][149];
    let [half, single] = [0, 1].map(|place| number(&last(place)["energy_ratio"]));
    assert!(half > 2.0 * single, "half {half} times float, naive {single} times");
    let [half, single] = [0, 1].map(|place| number(&last(place)["unmoved_share"]));
    assert!(half > 0.5 && single < 0.5, "unmoved: half {half}, naive {single}");
    assert_eq!(document["float_kinetic_energy_j"].as_array().map(Vec::len), Some(151));
}

/// Verbs that step a pile to a state lead to the same one: `formats` counts the step that it measures, a
/// study the steps before, and `half` shows the numbers of the step behind its last.
#[test]
fn a_step_of_the_pile_is_the_same_in_every_verb() {
    let formats = run(["thesis", "formats", "--grid", "4x4x4", "--step", "50", "--json"]).json();
    let scene = ["--grid", "4x4x4", "--from", "48", "--steps", "1", "--build", "half"];
    let half = study(&[&["half"], &scene[..]].concat());
    for place in 0..2 {
        let split = &half["splits"][place];
        let name = split["format"].as_str().expect("a name");
        assert_eq!(&split["relative_mean_percent"], once(&formats, name, "mean_percent"), "{name}");
        let under = number(once(&formats, name, "under_1_percent"));
        near(&split["under_1_percent_share"], under / 100.0, 1e-12);
    }
    let ordered =
        run(["thesis", "order", "--grid", "4x4x4", "--drop", "1", "--steps", "49", "--json"])
            .json();
    assert_eq!(ordered["scene"]["collisions"], formats["collisions"]);
    assert!(number(&formats["collisions"]) > 0.0);
}

#[test]
fn every_verb_takes_an_order_of_the_command() {
    let input = golden("pile5_step62");
    let input = text(&input);
    let digest = |order: &str| {
        let ran = run(["solve", input, "--digest", "--order", order]);
        assert_eq!(ran.code, Some(0), "{order}: {}", ran.stderr);
        ran.stdout
    };
    let orders = ["as-given", "gpu", "random=1", "random=2"].map(digest);
    for (place, one) in orders.iter().enumerate() {
        assert!(!orders[..place].contains(one), "each order has its own result");
    }
    assert_eq!(digest("random=1"), orders[2]);
    let ran = run(["solve", input, "--compare", "--order", "random=1"]);
    assert_eq!(ran.code, Some(1));
    let said = "order      random=1 (not Bullet's: results differ by the order alone)";
    assert!(ran.stdout.contains(said), "{}", ran.stdout);

    let end = |order: &str| {
        let scene = ["run", "--json", "--grid", "3x3x3", "--steps", "60", "--order", order];
        run(scene).json()
    };
    let [one, again, gpu] = ["random=3", "random=3", "gpu"].map(end);
    assert_eq!(one["digest"], again["digest"]);
    assert_ne!(one["digest"], gpu["digest"]);
    assert_eq!(one["config"]["permutation"], "random=3");

    let compared =
        run(["thesis", "compare", "float,random=1", "float,gpu", "--input", input, "--json"]);
    assert_eq!(
        compared.json()["a"]["digest"]["value"],
        orders[2].trim_start_matches(|c| c != ' ').trim()
    );
}

#[test]
fn a_refused_collision_is_named_by_its_place_in_the_folder() {
    let folder = copy("pile5_step60");
    crate::common::patch(&folder, "contact_bodies.npy", 5, 126_u32.to_le_bytes());
    let input = text(folder.path());
    for verb in [
        &["solve", "--order", "random=4"][..],
        &["solve", "--order", "gpu"],
        &["thesis", "determinism", "--input"],
        &["thesis", "half", "--input"],
        &["thesis", "stopping", "--input"],
    ] {
        let ran = run([verb, &[input]].concat());
        assert_eq!(ran.code, Some(2), "{verb:?}: {}", ran.stderr);
        for part in ["collision 2", "contact_bodies.npy"] {
            assert!(ran.stderr.contains(part), "{verb:?}: {}", ran.stderr);
        }
    }
}

#[test]
fn what_cannot_be_studied_is_refused() {
    let input = golden("pile5_step60");
    let input = text(&input);
    for (arguments, part) in [
        (&["determinism", "--input", input, "--hazards", "unchecked"][..], "stale velocities"),
        (&["determinism", "--input", input, "--steps", "3"], "cannot be used with"),
        (&["half", "--input", input, "--grid", "2x2x2"], "cannot be used with"),
        (&["half", "--grid", "2x2x2", "--board", "uio"], "leave out --board"),
        (&["half", "--grid", "2x2x2", "--build", "halv"], "halv"),
        (&["weather"], "weather"),
    ] {
        let ran = run([&["thesis"], arguments].concat());
        assert_eq!(ran.code, Some(2), "{arguments:?}: {}{}", ran.stdout, ran.stderr);
        assert!(ran.stderr.contains(part), "{arguments:?}: {}", ran.stderr);
    }
    for wrong in ["random=", "random=-1", "order=gpu", "cells"] {
        let ran = run(["solve", input, "--order", wrong]);
        assert_eq!(ran.code, Some(2), "{wrong}");
        assert!(ran.stderr.contains("random=SEED"), "{}", ran.stderr);
    }
}

/// Measured on the same step by a program outside this project.
#[test]
fn the_full_step_deviates_as_others_measured() {
    let folder = variable("PGS_VECTORS").map(std::path::PathBuf::from);
    let folder = folder.map(|root| root.join("full_step186")).filter(|folder| folder.exists());
    let Some(folder) = folder else {
        skipped("the orders of full_step186 (PGS_VECTORS does not lead there)");
        return;
    };
    let document = study(&["determinism", "--input", text(&folder), "--pairs", "3"]);
    assert_eq!(document["gpu_order"], "gpu_order.npy");
    let position = &document["gpu"]["curve"][0]["position"];
    near(&position["relative_mean_percent"], 0.0237, 0.000_05);
    near(&position["under_1_percent_share"], 0.997_54, 0.000_005);
    for pair in document["pairs"].as_array().expect("pairs") {
        let position = &pair["curve"][0]["position"];
        near(&position["relative_mean_percent"], 0.038, 0.004);
        near(&position["under_1_percent_share"], 0.992, 0.002);
    }
}
