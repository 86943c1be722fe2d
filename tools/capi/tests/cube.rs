//! `examples/cube.c`, built by the system's C compiler against the committed header and both kinds
//! of library, gives the bits of the same scene in Rust.

use std::env::consts::ARCH;
use std::ffi::OsString;
use std::fs;
use std::io::Write;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;

use zynq_pgs::{
    Accelerator, Body, Collision, Contact, OpenOptions, Pose, Shape, StepParameters, Velocity,
};

/// The folder of the libraries that cargo has built for the tests.
fn libraries() -> PathBuf {
    let test = std::env::current_exe().expect("the path of the test");
    test.parent().expect("the folder of the test").to_owned()
}

/// The C compiler: `cc`, or the one that the variable `CC` names.
fn compiler() -> String {
    std::env::var("CC").unwrap_or_else(|_| "cc".to_owned())
}

/// A command that runs a program that was compiled: by the variable `PGS_TEST_RUNNER`, where the tests
/// run in an emulated processor.
fn running(program: &Path) -> Command {
    let runner = std::env::var("PGS_TEST_RUNNER").unwrap_or_default();
    let mut words = runner.split_whitespace();
    let Some(first) = words.next() else { return Command::new(program) };
    let mut command = Command::new(first);
    command.args(words).arg(program);
    command
}

/// Whether the C compiler makes programs for the machine of the tests; says aloud if not.
fn can_compile() -> bool {
    let cc = compiler();
    let machine = Command::new(&cc).arg("-dumpmachine").output();
    let machine = machine.map(|made| String::from_utf8_lossy(&made.stdout).into_owned());
    let can = machine.as_ref().is_ok_and(|machine| machine.starts_with(ARCH));
    if !can {
        // Past the test's own output, which is hidden where it passes.
        let said = writeln!(
            std::io::stderr(),
            "skipped: the C example (`{cc} -dumpmachine` gives {machine:?}, not {ARCH})"
        );
        said.expect("a terminal or a file");
    }
    can
}

/// Compiles the example, and returns the digest that it prints.
fn digest_of_c(folder: &Path, name: &str, libraries: &[OsString]) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let program = folder.join(name);
    let mut cc = Command::new(compiler());
    cc.args(["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off"]);
    cc.arg("-I").arg(root.join("include")).arg(root.join("examples/cube.c"));
    cc.args(libraries).arg("-o").arg(&program);
    let made = cc.output().expect("cc runs");
    assert!(made.status.success(), "{cc:?}: {}", String::from_utf8_lossy(&made.stderr));
    let ran = running(&program).output().expect("the example runs");
    let (stdout, stderr) =
        (String::from_utf8_lossy(&ran.stdout), String::from_utf8_lossy(&ran.stderr));
    assert!(ran.status.success(), "{name}: {stdout}{stderr}");
    let digest = stdout.lines().find_map(|line| line.strip_prefix("digest     fnv1a-64 "));
    digest.unwrap_or_else(|| panic!("{name}: no digest in {stdout}")).to_owned()
}

fn collide(cube: &Body) -> Collision {
    let [x, y, z] = cube.pose.position;
    let depth = y - 1.0;
    let corner = |dx, dz| Contact { point: [x + dx, depth, z + dz], distance: depth };
    let contacts = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
    let count = if depth < 0.0 { 4 } else { 0 };
    Collision { body_a: 0, body_b: 1, normal: [0.0, -1.0, 0.0], count, contacts }
}

/// The digest of the example's scene, stepped by the driver.
fn digest_of_rust() -> String {
    let board = OpenOptions::emulated("float").expect("a build");
    let mut board = Accelerator::open(board).expect("a board");
    board.set_shapes(&[Shape::STATIC, Shape::isotropic(1.0, 1.5)]).expect("shapes");
    let at = |y, shape, x_speed| Body {
        pose: Pose { position: [0.0, y, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] },
        velocity: Velocity { linear: [x_speed, 0.0, 0.0], angular: [0.0; 3] },
        shape,
    };
    let mut bodies = [at(-1.0, 0, 0.0), at(2.0, 1, 0.5)];
    let parameters = StepParameters::default().with_friction(0.5);
    for _ in 0..90 {
        let collision = collide(&bodies[1]);
        board.step(&mut bodies[..], &[collision][..], &parameters).expect("a step");
    }
    let height = bodies[1].pose.position[1];
    assert!((0.9..1.1).contains(&height), "the cube lies on the ground: {height}");
    format!("{:016x}", step_folder::digest::of_bodies(&bodies))
}

#[test]
fn the_c_example_gives_the_drivers_bits_with_the_static_and_the_shared_library() {
    if !can_compile() {
        return;
    }
    let (folder, expected) = (tempfile::tempdir().expect("a folder"), digest_of_rust());
    let fixed = libraries().join("libzynq_pgs_c.a");
    let mut with: Vec<_> = [fixed.into_os_string()]
        .into_iter()
        .chain(["-lpthread", "-ldl", "-lm"].map(OsString::from))
        .collect();
    if std::env::var_os("PGS_TEST_RUNNER").is_some() {
        // Another machine's C library is not where the loader would look.
        with.push("-static".into());
    }
    assert_eq!(digest_of_c(folder.path(), "static", &with), expected);

    let shared = libraries().join("libzynq_pgs_c.so");
    if cfg!(target_feature = "crt-static") {
        // A build whose C library is static has no shared one.
        return;
    }
    // Installed as docs/c.md says: the loader looks for the name with the version.
    let version = zynq_pgs_c::ZPGS_ABI_VERSION;
    let named = folder.path().join(format!("libzynq_pgs_c.so.{version}"));
    fs::copy(shared, &named).expect("the shared library");
    symlink(&named, folder.path().join("libzynq_pgs_c.so")).expect("a link");
    let mut path = OsString::from("-Wl,-rpath,");
    path.push(folder.path());
    let with = ["-L".into(), folder.path().into(), "-lzynq_pgs_c".into(), path];
    assert_eq!(digest_of_c(folder.path(), "shared", &with), expected);
    let program = fs::read(folder.path().join("shared")).expect("the program");
    let named = format!("libzynq_pgs_c.so.{version}\0");
    let holds = program.windows(named.len()).any(|bytes| bytes == named.as_bytes());
    assert!(holds, "the program asks for {named:?}");
}
