//! Orders memory accesses of the CPU against accesses of the device.
//!
//! A doorbell must not overtake the stores to the buffers and descriptors that it announces, and no
//! load from a buffer may overtake the load that saw its completion. The DMA cores lie outside the
//! CPU's inner shareable domain, so that on aarch64 the barriers must be of the outer domain, which
//! no `core::sync::atomic::fence` is.
//!
//! Source: Arm ARM (DMB, shareability), Linux `dma_wmb` and `dma_rmb`.
#![allow(unsafe_code, reason = "outer shareable barriers exist as instructions only")]

/// Everything stored before is visible to the device before anything stored after.
pub(crate) fn release_to_device() {
    #[cfg(target_arch = "aarch64")]
    // SAFETY: a barrier touches neither registers nor memory nor the stack; without `nomem` the
    // compiler moves no memory access across it.
    unsafe {
        core::arch::asm!("dmb oshst", options(nostack, preserves_flags));
    }
    #[cfg(not(target_arch = "aarch64"))]
    std::sync::atomic::fence(std::sync::atomic::Ordering::Release);
}

/// Nothing loaded after was read before anything loaded before.
pub(crate) fn acquire_from_device() {
    #[cfg(target_arch = "aarch64")]
    // SAFETY: as in `release_to_device`.
    unsafe {
        core::arch::asm!("dmb oshld", options(nostack, preserves_flags));
    }
    #[cfg(not(target_arch = "aarch64"))]
    std::sync::atomic::fence(std::sync::atomic::Ordering::Acquire);
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};

    #[test]
    fn a_flag_published_after_a_release_shows_the_data_before_it() {
        let data = AtomicU32::new(0);
        let flag = AtomicU32::new(0);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                data.store(7, Ordering::Relaxed);
                super::release_to_device();
                flag.store(1, Ordering::Relaxed);
            });
            while flag.load(Ordering::Relaxed) == 0 {
                std::thread::yield_now();
            }
            super::acquire_from_device();
            assert_eq!(data.load(Ordering::Relaxed), 7);
        });
    }
}
