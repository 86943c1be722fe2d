//! How far loading has come, for the thread that ends it at a signal.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::LoadError;

/// The state of the logic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stage {
    /// Nothing was given to the kernel.
    #[default]
    Untouched,
    /// The kernel has got the bitstream's name.
    Programming,
    /// It is programmed, and the overlay may be applied.
    Programmed,
}

#[derive(Debug, Default)]
struct State {
    stage: Stage,
    /// The copy of the bitstream in the kernel's firmware folder.
    copy: Option<PathBuf>,
}

impl State {
    fn remove_copy(&mut self) {
        let Some(copy) = self.copy.take() else { return };
        if let Err(error) = fs::remove_file(&copy) {
            log::warn!("the copy {} stays: {error}", copy.display());
        }
    }
}

/// How far loading has come; clones share it.
#[derive(Debug, Clone, Default)]
pub struct Progress(Arc<Mutex<State>>);

impl Progress {
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn reach(&self, stage: Stage) {
        self.state().stage = stage;
    }

    /// A copy is about to be made, and is to be removed.
    pub(super) fn keep(&self, copy: &Path) {
        self.state().copy = Some(copy.to_owned());
    }

    /// There is no copy.
    pub(super) fn forget(&self) {
        self.state().copy = None;
    }

    pub(super) fn remove_copy(&self) {
        self.state().remove_copy();
    }

    /// Removes the copy and ends the program. While `exit` runs, loading does not reach its next
    /// stage.
    pub fn end(&self, exit: impl FnOnce(LoadError)) {
        let mut state = self.state();
        state.remove_copy();
        exit(LoadError::Interrupted { stage: state.stage });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_removes_the_copy_and_tells_each_state_of_the_logic_apart() {
        let folder = tempfile::tempdir().expect("a directory");
        let copy = folder.path().join("copy");
        let mut told = Vec::new();
        for stage in [Stage::Untouched, Stage::Programming, Stage::Programmed] {
            let progress = Progress::default();
            progress.reach(stage);
            progress.keep(&copy);
            fs::write(&copy, "a bitstream").expect("written");
            progress.clone().end(|error| told.push((error.to_string(), error.next())));
            assert!(!copy.exists(), "{stage:?}");
        }
        for (place, (text, next)) in told.iter().enumerate() {
            assert!(text.starts_with("interrupted: "), "{text}");
            assert!(told[..place].iter().all(|(t, n)| t != text && n != next), "{told:?}");
        }
        assert!(told[0].0.contains("the logic is as it was"), "{told:?}");
        assert!(told[1].0.contains("half programmed"), "{told:?}");
        assert!(told[2].0.contains("the bitstream is loaded"), "{told:?}");
    }
}
