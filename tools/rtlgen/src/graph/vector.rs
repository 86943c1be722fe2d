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
