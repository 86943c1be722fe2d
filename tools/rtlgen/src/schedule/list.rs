//! List scheduling from the outputs backwards.

use std::collections::{BTreeSet, HashMap};

use super::latency;
use crate::graph::{Graph, Kind, NodeId, Operation, Source};

/// Start cycles in which the outputs are read at cycle 0, so that all starts are <= 0.
pub(super) struct List {
    pub(super) starts: Vec<i32>,
}

/// A node whose readers all have a cycle. The smallest is scheduled next: the one that can start
/// latest, then the one with the longest way from the velocities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Candidate {
    /// Cycles from the node's result to the outputs.
    before_end: i32,
    /// Minus the cycles from the velocities to the node.
    minus_distance: i32,
    node: NodeId,
}

/// Starts every node as late as its readers and the units allow.
pub(super) fn as_late_as_possible(graph: &Graph, interval: i32) -> List {
    let readers = graph.readers();
    let distance = distance_from_velocities(graph);
    let mut units = Units::new(graph, interval);
    let mut starts: Vec<Option<i32>> = vec![None; graph.nodes().len()];
    let mut waiting: Vec<usize> = readers.iter().map(Vec::len).collect();
    // The first read of a value by its readers; an output is read at cycle 0.
    let first_read = |starts: &[Option<i32>], node: NodeId| {
        let reads = readers[node.index()].iter().filter_map(|reader| starts[reader.index()]);
        reads.min().unwrap_or(0)
    };
    let candidate = |starts: &[Option<i32>], node: NodeId| Candidate {
        before_end: -first_read(starts, node),
        minus_distance: -distance[node.index()],
        node,
    };

    let mut ready: BTreeSet<Candidate> = graph
        .ids()
        .filter(|node| waiting[node.index()] == 0)
        .map(|node| candidate(&starts, node))
        .collect();
    while let Some(Candidate { node, .. }) = ready.pop_first() {
        let kind = graph.node(node).kind;
        let latest = first_read(&starts, node) - latency(graph, node);
        let start = kind.operation().map_or(latest, |operation| units.take(operation, latest));
        starts[node.index()] = Some(start);
        for read in graph.node(node).reads() {
            waiting[read.index()] -= 1;
            if waiting[read.index()] == 0 {
                ready.insert(candidate(&starts, read));
            }
        }
    }
    List { starts: starts.into_iter().map(|start| start.unwrap_or(0)).collect() }
}

/// For each node the cycles of the longest way from a velocity to its operands; a node that no
/// velocity reaches has a very small number.
fn distance_from_velocities(graph: &Graph) -> Vec<i32> {
    const UNREACHED: i32 = i32::MIN / 2;
    let mut distance = vec![UNREACHED; graph.nodes().len()];
    for id in graph.ids() {
        let node = graph.node(id);
        let start = if node.kind == Kind::Input(Source::Velocity) { 0 } else { UNREACHED };
        let reads = node.reads().map(|read| distance[read.index()] + latency(graph, read));
        distance[id.index()] = reads.fold(start, i32::max);
    }
    distance
}

/// The modulo reservation table: how many units of an operation are taken in each phase.
struct Units {
    interval: i32,
    available: HashMap<Operation, usize>,
    taken: HashMap<(Operation, i32), usize>,
}

impl Units {
    /// The smallest number of units that can carry out all operations of each kind.
    fn new(graph: &Graph, interval: i32) -> Self {
        let mut operations = HashMap::<_, usize>::new();
        for operation in graph.nodes().iter().filter_map(|node| node.kind.operation()) {
            *operations.entry(operation).or_default() += 1;
        }
        let phases = usize::try_from(interval).unwrap_or(1);
        let available =
            operations.into_iter().map(|(operation, n)| (operation, n.div_ceil(phases)));
        Self { interval, available: available.collect(), taken: HashMap::new() }
    }

    /// Takes a unit at the latest cycle, not after `latest`, in whose phase one is free.
    fn take(&mut self, operation: Operation, latest: i32) -> i32 {
        let available = self.available.get(&operation).copied().unwrap_or(0);
        let mut start = latest;
        for _ in 0..self.interval {
            let taken = self.taken.entry((operation, start.rem_euclid(self.interval))).or_default();
            if *taken < available {
                *taken += 1;
                break;
            }
            start -= 1;
        }
        start
    }
}
