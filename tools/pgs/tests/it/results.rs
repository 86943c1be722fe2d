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
    assert!(ran.stderr.contains("is unchanged"), "{}", ran.stderr);
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

#[test]
fn a_curve_and_a_report_that_cannot_be_written_leave_the_earlier_ones() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [curve, report] = ["live.csv", "fault.json"].map(|name| folder.path().join(name));
    fs::write(&curve, "earlier").expect("written");
    fs::write(&report, "earlier").expect("written");
    let before = content(folder.path());

    let scene = ["order", "--grid", "6x6x6", "--runs", "1", "--curve", text(&curve)];
    let ran = on_a_full_disk(&scene);
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("live.csv cannot be written"), "{}", ran.stderr);
    assert_eq!(content(folder.path()), before);

    let late = ["run", "--grid", "6x6x6", "--steps", "1", "--bandwidth", "0.1", "--deadline", "1"];
    let late = [&late[..], &["--report", text(&report)]].concat();
    let ran = on_a_full_disk(&late);
    assert_eq!(ran.code, Some(4), "{}", ran.stderr);
    assert!(ran.stderr.contains("fault.json cannot be written"), "{}", ran.stderr);
    assert_eq!(content(folder.path()), before);

    assert_eq!(run(scene).code, Some(0));
    assert_eq!(run(late).code, Some(4));
    let after = content(folder.path());
    assert!(after.len() == 2 && after.iter().all(|(_, bytes)| bytes != b"earlier"));
}

#[test]
fn a_report_may_go_to_a_device() {
    let late = ["run", "--grid", "6x6x6", "--steps", "1", "--bandwidth", "0.1", "--deadline", "1"];
    let ran = run(late.iter().chain(&["--report", "/dev/null"]));
    assert_eq!(ran.code, Some(4), "{}", ran.stderr);
    assert!(ran.stderr.contains("for a bug report, see /dev/null"), "{}", ran.stderr);
    assert!(!fs::metadata("/dev/null").expect("there").is_file());
}
