//! Files of results replace earlier ones together: after a failure the earlier files are unchanged.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::common::{Ran, golden, pgs, run, text};

/// Names and contents of a folder, by name.
fn content(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(folder).expect("the folder").map(|entry| {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        (name, fs::read(&path).expect("a file"))
    });
    let mut found: Vec<_> = entries.collect();
    found.sort();
    found
}

/// Runs the command with a limit of half a KiB on files, as on a full disk.
fn on_a_full_disk(arguments: &[&str]) -> Ran {
    let command = pgs();
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    let words: Vec<_> = words.map(|word| word.to_str().expect("UTF-8")).collect();
    let script = format!("trap '' XFSZ; ulimit -f 1; exec {} \"$@\"", words.join(" "));
    let mut shell = Command::new("sh");
    shell.env("PGS_BOARD", "emulated").env("RUST_LOG", "error");
    shell.arg("-c").arg(script).arg("sh").args(arguments).output().expect("a shell").into()
}

#[test]
fn results_that_cannot_be_written_leave_the_earlier_ones() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    let (small, large) = (golden("two_cubes"), golden("pile5_step60"));
    let ran = run(["solve", text(&small), "--out", text(&out)]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let before = content(&out);
    assert_eq!(before.len(), 4);

    let ran = on_a_full_disk(&["solve", text(&large), "--out", text(&out)]);
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("cannot be written"), "{}", ran.stderr);
    assert!(ran.stderr.contains("has not changed"), "{}", ran.stderr);
    assert_eq!(content(&out), before);

    // Folders made for the results are removed.
    let deep = folder.path().join("a/b");
    let ran = on_a_full_disk(&["solve", text(&large), "--out", text(&deep)]);
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(!folder.path().join("a").exists());

    let ran = run(["solve", text(&large), "--out", text(&out)]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert_ne!(content(&out), before);
    assert_eq!(content(&out).len(), 4);
}

#[test]
fn a_name_that_is_taken_by_a_folder_leaves_the_other_results() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let small = golden("two_cubes");
    fs::write(folder.path().join("out_pos.npy"), "earlier").expect("written");
    fs::create_dir(folder.path().join("out_angvel.npy")).expect("a folder");
    let ran = run(["solve", text(&small), "--out", text(folder.path())]);
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("out_angvel.npy"), "{}", ran.stderr);
    fs::remove_dir(folder.path().join("out_angvel.npy")).expect("it is there, and empty");
    assert_eq!(content(folder.path()), [("out_pos.npy".to_owned(), b"earlier".to_vec())]);
}

/// A step that misses its deadline.
const SLOW: [&str; 9] = [
    "run",
    "--board",
    "emulated:float,bandwidth=0.1",
    "--grid",
    "6x6x6",
    "--steps",
    "1",
    "--deadline",
    "1",
];

#[test]
fn a_report_that_cannot_be_written_leaves_the_earlier_one() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let report = folder.path().join("fault.json");
    fs::write(&report, "earlier").expect("written");
    let before = content(folder.path());

    let late = [&SLOW[..], &["--report", text(&report)]].concat();
    let ran = on_a_full_disk(&late);
    assert_eq!(ran.code, Some(4), "{}", ran.stderr);
    assert!(ran.stderr.contains("fault.json cannot be written"), "{}", ran.stderr);
    assert_eq!(content(folder.path()), before);

    assert_eq!(run(late).code, Some(4));
    let after = content(folder.path());
    assert!(after.len() == 1 && after.iter().all(|(_, bytes)| bytes != b"earlier"));
}

#[test]
fn a_report_may_go_to_a_device() {
    let ran = run(SLOW.iter().chain(&["--report", "/dev/null"]));
    assert_eq!(ran.code, Some(4), "{}", ran.stderr);
    assert!(ran.stderr.contains("for a bug report, see /dev/null"), "{}", ran.stderr);
    assert!(!fs::metadata("/dev/null").expect("there").is_file());
}

/// Every file that a verb writes says what to do, not one option alone.
#[test]
fn every_file_that_finds_no_room_has_a_next_step() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| text(&folder.path().join(name)).to_owned();
    let step = golden("pile5_step60");
    let (run, solve) = (vec!["run", "--grid", "4x4x4", "--steps", "2"], vec!["solve", text(&step)]);
    for (verb, option, name) in [
        (&run, "--poses", "poses.npz"),
        (&run, "--view", "page.html"),
        (&run, "--picture", "last.png"),
        (&run, "--trace", "step.json"),
        (&solve, "--vcd", "step.vcd"),
        (&solve, "--timeline", "step.svg"),
        (&solve, "--out", "results"),
    ] {
        let ran = on_a_full_disk(&[&verb[..], &[option, &at(name)]].concat());
        assert_eq!(ran.code, Some(2), "{option}: {}", ran.stderr);
        assert!(ran.stderr.contains("\n  next: make room, or "), "{option}: {}", ran.stderr);
        assert!(content(folder.path()).is_empty(), "{option}");
    }
}

#[test]
fn an_output_that_is_another_output_or_an_input_is_refused_before_the_run() {
    let folder = crate::common::copy("two_cubes");
    let at = |name: &str| text(&folder.path().join(name)).to_owned();
    let before = content(folder.path());
    let out = at("");
    let input = text(folder.path());
    let (one, dotted) = (at("s.json"), at("./s.json"));
    let (result, array) = (at("out_pos.npy"), at("body_pos.npy"));
    let refused = |arguments: &[&str], names: [&str; 2]| {
        let ran = run(arguments);
        assert_eq!(ran.code, Some(2), "{arguments:?}: {}", ran.stderr);
        for name in names {
            assert!(ran.stderr.contains(name), "{arguments:?}: {}", ran.stderr);
        }
        assert!(ran.stderr.contains("are one file\n  next: name another file"), "{}", ran.stderr);
        assert_eq!((ran.stdout.as_str(), content(folder.path()) == before), ("", true));
    };
    refused(&["solve", input, "--trace", &one, "--vcd", &dotted], ["--trace", "--vcd"]);
    refused(&["solve", input, "--trace", &one, "--report", &one], ["--trace", "--report"]);
    refused(&["solve", input, "--out", &out, "--vcd", &result], ["--out", "--vcd"]);
    refused(&["solve", input, "--timeline", &array], ["--timeline", "the input"]);
    refused(&["solve", input, "--compare", "--out", &out], ["--out", "the input"]);
    let (page, scene) = (at("x.html"), ["run", "--grid", "2x2x2", "--steps", "1"]);
    refused(&[&scene[..], &["--view", &page, "--trace", &page]].concat(), ["--view", "--trace"]);
    let null = "/dev/null";
    let ran = run(["solve", input, "--trace", null, "--vcd", null, "--timeline", null]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    // The folder's expected results are no input unless they are compared.
    assert_eq!(run(["solve", input, "--out", &out]).code, Some(0));
}

/// The text of a program and the bytes of the same file behind stdout would destroy each other.
#[test]
fn an_output_that_is_the_file_of_stdout_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("all.json");
    let file = fs::File::create(&path).expect("made");
    let mut command = pgs();
    command.args(["solve", text(&golden("two_cubes")), "--json", "--trace", text(&path)]);
    let ran = command.stdout(file).output().expect("it runs");
    assert_eq!(ran.status.code(), Some(2));
    let said = String::from_utf8_lossy(&ran.stderr);
    assert!(said.contains("--trace") && said.contains("standard output"), "{said}");
}
