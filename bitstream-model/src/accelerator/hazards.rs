//! Read-after-write hazards of the pipeline: which velocities a collision reads, and when it may
//! enter.
//!
//! A collision reads the velocities of its bodies when it enters and writes them back `window`
//! cycles later. *Interlocked*, it waits until both are written. *Unchecked*, it enters in its
//! issue slot without waiting for write-backs: it reads the velocity that was last written back.
//! Where two write-backs to one body overlap, the later one wins and the earlier impulse is lost.
//! Static bodies never change and are no hazard.

use super::state::Velocity;
use crate::cast::index;
use crate::config::Hazards;

/// A write-back that is under way.
#[derive(Debug, Clone, Copy, Default)]
struct WriteBack {
    bodies: [u32; 2],
    /// Which of the two bodies move; a static body is not written.
    moving: [bool; 2],
    velocities: [Velocity; 2],
}

/// The bodies of a collision that is about to enter.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entry {
    pub(crate) bodies: [u32; 2],
    pub(crate) moving: [bool; 2],
}

/// Hazard bookkeeping of one kind of pass.
#[derive(Debug)]
pub(crate) struct Pipeline {
    hazards: Hazards,
    interval: u64,
    per_issue: u64,
    window: u64,
    /// Interlocked: the cycle from which a body's velocity can be read.
    ready: Vec<u64>,
    /// Unchecked: the issue slot of a body's last use, counted over all passes, from 1.
    last_slot: Vec<u64>,
    slot_base: u64,
    collisions: u64,
    under_way: Vec<WriteBack>,
    retired: u64,
}

impl Pipeline {
    pub(crate) fn new(hazards: Hazards, interval: u32, per_issue: u32) -> Self {
        Self {
            hazards,
            interval: interval.into(),
            per_issue: per_issue.into(),
            window: 0,
            ready: Vec::new(),
            last_slot: Vec::new(),
            slot_base: 0,
            collisions: 0,
            under_way: Vec::new(),
            retired: 0,
        }
    }

    /// A step begins.
    pub(crate) fn start_step(&mut self, bodies: usize) {
        match self.hazards {
            Hazards::Interlocked => {
                self.ready.clear();
                self.ready.resize(bodies, 0);
            }
            Hazards::Unchecked => {
                self.last_slot.clear();
                self.last_slot.resize(bodies, 0);
                self.slot_base = 0;
            }
        }
    }

    /// A pass begins; the previous pass has written everything back.
    pub(crate) fn start_pass(&mut self, window: u64) {
        self.window = window;
        self.collisions = 0;
        self.retired = 0;
        if self.hazards == Hazards::Unchecked {
            // Slots of the previous pass lie at least a window back.
            self.slot_base += 1;
            let depth = self.depth() * self.per_issue;
            self.under_way.clear();
            self.under_way.resize(index(depth), WriteBack::default());
        }
    }

    /// Issue slots from a collision's read to the first slot that sees its write-back.
    pub(super) fn depth(&self) -> u64 {
        self.window.div_ceil(self.interval).max(1)
    }

    /// Interlocked: cycles that the collision has to wait at cycle `now`.
    pub(crate) fn wait(&self, now: u64, entry: &Entry) -> u64 {
        let of = |side: usize| {
            if entry.moving[side] {
                self.ready[entry.bodies[side] as usize].saturating_sub(now)
            } else {
                0
            }
        };
        of(0).max(of(1))
    }

    /// Interlocked: the collision has entered at cycle `now`.
    pub(crate) fn entered(&mut self, now: u64, entry: &Entry) {
        for side in 0..2 {
            if entry.moving[side] {
                self.ready[entry.bodies[side] as usize] = now + self.window;
            }
        }
    }

    /// Unchecked: does the write-backs that are due before the next collision reads. A padding
    /// collision takes its slot too.
    pub(super) fn retire_due(&mut self, velocities: &mut [Velocity]) {
        let slot = self.collisions / self.per_issue;
        let due = slot.saturating_sub(self.depth() - 1) * self.per_issue;
        self.retire_to(due, velocities);
    }

    fn retire_to(&mut self, due: u64, velocities: &mut [Velocity]) {
        while self.retired < due.min(self.collisions) {
            let slot = index(self.retired % self.under_way.len() as u64);
            let entry = self.under_way[slot];
            for side in 0..2 {
                if entry.moving[side] {
                    velocities[entry.bodies[side] as usize] = entry.velocities[side];
                }
            }
            self.retired += 1;
        }
    }

    /// Unchecked: the collision has entered and will write `velocities`. Returns whether it read a
    /// stale velocity.
    pub(super) fn issue(&mut self, entry: &Entry, velocities: [Velocity; 2]) -> bool {
        let slot = self.slot_base + self.collisions / self.per_issue;
        let depth = self.depth();
        let mut stale = false;
        for side in 0..2 {
            if entry.moving[side] {
                let last = &mut self.last_slot[entry.bodies[side] as usize];
                stale |= *last != 0 && slot - *last < depth;
                *last = slot;
            }
        }
        self.put(WriteBack { bodies: entry.bodies, moving: entry.moving, velocities });
        stale
    }

    /// Unchecked: a padding collision has entered.
    pub(super) fn issue_padding(&mut self) {
        self.put(WriteBack::default());
    }

    /// Unchecked: slots pass in which nothing enters.
    pub(super) fn pass_slots(&mut self, slots: u64, velocities: &mut [Velocity]) {
        for _ in 0..slots {
            self.retire_due(velocities);
            (0..self.per_issue).for_each(|_| self.issue_padding());
        }
    }

    fn put(&mut self, write_back: WriteBack) {
        let at = index(self.collisions % self.under_way.len() as u64);
        self.under_way[at] = write_back;
        self.collisions += 1;
    }

    /// Unchecked: the pass has ended; everything is written back.
    pub(super) fn finish_pass(&mut self, velocities: &mut [Velocity]) {
        self.retire_to(self.collisions, velocities);
        self.slot_base += self.collisions / self.per_issue + self.depth();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOVING: [bool; 2] = [true, true];

    fn speed(x: f32) -> Velocity {
        Velocity { linear: [x, 0.0, 0.0], angular: [0.0; 3] }
    }

    #[test]
    fn interlocked_waits_for_the_later_of_both_bodies() {
        let mut pipeline = Pipeline::new(Hazards::Interlocked, 2, 1);
        pipeline.start_step(3);
        pipeline.start_pass(10);
        pipeline.entered(0, &Entry { bodies: [0, 1], moving: MOVING });
        let next = Entry { bodies: [1, 2], moving: MOVING };
        assert_eq!(pipeline.wait(2, &next), 8);
        assert_eq!(pipeline.wait(10, &next), 0);
        let ground = Entry { bodies: [0, 2], moving: [false, true] };
        assert_eq!(pipeline.wait(2, &ground), 0, "a static body is no hazard");
    }

    /// Window of 3 slots: a write-back of slot s is seen from slot s + 3 on.
    #[test]
    fn unchecked_reads_stale_within_the_window_and_the_later_write_back_wins() {
        let mut pipeline = Pipeline::new(Hazards::Unchecked, 2, 1);
        pipeline.start_step(2);
        pipeline.start_pass(6);
        let entry = Entry { bodies: [0, 1], moving: [false, true] };
        let mut velocities = [speed(0.0); 2];
        let mut stale = Vec::new();
        let mut read = Vec::new();
        for slot in 0..5_u8 {
            pipeline.retire_due(&mut velocities);
            read.push(velocities[1].linear[0]);
            stale.push(pipeline.issue(&entry, [speed(0.0), speed(f32::from(slot) + 1.0)]));
        }
        assert_eq!(read, [0.0, 0.0, 0.0, 1.0, 2.0]);
        assert_eq!(stale, [false, true, true, true, true]);
        pipeline.finish_pass(&mut velocities);
        assert_eq!(velocities[1], speed(5.0));
    }

    #[test]
    fn unchecked_is_not_stale_at_exactly_the_depth_nor_in_the_next_pass() {
        let mut pipeline = Pipeline::new(Hazards::Unchecked, 2, 1);
        pipeline.start_step(2);
        let entry = Entry { bodies: [0, 1], moving: [false, true] };
        let mut velocities = [speed(0.0); 2];
        for _ in 0..2 {
            pipeline.start_pass(6);
            pipeline.retire_due(&mut velocities);
            assert!(!pipeline.issue(&entry, [speed(0.0); 2]));
            for _ in 0..2 {
                pipeline.retire_due(&mut velocities);
                pipeline.issue_padding();
            }
            pipeline.retire_due(&mut velocities);
            assert!(!pipeline.issue(&entry, [speed(0.0); 2]));
            pipeline.finish_pass(&mut velocities);
        }
    }
}
