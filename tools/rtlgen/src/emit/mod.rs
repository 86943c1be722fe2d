//! Writes a design as Verilog-2001: a module for the
//! pipelines, and headers with the facts that the
//! hand-written modules need of it. The block design of Vivado gets its numbers likewise.

mod headers;
mod nets;
mod solver;
mod text;
mod vivado;

use crate::design::Design;
use crate::sources;

/// A file of the generated folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Its name.
    pub name: String,
    /// Its text.
    pub text: String,
}

/// Name of the top module.
pub const TOP: &str = "pgs_top";

/// All files of a design, ready for a tool: hand-written and generated modules, headers, `pgs.f`,
/// the list of the modules, and `pgs_vivado.tcl`, the numbers of a block design.
#[must_use]
pub fn files(design: &Design) -> Vec<File> {
    let file = |name: &str, text: String| File { name: name.into(), text };
    let mut files = vec![
        file("pgs_interface.vh", headers::interface()),
        file("pgs_operators.vh", headers::operators(design.parameters.profile.numbers.updates)),
        file("pgs_schedule.vh", headers::schedule(design)),
    ];
    let mut modules = Vec::new();
    for source in sources::of(design.parameters.profile) {
        modules.push(file(source.file, source.text.into()));
    }
    let solver = solver::module(&design.pipelines(), design.parameters.smallest_normal);
    modules.push(file("pgs_solver.v", solver));
    let list: String = modules.iter().map(|module| format!("{}\n", module.name)).collect();
    files.append(&mut modules);
    files.push(file("pgs.f", list));
    files.push(file("pgs_vivado.tcl", vivado::numbers(design)));
    files
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::Parameters;
    use crate::pool::{self, Unit};
    use pgs_interface::number::Precision;

    /// Instances that leave the rule of the smallest normal number out, in the whole design.
    fn without_rule(smallest_normal: bool) -> usize {
        let parameters = Parameters { smallest_normal, ..Parameters::default() };
        let files = files(&Design::new(parameters));
        files.iter().map(|file| file.text.matches("#(.SMALLEST_NORMAL(0)) f").count()).sum()
    }

    #[test]
    fn every_multiplier_and_divider_of_a_pipeline_follows_the_rule_or_none_does() {
        let pool = pool::units(&Design::new(Parameters::default()).pipelines());
        let rule = |unit: &&Unit| unit.operation.operator(Precision::F32).smallest_normal;
        let rounding = pool.iter().filter(rule).count();
        assert!(rounding > 100, "{rounding}");
        assert_eq!((without_rule(true), without_rule(false)), (0, rounding));
    }
}
