//! Plants mistakes with registers, addresses, lengths and the order of doorbells.

use std::sync::Arc;

use bitstream_model::{BoardConfig, Delays, Quirks};
use pgs_interface::axi_dma::{S2MM_OFFSET, TAILDESC, TAILDESC_MSB};
use pgs_interface::descriptor::{CONTROL, control};

use super::kinds::{Event, Mistake, Trouble};
use super::planted::Planted;
use super::{Bench, assert_reported, clean, clean_in};
use crate::axi_dma::{Descriptor, largest_piece, pieces};
use crate::platform::{Access, BusAddress, CpuBuffer, Platform};

/// Descriptors of at most 255 bytes: several a packet.
fn short_lengths() -> BoardConfig {
    BoardConfig { length_width: 8, ..BoardConfig::default() }
}

#[test]
fn mistake_01_length_width_assumed() {
    // The collisions of 600 cubes take 19,200 bytes of a channel, more than 14 bits can express.
    let narrow = BoardConfig { length_width: 14, ..BoardConfig::default() };
    assert_reported(Mistake::LengthWidthAssumed, "does not fit 14 bits", |mistake| {
        clean(narrow, mistake, &[600])
    });
    // A bitstream and cores that disagree are refused before the first length is written.
    let quirks = Quirks { length_register: Some(14), ..Quirks::default() };
    let wrong = BoardConfig { quirks, ..BoardConfig::default() };
    assert_reported(
        Mistake::LengthWidthAssumed,
        "does not fit 14 bits",
        |mistake| match Bench::open(wrong, mistake, None) {
            Err(refused) => {
                assert!(refused.contains("26") && refused.contains("14"), "{refused}");
                Ok(())
            }
            Ok(mut bench) => bench.step(600).and_then(|_| bench.close()),
        },
    );
}

#[test]
fn mistake_02_upper_half_written_first() {
    for length_width in [8, 26] {
        let config = BoardConfig { length_width, ..BoardConfig::default() };
        assert_reported(Mistake::UpperHalfFirst, "has length 0", |mistake| {
            clean_in(Some(Trouble::Preempted), config, mistake, &[9, 20, 9])
        });
    }
}

#[test]
fn mistake_03_address_cut_to_32_bits() {
    assert_reported(Mistake::AddressCut, "no buffer is granted there", |mistake| {
        clean(BoardConfig::default(), mistake, &[9, 20])
    });
    // Memory that the cores do not reach is refused, not cut.
    let planted = Planted::new(BoardConfig::default(), None, None);
    let platform: Arc<dyn Platform> = Arc::new(planted);
    let beyond = (0..4).filter(|_| CpuBuffer::allocate(&platform, 4, 32.into()).is_err()).count();
    assert!(beyond > 0, "some of the memory lies above 4 GiB");
}

#[test]
fn mistake_04_current_descriptor_written_while_running() {
    // The channels halt slowly. The second step needs longer rings, and the driver stops the
    // channels for it.
    let delays = Delays { halt: 100_000, ..Delays::default() };
    let config = BoardConfig { delays, ..short_lengths() };
    assert_reported(Mistake::HaltNotAwaited, "CURDESC written while not halted", |mistake| {
        clean(config, mistake, &[3, 90])
    });
}

#[test]
fn mistake_09_descriptor_used_again_uncleared() {
    for config in [BoardConfig::default(), short_lengths()] {
        assert_reported(Mistake::StatusNotCleared, "still has Cmplted set", |mistake| {
            clean(config, mistake, &[20, 20, 20, 20])
        });
    }
}

/// Checks the packet marks and the length of each piece of a packet.
fn marks(words: &[u32], bytes: u64) -> Result<(), String> {
    let sum: u64 = words.iter().map(|word| u64::from(control::LENGTH.of(*word))).sum();
    if sum != bytes {
        return Err(format!("{sum} bytes instead of {bytes}"));
    }
    for (index, word) in words.iter().enumerate() {
        let starts = control::SOF.is_set(*word) == (index == 0);
        let ends = control::EOF.is_set(*word) == (index + 1 == words.len());
        if !starts || !ends || word >> 28 != 0 {
            return Err(format!("descriptor {index} has {word:#010x}"));
        }
    }
    Ok(())
}

#[test]
fn mistake_15_length_spills_into_the_packet_marks() {
    // Every length beyond 26 bits, and the lengths around them.
    let at = some_address();
    for bytes in [(1 << 26) - 16, 1 << 26, (1 << 26) + 16, 3 << 26, (1_u64 << 28) + 64] {
        let words: Vec<u32> = pieces(bytes, largest_piece(26))
            .map(|(offset, length)| {
                let descriptor = Descriptor {
                    address: at,
                    bytes: length,
                    starts_packet: offset == 0,
                    ends_packet: offset + u64::from(length) == bytes,
                };
                let words = descriptor.words();
                words.iter().find(|(word, _)| *word == CONTROL).expect("it has a CONTROL").1
            })
            .collect();
        marks(&words, bytes).expect("whole, and marked at both ends");
        let unsplit = u32::try_from(bytes).expect("below 4 GiB") | control::SOF.mask();
        let whole = marks(&[unsplit | control::EOF.mask()], bytes);
        assert_eq!(whole.is_ok(), bytes < 1 << 26, "{whole:?}");
    }
    // On a board, in packets of several descriptors.
    assert_reported(Mistake::LengthSpills, "SOF and EOF do not pair", |mistake| {
        clean(short_lengths(), mistake, &[20])
    });
}

fn some_address() -> BusAddress {
    let planted = Planted::new(BoardConfig::default(), None, None);
    let platform: Arc<dyn Platform> = Arc::new(planted);
    let buffer = CpuBuffer::allocate(&platform, 4, 40.into()).expect("there is room");
    let buffer = buffer.into_device(4, Access::Read).expect("handed over");
    buffer.range(0, 64).expect("inside")
}

#[test]
fn mistake_16_receivers_started_after_senders() {
    assert_reported(Mistake::ReceiversLast, "dma0 MM2S was started before dma0 S2MM", |mistake| {
        let mut bench = Bench::open(BoardConfig::default(), mistake, None)?;
        for cubes in [20, 9] {
            bench.planted.events();
            bench.step(cubes)?;
            let mut receivers = 0;
            for event in bench.planted.events() {
                match event {
                    Event::Write(core, at, _) if at == S2MM_OFFSET + TAILDESC_MSB.offset => {
                        receivers |= 1 << core;
                    }
                    Event::Write(core, at, _) if at == TAILDESC.offset && core < 4 => {
                        // All of the receivers: results go to every channel.
                        if let Some(late) = (0..4).find(|core| receivers & (1 << core) == 0) {
                            return Err(format!(
                                "dma{core} MM2S was started before dma{late} S2MM"
                            ));
                        }
                    }
                    _ => {}
                }
            }
            if receivers != 0b1111 {
                return Err(format!("receivers {receivers:#06b} were started"));
            }
        }
        bench.close()
    });
}
