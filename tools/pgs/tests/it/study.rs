//! Experiments of `pgs thesis` that step a board: their figures agree with each other, and with
//! `PGS_VECTORS` on the thesis' scene with figures that were measured outside this project.

use crate::common::{
    at, copy, golden, near, number, rows, run, skipped, text, variable, write as write_array,
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
    let all = document["tables"][0]["rows"].as_array().expect("rows");
    let sum = all.iter().find(|row| row["kind"] == "each once").expect("the sum");
    &sum[format!("{}_{of}", format.trim_start_matches("thesis16-"))]
}

/// The step of a folder in the orders of two boards, by `pgs thesis compare`.
fn in_two_orders(input: &str, [original, new]: [&str; 2]) -> Value {
    let builds = [original, new].map(|order| format!("float,{order}"));
    study(&["compare", &builds[0], &builds[1], "--input", input])
}

/// The rows of `determinism`.
const GPU: &str = "as-given against gpu";
const PAIRS: &str = "random pairs";

#[test]
fn the_deviation_of_orders_is_that_of_single_steps() {
    let input = golden("pile5_step60");
    let input = text(&input);
    let document = study(&["determinism", "--input", input, "--pairs", "2", "--order-seed", "5"]);
    let named = (&document["verb"], &document["experiment"]);
    assert_eq!(named, (&"thesis".into(), &"determinism".into()));
    assert_eq!(document["complete"], true);
    let said = document["facts"].to_string();
    assert!(said.contains("(cells)") && said.contains("84.290 % under 1 %"), "{said}");
    let expected = |orders| at(&in_two_orders(input, orders), 1, "B").clone();
    let of = ["position_mean_percent", "position_under_1_percent", "linear_within_1_percent"];
    let (gpu, found) = (expected(["gpu", "as-given"]), at(&document, 1, GPU));
    let pairs = [["random=5", "random=6"], ["random=7", "random=8"]].map(expected);
    for key in of {
        assert_eq!(found[key], gpu[key], "{key}");
        let [one, other] = [&pairs[0], &pairs[1]].map(|row| number(&row[key]));
        assert!(one > 1e-3 && other > 1e-3, "{key}: {one} {other}");
        near(&at(&document, 1, PAIRS)[key], f64::midpoint(one, other), 1e-9);
        // The deviation over n - 1 of two values is their distance by the root of 2.
        near(&at(&document, 1, "+-")[key], (one - other).abs() / 2.0_f64.sqrt(), 1e-9);
    }
    let spread = &rows(&document, "positions")[0];
    near(&spread["below_1_percent"], number(&found["position_under_1_percent"]), 1e-9);
}

#[test]
fn the_order_of_the_gpu_is_that_of_the_folder_if_it_has_one() {
    let folder = copy("two_cubes");
    let input = text(folder.path());
    let order = [1_u32, 0].map(u32::to_le_bytes);
    write_array(&folder, "gpu_order.npy", "<u4", &[2], &order);
    let document = study(&["determinism", "--input", input, "--pairs", "0"]);
    assert!(document["facts"].to_string().contains("(gpu_order.npy)"), "{document:#}");
    // The other order of two collisions moves the cubes otherwise.
    assert!(number(&at(&document, 1, GPU)["linear_most_m_s"]) > 0.0);
    assert_eq!(rows(&document, "steps").len(), 1);

    write_array(&folder, "gpu_order.npy", "<u4", &[2], &[1_u32.to_le_bytes()]);
    for verb in [&["thesis", "determinism"][..], &["thesis", "compare", "float,gpu", "float"]] {
        let ran = run([verb, &["--input", input]].concat());
        assert_eq!(ran.code, Some(2), "{}", ran.stderr);
        assert!(ran.stderr.contains("each index below 2 once"), "{}", ran.stderr);
    }
}

#[test]
fn orders_lead_further_apart_step_by_step_and_the_same_way_every_time() {
    let scene =
        ["determinism", "--grid", "4x4x4", "--steps", "70", "--pairs", "2", "--drop", "0.1"];
    let scene = [&scene[..], &["--every", "1"]].concat();
    let document = study(&scene);
    assert_eq!(rows(&document, "steps").len(), 3 * 70);
    let apart = |step: u64, side| number(&at(&document, step, side)["position_mean_mm"]);
    let [gpu, pairs] = [GPU, PAIRS].map(|side| move |step| apart(step, side));
    // Free fall has no collisions.
    assert!(gpu(5) <= 0.0 && pairs(5) <= 0.0, "{} {}", gpu(5), pairs(5));
    assert!(gpu(70) > 2.0 * gpu(12) && gpu(12) > 0.0, "{} {}", gpu(12), gpu(70));
    assert!(pairs(12) > 0.0, "{}", pairs(12));
    let again =
        study(&[&scene[..], &["--board", "emulated:float,fast=off", "--threads", "1"]].concat());
    assert_eq!(again["tables"], document["tables"]);

    // The state after some steps is the start of others.
    let one = study(&["determinism", "--grid", "4x4x4", "--from", "40", "--steps", "1"]);
    assert_eq!(rows(&one, "steps").len(), 3);
    assert!(number(&at(&one, 1, PAIRS)["position_mean_percent"]) > 0.0);
    assert!(one["facts"].to_string().contains("1 steps after step 40"), "{one:#}");
}

#[test]
fn sixteen_bits_are_compared_with_float_as_compare_does() {
    let input = golden("pile5_step61");
    let input = text(&input);
    let document = study(&["half", "--input", input]);
    for build in ["half,thesis16", "half,thesis16-literal"] {
        at(&document, 1, build);
    }
    let compared = study(&["compare", "float", "half", "--input", input]);
    let [float, half] = ["A", "B"].map(|side| at(&compared, 1, side));
    let found = at(&document, 1, "half");
    let of = ["position_mean_percent", "linear_within_1_percent", "unmoved_percent", "kinetic_kj"];
    for key in of {
        assert_eq!(found[key], half[key], "{key}");
    }
    let energy = [float, half].map(|row| number(&row["kinetic_kj"]));
    near(&found["energy_ratio"], energy[1] / energy[0], 1e-9);
    // `pgs thesis formats` measures the same numbers.
    let formats = run(["thesis", "formats", "--input", input, "--json"]).json();
    for (place, name) in ["binary16", "thesis16", "thesis16-literal"].into_iter().enumerate() {
        let split = &rows(&document, "splits")[place];
        assert_eq!(split["format"], name);
        let expected = number(once(&formats, name, "mean_percent"));
        near(&split["mean_percent"], expected, 1e-12);
    }
    assert!(document["facts"].to_string().contains("99.640 % under 1 %"), "{document:#}");
}

#[test]
fn the_reference_solver_in_binary16_has_the_bits_of_the_board_half() {
    let scene = ["--grid", "4x4x4", "--drop", "0.5", "--steps", "40"];
    let builds = ["half", "--build", "half", "--build", "half,binary16"];
    let document = study(&[&builds[..], &scene[..]].concat());
    for step in (4..=40).step_by(4) {
        let [board, reference] = ["half", "half,binary16"].map(|build| at(&document, step, build));
        for (key, value) in
            board.as_object().expect("cells").iter().filter(|(key, _)| *key != "side")
        {
            assert_eq!(value, &reference[key], "{key}");
        }
    }
}

#[test]
fn a_pile_in_half_keeps_moving_and_one_in_f32_does_not() {
    let scene = ["--grid", "4x4x4", "--drop", "0.5", "--steps", "150"];
    let arguments = [&["half", "--build", "half", "--build", "naive"], &scene[..]].concat();
    let document = study(&arguments);
    let last = |key: &str| ["half", "naive"].map(|build| number(&at(&document, 150, build)[key]));
    let [half, single] = last("energy_ratio");
    assert!(half > 2.0 * single, "half {half} times float, naive {single} times");
    let [half, single] = last("unmoved_percent");
    assert!(half > 50.0 && single < 50.0, "unmoved: half {half}, naive {single}");
}

/// Verbs that step a pile to a state lead to the same one: `formats` counts the step that it
/// measures, a study the steps before, and `half` shows the numbers of the step behind its last.
#[test]
fn a_step_of_the_pile_is_the_same_in_every_verb() {
    let formats = run(["thesis", "formats", "--grid", "4x4x4", "--step", "50", "--json"]).json();
    let scene = ["--grid", "4x4x4", "--from", "48", "--steps", "1", "--build", "half"];
    let half = study(&[&["half"], &scene[..]].concat());
    for place in 0..2 {
        let split = &rows(&half, "splits")[place];
        let name = split["format"].as_str().expect("a name");
        assert_eq!(&split["mean_percent"], once(&formats, name, "mean_percent"), "{name}");
        near(&split["under_1_percent"], number(once(&formats, name, "under_1_percent")), 1e-12);
    }
    let ordered =
        run(["thesis", "order", "--grid", "4x4x4", "--drop", "1", "--steps", "49", "--json"])
            .json();
    let slots = &ordered["tables"][0]["rows"][0]["slots"];
    assert_eq!(slots, &formats["collisions"]);
    assert!(number(&formats["collisions"]) > 0.0);
}

#[test]
fn a_board_gets_the_collisions_in_an_order_of_the_thesis_part() {
    let input = golden("pile5_step62");
    let input = text(&input);
    let orders = [
        "as-given",
        "gpu",
        "body-by-body",
        "body-by-body-oldest",
        "body-by-body-newest",
        "random=1",
        "random=2",
    ];
    let digests = orders.map(|order| {
        let document = in_two_orders(input, [order, order]);
        let [a, b] = rows(&document, "boards") else { panic!("two boards: {document:#}") };
        assert_eq!(a["digest"], b["digest"], "{order}");
        assert_eq!(a["build"], format!("float,{order}"));
        a["digest"].clone()
    });
    for (place, one) in digests.iter().enumerate() {
        assert!(
            !digests[..place].contains(one),
            "{}: each order has its own result",
            orders[place]
        );
    }
    let given = run(["solve", input, "--digest", "--order", "as-given"]).stdout;
    assert!(given.trim_end().ends_with(digests[0].as_str().expect("a digest")), "{given}");

    // Another order in each step, the same for a seed.
    let end = |order: &str| {
        let build = format!("float,{order}");
        let document = study(&["compare", &build, &build, "--grid", "3x3x3", "--steps", "60"]);
        rows(&document, "boards")[0]["digest"].clone()
    };
    assert_eq!(end("random=3"), end("random=3"));
    assert_ne!(end("random=3"), end("gpu"));
}

#[test]
fn a_refused_collision_is_named_by_its_place_in_the_folder() {
    let folder = copy("pile5_step60");
    crate::common::patch(&folder, "contact_bodies.npy", 5, 126_u32.to_le_bytes());
    let input = text(folder.path());
    for verb in [
        &["thesis", "compare", "float,random=4", "float,body-by-body", "--input"][..],
        &["thesis", "compare", "float,gpu", "float,body-by-body", "--input"],
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
        (
            &["determinism", "--input", input, "--board", "emulated:float,unchecked"][..],
            "stale velocities",
        ),
        (&["determinism", "--input", input, "--steps", "3"], "cannot be used with"),
        (&["half", "--input", input, "--grid", "2x2x2"], "cannot be used with"),
        (&["half", "--grid", "2x2x2", "--board", "uio"], "unexpected argument '--board'"),
        (&["half", "--grid", "2x2x2", "--build", "halv"], "halv"),
        (&["weather"], "weather"),
    ] {
        let ran = run([&["thesis"], arguments].concat());
        assert_eq!(ran.code, Some(2), "{arguments:?}: {}{}", ran.stdout, ran.stderr);
        assert!(ran.stderr.contains(part), "{arguments:?}: {}", ran.stderr);
    }
    for wrong in ["random=", "random=-1", "cells"] {
        let ran = run(["thesis", "compare", &format!("float,{wrong}"), "float"]);
        assert_eq!(ran.code, Some(2), "{wrong}");
        assert!(ran.stderr.contains("random=SEED"), "{}", ran.stderr);
    }
    let ran = run(["solve", input, "--order", "gpu"]);
    assert_eq!(ran.code, Some(2));
    assert!(ran.stderr.contains("hazard-free"), "{}", ran.stderr);
    // A name that went: the tip has the one that stays.
    let ran = run(["solve", input, "--order", "hazard-free-nearby"]);
    assert_eq!(ran.code, Some(2));
    assert!(ran.stderr.contains("tip: a similar value exists: 'hazard-free'"), "{}", ran.stderr);
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
    assert!(document["facts"].to_string().contains("(gpu_order.npy)"), "{document:#}");
    let gpu = at(&document, 1, GPU);
    near(&gpu["position_mean_percent"], 0.0237, 0.000_05);
    near(&gpu["position_under_1_percent"], 99.754, 0.000_5);
    let pairs = at(&document, 1, PAIRS);
    near(&pairs["position_mean_percent"], 0.038, 0.004);
    near(&pairs["position_under_1_percent"], 99.2, 0.2);
    // As `docs/thesis.md` has them, beside the thesis' own row.
    let document = study(&["step", "--input", text(&folder)]);
    let boards = rows(&document, "given_step")[1..].iter();
    for (row, [ms, after]) in
        boards.zip([[7.751, 190.4], [679.982, 138.8], [7.763, 140.1], [6.336, 141.0]])
    {
        near(&row["ms"], ms, 0.000_5);
        near(&row["before_kj"], 154.8, 0.05);
        near(&row["after_kj"], after, 0.05);
    }
}
