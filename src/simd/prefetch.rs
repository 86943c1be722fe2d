//! Prefetches values that a packing loop reads soon.
#![allow(unsafe_code, reason = "hints to the caches exist as intrinsics on raw pointers only")]

/// Prefetches a value.
#[inline(always)]
pub(crate) fn prefetch<T>(value: &T) {
    lines_of(std::ptr::from_ref(value));
}

/// Prefetches one of these values. An index past the end is harmless.
#[inline(always)]
pub(crate) fn soon_alone<T>(values: &[T], at: usize) {
    lines_of(values.as_ptr().wrapping_add(at));
}

/// Prefetches `N` of these values from index `at` on. The line of the last byte may be left out:
/// the caller prefetches the values after it next, and few lines are prefetched twice.
#[inline(always)]
pub(crate) fn soon_with_those_behind<const N: usize, T>(values: &[T], at: usize) {
    first_lines_of::<FIRST, [T; N]>(values.as_ptr().wrapping_add(at).cast());
}

/// Prefetches as [`soon_with_those_behind`] does, but into the second cache, for values that are
/// read later.
#[inline(always)]
pub(crate) fn later_with_those_behind<const N: usize, T>(values: &[T], at: usize) {
    first_lines_of::<SECOND, [T; N]>(values.as_ptr().wrapping_add(at).cast());
}

/// Prefetches all cache lines of a value. Any address is allowed.
#[inline(always)]
fn lines_of<T>(value: *const T) {
    first_lines_of::<FIRST, T>(value);
    fetch(value.cast::<u8>().wrapping_add(size_of::<T>().saturating_sub(1)));
}

/// Prefetches into cache `CACHE` the lines at every 64th byte of a value. The line of its last byte
/// is left out if it holds no such byte.
#[inline(always)]
fn first_lines_of<const CACHE: usize, T>(value: *const T) {
    for line in 0..size_of::<T>().div_ceil(LINE) {
        fetch_into::<CACHE, _>(value.cast::<u8>().wrapping_add(line * LINE));
    }
}

/// Bytes of a line of a cache.
const LINE: usize = 64;

/// Prefetches the cache line at an address. Any address is allowed.
#[inline(always)]
pub(crate) fn fetch<T>(at: *const T) {
    fetch_into::<FIRST, T>(at);
}

/// The caches that a prefetch can fill, the innermost first.
const FIRST: usize = 1;
const SECOND: usize = 2;

/// Prefetches the cache line at an address into cache `CACHE`.
#[inline(always)]
fn fetch_into<const CACHE: usize, T>(at: *const T) {
    const { assert!(CACHE == FIRST || CACHE == SECOND, "there is a hint for either") };
    let at: *const i8 = at.cast();
    #[cfg(target_arch = "x86_64")]
    {
        use core::arch::x86_64::{_MM_HINT_T0, _MM_HINT_T1, _mm_prefetch};
        match CACHE {
            // SAFETY: every x86-64 has PREFETCHT0. The address is a hint: nothing is loaded from it
            // into a register or stored, and no address faults, mapped or not.
            FIRST => unsafe { _mm_prefetch::<_MM_HINT_T0>(at) },
            // SAFETY: every x86-64 has PREFETCHT1. The address is a hint: nothing is loaded from it
            // into a register or stored, and no address faults, mapped or not.
            _ => unsafe { _mm_prefetch::<_MM_HINT_T1>(at) },
        }
    }
    #[cfg(target_arch = "aarch64")]
    // SAFETY: every aarch64 has PRFM for the first and the second cache, and `CACHE` is 1 or 2. The
    // address is a hint: no register, flag or memory is changed, and no address faults, mapped or
    // not.
    unsafe {
        core::arch::asm!(
            "prfm pldl{}keep, [{}]", const CACHE, in(reg) at,
            options(nostack, preserves_flags, nomem)
        );
    }
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    let _ = at;
}
