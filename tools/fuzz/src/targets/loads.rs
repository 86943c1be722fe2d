//! Has bitstreams and overlays judged as `pgs load --check` does, most of them damaged.

use std::fs;

use pgs_loading::{AtFault, Request, check};
use zynq_pgs::platform::ManagerChoice;

use super::files::{self, BODY, DESYNCED, HEAD};
use crate::input::Input;
use crate::tally::Tally;

const IDCODE: u32 = 0x0473_8093;
/// Heads of files that are mistaken for bitstreams: bootgen's, Vivado's, a tree's, an archive's.
const HEADS: [&[u8]; 4] = [
    &[0x66, 0x55, 0x99, 0xAA, b'X', b'N', b'L', b'X'],
    b"\x00\x09\x0f\xf0\x0f\xf0\x0f\xf0\x0f\xf0\x00\x00\x01a",
    &[0xD0, 0x0D, 0xFE, 0xED],
    b"\x1f\x8b\x08",
];

/// One execution.
pub(super) fn run(bytes: &[u8]) -> Tally {
    let mut input = Input::new(bytes);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.bit.bin");
    let mut right = true;
    let mhz = input.one_in(2).then(|| 1 + input.below(4000));
    let stream = bitstream(&mut input, mhz, &mut right);
    fs::write(&path, &stream).expect("written");
    let mut request = Request {
        bitstream: path,
        overlay: None,
        part: "XCZU9EG".parse().expect("a chip"),
        unjudged: input.one_in(4),
        manager: ManagerChoice::Automatic,
        replace_others: false,
    };
    if input.one_in(2) {
        let path = folder.path().join("x.dtbo");
        fs::write(&path, overlay(&mut input, mhz, &mut right)).expect("written");
        request.overlay = Some(path);
    }

    let mut tally = Tally::default();
    match check(&request) {
        Ok(judged) => {
            assert_eq!(judged.bytes(), stream.len() as u64);
            if !request.unjudged {
                assert_eq!(judged.chip, Some(request.part), "taken for this chip");
                if let (Some(wanted), Some(Some(sets_hz))) =
                    (judged.wanted_mhz, judged.overlay_clock_hz())
                {
                    let (sets, wanted) = (f64::from(sets_hz), f64::from(wanted) * 1e6);
                    assert!((sets - wanted).abs() <= wanted / 100.0, "{sets} Hz for {wanted}");
                }
            }
            tally.steps += 1;
        }
        Err(error) => {
            assert!(!right, "undamaged files: {error}");
            assert_eq!(error.at_fault(), AtFault::Caller, "{error}");
            assert!(!error.next().is_empty(), "{error}");
            tally.refused += 1;
        }
    }
    tally
}

/// A bitstream; sometimes of another chip, of other packets, or damaged.
fn bitstream(input: &mut Input<'_>, mhz: Option<u32>, right: &mut bool) -> Vec<u8> {
    if input.one_in(2) {
        return damaged(input, files::bitstream(mhz), right);
    }
    let idcode = if input.one_in(4) { input.telling_word() } else { IDCODE };
    // Of any revision.
    *right &= idcode << 4 == IDCODE << 4;
    let mut words = [HEAD, &files::chip(idcode)].concat();
    if let Some(mhz) = mhz {
        words.extend(files::write(13, &[0x5047_0000 | mhz]));
    }
    if input.one_in(2) {
        let data: Vec<u32> = (0..input.below(4)).map(|_| input.telling_word()).collect();
        words.extend(files::write(input.below(32), &data));
        words.extend(files::noise(input.below(4)));
        *right = false;
    }
    words.extend([BODY, DESYNCED].concat());
    let bytes = files::bytes(&[&words]);
    damaged(input, bytes, right)
}

/// An overlay for a bitstream that asks for this rate; sometimes another, or damaged.
fn overlay(input: &mut Input<'_>, mhz: Option<u32>, right: &mut bool) -> Vec<u8> {
    let mut hz = mhz.map(|mhz| mhz * 1_000_000);
    if input.one_in(4) {
        hz = input.one_in(2).then(|| input.word());
        *right = false;
    }
    let firmware = input.pick(&[None, None, None, Some("x.bit.bin"), Some("y.bit.bin")]);
    *right &= firmware != Some("y.bit.bin");
    let bytes = files::overlay(hz, firmware);
    damaged(input, bytes, right)
}

/// A file as it is, or with some of its bytes changed, cut out, put in or replaced by another head.
fn damaged(input: &mut Input<'_>, mut bytes: Vec<u8>, right: &mut bool) -> Vec<u8> {
    if !input.one_in(2) {
        return bytes;
    }
    *right = false;
    for _ in 0..=input.below(4) {
        let at = input.index(bytes.len() + 1);
        match input.below(8) {
            0 => bytes.truncate(at),
            1 => drop(bytes.splice(at..at, input.bytes(16).to_vec())),
            2 => drop(bytes.drain(at..(at + 4 * input.index(8)).min(bytes.len()))),
            3 => {
                let head = input.pick(&HEADS);
                bytes.splice(..head.len().min(bytes.len()), head.to_vec());
            }
            4 | 5 => {
                // A length, an offset, a token or a packet's head.
                let word = input.telling_word().to_be_bytes();
                let at = at & !3;
                let end = (at + 4).min(bytes.len());
                bytes[at..end].copy_from_slice(&word[..end - at]);
            }
            _ => bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= input.byte()),
        }
    }
    bytes
}
