//! Tests that the commands of `README.md` and of the pages in `docs` print the output that stands
//! below them, and that the figures there come from these commands.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{at, pgs, run};
use serde_json::Value;

pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The text of a document, by its path below the root.
pub(crate) fn text(document: &str) -> String {
    fs::read_to_string(root().join(document)).unwrap_or_else(|error| panic!("{document}: {error}"))
}

/// The paths of `README.md` and of every page in `docs`.
pub(crate) fn documents() -> Vec<String> {
    let pages = fs::read_dir(root().join("docs")).expect("the folder of the pages");
    let names = pages.map(|page| page.expect("an entry").file_name().into_string().expect("UTF-8"));
    let mut documents: Vec<_> =
        names.filter(|name| name.ends_with(".md")).map(|name| format!("docs/{name}")).collect();
    documents.push("README.md".to_owned());
    documents.sort();
    documents
}

/// The fenced blocks of a document: what stands behind the opening fence, and the lines inside.
pub(crate) fn blocks(text: &str) -> Vec<(&str, Vec<&str>)> {
    let mut blocks = Vec::new();
    let mut open = None;
    for line in text.lines() {
        match (line.strip_prefix("```"), &mut open) {
            (Some(kind), None) => open = Some((kind, Vec::new())),
            (Some(_), Some(_)) => blocks.extend(open.take()),
            (None, Some((_, lines))) => lines.push(line),
            (None, None) => {}
        }
    }
    assert!(open.is_none(), "a block without an end");
    blocks
}

/// A command of a document, and the lines shown below it.
struct Transcript {
    document: String,
    arguments: Vec<String>,
    shown: Vec<String>,
}

/// Every block of every document that begins with a command and shows its output.
fn transcripts() -> Vec<Transcript> {
    let mut transcripts = Vec::new();
    for document in documents() {
        let text = text(&document);
        for (kind, lines) in blocks(&text) {
            let Some(command) = lines.first().and_then(|line| line.strip_prefix("$ ")) else {
                assert_ne!(kind, "console", "{document}: a block begins with its command");
                continue;
            };
            let arguments = command.strip_prefix("cargo run --release -- ");
            let arguments = arguments.unwrap_or_else(|| panic!("{document}: {command}"));
            let commands = lines.iter().filter(|line| line.starts_with("$ ")).count();
            assert_eq!(commands, 1, "{document}: one command a block: {command}");
            transcripts.push(Transcript {
                document: document.clone(),
                arguments: arguments.split_whitespace().map(str::to_owned).collect(),
                shown: lines[1..].iter().map(|line| (*line).to_owned()).collect(),
            });
        }
    }
    transcripts
}

/// Fails unless the lines were printed, all of them and in this order; `...` stands for the
/// lines that the document leaves out.
fn assert_shown(printed: &str, shown: &[String], what: &str) {
    let mut printed = printed.lines();
    let mut left_out = false;
    for line in shown {
        if line == "..." {
            left_out = true;
        } else if std::mem::take(&mut left_out) {
            assert!(printed.any(|printed| printed == line), "{what}: not printed: {line}");
        } else {
            assert_eq!(printed.next(), Some(line.as_str()), "{what}");
        }
    }
    assert!(left_out || printed.next().is_none(), "{what}: more is printed");
}

#[test]
fn the_commands_of_the_documents_print_what_these_show() {
    let transcripts = transcripts();
    let verbs: Vec<_> = transcripts
        .iter()
        .map(|transcript| (transcript.document.as_str(), transcript.arguments[0].as_str()))
        .collect();
    let expected =
        [("README.md", "solve"), ("docs/faults.md", "solve"), ("docs/to-a-board.md", "check")];
    assert_eq!(verbs, expected, "a new transcript is tested by being named here");
    for Transcript { document, arguments, shown } in transcripts {
        let what = format!("{document}: {}", arguments.join(" "));
        let mut pgs = pgs();
        let ran = pgs.current_dir(root()).env("PGS_BOARD", "auto").args(&arguments).output();
        let ran = ran.expect("the command starts");
        let fails = document == "docs/faults.md";
        let [printed, silent] =
            if fails { [ran.stderr, ran.stdout] } else { [ran.stdout, ran.stderr] };
        assert_shown(&String::from_utf8(printed).expect("text"), &shown, &what);
        assert_eq!(ran.status.code(), Some(if fails { 4 } else { 0 }), "{what}");
        assert!(!fails || silent.is_empty(), "{what}: the error is on stderr alone");
    }
}

#[test]
#[cfg_attr(debug_assertions, ignore = "120 steps of 38,880 cubes, for a release build")]
fn the_main_command_prints_what_the_readme_shows() {
    let ran = pgs().current_dir(root()).env("PGS_BOARD", "auto").output();
    let ran = ran.expect("the command starts");
    assert!(ran.status.success());
    let printed = String::from_utf8(ran.stdout).expect("text");
    let document = text("README.md");
    let blocks = blocks(&document);
    let block = blocks.iter().find(|(_, lines)| {
        lines.first().is_some_and(|line| line.starts_with("board      emulated"))
            && lines.last().is_some_and(|line| line.starts_with("digest"))
    });
    let (_, lines) = block.expect("a block that shows the run");
    let lines: Vec<_> = lines.iter().map(|line| (*line).to_owned()).collect();
    assert_shown(&printed, &lines, "README.md");
}

#[test]
fn every_page_with_an_example_in_rust_is_a_doc_test() {
    let library = text("src/lib.rs");
    for document in documents() {
        let included = library.contains(&format!("include_str!(\"../{document}\")"));
        let examples = blocks(&text(&document)).iter().any(|(kind, _)| *kind == "rust");
        assert_eq!(included, examples, "{document}");
    }
}

/// The part of an address that GitHub makes from a heading.
fn anchor(heading: &str) -> String {
    let heading = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = heading.chars().filter(|c| c.is_alphanumeric() || [' ', '-', '_'].contains(c));
    kept.map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// The pages outside `docs` that belong to the documentation, beside `README.md`.
const BESIDE: [&str; 3] =
    ["device-tree/README.md", "bitstream-model/README.md", "bitstream-model/rtl/README.md"];

#[test]
fn the_documentation_is_twelve_pages_and_short() {
    let pages = documents();
    assert!(pages.len() <= 1 + 12, "{pages:?}");
    let pages = pages.into_iter().chain(BESIDE.map(str::to_owned));
    let words: usize = pages.map(|page| text(&page).split_whitespace().count()).sum();
    assert!(words <= 24_000, "{words} words: shorten a page before another one grows");
}

#[test]
fn every_link_of_the_documents_leads_to_a_file_and_to_a_heading() {
    let mut links = 0;
    for document in documents().into_iter().chain(BESIDE.map(str::to_owned)) {
        let text = text(&document);
        let path = root().join(&document);
        let folder = path.parent().expect("a folder");
        for link in text.split("](").skip(1) {
            let (link, _) = link.split_once(')').expect("the end of a link");
            if link.starts_with("https://") {
                continue;
            }
            links += 1;
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            let target = if file.is_empty() { path.clone() } else { folder.join(file) };
            assert!(target.exists(), "{document}: {link}");
            if !heading.is_empty() {
                let target = fs::read_to_string(&target).expect("a document");
                let mut headings = target.lines().filter(|line| line.starts_with('#'));
                assert!(headings.any(|line| anchor(line) == heading), "{document}: {link}");
            }
        }
    }
    assert!(links > 40, "{links}");
}

/// The rows of the table whose second and third column are `time` and `kind`, with their first
/// three cells.
fn figures(document: &str) -> Vec<Vec<String>> {
    let text = text(document);
    let rows = text.lines().skip_while(|line| !line.contains("| time | kind |")).skip(2);
    let rows = rows.take_while(|line| line.starts_with('|'));
    rows.map(|row| row.split('|').skip(1).take(3).map(|cell| cell.trim().to_owned()).collect())
        .collect()
}

/// The number at the beginning of a cell.
fn number(cell: &str) -> f64 {
    let number = cell.split(' ').next().unwrap_or_default();
    number.parse().unwrap_or_else(|error| panic!("{cell}: {error}"))
}

#[test]
fn the_comparison_of_the_readme_is_that_of_the_page_and_of_its_table() {
    let [readme, page] = ["README.md", "docs/worth.md"].map(figures);
    assert_eq!(readme.len(), 7, "the comparison");
    assert_eq!(readme, page);
    // The table of counts on paper has the same step.
    let page = text("docs/worth.md");
    let row = page.lines().find(|line| line.starts_with("| 36x30x36, 4 + 4, cold |"));
    let row: Vec<_> = row.expect("the step").trim_matches('|').split('|').collect();
    let [board, overlapped, software, search] =
        [4, 5, 6, 8].map(|column| number(row[column].trim()));
    let printed = [0, 2, 3, 5, 6].map(|line| number(&readme[line][1]));
    let expected = [software, board, overlapped, software + search, board + search];
    for (printed, expected) in printed.into_iter().zip(expected) {
        assert!((printed - expected).abs() < 0.051, "{printed} ms, by the table {expected} ms");
    }
}

#[test]
fn the_figures_by_formula_are_what_the_commands_print() {
    let cycles = run(["thesis", "cycles"]).stdout + &run(["thesis", "memory"]).stdout;
    for (page, figures) in [
        ("README.md", &["2,062,697", "2,066,606"][..]),
        ("docs/worth.md", &["2,062,697", "2,066,606", "2,093,336", "9.290", "2.83"]),
        ("docs/thesis.md", &["2,062,697", "2,066,606", "1,551,477", "1,557,317"]),
        ("docs/profiles.md", &["29,384,064", "2,093,336", "1,572,861", "9.290", "6.313"]),
    ] {
        let text = text(page);
        for figure in figures {
            assert!(text.contains(figure) && cycles.contains(figure), "{page}: {figure}\n{cycles}");
        }
    }
    // One number of faults, wherever it is quoted.
    for page in ["README.md", "docs/worth.md"] {
        assert!(text(page).contains("7,892"), "{page}");
    }
}

#[test]
fn the_readme_says_first_what_does_not_exist_yet() {
    let readme = text("README.md");
    let lines = readme.lines().count();
    assert!(lines <= 150, "{lines} lines: a page in docs has room for more");
    let first: Vec<_> = readme.lines().take(10).collect();
    let first = first.join(" ");
    assert!(first.contains("emulated and modelled only, no bitstream published yet"), "{first}");
}

/// The cells of the row of that profile in the table of the bitstreams.
fn bitstream<'a>(page: &'a str, profile: &str) -> Vec<&'a str> {
    let begins = format!("| `{profile}` (");
    let row = page.lines().find(|line| line.starts_with(&begins)).expect("a row");
    row.trim_matches('|').split('|').map(str::trim).collect()
}

/// Percent, as the table has it.
fn percent(share: &Value) -> String {
    format!("{:.1} %", share.as_f64().expect("a share"))
}

#[test]
#[cfg_attr(debug_assertions, ignore = "240 steps of 1,440 cubes, for a release build")]
fn the_table_of_bitstreams_holds_what_its_commands_measure() {
    let page = text("docs/profiles.md");
    let words = page.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        words.contains("`pgs thesis compare float half --grid 12x10x12 --drop 5 --steps 120`"),
        "the command"
    );
    assert!(words.contains("ends with seven times the kinetic energy"), "what it ends with");
    let command = "thesis compare float half --grid 12x10x12 --drop 5 --steps 120 --json";
    let ran = run(command.split(' '));
    assert_eq!(ran.code, Some(0), "{command}: {}", ran.stderr);
    let document: Value = serde_json::from_str(&ran.stdout).expect("one JSON document");
    let [float, half] = ["A", "B"].map(|side| at(&document, 120, side));
    let [velocities, still] = ["linear_within_1_percent", "unmoved_percent"];
    assert_eq!(bitstream(&page, "half")[5..], [percent(&half[velocities]), percent(&half[still])]);
    assert_eq!(bitstream(&page, "float")[5..], [String::new(), percent(&float[still])]);
    let [float, half] = [float, half].map(|row| row["kinetic_kj"].as_f64().expect("kJ"));
    assert!((6.5..7.5).contains(&(half / float)), "{}", half / float);
}
