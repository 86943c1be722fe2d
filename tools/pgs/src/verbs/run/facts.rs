//! The facts of a run on its page, and the time of a step in words.

use zynq_pgs::StepParameters;
use zynq_pgs::board::BoardKind;

use super::RunArgs;
use pgs_command::board::OpenBoard;

/// The facts of a run on its page.
pub(super) fn facts(
    args: &RunArgs,
    opened: &OpenBoard,
    parameters: &StepParameters,
) -> [(&'static str, String); 4] {
    let StepParameters { contact_iterations, friction_iterations, warm_start, .. } = parameters;
    let warm = if *warm_start { ", and one more of each for a warm start" } else { "" };
    let profile = opened.accelerator.capabilities().variant.profile.name;
    [
        ("scene", args.scene.text()),
        ("board", opened.accelerator.board().to_string()),
        ("profile", profile.to_owned()),
        (
            "passes of a step",
            format!(
                "{contact_iterations} over contacts, {friction_iterations} over friction{warm}"
            ),
        ),
    ]
}

/// The time of a step on the board, in words.
pub(super) fn board_time(opened: &OpenBoard, milliseconds: f64) -> String {
    let modelled = if is_emulated(opened) { " (modelled)" } else { "" };
    format!("{milliseconds:.3} ms a step on the board{modelled}")
}

/// Whether the times of the board are modelled.
pub(super) fn is_emulated(opened: &OpenBoard) -> bool {
    matches!(opened.accelerator.board().kind, BoardKind::Emulated | BoardKind::Served)
}
