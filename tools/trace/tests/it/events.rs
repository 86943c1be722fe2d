//! Reads trace events, and holds them against the schema and the counts of the step.

use bitstream_model::{BoardConfig, Direction, Fault, FaultKind, StepPhase, When};
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

/// The events on the thread of a channel's packets: each packet, with its beats as the states
/// within it have them.
fn packets(events: &[Value], thread: &str) -> Vec<(String, u64, u64)> {
    let named = |event: &&Value| {
        event["name"] == "thread_name" && event["pid"] == 1 && event["args"]["name"] == thread
    };
    let number = events.iter().find(named).expect("a thread")["tid"].clone();
    let mut found = Vec::new();
    for event in events.iter().filter(|event| event["ph"] == "X" && event["tid"] == number) {
        if event["pid"] != 1 {
            continue;
        }
        let beats = event["args"]["beats"].as_u64().unwrap_or(0);
        let name = event["name"].as_str().expect("a name").to_owned();
        match event["args"].get("ended") {
            Some(_) => found.push((name, beats, 0)),
            None => found.last_mut().expect("a packet").2 += beats,
        }
    }
    found
}

#[test]
fn each_packet_of_a_repeated_step_has_its_own_beats() {
    let fault = Fault::new(FaultKind::DmaDecErr).on(2, Direction::Mm2s);
    let fault = fault.in_phase(StepPhase::Contact(2)).when(When::Beat(17));
    let taken = Taken::repeated(BoardConfig::default(), Some(fault), 1);
    let report = taken.report.as_ref().expect("the second attempt");
    assert_eq!(report.retries, 1);
    let mut out = Vec::new();
    taken.traced().write_events(&mut out).expect("a vector takes all");
    let document: Value = serde_json::from_slice(&out).expect("a document");
    schema::assert_valid(&document);
    let events = document["traceEvents"].as_array().expect("events");
    for core in 0..4 {
        for direction in ["MM2S", "S2MM"] {
            for (name, beats, within) in packets(events, &format!("{direction} {core}")) {
                assert_eq!(beats, within, "{direction} {core}: {name}");
            }
        }
    }
    let faulty = packets(events, "MM2S 2");
    let names: Vec<&str> = faulty.iter().map(|(name, ..)| name.as_str()).collect();
    assert_eq!(names[..4], ["velocities", "contact 1", "contact 2", "velocities"]);
    assert_eq!(faulty[2].1, 17);
    assert_eq!(faulty[0].1, faulty[3].1);
    let mut picture = Vec::new();
    taken.traced().write_timeline(&mut picture).expect("a vector takes all");
    let picture = String::from_utf8(picture).expect("text");
    let cycles = report.cycles.total;
    assert!(picture.contains(&format!("Accelerator: {cycles} clocks")), "{picture}");
    assert!(picture.contains("attempt 2 ended") && picture.contains("cut short"), "{picture}");
}

#[test]
fn events_agree_with_the_schema_and_the_report() {
    assert_agrees(&Taken::new(BoardConfig::default()));
}
