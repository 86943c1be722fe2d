//! Operation graph: the values of one collision or body, and the operations that compute them.
//!
//! A graph has no time in it; [`crate::schedule`] adds the cycles. Building the same operation on
//! the same operands twice gives the same node, so equations can be written down as they stand in
//! the specification. Signs cost nothing in floating point: a minus is a mark on the operand that
//! reads a value, never an operation.

mod vector;

use std::collections::{BTreeSet, HashMap};

use pgs_interface::number::Precision;

use crate::number;

pub use vector::{Symmetric, Vec3};

/// Number of a node in its graph. Operands of a node have smaller numbers than the node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(usize);

impl NodeId {
    /// Position of the node in [`Graph::nodes`].
    #[must_use]
    pub fn index(self) -> usize {
        self.0
    }
}

/// Where an input of a pipeline comes from; inputs of one group arrive in the same cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Source {
    /// A number of the record, or of the shape table, as the record enters.
    Record,
    /// One bit that belongs to the record.
    Flag,
    /// Velocities, which are read as late as possible: the window begins at this read.
    Velocity,
    /// Accumulated impulses, read from a memory of their own.
    Impulse,
    /// An argument or a constant of the step; it does not change while the step runs.
    Argument,
    /// One bit that does not change while a pass runs.
    Switch,
}

/// An operation of the hardware library.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Operation {
    /// a + b
    Add,
    /// a * b
    Multiply,
    /// a / b
    Divide,
    /// Square root of a.
    SquareRoot,
    /// Sine and cosine of a, side by side.
    SineCosine,
    /// a > b ? a : b
    Maximum,
    /// a < b ? a : b
    Minimum,
    /// a < b, one bit; false for a NaN.
    Less,
    /// Condition (one bit) ? a : b.
    Select,
    /// Flag (one bit) and b is not zero, one bit.
    NonZero,
    /// One bit or the other.
    Or,
    /// Both of two bits.
    And,
    /// Condition (one bit) ? (a > b ? a : b) : c.
    MaximumOr,
    /// Condition (one bit) ? (a < b ? a : b) : c.
    MinimumOr,
}

/// The kind of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
    /// An input of the pipeline.
    Input(Source),
    /// A constant, as the bits of its number.
    Constant(u32),
    /// A result of an operator.
    Operation(Operation),
}

impl Kind {
    /// Whether the value is one bit, not a number.
    #[must_use]
    pub fn is_flag(self) -> bool {
        use Operation::{And, Less, NonZero, Or};
        matches!(
            self,
            Self::Input(Source::Flag | Source::Switch) | Self::Operation(Less | NonZero | Or | And)
        )
    }

    /// Whether the value is two numbers, the first in the low bits.
    #[must_use]
    pub fn is_pair(self) -> bool {
        self == Self::Operation(Operation::SineCosine)
    }

    /// Whether the value is the same for all records of a pass and needs no delay.
    #[must_use]
    pub fn is_still(self) -> bool {
        matches!(self, Self::Input(Source::Argument | Source::Switch) | Self::Constant(_))
    }

    /// The operation that computes the value, if one does.
    #[must_use]
    pub fn operation(self) -> Option<Operation> {
        match self {
            Self::Operation(operation) => Some(operation),
            _ => None,
        }
    }
}

/// A read of a value, with the free changes that wiring makes on the way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Operand {
    /// The node whose value is read.
    pub node: NodeId,
    /// The sign is inverted.
    pub negated: bool,
    /// The upper one of two numbers is read.
    pub upper: bool,
    /// Where this bit is 0, -0 is read instead, which changes no sum, not even one that is -0.
    pub gate: Option<NodeId>,
}

impl Operand {
    fn of(node: NodeId) -> Self {
        Self { node, negated: false, upper: false, gate: None }
    }

    /// The value with its sign inverted.
    #[must_use]
    pub fn negated(self) -> Self {
        Self { negated: !self.negated, ..self }
    }

    /// The value where `flag` is 1, else -0: as an addend it then changes nothing.
    #[must_use]
    pub fn only_if(self, flag: Self) -> Self {
        Self { gate: Some(flag.node), ..self }
    }

    fn magnitude(self) -> Self {
        Self { negated: false, ..self }
    }

    /// The nodes that this read needs: the value and its gate.
    pub fn nodes(&self) -> impl Iterator<Item = NodeId> {
        [Some(self.node), self.gate].into_iter().flatten()
    }
}

/// A node: what it is, what it reads, and a name that leads back to the equations.
#[derive(Debug, Clone)]
pub struct Node {
    /// Its kind.
    pub kind: Kind,
    /// The values that it reads, in the order of the operator's ports.
    pub operands: Vec<Operand>,
    /// A Verilog name, unique in the graph.
    pub name: String,
}

impl Node {
    /// All nodes that this node reads, gates included; a node may come twice.
    pub fn reads(&self) -> impl Iterator<Item = NodeId> {
        self.operands.iter().flat_map(Operand::nodes)
    }
}

/// An input port of a pipeline: one value, or some side by side, the first in the low bits.
#[derive(Debug, Clone)]
pub struct Input {
    /// Name of the port.
    pub name: String,
    /// The values.
    pub nodes: Vec<NodeId>,
}

/// An output port of a pipeline: one value, or some side by side, the first in the low bits.
#[derive(Debug, Clone)]
pub struct Output {
    /// Name of the port without the prefix of outputs.
    pub name: String,
    /// The values.
    pub operands: Vec<Operand>,
}

/// The equations of one pipeline.
#[derive(Debug)]
pub struct Graph {
    precision: Precision,
    nodes: Vec<Node>,
    inputs: Vec<Input>,
    outputs: Vec<Output>,
    known: HashMap<(Kind, Vec<Operand>), NodeId>,
    names: BTreeSet<String>,
    scope: Vec<String>,
}

impl Graph {
    /// No equations yet, in numbers of a precision.
    #[must_use]
    pub fn new(precision: Precision) -> Self {
        Self {
            precision,
            nodes: Vec::new(),
            inputs: Vec::new(),
            outputs: Vec::new(),
            known: HashMap::new(),
            names: BTreeSet::new(),
            scope: Vec::new(),
        }
    }

    /// The precision of all numbers.
    #[must_use]
    pub fn precision(&self) -> Precision {
        self.precision
    }

    /// Bits of a value, or of each of two numbers that an operator gives together.
    #[must_use]
    pub fn width(&self, id: NodeId) -> u32 {
        if self.node(id).kind.is_flag() { 1 } else { number::width(self.precision) }
    }

    /// The nodes; operands come before the nodes that read them.
    #[must_use]
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// The input ports.
    #[must_use]
    pub fn inputs(&self) -> &[Input] {
        &self.inputs
    }

    /// The output ports.
    #[must_use]
    pub fn outputs(&self) -> &[Output] {
        &self.outputs
    }

    /// All node numbers, in order.
    pub fn ids(&self) -> impl DoubleEndedIterator<Item = NodeId> + use<> {
        (0..self.nodes.len()).map(NodeId)
    }

    /// A node.
    #[must_use]
    pub fn node(&self, id: NodeId) -> &Node {
        &self.nodes[id.0]
    }

    /// For each node the nodes that read it; a reader comes as often as it reads.
    #[must_use]
    pub fn readers(&self) -> Vec<Vec<NodeId>> {
        let mut readers = vec![Vec::new(); self.nodes.len()];
        for id in self.ids() {
            for read in self.node(id).reads() {
                readers[read.0].push(id);
            }
        }
        readers
    }

    /// For each input port whether an operation or an output reads it.
    pub fn inputs_read(&self) -> impl Iterator<Item = bool> {
        let operations = self.nodes.iter().flat_map(Node::reads);
        let outputs = self.outputs.iter().flat_map(|output| &output.operands);
        let read: BTreeSet<NodeId> = operations.chain(outputs.flat_map(Operand::nodes)).collect();
        self.inputs.iter().map(move |input| input.nodes.iter().any(|node| read.contains(node)))
    }

    /// Prefixes the names of all nodes that `build` makes.
    pub fn within<T>(&mut self, scope: &str, build: impl FnOnce(&mut Self) -> T) -> T {
        self.scope.push(scope.into());
        let built = build(self);
        self.scope.pop();
        built
    }

    fn add_node(&mut self, kind: Kind, operands: Vec<Operand>, name: String) -> NodeId {
        let id = NodeId(self.nodes.len());
        debug_assert!(operands.iter().flat_map(Operand::nodes).all(|read| read < id));
        self.names.insert(name.clone());
        self.nodes.push(Node { kind, operands, name });
        id
    }

    /// A name for a new node: the scopes, then `what`, then a number where the name is taken.
    fn fresh_name(&self, what: &str) -> String {
        let mut name = self.scope.join("_");
        if !name.is_empty() {
            name.push('_');
        }
        name.push_str(what);
        if !self.names.contains(&name) {
            return name;
        }
        (2..).map(|n| format!("{name}_{n}")).find(|name| !self.names.contains(name)).unwrap_or(name)
    }

    /// An input of one value.
    pub fn input(&mut self, source: Source, name: &str) -> Operand {
        let [value] = self.input_port(source, name, [""]);
        value
    }

    /// An input of three values.
    pub fn input3(&mut self, source: Source, name: &str) -> Vec3 {
        Vec3(self.input_port(source, name, ["_x", "_y", "_z"]))
    }

    /// An input of four values.
    pub fn input4(&mut self, source: Source, name: &str) -> [Operand; 4] {
        self.input_port(source, name, ["_x", "_y", "_z", "_w"])
    }

    /// An input of a symmetric matrix: xx, yy, zz, xy, xz, yz.
    pub fn input_symmetric(&mut self, source: Source, name: &str) -> Symmetric {
        Symmetric(self.input_port(source, name, ["_xx", "_yy", "_zz", "_xy", "_xz", "_yz"]))
    }

    fn input_port<const N: usize>(
        &mut self,
        source: Source,
        name: &str,
        parts: [&str; N],
    ) -> [Operand; N] {
        let nodes = parts
            .map(|part| self.add_node(Kind::Input(source), Vec::new(), format!("{name}{part}")));
        self.inputs.push(Input { name: name.into(), nodes: nodes.into() });
        nodes.map(Operand::of)
    }

    /// An output of one value or some.
    pub fn output(&mut self, name: &str, operands: &[Operand]) {
        self.outputs.push(Output { name: name.into(), operands: operands.into() });
    }

    /// The constant nearest to a value.
    pub fn constant(&mut self, value: f32) -> Operand {
        let kind = Kind::Constant(number::bits(self.precision, value));
        Operand::of(self.shared(kind, Vec::new(), "constant"))
    }

    /// The node of a kind and operands: the one that exists, or a new one.
    fn shared(&mut self, kind: Kind, operands: Vec<Operand>, what: &str) -> NodeId {
        let key = (kind, operands);
        if let Some(&id) = self.known.get(&key) {
            return id;
        }
        let name = self.fresh_name(what);
        let id = self.add_node(kind, key.1.clone(), name);
        self.known.insert(key, id);
        id
    }

    fn operation(&mut self, operation: Operation, operands: Vec<Operand>, what: &str) -> Operand {
        Operand::of(self.shared(Kind::Operation(operation), operands, what))
    }

    /// a + b
    pub fn add(&mut self, a: Operand, b: Operand) -> Operand {
        self.operation(Operation::Add, vec![a, b], "sum")
    }

    /// a - b
    pub fn subtract(&mut self, a: Operand, b: Operand) -> Operand {
        self.operation(Operation::Add, vec![a, b.negated()], "difference")
    }

    /// a * b. The product of the magnitudes is computed, once for all signs, and its sign is the
    /// operands' signs together.
    pub fn multiply(&mut self, a: Operand, b: Operand) -> Operand {
        let negated = a.negated != b.negated;
        let (mut a, mut b) = (a.magnitude(), b.magnitude());
        if a.node > b.node {
            std::mem::swap(&mut a, &mut b);
        }
        let product = self.operation(Operation::Multiply, vec![a, b], "product");
        Operand { negated, ..product }
    }

    /// a / b
    pub fn divide(&mut self, a: Operand, b: Operand) -> Operand {
        self.operation(Operation::Divide, vec![a, b], "quotient")
    }

    /// Square root of a.
    pub fn square_root(&mut self, a: Operand) -> Operand {
        self.operation(Operation::SquareRoot, vec![a], "root")
    }

    /// Sine and cosine of a.
    pub fn sine_cosine(&mut self, a: Operand) -> [Operand; 2] {
        let both = self.operation(Operation::SineCosine, vec![a], "sine_cosine");
        [both, Operand { upper: true, ..both }]
    }

    /// a > b ? a : b
    pub fn maximum(&mut self, a: Operand, b: Operand) -> Operand {
        self.operation(Operation::Maximum, vec![a, b], "maximum")
    }

    /// a < b ? a : b
    pub fn minimum(&mut self, a: Operand, b: Operand) -> Operand {
        self.operation(Operation::Minimum, vec![a, b], "minimum")
    }

    /// a < b, a flag.
    pub fn less(&mut self, a: Operand, b: Operand) -> Operand {
        self.operation(Operation::Less, vec![a, b], "less")
    }

    /// `condition ? a : b`; `condition` is a flag.
    pub fn select(&mut self, condition: Operand, a: Operand, b: Operand) -> Operand {
        self.operation(Operation::Select, vec![condition, a, b], "selected")
    }

    /// Whether `flag` is set and `a` is not zero, a flag.
    pub fn non_zero(&mut self, flag: Operand, a: Operand) -> Operand {
        self.operation(Operation::NonZero, vec![flag, a], "non_zero")
    }

    /// Whether one of two flags is set, a flag.
    pub fn either(&mut self, a: Operand, b: Operand) -> Operand {
        self.operation(Operation::Or, vec![a, b], "either")
    }

    /// Whether both of two flags are set, a flag.
    pub fn both(&mut self, a: Operand, b: Operand) -> Operand {
        self.operation(Operation::And, vec![a, b], "both")
    }

    /// `condition ? maximum(a, b) : c`; `condition` is a flag.
    pub fn maximum_or(&mut self, condition: Operand, [a, b]: [Operand; 2], c: Operand) -> Operand {
        self.operation(Operation::MaximumOr, vec![condition, a, b, c], "maximum")
    }

    /// `condition ? minimum(a, b) : c`; `condition` is a flag.
    pub fn minimum_or(&mut self, condition: Operand, [a, b]: [Operand; 2], c: Operand) -> Operand {
        self.operation(Operation::MinimumOr, vec![condition, a, b, c], "minimum")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_product_is_computed_once_whatever_its_signs() {
        let mut graph = Graph::new(Precision::F32);
        let a = graph.input(Source::Record, "a");
        let b = graph.input(Source::Record, "b");
        let product = graph.multiply(a, b);
        let negative = graph.multiply(b.negated(), a);
        assert_eq!(product.node, negative.node);
        assert!(!product.negated && negative.negated);
        assert_eq!(graph.multiply(a.negated(), b.negated()), product);
    }

    #[test]
    fn names_lead_back_to_the_scope_and_are_unique() {
        let mut graph = Graph::new(Precision::F32);
        let a = graph.input(Source::Record, "a");
        let (one, two) = graph.within("point0", |graph| {
            graph.within("row", |graph| (graph.add(a, a), graph.subtract(a, a)))
        });
        let three =
            graph.within("point0", |graph| graph.within("row", |graph| graph.add(one, two)));
        assert_eq!(graph.node(one.node).name, "point0_row_sum");
        assert_eq!(graph.node(two.node).name, "point0_row_difference");
        assert_eq!(graph.node(three.node).name, "point0_row_sum_2");
    }
}
