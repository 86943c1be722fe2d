//! Vectors of three values, in the specification's order of evaluation.

use super::{Graph, Operand};

/// Three values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Vec3(pub [Operand; 3]);

impl Vec3 {
    /// The vector with its signs inverted.
    #[must_use]
    pub fn negated(self) -> Self {
        Self(self.0.map(Operand::negated))
    }

    /// The vector where `flag` is 1, else (-0, -0, -0).
    #[must_use]
    pub fn only_if(self, flag: Operand) -> Self {
        Self(self.0.map(|value| value.only_if(flag)))
    }
}

/// A symmetric matrix: xx, yy, zz, xy, xz, yz.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Symmetric(pub [Operand; 6]);

impl Graph {
    fn by_axis(&mut self, combine: impl Fn(&mut Self, usize) -> Operand) -> Vec3 {
        Vec3([0, 1, 2].map(|axis| combine(self, axis)))
    }

    /// a + b
    pub fn add3(&mut self, a: Vec3, b: Vec3) -> Vec3 {
        self.by_axis(|graph, axis| graph.add(a.0[axis], b.0[axis]))
    }

    /// a - b
    pub fn subtract3(&mut self, a: Vec3, b: Vec3) -> Vec3 {
        self.by_axis(|graph, axis| graph.subtract(a.0[axis], b.0[axis]))
    }

    /// a * s
    pub fn scale(&mut self, a: Vec3, s: Operand) -> Vec3 {
        self.by_axis(|graph, axis| graph.multiply(a.0[axis], s))
    }

    /// `(a.x*b.x + a.y*b.y) + a.z*b.z`
    pub fn dot(&mut self, a: Vec3, b: Vec3) -> Operand {
        self.within("dot", |graph| {
            let [x, y, z] = [0, 1, 2].map(|axis| graph.multiply(a.0[axis], b.0[axis]));
            let xy = graph.add(x, y);
            graph.add(xy, z)
        })
    }

    /// `((xx*v.x + xy*v.y) + xz*v.z, (xy*v.x + yy*v.y) + yz*v.z, (xz*v.x + yz*v.y) + zz*v.z)`
    pub fn times(&mut self, v: Vec3, Symmetric([xx, yy, zz, xy, xz, yz]): Symmetric) -> Vec3 {
        let rows = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        self.by_axis(|graph, axis| graph.dot(Vec3(rows[axis]), v))
    }

    /// `a.y*b.z - a.z*b.y` and so on.
    pub fn cross(&mut self, a: Vec3, b: Vec3) -> Vec3 {
        self.within("cross", |graph| {
            graph.by_axis(|graph, axis| {
                let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
                let plus = graph.multiply(a.0[next], b.0[last]);
                let minus = graph.multiply(a.0[last], b.0[next]);
                graph.subtract(plus, minus)
            })
        })
    }

    /// `v * (1 / sqrt(dot(v,v)))`
    pub fn unit(&mut self, v: Vec3) -> Vec3 {
        let square = self.dot(v, v);
        let length = self.square_root(square);
        let one = self.constant(1.0);
        let scale = self.divide(one, length);
        self.scale(v, scale)
    }
}

#[cfg(test)]
mod tests {
    use pgs_interface::number::Precision;

    use super::super::{Graph, Operand, Operation, Source};
    use super::Vec3;

    /// The value of an operand; an input has that of its place among the nodes.
    fn value(graph: &Graph, inputs: &[f32], operand: &Operand) -> f32 {
        let node = graph.node(operand.node);
        let read = |port: usize| value(graph, inputs, &node.operands[port]);
        let number = match node.kind.operation() {
            Some(Operation::Add) => read(0) + read(1),
            Some(Operation::Multiply) => read(0) * read(1),
            _ => inputs[operand.node.index()],
        };
        if operand.negated { -number } else { number }
    }

    /// The sums of each component associate to the left: 10^8 - 10^8 + 1 is 1, and 0 in another
    /// order.
    #[test]
    fn a_matrix_multiplies_by_its_rows_from_the_left() {
        let mut graph = Graph::new(Precision::F32);
        let v = graph.input3(Source::Record, "v");
        let matrix = graph.input_symmetric(Source::Record, "k");
        let Vec3(product) = graph.times(v.negated(), matrix);
        for (inputs, expected) in [
            (
                [1.0, 100.0, 10_000.0, 1.0, 2.0, 3.0, 10.0, 20.0, 30.0],
                [-201_001.0_f32, -300_210.0, -33_020.0],
            ),
            ([1.0, 1.0, 1.0, 1e8, 1e8, 1.0, -1e8, 1.0, 1.0], [-1.0, -1.0, -3.0]),
        ] {
            let found = product.each_ref().map(|sum| value(&graph, &inputs, sum));
            assert_eq!(found.map(f32::to_bits), expected.map(f32::to_bits), "{found:?}");
        }
    }
}
