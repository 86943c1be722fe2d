//! Every path that `README.md` and the pages in `docs` name exists, and the map of
//! `docs/architecture.md` leads to the code that it names.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// The folders of the repository whose paths must exist.
const ROOTS: [&str; 7] = ["bitstream-model", "device-tree", "docs", "src", "tests", "tools", ".ci"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn architecture() -> String {
    fs::read_to_string(root().join("docs/architecture.md")).expect("the page")
}

/// The text of a document outside its fenced blocks.
fn prose(text: &str) -> String {
    text.split("\n```").step_by(2).collect()
}

/// The code spans of a text that are paths of the repository.
fn paths(text: &str) -> Vec<String> {
    let text = prose(text);
    let spans = text.split('`').skip(1).step_by(2);
    let is_path = |span: &&str| {
        ROOTS.contains(&span.split('/').next().unwrap_or_default())
            && span.chars().all(|c| c.is_ascii_alphanumeric() || "/._-".contains(c))
    };
    spans.filter(is_path).map(str::to_owned).collect()
}

/// The rows of the table below a heading, without the head of the table.
fn rows<'a>(page: &'a str, heading: &str) -> Vec<&'a str> {
    let (_, section) = page.split_once(&format!("\n{heading}\n")).expect("the heading");
    let table = section.lines().skip_while(|line| !line.starts_with("|---"));
    table.skip(1).take_while(|line| line.starts_with('|')).collect()
}

#[test]
fn every_path_that_a_document_names_exists() {
    let pages = fs::read_dir(root().join("docs")).expect("the folder of the pages");
    let mut documents: Vec<_> = pages.map(|page| page.expect("an entry").path()).collect();
    documents.retain(|path| path.extension().is_some_and(|extension| extension == "md"));
    documents.push(root().join("README.md"));
    let mut missing = BTreeSet::new();
    let mut found = 0;
    for document in documents {
        let text = fs::read_to_string(&document).expect("text");
        for path in paths(&text) {
            match root().join(&path).exists() {
                true => found += 1,
                false => _ = missing.insert(path),
            }
        }
    }
    assert_eq!(missing, BTreeSet::new());
    assert!(found > 80, "{found}");
}

#[test]
fn every_answer_of_the_map_has_a_path_and_its_file_the_function_that_it_names() {
    let page = architecture();
    let questions = rows(&page, "## Where is ...?");
    assert!(questions.len() > 20, "{}", questions.len());
    for row in questions {
        assert!(!paths(row).is_empty(), "{row}");
        for (path, rest) in row.split("`, `").flat_map(|part| part.split_once("` (`")) {
            let path = path.rsplit('`').next().expect("the path");
            let (function, _) = rest.split_once('`').expect("its end");
            let text = fs::read_to_string(root().join(path));
            let text = text.unwrap_or_else(|error| panic!("{path}: {error}"));
            assert!(text.contains(&format!("fn {function}")), "{path} has no {function}");
        }
    }
}

/// The Rust files below a folder.
fn rust_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            rust_files(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
}

#[test]
fn unsafe_code_is_allowed_only_where_the_page_says() {
    let page = architecture();
    let allowed: Vec<_> = rows(&page, "## Where `unsafe` lives")
        .into_iter()
        .flat_map(paths)
        .map(|path| root().join(path))
        .collect();
    let mut files = Vec::new();
    for folder in [
        "src",
        "bitstream-model/src",
        "bitstream-model/interface",
        "bitstream-model/support",
        "tools/capi/src",
    ] {
        rust_files(&root().join(folder), &mut files);
    }
    let mut seen = 0;
    for file in files {
        let text = fs::read_to_string(&file).expect("text");
        if text.contains("allow(unsafe_code") || text.contains("allow(\n    unsafe_code") {
            seen += 1;
            assert!(allowed.iter().any(|path| file.starts_with(path)), "{}", file.display());
        }
    }
    assert!(seen > 3, "{seen}");
}
