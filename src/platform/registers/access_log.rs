//! Keeps the last register accesses of a board, for the report of a fault.
//!
//! A ring of fixed length: an access costs a clock reading and no allocation.

use std::fmt;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::map::{Decoded, RegisterMap};

/// Number of accesses in the ring.
const KEPT: usize = 64;

/// The direction of a register access.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AccessKind {
    /// It was read.
    Read,
    /// It was written.
    Write,
}

/// One access to a register. As text: `dma2 S2MM DMASR -> 0x00011002 Idle IOC_Irq ...`, with `<-`
/// for a write.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct RegisterAccess {
    /// Time of the access on the host's clock, since the board was opened.
    pub at: Duration,
    /// Whether it was read or written.
    pub kind: AccessKind,
    /// Offset in its region, bytes.
    pub offset: u32,
    /// The value that was read or written.
    pub value: u32,
    pub(crate) map: RegisterMap,
}

impl fmt::Display for RegisterAccess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let arrow = match self.kind {
            AccessKind::Read => "->",
            AccessKind::Write => "<-",
        };
        Decoded { map: self.map, at: self.offset, arrow, value: self.value }.fmt(f)
    }
}

/// The last accesses, oldest first from `next` on once the ring is full.
#[derive(Debug)]
struct Ring {
    accesses: [Option<RegisterAccess>; KEPT],
    next: usize,
}

/// The last accesses to all regions of a board.
#[derive(Debug)]
pub(crate) struct AccessLog {
    opened: Instant,
    ring: Mutex<Ring>,
}

impl Default for AccessLog {
    fn default() -> Self {
        let ring = Ring { accesses: [None; KEPT], next: 0 };
        Self { opened: Instant::now(), ring: Mutex::new(ring) }
    }
}

impl AccessLog {
    /// Notes an access, in place of the oldest.
    pub(crate) fn note(&self, map: RegisterMap, kind: AccessKind, offset: u32, value: u32) {
        let at = self.opened.elapsed();
        // A panic elsewhere leaves a ring that is whole.
        let mut ring = self.ring.lock().unwrap_or_else(PoisonError::into_inner);
        let next = ring.next;
        ring.accesses[next] = Some(RegisterAccess { at, kind, offset, value, map });
        ring.next = (next + 1) % KEPT;
    }

    /// The last accesses, oldest first.
    pub(crate) fn recent(&self) -> Vec<RegisterAccess> {
        let ring = self.ring.lock().unwrap_or_else(PoisonError::into_inner);
        let (newer, older) = ring.accesses.split_at(ring.next);
        older.iter().chain(newer).copied().flatten().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_accesses_are_kept_oldest_first() {
        let log = AccessLog::default();
        let values = |log: &AccessLog| -> Vec<_> {
            log.recent().iter().map(|access| access.value).collect()
        };
        for value in 0..3 {
            log.note(RegisterMap::Dma(1), AccessKind::Write, 0x10, value);
        }
        assert_eq!(values(&log), [0, 1, 2]);
        for value in 3..100 {
            log.note(RegisterMap::Dma(1), AccessKind::Write, 0x10, value);
        }
        assert_eq!(values(&log), (36..100).collect::<Vec<_>>());
        assert!(log.recent().is_sorted_by_key(|access| access.at));
    }

    #[test]
    fn an_access_is_told_with_its_register() {
        let log = AccessLog::default();
        log.note(RegisterMap::Control, AccessKind::Read, 0, 6);
        log.note(RegisterMap::Dma(0), AccessKind::Write, 0x40, 0x80);
        let lines: Vec<_> = log.recent().iter().map(ToString::to_string).collect();
        assert_eq!(
            lines,
            ["control AP_CTRL -> 0x00000006 ap_done ap_idle", "dma0 S2MM TAILDESC <- 0x00000080"]
        );
    }
}
