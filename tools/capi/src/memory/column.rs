//! Strided arrays of the caller's memory.

use std::ptr::NonNull;

use zynq_pgs::scene::Real;

use super::overlap::Span;
use super::pointer::{extent, misaligned};
use crate::arrays::{Strided, StridedConst};
use crate::failure::Failure;

/// One strided array.
///
/// Invariant: for every index below the count it was made with, `first` plus the index times the
/// stride is aligned and leads to an element in the caller's memory.
#[derive(Debug)]
pub(super) struct Column<T> {
    name: &'static str,
    pub(super) first: NonNull<T>,
    pub(super) stride: usize,
}

impl<T: Copy> Column<T> {
    /// Checks the address, the stride and the extent of an array.
    ///
    /// # Safety
    /// `data` is null or leads to `count` elements, `stride` bytes apart, which live as long as the
    /// column is in use. Every bit pattern is a `T`.
    pub(super) unsafe fn new(
        data: StridedConst,
        count: usize,
        name: &'static str,
    ) -> Result<Self, Failure> {
        let StridedConst { data, stride } = data;
        if count == 0 {
            return Ok(Self { name, first: NonNull::dangling(), stride: 0 });
        }
        let first = NonNull::new(data.cast_mut()).ok_or_else(|| Failure::null(name))?.cast::<T>();
        if !first.is_aligned() {
            return Err(misaligned(name, first.addr().get(), align_of::<T>()));
        }
        if stride < size_of::<T>() || !stride.is_multiple_of(align_of::<T>()) {
            return Err(Failure::argument(format!(
                "the stride of the {name} is {stride} bytes: give a multiple of {}, at least {}",
                align_of::<T>(),
                size_of::<T>()
            )));
        }
        extent(first.addr().get(), stride, size_of::<T>(), count, name)?;
        Ok(Self { name, first, stride })
    }

    /// Its bytes.
    pub(super) fn span(&self, count: usize) -> Span {
        Span::new::<T>(self.name, self.first.addr().get(), self.stride, count)
    }

    /// The address of an element.
    ///
    /// # Safety
    /// `index` is below the count.
    unsafe fn at(&self, index: usize) -> NonNull<T> {
        // SAFETY: the element is in the caller's memory (the invariant), and the offset to it does
        // not overflow: `extent` has checked the last one.
        unsafe { self.first.byte_add(index * self.stride) }
    }

    /// An element.
    ///
    /// # Safety
    /// `index` is below the count, the element is initialised, and no other thread writes it.
    pub(super) unsafe fn get(&self, index: usize) -> T {
        // SAFETY: the caller promises the index.
        let element = unsafe { self.at(index) };
        // SAFETY: aligned and in the caller's memory (the invariant), and initialised; nothing
        // writes it.
        unsafe { element.read() }
    }

    /// Replaces an element.
    ///
    /// # Safety
    /// `index` is below the count, and nothing else reads or writes the element.
    pub(super) unsafe fn set(&mut self, index: usize, value: T) {
        // SAFETY: the caller promises the index.
        let element = unsafe { self.at(index) };
        // SAFETY: aligned and in the caller's memory (the invariant), which is writable and which
        // nothing else reads or writes.
        unsafe { element.write(value) };
    }
}

impl From<Strided> for StridedConst {
    fn from(Strided { data, stride }: Strided) -> Self {
        Self { data, stride }
    }
}

/// A strided array of `N` numbers an element, of 32 or of 64 bits.
#[derive(Debug)]
pub(super) enum Numbers<const N: usize> {
    Single(Column<[f32; N]>),
    Double(Column<[f64; N]>),
}

impl<const N: usize> Numbers<N> {
    /// Checks the array; `size` is the number of bytes of a number.
    ///
    /// # Safety
    /// As [`Column::new`].
    pub(super) unsafe fn new(
        array: Strided,
        count: usize,
        size: usize,
        name: &'static str,
    ) -> Result<Self, Failure> {
        let array = array.into();
        match size {
            // SAFETY: the caller promises the array; floats take every bit pattern.
            0 | 4 => Ok(Self::Single(unsafe { Column::new(array, count, name) }?)),
            // SAFETY: the caller promises the array; doubles take every bit pattern.
            8 => Ok(Self::Double(unsafe { Column::new(array, count, name) }?)),
            _ => Err(Failure::argument(format!(
                "found {size} as the number_size of zpgs_bodies: give 4 for float or 8 for double"
            ))),
        }
    }

    /// Its bytes.
    pub(super) fn span(&self, count: usize) -> Span {
        match self {
            Self::Single(column) => column.span(count),
            Self::Double(column) => column.span(count),
        }
    }

    /// An element, relative to `origin`.
    ///
    /// # Safety
    /// As [`Column::get`].
    pub(super) unsafe fn get(&self, index: usize, origin: [f64; N]) -> [f32; N] {
        match self {
            Self::Single(column) => {
                // SAFETY: the caller promises that the index is below the count and that nothing
                // writes.
                Real::relative(unsafe { column.get(index) }, origin.map(Real::single))
            }
            // SAFETY: the caller promises that the index is below the count and that nothing
            // writes.
            Self::Double(column) => Real::relative(unsafe { column.get(index) }, origin),
        }
    }

    /// Stores a result, which is relative to `origin`.
    ///
    /// # Safety
    /// As [`Column::set`].
    pub(super) unsafe fn set(&mut self, index: usize, results: [f32; N], origin: [f64; N]) {
        match self {
            Self::Single(column) => {
                // SAFETY: the caller promises that the index is below the count and that nothing else
                // uses the element.
                let mut kept = unsafe { column.get(index) };
                Real::store(&mut kept, results, origin.map(Real::single));
                // SAFETY: the caller promises that the index is below the count and that nothing
                // else uses the element.
                unsafe { column.set(index, kept) };
            }
            Self::Double(column) => {
                // SAFETY: the caller promises that the index is below the count and that nothing
                // else uses the element.
                let mut kept = unsafe { column.get(index) };
                Real::store(&mut kept, results, origin);
                // SAFETY: the caller promises that the index is below the count and that nothing
                // else uses the element.
                unsafe { column.set(index, kept) };
            }
        }
    }
}
