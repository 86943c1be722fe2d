//! The files of `pgs run`: poses, page and picture.

use std::fs;
use std::path::Path;

use crate::common::{Ran, number, run, text};

const SCENE: [&str; 8] =
    ["run", "--scene", "shapes", "--grid", "3x2x3", "--steps", "7", "--beside-cold=false"];

fn ran(options: &[&str]) -> Ran {
    let ran = run(SCENE.iter().chain(options));
    assert_eq!(ran.code, Some(0), "{options:?}: {}", ran.stderr);
    ran
}

fn length(path: &Path) -> u64 {
    fs::metadata(path).expect("the file").len()
}

#[test]
fn a_run_writes_the_files_that_it_names() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [poses, view, picture] =
        ["poses.npz", "view.html", "picture.png"].map(|name| folder.path().join(name));
    let files = [
        "--poses",
        text(&poses),
        "--view",
        text(&view),
        "--picture",
        text(&picture),
        "--fps",
        "20",
    ];
    let document = ran(&[&files[..], &["--json"]].concat()).json();
    // The start, steps 3 and 6, and the last one.
    let written = &document["files"];
    assert_eq!((&written["poses"]["frames"], &written["view"]["frames"]), (&4.into(), &4.into()));
    for (label, path) in [("poses", &poses), ("view", &view), ("picture", &picture)] {
        assert_eq!(written[label]["path"], text(path));
        assert_eq!(written[label]["bytes"], length(path), "{label}");
    }
    assert!((1e-6..1e-3).contains(&number(&written["view"]["largest_error_m"])));
    assert!((0.01..0.08).contains(&number(&written["view"]["largest_error_degrees"])));
    let page = fs::read_to_string(&view).expect("the page");
    let digest = document["digest"]["value"].as_str().expect("a digest");
    assert!(page.contains(digest), "the page names the run's digest");

    // The same bits again, with another number of threads.
    let bytes = [&poses, &picture].map(|path| fs::read(path).expect("a file"));
    let printed = ran(&[&files[..], &["--threads", "3"]].concat()).stdout;
    assert_eq!([&poses, &picture].map(|path| fs::read(path).expect("a file")), bytes);
    for line in ["poses      ", "view       ", "picture    "] {
        assert!(printed.lines().any(|found| found.starts_with(line)), "{line}: {printed}");
    }
}

#[test]
fn the_name_of_a_file_tells_its_format() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let begins = |option: &str, name: &str| {
        let path = folder.path().join(name);
        ran(&[option, text(&path), "--fps", "10"]);
        String::from_utf8_lossy(&fs::read(&path).expect("a file")[..20]).into_owned()
    };
    assert!(begins("--poses", "a.npz").starts_with("PK\u{3}\u{4}"));
    assert!(begins("--picture", "a.png").starts_with("\u{fffd}PNG"));
    // An animated PNG is one by its chunk `acTL`, whatever it is called.
    for (name, moves) in [("still.png", false), ("moving.apng", true), ("moving.apng.png", true)] {
        begins("--picture", name);
        let bytes = fs::read(folder.path().join(name)).expect("a file");
        assert_eq!(bytes.windows(4).any(|chunk| chunk == b"acTL"), moves, "{name}");
    }
}

#[test]
fn the_moving_picture_of_the_pages_is_what_its_command_draws() {
    const PICTURE: &str = "docs/pile-shapes.apng.png";
    let repository = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let page = fs::read_to_string(repository.join("docs/command-line.md")).expect("the page");
    let mut lines = page.lines().filter_map(|line| line.strip_prefix("cargo run --release -- "));
    let command = lines.find(|line| line.ends_with(PICTURE)).expect("its command");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let drawn = folder.path().join("drawn.apng.png");
    let words = command.split_whitespace();
    let ran = run(words.map(|word| if word == PICTURE { text(&drawn) } else { word }));
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let [drawn, kept] = [drawn, repository.join(PICTURE)].map(|path| fs::read(path).expect("it"));
    assert!(drawn == kept, "{PICTURE} is another picture; draw it anew: {command}");
}

#[test]
fn a_file_that_cannot_be_written_is_refused_before_the_run() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let refused = |option: &str, name: &str, said: &[&str]| {
        let path = folder.path().join(name);
        let ran = run(SCENE.iter().chain(&[option, text(&path)]));
        assert_eq!((ran.code, ran.stdout.as_str()), (Some(2), ""), "{name}");
        for said in said {
            assert!(ran.stderr.contains(said), "{name}: {}", ran.stderr);
        }
        assert!(!path.exists());
    };
    refused("--poses", "poses.csv", &["expected a name that ends in .npz"]);
    refused("--view", "view", &["expected a name that ends in .html"]);
    refused("--picture", "a.jpg", &["expected a name that ends in .png or .apng"]);
    refused(
        "--view",
        "missing/view.html",
        &["expected a folder to write", "next: make the folder"],
    );
}
