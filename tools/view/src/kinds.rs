//! The kinds of bodies: their different geometries, each with a surface and a colour of its own.

use scene::Geometry;
use zynq_pgs::Body;

use crate::error::ViewError;
use crate::mesh::Mesh;

/// Colours of the kinds in turn: red, green and blue of sRGB, up to 255.
pub(crate) const COLOURS: [[f32; 3]; 6] = [
    [86.0, 140.0, 200.0],
    [226.0, 140.0, 80.0],
    [110.0, 176.0, 128.0],
    [222.0, 190.0, 90.0],
    [160.0, 126.0, 190.0],
    [196.0, 100.0, 104.0],
];

/// The different geometries of bodies, in the order in which the bodies show them.
#[derive(Debug, Clone)]
pub(crate) struct Kinds {
    pub(crate) geometries: Vec<Geometry>,
    /// The kind of each body; none for a body without a geometry.
    pub(crate) of_body: Vec<Option<usize>>,
}

impl Kinds {
    /// The kinds of bodies; `geometries` has one for each shape.
    pub(crate) fn of(bodies: &[Body], geometries: &[Option<Geometry>]) -> Self {
        let mut different: Vec<Geometry> = Vec::new();
        let mut of_shape: Vec<Option<usize>> = vec![None; geometries.len()];
        let mut kind = |body: &Body| {
            let shape = usize::try_from(body.shape).ok()?;
            let geometry = geometries.get(shape)?.as_ref()?;
            let kind = of_shape[shape].unwrap_or_else(|| {
                let known = different.iter().position(|known| known == geometry);
                known.unwrap_or_else(|| {
                    different.push(*geometry);
                    different.len() - 1
                })
            });
            of_shape[shape] = Some(kind);
            Some(kind)
        };
        let of_body = bodies.iter().map(&mut kind).collect();
        Self { geometries: different, of_body }
    }
}

/// The surface of each geometry.
pub(crate) fn surfaces(geometries: &[Geometry]) -> Result<Vec<Mesh>, ViewError> {
    let surface = |(kind, geometry): (usize, &Geometry)| {
        Mesh::of(geometry).ok_or(ViewError::NoSurface { kind, geometry: *geometry })
    };
    geometries.iter().enumerate().map(surface).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use zynq_pgs::{Pose, Velocity};

    #[test]
    fn shapes_of_one_geometry_are_one_kind_in_the_order_of_the_bodies() {
        let ball = Geometry::Sphere { radius: 1.0 };
        let geometries = [None, Some(ball), Some(Geometry::CUBE), Some(ball)];
        let pose = Pose { position: [0.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] };
        let body = |shape| Body { pose, velocity: Velocity::default(), shape };
        let kinds = Kinds::of(&[0, 2, 3, 1, 9].map(body), &geometries);
        assert_eq!(kinds.geometries, [Geometry::CUBE, ball]);
        assert_eq!(kinds.of_body, [None, Some(0), Some(1), Some(1), None]);
    }

    #[test]
    fn a_hull_of_three_points_has_no_surface() {
        const POINTS: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0]];
        let found = surfaces(&[Geometry::CUBE, Geometry::Hull { points: &POINTS }]);
        let said = found.expect_err("no surface").to_string();
        assert!(said.contains("the hull of kind 1 without one"), "{said}");
    }
}
