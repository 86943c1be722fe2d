//! The hand-written Verilog, as part of the program.

/// A hand-written module.
#[derive(Debug, Clone, Copy)]
pub struct Source {
    /// Name of the file.
    pub name: &'static str,
    /// Text of the file.
    pub text: &'static str,
}

macro_rules! sources {
    ($($folder:literal: $($name:literal),+;)*) => {
        &[$($(Source {
            name: concat!($name, ".v"),
            text: include_str!(concat!(
                env!("CARGO_MANIFEST_DIR"), "/../../bitstream-model/rtl/", $folder, $name, ".v"
            )),
        }),+),*]
    };
}

/// Every hand-written module, each after the modules that it is made of.
pub const ALL: &[Source] = sources! {
    "operators/": "fadd", "fmul", "fdiv", "fsqrt", "horner", "fsincos", "fbelow", "fmax", "fmin",
        "fless", "fselect", "fnonzero", "flogic_or";
    "memory/": "pipeline_register", "timed_flag", "delay", "fifo", "simple_dual_port", "true_dual_port";
    "stream/": "word_sum", "receiver", "sender";
    "step/": "constants", "loader", "body_shapes", "integrator", "step_sequence";
    "pass/": "finder", "issue", "impulses", "impulse_sum";
    "": "core", "control_block", "pgs_top";
};
