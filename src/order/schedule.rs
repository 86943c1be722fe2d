//! Holds an order: the collision of each entry, and the empty entries.

use super::interleave::interleave;
use crate::scene::{Collision, Collisions, Impulses, Structures};

/// The value of an empty entry. No collision has this index, because the number of collisions is
/// smaller.
pub(super) const EMPTY: u32 = u32::MAX;

/// The order in which collisions enter the pipeline.
///
/// One entry a collision, `per_issue` of them an issue slot; an empty entry is sent as a collision
/// without contact points. A caller's collision without contact points is left out, or its entry is
/// empty.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Schedule {
    pub(super) entries: Vec<u32>,
    pub(super) empty: usize,
}

impl Schedule {
    /// Number of entries, empty ones included.
    #[must_use]
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether the schedule has no entries.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Number of entries with a collision.
    #[must_use]
    pub fn collisions(&self) -> usize {
        self.entries.len() - self.empty
    }

    /// Number of empty entries.
    #[must_use]
    pub fn empty(&self) -> usize {
        self.empty
    }

    /// The collision in an entry; `None` if the entry is empty or does not exist.
    #[must_use]
    #[inline]
    pub fn get(&self, entry: usize) -> Option<usize> {
        let index = *self.entries.get(entry)?;
        if index == EMPTY { None } else { usize::try_from(index).ok() }
    }

    /// The collision of each entry, `None` where it is empty.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Option<u32>> + '_ {
        self.entries.iter().map(|index| if *index == EMPTY { None } else { Some(*index) })
    }

    /// Keeps the order and leaves out its empty entries.
    pub(super) fn drop_empty(&mut self) {
        if self.empty > 0 {
            self.entries.retain(|index| *index != EMPTY);
            self.empty = 0;
        }
    }

    /// Interleaves `count` collisions, with or without contact points.
    pub(crate) fn interleave(&mut self, count: usize) {
        self.empty = 0;
        self.entries.resize(count, EMPTY);
        interleave(&mut self.entries);
    }

    pub(super) fn clear(&mut self) {
        self.entries.clear();
        self.empty = 0;
    }
}

/// Makes a schedule from the collision of each entry; `None` is an empty one.
impl FromIterator<Option<u32>> for Schedule {
    fn from_iter<I: IntoIterator<Item = Option<u32>>>(entries: I) -> Self {
        let entries: Vec<u32> = entries.into_iter().map(|entry| entry.unwrap_or(EMPTY)).collect();
        let empty = entries.iter().filter(|index| **index == EMPTY).count();
        Self { entries, empty }
    }
}

/// Collisions in the order of a schedule. An empty entry is a collision without contact points,
/// which has no effect.
#[derive(Debug)]
pub struct Ordered<'a, C: ?Sized> {
    /// The collisions, as given.
    pub collisions: &'a C,
    /// Their order; it was made for the same number of collisions.
    pub schedule: &'a Schedule,
}

impl<C: Collisions + ?Sized> Collisions for Ordered<'_, C> {
    fn len(&self) -> usize {
        self.schedule.len()
    }

    #[inline]
    fn collision(&self, index: usize) -> Collision {
        self.schedule
            .get(index)
            .map_or(Collision::NOTHING, |index| self.collisions.collision(index))
    }

    fn structures(&self) -> Option<Structures<'_>> {
        match self.collisions.structures()? {
            // The index of an empty entry lies beyond the array.
            Structures::Array(all) if all.len() == self.collisions.len() => {
                Some(Structures::Ordered { all, order: &self.schedule.entries })
            }
            Structures::Array(_) | Structures::Ordered { .. } => None,
        }
    }

    #[inline]
    fn prefetch(&self, index: usize) {
        self.schedule.get(index).into_iter().for_each(|index| self.collisions.prefetch(index));
    }

    #[inline]
    fn impulses(&self, index: usize, normal: [f32; 3], points: u32) -> Impulses {
        let given = |index| self.collisions.impulses(index, normal, points);
        self.schedule.get(index).map_or(Impulses::ZERO, given)
    }

    fn lengths_agree(&self) -> bool {
        // A schedule leaves out collisions without contact points.
        self.collisions.lengths_agree() && self.schedule.collisions() <= self.collisions.len()
    }
}
