//! Makes poses small: whole numbers, differences between frames, and a general compression.
//!
//! A position is a whole number of quanta from the lowest corner of all positions. A quaternion
//! is its three smallest components and the index of the largest. The page's `decode.js` undoes each
//! step.
//!
//! In the order of the bytes: for each frame, for each of the six numbers of a body, the difference
//! from the last frame, zigzag coded, first the low bytes of all bodies, then the high bytes; then
//! the index of the largest component of all bodies as a difference, too. A frame that is sent alone
//! has the six numbers themselves, each of all bodies in a row, then the indices.
//!
//! Source: Glenn Fiedler: "Snapshot Compression" (2015), for the three smallest components.

use std::io::Write as _;

use flate2::Compression;
use flate2::write::DeflateEncoder;
use zynq_pgs::Pose;

use crate::error::ViewError;
use crate::recording::{Frame, Recording};

/// Largest whole number of a position.
const POSITION_MOST: f64 = 65_535.0;
/// Largest whole number of a component of a quaternion.
pub(crate) const COMPONENT_MOST: f64 = 4095.0;

/// Poses as whole numbers.
#[derive(Debug)]
pub(crate) struct Quantised {
    /// The deflated numbers.
    pub(crate) bytes: Vec<u8>,
    /// The lowest corner of all positions, m.
    pub(crate) low: [f32; 3],
    /// One quantum of a position, m.
    pub(crate) quantum: f64,
    pub(crate) error: Error,
}

/// The largest error of all poses.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Error {
    /// Distance of a position, m.
    pub distance: f64,
    /// Angle of an orientation, degrees.
    pub angle: f64,
}

/// The whole numbers of a pose.
type Numbers = ([u16; 6], u8);

/// The scale of positions.
#[derive(Debug, Clone, Copy)]
struct Scale {
    low: [f32; 3],
    quantum: f64,
}

impl Scale {
    fn of(frames: &[Frame]) -> Self {
        let mut low = [f32::INFINITY; 3];
        let mut high = [f32::NEG_INFINITY; 3];
        for pose in frames.iter().flat_map(|frame| &frame.poses) {
            for axis in 0..3 {
                let value = pose.position[axis];
                low[axis] = if value < low[axis] { value } else { low[axis] };
                high[axis] = if value > high[axis] { value } else { high[axis] };
            }
        }
        let extent = |axis: usize| f64::from(high[axis]) - f64::from(low[axis]);
        let largest = [0, 1, 2].map(extent).into_iter().fold(0.0, larger);
        // Without bodies, or with one that never moves, any quantum does.
        let quantum = if largest > 0.0 { largest / POSITION_MOST } else { 1.0 };
        Self { low: low.map(|value| if value.is_finite() { value } else { 0.0 }), quantum }
    }

    fn numbers(self, pose: &Pose) -> Numbers {
        let mut numbers = [0; 6];
        for (number, (value, low)) in numbers.iter_mut().zip(pose.position.iter().zip(self.low)) {
            let offset = f64::from(*value) - f64::from(low);
            *number = whole(offset / self.quantum, POSITION_MOST);
        }
        let q = pose.orientation.map(f64::from);
        let mut largest = 0;
        for k in 1..4 {
            largest = if q[k].abs() > q[largest].abs() { k } else { largest };
        }
        let sign = if q[largest] < 0.0 { -1.0 } else { 1.0 };
        for (slot, k) in (0..4).filter(|k| *k != largest).enumerate() {
            // Beside a larger one a component lies within the root of a half.
            let share = 0.5 + sign * q[k] * std::f64::consts::FRAC_1_SQRT_2;
            numbers[3 + slot] = whole(share * COMPONENT_MOST, COMPONENT_MOST);
        }
        (numbers, u8::try_from(largest).unwrap_or(0))
    }

    /// The pose that the numbers stand for.
    fn pose(self, (numbers, largest): Numbers) -> ([f64; 3], [f64; 4]) {
        let position = [0, 1, 2]
            .map(|axis: usize| f64::from(self.low[axis]) + self.quantum * f64::from(numbers[axis]));
        let mut q = [0.0; 4];
        let mut squares = 0.0;
        let others = (0..4).filter(|k| *k != usize::from(largest));
        for (slot, k) in others.enumerate() {
            let share = f64::from(numbers[3 + slot]) / COMPONENT_MOST;
            q[k] = (share - 0.5) * std::f64::consts::SQRT_2;
            squares += q[k] * q[k];
        }
        q[usize::from(largest)] = if squares < 1.0 { (1.0 - squares).sqrt() } else { 0.0 };
        (position, q)
    }

    fn error(self, pose: &Pose, numbers: Numbers) -> Error {
        let (position, q) = self.pose(numbers);
        let mut distance = 0.0;
        for (found, exact) in position.iter().zip(pose.position) {
            let difference = found - f64::from(exact);
            distance += difference * difference;
        }
        let exact = pose.orientation.map(f64::from);
        let sign = if exact[usize::from(numbers.1)] < 0.0 { -1.0 } else { 1.0 };
        // The orientation has the length 1 up to the rounding of f32: its own length is no error.
        let length = exact.iter().fold(0.0, |sum, value| sum + value * value).sqrt();
        let mut chord = 0.0;
        for k in 0..4 {
            let difference = q[k] - sign * exact[k] / length;
            chord += difference * difference;
        }
        let half = 0.5 * chord.sqrt();
        let angle = 4.0 * libm::asin(if half < 1.0 { half } else { 1.0 });
        Error { distance: distance.sqrt(), angle: angle.to_degrees() }
    }
}

/// The larger of two numbers.
fn larger(one: f64, other: f64) -> f64 {
    if other > one { other } else { one }
}

/// The nearest whole number from 0 to `most`.
fn whole(value: f64, most: f64) -> u16 {
    let value = if value > 0.0 { value } else { 0.0 };
    let value = if value < most { value } else { most };
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the value is between 0 and 65,535"
    )]
    let whole = (value + 0.5) as u16;
    whole
}

/// A difference as a number without a sign: small for a small difference of either sign.
fn zigzag(now: u16, before: u16) -> [u8; 2] {
    let difference = now.wrapping_sub(before);
    let negative = if difference >> 15 == 1 { u16::MAX } else { 0 };
    ((difference << 1) ^ negative).to_le_bytes()
}

/// The kind of each body as a byte.
pub(crate) fn kinds(recording: &Recording) -> Result<Vec<u8>, ViewError> {
    let (found, most) = (recording.geometries().len(), usize::from(u8::MAX) + 1);
    let bytes = recording.kinds().iter().map(|kind| u8::try_from(*kind));
    bytes.collect::<Result<_, _>>().map_err(|_| ViewError::TooManyKinds { found, most })
}

/// Quantises and compresses the poses.
pub(crate) fn quantise(recording: &Recording) -> Result<Quantised, ViewError> {
    let frames = recording.frames();
    let scale = Scale::of(frames);
    let bodies = recording.bodies();
    let mut error = Error::default();
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::new(6));
    let mut put = |bytes: &[u8]| encoder.write_all(bytes).map_err(ViewError::Compression);
    let mut before: Vec<Numbers> = vec![([0; 6], 0); bodies];
    for frame in frames {
        let now: Vec<Numbers> = frame.poses.iter().map(|pose| scale.numbers(pose)).collect();
        for (pose, numbers) in frame.poses.iter().zip(&now) {
            let found = scale.error(pose, *numbers);
            error.distance = larger(error.distance, found.distance);
            error.angle = larger(error.angle, found.angle);
        }
        for k in 0..6 {
            let differences =
                || now.iter().zip(&before).map(|(now, was)| zigzag(now.0[k], was.0[k]));
            put(&differences().map(|[low, _]| low).collect::<Vec<_>>())?;
            put(&differences().map(|[_, high]| high).collect::<Vec<_>>())?;
        }
        let pairs = now.iter().zip(&before);
        put(&pairs.map(|(now, was)| now.1.wrapping_sub(was.1)).collect::<Vec<_>>())?;
        before = now;
    }
    Ok(Quantised {
        bytes: encoder.finish().map_err(ViewError::Compression)?,
        low: scale.low,
        quantum: scale.quantum,
        error,
    })
}

/// One frame alone: its lowest corner and quantum, and its bytes.
#[cfg(feature = "live")]
pub(crate) fn alone(frame: &Frame) -> ([f32; 3], f64, Vec<u8>) {
    let scale = Scale::of(std::slice::from_ref(frame));
    let all: Vec<Numbers> = frame.poses.iter().map(|pose| scale.numbers(pose)).collect();
    let numbers =
        (0..6).flat_map(|k| all.iter().flat_map(move |(numbers, _)| numbers[k].to_le_bytes()));
    (scale.low, scale.quantum, numbers.chain(all.iter().map(|(_, largest)| *largest)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::fixture;
    use scene::Geometry;
    use std::io::Read as _;

    /// Undoes the compression and the differences, as the page does.
    fn decode(found: &Quantised, frames: usize, bodies: usize) -> Vec<Vec<Numbers>> {
        let mut raw = Vec::new();
        let mut decoder = flate2::read::DeflateDecoder::new(&found.bytes[..]);
        decoder.read_to_end(&mut raw).expect("deflated");
        assert_eq!(raw.len(), bodies * 13 * frames);
        let mut planes = raw.chunks(bodies);
        let mut state = vec![([0_u16; 6], 0_u8); bodies];
        let mut decoded = Vec::new();
        for _ in 0..frames {
            for k in 0..6 {
                let (low, high) = (planes.next().expect("low"), planes.next().expect("high"));
                for body in 0..bodies {
                    let coded = u16::from_le_bytes([low[body], high[body]]);
                    let negative = if coded & 1 == 1 { u16::MAX } else { 0 };
                    let number = &mut state[body].0[k];
                    *number = number.wrapping_add((coded >> 1) ^ negative);
                }
            }
            let largest = planes.next().expect("largest");
            for body in 0..bodies {
                state[body].1 = state[body].1.wrapping_add(largest[body]);
            }
            decoded.push(state.clone());
        }
        decoded
    }

    #[test]
    fn decoded_poses_are_as_near_as_the_error_says() {
        let recording = fixture(6);
        let found = quantise(&recording).expect("six kinds");
        let scale = Scale { low: found.low, quantum: found.quantum };
        let mut largest = Error::default();
        for (frame, decoded) in recording.frames().iter().zip(decode(&found, 6, 18)) {
            for (pose, numbers) in frame.poses.iter().zip(decoded) {
                let error = scale.error(pose, numbers);
                largest.distance = larger(largest.distance, error.distance);
                largest.angle = larger(largest.angle, error.angle);
            }
        }
        assert_eq!(largest, found.error);
        // Half a quantum along each axis; half a step of each component, and what the largest makes
        // of it.
        assert!(found.error.distance <= 0.87 * found.quantum + 1e-6, "{:?}", found.error);
        assert!(found.error.distance > 0.4 * found.quantum, "{:?}", found.error);
        assert!((0.01..0.08).contains(&found.error.angle), "{:?}", found.error);
    }

    #[test]
    fn a_wrong_number_is_an_error_of_that_size() {
        let scale = Scale { low: [0.0; 3], quantum: 0.001 };
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let pose = Pose { position: [1.0, 2.0, 3.0], orientation: [0.0, half, 0.0, -half] };
        let (mut numbers, largest) = scale.numbers(&pose);
        assert_eq!(numbers[..3], [1000, 2000, 3000]);
        numbers[1] += 50;
        let error = scale.error(&pose, (numbers, largest));
        assert!((error.distance - 0.05).abs() < 1e-6, "{error:?}");
        // A quarter turn about y is 90 degrees from none.
        let none = scale.numbers(&Pose { orientation: [0.0, 0.0, 0.0, 1.0], ..pose });
        assert!((scale.error(&pose, none).angle - 90.0).abs() < 0.1);
    }

    #[cfg(feature = "live")]
    #[test]
    fn a_frame_alone_has_the_numbers_of_its_poses() {
        let recording = fixture(6);
        let frame = &recording.frames()[5];
        let (low, quantum, bytes) = alone(frame);
        assert_eq!(bytes.len(), 13 * 18);
        let scale = Scale { low, quantum };
        for (body, pose) in frame.poses.iter().enumerate() {
            let number = |k: usize| {
                let at = 2 * (18 * k + body);
                u16::from_le_bytes([bytes[at], bytes[at + 1]])
            };
            let numbers = [0, 1, 2, 3, 4, 5].map(number);
            let error = scale.error(pose, (numbers, bytes[12 * 18 + body]));
            assert!(error.distance <= 0.87 * quantum + 1e-6 && error.angle < 0.08, "{error:?}");
        }
    }

    #[test]
    fn more_kinds_than_a_byte_has_are_refused() {
        use zynq_pgs::{Body, Velocity};
        let recording = |kinds: u16| {
            let radii = (0..kinds).map(|kind| f32::from(kind) + 1.0);
            let geometries: Vec<_> =
                radii.map(|radius| Some(Geometry::Sphere { radius })).collect();
            let pose = Pose { position: [0.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] };
            let body = |shape| Body { pose, velocity: Velocity::default(), shape };
            let bodies: Vec<Body> = (0..u32::from(kinds)).map(body).collect();
            let mut recording = Recording::new(&bodies, &geometries);
            recording.add(0, 0.0, &bodies).expect("finite poses");
            recording
        };
        kinds(&recording(256)).expect("as many as a byte has");
        let said = kinds(&recording(257)).expect_err("too many").to_string();
        assert!(said.contains("at most 256 kinds of bodies on a page, found 257"), "{said}");
        crate::npz::bytes(&recording(257)).expect("arrays have whole words");
    }

    #[test]
    fn differences_of_either_sign_are_small_numbers() {
        assert_eq!(zigzag(5, 5), [0, 0]);
        assert_eq!(zigzag(4, 5), [1, 0]);
        assert_eq!(zigzag(6, 5), [2, 0]);
        assert_eq!(zigzag(0, 65_535), [2, 0]);
        assert_eq!(zigzag(300, 0), [0x58, 0x02]);
    }

    #[test]
    fn nothing_and_one_body_at_rest_have_a_scale() {
        assert_eq!(Scale::of(&[]).low.map(f32::to_bits), [0; 3]);
        let pose = Pose { position: [1.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] };
        let scale = Scale::of(&[Frame { step: 0, time: 0.0, poses: vec![pose] }]);
        assert_eq!(scale.numbers(&pose), ([0, 0, 0, 2048, 2048, 2048], 3));
    }
}
