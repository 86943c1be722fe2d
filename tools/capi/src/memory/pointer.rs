//! Single addresses: the handle, texts, dense arrays.

use std::ffi::{CStr, c_char};
use std::ptr::NonNull;
use std::slice;

use crate::failure::Failure;

/// The address, if it is neither null nor misaligned.
pub(super) fn checked<T>(pointer: *const T, name: &str) -> Result<NonNull<T>, Failure> {
    let pointer = NonNull::new(pointer.cast_mut()).ok_or_else(|| Failure::null(name))?;
    match pointer.is_aligned() {
        true => Ok(pointer),
        false => Err(misaligned(name, pointer.addr().get(), align_of::<T>())),
    }
}

/// The failure of an address that is no multiple of the alignment.
pub(super) fn misaligned(name: &str, address: usize, alignment: usize) -> Failure {
    Failure::argument(format!(
        "the address of the {name} is {address:#x}: give a multiple of {alignment}"
    ))
}

/// The accelerator behind a handle.
///
/// # Safety
/// The pointer is null, or [`open_into`] has given it and [`close`] has not had it; no other thread
/// closes it before the reference ends.
pub(crate) unsafe fn handle<'a, T>(pointer: *const T) -> Result<&'a T, Failure> {
    let pointer = checked(pointer, "accelerator")?;
    // SAFETY: not null and aligned, as checked. The box of `open_into` lives until `close`, which
    // the caller has not called. References to a handle are shared: nothing makes an exclusive one.
    Ok(unsafe { pointer.as_ref() })
}

/// Opens an accelerator and stores its handle, or null where that fails.
///
/// # Safety
/// `out` is null, or leads to memory for a pointer that no other thread reads or writes.
pub(crate) unsafe fn open_into<T>(
    out: *mut *mut T,
    open: impl FnOnce() -> Result<T, Failure>,
) -> Result<(), Failure> {
    let out = checked(out, "handle to store")?;
    // SAFETY: not null and aligned, as checked; the caller promises memory for a pointer.
    unsafe { out.write(std::ptr::null_mut()) };
    let opened = Box::new(open()?);
    // SAFETY: as above.
    unsafe { out.write(Box::into_raw(opened)) };
    Ok(())
}

/// Stores a value; null does nothing.
///
/// # Safety
/// `out` is null, or leads to memory for a value that no other thread reads or writes.
pub(crate) unsafe fn store<T>(out: *mut T, name: &str, value: T) -> Result<(), Failure> {
    if out.is_null() {
        return Ok(());
    }
    let out = checked(out, name)?;
    // SAFETY: not null and aligned, as checked; the caller promises memory for a value.
    unsafe { out.write(value) };
    Ok(())
}

/// Closes an accelerator; null does nothing.
///
/// # Safety
/// As [`handle`], and no other call uses the handle now or later.
pub(crate) unsafe fn close<T>(pointer: *mut T) -> Result<(), Failure> {
    if !pointer.is_null() {
        let pointer = checked(pointer, "accelerator")?;
        // SAFETY: `open_into` took the pointer out of a box, and the caller closes it once.
        drop(unsafe { Box::from_raw(pointer.as_ptr()) });
    }
    Ok(())
}

/// A text that ends with a null byte.
///
/// # Safety
/// The pointer is null, or leads to bytes that end with a null byte; nothing writes them before the
/// reference ends.
pub(crate) unsafe fn text<'a>(pointer: *const c_char, name: &str) -> Result<&'a str, Failure> {
    let pointer = checked(pointer, name)?;
    // SAFETY: not null, as checked; the caller promises the null byte and that nothing writes.
    let text = unsafe { CStr::from_ptr(pointer.as_ptr()) };
    text.to_str().map_err(|error| {
        Failure::argument(format!("the {name} is not UTF-8 behind byte {}", error.valid_up_to()))
    })
}

/// A dense array of `count` elements. Its address may be null if there is no element.
///
/// # Safety
/// The pointer is null, or leads to `count` elements that are initialised; nothing writes them
/// before the reference ends. Every bit pattern is a `T`.
pub(crate) unsafe fn slice<'a, T: Copy>(
    pointer: *const T,
    count: usize,
    name: &str,
) -> Result<&'a [T], Failure> {
    if count == 0 {
        return Ok(&[]);
    }
    let pointer = checked(pointer, name)?;
    extent(pointer.addr().get(), size_of::<T>(), size_of::<T>(), count, name)?;
    // SAFETY: not null and aligned, and its bytes are within the address space, as checked; the
    // caller promises the elements and that nothing writes.
    Ok(unsafe { slice::from_raw_parts(pointer.as_ptr(), count) })
}

/// Checks that `count` elements of `size` bytes, `stride` bytes apart, end within the address
/// space.
pub(super) fn extent(
    address: usize,
    stride: usize,
    size: usize,
    count: usize,
    name: &str,
) -> Result<(), Failure> {
    let last = count.saturating_sub(1).checked_mul(stride);
    let bytes = last.and_then(|last| last.checked_add(size));
    let fits = bytes.is_some_and(|bytes| {
        isize::try_from(bytes).is_ok() && address.checked_add(bytes).is_some()
    });
    match fits {
        true => Ok(()),
        false => Err(Failure::argument(format!(
            "{count} elements of the {name} exceed the address space: correct their number or \
             stride"
        ))),
    }
}
