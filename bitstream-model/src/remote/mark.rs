//! A mark behind the memory tells a file that a board made for its memory from every other file.
//!
//! ```text
//! byte 0              the memory, whole pages of 64 KiB
//! byte L, its length  the mark, 4 KiB:   0 "PGSMEMRY"   8 L, little endian   16 zeros
//! ```

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt as _;

/// Length of the mark, bytes.
pub const MARK_BYTES: u64 = 1 << 12;

const MAGIC: [u8; 8] = *b"PGSMEMRY";

/// Length of the memory in a file, bytes; `None` if no board has made the file, or if its length
/// has changed since.
///
/// # Errors
/// The kernel's, if the file cannot be read.
pub fn memory_bytes(file: &File) -> io::Result<Option<u64>> {
    let Some(bytes) = file.metadata()?.len().checked_sub(MARK_BYTES) else { return Ok(None) };
    let mut found = [0; 16];
    file.read_exact_at(&mut found, bytes)?;
    Ok((found == begin(bytes)).then_some(bytes))
}

/// Marks a file as `bytes` bytes of memory, and sets its length.
pub(super) fn write(file: &File, bytes: u64) -> io::Result<()> {
    file.write_all_at(&begin(bytes), bytes)?;
    file.set_len(bytes + MARK_BYTES)
}

/// The first bytes of a mark.
fn begin(bytes: u64) -> [u8; 16] {
    let mut begin = [0; 16];
    begin[..8].copy_from_slice(&MAGIC);
    begin[8..].copy_from_slice(&bytes.to_le_bytes());
    begin
}
