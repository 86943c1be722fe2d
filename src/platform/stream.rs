//! This file holds what the processor is told about its caches: what goes past them, and what will
//! be needed soon.
//!
//! A step's records are written once and next read by the device. Written past the caches they are
//! not read from memory first, and push nothing out that is needed; a copy of a C library does the
//! same above some size. On aarch64, whose buffers may be write-combining memory, plain stores do.
#![allow(unsafe_code, reason = "hints to the caches exist as intrinsics on raw pointers only")]

use bitstream_model::interface::record::Beat;

/// Channels that are written past the caches, while this lives.
#[derive(Debug)]
pub(crate) struct Streamed<'a, 'b>(&'a mut [&'b mut [Beat]]);

impl<'a, 'b> Streamed<'a, 'b> {
    /// Of these channels.
    pub(crate) fn new(channels: &'a mut [&'b mut [Beat]]) -> Self {
        Self(channels)
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    /// Beats `slots` of a channel, to write.
    #[inline]
    pub(crate) fn slots(&mut self, channel: usize, slots: std::ops::Range<usize>) -> Slots<'_> {
        Slots(&mut self.0[channel][slots])
    }

    /// Writes one beat the usual way.
    #[inline]
    pub(crate) fn put(&mut self, channel: usize, slot: usize, beat: Beat) {
        self.0[channel][slot] = beat;
    }
}

impl Drop for Streamed<'_, '_> {
    /// Everything written is in its place before anything that is written later, by whomever.
    fn drop(&mut self) {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: every x86-64 has the instruction.
        unsafe {
            core::arch::x86_64::_mm_sfence();
        }
    }
}

/// Some beats of a channel.
#[derive(Debug)]
pub(crate) struct Slots<'a>(&'a mut [Beat]);

impl Slots<'_> {
    /// Writes them, `S` at a time, past the caches or into them.
    #[inline]
    pub(crate) fn write<const S: usize, const PAST_CACHES: bool>(
        self,
        runs: impl Iterator<Item = [Beat; S]>,
    ) {
        for (to, run) in self.0.as_chunks_mut::<S>().0.iter_mut().zip(runs) {
            for (to, beat) in to.iter_mut().zip(run) {
                if PAST_CACHES {
                    store(to, beat);
                } else {
                    *to = beat;
                }
            }
        }
    }
}

/// Stores a beat past the caches.
#[inline]
fn store(to: &mut Beat, beat: Beat) {
    #[cfg(target_arch = "x86_64")]
    {
        use core::arch::x86_64::{__m128i, _mm_stream_si128};
        let to: *mut __m128i = std::ptr::from_mut(to).cast();
        // SAFETY: `to` comes from a reference to sixteen bytes, aligned to sixteen, that nobody else
        // has; every x86-64 has the instruction. That the store is ordered after those that follow
        // it is ended by the fence of `Streamed`, out of whose borrow of the memory `to` was made:
        // until then nobody else can read it, and the same thread sees its own stores in order.
        unsafe { _mm_stream_si128(to, bytemuck::cast(beat)) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        *to = beat;
    }
}

/// Says that a value will be read soon.
#[inline]
pub(crate) fn prefetch<T>(value: &T) {
    let first: *const i8 = std::ptr::from_ref(value).cast();
    // The lines of its first byte, of every 64th after it, and of its last.
    for byte in (0..size_of::<T>()).step_by(64).chain([size_of::<T>().saturating_sub(1)]) {
        fetch(first.wrapping_add(byte));
    }
}

#[inline]
fn fetch(at: *const i8) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: a prefetch neither reads nor faults, whatever the address.
    unsafe {
        core::arch::x86_64::_mm_prefetch::<{ core::arch::x86_64::_MM_HINT_T0 }>(at);
    }
    #[cfg(target_arch = "aarch64")]
    // SAFETY: a prefetch neither faults nor changes registers, whatever the address.
    unsafe {
        core::arch::asm!("prfm pldl1keep, [{}]", in(reg) at, options(nostack, preserves_flags, readonly));
    }
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    let _ = at;
}
