//! Keeps bodies and collisions in one array of numbers each, as an engine with records of its own
//! does: fields anywhere in a record, and words between them that must not change.

use zynq_pgs::scene::CONTACT_POINTS;
use zynq_pgs::{Bodies, Body, Collision, Collisions, Contact, Pose, Velocity};

/// The words between the fields.
const CANARY: f32 = -7.25;
/// Numbers of a body: position, orientation, both velocities. Its shape is in another array.
const BODY: usize = 13;
/// Numbers of a collision: normal and contact points.
const COLLISION: usize = 3 + 4 * CONTACT_POINTS;

/// Records of numbers.
#[derive(Debug, Clone)]
struct Records {
    numbers: Vec<f32>,
    /// Numbers from one record to the next.
    stride: usize,
    /// First number of the fields in a record.
    offset: usize,
}

impl Records {
    /// Makes records with `gap` words more than `fields`; some of them lie before the fields.
    fn new(count: usize, fields: usize, gap: usize) -> Self {
        let stride = fields + gap;
        Self { numbers: vec![CANARY; count * stride], stride, offset: gap / 2 }
    }

    fn fields<const N: usize>(&self, record: usize) -> [f32; N] {
        let first = record * self.stride + self.offset;
        let mut fields = [0.0; N];
        fields.copy_from_slice(&self.numbers[first..first + N]);
        fields
    }

    fn set<const N: usize>(&mut self, record: usize, fields: [f32; N]) {
        let first = record * self.stride + self.offset;
        self.numbers[first..first + N].copy_from_slice(&fields);
    }

    fn check_gaps(&self, fields: usize) {
        for record in self.numbers.chunks(self.stride) {
            let (before, rest) = record.split_at(self.offset);
            let gaps = before.iter().chain(&rest[fields..]);
            assert!(
                gaps.into_iter().all(|gap| gap.to_bits() == CANARY.to_bits()),
                "something was written between the records"
            );
        }
    }
}

/// Bodies in records.
#[derive(Debug, Clone)]
pub(super) struct StridedBodies {
    records: Records,
    shapes: Vec<u32>,
}

impl StridedBodies {
    pub(super) fn new(bodies: &[Body], gap: usize) -> Self {
        let records = Records::new(bodies.len(), BODY, gap);
        let mut strided = Self { records, shapes: bodies.iter().map(|body| body.shape).collect() };
        for (index, body) in bodies.iter().enumerate() {
            strided.commit(index, body.pose, body.velocity);
        }
        strided
    }

    /// The bodies; the words between them must be unchanged.
    pub(super) fn bodies(&self) -> Vec<Body> {
        self.records.check_gaps(BODY);
        (0..self.len()).map(|index| self.body(index)).collect()
    }
}

impl Bodies for StridedBodies {
    fn len(&self) -> usize {
        self.shapes.len()
    }

    fn body(&self, index: usize) -> Body {
        let [px, py, pz, ox, oy, oz, ow, lx, ly, lz, ax, ay, az] = self.records.fields(index);
        Body {
            pose: Pose { position: [px, py, pz], orientation: [ox, oy, oz, ow] },
            velocity: Velocity { linear: [lx, ly, lz], angular: [ax, ay, az] },
            shape: self.shapes[index],
        }
    }

    fn commit(&mut self, index: usize, pose: Pose, velocity: Velocity) {
        let Pose { position: [px, py, pz], orientation: [ox, oy, oz, ow] } = pose;
        let Velocity { linear: [lx, ly, lz], angular: [ax, ay, az] } = velocity;
        self.records.set(index, [px, py, pz, ox, oy, oz, ow, lx, ly, lz, ax, ay, az]);
    }
}

/// Collisions in records.
#[derive(Debug, Clone)]
pub(super) struct StridedCollisions {
    records: Records,
    indices: Vec<[u32; 3]>,
}

impl StridedCollisions {
    pub(super) fn new(collisions: &[Collision], gap: usize) -> Self {
        let mut records = Records::new(collisions.len(), COLLISION, gap);
        for (index, collision) in collisions.iter().enumerate() {
            let mut fields = [0.0; COLLISION];
            let points = collision
                .contacts
                .iter()
                .flat_map(|Contact { point: [x, y, z], distance }| [*x, *y, *z, *distance]);
            for (field, number) in fields.iter_mut().zip(collision.normal.into_iter().chain(points))
            {
                *field = number;
            }
            records.set(index, fields);
        }
        let indices = collisions.iter().map(|c| [c.body_a, c.body_b, c.count]).collect();
        Self { records, indices }
    }
}

impl Collisions for StridedCollisions {
    fn len(&self) -> usize {
        self.indices.len()
    }

    fn collision(&self, index: usize) -> Collision {
        let [body_a, body_b, count] = self.indices[index];
        let fields: [f32; COLLISION] = self.records.fields(index);
        let (normal, points) = fields.split_at(3);
        let mut contacts = [Contact::default(); CONTACT_POINTS];
        for (contact, numbers) in contacts.iter_mut().zip(points.as_chunks().0) {
            let [x, y, z, distance] = *numbers;
            *contact = Contact { point: [x, y, z], distance };
        }
        Collision { body_a, body_b, normal: [normal[0], normal[1], normal[2]], count, contacts }
    }
}

/// Bodies in separate arrays.
#[derive(Debug, Clone, Default)]
pub(super) struct SeparateBodies {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) orientations: Vec<[f32; 4]>,
    pub(super) linear: Vec<[f32; 3]>,
    pub(super) angular: Vec<[f32; 3]>,
    pub(super) shapes: Vec<u32>,
}

impl SeparateBodies {
    pub(super) fn new(bodies: &[Body]) -> Self {
        Self {
            positions: bodies.iter().map(|body| body.pose.position).collect(),
            orientations: bodies.iter().map(|body| body.pose.orientation).collect(),
            linear: bodies.iter().map(|body| body.velocity.linear).collect(),
            angular: bodies.iter().map(|body| body.velocity.angular).collect(),
            shapes: bodies.iter().map(|body| body.shape).collect(),
        }
    }

    pub(super) fn bodies(&self) -> Vec<Body> {
        (0..self.shapes.len())
            .map(|k| Body {
                pose: Pose { position: self.positions[k], orientation: self.orientations[k] },
                velocity: Velocity { linear: self.linear[k], angular: self.angular[k] },
                shape: self.shapes[k],
            })
            .collect()
    }
}

/// Collisions in separate arrays.
#[derive(Debug, Clone)]
pub(super) struct SeparateCollisions {
    pub(super) bodies: Vec<[u32; 2]>,
    pub(super) normals: Vec<[f32; 3]>,
    pub(super) counts: Vec<u32>,
    pub(super) contacts: Vec<[[f32; 4]; CONTACT_POINTS]>,
}

impl SeparateCollisions {
    pub(super) fn new(collisions: &[Collision]) -> Self {
        let contacts = |collision: &Collision| {
            collision.contacts.map(|Contact { point: [x, y, z], distance }| [x, y, z, distance])
        };
        Self {
            bodies: collisions.iter().map(|c| [c.body_a, c.body_b]).collect(),
            normals: collisions.iter().map(|c| c.normal).collect(),
            counts: collisions.iter().map(|c| c.count).collect(),
            contacts: collisions.iter().map(contacts).collect(),
        }
    }
}
