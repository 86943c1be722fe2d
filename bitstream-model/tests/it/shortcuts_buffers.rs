//! A pass takes the collisions decoded in the first one only as long as it brings the same bytes: other
//! buffers, other bytes, buffers that change hands, packets that end elsewhere.

use bitstream_model::{BoardConfig, DeviceAccess, Direction, FaultPlan};
use half::f16;
use pgs_interface::control;
use pgs_interface::profile::{FLOAT, HALF, Profile};
use pgs_interface::record::Beat;

use crate::common::packing::beats_out;
use crate::common::ring::WHOLE;
use crate::common::scene::Lane;
use crate::common::sg::{Failure, Flight, LONG};
use crate::common::shortcuts::{
    PROFILES, Seen, begin, begin_once, large, same, scene, whole_length,
};

/// Where the first contact point of each collision is on the streams of a design, or of each issue.
#[derive(Debug, Clone, Copy)]
struct FirstContact {
    stream: usize,
    /// Collisions of an issue, its beats on the stream, and which of them it is.
    together: usize,
    share: usize,
    beat: usize,
    /// Of sixteen-bit words: which half of the beat.
    half: Option<usize>,
}

impl FirstContact {
    fn of(profile: &Profile) -> Self {
        match profile.collisions_per_issue {
            1 => Self { stream: 3, together: 1, share: 1, beat: 0, half: None },
            _ => Self { stream: 0, together: 2, share: 3, beat: 1, half: Some(1) },
        }
    }

    /// The beat of a collision, or of the first one of its issue.
    fn among(self, beats: &mut [Beat], collision: usize) -> &mut Beat {
        &mut beats[collision / self.together * self.share + self.beat]
    }

    /// Puts it somewhere else.
    fn moves(self, beat: &mut Beat) {
        match self.half {
            Some(half) => beat.0[2 * half] = u32::from(f16::from_f32(0.75).to_bits()) * 0x1_0001,
            None => beat.0[1] = 0.75_f32.to_bits(),
        }
    }

    /// Lets it lie deep inside.
    fn sinks(self, beat: &mut Beat) {
        match self.half {
            Some(half) => {
                let distance = u32::from(f16::from_f32(-50.0).to_bits());
                let word = &mut beat.0[2 * half + 1];
                *word = *word & 0xFFFF | (distance << 16);
            }
            None => beat.0[3] = (-50.0_f32).to_bits(),
        }
    }
}

#[test]
fn other_bytes_in_a_later_pass_are_noticed() {
    let step = large();
    for profile in PROFILES {
        let run = |change: &dyn Fn(usize, usize, &mut Vec<Beat>)| {
            same(BoardConfig { profile, ..whole_length() }, None, 2, |machine| {
                let (flight, _) = begin(machine, &step, change);
                machine.wait(&flight, LONG)?;
                Ok(machine.collect(&flight, step.bodies.len()))
            })
        };
        let usual = run(&|_, _, _| {});
        let contact = FirstContact::of(profile);
        // Packet 0 are the velocities, 1 to 4 the contact passes.
        for pass in 2..=4 {
            for collision in [0, 1, 401, 799] {
                let changed = run(&|stream, packet, beats| {
                    if stream == contact.stream && packet == pass {
                        contact.sinks(contact.among(beats, collision));
                    }
                });
                let bodies = |seen: &Seen| seen.steps[0].clone().expect("no fault").0;
                let case = format!("{}: pass {pass}, collision {collision}", profile.name);
                assert_ne!(bodies(&changed), bodies(&usual), "{case}");
            }
        }
        // The decoder refuses a wrong record in the pass that brings it.
        let refused = run(&|stream, packet, beats| {
            if stream == 0 && packet == 6 {
                match contact.half {
                    None => beats[2 * 300].0[3] = 5,
                    Some(_) => beats[3 * 150].0[1] |= 5 << 16,
                }
            }
        });
        let code = control::ErrorCode::ContactCount;
        assert_eq!(refused.steps, [Err(Failure::Accelerator(code as u32, 0, 300))]);
    }
}

#[test]
fn a_packet_that_ends_too_early_or_too_late_is_noticed() {
    use control::ErrorCode::{TlastEarly, TlastMissing};
    let step = large();
    for profile in PROFILES {
        for (stream, pass) in [(0, 1), (1, 1), (2, 3), (2, 8)] {
            let of_stream = |on: &&u8| usize::from(**on) == stream;
            let share = profile.stripes.collisions.streams.iter().filter(of_stream).count();
            let all = 800 / profile.collisions_per_issue as usize * share;
            for length in [1, 333, all - 1, all + 1] {
                let config = BoardConfig { profile, ..whole_length() };
                let seen = same(config, None, 1, |machine| {
                    let (flight, _) = begin(machine, &step, |of, packet, beats| {
                        if of == stream && packet == pass {
                            beats.resize(length, Beat::default());
                        }
                    });
                    machine.wait(&flight, LONG)?;
                    Ok(machine.collect(&flight, step.bodies.len()))
                });
                let code = if length < all { TlastEarly } else { TlastMissing };
                let met = match seen.steps[0] {
                    Err(Failure::Accelerator(code, stream, _)) => Some((code, stream as usize)),
                    _ => None,
                };
                let case = format!("{}: {stream} {pass} {length}", profile.name);
                assert_eq!(met, Some((code as u32, stream)), "{case}");
            }
        }
    }
}

#[test]
fn the_same_bytes_in_other_buffers_give_the_same() {
    let step = large();
    for profile in PROFILES {
        let config = BoardConfig { profile, ..whole_length() };
        let apart = same(config, None, 1, |machine| {
            let (flight, _) = begin(machine, &step, |_, _, _| {});
            machine.wait(&flight, LONG)?;
            Ok(machine.collect(&flight, step.bodies.len()))
        });
        let together = same(config, None, 1, |machine| machine.step(&step));
        let results = |seen: &Seen| seen.steps[0].clone().expect("no fault");
        assert_eq!(results(&apart).0, results(&together).0);
    }
}

#[test]
fn a_corrupt_beat_in_a_later_pass_is_noticed() {
    let step = large();
    for (profile, spoils) in [(&FLOAT, "0x00700000@dma3.mm2s"), (&HALF, "0x04000400@dma0.mm2s")] {
        let config = BoardConfig { profile, ..whole_length() };
        let usual = same(config, None, 1, |machine| machine.step(&step));
        for at in ["contact1", "contact3", "friction2"] {
            let plan = format!("corrupt={spoils},phase={at},beat=500");
            let plan: FaultPlan = plan.parse().expect("a plan");
            let seen = same(config, Some(&plan), 1, |machine| machine.step(&step));
            assert_eq!(seen.faults, 1);
            assert_ne!(seen.steps, usual.steps, "{} {at}", profile.name);
        }
    }
}

#[test]
fn a_buffer_that_changes_hands_in_the_middle_of_a_pass_is_noticed() {
    let step = large();
    for profile in PROFILES {
        let contact = FirstContact::of(profile);
        // A pass takes some 1600 cycles of 3.6 ns, or 1200 of 4 ns.
        for pause in [3, 5, 6, 8, 14, 21, 33] {
            let config = BoardConfig { profile, ..whole_length() };
            let seen = same(config, None, 1, |machine| {
                let variant = machine.host.variant();
                let mut flight = Flight::default();
                step.write_arguments(&machine.host);
                machine.arm(&mut flight, &beats_out(&variant, &step));
                machine.start();
                let lanes = step.packed(&variant);
                let mut addresses = Vec::new();
                for (stream, Lane { segments, packets }) in lanes.iter().enumerate() {
                    let there = segments.iter().filter(|beats| !beats.is_empty());
                    let buffers: Vec<u64> =
                        there.map(|beats| machine.host.readable(beats)).collect();
                    buffers.iter().for_each(|address| flight.input(*address));
                    let mut tail = 0;
                    for segment in packets {
                        let bytes = u32::try_from(segments[*segment].len() * 16).expect("some");
                        tail = machine.mm2s[stream].push(buffers[*segment], bytes | WHOLE);
                    }
                    machine.mm2s[stream].doorbell(&machine.host, tail);
                    addresses.push(buffers);
                }
                machine.host.pause(pause);
                // The contact points of the first half lie elsewhere from now on.
                let address = addresses[contact.stream][1];
                let mut beats = machine.host.take(address);
                (0..400).for_each(|of| contact.moves(contact.among(&mut beats, of)));
                let port = &machine.host.port;
                port.hand_over(address, beats, DeviceAccess::Read).expect("the CPU owns it");
                machine.wait(&flight, LONG)?;
                Ok(machine.collect(&flight, step.bodies.len()))
            });
            assert!(seen.steps[0].is_ok(), "{} {seen:?}", profile.name);
        }
    }
}

/// How far a step of many bodies has come, by the buffers of stream 2.
#[derive(Debug, Clone, Copy)]
enum Moment {
    /// Velocities are loaded.
    Load,
    /// Poses come.
    Poses,
    /// Results go.
    Results,
}

impl Moment {
    fn access(self) -> DeviceAccess {
        match self {
            Self::Load | Self::Poses => DeviceAccess::Read,
            Self::Results => DeviceAccess::Write,
        }
    }

    /// The buffer that is at work then.
    fn buffer(self, flight: &Flight) -> u64 {
        match self {
            // Velocities, collisions and poses of each stream.
            Self::Load => flight.inputs()[3 * 2],
            Self::Poses => flight.inputs()[3 * 2 + 2],
            Self::Results => flight.outputs()[2],
        }
    }
}

/// When each moment is for a step of 3000 bodies and 40 collisions, microseconds from its start.
type Moments = [(Moment, &'static [u64]); 3];

const MOMENTS: [(&Profile, Moments); 1] = [(
    &FLOAT,
    [
        (Moment::Load, &[1, 3, 6]),
        (Moment::Poses, &[20, 44, 49]),
        (Moment::Results, &[44, 49, 51, 57]),
    ],
)];

#[test]
fn a_buffer_of_bodies_that_changes_hands_is_noticed() {
    let step = scene(3000, 40, 7, true);
    // One word of each beat is another when the device gets the buffer back, if `other` says so.
    let run = |profile, moment: Moment, pause, other: bool| {
        let config = BoardConfig { profile, ..whole_length() };
        let mut seen = same(config, None, 1, |machine| {
            let flight = begin_once(machine, &step);
            machine.host.pause(pause);
            let address = moment.buffer(&flight);
            let mut beats = machine.host.take(address);
            for beat in beats.iter_mut().filter(|_| other) {
                beat.0[0] = 0.75_f32.to_bits();
            }
            let port = &machine.host.port;
            port.hand_over(address, beats, moment.access()).expect("the CPU owns it");
            machine.wait(&flight, LONG)?;
            Ok(machine.collect(&flight, step.bodies.len()))
        });
        seen.steps.remove(0).expect("no fault").0
    };
    for (profile, moments) in MOMENTS {
        for (moment, pauses) in moments {
            // Stream 2 carries the odd bodies, and one row of every result.
            let all = match moment {
                Moment::Load | Moment::Poses => 1500,
                Moment::Results => 3000,
            };
            for pause in pauses {
                let [usual, changed] =
                    [false, true].map(|other| run(profile, moment, *pause, other));
                let others = usual.iter().zip(&changed).filter(|(usual, changed)| usual != changed);
                // It was in the middle.
                let others = others.count();
                let case = format!("{} {moment:?} {pause}: {others}", profile.name);
                assert!((1..all).contains(&others), "{case}");
            }
        }
    }
}

#[test]
fn a_buffer_of_bodies_that_is_gone_or_shorter_is_noticed() {
    let step = scene(3000, 40, 7, true);
    for (profile, moment, pauses) in MOMENTS
        .into_iter()
        .flat_map(|(profile, moments)| moments.map(|(moment, pauses)| (profile, moment, pauses)))
    {
        for (pause, gone) in pauses.iter().flat_map(|pause| [(pause, false), (pause, true)]) {
            let config = BoardConfig { profile, ..whole_length() };
            let seen = same(config, None, 1, |machine| {
                let flight = begin_once(machine, &step);
                machine.host.pause(*pause);
                let address = moment.buffer(&flight);
                let beats = machine.host.take(address);
                // More are missing than a FIFO holds.
                let granted = beats.len() - 700;
                let kept = (!gone).then(|| beats[granted..].to_vec());
                if !gone {
                    let port = &machine.host.port;
                    port.hand_over_first(address, beats, granted, moment.access())
                        .expect("the CPU owns it");
                }
                let waited = machine.wait(&flight, LONG);
                if let Some(kept) = kept {
                    // Whether and when an error is seen: the device wrote nothing outside its grant.
                    assert_eq!(machine.host.take(address)[granted..], kept, "{moment:?} {pause}");
                }
                waited?;
                Ok(machine.collect(&flight, step.bodies.len()))
            });
            let direction = match moment.access() {
                DeviceAccess::Read => Direction::Mm2s,
                DeviceAccess::Write => Direction::S2mm,
            };
            let met = match seen.steps[0] {
                Err(Failure::Dma { core, direction, .. }) => Some((core, direction)),
                _ => None,
            };
            let case = format!("{} {moment:?} {pause} {gone}", profile.name);
            assert_eq!(met, Some((2, direction)), "{case}");
        }
    }
}

#[test]
fn beats_on_the_way_are_there_when_their_buffer_is_gone() {
    let step = large();
    for (profile, pause) in PROFILES.into_iter().flat_map(|of| [3, 6, 20].map(|at| (of, at))) {
        let seen = same(BoardConfig { profile, ..whole_length() }, None, 1, |machine| {
            let (flight, addresses) = begin(machine, &step, |_, _, _| {});
            machine.host.pause(pause);
            // The device runs into the hole that they leave.
            for stream in &addresses {
                for address in stream {
                    machine.host.take(*address);
                    machine.host.port.release(*address).expect("it was allocated");
                }
            }
            machine.host.pause(200);
            machine.wait(&flight, LONG)?;
            Ok(machine.collect(&flight, step.bodies.len()))
        });
        assert!(matches!(seen.steps[0], Err(Failure::Dma { .. })), "{} {seen:?}", profile.name);
    }
}
