//! The errors of a file in a folder, with the next step.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use super::dtype;
use super::{Dimensions, ROWS_MAX};

/// The defect of a file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Problem {
    /// The system refuses to read it.
    #[error("cannot be read")]
    Read(#[source] io::Error),
    /// The system refuses to write it.
    #[error("cannot be written")]
    Write(#[source] io::Error),
    /// A folder, a pipe or a device in place of a file.
    #[error("expected a regular file, found {0}")]
    NotAFile(&'static str),
    /// A file, or nothing, in place of a folder.
    #[error("expected a folder of .npy arrays, found {0}")]
    NotAFolder(&'static str),
    /// Another format.
    #[error("expected a .npy file, found {found}: {next}")]
    NotNpy {
        /// The format of the file.
        found: &'static str,
        /// How to convert it to an array.
        next: &'static str,
    },
    /// An unknown version of the format.
    #[error(
        "found version {major}.{minor} of the .npy format, known are 1.0, 2.0 and 3.0: write the \
         array anew with numpy.save"
    )]
    Version {
        /// The first number.
        major: u8,
        /// The second number.
        minor: u8,
    },
    /// A malformed header.
    #[error("malformed .npy header, expected {0}: write the array anew with numpy.save")]
    Header(&'static str),
    /// Elements of another type.
    #[error(
        "expected elements of type {expected}, found {found:?}: {}",
        dtype::advice(found, expected)
    )]
    Type {
        /// The expected type, in `NumPy`'s notation.
        expected: &'static str,
        /// The type in the header.
        found: String,
    },
    /// Fortran order: one column after the other.
    #[error("expected C order, found Fortran order: save numpy.ascontiguousarray(a)")]
    FortranOrder,
    /// A wrong number of dimensions, or a wrong length.
    #[error("expected shape {expected}, found {found}")]
    Shape {
        /// The shape that fits.
        expected: Dimensions,
        /// The shape in the header.
        found: Dimensions,
    },
    /// More rows than any board takes.
    #[error(
        "found shape {found}, which has more rows than any board takes ({limit}): give a smaller \
         step",
        limit = ROWS_MAX
    )]
    TooManyRows {
        /// The shape in the header.
        found: Dimensions,
    },
    /// A file shorter than its shape.
    #[error(
        "expected {expected} bytes of data by its shape {shape}, found {found}, {missing} fewer: \
         is the file cut off?",
        missing = expected - u128::from(*found)
    )]
    TooShort {
        /// The shape in the header.
        shape: Dimensions,
        /// Bytes of data for this shape.
        expected: u128,
        /// Bytes of data in the file.
        found: u64,
    },
    /// A file longer than its shape.
    #[error(
        "expected {expected} bytes of data by its shape {shape}, found {found}, {extra} more: give \
         a file that holds one array alone, with nothing appended to it",
        extra = u128::from(*found) - expected
    )]
    TooLong {
        /// The shape in the header.
        shape: Dimensions,
        /// Bytes of data for this shape.
        expected: u128,
        /// Bytes of data in the file.
        found: u64,
    },
}

/// A refused file, with the reason.
#[derive(Debug, Error)]
#[error("{}", path.display())]
pub struct NpyError {
    /// The file.
    pub path: PathBuf,
    /// The reason.
    #[source]
    pub problem: Problem,
}
