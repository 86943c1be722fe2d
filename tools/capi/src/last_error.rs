//! Keeps the texts of failed calls, as C strings.

use std::cell::RefCell;
use std::ffi::{CStr, CString, c_char};
use std::ptr;

thread_local! {
    /// The text of the last failed call of a thread without an accelerator.
    static TEXT: RefCell<CString> = RefCell::default();
}

const EMPTY: &CStr = c"";

/// A text for C. A text with a null byte in it ends there.
pub(crate) fn c_string(text: String) -> CString {
    let mut bytes = text.into_bytes();
    if let Some(end) = bytes.iter().position(|byte| *byte == 0) {
        bytes.truncate(end);
    }
    // No null byte is left.
    CString::new(bytes).unwrap_or_default()
}

/// Keeps the text of a failed call without an accelerator, for the thread that made it.
pub(crate) fn set(text: String) {
    let text = c_string(text);
    // A thread that ends has no text any more; nothing reads it.
    let _ = TEXT.try_with(|kept| {
        if let Ok(mut kept) = kept.try_borrow_mut() {
            *kept = text;
        }
    });
}

/// The text of this thread; it stays until the next failed call without an accelerator.
pub(crate) fn get() -> *const c_char {
    let kept = TEXT.try_with(|kept| kept.try_borrow().map_or(ptr::null(), |text| text.as_ptr()));
    kept.ok().filter(|text| !text.is_null()).unwrap_or(EMPTY.as_ptr())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_null_byte_ends_a_text() {
        assert_eq!(c_string("to\0be".to_owned()).as_c_str(), c"to");
        assert_eq!(c_string(String::new()).as_c_str(), c"");
    }
}
