//! One pool of units for pipelines that never run together.
//!
//! A step is contact passes, friction passes, and the integration, one after the other. An
//! arithmetic unit of one pipeline carries out operations of the others where the choice between
//! their operands takes less than a second unit. The schedules stay as they are: no cycle and no
//! window depends on the pool.

use pgs_interface::number::Precision;

use crate::design::Pipeline;
use crate::graph::{NodeId, Operation};

/// An operation that a unit carries out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Use {
    /// Number of the pipeline among the ones that share the pool.
    pub pipeline: usize,
    /// The phase in which the unit reads its operands.
    pub phase: usize,
    /// The node of the pipeline's graph.
    pub node: NodeId,
}

/// A unit of the pool.
#[derive(Debug, Clone)]
pub struct Unit {
    /// The operation of the unit.
    pub operation: Operation,
    /// Number among the units of its operation.
    pub number: usize,
    /// At most one operation for each phase of each pipeline, in their order.
    pub uses: Vec<Use>,
}

impl Unit {
    /// Its name in the Verilog, in numbers of a precision.
    #[must_use]
    pub fn name(&self, precision: Precision) -> String {
        format!("{}_{}", self.operation.operator(precision).module, self.number)
    }

    /// The operations of a pipeline.
    pub fn of(&self, pipeline: usize) -> impl Iterator<Item = &Use> {
        self.uses.iter().filter(move |used| used.pipeline == pipeline)
    }
}

/// The largest number of operands from which a port of a unit takes one. Two passes of two phases have
/// four, a LUT a bit and one level of logic; two of three phases, and the integration, seven, three
/// LUTs a bit and two levels.
fn choices(pipelines: &[&Pipeline]) -> usize {
    let phases = pipelines.iter().map(|pipeline| pipeline.schedule.interval).max();
    if phases == Some(3) { 7 } else { 4 }
}

/// The units of some pipelines: a comparison or a selection is as small as the choice between its
/// operands, so that each pipeline has its own.
#[must_use]
pub fn units(pipelines: &[&Pipeline]) -> Vec<Unit> {
    let choices = choices(pipelines);
    let mut pool: Vec<Unit> = Vec::new();
    for (pipeline, Pipeline { graph, schedule, .. }) in pipelines.iter().enumerate() {
        let own = |unit: &Unit| unit.of(pipeline).next().is_some();
        for scheduled in &schedule.units {
            let operation = scheduled.operation;
            let shares = operation.operator(graph.precision()).arithmetic;
            let uses = scheduled.phases.iter().enumerate();
            let uses: Vec<Use> = uses
                .filter_map(|(phase, node)| node.map(|node| Use { pipeline, phase, node }))
                .collect();
            let of_operation = pool.iter().filter(|unit| unit.operation == operation).count();
            // The one with the fewest operations, so that no choice is larger than it has to be.
            let free = pool
                .iter_mut()
                .filter(|unit| shares && unit.operation == operation && !own(unit))
                .filter(|unit| unit.uses.len() + uses.len() <= choices)
                .min_by_key(|unit| unit.uses.len());
            match free {
                Some(unit) => unit.uses.extend(uses),
                None => pool.push(Unit { operation, number: of_operation, uses }),
            }
        }
    }
    pool
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::{Design, Parameters};
    use pgs_interface::profile::Inertia;

    /// Every operation has one unit, and a unit one operation for each phase of a pipeline.
    #[test]
    fn each_operation_is_carried_out_once_and_no_unit_has_two_at_a_time() {
        for inertia in [Inertia::Isotropic, Inertia::World] {
            let design = Design::new(Parameters::with(inertia));
            let pipelines = design.pipelines();
            let mut carried_out = Vec::new();
            for unit in units(&pipelines) {
                let mut taken = Vec::new();
                for &Use { pipeline, phase, node } in &unit.uses {
                    let Pipeline { graph, schedule, .. } = pipelines[pipeline];
                    assert_eq!(graph.node(node).kind.operation(), Some(unit.operation));
                    assert_eq!(schedule.phase(schedule.starts[node.index()]), phase);
                    assert!(!taken.contains(&(pipeline, phase)), "{unit:?}");
                    taken.push((pipeline, phase));
                    carried_out.push((pipeline, node));
                }
            }
            let all = carried_out.len();
            carried_out.sort_unstable();
            carried_out.dedup();
            let operations = |pipeline: &&Pipeline| {
                pipeline.graph.nodes().iter().filter(|node| node.kind.operation().is_some()).count()
            };
            assert_eq!((carried_out.len(), all), (all, pipelines.iter().map(operations).sum()));
        }
    }

    /// No pipeline takes an adder that another one could lend, and no port chooses among more than
    /// four operands.
    #[test]
    fn the_pool_has_the_adders_of_the_largest_pipeline() {
        let design = Design::new(Parameters::default());
        let pool = units(&design.pipelines());
        let adders = pool.iter().filter(|unit| unit.operation == Operation::Add).count();
        let each = design.pipelines().map(|one| one.schedule.usage()[&Operation::Add].units);
        assert_eq!(Some(&adders), each.iter().max(), "{each:?}");
        assert!(pool.iter().all(|unit| unit.uses.len() <= 4));
    }
}
