//! Folders of arrays as other programs export them: accepted forms, and refusals that name the true
//! cause.

use std::fs::{self, File};
use std::io::Write as _;
use std::path::Path;
use std::process::Command;

use crate::common::{Ran, copy, golden, patch, pgs, run, write};
use tempfile::TempDir;

const COLLISION_FILES: [&str; 4] =
    ["contact_bodies.npy", "contact_npoints.npy", "contact_normal.npy", "contact_points.npy"];
const BODY_FILES: [&str; 6] = [
    "body_pos.npy",
    "body_quat.npy",
    "body_linvel.npy",
    "body_angvel.npy",
    "body_inv_mass.npy",
    "body_inv_inertia.npy",
];

fn solve(folder: &Path, more: &[&str]) -> Ran {
    let output = pgs().arg("solve").arg(folder).args(more).output();
    output.expect("it starts").into()
}

/// Runs the command with a folder behind the arguments.
fn with_folder(arguments: &[&str], folder: &TempDir) -> Ran {
    pgs().args(arguments).arg(folder.path()).output().expect("it starts").into()
}

/// Asserts code 2 and one error that holds all of `said`.
fn assert_said(ran: &Ran, said: &[&str]) {
    assert_eq!(ran.code, Some(2), "{said:?}: {} {}", ran.stdout, ran.stderr);
    assert_eq!(ran.stderr.matches("error: ").count(), 1, "{}", ran.stderr);
    for text in said {
        assert!(ran.stderr.contains(text), "no {text:?} in: {}", ran.stderr);
    }
}

/// Writes a file whose header names this type and shape, with some data behind it.
fn write_as(path: &Path, descr: &str, order: &str, shape: &str, data: &[u8]) {
    let header = format!("{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}\n");
    let mut file = File::create(path).expect("the array");
    let length = u16::try_from(header.len()).expect("a short header").to_le_bytes();
    let parts = [&b"\x93NUMPY\x01\x00"[..], &length, header.as_bytes(), data];
    file.write_all(&parts.concat()).expect("written");
}

#[test]
fn contact_arrays_of_nothing_are_no_collisions_whatever_their_type() {
    let expected = {
        let folder = copy("two_cubes");
        for (file, width) in COLLISION_FILES.iter().zip([&[0, 2][..], &[0], &[0, 3], &[0, 4, 4]]) {
            let descr = if file.contains("no") { "<f4" } else { "<u4" };
            let descr = if file.contains("npoints") { "<u4" } else { descr };
            write(&folder, file, descr, width, &[]);
        }
        solve(folder.path(), &["--digest"])
    };
    assert_eq!(expected.code, Some(0), "{}", expected.stderr);
    for descr in ["<f8", "<u4", "<i8", "|b1"] {
        let folder = copy("two_cubes");
        for file in COLLISION_FILES {
            write(&folder, file, descr, &[0], &[]);
        }
        let ran = solve(folder.path(), &["--digest"]);
        assert_eq!((ran.code, &ran.stdout), (Some(0), &expected.stdout), "{descr}: {}", ran.stderr);
        for verb in [
            &["thesis", "formats", "--input"][..],
            &["thesis", "order", "--input"],
            &["thesis", "compare", "float", "half", "--input"],
        ] {
            let ran = with_folder(verb, &folder);
            assert_eq!(ran.code, Some(0), "{verb:?}: {}", ran.stderr);
        }
    }
    assert!(run(["solve", "--help"]).stdout.contains("shape (0,)"), "the help says so");
}

#[test]
fn some_empty_contact_arrays_beside_others_are_refused() {
    let folder = copy("two_cubes");
    write(&folder, "contact_normal.npy", "<f8", &[0], &[]);
    let said = ["contact_normal.npy", "expected shape (2, 3), found (0,)"];
    assert_said(&solve(folder.path(), &[]), &said);
}

#[test]
fn a_step_without_bodies_is_a_step_unless_a_collision_names_one() {
    let said = ["contact_bodies.npy", "collision 0: body A is", "there are 0 bodies"];
    for collisions in [true, false] {
        for (shape, descr) in [("(0, 3)", "'<f4'"), ("(0,)", "'<f8'")] {
            let folder = copy("two_cubes");
            for file in BODY_FILES {
                let shape = match file {
                    "body_quat.npy" if shape == "(0, 3)" => "(0, 4)",
                    "body_inv_mass.npy" => "(0,)",
                    _ => shape,
                };
                write_as(&folder.path().join(file), descr, "False", shape, &[]);
            }
            if !collisions {
                for file in COLLISION_FILES {
                    write(&folder, file, "<u4", &[0], &[]);
                }
            }
            if collisions {
                assert_said(&with_folder(&["solve"], &folder), &said);
                // The empty ones need no bodies.
                for collision in 0..2 {
                    patch(&folder, "contact_npoints.npy", collision, [0; 4]);
                }
            }
            for verb in [
                &["solve"][..],
                &["solve", "--json"],
                &["thesis", "formats", "--input"],
                &["thesis", "order", "--input"],
                &["thesis", "compare", "float", "half", "--input"],
            ] {
                let ran = with_folder(verb, &folder);
                assert_eq!(ran.code, Some(0), "{verb:?}: {}", ran.stderr);
            }
        }
    }
}

#[test]
fn a_step_whose_bodies_are_all_static_is_taken() {
    let folder = copy("two_cubes");
    for (file, width) in BODY_FILES.iter().zip([3, 4, 3, 3, 1, 3]).skip(2) {
        let shape = if width == 1 { vec![3] } else { vec![3, width] };
        write(&folder, file, "<f4", &shape, &[[0; 4]]);
    }
    assert_said(&solve(folder.path(), &[]), &["collision 0", "both static"]);
    for file in COLLISION_FILES {
        write(&folder, file, "<f8", &[0], &[]);
    }
    let ran = solve(folder.path(), &[]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
}

#[test]
fn a_type_that_does_not_fit_says_what_to_save_instead() {
    let twelve = &[0; 36][..];
    let structured = "[('x', '<f4'), ('y', '<f4'), ('z', '<f4')]";
    for (descr, order, shape, said) in [
        ("'<f8'", "False", "(3, 3)", "save a.astype(\"<f4\")"),
        ("'>f4'", "False", "(3, 3)", "big-endian; save a.astype(\"<f4\")"),
        ("'|b1'", "False", "(3, 3)", "booleans"),
        ("'|O'", "False", "(3, 3)", "pickled"),
        ("'<U4'", "False", "(3, 3)", "text"),
        (structured, "False", "(3,)", "structured dtype"),
        ("'<f4'", "True", "(3, 3)", "Fortran order: save numpy.ascontiguousarray(a)"),
    ] {
        let folder = copy("two_cubes");
        write_as(&folder.path().join("body_pos.npy"), descr, order, shape, twelve);
        let ran = solve(folder.path(), &[]);
        assert_said(&ran, &["body_pos.npy", said]);
        assert!(!ran.stderr.contains("write it with numpy.save"), "{}", ran.stderr);
    }
}

#[test]
fn what_is_no_array_is_called_what_it_is() {
    for (content, said) in [
        (&b""[..], "found an empty file"),
        (b"PK\x03\x04 and so on", "found an archive, as .npz is"),
        (b"0.0,1.0,2.0\n", "found text"),
        (b"\x80\x04\x95 a pickle", "found a Python pickle"),
        (&[0; 36], "as numpy's tofile writes them"),
        (b"\x93NUMPY\x09\x00\x76\x00", "found version 9.0 of the .npy format"),
        (b"\x93NUMPY\x02\x00\xFF\xFF\xFF\xFF", "at most 65535 bytes"),
        (b"\x93NUMPY\x01\x00\xFF\xFF{'descr'", "ends within its header"),
    ] {
        let folder = copy("two_cubes");
        fs::write(folder.path().join("body_pos.npy"), content).expect("written");
        assert_said(&solve(folder.path(), &[]), &["body_pos.npy", said]);
    }
}

#[test]
fn a_file_that_is_too_long_is_not_called_cut_off() {
    let folder = copy("two_cubes");
    let path = folder.path().join("params.npy");
    let once = fs::read(&path).expect("the array");
    fs::write(&path, [&once[..], &once].concat()).expect("written");
    let ran = solve(folder.path(), &[]);
    assert_said(&ran, &["params.npy", "found 192, 160 more", "one array alone"]);
    assert!(!ran.stderr.contains("cut off"), "{}", ran.stderr);
    fs::write(&path, &once[..once.len() - 4]).expect("written");
    assert_said(&solve(folder.path(), &[]), &["params.npy", "4 fewer", "cut off?"]);
}

#[test]
fn what_is_no_file_or_no_folder_is_called_what_it_is() {
    let folder = copy("two_cubes");
    let array = folder.path().join("body_pos.npy");
    fs::remove_file(&array).expect("the array");
    fs::create_dir(&array).expect("a folder");
    assert_said(&solve(folder.path(), &[]), &["body_pos.npy", "regular file, found a folder"]);
    fs::remove_dir(&array).expect("the folder");
    std::os::unix::fs::symlink("/dev/zero", &array).expect("a link");
    assert_said(&solve(folder.path(), &[]), &["body_pos.npy", "regular file, found a device"]);
    fs::remove_file(&array).expect("the link");
    if Command::new("mkfifo").arg(&array).status().is_ok_and(|made| made.success()) {
        assert_said(&solve(folder.path(), &[]), &["body_pos.npy", "file, found a named pipe"]);
    }
    let file = folder.path().join("params.npy");
    assert_said(&solve(&file, &[]), &["params.npy", "a folder of .npy arrays, found a file"]);
    let missing = folder.path().join("missing");
    assert_said(&solve(&missing, &[]), &["missing", "a folder of .npy arrays, found nothing"]);
}

/// Sparse files of gigabytes are refused in an address space that is too small for them.
#[test]
fn no_memory_is_taken_for_what_a_file_claims() {
    let claim = |folder: &TempDir, file: &str, shape: &str, bytes: u64| {
        let path = folder.path().join(file);
        write_as(&path, "'<f4'", "False", shape, &[]);
        let array = fs::OpenOptions::new().write(true).open(&path).expect("the array");
        let begin = array.metadata().expect("its length").len();
        array.set_len(begin + bytes).expect("a hole");
    };
    let bounded = |folder: &TempDir, more: &str| -> Ran {
        let command = pgs();
        let words = std::iter::once(command.get_program()).chain(command.get_args());
        let words: Vec<_> = words.map(|word| word.to_str().expect("UTF-8")).collect();
        let script = format!("ulimit -v 4000000; exec {} solve \"$0\" {more}", words.join(" "));
        let mut shell = Command::new("sh");
        shell.env("PGS_BOARD", "emulated").env("RUST_LOG", "error");
        shell.arg("-c").arg(script).arg(folder.path()).output().expect("a shell").into()
    };
    let folder = copy("two_cubes");
    claim(&folder, "body_pos.npy", "(2000000000, 3)", 24_000_000_000);
    assert_said(&bounded(&folder, ""), &["body_pos.npy", "more rows than any board takes"]);

    let folder = copy("two_cubes");
    claim(&folder, "contact_points.npy", "(1000000000, 4, 4)", 64_000_000_000);
    assert_said(&bounded(&folder, ""), &["contact_points.npy", "expected shape (2, 4, 4)"]);

    // A pass that `iterations.npy` claims.
    let stage = "--compare --no-integrate --contact-iterations 2 --friction-iterations 0";
    let folder = copy("two_cubes");
    patch(&folder, "iterations.npy", 0, 4_000_000_000_u32.to_le_bytes());
    claim(&folder, "out_vel_contact.npy", "(4000000000, 3, 6)", 288_000_000_000);
    assert_said(&bounded(&folder, stage), &["out_vel_contact.npy", "more rows"]);
    let folder = copy("two_cubes");
    patch(&folder, "iterations.npy", 0, 1_000_000_u32.to_le_bytes());
    claim(&folder, "out_vel_contact.npy", "(1000000, 3, 6)", 72_000_000);
    let ran = bounded(&folder, stage);
    assert_eq!(ran.code, Some(1), "the pass is read, and differs: {}", ran.stderr);
}

#[test]
fn a_contact_without_a_direction_is_not_to_be_normalised() {
    let folder = copy("two_cubes");
    for component in 3..6 {
        patch(&folder, "contact_normal.npy", component, [0; 4]);
    }
    let ran = solve(folder.path(), &[]);
    assert_said(
        &ran,
        &["contact_normal.npy", "collision 1", "no direction", "leave the collision"],
    );
    assert!(!ran.stderr.contains("normalise"), "{}", ran.stderr);
}

#[test]
fn the_golden_folders_are_taken_in_every_version_of_the_format() {
    let expected = solve(&golden("two_cubes"), &["--digest"]).stdout;
    for version in [2, 3] {
        let folder = copy("two_cubes");
        for file in BODY_FILES.iter().chain(&COLLISION_FILES) {
            let path = folder.path().join(file);
            let array = fs::read(&path).expect("the array");
            let later = [&array[..6], &[version, 0], &array[8..10], &[0, 0], &array[10..]];
            fs::write(&path, later.concat()).expect("written");
        }
        let ran = solve(folder.path(), &["--digest"]);
        assert_eq!((ran.code, ran.stdout), (Some(0), expected.clone()), "{}", ran.stderr);
    }
}
