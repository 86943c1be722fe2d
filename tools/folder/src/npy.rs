//! This file reads and writes `.npy` arrays of f32 and u32.
//!
//! Format 1.0, little-endian, C order: what `numpy.save` makes of such arrays.
//!
//! ```text
//! 0        6     8        10              10 + header length
//! \x93NUMPY 1 0  u16 LE   {'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }...\n  data
//! ```
//!
//! A file is untrusted: the shape in its header is held against the expected shape and against the
//! file's length before anything is allocated for it.
//!
//! Written here because the crate `npyz` brings a parser generator and a type system for records,
//! of which two element types are needed.
//!
//! Source: NEP 1, "A Simple File Format for `NumPy` Arrays".

use std::fmt;
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

const MAGIC: &[u8; 6] = b"\x93NUMPY";
/// Bytes before the header: magic, version, header length.
const PREAMBLE: usize = 10;
/// The data begins at a multiple of this.
const ALIGNMENT: usize = 64;
/// More dimensions than any array here has.
const DIMENSIONS_MAX: usize = 8;

/// An element type that a file can hold.
pub trait Element: Copy {
    /// The name in the header.
    const DESCR: &'static str;
    /// The element of those bytes.
    fn from_le(bytes: [u8; 4]) -> Self;
    /// The bytes of the element.
    fn to_le(self) -> [u8; 4];
}

impl Element for f32 {
    const DESCR: &'static str = "<f4";
    fn from_le(bytes: [u8; 4]) -> Self {
        Self::from_le_bytes(bytes)
    }
    fn to_le(self) -> [u8; 4] {
        self.to_le_bytes()
    }
}

impl Element for u32 {
    const DESCR: &'static str = "<u4";
    fn from_le(bytes: [u8; 4]) -> Self {
        Self::from_le_bytes(bytes)
    }
    fn to_le(self) -> [u8; 4] {
        self.to_le_bytes()
    }
}

/// A shape, written as `NumPy` writes it; a dimension that may have any length is `*`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Dimensions(
    /// The length of each; `None` is any.
    pub Vec<Option<usize>>,
);

impl Dimensions {
    fn fit(&self, shape: &[usize]) -> bool {
        self.0.len() == shape.len()
            && self
                .0
                .iter()
                .zip(shape)
                .all(|(expected, found)| expected.is_none_or(|e| e == *found))
    }
}

impl fmt::Display for Dimensions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("(")?;
        for (k, dimension) in self.0.iter().enumerate() {
            if k > 0 {
                f.write_str(", ")?;
            }
            match dimension {
                Some(length) => write!(f, "{length}")?,
                None => f.write_str("*")?,
            }
        }
        f.write_str(if self.0.len() == 1 { ",)" } else { ")" })
    }
}

fn exactly(shape: &[usize]) -> Dimensions {
    Dimensions(shape.iter().map(|length| Some(*length)).collect())
}

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
    /// A folder, a pipe.
    #[error("expected a regular file")]
    NotAFile,
    /// Not the format, or another version of it.
    #[error("expected a .npy file of format 1.0, found {0}: write it with numpy.save")]
    NotNpy(&'static str),
    /// A header that says something else than it should.
    #[error("malformed .npy header, expected {0}: write it with numpy.save")]
    Header(&'static str),
    /// Elements of another type.
    #[error("expected elements of type {expected}, found {found:?}: convert with numpy's astype")]
    Type {
        /// The type, as `NumPy` names it.
        expected: &'static str,
        /// What the header names.
        found: String,
    },
    /// Columns one after the other.
    #[error("expected C order, found Fortran order: convert with numpy.ascontiguousarray")]
    FortranOrder,
    /// Another number of dimensions, or of other lengths.
    #[error("expected shape {expected}, found {found}")]
    Shape {
        /// The shape that fits.
        expected: Dimensions,
        /// That of the header.
        found: Dimensions,
    },
    /// A file longer or shorter than its shape.
    #[error(
        "expected {expected} bytes of data by its shape {shape}, found {found}: is it cut off?"
    )]
    Length {
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

/// Reads an array whose shape fits `expected`.
///
/// Returns the length of its first dimension and its elements in C order.
///
/// # Errors
/// [`NpyError`]: no such file, not an array, or another one than expected.
pub fn read<T: Element>(path: &Path, expected: &Dimensions) -> Result<(usize, Vec<T>), NpyError> {
    read_with(path, expected, open)
}

/// Reads an array as [`read`] does, from what `open` finds under its name: the content, header
/// included, and its length in bytes.
///
/// # Errors
/// As for [`read`], and what `open` returns.
pub fn read_with<T: Element, S: Read>(
    path: &Path,
    expected: &Dimensions,
    open: impl Fn(&Path) -> Result<(S, u64), Problem>,
) -> Result<(usize, Vec<T>), NpyError> {
    open(path)
        .and_then(|(source, length)| decode(source, length, expected))
        .map_err(|problem| NpyError { path: path.to_path_buf(), problem })
}

/// Opens a regular file; with its length in bytes.
pub(crate) fn open(path: &Path) -> Result<(File, u64), Problem> {
    // Asked for before opening, because opening a named pipe would wait for a writer.
    let metadata = std::fs::metadata(path).map_err(Problem::Read)?;
    if !metadata.is_file() {
        return Err(Problem::NotAFile);
    }
    let file = File::open(path).map_err(Problem::Read)?;
    Ok((file, metadata.len()))
}

/// Reads an array of `length` bytes, header included, from `source`.
fn decode<T: Element>(
    mut source: impl Read,
    length: u64,
    expected: &Dimensions,
) -> Result<(usize, Vec<T>), Problem> {
    let mut preamble = [0; PREAMBLE];
    read_exact(&mut source, &mut preamble, "a shorter file")?;
    if !preamble.starts_with(MAGIC) {
        return Err(Problem::NotNpy("other first bytes"));
    }
    if preamble[6..8] != [1, 0] {
        return Err(Problem::NotNpy("another version"));
    }
    let header_length = u16::from_le_bytes([preamble[8], preamble[9]]);
    let mut header = vec![0; usize::from(header_length)];
    read_exact(&mut source, &mut header, "a file that ends within its header")?;
    let Header { descr, fortran_order, shape } = Header::parse(&header)?;

    if descr != T::DESCR {
        return Err(Problem::Type { expected: T::DESCR, found: descr });
    }
    if !expected.fit(&shape) {
        return Err(Problem::Shape { expected: expected.clone(), found: exactly(&shape) });
    }
    // The order of one row or column is both.
    if fortran_order && shape.len() > 1 {
        return Err(Problem::FortranOrder);
    }
    let found = length.saturating_sub(PREAMBLE as u64 + u64::from(header_length));
    let claimed = shape.iter().try_fold(4_u128, |bytes, n| bytes.checked_mul(*n as u128));
    let mismatch = |expected| Problem::Length { shape: exactly(&shape), expected, found };
    let claimed = claimed.ok_or_else(|| mismatch(u128::MAX))?;
    if claimed != u128::from(found) {
        return Err(mismatch(claimed));
    }
    let bytes = usize::try_from(claimed).map_err(|_| mismatch(claimed))?;
    let mut data = vec![0; bytes];
    source.read_exact(&mut data).map_err(Problem::Read)?;
    let elements = data
        .chunks_exact(4)
        .map(|chunk| T::from_le([chunk[0], chunk[1], chunk[2], chunk[3]]))
        .collect();
    Ok((shape.first().copied().unwrap_or(1), elements))
}

fn read_exact(source: &mut impl Read, into: &mut [u8], short: &'static str) -> Result<(), Problem> {
    source.read_exact(into).map_err(|error| match error.kind() {
        io::ErrorKind::UnexpectedEof => Problem::NotNpy(short),
        _ => Problem::Read(error),
    })
}

/// The three entries of a header.
#[derive(Debug)]
struct Header {
    descr: String,
    fortran_order: bool,
    shape: Vec<usize>,
}

impl Header {
    /// Parses the Python dictionary that a header is.
    fn parse(bytes: &[u8]) -> Result<Self, Problem> {
        let text = std::str::from_utf8(bytes).map_err(|_| Problem::Header("ASCII text"))?;
        let mut scan = Scanner(text);
        let (mut descr, mut fortran_order, mut shape) = (None, None, None);
        scan.expect('{', "a dictionary")?;
        while !scan.take('}') {
            let key = scan.string()?;
            scan.expect(':', "a colon after a key")?;
            match key {
                "descr" => descr = Some(scan.string()?.to_owned()),
                "fortran_order" => fortran_order = Some(scan.boolean()?),
                "shape" => shape = Some(scan.tuple()?),
                _ => return Err(Problem::Header("the keys descr, fortran_order and shape only")),
            }
            if !scan.take(',') {
                scan.expect('}', "a comma or the dictionary's end")?;
                break;
            }
        }
        if !scan.0.trim().is_empty() {
            return Err(Problem::Header("spaces after the dictionary"));
        }
        Ok(Self {
            descr: descr.ok_or(Problem::Header("the key descr"))?,
            fortran_order: fortran_order.ok_or(Problem::Header("the key fortran_order"))?,
            shape: shape.ok_or(Problem::Header("the key shape"))?,
        })
    }
}

/// What is left of the text.
struct Scanner<'a>(&'a str);

impl<'a> Scanner<'a> {
    fn take(&mut self, token: char) -> bool {
        let rest = self.0.trim_start().strip_prefix(token);
        self.0 = rest.unwrap_or(self.0);
        rest.is_some()
    }

    fn expect(&mut self, token: char, what: &'static str) -> Result<(), Problem> {
        if self.take(token) { Ok(()) } else { Err(Problem::Header(what)) }
    }

    fn string(&mut self) -> Result<&'a str, Problem> {
        let wrong = Problem::Header("a quoted string");
        let quote = if self.take('\'') {
            '\''
        } else if self.take('"') {
            '"'
        } else {
            return Err(wrong);
        };
        let (string, rest) = self.0.split_once(quote).ok_or(wrong)?;
        self.0 = rest;
        Ok(string)
    }

    fn boolean(&mut self) -> Result<bool, Problem> {
        for (word, value) in [("True", true), ("False", false)] {
            if let Some(rest) = self.0.trim_start().strip_prefix(word) {
                self.0 = rest;
                return Ok(value);
            }
        }
        Err(Problem::Header("True or False"))
    }

    fn tuple(&mut self) -> Result<Vec<usize>, Problem> {
        let mut lengths = Vec::new();
        self.expect('(', "a tuple as shape")?;
        while !self.take(')') {
            let text = self.0.trim_start();
            let digits = text.bytes().take_while(u8::is_ascii_digit).count();
            let (number, rest) = text.split_at(digits);
            let length =
                number.parse().map_err(|_| Problem::Header("lengths below 2^64 in the shape"))?;
            self.0 = rest;
            if lengths.len() == DIMENSIONS_MAX {
                return Err(Problem::Header("at most eight dimensions"));
            }
            lengths.push(length);
            if !self.take(',') {
                self.expect(')', "a comma or the tuple's end")?;
                break;
            }
        }
        Ok(lengths)
    }
}

/// Writes `elements` as an array of `shape`, whose product is their number.
///
/// # Errors
/// [`NpyError`]: the file cannot be written.
pub fn write<T: Element>(
    path: &Path,
    shape: &[usize],
    elements: impl Iterator<Item = T>,
) -> Result<(), NpyError> {
    let inner = || {
        let mut file = io::BufWriter::new(File::create(path)?);
        encode(&mut file, shape, elements)?;
        file.flush()
    };
    inner().map_err(|error| NpyError { path: path.to_path_buf(), problem: Problem::Write(error) })
}

/// Writes an array into a file that is open.
///
/// # Errors
/// Whatever keeps the file from being written.
pub fn encode<T: Element>(
    file: &mut impl Write,
    shape: &[usize],
    elements: impl Iterator<Item = T>,
) -> io::Result<()> {
    let shape = exactly(shape);
    let mut header =
        format!("{{'descr': '{}', 'fortran_order': False, 'shape': {shape}, }}", T::DESCR);
    while !(PREAMBLE + header.len() + 1).is_multiple_of(ALIGNMENT) {
        header.push(' ');
    }
    header.push('\n');
    let length = u16::try_from(header.len()).map_err(io::Error::other)?;
    file.write_all(MAGIC)?;
    file.write_all(&[1, 0])?;
    file.write_all(&length.to_le_bytes())?;
    file.write_all(header.as_bytes())?;
    for element in elements {
        file.write_all(&element.to_le())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rows(n: usize) -> Dimensions {
        Dimensions(vec![None, Some(n)])
    }

    fn encoded(shape: &[usize], elements: &[f32]) -> Vec<u8> {
        let mut bytes = Vec::new();
        encode(&mut bytes, shape, elements.iter().copied()).expect("a vector takes all bytes");
        bytes
    }

    fn decoded<T: Element>(
        bytes: &[u8],
        expected: &Dimensions,
    ) -> Result<(usize, Vec<T>), Problem> {
        decode(bytes, bytes.len() as u64, expected)
    }

    fn with_header(header: &str, data: &[u8]) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend([1, 0]);
        bytes.extend(u16::try_from(header.len()).expect("a short header").to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        bytes
    }

    #[test]
    fn a_file_is_what_numpy_writes() {
        // The layout of the golden vectors' files: header padded with spaces to 128 bytes.
        let mut expected = b"\x93NUMPY\x01\x00\x76\x00{'descr': '<f4', 'fortran_order': False, \
            'shape': (1, 3), }"
            .to_vec();
        expected.resize(127, b' ');
        expected.push(b'\n');
        expected.extend([0, 0, 0x80, 0x3f, 0, 0, 0, 0x80, 0, 0, 0x20, 0x40]);
        assert_eq!(encoded(&[1, 3], &[1.0, -0.0, 2.5]), expected);
    }

    #[test]
    fn a_wrong_shape_says_both_shapes() {
        let problem = decoded::<f32>(&encoded(&[1, 3], &[0.0; 3]), &rows(4)).expect_err("refused");
        assert_eq!(problem.to_string(), "expected shape (*, 4), found (1, 3)");
        let problem = decoded::<f32>(&encoded(&[3], &[0.0; 3]), &rows(4)).expect_err("refused");
        assert_eq!(problem.to_string(), "expected shape (*, 4), found (3,)");
    }

    #[test]
    fn a_wrong_type_says_both_types() {
        let problem = decoded::<u32>(&encoded(&[1, 3], &[0.0; 3]), &rows(3)).expect_err("refused");
        assert!(problem.to_string().starts_with("expected elements of type <u4, found \"<f4\""));
    }

    #[test]
    fn a_huge_shape_is_held_against_the_length_before_memory_is_taken() {
        for shape in ["(4000000000000000, 3)", "(18446744073709551615, 3)"] {
            let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}}}");
            let problem = decoded::<f32>(&with_header(&header, &[0; 12]), &rows(3));
            assert!(matches!(problem, Err(Problem::Length { found: 12, .. })), "{problem:?}");
        }
    }

    #[test]
    fn every_truncation_and_every_extra_byte_is_refused() {
        let whole = encoded(&[2, 3], &[1.0; 6]);
        for length in 0..whole.len() {
            decoded::<f32>(&whole[..length], &rows(3)).expect_err("cut off");
        }
        let mut longer = whole;
        longer.push(0);
        decoded::<f32>(&longer, &rows(3)).expect_err("one byte too many");
    }

    #[test]
    fn malformed_headers_are_refused() {
        for header in [
            "",
            "{",
            "{}",
            "[]",
            "{'descr': '<f4'}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (0, 3)",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (0, 3)} x",
            "{'descr': '<f4', 'fortran_order': no, 'shape': (0, 3)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (-1, 3)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (, 3)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (0 3)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (0,3,0,3,0,3,0,3,0)}",
            "{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (0, 3)}",
            "{'descr': '<f4', 'fortran_order': False, 'shape': (0, 3), 'x': 1}",
            "{'descr: 0}",
        ] {
            let problem = decoded::<f32>(&with_header(header, &[]), &rows(3)).expect_err(header);
            assert!(matches!(problem, Problem::Header(_)), "{header}: {problem}");
        }
        let fortran = "{'descr': '<f4', 'fortran_order': True, 'shape': (0, 3)}";
        let problem = decoded::<f32>(&with_header(fortran, &[]), &rows(3)).expect_err(fortran);
        assert!(matches!(problem, Problem::FortranOrder));
    }

    #[test]
    fn a_missing_file_and_a_folder_are_named() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let missing = folder.path().join("params.npy");
        let error = read::<f32>(&missing, &rows(3)).expect_err("missing");
        assert!(error.to_string().ends_with("params.npy"));
        let error = read::<f32>(folder.path(), &rows(3)).expect_err("a folder");
        assert!(matches!(error.problem, Problem::NotAFile));
    }

    proptest! {
        #[test]
        fn arrays_survive_a_round_trip(bits in proptest::collection::vec(any::<u32>(), 0..64)) {
            let elements: Vec<f32> = bits.iter().map(|b| f32::from_bits(*b)).collect();
            let bytes = encoded(&[elements.len(), 1], &elements);
            let (n, back) = decoded::<f32>(&bytes, &rows(1)).expect("its own file");
            prop_assert_eq!(n, bits.len());
            prop_assert_eq!(back.iter().map(|f| f.to_bits()).collect::<Vec<_>>(), bits);
        }

        #[test]
        fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..256)) {
            let _ = decoded::<f32>(&bytes, &rows(3));
        }

        #[test]
        fn arbitrary_headers_never_panic(header in "[{}(), :'\"descrfotan_hp<f40-9]{0,90}") {
            let _ = decoded::<f32>(&with_header(&header, &[0; 12]), &rows(3));
        }

        #[test]
        fn corrupted_files_never_panic(at in 0_usize..150, to in any::<u8>()) {
            let mut bytes = encoded(&[2, 3], &[1.0; 6]);
            let at = at % bytes.len();
            bytes[at] = to;
            let _ = decoded::<f32>(&bytes, &rows(3));
        }
    }
}
