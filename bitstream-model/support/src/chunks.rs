//! Splits slices into arrays of one length.
//!
//! The standard library has this as `as_chunks` from Rust 1.88 on.

use std::slice;

/// Slices that can be split into arrays.
pub trait Chunks {
    /// Element of the slice.
    type Item;

    /// All whole arrays of `N` elements, and the elements that are left. `N` is above 0.
    fn split_arrays<const N: usize>(&self) -> (&[[Self::Item; N]], &[Self::Item]);

    /// The same, to be changed.
    fn split_arrays_mut<const N: usize>(&mut self) -> (&mut [[Self::Item; N]], &mut [Self::Item]);
}

impl<T> Chunks for [T] {
    type Item = T;

    #[inline(always)]
    fn split_arrays<const N: usize>(&self) -> (&[[T; N]], &[T]) {
        const { assert!(N > 0, "an array has elements") };
        let count = self.len() / N;
        let (whole, rest) = self.split_at(count * N);
        // SAFETY: `whole` has `count * N` elements, which lie as `count` arrays of `N` do: an array has
        // the alignment of its element, and no gaps. The borrow is that of `whole`.
        (unsafe { slice::from_raw_parts(whole.as_ptr().cast(), count) }, rest)
    }

    #[inline(always)]
    fn split_arrays_mut<const N: usize>(&mut self) -> (&mut [[T; N]], &mut [T]) {
        const { assert!(N > 0, "an array has elements") };
        let count = self.len() / N;
        let (whole, rest) = self.split_at_mut(count * N);
        // SAFETY: as in `split_arrays`; `whole` is borrowed uniquely, and not used otherwise.
        (unsafe { slice::from_raw_parts_mut(whole.as_mut_ptr().cast(), count) }, rest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_arrays_come_first_and_the_rest_is_left() {
        let numbers = [1, 2, 3, 4, 5, 6, 7];
        assert_eq!(numbers.split_arrays::<3>(), (&[[1, 2, 3], [4, 5, 6]][..], &[7][..]));
        assert_eq!(numbers.split_arrays::<7>(), (&[numbers][..], &[][..]));
        let (none, rest) = numbers.split_arrays::<8>();
        assert!(none.is_empty() && rest == numbers);
        let empty: [u8; 0] = [];
        assert!(empty.split_arrays::<2>().0.is_empty());
    }

    #[test]
    fn arrays_are_the_slice_itself() {
        let mut numbers = [1, 2, 3, 4, 5];
        let (pairs, rest) = numbers.split_arrays_mut::<2>();
        pairs[1][0] = 30;
        rest[0] = 50;
        assert_eq!(numbers, [1, 2, 30, 4, 50]);
    }

    #[test]
    fn elements_without_a_size_have_arrays_too() {
        let (pairs, rest) = [(); 5].split_arrays::<2>().to_owned();
        assert_eq!((pairs.len(), rest.len()), (2, 1));
    }
}
