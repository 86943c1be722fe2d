//! The order in which the collisions of a step issue: that of the issue queue, or that of the
//! stream. It is the same in every pass, so that it is found once a step.

use crate::accelerator::Accelerator;
use crate::accelerator::hazards::Entry;
use crate::accelerator::queue::Queue;
use crate::cast::register;

/// The slots of a pass through the issue queue.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Slots {
    /// All of them: filling, issues and idle ones.
    pub(super) all: u64,
    pub(super) idle: u64,
    /// Behind the one in which the last collision of the stream enters.
    pub(super) draining: u64,
    /// Collisions that met a hazard.
    pub(super) hazards: u64,
}

/// The order of a step.
#[derive(Debug)]
pub(super) struct Order {
    queue: Queue,
    queued: bool,
    /// The numbers of the collisions as they issue.
    pub(super) numbers: Vec<u32>,
    entered: usize,
    /// The slot that decides behind the last entry.
    last_entry: u64,
    slots: Slots,
}

impl Order {
    pub(super) fn new(depth: u32) -> Self {
        let (queue, numbers, slots) = (Queue::new(depth), Vec::new(), Slots::default());
        Self { queue, queued: false, numbers, entered: 0, last_entry: 0, slots }
    }

    /// A step begins.
    pub(super) fn begin(&mut self, accelerator: &Accelerator) {
        self.numbers.clear();
        (self.entered, self.slots) = (0, Slots::default());
        self.queued = accelerator.is_queued();
        if self.queued {
            self.queue.start_step(accelerator.velocities.len(), accelerator.queue_window());
            self.queue.start_pass();
        }
    }

    /// The next collision of the stream comes; padding has no entry. Returns the number of the one
    /// that issues, if one does.
    #[inline]
    pub(super) fn enter(&mut self, entry: Option<Entry>) -> Option<u32> {
        let number = register(self.entered);
        self.entered += 1;
        if !self.queued {
            self.numbers.push(number);
            return Some(number);
        }
        self.slots.all += u64::from(self.queue.fills());
        self.queue.enter(entry);
        self.last_entry = self.queue.slot();
        if self.queue.is_full() { self.leave() } else { None }
    }

    /// The number of the next collision that issues after all have come.
    #[inline]
    pub(super) fn leave(&mut self) -> Option<u32> {
        let issued = if self.queued { self.queue.issue() } else { None }?;
        self.slots.all += 1 + issued.idle;
        self.slots.idle += issued.idle;
        self.slots.hazards += u64::from(issued.hazard);
        self.slots.draining = self.queue.slot() - self.last_entry;
        self.numbers.push(issued.number);
        Some(issued.number)
    }

    /// The slots of each pass; `None` in the order of the stream.
    pub(super) fn slots(&self) -> Option<Slots> {
        self.queued.then_some(self.slots)
    }
}
