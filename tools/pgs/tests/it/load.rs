//! `pgs load` as a command: exit codes, messages and JSON, on a system made of files.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{Ran, run};
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
    fs::write(firmware.join("zynq-pgs.bit.bin"), b"\x66\x55\x99\xaa bytes").expect("written");
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
    for text in ["10 bytes, full", "fpga0 (Xilinx ZynqMP FPGA Manager)", "-> operating", "none"] {
        assert!(ran.stdout.contains(text), "{text}: {}", ran.stdout);
    }
    let attribute = |name: &str| {
        let manager = root.path().join("sys/class/fpga_manager/fpga0");
        fs::read_to_string(manager.join(name)).expect("an attribute")
    };
    assert_eq!(attribute("flags"), "0");
    assert_eq!(attribute("firmware"), "zynq-pgs.bit.bin");

    let ran = load(root.path(), &bitstream(root.path()), &["--json", "--partial"]);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let document = ran.json();
    assert_eq!(document["schema"], 1);
    assert_eq!(document["verb"], "load");
    assert_eq!(document["bitstream"]["firmware"], "zynq-pgs.bit.bin");
    assert_eq!(document["bitstream"]["kind"], "partial");
    assert_eq!(document["bitstream"]["bytes"], 10);
    assert_eq!(document["bitstream"]["copied"], false);
    assert_eq!(document["manager"]["state"], "operating");
    assert_eq!(document["overlay"], Value::Null);
    assert_eq!(document["uio_nodes"], Value::Array(Vec::new()));
    assert!(document["load_ms"].is_number());
    assert_eq!(attribute("flags"), "1");
}

#[test]
fn a_system_that_cannot_load_ends_with_3_and_the_next_step() {
    let root = system();
    let file = bitstream(root.path());
    let overlay = root.path().join("zynq-pgs.dtbo");
    fs::write(&overlay, [0xD0, 0x0D, 0xFE, 0xED]).expect("written");
    let overlay = overlay.to_str().expect("UTF-8");
    let ran = load(root.path(), &file, &["--overlay", overlay]);
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
