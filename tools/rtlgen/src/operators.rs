//! The operators of the hardware library: their Verilog modules and latencies.
//!
//! A latency is the number of register stages of the module in `bitstream-model/rtl/operators`; the
//! check of the operators measures it.

use pgs_interface::number::Precision;

use crate::graph::Operation;
use crate::number;

/// An operator of the library.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Operator {
    /// Name of the Verilog module, without the prefix `pgs_` of all modules.
    pub module: &'static str,
    /// Names of the module's operand ports, in the order of a node's operands.
    pub ports: &'static [&'static str],
    /// Cycles from the operands to the result.
    pub latency: i32,
    /// Whether the operator is an arithmetic unit of its own in the tables, not a comparison.
    pub arithmetic: bool,
    /// Whether the module has the parameter `SMALLEST_NORMAL`.
    pub smallest_normal: bool,
    /// The value of the module's parameter `WIDTH`, where it is not the default.
    pub set_width: Option<u32>,
}

/// Cycles of the conversion from binary32 to binary16, which no pipeline needs.
pub const FLOAT_TO_HALF: u32 = 3;

/// All operations, in the order of the tables.
pub const ALL: [Operation; 14] = [
    Operation::Add,
    Operation::Multiply,
    Operation::Divide,
    Operation::SquareRoot,
    Operation::SineCosine,
    Operation::Maximum,
    Operation::Minimum,
    Operation::Less,
    Operation::Select,
    Operation::NonZero,
    Operation::Or,
    Operation::And,
    Operation::MaximumOr,
    Operation::MinimumOr,
];

impl Operation {
    /// The operator that carries the operation out.
    #[must_use]
    pub fn operator(self, precision: Precision) -> Operator {
        const AB: &[&str] = &["a", "b"];
        const ABC: &[&str] = &["condition", "a", "b", "c"];
        let half = precision == Precision::Binary16;
        let of = |single, in_half| if half { in_half } else { single };
        let ((module, latency), ports, arithmetic): (_, &[&str], _) = match self {
            Self::Add => (of(("fadd", 7), ("hadd", 5)), AB, true),
            Self::Multiply => (of(("fmul", 5), ("hmul", 5)), AB, true),
            Self::Divide => (of(("fdiv", 29), ("hdiv", 11)), AB, true),
            Self::SquareRoot => (of(("fsqrt", 27), ("hsqrt", 9)), &["a"], true),
            Self::SineCosine => (of(("fsincos", 26), ("hsincos", 12)), &["a"], true),
            Self::Maximum => (("fmax", 1), AB, false),
            Self::Minimum => (("fmin", 1), AB, false),
            Self::Less => (("fless", 1), AB, false),
            Self::Select => (("fselect", 1), &["condition", "a", "b"], false),
            Self::NonZero => (("fnonzero", 1), &["flag", "a"], false),
            Self::Or => (("flogic_or", 1), AB, false),
            Self::And => (("flogic_and", 1), AB, false),
            Self::MaximumOr => (("fmax_or", 1), ABC, false),
            Self::MinimumOr => (("fmin_or", 1), ABC, false),
        };
        let smallest_normal = !half && matches!(self, Self::Multiply | Self::Divide);
        let has_width = !arithmetic && !matches!(self, Self::Or | Self::And);
        let set_width = (half && has_width).then(|| number::width(precision));
        Operator { module, ports, latency, arithmetic, smallest_normal, set_width }
    }
}
