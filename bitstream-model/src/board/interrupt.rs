//! Models the one level interrupt: all sources OR-ed, and the UIO driver that waits for it.

/// The interrupt line and the kernel's view of it.
#[derive(Debug, Default)]
pub(crate) struct InterruptLine {
    /// The level of the sources, and the level that arrives at the processor.
    source: bool,
    level: bool,
    /// Cycle until which a fault withholds a rising edge; `u64::MAX` means until the line falls.
    withheld: Option<u64>,
    /// Interrupts without a source that are still to come.
    spurious: u32,
    /// The kernel masks the line with each event; user space unmasks it.
    masked: bool,
    events: u32,
    /// Rising edges of the line.
    pub(crate) rising_edges: u64,
}

impl InterruptLine {
    /// Whether the level `source` would be a rising edge of the sources.
    pub(crate) fn rises(&self, source: bool) -> bool {
        source && !self.source
    }

    /// Withholds the next edge until cycle `until`.
    pub(crate) fn withhold(&mut self, until: u64) {
        self.withheld = Some(until);
    }

    /// Adds interrupts without a source.
    pub(crate) fn disturb(&mut self, times: u32) {
        self.spurious = self.spurious.saturating_add(times);
    }

    /// Sets the level of the sources.
    pub(crate) fn set(&mut self, source: bool, now: u64) {
        self.source = source;
        if !source || self.withheld.is_some_and(|until| until <= now) {
            self.withheld = None;
        }
        let level = source && self.withheld.is_none();
        self.rising_edges += u64::from(level && !self.level);
        self.level = level;
    }

    /// The cycle at which a withheld level arrives.
    pub(crate) fn next_event(&self) -> Option<u64> {
        self.withheld
    }

    /// The level that arrives at the processor.
    pub(crate) fn level(&self) -> bool {
        self.level
    }

    /// Whether an event would be delivered.
    pub(crate) fn pending(&self) -> bool {
        (self.level || self.spurious > 0) && !self.masked
    }

    /// Delivers an event if one is pending: counts it and masks the line.
    pub(crate) fn take(&mut self) -> Option<u32> {
        self.pending().then(|| {
            if !self.level {
                self.spurious = self.spurious.saturating_sub(1);
            }
            self.masked = true;
            self.events = self.events.wrapping_add(1);
            self.events
        })
    }

    pub(crate) fn unmask(&mut self) {
        self.masked = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_masks_the_line_and_a_level_that_stands_comes_again() {
        let mut line = InterruptLine::default();
        assert_eq!(line.take(), None);
        line.set(true, 0);
        assert_eq!(line.take(), Some(1));
        assert_eq!(line.take(), None, "masked");
        line.unmask();
        assert_eq!(line.take(), Some(2), "enabled before it was acknowledged");
        line.set(false, 0);
        line.unmask();
        assert_eq!(line.take(), None);
        assert_eq!(line.rising_edges, 1);
    }

    #[test]
    fn an_edge_that_is_withheld_comes_late_or_not_at_all() {
        let mut line = InterruptLine::default();
        line.withhold(10);
        line.set(true, 3);
        assert_eq!((line.pending(), line.next_event()), (false, Some(10)));
        line.set(true, 10);
        assert!(line.pending());
        line.set(false, 11);
        line.withhold(u64::MAX);
        line.set(true, 12);
        line.set(true, 1000);
        assert!(!line.pending(), "lost");
        line.set(false, 1001);
        line.set(true, 1002);
        assert!(line.pending(), "the next one arrives");
    }

    #[test]
    fn interrupts_without_a_source_end() {
        let mut line = InterruptLine::default();
        line.disturb(2);
        for _ in 0..2 {
            assert!(line.take().is_some());
            line.unmask();
        }
        assert_eq!((line.take(), line.rising_edges), (None, 0));
        // An interrupt without a source adds to one with a source.
        line.disturb(1);
        line.set(true, 0);
        assert!(line.take().is_some());
        line.set(false, 1);
        line.unmask();
        assert!(line.take().is_some());
    }
}
