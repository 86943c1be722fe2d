//! Asks parry3d for the contacts of a pair.
//!
//! parry computes the contact manifold in the frame of its first shape, which is our body A. Its
//! normal points from A to B, ours from B to A; its distances mean the same.

use parry3d::math::{Pose, Rotation, Vector};
use parry3d::query::details::contact_manifold_cuboid_cuboid;
use parry3d::query::{ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher};
use parry3d::shape::{Ball, Capsule, ConvexPolyhedron, Cuboid, Cylinder, PackedFeatureId, Shape};
use zynq_pgs::{Body, Contact};

use super::MARGIN;
use crate::{Geometry, hull};

/// Squared distance below which two points are the same, m². Clipping can reduce a line to one
/// point, which parry returns twice.
const SAME_POINT: f32 = 1e-8;

/// Allowance for rounding between two equal distances, m.
const SAME_DEPTH: f32 = 1e-4;

/// The contact of two bodies, each in its own frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub(super) on_a: Vector,
    pub(super) on_b: Vector,
    pub(super) distance: f32,
}

impl Place {
    /// The point on B, in its frame.
    pub(super) fn contact(&self) -> Contact {
        Contact { point: self.on_b.to_array(), distance: self.distance }
    }
}

/// parry and its buffers.
#[derive(Debug, Default)]
pub(super) struct Parry {
    manifold: ContactManifold<(), ()>,
    places: Vec<Place>,
    hulls: Hulls,
}

impl Parry {
    /// The contact points of two bodies with these geometries, and the unit vector from A to B
    /// along which they touch, in the frame of A. `None` if parry does not know the pair.
    pub(super) fn ask(
        &mut self,
        b_in_a: &Pose,
        [a, b]: [Geometry; 2],
    ) -> Option<(Vector, &[Place])> {
        self.places.clear();
        let curved = self.parry(b_in_a, a, b)?;
        for point in &self.manifold.points {
            let same = |other: &Place| other.on_b.distance_squared(point.local_p2) < SAME_POINT;
            // In this form a NaN is no contact.
            let near = point.dist <= MARGIN && point.dist.is_finite() && point.local_p2.is_finite();
            if near && !(curved && self.places.iter().any(same)) {
                self.places.push(Place {
                    on_a: point.local_p1,
                    on_b: point.local_p2,
                    distance: point.dist,
                });
            }
        }
        Some((self.manifold.local_n1, &self.places))
    }

    /// Has parry compute the manifold of two geometries; returns whether one has a curved side.
    fn parry(&mut self, b_in_a: &Pose, a: Geometry, b: Geometry) -> Option<bool> {
        // Without points and normals of an earlier pair, parry starts afresh, so that a result
        // depends on the two poses alone.
        let manifold = &mut self.manifold;
        manifold.clear();
        manifold.local_n1 = Vector::ZERO;
        manifold.local_n2 = Vector::ZERO;
        if let (Geometry::Box { half_extents: a }, Geometry::Box { half_extents: b }) = (a, b) {
            let (a, b) = (Cuboid::new(Vector::from_array(a)), Cuboid::new(Vector::from_array(b)));
            contact_manifold_cuboid_cuboid(b_in_a, &a, &b, MARGIN, manifold);
            return Some(false);
        }
        for geometry in [a, b] {
            if let Geometry::Hull { points } = geometry {
                self.hulls.add(points);
            }
        }
        with_shape(a, &self.hulls, |a| {
            with_shape(b, &self.hulls, |b| {
                let parry = DefaultQueryDispatcher;
                parry.contact_manifold_convex_convex(b_in_a, a, b, None, None, MARGIN, manifold)
            })
        })??
        .ok()?;
        // parry adds the nearest point to the points of two features, last and without a feature.
        // For a flat-lying capsule that is any point of a line whose ends are already there.
        let is_spare = match &self.manifold.points[..] {
            [others @ .., nearest] => {
                nearest.fid1 == PackedFeatureId::UNKNOWN
                    && others.iter().any(|other| other.dist <= nearest.dist + SAME_DEPTH)
            }
            [] => false,
        };
        if is_spare {
            self.manifold.points.pop();
        }
        Some(true)
    }
}

/// The polyhedra of the hulls seen so far, by their corners.
#[derive(Default)]
struct Hulls(Vec<(&'static [[f32; 3]], Option<ConvexPolyhedron>)>);

impl Hulls {
    fn find(&self, points: &'static [[f32; 3]]) -> Option<&Option<ConvexPolyhedron>> {
        self.0.iter().find(|(known, _)| std::ptr::eq(*known, points)).map(|(_, hull)| hull)
    }

    fn add(&mut self, points: &'static [[f32; 3]]) {
        if self.find(points).is_none() {
            self.0.push((points, hull::polyhedron(points)));
        }
    }
}

impl std::fmt::Debug for Hulls {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} hulls", self.0.len())
    }
}

/// Passes parry's shape of a geometry to `then`; `None` for a hull without a volume.
fn with_shape<R>(
    geometry: Geometry,
    hulls: &Hulls,
    then: impl FnOnce(&dyn Shape) -> R,
) -> Option<R> {
    Some(match geometry {
        Geometry::Box { half_extents } => then(&Cuboid::new(Vector::from_array(half_extents))),
        Geometry::Sphere { radius } => then(&Ball::new(radius)),
        Geometry::Capsule { half_height, radius } => then(&Capsule::new_y(half_height, radius)),
        Geometry::Cylinder { half_height, radius } => then(&Cylinder::new(half_height, radius)),
        Geometry::Hull { points } => then(hulls.find(points)?.as_ref()?),
    })
}

pub(super) fn pose(body: &Body) -> Pose {
    let Body { pose, .. } = body;
    Pose::from_parts(Vector::from_array(pose.position), Rotation::from_array(pose.orientation))
}
