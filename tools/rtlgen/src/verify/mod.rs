//! Checks of the hardware against references that share no code with it.

use std::io;
use std::path::PathBuf;
use std::process::ExitStatus;

pub mod half;
pub mod operators;
pub mod reference;
pub mod simulation;
pub mod sincos;
pub mod vectors;
pub mod verilator;

/// Why a check could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A tool is not installed.
    #[error("{tool} is not installed, and {purpose} needs it")]
    Missing {
        /// Name of the tool's program.
        tool: &'static str,
        /// The work that needs it.
        purpose: &'static str,
    },
    /// Verilator refuses the Verilog, or the C++ compiler what Verilator made of it.
    #[error("the simulator cannot be built ({status}):\n{output}")]
    Build {
        /// How Verilator ended.
        status: ExitStatus,
        /// Its messages and the compiler's.
        output: String,
    },
    /// The temporary folder has a path that `make` does not take.
    #[error(
        "Verilator's makefiles do not work in {}: set TMPDIR to a folder whose path has letters, \
         digits and . _ - + , @ alone",
        folder.display()
    )]
    Place {
        /// The folder.
        folder: PathBuf,
    },
    /// Two files of a design are one, or one is the program's output.
    #[error(
        "{} and {} are one file: name another folder, or redirect the output elsewhere",
        path.display(),
        other.display()
    )]
    OneFile {
        /// A file of the design.
        path: PathBuf,
        /// Another one, `/dev/stdout` or `/dev/stderr`.
        other: PathBuf,
    },
    /// A file, a program or a pipe.
    #[error("cannot {act}")]
    Io {
        /// The act that failed.
        act: &'static str,
        /// Why it failed.
        source: io::Error,
    },
    /// The simulator ended before it had given every result.
    #[error("the simulator ended after {results} of {vectors} results ({status})")]
    Ended {
        /// Results that it gave.
        results: u64,
        /// Vectors that it was to take.
        vectors: u64,
        /// How it ended.
        status: ExitStatus,
    },
}

impl Error {
    /// The map from an error of `act`, for `map_err`.
    pub(crate) fn io(act: &'static str) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { act, source }
    }
}
