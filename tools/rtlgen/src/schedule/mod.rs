//! Modulo schedule: the cycle of every operation, and the unit that carries it out.
//!
//! A record enters every `interval` cycles, so a unit carries out up to `interval` operations of a
//! graph, one in each phase (cycle modulo the interval). The scheduler goes from the outputs back
//! to the inputs and starts every operation as late as its readers allow, the longest way to the
//! velocities first: the velocities are then read as late as possible, which makes the hazard
//! window short, and values wait as little as possible, which saves delays.

mod list;

use std::collections::BTreeMap;

use crate::graph::{Graph, Kind, NodeId, Operation, Source};

/// A unit of the library, and the operations that it carries out.
#[derive(Debug, Clone)]
pub struct Unit {
    /// The operation of the unit.
    pub operation: Operation,
    /// Number among the units of its operation.
    pub number: usize,
    /// The node of each phase; an idle phase has none.
    pub phases: Vec<Option<NodeId>>,
}

/// A scheduled graph. Cycle 0 is the first cycle in which the record's inputs can be read.
#[derive(Debug)]
pub struct Schedule {
    /// Cycles from one record to the next.
    pub interval: i32,
    /// For each node the cycle in which its operands are read; for an input the cycle from which
    /// its value can be read, for an interval.
    pub starts: Vec<i32>,
    /// All units.
    pub units: Vec<Unit>,
    /// Cycle in which all outputs can be read.
    pub depth: i32,
    /// Cycle in which the velocities can be read.
    pub velocities_at: i32,
    /// Cycle in which the impulses can be read.
    pub impulses_at: i32,
}

impl Schedule {
    /// Schedules a graph with one record every `interval` cycles.
    ///
    /// # Panics
    ///
    /// If `interval` is 0.
    #[must_use]
    pub fn new(graph: &Graph, interval: u32) -> Self {
        let interval = i32::try_from(interval).unwrap_or(i32::MAX);
        assert!(interval > 0, "an interval of at least one cycle");
        let list = list::as_late_as_possible(graph, interval);

        // Outputs are at cycle 0 of the list; the first read is to be at a cycle >= 0 here.
        let first = graph
            .ids()
            .filter(|id| !graph.node(*id).kind.is_still())
            .map(|id| list.starts[id.index()])
            .min()
            .unwrap_or(0);
        let shift = round_up(-first, interval);
        let mut starts: Vec<i32> = list.starts.iter().map(|start| start + shift).collect();
        let group = |source| {
            let starts = graph
                .ids()
                .filter(|id| graph.node(*id).kind == Kind::Input(source))
                .map(|id| starts[id.index()]);
            starts.min().map_or(0, |first| round_down(first, interval))
        };
        let (velocities_at, impulses_at) = (group(Source::Velocity), group(Source::Impulse));
        for id in graph.ids() {
            match graph.node(id).kind {
                Kind::Input(Source::Record | Source::Flag) => starts[id.index()] = 0,
                Kind::Input(Source::Velocity) => starts[id.index()] = velocities_at,
                Kind::Input(Source::Impulse) => starts[id.index()] = impulses_at,
                _ => {}
            }
        }
        let units = bind(graph, &starts, interval);
        Self { interval, starts, units, depth: shift, velocities_at, impulses_at }
    }

    /// Cycle from which a node's value can be read.
    #[must_use]
    pub fn ready(&self, graph: &Graph, node: NodeId) -> i32 {
        self.starts[node.index()] + latency(graph, node)
    }

    /// The phase of a cycle.
    #[must_use]
    pub fn phase(&self, cycle: i32) -> usize {
        usize::try_from(cycle.rem_euclid(self.interval)).unwrap_or(0)
    }

    /// Operations and units of each kind.
    #[must_use]
    pub fn usage(&self) -> BTreeMap<Operation, Usage> {
        let mut usage = BTreeMap::<_, Usage>::new();
        for unit in &self.units {
            let entry = usage.entry(unit.operation).or_default();
            entry.units += 1;
            entry.operations += unit.phases.iter().flatten().count();
        }
        usage
    }
}

/// How much hardware an operation takes in a pipeline.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Usage {
    /// Operations a record.
    pub operations: usize,
    /// Units that carry them out.
    pub units: usize,
}

/// Assigns the operations of each kind to units: the n-th operation of a phase to the n-th unit.
fn bind(graph: &Graph, starts: &[i32], interval: i32) -> Vec<Unit> {
    let phases = usize::try_from(interval).unwrap_or(1);
    let mut units = BTreeMap::<(Operation, usize), Unit>::new();
    let mut taken = BTreeMap::<(Operation, i32), usize>::new();
    for id in graph.ids() {
        let Some(operation) = graph.node(id).kind.operation() else { continue };
        let phase = starts[id.index()].rem_euclid(interval);
        let number = taken.entry((operation, phase)).or_default();
        let unit = units.entry((operation, *number)).or_insert_with(|| Unit {
            operation,
            number: *number,
            phases: vec![None; phases],
        });
        unit.phases[usize::try_from(phase).unwrap_or(0)] = Some(id);
        *number += 1;
    }
    units.into_values().collect()
}

/// Cycles from the read of a node's operands to its value.
fn latency(graph: &Graph, node: NodeId) -> i32 {
    let operation = graph.node(node).kind.operation();
    operation.map_or(0, |operation| operation.operator(graph.precision()).latency)
}

fn round_down(cycle: i32, interval: i32) -> i32 {
    cycle.div_euclid(interval) * interval
}

fn round_up(cycle: i32, interval: i32) -> i32 {
    -round_down(-cycle, interval)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equations;
    use pgs_interface::number::Precision;
    use pgs_interface::profile::Inertia;

    fn all() -> Vec<(Graph, u32)> {
        let mut all = Vec::new();
        for (precision, passes) in [(Precision::F32, 2), (Precision::Binary16, 3)] {
            all.push((equations::integration(precision), 1));
            for inertia in [Inertia::Isotropic, Inertia::World] {
                all.push((equations::contact(precision, 4, inertia), passes));
                all.push((equations::friction(precision, inertia), passes));
            }
        }
        all
    }

    #[test]
    fn no_value_is_read_before_it_is_there() {
        for (graph, interval) in all() {
            let schedule = Schedule::new(&graph, interval);
            for id in graph.ids() {
                for read in graph.node(id).reads() {
                    let kind = graph.node(read).kind;
                    let ready = schedule.ready(&graph, read);
                    let start = schedule.starts[id.index()];
                    assert!(kind.is_still() || ready <= start, "{}", graph.node(id).name);
                }
            }
            for operand in graph.outputs().iter().flat_map(|output| &output.operands) {
                assert!(schedule.ready(&graph, operand.node) <= schedule.depth);
            }
        }
    }

    #[test]
    fn every_operation_has_a_unit_and_a_unit_one_operation_a_phase() {
        for (graph, interval) in all() {
            let schedule = Schedule::new(&graph, interval);
            let mut bound = 0;
            for unit in &schedule.units {
                for (phase, node) in unit.phases.iter().enumerate() {
                    let Some(node) = *node else { continue };
                    assert_eq!(schedule.phase(schedule.starts[node.index()]), phase);
                    assert_eq!(graph.node(node).kind, Kind::Operation(unit.operation));
                    bound += 1;
                }
            }
            let operations =
                graph.nodes().iter().filter(|node| node.kind.operation().is_some()).count();
            assert_eq!(bound, operations);
        }
    }

    #[test]
    fn no_kind_takes_more_units_than_its_operations_need() {
        for (graph, interval) in all() {
            for (operation, usage) in Schedule::new(&graph, interval).usage() {
                let least = usage.operations.div_ceil(usize::try_from(interval).unwrap_or(1));
                assert_eq!(usage.units, least, "{operation:?} at an interval of {interval}");
            }
        }
    }
}
