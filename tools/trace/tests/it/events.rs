//! Reads trace events, and holds them against the schema and the counts of the step.

use bitstream_model::BoardConfig;
use serde_json::Value;

use crate::schema;
use crate::step::Taken;

/// Asserts that the events keep to the schema, nest, and add up to the counts of the step.
pub(crate) fn assert_agrees(taken: &Taken) {
    let mut out = Vec::new();
    taken.traced().write_events(&mut out).expect("a vector takes all");
    let document: Value = serde_json::from_slice(&out).expect("a document");
    schema::assert_valid(&document);
    let events = document["traceEvents"].as_array().expect("events");
    let of = |category: &'static str| {
        events.iter().filter(move |event| event["cat"] == category).cloned()
    };
    let [before, after] = &taken.counts;
    let writes = of("board").filter(|event| event["args"]["write"] == true).count() as u64;
    assert_eq!(writes, after.register_writes - before.register_writes);
    let bells = of("board").filter(|event| event["args"]["doorbell"] == true).count() as u64;
    assert_eq!(bells, after.doorbells - before.doorbells);
    let number = |event: &Value, key: &str| event["args"][key].as_u64().unwrap_or_default();
    let beats: u64 =
        of("board").filter(|event| event["name"] == "beats").map(|one| number(&one, "beats")).sum();
    let counted = |counts: &bitstream_model::Counts| counts.beats_read + counts.beats_written;
    assert_eq!(beats, counted(after) - counted(before));
    let report = taken.report.as_ref().expect("no fault");
    let stages: Vec<Value> =
        of("board").filter(|event| event["args"].get("stalls").is_some()).collect();
    let sum = |key| stages.iter().map(|stage| number(stage, key)).sum::<u64>();
    assert_eq!(sum("clocks"), report.cycles.total);
    assert_eq!(sum("stalls"), report.cycles.stalls);
    assert_eq!(sum("waits"), report.cycles.waits);
    assert_eq!(sum("hazards"), report.hazards);

    // The wall clock of the host is in a process of its own.
    assert!(
        of("host").all(|event| event["pid"] == 2) && of("board").all(|event| event["pid"] == 1)
    );
    let host: f64 = of("host").filter_map(|event| event["dur"].as_f64()).sum();
    assert!((host - report.host.pack.as_secs_f64() * 1e6) > 0.0);
    assert_eq!(of("host").count(), 7);
}

#[test]
fn events_agree_with_the_schema_and_the_report() {
    assert_agrees(&Taken::new(BoardConfig::default()));
}
