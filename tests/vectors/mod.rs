//! One step from a folder of arrays, as far as a test needs it: `.npy` files of format 1.0.

use std::path::{Path, PathBuf};

use zynq_pgs::{Body, Collision, Contact, Pose, Shape, Velocity};

/// One step of Bullet.
pub(crate) struct Step {
    pub(crate) shapes: Vec<Shape>,
    pub(crate) bodies: Vec<Body>,
    pub(crate) collisions: Vec<Collision>,
}

/// The folder of the thesis' step, if the environment names one; a blank variable names none.
pub(crate) fn full_step() -> Option<PathBuf> {
    let root = std::env::var_os("PGS_VECTORS")?;
    let blank = root.to_str().is_some_and(|root| root.trim().is_empty());
    let folder = Path::new(&root).join("full_step186");
    (!blank && folder.exists()).then_some(folder)
}

/// The words of an array.
fn words(folder: &Path, name: &str) -> Vec<u32> {
    let path = folder.join(name);
    let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    assert!(bytes.starts_with(b"\x93NUMPY\x01\x00"), "{}", path.display());
    let header = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let (words, rest) = bytes[10 + header..].as_chunks::<4>();
    assert!(rest.is_empty(), "{}", path.display());
    words.iter().map(|word| u32::from_le_bytes(*word)).collect()
}

/// The rows of an array of f32.
fn rows<const N: usize>(folder: &Path, name: &str) -> Vec<[f32; N]> {
    let words = words(folder, name);
    let (rows, rest) = words.as_chunks::<N>();
    assert!(rest.is_empty(), "{name}");
    rows.iter().map(|row| row.map(f32::from_bits)).collect()
}

/// Reads the step in `folder`. Its bodies have one static shape and one other.
pub(crate) fn load(folder: &Path) -> Step {
    let masses = rows::<1>(folder, "body_inv_mass.npy");
    let inertia = rows::<3>(folder, "body_inv_inertia.npy");
    let of = |index: usize| Shape {
        inverse_inertia: inertia[index],
        ..Shape::isotropic(masses[index][0], 0.0)
    };
    let moving = masses.iter().position(|mass| mass[0] != 0.0).expect("something moves");
    let shapes = vec![Shape::STATIC, of(moving)];
    let positions = rows::<3>(folder, "body_pos.npy");
    let bodies = (0..positions.len())
        .map(|index| {
            let shape = shapes.iter().position(|shape| *shape == of(index)).expect("two shapes");
            Body {
                pose: Pose { position: positions[index], orientation: [0.0; 4] },
                velocity: Velocity::default(),
                shape: u32::try_from(shape).expect("two shapes"),
            }
        })
        .zip(rows::<4>(folder, "body_quat.npy"))
        .zip(rows::<3>(folder, "body_linvel.npy"))
        .zip(rows::<3>(folder, "body_angvel.npy"))
        .map(|(((mut body, orientation), linear), angular)| {
            body.pose.orientation = orientation;
            body.velocity = Velocity { linear, angular };
            body
        })
        .collect();
    let counts = words(folder, "contact_npoints.npy");
    let pairs = words(folder, "contact_bodies.npy");
    let collisions = counts
        .iter()
        .zip(pairs.as_chunks::<2>().0)
        .zip(rows::<3>(folder, "contact_normal.npy"))
        .zip(rows::<16>(folder, "contact_points.npy"))
        .map(|(((count, pair), normal), points)| Collision {
            body_a: pair[0],
            body_b: pair[1],
            normal,
            count: *count,
            contacts: std::array::from_fn(|at| {
                let point = &points[4 * at..4 * at + 4];
                Contact { point: [point[0], point[1], point[2]], distance: point[3] }
            }),
        })
        .collect();
    Step { shapes, bodies, collisions }
}
