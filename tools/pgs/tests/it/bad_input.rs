//! `pgs solve` answers any content of a folder of arrays with one clear error and code 2.

use std::fs;

use crate::common::{DATA, Ran, copy, patch, pgs, write};
use proptest::prelude::*;
use tempfile::TempDir;

/// The files of a comparison of the whole step, and the values in each array of `two_cubes`.
const FILES: [(&str, usize); 16] = [
    ("params.npy", 8),
    ("iterations.npy", 2),
    ("body_pos.npy", 9),
    ("body_quat.npy", 12),
    ("body_linvel.npy", 9),
    ("body_angvel.npy", 9),
    ("body_inv_mass.npy", 3),
    ("body_inv_inertia.npy", 9),
    ("contact_bodies.npy", 4),
    ("contact_npoints.npy", 2),
    ("contact_normal.npy", 6),
    ("contact_points.npy", 32),
    ("out_pos.npy", 9),
    ("out_quat.npy", 12),
    ("out_linvel.npy", 9),
    ("out_angvel.npy", 9),
];

/// Further files of comparisons of single stages.
const STAGE_FILES: [(&str, usize); 2] = [("out_vel_contact.npy", 72), ("out_vel_friction.npy", 72)];

/// A file, the index of a value in its array, and the bytes to write there.
type Patch<'a> = (&'a str, usize, [u8; 4]);

fn solve(folder: &TempDir) -> Ran {
    let output = pgs().arg("solve").arg(folder.path()).arg("--compare").output();
    Ran::from(output.expect("it starts"))
}

/// Asserts that the folder is refused with code 2, and that the message holds all of `said`.
fn assert_refused(folder: &TempDir, said: &[&str]) {
    let ran = solve(folder);
    assert_eq!(ran.code, Some(2), "{said:?}: {} {}", ran.stdout, ran.stderr);
    assert!(ran.stdout.is_empty(), "{}", ran.stdout);
    assert_eq!(ran.stderr.matches("error: ").count(), 1, "{}", ran.stderr);
    for text in said {
        assert!(ran.stderr.contains(text), "no {text:?} in: {}", ran.stderr);
    }
}

fn two_cubes(patches: &[Patch]) -> TempDir {
    let folder = copy("two_cubes");
    for (file, index, bytes) in patches {
        patch(&folder, file, *index, *bytes);
    }
    folder
}

fn f(value: f32) -> [u8; 4] {
    value.to_le_bytes()
}

fn u(value: u32) -> [u8; 4] {
    value.to_le_bytes()
}

#[test]
fn the_folder_as_it_is_is_taken() {
    let ran = solve(&two_cubes(&[]));
    assert_eq!(ran.code, Some(0), "{} {}", ran.stdout, ran.stderr);
}

#[test]
fn each_missing_array_is_named() {
    let results = ["out_pos.npy", "out_quat.npy", "out_linvel.npy", "out_angvel.npy"];
    for name in FILES.iter().map(|(name, _)| *name).chain(results) {
        let folder = copy("two_cubes");
        fs::remove_file(folder.path().join(name)).expect("the array");
        assert_refused(&folder, &[name]);
    }
}

#[test]
fn each_wrong_shape_is_named_with_the_expected_one() {
    for (name, _) in FILES {
        let folder = copy("two_cubes");
        let descr = if fs::read(folder.path().join(name)).expect("the array")[22] == b'u' {
            "<u4"
        } else {
            "<f4"
        };
        write(&folder, name, descr, &[7, 7], &[[0; 4]]);
        assert_refused(&folder, &[name, "expected shape", "found (7, 7)"]);
    }
}

#[test]
fn each_wrong_type_is_named_with_the_expected_one() {
    for (name, _) in FILES {
        let folder = copy("two_cubes");
        let path = folder.path().join(name);
        let mut bytes = fs::read(&path).expect("the array");
        bytes[22] = b'i';
        fs::write(&path, bytes).expect("the array");
        assert_refused(&folder, &[name, "expected elements of type", "found \"<i4\""]);
    }
}

#[test]
fn each_bad_value_is_named_with_file_and_index() {
    let cases: &[(&[Patch], &[&str])] = &[
        (&[("params.npy", 0, f(f32::NAN))], &["params.npy", "time step", "NaN"]),
        (&[("iterations.npy", 0, u(1000))], &["iterations.npy", "1000", "255"]),
        (&[("body_pos.npy", 4, f(f32::NAN))], &["body_pos.npy", "body 1", "position[1]", "NaN"]),
        (&[("body_linvel.npy", 3, f(f32::INFINITY))], &["body_linvel.npy", "body 1", "inf"]),
        (&[("body_angvel.npy", 8, f(f32::NAN))], &["body_angvel.npy", "body 2"]),
        (&[("body_linvel.npy", 0, f(1.0))], &["body_linvel.npy", "body 0 is static"]),
        (
            &[
                ("body_quat.npy", 4, f(0.0)),
                ("body_quat.npy", 5, f(0.0)),
                ("body_quat.npy", 6, f(0.0)),
                ("body_quat.npy", 7, f(0.0)),
            ],
            &["body_quat.npy", "body 1", "orientation"],
        ),
        (&[("body_inv_mass.npy", 2, f(-1.0))], &["body_inv_mass.npy", "body 2", "inverse mass"]),
        (
            &[("body_inv_inertia.npy", 7, f(0.5))],
            &["body_inv_inertia.npy", "body 2", "three equal components"],
        ),
        (&[("contact_bodies.npy", 3, u(99))], &["contact_bodies.npy", "collision 1", "99", "3"]),
        (&[("contact_bodies.npy", 0, u(1))], &["contact_bodies.npy", "collision 0", "both 1"]),
        (&[("contact_npoints.npy", 1, u(5))], &["contact_npoints.npy", "collision 1", "at most 4"]),
        (&[("contact_normal.npy", 1, f(0.9))], &["contact_normal.npy", "collision 0", "0.001"]),
        (&[("contact_normal.npy", 4, f(f32::NAN))], &["contact_normal.npy", "collision 1"]),
        (
            &[("contact_points.npy", 19, f(f32::NAN))],
            &["contact_points.npy", "collision 1", "contact point 0", "distance"],
        ),
        (&[("out_quat.npy", 5, f(f32::NAN))], &["out_quat.npy", "value 5", "NaN"]),
    ];
    for (patches, said) in cases {
        assert_refused(&two_cubes(patches), said);
    }
}

#[test]
fn a_step_that_overflows_is_bad_input_on_the_emulated_board() {
    let folder = two_cubes(&[("body_angvel.npy", 5, f(f32::MAX))]);
    assert_refused(&folder, &["body 1", "not finite", "next: "]);
}

#[test]
fn a_pair_of_two_static_bodies_is_refused() {
    let folder = two_cubes(&[("body_inv_mass.npy", 1, f(0.0))]);
    for k in 3..6 {
        patch(&folder, "body_inv_inertia.npy", k, f(0.0));
        patch(&folder, "body_linvel.npy", k, f(0.0));
        patch(&folder, "body_angvel.npy", k, f(0.0));
    }
    assert_refused(&folder, &["contact_bodies.npy", "collision 0", "both static"]);
}

#[test]
fn the_first_shape_too_many_is_named_by_its_body() {
    let folder = copy("pile5_step60");
    for body in 1..126_u16 {
        patch(&folder, "body_inv_mass.npy", body.into(), f(f32::from(body)));
    }
    // Body 0 has shape 0, body 64 has shape 64: the 65th.
    assert_refused(&folder, &["body_inv_mass.npy", "body 64", "126", "at most 64"]);
}

#[test]
fn more_bodies_than_the_bitstream_takes_are_refused() {
    let folder = copy("one_cube");
    let n = 131_073;
    for (file, width) in [("body_pos.npy", 3), ("body_linvel.npy", 3), ("body_angvel.npy", 3)] {
        write(&folder, file, "<f4", &[n, width], &[f(0.0)]);
        write(&folder, &file.replace("body", "out"), "<f4", &[n, width], &[f(0.0)]);
    }
    for file in ["body_quat.npy", "out_quat.npy"] {
        write(&folder, file, "<f4", &[n, 4], &[f(0.0), f(0.0), f(0.0), f(1.0)]);
    }
    write(&folder, "body_inv_mass.npy", "<f4", &[n], &[f(1.0)]);
    write(&folder, "body_inv_inertia.npy", "<f4", &[n, 3], &[f(1.0)]);
    assert_refused(&folder, &["body_pos.npy", "131073", "131072"]);
}

#[test]
fn more_collisions_than_the_memory_holds_are_refused() {
    let folder = copy("one_cube");
    // (4 MiB - 2 bodies x 24 bytes) / 16 bytes = 262,141 fit.
    let m = 262_142;
    write(&folder, "contact_bodies.npy", "<u4", &[m, 2], &[u(0), u(1)]);
    write(&folder, "contact_npoints.npy", "<u4", &[m], &[u(1)]);
    write(&folder, "contact_normal.npy", "<f4", &[m, 3], &[f(0.0), f(-1.0), f(0.0)]);
    write(&folder, "contact_points.npy", "<f4", &[m, 4, 4], &[f(0.0)]);
    assert_refused(&folder, &["contact_bodies.npy", "262142", "262141"]);
}

/// Options of the possible comparisons.
const STAGES: [&[&str]; 3] = [
    &[],
    &["--contact-iterations", "2", "--friction-iterations", "0", "--no-integrate"],
    &["--contact-iterations", "4", "--friction-iterations", "3", "--no-integrate"],
];

/// A change of a file.
#[derive(Debug, Clone, Copy)]
enum Damage {
    /// Set one byte anywhere, the header included.
    Byte(u8),
    /// Truncate the file.
    Cut,
    /// Set one value.
    Word(u32),
}

fn damage() -> impl Strategy<Value = Damage> {
    prop_oneof![
        any::<u8>().prop_map(Damage::Byte),
        Just(Damage::Cut),
        any::<u32>().prop_map(Damage::Word),
        prop::sample::select(vec![
            f32::MAX,
            f32::MIN,
            f32::MIN_POSITIVE,
            1e-45,
            1e30,
            -1e10,
            -0.0,
            f32::NAN,
            f32::INFINITY,
        ])
        .prop_map(|value| Damage::Word(value.to_bits())),
        (0..300_u32).prop_map(Damage::Word),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn broken_arrays_never_break_the_command(
        damages in prop::collection::vec(
            (any::<prop::sample::Index>(), any::<prop::sample::Index>(), damage()), 1..4
        ),
        stage in 0..STAGES.len(),
    ) {
        let folder = copy("two_cubes");
        for (file, at, damage) in &damages {
            let (name, values) = *file.get(&[&FILES[..], &STAGE_FILES[..]].concat());
            let path = folder.path().join(name);
            let mut bytes = fs::read(&path).expect("the array");
            match *damage {
                Damage::Byte(byte) if !bytes.is_empty() => {
                    let at = at.index(bytes.len());
                    bytes[at] = byte;
                }
                Damage::Cut if !bytes.is_empty() => bytes.truncate(at.index(bytes.len())),
                Damage::Word(word) => {
                    let at = DATA + 4 * at.index(values);
                    if let Some(place) = bytes.get_mut(at..at + 4) {
                        place.copy_from_slice(&u(word));
                    }
                }
                Damage::Byte(_) | Damage::Cut => {}
            }
            fs::write(&path, bytes).expect("the array");
        }
        for (verb, options) in [
            (&["solve", "--compare"][..], STAGES[stage]),
            (&["thesis", "detection"], &["--input"]),
        ] {
            let mut pgs = pgs();
            let output = pgs.args(verb).args(options).arg(folder.path()).output();
            let ran = Ran::from(output.expect("it starts"));
            prop_assert!(
                matches!(ran.code, Some(0..=2)),
                "{verb:?} {damages:?}: {:?} {}", ran.code, ran.stderr
            );
            prop_assert!(!ran.stderr.contains("panicked"), "{}", ran.stderr);
        }
    }
}
