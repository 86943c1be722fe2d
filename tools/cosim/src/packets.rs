//! The packets of a step: rows of words dealt out to the four streams (specification, sections 2
//! and 3).

use bitstream_model::external::StreamBeat;
use pgs_interface::profile::Inertia;
use pgs_interface::record::Beat;

use crate::scene::{Body, Collision, Scene};

/// Streams into the accelerator.
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

/// The packets of a step, with at most one fault.
#[must_use]
pub fn packets(scene: &Scene, fault: Option<FaultAt>) -> Beats {
    let velocities: Vec<Vec<[u32; 4]>> =
        scene.bodies.iter().map(|body| velocity_rows(body, scene.inertia)).collect();
    let poses: Vec<Vec<[u32; 4]>> = scene.bodies.iter().map(pose_rows).collect();
    let collisions: Vec<Vec<[u32; 4]>> = scene.collisions.iter().map(collision_rows).collect();
    let warm = [0, 1].map(|kind| {
        let rows = scene.collisions.iter().map(|collision| {
            let mut rows = collision_rows(collision);
            rows.push(collision.impulses[kind]);
            rows
        });
        rows.collect::<Vec<_>>()
    });

    let mut segments = vec![(&velocities, BODY_STRIPE)];
    for (passes, warm) in scene.passes().into_iter().zip(&warm) {
        segments.extend((0..passes).map(|pass| match pass {
            0 if scene.arguments.warm_start => (warm, WARM_STRIPE),
            _ => (&collisions, COLLISION_STRIPE),
        }));
    }
    segments.push((&poses, BODY_STRIPE));
    let mut beats = Beats::default();
    for (number, (records, stripe)) in segments.into_iter().enumerate() {
        let mut packet = deal(records, stripe);
        if let Some(fault) = fault.filter(|fault| fault.segment == number) {
            apply(&mut packet[fault.stream], fault);
        }
        for (stream, packet) in beats.iter_mut().zip(packet) {
            stream.extend(packet);
        }
    }
    beats
}

/// The stream of each beat, over and over.
const BODY_STRIPE: &[usize] = &[0, 1, 2, 3];
const COLLISION_STRIPE: &[usize] = &[0, 1, 2, 3, 0, 1, 2];
const WARM_STRIPE: &[usize] = &[0, 1, 2, 3, 0, 1, 2, 3];

fn deal(records: &[Vec<[u32; 4]>], stripe: &[usize]) -> Beats {
    let mut packet = Beats::default();
    for (row, stream) in records.iter().flatten().zip(stripe.iter().cycle()) {
        packet[*stream].push(StreamBeat { beat: Beat(*row), last: false, partial: false });
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

fn with([x, y, z]: [u32; 3], w: u32) -> [u32; 4] {
    [x, y, z, w]
}

fn velocity_rows(body: &Body, inertia: Inertia) -> Vec<[u32; 4]> {
    let mut rows = vec![with(body.linear, body.shape), with(body.angular, 0)];
    if inertia == Inertia::World {
        let [xx, yy, zz, xy, xz, yz] = body.inverse_inertia;
        rows.extend([[xx, yy, zz, body.inverse_mass], [xy, xz, yz, 0]]);
    }
    rows
}

fn pose_rows(body: &Body) -> Vec<[u32; 4]> {
    vec![with(body.position, 0), body.orientation]
}

fn collision_rows(collision: &Collision) -> Vec<[u32; 4]> {
    let [a, b] = collision.bodies;
    let mut rows = vec![
        with(collision.normal, collision.count),
        with(collision.positions[0], a),
        with(collision.positions[1], b),
    ];
    rows.extend(collision.points);
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_collision_has_two_beats_on_three_streams_and_one_on_the_fourth() {
        let rows: Vec<[u32; 4]> = (0..7).map(|row| [row; 4]).collect();
        let packet = deal(&[rows.clone(), rows], COLLISION_STRIPE);
        let words = |stream: usize| packet[stream].iter().map(|beat| beat.beat.0[0]);
        assert_eq!(words(0).collect::<Vec<_>>(), [0, 4, 0, 4]);
        assert_eq!(words(2).collect::<Vec<_>>(), [2, 6, 2, 6]);
        assert_eq!(words(3).collect::<Vec<_>>(), [3, 3]);
        assert!(packet.iter().all(|stream| stream.iter().filter(|beat| beat.last).count() == 1));
    }
}
