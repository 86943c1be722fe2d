//! Opens the emulated boards of the studies.

use indicatif::ProgressBar;
use zynq_pgs::MemoryChoice;
use zynq_pgs::emulation::Build;

use crate::board::{self, OpenBoard};
use crate::common::{AcceleratorChoice, BoardName, CommonArgs};
use crate::failure::Failure;
use crate::output::progress::progress_bar;

/// Opens an emulated board of this build, whatever the command line and the environment say.
pub(super) fn open(build: &Build) -> Result<OpenBoard, Failure> {
    let common = CommonArgs {
        json: false,
        board: BoardName::Emulated,
        memory: MemoryChoice::Automatic,
        memory_of_environment: false,
        manager: Default::default(),
        accelerator: AcceleratorChoice::Model,
    };
    board::open(&common, build)
}

/// A bar whose length each study sets.
pub(super) fn bar() -> ProgressBar {
    progress_bar(0)
}
