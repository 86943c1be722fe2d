//! Prefetches values that a packing loop reads soon.
#![allow(unsafe_code, reason = "hints to the caches exist as intrinsics on raw pointers only")]

/// Bytes of a line of a cache.
const LINE: usize = 64;

/// Prefetches all cache lines of a value.
#[inline(always)]
pub(crate) fn prefetch<T>(value: &T) {
    prefetch_at(std::slice::from_ref(value), 0);
}

/// Prefetches all cache lines of one of these values. An index past the end is harmless.
#[inline(always)]
pub(crate) fn prefetch_at<T>(values: &[T], at: usize) {
    let bytes = values.as_ptr().wrapping_add(at).cast::<u8>();
    fetch::<0>(bytes);
    if size_of::<T>() > LINE {
        fetch::<LINE>(bytes);
    }
    // A value that is aligned to its size lies in one line.
    if align_of::<T>() < size_of::<T>() {
        fetch::<0>(bytes.wrapping_add(size_of::<T>() - 1));
    }
    const { assert!(size_of::<T>() <= 2 * LINE, "no line is left out") };
}

/// Prefetches the cache line at an address and an offset. Any address is allowed.
#[inline(always)]
fn fetch<const OFFSET: usize>(at: *const u8) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: every x86-64 has the instruction. The address is a hint: nothing is loaded from it
    // into a register or stored, and no address faults, mapped or not.
    unsafe {
        use core::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(at.wrapping_add(OFFSET).cast());
    }
    #[cfg(target_arch = "aarch64")]
    // SAFETY: every aarch64 has the instruction. The address is a hint: no register, flag or memory
    // is changed, and no address faults, mapped or not.
    unsafe {
        core::arch::asm!(
            "prfm pldl1keep, [{}, {}]", in(reg) at, const OFFSET,
            options(nostack, preserves_flags, nomem)
        );
    }
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    let _ = at;
}
