//! The yardstick computes Bullet's results: no bit differs after any pass, nor at the end of the
//! step.
//!
//! The small scenes are in `tests/golden`. With the environment variable `PGS_VECTORS` every folder
//! below it is compared, too, with the thesis' step among them.

use std::path::{Path, PathBuf};

use step_folder::folder::{Folder, State, velocities};
use step_folder::npy::{self, Dimensions};
use yardstick::Yardstick;

/// The folders of `root` that hold a step.
fn steps(root: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(root).expect("the folder is there");
    let folders = entries.map(|entry| entry.expect("a readable folder").path());
    folders.filter(|path| path.join("params.npy").is_file()).collect()
}

fn every_step() -> Vec<PathBuf> {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden");
    let mut found = steps(&golden);
    assert_eq!(found.len(), 8, "{found:?}");
    // A blank variable is none.
    let root = std::env::var_os("PGS_VECTORS");
    if let Some(root) = root.filter(|root| !root.to_string_lossy().trim().is_empty()) {
        found.extend(steps(Path::new(&root)));
    }
    found
}

/// The bits of an array.
fn expected(folder: &Path, name: &str, rest: &[usize]) -> Vec<u32> {
    let shape = std::iter::once(None).chain(rest.iter().copied().map(Some)).collect();
    let (_, numbers) =
        npy::read::<f32>(&folder.join(name), &Dimensions(shape)).expect("Bullet's results");
    numbers.into_iter().map(f32::to_bits).collect()
}

fn bits(numbers: impl Iterator<Item = f32>) -> Vec<u32> {
    numbers.map(f32::to_bits).collect()
}

#[test]
fn the_state_after_a_step_is_that_of_bullet() {
    for path in every_step() {
        let step = Folder::load(&path).expect("a step");
        let Folder { shapes, bodies, collisions, parameters, .. } = &step;
        let mut yardstick = Yardstick::new(shapes, bodies, collisions, parameters);
        // The second time it starts from the same state.
        yardstick.solve();
        yardstick.solve();
        let found = yardstick.bodies();
        assert_eq!(found.len(), bodies.len());
        for state in State::ALL {
            let expected = expected(&path, state.file(), &[state.width()]);
            assert!(bits(state.of(&found)) == expected, "{}: {state:?}", path.display());
        }
    }
}

#[test]
fn the_velocities_after_every_pass_are_those_of_bullet() {
    for path in every_step() {
        let step = Folder::load(&path).expect("a step");
        let Folder { shapes, bodies, collisions, .. } = &step;
        let numbers = 6 * bodies.len();
        for (file, contact, friction) in [
            ("out_vel_contact.npy", [1, 2, 3, 4], [0; 4]),
            ("out_vel_friction.npy", [4; 4], [1, 2, 3, 4]),
        ] {
            let expected = expected(&path, file, &[bodies.len(), 6]);
            assert_eq!(expected.len(), 4 * numbers);
            for (pass, expected) in expected.chunks(numbers).enumerate() {
                let mut parameters = step.parameters;
                parameters.contact_iterations = contact[pass];
                parameters.friction_iterations = friction[pass];
                parameters.integrate = false;
                let mut yardstick = Yardstick::new(shapes, bodies, collisions, &parameters);
                yardstick.solve();
                let found = bits(velocities(&yardstick.bodies()));
                assert!(found == expected, "{}: {file}, pass {pass}", path.display());
            }
        }
    }
}
