//! The circumstances of an experiment: the common options, Ctrl-C, and the progress it shows.

use indicatif::ProgressBar;

use pgs_command::board::OpenBoard;
use pgs_command::common::CommonArgs;
use pgs_command::interrupt::Interrupt;
use pgs_command::output::progress::progress_bar;

/// The circumstances of a study.
#[derive(Debug)]
pub(crate) struct Session {
    pub(crate) common: CommonArgs,
    interrupt: Interrupt,
    bar: ProgressBar,
    /// The bar is of this session alone.
    owns_bar: bool,
}

impl Session {
    /// Takes over Ctrl-C, and shows the progress on a terminal.
    pub(crate) fn new(common: &CommonArgs) -> Self {
        let (interrupt, bar) = (Interrupt::install(), progress_bar(0));
        Self { common: common.clone(), interrupt, bar, owns_bar: true }
    }

    /// A session in a verb that has taken over Ctrl-C, and shows the progress in `bar`.
    pub(crate) fn within(common: &CommonArgs, interrupt: Interrupt, bar: ProgressBar) -> Self {
        Self { common: common.clone(), interrupt, bar, owns_bar: false }
    }

    /// The options with the emulated board, for experiments that build their boards themselves.
    pub(crate) fn emulated(&self) -> CommonArgs {
        CommonArgs { board: CommonArgs::emulated().board, ..self.common.clone() }
    }

    /// Announces further steps.
    pub(crate) fn expect(&self, steps: u64) {
        self.bar.inc_length(steps);
    }

    /// Tells that a step was taken.
    pub(crate) fn advance(&self) {
        self.bar.inc(1);
    }

    /// Clears the progress, unless another verb shows it.
    pub(crate) fn end(&self) {
        if self.owns_bar {
            self.bar.finish_and_clear();
        }
    }

    /// Whether Ctrl-C has come.
    pub(crate) fn is_interrupted(&self) -> bool {
        self.interrupt.is_set()
    }

    /// Lets Ctrl-C end a step of the board.
    pub(crate) fn watch(&self, opened: &mut OpenBoard) {
        opened.accelerator.set_cancellation(self.interrupt.cancellation());
    }
}
