//! The system's allocator, reporting its allocations: for tests that allow none.

use std::alloc::{GlobalAlloc, Layout, System};

/// Calls a function before each allocation and reallocation; the function must not allocate.
pub(crate) struct CountingAllocator(pub(crate) fn());

// SAFETY: every call goes to the system's allocator with its arguments unchanged, and the function
// does not allocate.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        (self.0)();
        // SAFETY: the caller's promises about `layout` are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are passed on; `alloc` took the memory from `System`.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        (self.0)();
        // SAFETY: the caller's promises are passed on; `alloc` took the memory from `System`.
        unsafe { System.realloc(pointer, layout, bytes) }
    }
}
