//! Runs the device tree compiler and reads compiled trees.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Once;

use tempfile::TempDir;

/// The base tree that overlays are applied to.
const BASE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/device_tree/base.dts");

/// The folder of the shipped sources.
pub(crate) fn sources() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("device-tree")
}

/// Prints a line past the harness, which keeps the output of passing tests.
fn print_past_harness(line: &str) {
    // If stderr is closed, the test is none the worse.
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Whether the tools are installed. Prints a line once if they are not.
pub(crate) fn tools_found() -> bool {
    // With qemu-user, starting a missing program succeeds and ends with 127.
    let answers = |tool: &&str| {
        let asked = Command::new(tool).arg("--version").output();
        asked.is_ok_and(|answer| answer.status.success())
    };
    let found = ["dtc", "fdtoverlay", "fdtget"].iter().all(answers);
    if !found {
        static SAID: Once = Once::new();
        SAID.call_once(|| {
            print_past_harness(
                "skipped: device trees (dtc, fdtoverlay or fdtget is not installed)",
            );
        });
    }
    found
}

fn run(command: &mut Command) -> Output {
    command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"))
}

fn succeed(command: &mut Command) -> Output {
    let output = run(command);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {stderr}");
    if !stderr.trim().is_empty() {
        print_past_harness(&format!("{command:?}: {stderr}"));
    }
    output
}

/// A compiled tree.
#[derive(Debug)]
pub(crate) struct Tree {
    folder: TempDir,
}

impl Tree {
    fn blob(&self) -> PathBuf {
        self.folder.path().join("tree.dtb")
    }

    fn compile(source: &Path, blob: &Path) {
        succeed(
            Command::new("dtc").args(["-@", "-I", "dts", "-O", "dtb", "-o"]).args([blob, source]),
        );
    }

    /// The base tree with a shipped overlay. `change` may replace the text of each source.
    pub(crate) fn with_overlay(name: &str, change: impl Fn(String) -> String) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        for entry in fs::read_dir(sources()).expect("the sources") {
            let path = entry.expect("an entry").path();
            let text = fs::read_to_string(&path).expect("text");
            let copy = folder.path().join(path.file_name().expect("a name"));
            fs::write(copy, change(text)).expect("a copy");
        }
        let (base, overlay) = (folder.path().join("base.dtb"), folder.path().join("overlay.dtbo"));
        Self::compile(Path::new(BASE), &base);
        Self::compile(&folder.path().join(name), &overlay);
        let tree = Self { folder };
        let mut apply = Command::new("fdtoverlay");
        succeed(apply.arg("-i").arg(&base).arg("-o").arg(tree.blob()).arg(&overlay));
        tree
    }

    /// The base tree with a shipped file included at its end, and `after` behind that.
    pub(crate) fn with_included(name: &str, after: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let source = folder.path().join("tree.dts");
        let included = sources().join(name);
        let text = format!("/include/ \"{BASE}\"\n/include/ \"{}\"\n{after}", included.display());
        fs::write(&source, text).expect("a source");
        let tree = Self { folder };
        Self::compile(&source, &tree.blob());
        tree
    }

    fn get(&self, options: &[&str], arguments: &[&str]) -> Option<String> {
        let output = run(Command::new("fdtget").args(options).arg(self.blob()).args(arguments));
        let text = String::from_utf8(output.stdout).expect("text");
        output.status.success().then(|| text.trim().to_owned())
    }

    /// Words of a property of strings.
    pub(crate) fn strings(&self, node: &str, property: &str) -> Option<Vec<String>> {
        let text = self.get(&["-t", "s"], &[node, property])?;
        Some(text.split(' ').map(str::to_owned).collect())
    }

    /// Cells of a property.
    pub(crate) fn cells(&self, node: &str, property: &str) -> Option<Vec<u32>> {
        let text = self.get(&["-t", "x"], &[node, property])?;
        Some(
            text.split_whitespace()
                .map(|word| u32::from_str_radix(word, 16).expect("a cell"))
                .collect(),
        )
    }

    /// Address and length pairs of a property, two cells each.
    pub(crate) fn regions(&self, node: &str) -> Option<Vec<(u64, u64)>> {
        let cells = self.cells(node, "reg")?;
        let wide = |high: u32, low: u32| u64::from(high) << 32 | u64::from(low);
        Some(cells.chunks(4).map(|c| (wide(c[0], c[1]), wide(c[2], c[3]))).collect())
    }

    /// Names of a node's properties.
    pub(crate) fn properties(&self, node: &str) -> Vec<String> {
        let text = self.get(&["-p"], &[node]).unwrap_or_default();
        text.lines().map(str::to_owned).collect()
    }

    /// Names of a node's children.
    pub(crate) fn children(&self, node: &str) -> Vec<String> {
        let text = self.get(&["-l"], &[node]).unwrap_or_default();
        text.lines().map(str::to_owned).collect()
    }
}
