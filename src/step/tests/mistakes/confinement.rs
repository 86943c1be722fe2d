//! Plants descriptors that leave their buffer by a beat, or point to memory of another owner. The
//! board must report each of them; otherwise its silence in other tests would prove nothing.

use bitstream_model::{BoardConfig, Direction};

use super::kinds::{ChannelId, Mistake};
use super::{Bench, Verdict, assert_reported, chain_of};
use crate::StepParameters;

/// In this range of sizes every channel has a step whose data ends with its buffer.
const SIZES: std::ops::Range<u32> = 9..90;

/// Runs steps of growing sizes until the mistake had its occasion, or the channel's data ended with
/// its buffer.
fn growing(config: BoardConfig, mistake: Option<Mistake>, channel: ChannelId) -> Verdict {
    let mut bench = Bench::open(config, mistake, None)?;
    for cubes in SIZES {
        let (stepped, _) = bench.step_with(cubes, &StepParameters::default());
        let board = bench.planted.board();
        if let (Some(_), Some(violation)) = (mistake, board.violations().first()) {
            assert!(bench.planted.planted(), "reported, but not planted: {violation}");
            return Err(violation.kind.to_string());
        }
        stepped.map_err(|error| chain_of(&error))?;
        if mistake.is_none() && bench.planted.fitted(channel) {
            return bench.close();
        }
    }
    assert!(mistake.is_some(), "no step has filled the buffer of {channel:?}");
    assert!(bench.planted.planted(), "{mistake:?} has found no occasion");
    bench.close()
}

/// The board's messages for an access that leaves its buffer: with its start inside, and with its
/// start outside.
const LEFT: [&str; 2] = ["it runs past the end of its buffer", "no buffer is granted there"];

fn each_channel(plant: impl Fn(ChannelId) -> Mistake, messages: &[&str]) {
    for length_width in [26, 8] {
        let config = BoardConfig { length_width, ..BoardConfig::default() };
        for core in [0, 3] {
            for direction in [Direction::Mm2s, Direction::S2mm] {
                let channel = (core, direction);
                let mistake = plant(channel);
                let found =
                    assert_reported(mistake, "", |mistake| growing(config, mistake, channel));
                assert!(found.starts_with(&format!("dma{core} {direction}: ")), "{found}");
                assert!(messages.iter().any(|message| found.ends_with(message)), "{found}");
            }
        }
    }
}

#[test]
fn a_length_that_is_a_beat_too_long_is_reported() {
    each_channel(Mistake::BeatTooLong, &LEFT);
}

#[test]
fn an_address_that_is_a_beat_too_high_is_reported() {
    each_channel(Mistake::BeatTooHigh, &LEFT);
}

#[test]
fn a_buffer_that_was_freed_is_reported() {
    each_channel(Mistake::FreedBuffer, &["no buffer is granted there"]);
}

#[test]
fn a_buffer_of_the_cpu_is_reported() {
    each_channel(Mistake::CpuBuffer, &["the CPU owns the buffer"]);
}
