//! A short queue of work from one thread to the others: an idle thread takes the oldest piece.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Looks for work before the processor is given away.
const SPINS: u32 = 200;

/// Pieces in a circle.
#[derive(Debug)]
struct Ring<T, const N: usize> {
    pieces: [Option<T>; N],
    oldest: usize,
    count: usize,
}

/// Up to `N` pieces of work that wait.
#[derive(Debug)]
pub(crate) struct Queue<T, const N: usize> {
    ring: Mutex<Ring<T, N>>,
    /// The number of waiting pieces, readable without the lock.
    waiting: AtomicUsize,
    ended: AtomicBool,
}

impl<T, const N: usize> Queue<T, N> {
    pub(crate) fn new() -> Self {
        let ring = Ring { pieces: [const { None }; N], oldest: 0, count: 0 };
        Self { ring: Mutex::new(ring), waiting: AtomicUsize::new(0), ended: AtomicBool::new(false) }
    }

    fn with<R>(&self, change: impl FnOnce(&mut Ring<T, N>) -> R) -> R {
        // Only code of this module runs under the lock.
        let mut ring = self.ring.lock().unwrap_or_else(PoisonError::into_inner);
        let result = change(&mut ring);
        self.waiting.store(ring.count, Ordering::Release);
        result
    }

    /// Puts a piece in, or gives it back if there is no place for it.
    pub(crate) fn put(&self, piece: T) -> Option<T> {
        if self.waiting.load(Ordering::Acquire) == N {
            return Some(piece);
        }
        self.with(|ring| {
            if ring.count == N {
                return Some(piece);
            }
            ring.pieces[(ring.oldest + ring.count) % N] = Some(piece);
            ring.count += 1;
            None
        })
    }

    /// Takes the oldest piece, if any waits.
    pub(crate) fn take(&self) -> Option<T> {
        if self.waiting.load(Ordering::Acquire) == 0 {
            return None;
        }
        self.with(|ring| {
            let piece = ring.pieces[ring.oldest].take()?;
            ring.oldest = (ring.oldest + 1) % N;
            ring.count -= 1;
            Some(piece)
        })
    }

    /// Takes pieces as they come, until there are none and none will come any more.
    pub(crate) fn work(&self, mut on: impl FnMut(T)) {
        let mut idle = 0;
        loop {
            // Read first: a piece that was put in before the end is found below.
            let ended = self.ended.load(Ordering::Acquire);
            if let Some(piece) = self.take() {
                on(piece);
                idle = 0;
            } else if ended {
                return;
            } else if idle < SPINS {
                idle += 1;
                std::hint::spin_loop();
            } else {
                std::thread::yield_now();
            }
        }
    }

    /// A guard that ends the queue when it is dropped: no piece comes any more.
    pub(crate) fn ends(&self) -> Ends<'_> {
        Ends(&self.ended)
    }
}

/// Ends a queue when it goes, also in a panic.
#[derive(Debug)]
pub(crate) struct Ends<'a>(&'a AtomicBool);

impl Drop for Ends<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_come_out_once_and_in_their_order() {
        let queue = Queue::<u32, 3>::new();
        assert_eq!(queue.take(), None);
        for first in 0..10 {
            for piece in first..first + 3 {
                assert_eq!(queue.put(piece), None);
            }
            assert_eq!(queue.put(99), Some(99));
            for piece in first..first + 3 {
                assert_eq!(queue.take(), Some(piece));
            }
            assert_eq!(queue.take(), None);
            // The circle turns by one.
            assert_eq!((queue.put(7), queue.take()), (None, Some(7)));
        }
    }

    #[test]
    fn threads_share_all_pieces_and_leave_at_the_end() {
        let queue = Queue::<u64, 4>::new();
        let sum = AtomicUsize::new(0);
        let add = |piece: u64| {
            sum.fetch_add(crate::cast::index(piece), Ordering::Relaxed);
        };
        std::thread::scope(|scope| {
            for _ in 0..3 {
                scope.spawn(|| queue.work(add));
            }
            let ends = queue.ends();
            for piece in 0..1000 {
                if let Some(piece) = queue.put(piece) {
                    add(piece);
                }
            }
            drop(ends);
        });
        assert_eq!(sum.into_inner(), 999 * 1000 / 2);
    }
}
