//! The files that the generator writes are files of their own.

use std::fs::{self, File};
use std::process::Command;

#[test]
fn a_file_of_the_design_that_is_another_or_the_output_is_refused_and_stays() {
    let folder = tempfile::tempdir().expect("a folder");
    let [top, list, output] = ["pgs_top.v", "pgs.f", "output"].map(|name| folder.path().join(name));
    let refused = || {
        let ran = Command::new(env!("CARGO_BIN_EXE_rtlgen"))
            .args(["generate", "--out"])
            .arg(folder.path())
            .stdout(File::options().append(true).create(true).open(&output).expect("a file"))
            .output()
            .expect("it runs");
        let said = String::from_utf8(ran.stderr).expect("text");
        (ran.status.code() == Some(2) && said.contains(" are one file")).then_some(said)
    };
    fs::write(&top, "earlier").expect("written");
    fs::hard_link(&top, &output).expect("a link");
    let said = refused().expect("the output");
    assert!(said.contains("/dev/stdout") && said.contains("pgs_top.v"), "{said}");
    fs::remove_file(&output).expect("removed");
    fs::hard_link(&top, &list).expect("a link");
    let said = refused().expect("another file");
    assert!(said.contains("pgs.f") && said.contains("pgs_top.v"), "{said}");
    assert_eq!(fs::read_to_string(&top).expect("there"), "earlier");
    fs::remove_file(&list).expect("removed");
    assert_eq!(refused(), None);
    assert_ne!(fs::read_to_string(&top).expect("there"), "earlier");
}
