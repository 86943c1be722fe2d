//! Reads and writes `.npy` arrays of f32 and u32.
//!
//! Little-endian, C order. It writes format 1.0, as `numpy.save` does for such arrays; it also
//! reads 2.0 and 3.0, whose header length has four bytes.
//!
//! ```text
//! 0        6     8        10              10 + header length
//! \x93NUMPY 1 0  u16 LE   {'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }...\n  data
//! ```
//!
//! A file is untrusted: the shape in its header is compared with the expected shape, with the limit
//! of any board and with the file's length before memory is allocated for it.
//!
//! The crate `npyz` would bring a parser generator and a type system for records; a step needs two
//! element types only.
//!
//! Source: NEP 1, "A Simple File Format for `NumPy` Arrays".

mod dtype;
mod foreign;
mod header;
mod problem;

pub use problem::{NpyError, Problem};

use std::fmt;
use std::fs::{File, Metadata};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::FileTypeExt;
use std::path::Path;

use self::foreign::LOOKED_AT;
use self::header::Header;

const MAGIC: &[u8; 6] = b"\x93NUMPY";
/// Magic and version.
const VERSION_END: usize = 8;
/// Bytes before the header of a written file: magic, version, header length.
const PREAMBLE: usize = 10;
/// The data begins at a multiple of this.
const ALIGNMENT: usize = 64;
/// No array of a step has a longer header.
const HEADER_MAX: u32 = u16::MAX as u32;

/// Bytes of an element.
const ELEMENT_BYTES: usize = 4;

/// Most rows of an array: no board takes more bodies or collisions.
pub const ROWS_MAX: usize = 1 << 20;

/// An element type that a file can hold.
pub trait Element: Copy {
    /// The name in the header.
    const DESCR: &'static str;
    /// Decodes an element.
    fn from_le(bytes: [u8; 4]) -> Self;
    /// Encodes an element.
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

/// A shape in `NumPy`'s notation; `*` is a dimension of any length.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Dimensions(
    /// The length of each dimension; `None` is any.
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

    /// Whether an array without rows fits. `NumPy` gives it the shape (0,), because no row tells
    /// its length.
    fn may_be_empty(&self) -> bool {
        matches!(self.0.first(), Some(None | Some(0)))
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

/// Reads an array whose shape fits `expected`.
///
/// Returns the length of its first dimension and its elements in C order.
///
/// # Errors
///
/// [`NpyError`]: the file is missing, is no array, or is another array than expected.
pub fn read<T: Element>(path: &Path, expected: &Dimensions) -> Result<(usize, Vec<T>), NpyError> {
    read_with(path, expected, open)
}

/// Reads an array as [`read`] does, from the stream that `open` returns for its name, with the
/// length in bytes.
///
/// # Errors
///
/// As for [`read`], and the errors of `open`.
pub fn read_with<T: Element, S: Read>(
    path: &Path,
    expected: &Dimensions,
    open: impl Fn(&Path) -> Result<(S, u64), Problem>,
) -> Result<(usize, Vec<T>), NpyError> {
    open(path)
        .and_then(|(source, length)| decode(source, length, expected))
        .map_err(|problem| NpyError { path: path.to_path_buf(), problem })
}

/// Reads row `row` of an array whose shape fits `expected`, and no other row.
///
/// # Errors
/// As for [`read`].
pub fn read_row<T: Element>(
    path: &Path,
    expected: &Dimensions,
    row: usize,
) -> Result<Vec<T>, NpyError> {
    open(path)
        .and_then(|(mut file, length)| {
            let array = Array::begin::<T>(&mut file, length, expected)?;
            let elements = array.elements.checked_div(array.rows).unwrap_or(0);
            let skipped = i64::try_from(row * elements * ELEMENT_BYTES).unwrap_or(i64::MAX);
            file.seek(SeekFrom::Current(skipped)).map_err(Problem::Read)?;
            elements_of(file, elements)
        })
        .map_err(|problem| NpyError { path: path.to_path_buf(), problem })
}

/// Opens a regular file; returns it with its length in bytes.
pub(crate) fn open(path: &Path) -> Result<(File, u64), Problem> {
    // Checked before opening, because opening a named pipe would wait for a writer.
    let metadata = std::fs::metadata(path).map_err(Problem::Read)?;
    if !metadata.is_file() {
        return Err(Problem::NotAFile(kind(&metadata)));
    }
    let file = File::open(path).map_err(Problem::Read)?;
    Ok((file, metadata.len()))
}

/// The kind of a file that is not regular.
pub(crate) fn kind(metadata: &Metadata) -> &'static str {
    let kind = metadata.file_type();
    if kind.is_dir() {
        "a folder"
    } else if kind.is_fifo() {
        "a named pipe"
    } else if kind.is_socket() {
        "a socket"
    } else if kind.is_char_device() || kind.is_block_device() {
        "a device"
    } else {
        "a file"
    }
}

/// Decodes an array of `length` bytes, header included, from `source`.
fn decode<T: Element>(
    mut source: impl Read,
    length: u64,
    expected: &Dimensions,
) -> Result<(usize, Vec<T>), Problem> {
    let array = Array::begin::<T>(&mut source, length, expected)?;
    Ok((array.rows, elements_of(source, array.elements)?))
}

/// Reads the next elements of a file, whose length is checked.
fn elements_of<T: Element>(mut source: impl Read, count: usize) -> Result<Vec<T>, Problem> {
    let mut data = vec![0; count * ELEMENT_BYTES];
    source.read_exact(&mut data).map_err(Problem::Read)?;
    let elements = data.chunks_exact(ELEMENT_BYTES);
    Ok(elements.map(|bytes| T::from_le([bytes[0], bytes[1], bytes[2], bytes[3]])).collect())
}

/// An array whose header was read and accepted.
#[derive(Debug, Clone, Copy)]
struct Array {
    /// The length of its first dimension.
    rows: usize,
    /// The number of elements; the file has all of them.
    elements: usize,
}

impl Array {
    /// Reads the header of a file of `length` bytes; `source` is then at the beginning of the data.
    fn begin<T: Element>(
        source: &mut impl Read,
        length: u64,
        expected: &Dimensions,
    ) -> Result<Self, Problem> {
        let (header, begin) = read_header(source)?;
        let Header { descr, fortran_order, shape } = header;
        let found = length.saturating_sub(begin);
        // The type of an array without elements does not matter; but objects are pickled even then.
        let empty = shape.contains(&0) && descr != dtype::OBJECT;
        if !empty && descr != T::DESCR {
            return Err(Problem::Type { expected: T::DESCR, found: descr });
        }
        let fits = expected.fit(&shape) || (shape == [0] && expected.may_be_empty());
        if !fits {
            return Err(Problem::Shape { expected: expected.clone(), found: exactly(&shape) });
        }
        let rows = shape.first().copied().unwrap_or(1);
        if rows > ROWS_MAX {
            return Err(Problem::TooManyRows { found: exactly(&shape) });
        }
        // One row or one column has the same layout in both orders.
        if fortran_order && !empty && shape.len() > 1 {
            return Err(Problem::FortranOrder);
        }
        let product = |sum: u128, n: &usize| sum.checked_mul(*n as u128);
        let claimed = shape.iter().try_fold(ELEMENT_BYTES as u128, product).unwrap_or(u128::MAX);
        match claimed.cmp(&u128::from(found)) {
            std::cmp::Ordering::Greater => {
                Err(Problem::TooShort { shape: exactly(&shape), expected: claimed, found })
            }
            std::cmp::Ordering::Less => {
                Err(Problem::TooLong { shape: exactly(&shape), expected: claimed, found })
            }
            std::cmp::Ordering::Equal => Ok(Self { rows, elements: shape.iter().product() }),
        }
    }
}

/// Reads a header and the offset of the data.
fn read_header(source: &mut impl Read) -> Result<(Header, u64), Problem> {
    let mut begin = [0; LOOKED_AT];
    let read = read_up_to(source, &mut begin)?;
    let begin = &begin[..read];
    let cut_off = Problem::NotNpy {
        found: "a file that ends within its header",
        next: "write the array anew with numpy.save",
    };
    if !begin.starts_with(MAGIC) {
        let cut = !begin.is_empty() && MAGIC.starts_with(begin);
        return Err(if cut { cut_off } else { foreign::problem(begin) });
    }
    let &[_, _, _, _, _, _, major, minor, low, high] = begin else { return Err(cut_off) };
    let mut rest = [0; 2];
    let (length, preamble) = match (major, minor) {
        (1, 0) => (u32::from(u16::from_le_bytes([low, high])), VERSION_END + 2),
        (2 | 3, 0) => {
            if read_up_to(source, &mut rest)? < rest.len() {
                return Err(cut_off);
            }
            (u32::from_le_bytes([low, high, rest[0], rest[1]]), VERSION_END + 4)
        }
        _ => return Err(Problem::Version { major, minor }),
    };
    if length > HEADER_MAX {
        return Err(Problem::Header("at most 65535 bytes of it"));
    }
    let mut header = vec![0; length as usize];
    if read_up_to(source, &mut header)? < header.len() {
        return Err(cut_off);
    }
    Ok((Header::parse(&header)?, preamble as u64 + u64::from(length)))
}

/// Reads until `into` is full or the source ends; returns the number of bytes.
fn read_up_to(source: &mut impl Read, into: &mut [u8]) -> Result<usize, Problem> {
    let mut read = 0;
    while read < into.len() {
        match source.read(&mut into[read..]) {
            Ok(0) => break,
            Ok(more) => read += more,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(Problem::Read(error)),
        }
    }
    Ok(read)
}

/// Writes an array into an open file.
///
/// # Errors
///
/// The file cannot be written.
pub fn encode<T: Element>(
    file: &mut impl Write,
    shape: &[usize],
    elements: impl Iterator<Item = T>,
) -> io::Result<()> {
    let shape = exactly(shape);
    let mut header =
        format!("{{'descr': '{}', 'fortran_order': False, 'shape': {shape}, }}", T::DESCR);
    let end = (PREAMBLE + header.len() + 1).next_multiple_of(ALIGNMENT);
    header.extend(std::iter::repeat_n(' ', end - PREAMBLE - header.len() - 1));
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
mod tests;
