//! What is wrong with a file of a folder, and what to do about it.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use super::dtype;
use super::{Dimensions, ROWS_MAX};

/// What is wrong with a file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Problem {
    /// The system refuses to read it.
    #[error("cannot be read")]
    Read(#[source] io::Error),
    /// The system refuses to write it.
    #[error("cannot be written")]
    Write(#[source] io::Error),
    /// A folder, a pipe, a device.
    #[error("expected a regular file, found {0}")]
    NotAFile(&'static str),
    /// A file, or nothing, in place of a folder.
    #[error("expected a folder of .npy arrays, found {0}")]
    NotAFolder(&'static str),
    /// Another format.
    #[error("expected a .npy file, found {found}: {next}")]
    NotNpy {
        /// What the file is.
        found: &'static str,
        /// How to make an array of it.
        next: &'static str,
    },
    /// A version of the format that nobody has described yet.
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
    /// A header that says something else than it should.
    #[error("malformed .npy header, expected {0}: write the array anew with numpy.save")]
    Header(&'static str),
    /// Elements of another type.
    #[error(
        "expected elements of type {expected}, found {found:?}: {}",
        dtype::advice(found, expected)
    )]
    Type {
        /// The type, as `NumPy` names it.
        expected: &'static str,
        /// What the header names.
        found: String,
    },
    /// Columns one after the other.
    #[error("expected C order, found Fortran order: save numpy.ascontiguousarray(a)")]
    FortranOrder,
    /// Another number of dimensions, or of other lengths.
    #[error("expected shape {expected}, found {found}")]
    Shape {
        /// The shape that fits.
        expected: Dimensions,
        /// That of the header.
        found: Dimensions,
    },
    /// More rows than any board takes.
    #[error(
        "found shape {found}, which has more rows than any board takes ({limit}): give a smaller \
         step",
        limit = ROWS_MAX
    )]
    TooManyRows {
        /// That of the header.
        found: Dimensions,
    },
    /// A file shorter than its shape.
    #[error(
        "expected {expected} bytes of data by its shape {shape}, found {found}, {missing} fewer: is \
         the file cut off?",
        missing = expected - u128::from(*found)
    )]
    TooShort {
        /// That of the header.
        shape: Dimensions,
        /// Bytes of data of that shape.
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
        /// That of the header.
        shape: Dimensions,
        /// Bytes of data of that shape.
        expected: u128,
        /// Bytes of data in the file.
        found: u64,
    },
}

/// A file that cannot be taken, and why.
#[derive(Debug, Error)]
#[error("{}", path.display())]
pub struct NpyError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    #[source]
    pub problem: Problem,
}
