//! Gives the loader folders of nearly correct arrays.

use std::io::Cursor;
use std::path::Path;

use step_folder::folder::{
    BODY_ANGULAR, BODY_INVERSE_INERTIA, BODY_INVERSE_MASS, BODY_LINEAR, BODY_ORIENTATION,
    BODY_POSITION, COLLISION_BODIES, COLLISION_COUNT, COLLISION_NORMAL, COLLISION_POINTS, Folder,
    ITERATIONS, PARAMS,
};
use step_folder::npy::{self, Problem};

use crate::input::Input;
use crate::tally::Tally;

/// Size of a board's shape table.
const SHAPES: u32 = 64;

/// Name, type and row of each array.
const FILES: [(&str, Kind, &[usize]); 12] = [
    (PARAMS, Kind::Numbers, &[8]),
    (ITERATIONS, Kind::Counts, &[2]),
    (BODY_POSITION, Kind::Numbers, &[3]),
    (BODY_ORIENTATION, Kind::Numbers, &[4]),
    (BODY_LINEAR, Kind::Numbers, &[3]),
    (BODY_ANGULAR, Kind::Numbers, &[3]),
    (BODY_INVERSE_MASS, Kind::Numbers, &[]),
    (BODY_INVERSE_INERTIA, Kind::Numbers, &[3]),
    (COLLISION_BODIES, Kind::Counts, &[2]),
    (COLLISION_COUNT, Kind::Counts, &[]),
    (COLLISION_NORMAL, Kind::Numbers, &[3]),
    (COLLISION_POINTS, Kind::Numbers, &[4, 4]),
];
/// Files before `FIRST_OF_BODIES` have no rows of bodies; files before the other have no rows of
/// collisions.
const FIRST_OF_BODIES: usize = 2;
const FIRST_OF_COLLISIONS: usize = 8;

/// The type of an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// f32.
    Numbers,
    /// u32.
    Counts,
}

/// A correct file, and its altered bytes.
#[derive(Debug)]
struct Array {
    name: &'static str,
    words: Vec<u32>,
    file: Vec<u8>,
}

/// One execution.
pub(super) fn run(bytes: &[u8]) -> Tally {
    let mut input = Input::new(bytes);
    let (bodies, collisions) = (input.index(6), input.index(5));
    let mut files: Vec<Array> = FILES
        .iter()
        .enumerate()
        .map(|(k, (name, kind, row))| {
            let rows = match k {
                0..FIRST_OF_BODIES => None,
                FIRST_OF_BODIES..FIRST_OF_COLLISIONS => Some(bodies),
                _ => Some(collisions),
            };
            array(&mut input, name, *kind, &[rows.as_slice(), row].concat())
        })
        .collect();
    let damaged = input.one_in(2) || input.one_in(2);
    if damaged {
        for _ in 0..1 + input.below(3) {
            let file = input.index(files.len());
            damage(&mut input, &mut files[file].file);
        }
    }

    let open = |path: &Path| {
        let found = files.iter().find(|array| path.ends_with(array.name));
        let found = found.ok_or(Problem::NotAFile("nothing"))?;
        Ok((Cursor::new(&found.file[..]), found.file.len() as u64))
    };
    let mut tally = Tally::default();
    match Folder::load_with(Path::new("folder"), open) {
        Ok(folder) => {
            let _ = folder.check_shapes(SHAPES);
            if damaged {
                // A loaded step is complete.
                assert!(
                    folder.bodies.iter().all(|b| folder.shapes.get(b.shape as usize).is_some())
                );
            } else {
                assert_eq!((folder.bodies.len(), folder.collisions.len()), (bodies, collisions));
                check(&folder, &files);
            }
            tally.steps += 1;
        }
        Err(error) => {
            assert!(damaged, "{error}: {:?}", error.problem);
            // The error has a text for people.
            assert!(!error.to_string().is_empty() && !error.problem.to_string().is_empty());
            tally.refused += 1;
        }
    }
    tally
}

fn array(input: &mut Input<'_>, name: &'static str, kind: Kind, shape: &[usize]) -> Array {
    let count = shape.iter().product();
    let words: Vec<u32> = (0..count).map(|_| input.telling_word()).collect();
    let mut file = Vec::new();
    let written = match kind {
        Kind::Numbers => npy::encode(&mut file, shape, words.iter().copied().map(f32::from_bits)),
        Kind::Counts => npy::encode(&mut file, shape, words.iter().copied()),
    };
    written.expect("a vector takes all bytes");
    Array { name, words, file }
}

/// A loaded step equals the files bit for bit.
fn check(folder: &Folder, files: &[Array]) {
    let bits = |numbers: &[f32]| numbers.iter().map(|number| number.to_bits()).collect::<Vec<_>>();
    let file = |name: &str| {
        let found = files.iter().find(|array| array.name == name);
        found.map(|array| array.words.clone()).unwrap_or_default()
    };
    let bodies = |of: &dyn Fn(&zynq_pgs::Body) -> Vec<f32>| {
        bits(&folder.bodies.iter().flat_map(of).collect::<Vec<_>>())
    };
    let shape = |body: &zynq_pgs::Body| folder.shapes[body.shape as usize];
    let collisions = || folder.collisions.iter();
    let contacts = collisions().flat_map(|c| c.contacts);
    let points: Vec<f32> = contacts.flat_map(|c| [&c.point[..], &[c.distance]].concat()).collect();
    let normals: Vec<f32> = collisions().flat_map(|c| c.normal).collect();
    let of = &folder.parameters;
    let numbers =
        [of.time_step, of.position_drift, of.position_coefficient, of.friction, of.angular_damping];
    for (name, found) in [
        (BODY_POSITION, bodies(&|body| body.pose.position.to_vec())),
        (BODY_ORIENTATION, bodies(&|body| body.pose.orientation.to_vec())),
        (BODY_LINEAR, bodies(&|body| body.velocity.linear.to_vec())),
        (BODY_ANGULAR, bodies(&|body| body.velocity.angular.to_vec())),
        (BODY_INVERSE_MASS, bodies(&|body| vec![shape(body).inverse_mass])),
        (BODY_INVERSE_INERTIA, bodies(&|body| shape(body).inverse_inertia.to_vec())),
        (COLLISION_BODIES, collisions().flat_map(|c| [c.body_a, c.body_b]).collect()),
        (COLLISION_COUNT, collisions().map(|c| c.count).collect()),
        (COLLISION_NORMAL, bits(&normals)),
        (COLLISION_POINTS, bits(&points)),
        (PARAMS, bits(&[&numbers[..], &of.gravity].concat())),
        (ITERATIONS, vec![of.contact_iterations, of.friction_iterations]),
    ] {
        assert_eq!(found, file(name), "{name}");
    }
}

/// Fragments of a header, in the right and in the wrong place.
const WORDS: [&[u8]; 15] = [
    b"{",
    b"}",
    b"(",
    b")",
    b",",
    b"'descr': '<f4'",
    b"'descr': [('x', '<f4')]",
    b"'shape': (0,)",
    b"\x03\x00",
    b"'<u4'",
    b"True",
    b"'shape': (",
    b"18446744073709551616",
    b"4000000000000000000",
    b"\xC3",
];

fn damage(input: &mut Input<'_>, file: &mut Vec<u8>) {
    // Mostly in the header.
    let end = if input.one_in(4) { file.len() } else { file.len().min(90) };
    if end == 0 {
        return;
    }
    let at = input.index(end);
    match input.below(8) {
        0 => file.truncate(at),
        1 => {
            file.remove(at);
        }
        2 => file.insert(at, input.byte()),
        3 => {
            let word = input.pick(&WORDS);
            let until = file.len().min(at + word.len());
            file.splice(at..until, word.iter().copied());
        }
        4 => {
            let word = input.pick(&WORDS);
            file.splice(at..at, word.iter().copied());
        }
        5 => file.extend_from_slice(input.bytes(9)),
        6 => file[at] ^= 1 << input.below(8),
        _ => file[at] = input.byte(),
    }
}
