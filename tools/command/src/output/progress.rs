//! Shows the progress of a command on a terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar over a number of steps: on stderr, and only if it is a terminal.
pub fn progress_bar(steps: u32) -> ProgressBar {
    let bar = ProgressBar::new(steps.into());
    let style = "{bar:30} {pos}/{len} steps, {per_sec}, {eta} left";
    if let Ok(style) = ProgressStyle::with_template(style) {
        bar.set_style(style);
    }
    bar
}
