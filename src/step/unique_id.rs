//! Numbers that tell packings and detached steps apart.

use std::sync::atomic::{AtomicU64, Ordering};

/// An id that nothing else in this process has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct UniqueId(u64);

impl UniqueId {
    /// Makes a new id.
    pub(super) fn new() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}
