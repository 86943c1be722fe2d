//! Compiles an example with the system's compiler, and runs it.

use std::env::consts::ARCH;
use std::ffi::OsString;
use std::io::Write;
use std::path::Path;
use std::process::Command;

/// An example, and the compiler of its language.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Example {
    pub(crate) language: &'static str,
    /// Below the folder of the examples.
    pub(crate) source: &'static str,
    pub(crate) standard: &'static str,
    /// The variable that names the compiler, and its name without the variable.
    pub(crate) compiler: (&'static str, &'static str),
    /// The argument that takes the language's own library, if any, into the program.
    pub(crate) own_library: Option<&'static str>,
}

impl Example {
    fn compiler(self) -> String {
        let (variable, usual) = self.compiler;
        std::env::var(variable).unwrap_or_else(|_| usual.to_owned())
    }

    /// Whether the compiler makes programs for the machine of the tests; says aloud if not.
    pub(crate) fn can_compile(self) -> bool {
        let compiler = self.compiler();
        let machine = Command::new(&compiler).arg("-dumpmachine").output();
        let machine = machine.map(|made| String::from_utf8_lossy(&made.stdout).into_owned());
        let can = machine.as_ref().is_ok_and(|machine| machine.starts_with(ARCH));
        if !can {
            // Past the test's own output, which is hidden where it passes.
            let said = writeln!(
                std::io::stderr(),
                "skipped: the {} example (`{compiler} -dumpmachine` gives {machine:?}, not {ARCH})",
                self.language
            );
            said.expect("a terminal or a file");
        }
        can
    }

    /// Reads the header as a program of that standard; the compiler's messages, if it refuses.
    pub(crate) fn messages(self, standard: &str) -> Result<(), String> {
        let header = Path::new(env!("CARGO_MANIFEST_DIR")).join("include/zynq_pgs.h");
        let mut compiler = Command::new(self.compiler());
        compiler.args([standard, "-fsyntax-only", "-x", "c"]).arg(header);
        let made = compiler.output().expect("the compiler runs");
        match made.status.success() {
            true => Ok(()),
            false => Err(String::from_utf8_lossy(&made.stderr).into_owned()),
        }
    }

    /// Compiles the example, and returns the digest that it prints.
    pub(crate) fn digest(self, folder: &Path, name: &str, libraries: &[OsString]) -> String {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let program = folder.join(name);
        let mut compiler = Command::new(self.compiler());
        compiler.arg(self.standard);
        compiler.args(["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off"]);
        compiler.arg("-I").arg(root.join("include"));
        compiler.arg(root.join("examples").join(self.source));
        compiler.args(libraries).arg("-o").arg(&program);
        let made = compiler.output().expect("the compiler runs");
        assert!(made.status.success(), "{compiler:?}: {}", String::from_utf8_lossy(&made.stderr));
        let ran = running(&program).output().expect("the example runs");
        let (stdout, stderr) =
            (String::from_utf8_lossy(&ran.stdout), String::from_utf8_lossy(&ran.stderr));
        assert!(ran.status.success(), "{name}: {stdout}{stderr}");
        let digest = stdout.lines().find_map(|line| line.strip_prefix("digest     fnv1a-64 "));
        digest.unwrap_or_else(|| panic!("{name}: no digest in {stdout}")).to_owned()
    }
}

/// The command that runs a program in an emulated processor, if the tests run in one.
pub(crate) fn runner() -> Option<String> {
    std::env::var("PGS_TEST_RUNNER").ok().filter(|runner| !runner.trim().is_empty())
}

/// A command that runs a program that was compiled.
fn running(program: &Path) -> Command {
    let runner = runner().unwrap_or_default();
    let mut words = runner.split_whitespace();
    let Some(first) = words.next() else { return Command::new(program) };
    let mut command = Command::new(first);
    command.args(words).arg(program);
    command
}
