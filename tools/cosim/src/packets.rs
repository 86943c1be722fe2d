//! The packets of a step: rows of words dealt out to the streams (specification, sections 2 and 3).

use bitstream_model::external::StreamBeat;
use half::f16;
use pgs_interface::number::StreamFormat;
use pgs_interface::record::{Beat, LANES, collision, pose};

use crate::scene::{Body, Collision, Scene};

/// Most streams into an accelerator.
pub const STREAMS: usize = 4;

/// A fault in the packets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// TLAST on a beat that is not the last one.
    EarlyLast,
    /// No TLAST on the last beat.
    NoLast,
    /// Invalid bytes.
    Partial,
}

/// The place of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaultAt {
    /// The kind.
    pub fault: Fault,
    /// The segment, from 0: velocities, passes, poses.
    pub segment: usize,
    /// The stream.
    pub stream: usize,
    /// The beat; taken modulo the length of the packet.
    pub beat: usize,
}

/// All beats of a step on each stream, in order.
pub type Beats = [Vec<StreamBeat>; STREAMS];

/// A word of a row: a number as bits of f32, or an unsigned integer.
#[derive(Debug, Clone, Copy)]
enum Word {
    Number(u32),
    Integer(u32),
    /// Of contact points; in sixteen bits it has no friction above it.
    Count(u32),
}

type Row = [Word; LANES];

/// How the records of a profile lie on its streams.
struct Layout {
    format: StreamFormat,
    /// Collisions that enter together.
    together: usize,
    body: Stripe,
    collision: Stripe,
    warm: Stripe,
}

/// The stream of each beat, over and over, and whether beats of zeros fill the last group up.
#[derive(Clone, Copy)]
struct Stripe(&'static [usize], bool);

fn layout(scene: &Scene) -> Layout {
    let format = scene.variant.numbers.collisions;
    match format {
        StreamFormat::F32 => Layout {
            format,
            together: 1,
            body: Stripe(&[0, 1, 2, 3], false),
            collision: Stripe(&[0, 1, 2, 3, 0, 1, 2], false),
            warm: Stripe(&[0, 1, 2, 3, 0, 1, 2, 3], false),
        },
        StreamFormat::Binary16 => Layout {
            format,
            together: 2,
            body: Stripe(&[0, 0, 1, 1, 2], true),
            collision: Stripe(&[0, 0, 0, 1, 1, 1, 2], true),
            warm: Stripe(&[0, 0, 0, 1, 1, 1, 2, 2], true),
        },
    }
}

/// The packets of a step, with at most one fault.
#[must_use]
pub fn packets(scene: &Scene, fault: Option<FaultAt>) -> Beats {
    let Layout { format, together, body, collision, warm } = layout(scene);
    let world = scene.has_world_inertia();
    let velocities: Vec<Row> =
        scene.bodies.iter().flat_map(|body| velocity_rows(body, world)).collect();
    let poses: Vec<Row> = scene.bodies.iter().flat_map(pose_rows).collect();
    let rows = |impulses: Option<usize>| {
        let mut all: Vec<Row> = Vec::new();
        for issue in scene.collisions.chunks(together) {
            let none = together - issue.len();
            all.extend(issue.iter().flat_map(collision_rows));
            all.resize(all.len() + none * collision::ROWS, ZEROS);
            if let Some(kind) = impulses {
                all.extend(
                    issue.iter().map(|collision| collision.impulses[kind].map(Word::Number)),
                );
                all.resize(all.len() + none, ZEROS);
            }
        }
        beats(format, &all)
    };
    let collisions = rows(None);
    let warm_ones = [0, 1].map(|kind| rows(Some(kind)));
    let [velocities, poses] = [velocities, poses].map(|rows| beats(format, &rows));

    let mut segments = vec![(&velocities, body)];
    for (passes, warm_one) in scene.passes().into_iter().zip(&warm_ones) {
        segments.extend((0..passes).map(|pass| match pass {
            0 if scene.arguments.warm_start => (warm_one, warm),
            _ => (&collisions, collision),
        }));
    }
    segments.push((&poses, body));
    let mut all = Beats::default();
    let streams = scene.variant.profile.mm2s_widths.len();
    for (number, (array, stripe)) in segments.into_iter().enumerate() {
        let mut packet = deal(array, stripe);
        if let Some(fault) = fault.filter(|fault| fault.segment == number) {
            apply(&mut packet[fault.stream % streams], fault);
        }
        for (stream, packet) in all.iter_mut().zip(packet) {
            stream.extend(packet);
        }
    }
    all
}

/// Rows in beats: one a beat in f32, two in binary16.
fn beats(format: StreamFormat, rows: &[Row]) -> Vec<Beat> {
    match format {
        StreamFormat::F32 => {
            let word = |word| match word {
                Word::Number(word) | Word::Integer(word) | Word::Count(word) => word,
            };
            rows.iter().map(|row| Beat(row.map(word))).collect()
        }
        StreamFormat::Binary16 => {
            let half = |[x, y, z, w]: Row| {
                let [x, y, z, w] = [x, y, z, w].map(sixteen);
                [x | y << 16, z | w << 16]
            };
            let beat = |pair: &[Row]| {
                let ([a, b], [c, d]) = (half(pair[0]), half(*pair.get(1).unwrap_or(&ZEROS)));
                Beat([a, b, c, d])
            };
            rows.chunks(2).map(beat).collect()
        }
    }
}

/// A word in sixteen bits. A subnormal number of f32 becomes one of binary16: a scene has such
/// numbers to be special.
fn sixteen(word: Word) -> u32 {
    match word {
        Word::Integer(word) => word.min(0xFFFF),
        Word::Count(word) => (word & !collision::FRICTION_BITS).min(0xFFFF),
        Word::Number(bits) if f32::from_bits(bits).is_subnormal() => {
            bits >> 16 & 0x8000 | bits & 0x3FF | 1
        }
        Word::Number(bits) => f16::from_f32(f32::from_bits(bits)).to_bits().into(),
    }
}

fn deal(beats: &[Beat], Stripe(streams, padded): Stripe) -> Beats {
    let mut packet = Beats::default();
    let all = if padded { beats.len().next_multiple_of(streams.len()) } else { beats.len() };
    let padding = vec![Beat::default(); all - beats.len()];
    for (beat, stream) in beats.iter().chain(&padding).zip(streams.iter().cycle()) {
        packet[*stream].push(StreamBeat { beat: *beat, last: false, partial: false });
    }
    for stream in &mut packet {
        if let Some(beat) = stream.last_mut() {
            beat.last = true;
        }
    }
    packet
}

fn apply(packet: &mut [StreamBeat], FaultAt { fault, beat, .. }: FaultAt) {
    let length = packet.len();
    if length == 0 {
        return;
    }
    match fault {
        Fault::EarlyLast if length > 1 => packet[beat % (length - 1)].last = true,
        Fault::EarlyLast => {}
        Fault::NoLast => packet[length - 1].last = false,
        Fault::Partial => packet[beat % length].partial = true,
    }
}

const ZEROS: Row = [Word::Integer(0); LANES];

fn with([x, y, z]: [u32; 3], w: Word) -> Row {
    [Word::Number(x), Word::Number(y), Word::Number(z), w]
}

fn velocity_rows(body: &Body, world: bool) -> Vec<Row> {
    let mut rows =
        vec![with(body.linear, Word::Integer(body.shape)), with(body.angular, Word::Integer(0))];
    if world {
        let [xx, yy, zz, xy, xz, yz] = body.inverse_inertia;
        rows.push(with([xx, yy, zz], Word::Number(body.inverse_mass)));
        rows.push(with([xy, xz, yz], Word::Integer(0)));
    }
    rows
}

fn pose_rows(body: &Body) -> [Row; pose::ROWS] {
    [with(body.position, Word::Integer(0)), body.orientation.map(Word::Number)]
}

fn collision_rows(collision: &Collision) -> Vec<Row> {
    let [a, b] = collision.bodies.map(Word::Integer);
    let mut rows = vec![
        with(collision.normal, Word::Count(collision.count)),
        with(collision.positions[0], a),
        with(collision.positions[1], b),
    ];
    rows.extend(collision.points.map(|point| point.map(Word::Number)));
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_collision_has_two_beats_on_three_streams_and_one_on_the_fourth() {
        let rows: Vec<Row> = (0..7).map(|row| [Word::Integer(row); 4]).collect();
        let beats = beats(StreamFormat::F32, &[&rows[..], &rows[..]].concat());
        let packet = deal(&beats, Stripe(&[0, 1, 2, 3, 0, 1, 2], false));
        let words = |stream: usize| packet[stream].iter().map(|beat| beat.beat.0[0]);
        assert_eq!(words(0).collect::<Vec<_>>(), [0, 4, 0, 4]);
        assert_eq!(words(2).collect::<Vec<_>>(), [2, 6, 2, 6]);
        assert_eq!(words(3).collect::<Vec<_>>(), [3, 3]);
        assert!(packet.iter().all(|stream| stream.iter().filter(|beat| beat.last).count() == 1));
    }
}
