//! The operators of the hardware library: their Verilog modules and latencies.
//!
//! A latency is the number of register stages of the module in `bitstream-model/rtl/operators`; the
//! check of the operators measures it.

use crate::graph::Operation;

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
}

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
    pub fn operator(self) -> Operator {
        const AB: &[&str] = &["a", "b"];
        const ABC: &[&str] = &["condition", "a", "b", "c"];
        let (module, ports, latency, arithmetic): (_, &[&str], _, _) = match self {
            Self::Add => ("fadd", AB, 7, true),
            Self::Multiply => ("fmul", AB, 5, true),
            Self::Divide => ("fdiv", AB, 29, true),
            Self::SquareRoot => ("fsqrt", &["a"], 27, true),
            Self::SineCosine => ("fsincos", &["a"], 26, true),
            Self::Maximum => ("fmax", AB, 1, false),
            Self::Minimum => ("fmin", AB, 1, false),
            Self::Less => ("fless", AB, 1, false),
            Self::Select => ("fselect", &["condition", "a", "b"], 1, false),
            Self::NonZero => ("fnonzero", &["flag", "a"], 1, false),
            Self::Or => ("flogic_or", AB, 1, false),
            Self::And => ("flogic_and", AB, 1, false),
            Self::MaximumOr => ("fmax_or", ABC, 1, false),
            Self::MinimumOr => ("fmin_or", ABC, 1, false),
        };
        let smallest_normal = matches!(self, Self::Multiply | Self::Divide);
        Operator { module, ports, latency, arithmetic, smallest_normal }
    }
}
