//! Reads environment variables; a blank one counts as unset.

use std::ffi::OsString;

/// Names the board.
pub const BOARD: &str = "PGS_BOARD";
/// Names the DMA memory.
pub const MEMORY: &str = "PGS_MEMORY";
/// Names the FPGA manager.
pub const MANAGER: &str = "PGS_MANAGER";
/// Names the simulator that is the accelerator of an emulated board.
pub const RTL: &str = "PGS_RTL";
/// Sets the filter of the log.
pub const LOG: &str = "RUST_LOG";

/// Reads a variable of this process.
pub fn variable(name: &str) -> Option<OsString> {
    std::env::var_os(name).filter(|text| !is_blank(text))
}

/// Whether a text holds nothing but white space.
pub fn is_blank(text: &OsString) -> bool {
    text.to_str().is_some_and(|text| text.trim().is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::ffi::OsStringExt;

    #[test]
    fn white_space_is_blank_and_what_is_no_text_is_not() {
        for (text, blank) in
            [("", true), (" ", true), ("\t\n ", true), ("x", false), (" x ", false)]
        {
            assert_eq!(is_blank(&text.into()), blank, "{text:?}");
        }
        assert!(!is_blank(&OsString::from_vec(vec![b' ', 0xFF])));
    }
}
