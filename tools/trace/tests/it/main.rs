//! The files of a recorded step agree with the counts and logs that the board keeps beside the
//! recording.

mod dump;
mod events;
mod schema;
mod step;

use bitstream_model::interface::profile::{FLOAT, HALF, NAIVE};
use bitstream_model::recording::{Levels, Span};
use bitstream_model::{BoardConfig, FaultKind};

use step::Taken;

#[test]
fn the_picture_is_the_same_with_every_number_of_threads() {
    let picture = |threads| {
        let mut out = Vec::new();
        let config = BoardConfig { threads, ..BoardConfig::default() };
        Taken::new(config).traced().write_timeline(&mut out).expect("a vector takes all");
        String::from_utf8(out).expect("text")
    };
    let one = picture(1);
    assert_eq!(one, picture(2));
    assert!(one.starts_with("<svg ") && one.ends_with("</svg>\n"));
    assert!(one.contains("prefers-color-scheme: dark"));
    let lanes = ["CPU", "MM2S 0", "MM2S 3", "accelerator", "S2MM 0", "S2MM 3", "interrupt"];
    for lane in lanes {
        assert!(one.contains(&format!(">{lane}</text>")), "{lane}");
    }
}

#[test]
fn a_step_that_fails_has_files_too() {
    let fault = bitstream_model::Fault::new(FaultKind::DmaDecErr);
    let taken = Taken::with(BoardConfig::default(), Some(fault));
    assert!(taken.report.is_none());
    let [mut dump, mut events, mut picture] = [const { Vec::new() }; 3];
    taken.traced().write_vcd(&mut dump).expect("a vector takes all");
    taken.traced().write_events(&mut events).expect("a vector takes all");
    taken.traced().write_timeline(&mut picture).expect("a vector takes all");
    let picture = String::from_utf8(picture).expect("text");
    assert!(!picture.contains("NaN"), "{picture}");
    assert!(picture.contains("One step that did not end"), "{picture}");
    schema::assert_valid(&serde_json::from_slice(&events).expect("a document"));
}

#[test]
fn a_recording_of_no_clocks_has_a_picture_of_numbers() {
    let mut taken = Taken::new(BoardConfig::default());
    let span = Span { begin: taken.recording.span.begin, end: taken.recording.span.begin };
    let recording = &mut taken.recording;
    recording.span = span;
    (recording.accesses, recording.doorbells) = (vec![], vec![]);
    (recording.stages, recording.waits) = (vec![], vec![]);
    recording.interrupt = Levels { first: false, edges: vec![] };
    for channel in &mut recording.channels {
        (channel.packets, channel.descriptors) = (vec![], vec![]);
        channel.port.clear();
    }
    let mut picture = Vec::new();
    taken.traced().write_timeline(&mut picture).expect("a vector takes all");
    let picture = String::from_utf8(picture).expect("text");
    assert!(!picture.contains("NaN") && !picture.contains("inf"), "{picture}");
}

#[test]
fn every_design_has_files() {
    for profile in [&FLOAT, &HALF, &NAIVE] {
        let taken = Taken::new(BoardConfig { profile, ..BoardConfig::default() });
        dump::assert_agrees(&taken);
        events::assert_agrees(&taken);
    }
}
