//! Recognises files without the magic number of `.npy`.

use super::Problem;

/// Bytes at the beginning of a file that decide.
pub(super) const LOOKED_AT: usize = 10;

const SAVE: &str = "write the array with numpy.save";

/// The format that begins with these bytes, which are the first [`LOOKED_AT`] or all of a shorter
/// file.
pub(super) fn problem(begin: &[u8]) -> Problem {
    let (found, next) = match begin {
        [] => ("an empty file", SAVE),
        [b'P', b'K', 3 | 5, 4 | 6, ..] => (
            "an archive, as .npz is",
            "read it with numpy.load and write each of its arrays with numpy.save",
        ),
        [0x1F, 0x8B, ..] => ("a gzip file", "unpack it"),
        [0x89, b'H', b'D', b'F', ..] => {
            ("a HDF5 file", "read it with h5py and write each array with numpy.save")
        }
        [b'M', b'A', b'T', b'L', b'A', b'B', ..] => {
            ("a MATLAB file", "read it with scipy.io.loadmat and write each array with numpy.save")
        }
        [0x80, 2..=5, ..] => {
            ("a Python pickle", "read it with pickle.load and write the array with numpy.save")
        }
        _ if is_text(begin) => {
            ("text", "read it with numpy.loadtxt and write the array with numpy.save")
        }
        _ => ("other first bytes, as numpy's tofile writes them", SAVE),
    };
    Problem::NotNpy { found, next }
}

/// Whether all of it is text, or a byte order mark of text.
fn is_text(begin: &[u8]) -> bool {
    let printable =
        |byte: &u8| byte.is_ascii_graphic() || matches!(byte, b' ' | b'\t' | b'\r' | b'\n');
    begin.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(begin).iter().all(printable)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_array_is_called_by_its_name() {
        for (begin, name) in [
            (&b""[..], "an empty file"),
            (b"PK\x03\x04\x14\0\0\0\0\0", "an archive"),
            (b"PK\x05\x06\0\0", "an archive"),
            (b"\x1f\x8b\x08\0\0\0\0\0\0\0", "a gzip file"),
            (b"\x89HDF\r\n\x1a\n\0\0", "a HDF5 file"),
            (b"MATLAB 5.0", "a MATLAB file"),
            (b"\x80\x04\x95\x10\0\0\0\0\0\0", "a Python pickle"),
            (b"1.0, -2e3\r", "found text"),
            (b"x", "found text"),
            (b"\xEF\xBB\xBFa;b;c;d", "found text"),
            (&[0; 10], "other first bytes"),
            (b"1.0, \xFFabc", "other first bytes"),
        ] {
            let said = problem(begin).to_string();
            assert!(said.contains(name), "{begin:?}: {said}");
        }
    }
}
