//! This file is the one level interrupt: all sources OR-ed, and the UIO driver that waits for it.

/// The interrupt line and the kernel's view of it.
#[derive(Debug, Default)]
pub(crate) struct InterruptLine {
    level: bool,
    /// The kernel masks the line with each event; user space unmasks it.
    masked: bool,
    events: u32,
    /// Rising edges of the line.
    pub(crate) rising_edges: u64,
}

impl InterruptLine {
    /// Sets the level that the sources give.
    pub(crate) fn set(&mut self, level: bool) {
        self.rising_edges += u64::from(level && !self.level);
        self.level = level;
    }

    /// The level that the sources give.
    pub(crate) fn level(&self) -> bool {
        self.level
    }

    /// Whether an event would be delivered.
    pub(crate) fn pending(&self) -> bool {
        self.level && !self.masked
    }

    /// Delivers an event if one is pending: counts it and masks the line.
    pub(crate) fn take(&mut self) -> Option<u32> {
        self.pending().then(|| {
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
        line.set(true);
        assert_eq!(line.take(), Some(1));
        assert_eq!(line.take(), None, "masked");
        line.unmask();
        assert_eq!(line.take(), Some(2), "enabled before it was acknowledged");
        line.set(false);
        line.unmask();
        assert_eq!(line.take(), None);
        assert_eq!(line.rising_edges, 1);
    }
}
