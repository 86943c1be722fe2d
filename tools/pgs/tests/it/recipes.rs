//! Every printed recipe that loads a bitstream names an overlay which goes with the only bitstream
//! that can be built, that of `tools/vivado/build.tcl`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{run, skipped, text};
use crate::files_to_load::bitstream;
use bitstream_model::interface::usr_access::PL_CLOCK_MHZ;

/// The loader: `pgs load` by itself, or the kernel by the overlay's `firmware-name`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum By {
    Pgs,
    Overlay,
}

/// A printed command or line of a package.
#[derive(Debug)]
struct Recipe {
    place: String,
    by: By,
    bitstream: String,
    /// The source of the overlay, in `device-tree`.
    overlay: String,
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The pages and help texts that print recipes.
fn texts() -> Vec<(String, String)> {
    let mut pages = vec!["README.md".to_owned(), "device-tree/README.md".to_owned()];
    for page in fs::read_dir(root().join("docs")).expect("the pages") {
        pages.push(format!("docs/{}", page.expect("a page").file_name().display()));
    }
    pages.retain(|page| page.ends_with(".md"));
    pages.sort();
    let read = |page: String| {
        let text = fs::read_to_string(root().join(&page)).expect("a page");
        (page, text)
    };
    let mut texts: Vec<_> = pages.into_iter().map(read).collect();
    for verb in [&["--help"][..], &["load", "--help"]] {
        texts.push((format!("pgs {}", verb.join(" ")), run(verb).stdout));
    }
    texts
}

/// The source of a compiled overlay; a line may say that it was built from another one.
fn source(overlay: &str, line: &str) -> String {
    match line.split_once("built from ") {
        Some((_, source)) => source.trim_end_matches(['`', ' ']).to_owned(),
        None => {
            let name = Path::new(overlay).file_stem().expect("a name");
            format!("{}.dtso", name.display())
        }
    }
}

/// The recipe of a line, if it has one.
fn recipe(place: &str, line: &str) -> Option<Recipe> {
    let words = line.split(|c: char| c.is_whitespace() || c == '`');
    let words: Vec<_> = words.filter(|word| !word.is_empty()).collect();
    let overlay = words.iter().find(|word| word.ends_with(".dtbo"))?;
    let bitstream = words.iter().find(|word| word.ends_with(".bit.bin"));
    let by = match line {
        _ if line.contains("pgs load ") => By::Pgs,
        _ if line.contains("fpgautil ") || line.contains("/lib/firmware/") => By::Overlay,
        // Configfs takes the overlay of a bitstream that is loaded.
        _ if line.contains("overlays/") || line.contains("fdtoverlay ") => By::Pgs,
        _ => return None,
    };
    Some(Recipe {
        place: format!("{place}: {line}"),
        by,
        bitstream: bitstream.unwrap_or(&"zynq-pgs.bit.bin").to_string(),
        overlay: source(overlay, line),
    })
}

fn recipes() -> Vec<Recipe> {
    let texts = texts();
    let lines = texts.iter().flat_map(|(place, text)| text.lines().map(move |line| (place, line)));
    lines.filter_map(|(place, line)| recipe(place, line)).collect()
}

/// Compiles an overlay of `device-tree`, if the compiler is there.
fn compiled(source: &str, folder: &Path) -> Option<PathBuf> {
    let tree = folder.join(source).with_extension("dtbo");
    let mut dtc = Command::new("dtc");
    dtc.args(["-q", "-@", "-I", "dts", "-O", "dtb", "-o"]).arg(&tree).arg(source);
    let built = dtc.current_dir(root().join("device-tree")).output().ok()?;
    // Under user-mode QEMU a missing program starts and ends with 127.
    if built.status.code() == Some(127) {
        return None;
    }
    let said = String::from_utf8_lossy(&built.stderr);
    assert!(built.status.success(), "{source}: {said}");
    Some(tree)
}

#[test]
fn every_printed_recipe_names_an_overlay_for_the_bitstream_that_can_be_built() {
    let recipes = recipes();
    for (place, by) in [
        ("docs/to-a-board.md: ", By::Pgs),
        ("docs/packages.md: ", By::Pgs),
        ("device-tree/README.md: ", By::Pgs),
        ("device-tree/README.md:     fpgautil ", By::Overlay),
        ("device-tree/README.md:     /lib/firmware/xilinx/", By::Overlay),
        ("pgs --help: ", By::Pgs),
        ("pgs load --help: ", By::Pgs),
    ] {
        let found = recipes.iter().any(|recipe| recipe.by == by && recipe.place.starts_with(place));
        assert!(found, "{place}: no recipe is recognised, of {recipes:#?}");
    }
    let folder = tempfile::tempdir().expect("a directory");
    for Recipe { place, by, bitstream: name, overlay } in &recipes {
        let Some(tree) = compiled(overlay, folder.path()) else {
            return skipped("recipes (dtc is not installed)");
        };
        let file = folder.path().join(Path::new(name).file_name().expect("a name"));
        fs::write(&file, bitstream(Some(PL_CLOCK_MHZ))).expect("written");
        let ran = run(["load", "--check", text(&file), "--overlay", text(&tree)]);
        assert_eq!(ran.code, Some(0), "{place}\n{}", ran.stderr);
        let clock = format!("the overlay sets {PL_CLOCK_MHZ} MHz");
        assert!(ran.stdout.contains(&clock), "{place}\n{}", ran.stdout);
        // Only an overlay with a firmware-name objects to a bitstream of another name.
        let other = folder.path().join("other.bit.bin");
        fs::write(&other, bitstream(Some(PL_CLOCK_MHZ))).expect("written");
        let ran = run(["load", "--check", text(&other), "--overlay", text(&tree)]);
        let loads = ran.stderr.contains("firmware-name");
        assert_eq!(loads, *by == By::Overlay, "{place}\n{}", ran.stderr);
    }
}

#[test]
fn a_recipe_with_an_overlay_of_another_clock_is_found() {
    let folder = tempfile::tempdir().expect("a directory");
    let fast = crate::files_to_load::overlay(Some(275_000_000), None);
    let (tree, file) = (folder.path().join("x.dtbo"), folder.path().join("x.bit.bin"));
    fs::write(&tree, fast).expect("written");
    fs::write(&file, bitstream(Some(PL_CLOCK_MHZ))).expect("written");
    let ran = run(["load", "--check", text(&file), "--overlay", text(&tree)]);
    assert_eq!(ran.code, Some(2), "{}", ran.stdout);
    assert!(ran.stderr.contains("275000000 Hz"), "{}", ran.stderr);
    let line = "    /lib/firmware/xilinx/a/a.dtbo          # built from zynq-pgs-region.dtso";
    let found = recipe("page", line).expect("a recipe");
    assert_eq!((found.by, found.overlay.as_str()), (By::Overlay, "zynq-pgs-region.dtso"));
}
