//! Finds the descriptors of a doorbell: from the place where the engine goes on to the tail.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use pgs_interface::descriptor::{
    BUFFER, BUFFER_MSB, CONTROL, NXTDESC, NXTDESC_MSB, STATUS, control,
};
use pgs_interface::register::Field;

/// More descriptors than any chain in these tests.
const LONGEST: usize = 100_000;

/// A descriptor in the memory that driver and board share.
#[derive(Debug, Clone)]
pub(crate) struct Bd {
    words: Arc<[AtomicU32]>,
    first: usize,
}

impl Bd {
    pub(crate) fn get(&self, word: usize) -> u32 {
        self.words[self.first + word].load(Ordering::Relaxed)
    }

    pub(crate) fn set(&self, word: usize, value: u32) {
        self.words[self.first + word].store(value, Ordering::Relaxed);
    }

    fn pair(&self, low: usize, high: usize) -> u64 {
        u64::from(self.get(low)) | (u64::from(self.get(high)) << 32)
    }

    /// The address of its data.
    pub(crate) fn buffer(&self) -> u64 {
        self.pair(BUFFER, BUFFER_MSB)
    }

    #[expect(clippy::cast_possible_truncation, reason = "the lower half")]
    pub(crate) fn set_buffer(&self, address: u64) {
        self.set(BUFFER, address as u32);
        self.set(BUFFER_MSB, (address >> 32) as u32);
    }

    /// The length of its data, bytes.
    pub(crate) fn length(&self) -> u32 {
        control::LENGTH.of(self.get(CONTROL))
    }

    pub(crate) fn has(&self, field: Field) -> bool {
        field.is_set(self.get(CONTROL))
    }

    pub(crate) fn mark(&self, field: Field) {
        self.set(CONTROL, self.get(CONTROL) | field.mask());
    }

    pub(crate) fn status(&self) -> u32 {
        self.get(STATUS)
    }
}

/// The words that were allocated for descriptors, by bus address.
#[derive(Debug, Default)]
pub(crate) struct Descriptors(BTreeMap<u64, Arc<[AtomicU32]>>);

impl Descriptors {
    pub(crate) fn add(&mut self, address: u64, words: Arc<[AtomicU32]>) {
        self.0.insert(address, words);
    }

    fn at(&self, address: u64) -> Bd {
        let (base, words) = self.0.range(..=address).next_back().expect("a ring of the driver's");
        let first = usize::try_from((address - base) / 4).expect("a small ring");
        Bd { words: Arc::clone(words), first }
    }
}

/// The position of one channel in its ring.
#[derive(Debug, Clone, Default)]
pub(crate) struct Place {
    current: u64,
    tail: u64,
    /// The chain of the last doorbell.
    pub(crate) chain: Vec<Bd>,
}

fn put(value: &mut u64, high: bool, half: u32) {
    let half = u64::from(half);
    *value = if high { (*value & 0xFFFF_FFFF) | (half << 32) } else { (*value >> 32 << 32) | half };
}

impl Place {
    /// Records a write of CURDESC, or of its upper half.
    pub(crate) fn starts_at(&mut self, high: bool, half: u32) {
        put(&mut self.current, high, half);
    }

    /// Records a write of TAILDESC, or of its upper half.
    pub(crate) fn ends_at(&mut self, high: bool, half: u32) {
        put(&mut self.tail, high, half);
    }

    /// Follows the links from the place where the engine goes on to the tail.
    pub(crate) fn follow(&mut self, descriptors: &Descriptors) {
        self.chain.clear();
        for _ in 0..LONGEST {
            let bd = descriptors.at(self.current);
            let last = self.current == self.tail;
            self.current = bd.pair(NXTDESC, NXTDESC_MSB);
            self.chain.push(bd);
            if last {
                return;
            }
        }
        panic!("no link leads to the tail {:#x}", self.tail);
    }
}
