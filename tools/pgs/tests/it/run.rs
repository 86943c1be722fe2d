//! The output of `pgs run`, for people and for programs.

use crate::common::{Ran, run};
use serde_json::Value;

/// Columns of the terminal.
const WIDTH: usize = 100;

fn ran(options: &str) -> Ran {
    let ran = run(["run"].into_iter().chain(options.split_whitespace()));
    assert_eq!(ran.code, Some(0), "{options}: {}", ran.stderr);
    ran
}

fn document(options: &str) -> Value {
    ran(&format!("{options} --json")).json()
}

/// The fact behind a label, its lines joined.
fn fact(text: &str, label: &str) -> String {
    let mut lines = text.lines().skip_while(|line| !line.starts_with(&format!("{label:<11}")));
    let first = lines.next().unwrap_or_else(|| panic!("no {label}: {text}"));
    let rest = lines.take_while(|line| line.starts_with("           "));
    let words: Vec<&str> = [first].into_iter().chain(rest).map(|line| line[11..].trim()).collect();
    words.join(" ")
}

#[test]
fn no_line_is_wider_than_a_terminal() {
    for options in [
        "--grid 5x5x5 --steps 40",
        "--grid 4x4x4 --steps 30 --board emulated:half,f32,unchecked",
        "--grid 4x4x4 --steps 30 --board emulated:half --verify",
        "--grid 3x3x3 --steps 3 --scene shapes --board emulated:float,length-width=14 --retries 2",
        "--grid 3x3x3 --steps 9 --fault irq-drop,times=3",
    ] {
        let text = ran(options).stdout;
        let wide: Vec<&str> = text.lines().filter(|line| line.chars().count() > WIDTH).collect();
        assert!(wide.is_empty(), "{options}: {wide:?}");
    }
}

#[test]
fn the_table_and_the_summary_say_what_the_document_says() {
    let scene = "--grid 4x4x4 --steps 60 --report-every 60";
    let (text, document) = (ran(scene).stdout, document(scene));
    let last = document["steps"].as_array().expect("steps").last().expect("a step");
    let row: Vec<&str> = text
        .lines()
        .find(|line| line.starts_with("    60 "))
        .expect("a row")
        .split_whitespace()
        .collect();
    let number = |value: &Value| value.as_f64().expect("a number");
    assert_eq!(row[1], last["collisions"].to_string());
    assert_eq!(row[2], format!("{:.1}", 1e3 * number(&last["deepest_penetration_m"])));
    assert_eq!(row[3], format!("{:.3}", number(&last["kinetic_energy_before_gravity_j"]) / 1e3));
    assert_eq!(row[4], format!("{:.3}", number(&last["modelled_ms"])));

    let config = &document["config"];
    assert_eq!(
        (&config["contact_iterations"], &config["friction_iterations"]),
        (&10.into(), &10.into())
    );
    assert_eq!((&config["drop_m"], &config["time_step"]), (&1.0.into(), &"1/60 s".into()));
    let summary = &document["summary"];
    let mean = number(&summary["modelled_ms"]["mean"]);
    let steps = document["steps"].as_array().expect("steps");
    let sum: f64 = steps.iter().map(|step| number(&step["modelled_ms"])).sum();
    assert!((mean - sum / 60.0).abs() < 1e-9);
    assert!(fact(&text, "time").starts_with(&format!("{mean:.3} ms a step")), "{text}");
    let of = |key: &str| steps.iter().map(|step| number(&step["host_on_a53_ms"][key])).sum::<f64>();
    let ratio = of("software") / (of("step") + sum);
    assert!((number(&summary["ratio"]) - ratio).abs() < 1e-9, "{summary}");
    assert!(fact(&text, "ratio").starts_with(&format!("{ratio:.1} (on paper): ")), "{text}");
    assert_eq!(document["steps"][0]["order"]["choice"]["reason"], "queue");
}

#[test]
fn a_run_ends_in_five_lines() {
    for scene in ["", "--scene shapes", "--board emulated:half", "--order hazard-free"] {
        let text = ran(&format!("--grid 3x3x3 --steps 2 {scene}")).stdout;
        let (_, end) = text.rsplit_once("\n\n").expect("a blank line");
        let labels: Vec<_> = end.lines().filter_map(|line| line.split(' ').next()).collect();
        assert_eq!(labels, ["time", "ratio", "pile", "host", "digest"], "{text}");
    }
}

/// The lattice leaves the rim of its top layer on an edge: here seven cubes, which topple, fall and
/// come to rest.
#[test]
fn a_pile_comes_to_rest_without_energy() {
    let text = ran("--grid 4x4x4 --steps 600").stdout;
    let pile = fact(&text, "pile");
    assert!(pile.starts_with("at rest: ") && pile.contains(" (0.000 kJ), "), "{pile}");
    let summary = &document("--grid 4x4x4 --steps 240")["summary"]["end"];
    assert_eq!(summary["at_rest"], false, "the rim is falling: {summary}");
}

#[test]
fn the_spin_damping_is_that_of_the_command_line() {
    let of = |options: &str| document(&format!("--grid 3x3x3 --steps 40 {options}"));
    let (own, bullet, off) = (of(""), of("--spin-damping 0.1"), of("--spin-damping 0"));
    assert_eq!(own["digest"], bullet["digest"]);
    assert_ne!(own["digest"], off["digest"]);
    assert_eq!(off["config"]["spin_damping"], 0.0);
}

#[test]
fn a_warm_start_takes_a_pass_more_of_each_kind_and_makes_a_column_stiffer() {
    let of = |options: &str| document(&format!("--grid 1x6x1 --steps 240 {options}"));
    let passes = "--contact-iterations 4 --friction-iterations 4";
    let (cold, warm) = (of(passes), of(&format!("{passes} --warm-start")));
    assert_eq!(
        (&cold["config"]["warm_start"], &cold["steps"][239]["passes"]),
        (&false.into(), &8.into())
    );
    assert_eq!(
        (&warm["config"]["warm_start"], &warm["steps"][239]["passes"]),
        (&true.into(), &10.into())
    );
    let deepest =
        |of: &Value| of["steps"][239]["deepest_penetration_m"].as_f64().expect("a number");
    assert!(deepest(&warm) < 0.5 * deepest(&cold), "{} m, {} m", deepest(&warm), deepest(&cold));
}

#[test]
fn shapes_have_a_friction_for_each_pair_and_cubes_have_one() {
    let shapes = "--scene shapes --grid 3x3x3 --steps 60";
    let (one, own) = (document(&format!("{shapes} --pair-friction=false")), document(shapes));
    assert_ne!(one["digest"], own["digest"]);
    assert_eq!(own["config"]["pair_friction"], true);
    let refused = run("run --grid 2x2x2 --pair-friction".split(' '));
    assert_eq!(refused.code, Some(2), "{}", refused.stderr);
    assert!(refused.stderr.contains("--scene shapes"), "{}", refused.stderr);
}

/// The shapes need no option: world inertia, a warm start and the frictions are the scene's.
#[test]
fn shapes_are_stepped_warm_beside_the_same_ones_cold() {
    let of = |options: &str| document(&format!("--scene shapes --grid 3x3x3 {options}"));
    let found = of("--steps 120");
    assert_eq!(found["board"]["design"], "float,world");
    assert_eq!(
        (&found["config"]["warm_start"], &found["config"]["pair_friction"]),
        (&true.into(), &true.into())
    );
    let depth = |of: &Value| of["deepest_penetration_m"].as_f64().expect("a number").to_bits();
    let (warm, cold) = (&found["steps"][119], &found["steps"][119]["beside_cold"]);
    assert_ne!(depth(warm), depth(cold));
    // The scene beside it is the one that a run without both steps.
    let alone = of("--steps 120 --warm-start=false --pair-friction=false");
    assert_eq!(depth(cold), depth(&alone["steps"][119]));
    assert_eq!(alone["beside_cold"], Value::Null);
    let table = ran("--scene shapes --grid 2x2x2 --steps 3").stdout;
    assert!(table.contains("cold mm"), "{table}");
}

#[test]
fn iterations_and_time_step_are_those_of_the_command_line() {
    let options =
        "--grid 2x2x2 --steps 2 --contact-iterations 3 --friction-iterations 2 --dt 1/120";
    let document = document(options);
    assert_eq!(document["steps"][0]["passes"], 5);
    assert_eq!(document["config"]["time_step"], "1/120 s");
    // v = -g dt twice, and x by the first v.
    let fall = 8.0 * 9.8_f64.powi(2) * (2.0 / 120.0_f64).powi(2) / 2.0;
    let energy = document["steps"][1]["kinetic_energy_j"].as_f64().expect("a number");
    assert!((energy - fall).abs() < 1e-4, "{energy} J of {fall}");
    let wrong = [
        "--dt 0",
        "--dt 1/0",
        "--contact-iterations 256",
        "--friction-iterations -1",
        "--spin-damping 2",
    ];
    for wrong in wrong {
        assert_eq!(run(["run"].into_iter().chain(wrong.split(' '))).code, Some(2), "{wrong}");
    }
}
