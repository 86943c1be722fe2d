//! Structures that begin with their size, so that they can grow.
//!
//! A caller that was built with an older header has a smaller structure: the fields that it lacks
//! have their defaults. A caller with a newer header has a larger one: the bytes behind the known
//! fields must be zero, which asks for nothing.

use std::mem::offset_of;
use std::ptr::{self, NonNull};
use std::slice;

use super::overlap::Span;
use super::pointer::checked;
use crate::arrays::{BodyArrays, CollisionArray};
use crate::failure::Failure;
use crate::parameters::Parameters;
use crate::report::Report;

/// More than any structure will ever have: a larger size was never set.
const LARGEST: usize = 4096;

/// A structure that begins with its size.
///
/// # Safety
/// It is `repr(C)`, its first field is the size as a `usize`, it has no padding, every bit pattern
/// is a value of it, and its alignment is that of `usize`.
pub(crate) unsafe trait Growing: Copy {
    /// Its name in messages.
    const NAME: &'static str;
    /// Its size in the first header that had it: no caller has a smaller one.
    const FIRST: usize;
}

// SAFETY: `repr(C)`, a `usize` and 20 numbers of 32 bits.
unsafe impl Growing for Parameters {
    const NAME: &'static str = "zpgs_parameters";
    const FIRST: usize = offset_of!(Self, warm_start);
}
const _: () = assert!(size_of::<Parameters>() == size_of::<usize>() + 20 * 4);

// SAFETY: `repr(C)`, a `usize` and 9 numbers of 64 bits.
unsafe impl Growing for Report {
    const NAME: &'static str = "zpgs_report";
    const FIRST: usize = size_of::<Self>();
}
const _: () = assert!(size_of::<Report>() == size_of::<usize>() + 9 * 8);

// SAFETY: `repr(C)`, two `usize`, six pairs of a raw pointer and a `usize`, a `usize` and three
// numbers of 64 bits.
unsafe impl Growing for BodyArrays {
    const NAME: &'static str = "zpgs_bodies";
    const FIRST: usize = offset_of!(Self, table);
}
const _: () = assert!(size_of::<BodyArrays>() == 15 * size_of::<usize>() + 3 * 8);

// SAFETY: `repr(C)`, two `usize`, two pairs of a raw pointer and a `usize`, a raw pointer and two
// numbers of 32 bits.
unsafe impl Growing for CollisionArray {
    const NAME: &'static str = "zpgs_collisions";
    const FIRST: usize = offset_of!(Self, impulses);
}
const _: () = assert!(size_of::<CollisionArray>() == 7 * size_of::<usize>() + 2 * 4);

/// Checks the size that a caller gives.
fn check_size<T: Growing>(size: usize) -> Result<(), Failure> {
    if (T::FIRST..=LARGEST).contains(&size) && size.is_multiple_of(align_of::<T>()) {
        return Ok(());
    }
    let (name, first) = (T::NAME, T::FIRST);
    Err(Failure::argument(format!(
        "found {size} as the size of {name}, which has {first} bytes or more: set it to \
         sizeof({name})"
    )))
}

/// The size in the first field of a structure, checked.
///
/// # Safety
/// The pointer leads to a `usize` that is initialised.
unsafe fn size_in<T: Growing>(pointer: NonNull<T>) -> Result<usize, Failure> {
    // SAFETY: aligned as a `T`, which begins with a `usize`; the caller promises its memory.
    let size = unsafe { pointer.cast::<usize>().read() };
    check_size::<T>(size).map(|()| size)
}

/// The bytes of a structure: its first field has their number. No bytes for null.
///
/// # Safety
/// As [`read`].
pub(crate) unsafe fn span<T: Growing>(pointer: *const T) -> Span {
    let whole = Span::of(T::NAME, pointer);
    match checked(pointer, T::NAME) {
        // SAFETY: the caller promises the first field.
        Ok(pointer) => unsafe { size_in(pointer) }.map_or(whole, |size| whole.of_size(size)),
        Err(_) => whole,
    }
}

/// Reads a structure; a field that the caller's structure lacks comes from `defaults`.
///
/// # Safety
/// The pointer is null, or leads to initialised bytes, whose number is in their first field and
/// which no other thread writes.
pub(crate) unsafe fn read<T: Growing>(pointer: *const T, defaults: T) -> Result<T, Failure> {
    let pointer = checked(pointer, T::NAME)?;
    // SAFETY: the caller promises the first field.
    let size = unsafe { size_in(pointer) }?;
    let (known, mut value) = (size.min(size_of::<T>()), defaults);
    let (from, to) = (pointer.cast::<u8>().as_ptr(), (&raw mut value).cast::<u8>());
    // SAFETY: the caller promises `size` bytes and `value` has room for a `T`, `known` is at most
    // both; `value` is new and overlaps nothing. Every bit pattern is a `T` (`Growing`).
    unsafe { ptr::copy_nonoverlapping(from, to, known) };
    // SAFETY: `known` is at most `size`, the number of bytes that the caller promises.
    let rest = unsafe { from.add(known) };
    // SAFETY: the rest of the bytes that the caller promises, which nothing writes.
    let unknown = unsafe { slice::from_raw_parts(rest, size - known) };
    if unknown.iter().any(|byte| *byte != 0) {
        return Err(Failure::argument(format!(
            "{} has fields that this library does not know, and they are not zero: set them to \
             zero, or use the library of the header",
            T::NAME
        )));
    }
    Ok(value)
}

/// A structure of the caller's that the library fills in.
#[derive(Debug)]
pub(crate) struct Out<T> {
    /// Aligned, and leads to `size` bytes that this value alone may write.
    pointer: NonNull<T>,
    size: usize,
}

impl<T: Growing> Out<T> {
    /// Checks the structure; `None` for null, where the caller does not want it.
    ///
    /// # Safety
    /// As [`read`], and nothing else reads or writes the bytes before the value ends.
    pub(crate) unsafe fn optional(pointer: *mut T) -> Result<Option<Self>, Failure> {
        if pointer.is_null() {
            return Ok(None);
        }
        let pointer = checked(pointer, T::NAME)?;
        // SAFETY: the caller promises the first field.
        let size = unsafe { size_in(pointer) }?;
        Ok(Some(Self { pointer, size }))
    }

    /// Checks a structure whose size is not yet in it.
    ///
    /// # Safety
    /// The pointer is null, or leads to `size` bytes that nothing else reads or writes before the
    /// value ends.
    pub(crate) unsafe fn of_size(pointer: *mut T, size: usize) -> Result<Self, Failure> {
        let pointer = checked(pointer, T::NAME)?;
        check_size::<T>(size)?;
        Ok(Self { pointer, size })
    }

    /// Its bytes.
    pub(crate) fn span(&self) -> Span {
        Span::of(T::NAME, self.pointer.as_ptr()).of_size(self.size)
    }

    /// Writes the fields that the caller's structure has, its size as it is, and zeros behind the
    /// known fields.
    pub(crate) fn write(self, value: T) {
        let Self { pointer, size } = self;
        let known = size.min(size_of::<T>());
        let (from, to) = ((&raw const value).cast::<u8>(), pointer.cast::<u8>().as_ptr());
        // SAFETY: `pointer` leads to `size` bytes of the caller's, and `known` is at most that and
        // the size of `value`, which is new and overlaps nothing. A `T` has no padding (`Growing`).
        unsafe { ptr::copy_nonoverlapping(from, to, known) };
        // SAFETY: `known` is at most `size`, the length of the memory.
        let rest = unsafe { to.add(known) };
        // SAFETY: the rest of the memory that this value alone may write.
        unsafe { ptr::write_bytes(rest, 0, size - known) };
        // SAFETY: aligned as a `T`, which begins with a `usize`; `check_size` has seen room for it.
        unsafe { pointer.cast::<usize>().write(size) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A structure as a newer header may have it.
    #[repr(C)]
    struct Newer {
        known: Parameters,
        field: u64,
    }

    fn read_newer(newer: &Newer) -> Result<Parameters, Failure> {
        // SAFETY: the size in the structure is its own.
        unsafe { read(ptr::from_ref(newer).cast(), Parameters::default()) }
    }

    #[test]
    fn an_older_structure_has_the_defaults_of_the_fields_that_it_lacks() {
        let known = Parameters {
            size: Parameters::FIRST,
            retries: 3,
            warm_start: 1,
            ..Parameters::default()
        };
        // SAFETY: more bytes than the first field says.
        let read = unsafe { read(&raw const known, Parameters::default()) };
        let read = read.expect("an older structure");
        assert_eq!((read.size, read.retries, read.warm_start), (80, 3, 0));
    }

    #[test]
    fn a_structure_smaller_than_its_first_version_is_refused_by_name() {
        fn refused<T: Growing>(first: usize) {
            assert_eq!(check_size::<T>(first), Ok(()));
            for size in (0..first).step_by(4) {
                let refused = check_size::<T>(size).expect_err("too small");
                let name = T::NAME;
                assert_eq!(refused.status, crate::status::Status::Argument);
                assert!(refused.text.contains(&format!("found {size} as the size of {name}")));
                assert!(refused.text.contains(&format!("sizeof({name})")), "{}", refused.text);
            }
        }
        refused::<Parameters>(80);
        refused::<Report>(80);
        refused::<BodyArrays>(96);
        refused::<CollisionArray>(32);
    }

    #[test]
    fn a_newer_structure_may_ask_for_nothing_unknown() {
        let known = Parameters { size: size_of::<Newer>(), ..Parameters::default() };
        assert_eq!(read_newer(&Newer { known, field: 0 }), Ok(known));
        let refused = read_newer(&Newer { known, field: 1 << 40 }).expect_err("unknown");
        assert!(refused.text.contains("does not know"), "{}", refused.text);
    }

    #[test]
    fn a_size_that_no_header_has_is_refused() {
        for size in [0, 4, 84, 4104, usize::MAX] {
            let known = Parameters { size, ..Parameters::default() };
            let refused = read_newer(&Newer { known, field: 0 }).expect_err("refused");
            assert!(refused.text.contains("sizeof(zpgs_parameters)"), "{}", refused.text);
        }
    }

    #[test]
    fn what_is_written_ends_where_the_callers_structure_ends() {
        let mut older = [u64::MAX; 12];
        // SAFETY: 80 bytes of 96.
        let out = unsafe { Out::<Parameters>::of_size(older.as_mut_ptr().cast(), 80) };
        out.expect("a size").write(Parameters { retries: 7, ..Parameters::default() });
        assert_eq!((older[0], older[9] >> 32, older[10], older[11]), (80, 7, u64::MAX, u64::MAX));

        let mut newer = [u64::MAX; 12];
        // SAFETY: 88 bytes of 96.
        let out = unsafe { Out::<Report>::of_size(newer.as_mut_ptr().cast(), 88) };
        out.expect("a size").write(Report { retries: 5, ..Report::default() });
        assert_eq!((newer[0], newer[9], newer[10], newer[11]), (88, 5, 0, u64::MAX));
    }
}
