//! Parses what was written, and holds it to the specification.

use super::*;
use crate::recording::fixture;

fn index(value: &Value) -> usize {
    value
        .as_u64()
        .and_then(|value| usize::try_from(value).ok())
        .unwrap_or_else(|| panic!("{value} is no index"))
}

/// The JSON and the buffer of a GLB file, by section 4.4.
fn parsed(file: &[u8]) -> (Value, Vec<u8>) {
    let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().expect("a word"));
    assert_eq!((&file[..4], word(4)), (&b"glTF"[..], 2));
    assert_eq!(word(8) as usize, file.len());
    let text = word(12) as usize;
    assert_eq!((text % 4, &file[16..20]), (0, &b"JSON"[..]));
    let document = serde_json::from_slice(&file[20..20 + text]).expect("JSON");
    let chunk = 20 + text;
    let length = word(chunk) as usize;
    assert_eq!((length % 4, &file[chunk + 4..chunk + 8]), (0, &b"BIN\0"[..]));
    assert_eq!(chunk + 8 + length, file.len());
    (document, file[chunk + 8..].to_vec())
}

/// A document with its buffer, whose parts can be read through accessors.
struct Read {
    document: Value,
    buffer: Vec<u8>,
}

impl Read {
    fn of(recording: &Recording) -> Self {
        let (document, buffer) = parsed(&binary(recording).expect("small"));
        Self { document, buffer }
    }

    fn list(&self, name: &str) -> &[Value] {
        self.document[name].as_array().unwrap_or_else(|| panic!("no {name}"))
    }

    /// The elements of an accessor, after a check of its place and its bounds.
    fn elements(&self, accessor: usize) -> Vec<Vec<f32>> {
        let accessor = &self.list("accessors")[accessor];
        let width = match accessor["type"].as_str() {
            Some("SCALAR") => 1,
            Some("VEC3") => 3,
            Some("VEC4") => 4,
            other => panic!("{other:?}"),
        };
        let size = match accessor["componentType"].as_u64() {
            Some(5126) => 4,
            Some(5123) => 2,
            other => panic!("{other:?}"),
        };
        let view = &self.list("bufferViews")[index(&accessor["bufferView"])];
        let (offset, count) = (index(&accessor["byteOffset"]), index(&accessor["count"]));
        let (begin, length) = (index(&view["byteOffset"]), index(&view["byteLength"]));
        assert!(count > 0, "section 5.1.3");
        assert_eq!((begin + offset) % size, 0, "section 3.6.2.4");
        assert!(offset + count * width * size <= length, "beyond its part: {accessor}");
        assert!(begin + length <= index(&self.document["buffers"][0]["byteLength"]));
        let bytes = &self.buffer[begin + offset..][..count * width * size];
        let number = |bytes: &[u8]| match *bytes {
            [a, b] => f32::from(u16::from_le_bytes([a, b])),
            [a, b, c, d] => f32::from_le_bytes([a, b, c, d]),
            _ => unreachable!("two or four bytes"),
        };
        let elements: Vec<Vec<f32>> =
            bytes.chunks(width * size).map(|e| e.chunks(size).map(number).collect()).collect();
        for (name, beyond) in [("min", -1.0), ("max", 1.0)] {
            let Some(bounds) = accessor[name].as_array() else { continue };
            for (axis, bound) in bounds.iter().enumerate() {
                let values = elements.iter().map(|element| beyond * element[axis]);
                let extreme = beyond * values.fold(f32::NEG_INFINITY, f32::max);
                assert!((f64::from(extreme) - bound.as_f64().expect("a number")).abs() < 1e-6);
            }
        }
        elements
    }
}

#[test]
fn every_accessor_lies_in_the_buffer_and_the_bounds_are_there_where_they_must_be() {
    let read = Read::of(&fixture(5));
    assert_eq!(read.document["asset"]["version"], "2.0");
    for accessor in 0..read.list("accessors").len() {
        read.elements(accessor);
    }
    let has_bounds = |accessor: &Value| {
        let accessor = &read.list("accessors")[index(accessor)];
        accessor["min"].is_array() && accessor["max"].is_array()
    };
    // Sections 3.7.2.1 and 3.11.
    for mesh in read.list("meshes") {
        assert!(has_bounds(&mesh["primitives"][0]["attributes"]["POSITION"]));
    }
    for sampler in read.document["animations"][0]["samplers"].as_array().expect("samplers") {
        assert!(has_bounds(&sampler["input"]));
    }
}

#[test]
fn triangles_name_corners_that_exist() {
    let read = Read::of(&fixture(1));
    let meshes = read.list("meshes");
    assert_eq!(meshes.len(), 1 + fixture(1).geometries().len());
    for mesh in meshes {
        let part = &mesh["primitives"][0];
        let corners = read.elements(index(&part["attributes"]["POSITION"])).len();
        assert_eq!(corners, read.elements(index(&part["attributes"]["NORMAL"])).len());
        let triangles = read.elements(index(&part["indices"]));
        assert_eq!(triangles.len() % 3, 0);
        let largest = triangles.iter().map(|corner| corner[0]).fold(0.0, f32::max);
        assert!(largest + 1.5 > f32::from(u16::try_from(corners).expect("few")), "unused corners");
        assert!(largest < f32::from(u16::try_from(corners).expect("few")));
        assert!(index(&part["material"]) < read.list("materials").len());
    }
}

#[test]
fn each_body_has_its_poses_at_the_shared_times() {
    let recording = fixture(5);
    let read = Read::of(&recording);
    assert_eq!(read.list("nodes").len(), 19);
    assert_eq!(read.list("scenes")[0]["nodes"].as_array().map(Vec::len), Some(19));
    let animation = &read.document["animations"][0];
    let channels = animation["channels"].as_array().expect("channels");
    assert_eq!(channels.len(), 36);
    let mut inputs = std::collections::BTreeSet::new();
    for (k, channel) in channels.iter().enumerate() {
        let (body, node) = (k / 2, index(&channel["target"]["node"]));
        assert_eq!(node, body + 1);
        let sampler = &animation["samplers"][index(&channel["sampler"])];
        inputs.insert(index(&sampler["input"]));
        let found = read.elements(index(&sampler["output"]));
        let poses = recording.frames().iter().map(|frame| frame.poses[body]);
        let expected: Vec<Vec<f32>> = match channel["target"]["path"].as_str() {
            Some("translation") => poses.map(|pose| pose.position.to_vec()).collect(),
            Some("rotation") => poses.map(|pose| pose.orientation.to_vec()).collect(),
            other => panic!("{other:?}"),
        };
        assert_eq!(found, expected);
        let mesh = index(&read.list("nodes")[node]["mesh"]);
        assert_eq!(mesh, 1 + recording.kinds()[body]);
    }
    assert_eq!(inputs.len(), 1);
    let times = read.elements(*inputs.first().expect("an input")).concat();
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]) && times[0] >= 0.0, "section 3.11");
}

#[test]
fn without_a_frame_there_is_no_animation() {
    let read = Read::of(&fixture(0));
    assert!(read.document["animations"].is_null());
    assert_eq!(read.list("nodes").len(), 1);
}
