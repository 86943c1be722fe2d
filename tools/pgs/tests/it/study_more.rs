//! Experiments of `pgs thesis` about the time step, stopping rules, the shares of a step and the
//! ladder of designs: figures that a reader can compute by hand, and refusals.

use crate::common::{golden, near, number, rows, run, text};
use serde_json::Value;

/// Runs a study; returns its document.
fn study(arguments: &[&str]) -> Value {
    let ran = run([&["thesis"], arguments, &["--json"]].concat());
    assert_eq!(ran.code, Some(0), "{arguments:?}: {}", ran.stderr);
    assert!(ran.stderr.is_empty(), "{}", ran.stderr);
    ran.json()
}

#[test]
fn the_board_falls_as_explicit_euler_and_a_longer_step_costs_less() {
    let document = study(&["time-step", "--grid", "2x2x2", "--seconds", "1"]);
    let (flights, piles) = (rows(&document, "flight"), rows(&document, "pile"));
    let rates = [480.0, 240.0, 120.0, 60.0, 30.0, 15.0];
    assert_eq!((flights.len(), piles.len()), (rates.len(), rates.len()));
    for ((flight, pile), rate) in flights.iter().zip(piles).zip(rates) {
        // g t dt / 2 after 1 s.
        let off = 9.8 / rate / 2.0 * 1e3;
        near(&flight["explicit_mm"], off, 1e-3);
        near(&flight["symplectic_mm"], off, 1e-3);
        near(&flight["board_mm"], off, 0.1);
        near(&pile["steps"], rate, 0.0);
    }
    near(&piles[0]["distance_from_shortest_m"], 0.0, 0.0);
    let costs: Vec<f64> = piles.iter().map(|row| number(&row["cycles_per_second"])).collect();
    assert!(costs.windows(2).all(|two| two[1] < 0.6 * two[0]), "{costs:?}");
}

#[test]
fn passes_solve_a_cube_on_the_ground_and_each_rule_ends_them() {
    let folder = golden("one_cube");
    let document =
        study(&["stopping", "--input", text(&folder), "--passes", "40", "--spin-damping", "0"]);
    let contact = rows(&document, "contact");
    let last = contact.last().expect("passes");
    near(&last["passes"], 40.0, 0.0);
    let rms = |pass: &Value| number(&pass["contact_rms_m_s"]);
    let first = rms(&contact[0]);
    assert!(first > 0.1 && rms(last) < 1e-5 * first, "{first} to {}", rms(last));
    assert!(contact[0]["largest_change_n_s"].is_null());
    for rule in rows(&document, "rules") {
        let passes = number(&rule["contact_residual"]);
        let limit = number(&rule["tolerance"]) * first;
        let at = contact.iter().find(|pass| number(&pass["passes"]) >= passes).expect("a pass");
        assert!(rms(at) <= limit, "{rule:#}");
        assert!(number(&rule["contact_change"]) >= 1.0);
    }
}

#[test]
fn a_pile_is_solved_further_with_every_pass_and_four_leave_some() {
    let folder = golden("pile5_step60");
    let document =
        study(&["stopping", "--input", text(&folder), "--passes", "24", "--spin-damping", "0"]);
    let of = |kind: &str, passes: u32, key: &str| {
        let pass = rows(&document, kind).iter().find(|pass| pass["passes"] == passes);
        number(&pass.expect("a pass")[format!("{key}_rms_m_s")])
    };
    for kind in ["contact", "friction"] {
        let [first, fourth, last] = [0, 4, 24].map(|passes| of(kind, passes, kind));
        assert!(fourth < 0.2 * first && last < 0.3 * fourth, "{kind}: {first} {fourth} {last}");
    }
    // The step's own passes: friction passes take the contacts out of balance.
    let (before, after) = (of("contact", 4, "contact"), of("friction", 4, "contact"));
    assert!(after > before, "{before} {after}");
    assert!(document["facts"].to_string().contains("4 + 4 passes leave"), "{document:#}");
}

#[test]
fn search_and_response_share_a_step_and_the_thesis_gains_follow_from_its_share() {
    let document = study(&["split", "--grid", "4x4x4", "--steps", "30", "--runs", "3"]);
    let times = rows(&document, "shares");
    let [search, response, driver, board] = [0, 1, 2, 3].map(|row| number(&times[row]["ms"]));
    assert!(search > 0.0 && response > 0.0 && driver > 0.0 && board > 0.0, "{times:#?}");
    near(&times[1]["share_percent"], 100.0 * response / (search + response), 1e-9);
    let gains = rows(&document, "gains");
    for (gain, whole) in [(&gains[0], 1.37), (&gains[2], 1.48)] {
        near(&gain["recorded"], whole, 0.0);
        near(&gain["whole_with_recorded_share"], whole, 0.005);
    }
}

#[test]
fn the_ladder_ends_with_the_two_designs_that_the_thesis_measured() {
    let document = study(&["ladder"]);
    let rungs = rows(&document, "ladder");
    let of = |design: &str| {
        rungs.iter().find(|rung| rung["design"] == design).expect("a design of this name")
    };
    for (design, modelled, recorded) in
        [("float", 2_066_606.0, 2_062_697.0), ("half", 1_551_477.0, 1_557_317.0)]
    {
        near(&of(design)["cycles"], modelled, 0.0);
        near(&of(design)["recorded_cycles"], recorded, 0.0);
    }
    assert!(rungs[0]["factor"].is_null());
    let product: f64 = rungs[1..].iter().map(|rung| number(&rung["factor"])).product();
    let last = rungs.last().expect("a design");
    assert!((product / number(&last["factor_in_all"]) - 1.0).abs() < 1e-12);
}

#[test]
fn a_study_without_an_answer_is_refused() {
    for arguments in [
        &["thesis", "speed"][..],
        &["thesis", "stopping", "--passes", "1"],
        &["thesis", "stopping", "--input", "x", "--steps", "3"],
        &["thesis", "time-step", "--seconds", "0"],
        &["thesis", "split", "--runs", "0"],
        &["thesis", "ladder", "--collisions", "0"],
    ] {
        assert_eq!(run(arguments).code, Some(2), "{arguments:?}");
    }
}
