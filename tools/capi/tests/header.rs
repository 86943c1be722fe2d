//! The committed header is the one that the sources make, and a changed layout changes it.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The Rust files below a folder, in the order of their paths.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).expect("the folder of the sources") {
        let path = entry.expect("an entry").path();
        match path.is_dir() {
            true => files.extend(sources(&path)),
            false => files.push(path),
        }
    }
    files.sort();
    files
}

/// The header of the sources in a folder.
fn header(folder: &Path) -> String {
    let config = cbindgen::Config::from_file(root().join("cbindgen.toml")).expect("the settings");
    // cbindgen follows the modules from here.
    let builder = cbindgen::Builder::new().with_config(config).with_src(folder.join("lib.rs"));
    let mut text = Vec::new();
    builder.generate().expect("a header").write(&mut text);
    String::from_utf8(text).expect("UTF-8")
}

fn committed() -> String {
    fs::read_to_string(root().join("include/zynq_pgs.h")).unwrap_or_default()
}

#[test]
fn the_committed_header_is_the_one_of_the_sources() {
    let fresh = header(&root().join("src"));
    if fresh != committed() {
        let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("zynq_pgs.h");
        fs::write(&file, &fresh).expect("a file in the target folder");
        panic!(
            "the sources make another header: cp {} tools/capi/include/zynq_pgs.h, and look at the \
             difference (docs/engines.md, versions)",
            file.display()
        );
    }
}

/// The header of the sources after one text of one of them was replaced.
fn after(file: &str, old: &str, new: &str) -> String {
    let copy = tempfile::tempdir().expect("a folder");
    let from = root().join("src");
    for source in sources(&from) {
        let below = source.strip_prefix(&from).expect("below the folder");
        let text = fs::read_to_string(&source).expect("a source");
        let text = match below == Path::new(file) {
            true => {
                assert_eq!(text.matches(old).count(), 1, "{old:?} in {file}");
                text.replace(old, new)
            }
            false => text,
        };
        let to = copy.path().join(below);
        fs::create_dir_all(to.parent().expect("a folder")).expect("a folder");
        fs::write(to, text).expect("a copy");
    }
    header(copy.path())
}

#[test]
fn a_changed_layout_or_call_makes_another_header() {
    assert_eq!(after("report.rs", "pub stalls: u64", "pub stalls: u64"), committed(), "unchanged");
    // Two fields in the other order, with their comments where they were.
    let reordered = after("report.rs", "pub stalls: u64", "pub halts: u64");
    assert_ne!(reordered, committed(), "a field of another name");
    let report = fs::read_to_string(root().join("src/report.rs")).expect("the source");
    let fields = ["pub stalls: u64,", "pub waits: u64,"].map(|field| report.find(field));
    let [Some(stalls), Some(waits)] = fields else { panic!("the fields of the report") };
    let both = &report[stalls..waits + "pub waits: u64,".len()];
    let swapped = both.replace("stalls", "\0").replace("waits", "stalls").replace('\0', "waits");
    assert_ne!(after("report.rs", both, &swapped), committed(), "fields in another order");
    assert_ne!(after("status.rs", "Input = 3", "Input = 13"), committed(), "another number");
    let wider = after("parameters.rs", "pub retries: u32", "pub retries: u64");
    assert_ne!(wider, committed(), "a wider field");
}
