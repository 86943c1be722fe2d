//! Writes a recording as glTF 2.0: a node for each body, with an animation of its translation and
//! rotation.
//!
//! Node 0 is the ground. Node k is the k-th moving body, which is body k where the ground is body
//! 0. All bodies of one kind share a mesh, and all channels share the accessor of the times. The
//!    buffer has
//! the times, the surfaces, and for each body its translations and its rotations in the order of
//! time.
//!
//! Source: Khronos Group, glTF 2.0 Specification, sections 3.6 (buffers), 3.11 (animations), 4.4
//! (GLB).

use scene::GROUND_HALF_EXTENT;
use serde::Serialize;
use serde_json::{Value, json};

use crate::error::{TooLarge, ViewError};
use crate::kinds::{COLOURS, surfaces};
use crate::mesh::Mesh;
use crate::recording::Recording;

/// Numbers of the specification.
const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const ARRAY_BUFFER: u32 = 34_962;
const ELEMENT_ARRAY_BUFFER: u32 = 34_963;
const GLB_MAGIC: u32 = 0x4654_6C67;
const GLB_JSON: u32 = 0x4E4F_534A;
const GLB_BINARY: u32 = 0x004E_4942;

/// Colour of the ground, linear.
const GROUND_COLOUR: [f32; 4] = [0.45, 0.47, 0.5, 1.0];

/// A colour of sRGB, up to 255, as the linear one that materials have (section 3.9.2).
fn linear(colour: [f32; 3]) -> [f32; 4] {
    let [red, green, blue] = colour.map(|value| {
        let share = value / 255.0;
        match share <= 0.040_45 {
            true => share / 12.92,
            false => libm::powf((share + 0.055) / 1.055, 2.4),
        }
    });
    [red, green, blue, 1.0]
}

/// A part of the buffer.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
struct View {
    buffer: u32,
    byte_offset: usize,
    byte_length: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    target: Option<u32>,
}

/// An array in a part of the buffer.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: usize,
    byte_offset: usize,
    component_type: u32,
    count: usize,
    #[serde(rename = "type")]
    kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    min: Option<Vec<f32>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max: Option<Vec<f32>>,
}

#[derive(Debug, Serialize)]
struct Node {
    mesh: usize,
    translation: [f32; 3],
    rotation: [f32; 4],
}

#[derive(Debug, Serialize)]
struct Sampler {
    input: usize,
    output: usize,
}

#[derive(Debug, Serialize)]
struct Channel {
    sampler: usize,
    target: Target,
}

#[derive(Debug, Serialize)]
struct Target {
    node: usize,
    path: &'static str,
}

/// A document under construction, with its buffer.
#[derive(Debug, Default)]
struct Document {
    buffer: Vec<u8>,
    views: Vec<View>,
    accessors: Vec<Accessor>,
    meshes: Vec<Value>,
}

/// The recording as a binary file (GLB).
///
/// # Errors
/// [`ViewError`]: the file has 4 GiB or more, or a geometry has no surface.
pub fn binary(recording: &Recording) -> Result<Vec<u8>, ViewError> {
    let (document, mut buffer) = document(recording)?;
    let mut text = document.json(buffer.len())?.into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    buffer.resize(buffer.len().next_multiple_of(4), 0);
    // A header of three words; in front of each chunk two.
    let length = TooLarge::check("the file", (text.len() + buffer.len() + 28) as u64)?;
    let text_length = TooLarge::check("the JSON", text.len() as u64)?;
    let buffer_length = TooLarge::check("the buffer", buffer.len() as u64)?;
    let mut file = Vec::with_capacity(text.len() + buffer.len() + 28);
    let header = [GLB_MAGIC, 2, length, text_length, GLB_JSON];
    header.iter().for_each(|word| file.extend(word.to_le_bytes()));
    file.extend(text);
    [buffer_length, GLB_BINARY].iter().for_each(|word| file.extend(word.to_le_bytes()));
    file.extend(buffer);
    Ok(file)
}

/// The parts of a document's JSON.
#[derive(Debug)]
struct Parts {
    views: Vec<View>,
    accessors: Vec<Accessor>,
    meshes: Vec<Value>,
    nodes: Vec<Node>,
    samplers: Vec<Sampler>,
    channels: Vec<Channel>,
}

fn document(recording: &Recording) -> Result<(Parts, Vec<u8>), ViewError> {
    let frames = recording.frames();
    let (count, bodies) = (frames.len(), recording.bodies());
    TooLarge::check("the buffer", 28 * count as u64 * bodies as u64)?;
    let mut document = Document::default();
    document.mesh(&ground(), GROUND_MATERIAL);
    for (kind, mesh) in surfaces(recording.geometries())?.iter().enumerate() {
        document.mesh(mesh, 1 + kind % COLOURS.len());
    }
    let mut nodes = vec![Node { mesh: 0, translation: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] }];
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    // An animation needs a channel, and a channel a key.
    if count > 0 && bodies > 0 {
        let times: Vec<[f32; 1]> = frames.iter().map(|frame| [frame.time]).collect();
        let input = document.array("SCALAR", &times, None, Bounds::Given);
        let translations = document
            .animated("VEC3", bodies, count, |body, frame| frames[frame].poses[body].position);
        let rotations = document
            .animated("VEC4", bodies, count, |body, frame| frames[frame].poses[body].orientation);
        for (body, pose) in frames[0].poses.iter().enumerate() {
            let node = nodes.len();
            let tracks = [("translation", translations + body), ("rotation", rotations + body)];
            for (path, output) in tracks {
                channels.push(Channel { sampler: samplers.len(), target: Target { node, path } });
                samplers.push(Sampler { input, output });
            }
            let mesh = 1 + recording.kinds()[body];
            nodes.push(Node { mesh, translation: pose.position, rotation: pose.orientation });
        }
    }
    let Document { buffer, views, accessors, meshes } = document;
    Ok((Parts { views, accessors, meshes, nodes, samplers, channels }, buffer))
}

/// The material of the ground, the first of all.
const GROUND_MATERIAL: usize = 0;

/// The top of the ground.
fn ground() -> Mesh {
    let half = GROUND_HALF_EXTENT;
    Mesh {
        positions: vec![
            [-half, 0.0, -half],
            [-half, 0.0, half],
            [half, 0.0, half],
            [half, 0.0, -half],
        ],
        normals: vec![[0.0, 1.0, 0.0]; 4],
        faces: vec![vec![0, 1, 2, 3]],
    }
}

/// Whether an accessor tells its smallest and largest elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Bounds {
    Given,
    Left,
}

impl Document {
    /// Begins a part of the buffer at a multiple of four bytes.
    fn view(&mut self, target: Option<u32>) -> usize {
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        let byte_offset = self.buffer.len();
        self.views.push(View { buffer: 0, byte_offset, byte_length: 0, target });
        self.views.len() - 1
    }

    /// Ends the last part of the buffer.
    fn end_view(&mut self) {
        let length = self.buffer.len();
        if let Some(view) = self.views.last_mut() {
            view.byte_length = length - view.byte_offset;
        }
    }

    fn accessor(&mut self, accessor: Accessor) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds an array of its own part; returns its accessor.
    fn array<const N: usize>(
        &mut self,
        kind: &'static str,
        elements: &[[f32; N]],
        target: Option<u32>,
        bounds: Bounds,
    ) -> usize {
        let buffer_view = self.view(target);
        elements.iter().flatten().for_each(|value| self.buffer.extend(value.to_le_bytes()));
        self.end_view();
        let extreme = |is_beyond: fn(f32, f32) -> bool| {
            let first = elements.first().filter(|_| bounds == Bounds::Given)?;
            let mut extreme = first.to_vec();
            for element in elements {
                for (most, value) in extreme.iter_mut().zip(element) {
                    *most = if is_beyond(*value, *most) { *value } else { *most };
                }
            }
            Some(extreme)
        };
        let (min, max) =
            (extreme(|value, least| value < least), extreme(|value, most| value > most));
        let count = elements.len();
        let component_type = FLOAT;
        self.accessor(Accessor {
            buffer_view,
            byte_offset: 0,
            component_type,
            count,
            kind,
            min,
            max,
        })
    }

    /// Adds one part for all bodies, with an accessor for each; returns the first one.
    fn animated<const N: usize>(
        &mut self,
        kind: &'static str,
        bodies: usize,
        count: usize,
        value: impl Fn(usize, usize) -> [f32; N],
    ) -> usize {
        let buffer_view = self.view(None);
        let first = self.accessors.len();
        for body in 0..bodies {
            let byte_offset = body * count * N * 4;
            for frame in 0..count {
                value(body, frame).iter().for_each(|v| self.buffer.extend(v.to_le_bytes()));
            }
            let (component_type, min, max) = (FLOAT, None, None);
            self.accessor(Accessor {
                buffer_view,
                byte_offset,
                component_type,
                count,
                kind,
                min,
                max,
            });
        }
        self.end_view();
        first
    }

    fn mesh(&mut self, mesh: &Mesh, material: usize) {
        let position = self.array("VEC3", &mesh.positions, Some(ARRAY_BUFFER), Bounds::Given);
        let normal = self.array("VEC3", &mesh.normals, Some(ARRAY_BUFFER), Bounds::Left);
        let buffer_view = self.view(Some(ELEMENT_ARRAY_BUFFER));
        let corners = mesh.triangles().flatten();
        corners.clone().for_each(|corner| self.buffer.extend(corner.to_le_bytes()));
        self.end_view();
        let indices = self.accessor(Accessor {
            buffer_view,
            byte_offset: 0,
            component_type: UNSIGNED_SHORT,
            count: corners.count(),
            kind: "SCALAR",
            min: None,
            max: None,
        });
        self.meshes.push(json!({ "primitives": [{
            "attributes": { "POSITION": position, "NORMAL": normal },
            "indices": indices,
            "material": material,
        }] }));
    }
}

impl Parts {
    /// The text of the document; `uri` is where the buffer is, unless it follows in the same file.
    fn json(&self, buffer_bytes: usize) -> Result<String, ViewError> {
        #[derive(Serialize)]
        #[serde(rename_all = "camelCase")]
        struct Root<'a> {
            asset: Value,
            scene: usize,
            scenes: Value,
            materials: Vec<Value>,
            meshes: &'a [Value],
            nodes: &'a [Node],
            #[serde(skip_serializing_if = "Vec::is_empty")]
            animations: Vec<Animation<'a>>,
            accessors: &'a [Accessor],
            buffer_views: &'a [View],
            buffers: Value,
        }
        #[derive(Serialize)]
        struct Animation<'a> {
            name: &'static str,
            samplers: &'a [Sampler],
            channels: &'a [Channel],
        }
        let Self { views, accessors, meshes, nodes, samplers, channels } = self;
        let buffer = json!({ "byteLength": buffer_bytes });
        let colours = [GROUND_COLOUR].into_iter().chain(COLOURS.map(linear));
        let material = |colour: [f32; 4]| {
            json!({ "pbrMetallicRoughness": {
                "baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": 0.8,
            } })
        };
        let animation = Animation { name: "run", samplers, channels };
        let root = Root {
            asset: json!({ "version": "2.0", "generator": "zynq-pgs" }),
            scene: 0,
            scenes: json!([{ "nodes": (0..nodes.len()).collect::<Vec<_>>() }]),
            materials: colours.map(material).collect(),
            meshes,
            nodes,
            animations: if channels.is_empty() { vec![] } else { vec![animation] },
            accessors,
            buffer_views: views,
            buffers: json!([buffer]),
        };
        serde_json::to_string(&root).map_err(ViewError::Json)
    }
}

#[cfg(test)]
mod tests;
