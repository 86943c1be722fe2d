//! Packs a step's input for the streams of any profile, and unpacks its output: words, rows, beats,
//! stripes, padding, written from the interface's tables.

use half::f16;
use pgs_interface::control::NUMBERS_PER_BEAT;
use pgs_interface::number::StreamFormat;
use pgs_interface::profile::{Inertia, Variant};
use pgs_interface::record::{BEAT_BYTES, Beat, collision, result};
use pgs_interface::stripe::Stripe;

use super::scene::{Body, Collision, Lane, Step};

/// The four words of a row; sixteen-bit ones in the low bits.
pub(crate) type Row = [u32; 4];

/// The word of a number.
pub(crate) fn encode(format: StreamFormat, value: f32) -> u32 {
    match format {
        StreamFormat::F32 => value.to_bits(),
        StreamFormat::Binary16 => f16::from_f32(value).to_bits().into(),
    }
}

/// The number of a word.
pub(crate) fn decode(format: StreamFormat, word: u32) -> f32 {
    let half = || u16::try_from(word).expect("a word of sixteen bits");
    match format {
        StreamFormat::F32 => f32::from_bits(word),
        StreamFormat::Binary16 => f16::from_bits(half()).to_f32(),
    }
}

fn row(format: StreamFormat, [x, y, z]: [f32; 3], word: u32) -> Row {
    let [x, y, z] = [x, y, z].map(|value| encode(format, value));
    [x, y, z, word]
}

/// Rows one after the other in beats.
pub(crate) fn beats(format: StreamFormat, rows: &[Row]) -> Vec<Beat> {
    if format.bits() == 32 {
        return rows.iter().copied().map(Beat).collect();
    }
    let words: Vec<u32> = rows.iter().flatten().copied().collect();
    words
        .chunks(8)
        .map(|words| {
            let mut beat = Beat::default();
            for (k, word) in words.iter().enumerate() {
                assert!(*word < 0x1_0000, "a word of sixteen bits");
                beat.0[k / 2] |= word << (16 * (k % 2));
            }
            beat
        })
        .collect()
}

/// Beats on each of `streams` streams.
pub(crate) fn deal(stripe: &Stripe, streams: usize, mut beats: Vec<Beat>) -> Vec<Vec<Beat>> {
    while stripe.padded && !beats.len().is_multiple_of(stripe.streams.len()) {
        beats.push(Beat::default());
    }
    let mut dealt = vec![Vec::new(); streams];
    for (beat, stream) in beats.into_iter().zip(stripe.streams.iter().cycle()) {
        dealt[usize::from(*stream)].push(beat);
    }
    dealt
}

pub(crate) fn velocity_rows(variant: &Variant, step: &Step, body: &Body, k: usize) -> Vec<Row> {
    let format = variant.numbers.bodies;
    let mut rows = vec![row(format, body.linear, body.shape), row(format, body.angular, 0)];
    if variant.inertia == Inertia::World {
        let [xx, yy, zz, xy, xz, yz] = step.world_inertia(k);
        let mass = step.masses.get(k).map_or(0, |mass| encode(format, *mass));
        rows.push(row(format, [xx, yy, zz], mass));
        rows.push(row(format, [xy, xz, yz], 0));
    }
    rows
}

pub(crate) fn collision_rows(variant: &Variant, collision: &Collision) -> Vec<Row> {
    let format = variant.numbers.collisions;
    let [a, b] = collision.bodies;
    let [at_a, at_b] = collision.positions;
    let contact = |[x, y, z, distance]: [f32; 4]| row(format, [x, y, z], encode(format, distance));
    let mut rows = vec![
        row(format, collision.normal, collision.count),
        row(format, at_a, a),
        row(format, at_b, b),
    ];
    rows.extend(collision.contacts.map(contact));
    rows
}

pub(crate) fn pose_rows(format: StreamFormat, body: &Body) -> [Row; 2] {
    [row(format, body.position, 0), body.orientation.map(|value| encode(format, value))]
}

impl Step {
    /// The beats and packets on each stream of a profile.
    pub(crate) fn packed(&self, variant: &Variant) -> Vec<Lane> {
        let profile = variant.profile;
        let streams = profile.mm2s_widths.len();
        let numbers = variant.numbers;
        let velocities: Vec<Row> = (0..)
            .zip(&self.bodies)
            .flat_map(|(k, body)| velocity_rows(variant, self, body, k))
            .collect();
        let mut records: Vec<Vec<Row>> =
            self.collisions.iter().map(|collision| collision_rows(variant, collision)).collect();
        for (record, friction) in records.iter_mut().zip(&self.frictions) {
            record[0][3] |= u32::from(f16::from_f32(*friction).to_bits()) << 16;
        }
        let mut collisions = records.concat();
        let issue = profile.collisions_per_issue as usize * collision::ROWS;
        collisions.resize(collisions.len().next_multiple_of(issue), [0; 4]);
        let poses: Vec<Row> =
            self.bodies.iter().flat_map(|body| pose_rows(numbers.poses, body)).collect();
        let stripes = &profile.stripes;
        // The collisions with the impulses of a kind, where they have a stripe.
        let with_impulses = |kind: usize| {
            let stripe = stripes.warm_collisions.filter(|_| !self.impulses.is_empty());
            let Some(stripe) = stripe else { return vec![Vec::new(); streams] };
            let together = profile.collisions_per_issue as usize;
            let mut rows = Vec::new();
            for (records, impulses) in records.chunks(together).zip(self.impulses.chunks(together))
            {
                let padding = together - records.len();
                rows.extend(records.iter().flatten());
                rows.extend(vec![[0; 4]; padding * collision::ROWS]);
                for impulses in impulses {
                    rows.push(impulses[kind].map(|impulse| encode(numbers.collisions, impulse)));
                }
                rows.extend(vec![[0; 4]; padding]);
            }
            deal(&stripe, streams, beats(numbers.collisions, &rows))
        };
        let segments = [
            deal(&stripes.velocities, streams, beats(numbers.bodies, &velocities)),
            deal(&stripes.collisions, streams, beats(numbers.collisions, &collisions)),
            deal(&stripes.poses, streams, beats(numbers.poses, &poses)),
            with_impulses(0),
            with_impulses(1),
        ];
        (0..streams)
            .map(|stream| {
                let mut segments = segments.each_ref().map(|segment| segment[stream].clone());
                let mut packets = vec![0];
                for (warm, passes) in [3, 4].into_iter().zip(self.iterations) {
                    if passes > 0 && !self.impulses.is_empty() {
                        // The same beats come from the same buffer.
                        let same = segments[warm] == segments[1];
                        packets.push(if same { 1 } else { warm });
                    }
                    if segments[warm] == segments[1] {
                        segments[warm].clear();
                    }
                    packets.extend((0..passes).map(|_| 1));
                }
                packets.push(2);
                packets.retain(|segment| !segments[*segment].is_empty());
                Lane { segments, packets }
            })
            .collect()
    }

    /// Cycles of the step on a profile without stalls and waits.
    pub(crate) fn cycles(&self, variant: &Variant) -> u64 {
        let profile = variant.profile;
        let lanes = self.packed(variant);
        let inputs = |segment: usize| {
            let beats: Vec<_> = lanes.iter().map(|lane| lane.segments[segment].len()).collect();
            slowest(&beats, profile.mm2s_widths)
        };
        let results = Step { impulses_out: false, ..self.clone() };
        let results = slowest(&beats_out(variant, &results, false), profile.s2mm_widths);
        let collisions = self.collisions.len() as u64;
        let issues = collisions.div_ceil(profile.collisions_per_issue.into());
        let pass = issues * u64::from(profile.initiation_interval);
        let depths = [variant.contact(), variant.friction()];
        let warm = |passes: u32| match passes {
            0 => 0,
            _ if self.impulses.is_empty() => 0,
            _ => profile.issues_take(issues, warm_interval(variant)),
        };
        let passes: u64 = self
            .iterations
            .into_iter()
            .zip(depths)
            .map(|(passes, depth)| {
                let warm = warm(passes);
                let fills = u64::from(passes) + u64::from(warm > 0);
                u64::from(passes) * pass + warm + fills * u64::from(depth.fill)
            })
            .sum();
        let integration = inputs(2).max(results) + u64::from(profile.integration_fill);
        inputs(0) + if collisions == 0 { 0 } else { passes } + integration
    }
}

/// Cycles for which the records of an issue of a warm pass take their streams.
fn warm_interval(variant: &Variant) -> u64 {
    let Variant { profile, numbers, .. } = *variant;
    let rows = profile.collisions_per_issue as usize * collision::WARM_ROWS;
    let issue = beats(numbers.collisions, &vec![[0; 4]; rows]);
    let stripe = profile.stripes.warm_collisions.expect("a stripe");
    let dealt = deal(&stripe, profile.mm2s_widths.len(), issue);
    slowest(&dealt.iter().map(Vec::len).collect::<Vec<_>>(), profile.mm2s_widths)
}

/// Cycles of the slowest stream, with the beats and the width of each.
fn slowest(beats: &[usize], widths: &[u32]) -> u64 {
    let cycles =
        beats.iter().zip(widths).map(|(beats, width)| *beats as u64 * 128 / u64::from(*width));
    cycles.max().expect("a profile has streams")
}

/// Beats of impulses that go out on the first stream; through the issue queue with the numbers of
/// their collisions.
pub(crate) fn impulse_beats(step: &Step, queued: bool) -> usize {
    let kinds = step.iterations.into_iter().filter(|passes| *passes > 0).count();
    let collisions = step.collisions.len();
    let numbers = if queued { collisions.div_ceil(NUMBERS_PER_BEAT as usize) } else { 0 };
    if step.impulses_out { kinds * (collisions + numbers) } else { 0 }
}

/// Beats on each stream that a step gives out.
pub(crate) fn beats_out(variant: &Variant, step: &Step, queued: bool) -> Vec<usize> {
    let mut beats = result_beats(variant, step.bodies.len());
    beats[0] += impulse_beats(step, queued);
    beats
}

/// The numbers of the collisions and their impulses as a kind's beats have them, in order of issue.
pub(crate) fn numbered(beats: &[Beat], collisions: usize) -> Vec<(u32, Beat)> {
    let of_group = NUMBERS_PER_BEAT as usize;
    let mut all = Vec::new();
    for group in beats.chunks(of_group + 1) {
        let (numbers, impulses) = group.split_last().expect("a chunk is not empty");
        let (own, beyond) = numbers.0.split_at(impulses.len());
        assert!(beyond.iter().all(|number| *number == 0), "words beyond the last are 0");
        all.extend(own.iter().copied().zip(impulses.iter().copied()));
    }
    assert_eq!(all.len(), collisions);
    all
}

/// Result beats on each stream.
pub(crate) fn result_beats(variant: &Variant, bodies: usize) -> Vec<usize> {
    let bits = variant.numbers.poses.bits() as usize;
    let all = vec![Beat::default(); bodies * result::ROWS * 4 * bits / (8 * BEAT_BYTES)];
    let profile = variant.profile;
    let dealt = deal(&profile.stripes.results, profile.s2mm_widths.len(), all);
    dealt.iter().map(Vec::len).collect()
}

/// The bodies from the result beats of all streams. Shapes are not part of a result and read 0. The
/// other beats are padding and must be zeros.
pub(crate) fn unpack(variant: &Variant, streams: &[Box<[Beat]>], bodies: usize) -> Vec<Body> {
    let format = variant.numbers.poses;
    let mut next: Vec<_> = streams.iter().map(|stream| stream.iter()).collect();
    let mut rows = Vec::new();
    for stream in variant.profile.stripes.results.streams.iter().cycle() {
        let Some(Beat(words)) = next[usize::from(*stream)].next() else { break };
        if format.bits() == 32 {
            rows.push(*words);
        } else {
            let [a, b, c, d] = words.map(|word| [word & 0xFFFF, word >> 16]);
            rows.push([a[0], a[1], b[0], b[1]]);
            rows.push([c[0], c[1], d[0], d[1]]);
        }
    }
    assert!(next.into_iter().all(|mut left| left.next().is_none()), "beats in stripes");
    let padding = rows.split_off(result::ROWS * bodies);
    assert!(padding.iter().all(|row| *row == [0; 4]), "padding is zeros");
    let vec3 = |[x, y, z, word]: Row| {
        assert_eq!(word, 0, "the fourth word of a result is 0");
        [x, y, z].map(|word| decode(format, word))
    };
    let body = |rows: &[Row]| Body {
        shape: 0,
        position: vec3(rows[result::POSITION]),
        orientation: rows[result::ORIENTATION].map(|word| decode(format, word)),
        linear: vec3(rows[result::LINEAR]),
        angular: vec3(rows[result::ANGULAR]),
    };
    rows.chunks_exact(result::ROWS).map(body).collect()
}
