//! `pgs load` as a command: exit codes, messages and JSON, on a system made of files.

use std::fs;
use std::path::{Path, PathBuf};

use std::io::{Read as _, Write as _};
use std::os::unix::fs::FileTypeExt as _;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{Ran, Tied, pgs, run, signal, text};
use crate::files_to_load::{bitstream as stream, overlay};
use crate::filter::refuse;
use serde_json::Value;
use tempfile::TempDir;

/// A system whose logic stays programmed: its files do not react to writes.
fn system() -> TempDir {
    let root = tempfile::tempdir().expect("a directory");
    let manager = root.path().join("sys/class/fpga_manager/fpga0");
    fs::create_dir_all(&manager).expect("made");
    for (file, text) in [
        ("name", "Xilinx ZynqMP FPGA Manager\n"),
        ("state", "operating\n"),
        ("flags", "a longer text than what is written"),
        ("firmware", ""),
    ] {
        fs::write(manager.join(file), text).expect("written");
    }
    let firmware = root.path().join("lib/firmware");
    fs::create_dir_all(&firmware).expect("made");
    fs::write(firmware.join("zynq-pgs.bit.bin"), stream(Some(100))).expect("written");
    root
}

fn bitstream(root: &Path) -> PathBuf {
    root.join("lib/firmware/zynq-pgs.bit.bin")
}

fn load(root: &Path, file: &Path, more: &[&str]) -> Ran {
    let path = |path: &Path| path.to_str().expect("UTF-8").to_owned();
    let mut arguments = vec!["load".to_owned(), path(file), "--system-root".to_owned(), path(root)];
    arguments.extend(more.iter().map(|&argument| argument.to_owned()));
    run(arguments)
}

#[test]
fn a_loaded_bitstream_is_reported_as_text_and_as_json() {
    let root = system();
    let ran = load(root.path(), &bitstream(root.path()), &[]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    for text in ["328 bytes", "fpga0 (Xilinx ZynqMP FPGA Manager)", "-> operating", "none"] {
        assert!(ran.stdout.contains(text), "{text}: {}", ran.stdout);
    }
    let attribute = |name: &str| {
        let manager = root.path().join("sys/class/fpga_manager/fpga0");
        fs::read_to_string(manager.join(name)).expect("an attribute")
    };
    assert_eq!(attribute("flags"), "0");
    assert_eq!(attribute("firmware"), "zynq-pgs.bit.bin");

    let ran = load(root.path(), &bitstream(root.path()), &["--json"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let document = ran.json();
    assert_eq!(document["schema"], 1);
    assert_eq!(document["verb"], "load");
    assert_eq!(document["bitstream"]["firmware"], "zynq-pgs.bit.bin");
    assert_eq!(document["bitstream"]["bytes"], 328);
    assert_eq!(document["bitstream"]["copied"], false);
    assert_eq!(document["manager"]["state"], "operating");
    assert_eq!(document["bitstream"]["chip"], "XCZU9EG (IDCODE 0x04738093)");
    assert_eq!(document["pl_clock"]["bitstream_mhz"], 100);
    assert_eq!(document["pl_clock"]["overlay_hz"], Value::Null);
    assert_eq!(document["overlay"], Value::Null);
    assert_eq!(document["uio_nodes"], Value::Array(Vec::new()));
    assert!(document["load_ms"].is_number());
}

#[test]
fn a_system_that_cannot_load_ends_with_3_and_the_next_step() {
    let root = system();
    let file = bitstream(root.path());
    let tree = root.path().join("zynq-pgs.dtbo");
    fs::write(&tree, overlay(Some(100_000_000), None)).expect("written");
    let ran = load(root.path(), &file, &["--overlay", text(&tree)]);
    assert_eq!(ran.code, Some(3), "{}", ran.stderr);
    assert!(ran.stderr.contains("configfs is not mounted"), "{}", ran.stderr);
    assert!(ran.stderr.contains("next: mount -t configfs"), "{}", ran.stderr);

    fs::remove_file(root.path().join("sys/class/fpga_manager/fpga0/firmware")).expect("removed");
    let ran = load(root.path(), &file, &[]);
    assert_eq!(ran.code, Some(3), "{}", ran.stderr);
    assert!(ran.stderr.contains("mainline"), "{}", ran.stderr);

    fs::remove_dir_all(root.path().join("sys")).expect("removed");
    let ran = load(root.path(), &file, &[]);
    assert_eq!(ran.code, Some(3), "{}", ran.stderr);
    assert!(ran.stderr.starts_with("error: no FPGA manager"), "{}", ran.stderr);
    assert!(ran.stderr.contains("next: "), "{}", ran.stderr);
    assert!(ran.stdout.is_empty());
}

#[test]
fn logic_that_does_not_run_ends_with_4_and_a_wrong_file_with_2() {
    let root = system();
    let state = root.path().join("sys/class/fpga_manager/fpga0/state");
    fs::write(state, "write complete error\n").expect("written");
    let ran = load(root.path(), &bitstream(root.path()), &[]);
    assert_eq!(ran.code, Some(4), "{}", ran.stderr);
    assert!(ran.stderr.contains("\"write complete error\""), "{}", ran.stderr);

    let ran = load(root.path(), &root.path().join("absent.bit.bin"), &[]);
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("absent.bit.bin"), "{}", ran.stderr);
}

#[test]
fn a_check_needs_no_board_and_loads_nothing() {
    let folder = tempfile::tempdir().expect("a directory");
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).expect("written");
        path
    };
    let file = write("zynq-pgs.bit.bin", &stream(Some(100)));
    let tree = write("zynq-pgs.dtbo", &overlay(Some(100_000_000), None));
    let check = |more: &[&str]| {
        let fixed = ["--check", "--overlay", text(&tree)];
        load(folder.path(), &file, &[&fixed, more].concat())
    };
    let ran = check(&[]);
    assert_eq!((ran.code, ran.stderr.as_str()), (Some(0), ""));
    let expected = format!(
        "bitstream  {}, 328 bytes\nchip       XCZU9EG (IDCODE 0x04738093)\npl clock   the \
         bitstream asks for 100 MHz, the overlay sets 100 MHz\nchecked    nothing was loaded\n",
        file.display()
    );
    assert_eq!(ran.stdout, expected);
    assert_eq!(check(&["--json"]).json()["pl_clock"]["overlay_hz"], 100_000_000);

    let ran = check(&["--part", "xck26"]);
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("expected a bitstream for XCK26"), "{}", ran.stderr);
    let ran = check(&["--part", "zcu102"]);
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(ran.stderr.contains("XCZU9EG"), "{}", ran.stderr);

    // Without the word in the bitstream it says so, and goes on.
    fs::write(&file, stream(None)).expect("written");
    let ran = check(&[]);
    assert_eq!((ran.code, ran.stderr.as_str()), (Some(0), ""));
    let line = "pl clock   the bitstream does not say which rate it asks for (no USR_ACCESS), the \
                overlay sets 100 MHz\n";
    assert!(ran.stdout.contains(line), "{}", ran.stdout);
    let left = fs::read_dir(folder.path()).expect("there").count();
    assert_eq!(left, 2, "nothing was made");
}

#[test]
fn a_pipe_is_not_waited_for() {
    let folder = tempfile::tempdir().expect("a directory");
    let pipe = folder.path().join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo runs").success());
    let file = folder.path().join("x.bit.bin");
    fs::write(&file, stream(None)).expect("written");
    for (file, more) in [(&pipe, &[][..]), (&file, &["--overlay", text(&pipe)])] {
        let ran = load(folder.path(), file, more);
        assert_eq!(ran.code, Some(2), "{}", ran.stderr);
        assert!(ran.stderr.contains("found no plain file"), "{}", ran.stderr);
    }
}

/// Waits until something is so.
fn until(what: &str, mut is_so: impl FnMut() -> bool) {
    let end = Instant::now() + Duration::from_secs(60);
    while !is_so() {
        assert!(Instant::now() < end, "{what}");
        std::thread::yield_now();
    }
}

#[test]
fn an_interrupted_load_removes_its_copy_and_tells_the_state_of_the_logic() {
    for sent in ["-INT", "-TERM"] {
        if crate::signals::is_ignored(sent) {
            crate::common::skipped(&format!("{sent} (ignored by this test)"));
            continue;
        }
        let root = system();
        let manager = root.path().join("sys/class/fpga_manager/fpga0");
        // A kernel that loads without end: the pipe has no reader.
        fs::remove_file(manager.join("firmware")).expect("removed");
        let made = Command::new("mkfifo").arg(manager.join("firmware")).status();
        assert!(made.expect("mkfifo runs").success());
        assert!(manager.join("firmware").metadata().expect("made").file_type().is_fifo());
        let file = root.path().join("zynq-pgs.bit.bin");
        fs::write(&file, stream(None)).expect("written");
        let mut pgs = pgs();
        pgs.arg("load").arg(&file).arg("--system-root").arg(root.path());
        let mut child = Tied(pgs.stderr(Stdio::piped()).spawn().expect("it starts"));
        // The flags are written before the firmware's name.
        until("the kernel is asked", || {
            fs::read_to_string(manager.join("flags")).is_ok_and(|flags| flags == "0")
        });
        let firmware = root.path().join("lib/firmware");
        let left = || fs::read_dir(&firmware).expect("there").count();
        assert_eq!(left(), 2, "the installed one and the copy");
        signal(sent, child.0.id());
        assert_eq!(child.0.wait().expect("it ends").code(), Some(130), "{sent}");
        let mut stderr = String::new();
        child.0.stderr.take().expect("a pipe").read_to_string(&mut stderr).expect("text");
        assert_eq!(left(), 1, "{sent}: the copy is gone");
        for text in ["half programmed", "next: touch no register"] {
            assert!(stderr.contains(text), "{sent}: {stderr}");
        }
    }
}

#[test]
fn the_copy_of_a_bitstream_is_kept_where_fsync_is_refused_and_not_where_it_is_lost() {
    use nix::libc;
    use pgs_loading::{Linux, System as _};

    let root = tempfile::tempdir().expect("a folder");
    let linux = Linux { root: root.path().to_owned() };
    let created = |name: &str, errno| {
        pgs_support::in_forked_child(|| {
            if refuse(&[libc::SYS_fsync, libc::SYS_fdatasync], errno).is_err() {
                return 8;
            }
            u8::from(linux.create(&linux.path(name), b"a bitstream").is_ok())
        })
    };
    let refused = [libc::EPERM, libc::ENOSYS, libc::EINVAL];
    let kept = refused.map(|errno| created(&errno.to_string(), errno));
    if kept == [Some(8); 3] {
        let _ = writeln!(std::io::stderr(), "skipped: refused calls (no filter of system calls)");
        return;
    }
    assert_eq!(kept, [Some(1); 3]);
    for errno in refused {
        let copy = fs::read(linux.path(&errno.to_string())).expect("a copy");
        assert_eq!(copy, b"a bitstream");
    }
    assert_eq!(created("lost", libc::ENOSPC), Some(0));
    assert!(!linux.path("lost").exists());
}
