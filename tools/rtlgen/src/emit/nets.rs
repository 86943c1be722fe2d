//! The nets of pipelines that share a pool: the driver of each value, and how long it waits.

use std::collections::{BTreeMap, BTreeSet};

use crate::design::Pipeline;
use crate::graph::{NodeId, Operand};
use crate::pool::Unit;

/// A value of a pipeline: its node, and whether it is the upper one of two.
pub(super) type Value = (usize, NodeId, bool);

/// For each pipeline and node the net that carries its value as it comes.
pub(super) fn nets(pipelines: &[&Pipeline], units: &[Unit]) -> Vec<Vec<Net>> {
    let nets = pipelines.iter().enumerate().map(|(number, pipeline)| {
        let Pipeline { graph, schedule, .. } = pipeline;
        let net = |id: NodeId| Net {
            driver: graph.node(id).name.clone(),
            interval: schedule.interval,
            phase: schedule.phase(schedule.ready(graph, id)),
            is_input: true,
        };
        let mut nets: Vec<Net> = graph.ids().map(net).collect();
        for unit in units {
            for used in unit.of(number) {
                let net = &mut nets[used.node.index()];
                (net.driver, net.is_input) = (unit.name(graph.precision()), false);
            }
        }
        nets
    });
    nets.collect()
}

/// A net that carries a value as it comes, in one cycle of each interval.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Net {
    /// A unit, or an input.
    pub(super) driver: String,
    /// Cycles from a value to the next.
    pub(super) interval: i32,
    /// The phase in which the value comes.
    pub(super) phase: usize,
    /// Whether an input drives it.
    pub(super) is_input: bool,
}

/// For each value the numbers of intervals after which it is read.
pub(super) fn taps(pipelines: &[&Pipeline]) -> BTreeMap<Value, BTreeSet<i32>> {
    let mut taps = BTreeMap::<_, BTreeSet<i32>>::new();
    for (number, pipeline) in pipelines.iter().enumerate() {
        let Pipeline { graph, schedule, .. } = pipeline;
        let mut read = |operand: &Operand, cycle: i32| {
            let gate = operand.gate.map(|gate| (gate, false));
            for (node, upper) in [Some((operand.node, operand.upper)), gate].into_iter().flatten() {
                if !graph.node(node).kind.is_still() {
                    let slots = slots(pipeline, node, cycle);
                    taps.entry((number, node, upper)).or_default().insert(slots);
                }
            }
        };
        for id in graph.ids() {
            for operand in &graph.node(id).operands {
                read(operand, schedule.starts[id.index()]);
            }
        }
        for operand in graph.outputs().iter().flat_map(|output| &output.operands) {
            read(operand, schedule.depth);
        }
    }
    taps
}

/// Intervals for which a value waits that is read at `cycle`.
pub(super) fn slots(pipeline: &Pipeline, node: NodeId, cycle: i32) -> i32 {
    let Pipeline { graph, schedule, .. } = pipeline;
    let late = cycle - schedule.ready(graph, node);
    late.div_euclid(schedule.interval) + i32::from(late % schedule.interval != 0)
}
