//! A counter that stopped at its maximum is shown as a bound, and is no number for programs.

use crate::common::{copy, golden, patch, run};
use serde_json::Value;

fn json(arguments: &[&str]) -> Value {
    let ran = run(arguments.iter().chain(&["--json"]));
    assert_eq!(ran.code, Some(0), "{arguments:?}: {}", ran.stderr);
    ran.json()
}

/// A cube so heavy that stopping it takes more than 2^44 N s.
#[test]
fn impulses_beyond_the_counter_are_at_least_its_maximum() {
    let folder = copy("one_cube");
    patch(&folder, "body_inv_mass.npy", 1, 1e-15_f32.to_le_bytes());
    for axis in 3..6 {
        patch(&folder, "body_inv_inertia.npy", axis, 3.7e-16_f32.to_le_bytes());
    }
    let folder = folder.path().to_str().expect("a path in UTF-8");
    for profile in ["float", "naive"] {
        let board = format!("emulated:{profile}");
        let ran = run(["solve", folder, "--board", &board]);
        assert_eq!(ran.code, Some(0), "{profile}: {}", ran.stderr);
        let line = ran.stdout.lines().find(|line| line.starts_with("impulses"));
        let expected = "impulses   at least 17,592,186,044,416 N s";
        assert_eq!(line, Some(expected), "{profile}");
        let step = &json(&["solve", folder, "--board", &board])["step"];
        assert_eq!(step["impulse_sum_n_s"], Value::Null, "{profile}");
        assert_eq!(step["impulse_sum_saturated"], true, "{profile}");
    }
    let folder = golden("one_cube");
    let step = &json(&["solve", folder.to_str().expect("a path in UTF-8")])["step"];
    assert!(step["impulse_sum_n_s"].is_number() && step["impulse_sum_saturated"] == false);
}

/// A memory that delays every beat of a pass by seven seconds of the board's time.
#[test]
fn waits_beyond_the_counter_leave_the_stalls_open() {
    let folder = golden("two_cubes");
    let folder = folder.to_str().expect("a path in UTF-8");
    let fault = "slow=2000000000@dma0.mm2s,phase=contact1,beat=0";
    let slowed = ["solve", folder, "--deadline", "3600000", "--fault", fault];
    let ran = run(slowed);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let cycles = ran.stdout.lines().find(|line| line.starts_with("cycles")).expect("a line");
    assert!(cycles.contains(" + at least 4,294,967,295 waits; "), "{cycles}");
    assert!(cycles.contains(" + at most 3,"), "{cycles}");
    assert!(cycles.ends_with("limit: streams"), "more waits than stalls whatever: {cycles}");
    let step = &json(&slowed)["step"];
    let cycles = &step["cycles"];
    assert_eq!((&cycles["stalls"], &cycles["waits"]), (&Value::Null, &Value::Null));
    assert_eq!(
        (&cycles["waits_saturated"], &cycles["formula_saturated"]),
        (&true.into(), &false.into())
    );
    assert!(cycles["total"].as_u64() > Some(8_000_000_000), "{cycles}");

    // So long that stalls could outweigh the waits.
    let scene = ["run", "--grid", "3x3x3", "--drop", "0", "--steps", "1", "--deadline", "3600000"];
    let fault = "slow=2000000000@dma0.mm2s,phase=contact1,beat=30";
    let slowed = [&scene[..], &["--fault", fault]].concat();
    let step = &json(&slowed)["steps"][0];
    assert_eq!((&step["limit"], &step["cycles"]["stalls"]), (&"unknown".into(), &Value::Null));
}
