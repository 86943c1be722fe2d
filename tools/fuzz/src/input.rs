//! Reads choices from the front of an execution's bytes; after their end it reads zeros, which are
//! the tamest choice everywhere.

/// The bytes that are left.
#[derive(Debug, Clone)]
pub struct Input<'a>(&'a [u8]);

impl<'a> Input<'a> {
    /// Starts with all of the bytes.
    #[must_use]
    pub fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    /// Whether no byte is left.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    fn array<const N: usize>(&mut self) -> [u8; N] {
        let mut array = [0; N];
        let taken = self.bytes(N);
        array[..taken.len()].copy_from_slice(taken);
        array
    }

    /// At most `most` bytes, unchanged.
    pub fn bytes(&mut self, most: usize) -> &'a [u8] {
        let (taken, left) = self.0.split_at(most.min(self.0.len()));
        self.0 = left;
        taken
    }

    /// A byte.
    pub fn byte(&mut self) -> u8 {
        let [byte] = self.array();
        byte
    }

    /// Sixteen bits.
    pub fn short(&mut self) -> u16 {
        u16::from_le_bytes(self.array())
    }

    /// A word.
    pub fn word(&mut self) -> u32 {
        u32::from_le_bytes(self.array())
    }

    /// Two words.
    pub fn long(&mut self) -> u64 {
        u64::from_le_bytes(self.array())
    }

    /// A number below `end`, which is above 0; it uses one byte where that is enough.
    pub fn below(&mut self, end: u32) -> u32 {
        let raw = if end <= 256 { self.byte().into() } else { self.word() };
        raw.checked_rem(end).unwrap_or(0)
    }

    /// An index below `end`, which is above 0.
    pub fn index(&mut self, end: usize) -> usize {
        let below = self.below(u32::try_from(end).unwrap_or(u32::MAX));
        usize::try_from(below).unwrap_or(0)
    }

    /// True once in `rate` times.
    pub fn one_in(&mut self, rate: u32) -> bool {
        // Never after the end of the bytes.
        self.below(rate) == rate - 1
    }

    /// One of the choices; there must be at least one.
    pub fn pick<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.index(choices.len())]
    }

    /// A word that means something to some register: a bit, a small number, all ones.
    pub fn telling_word(&mut self) -> u32 {
        match self.below(8) {
            0 => 0,
            1 => u32::MAX,
            2 => 1 << self.below(32),
            3 | 4 => self.byte().into(),
            // Run, with all interrupts, one at a time.
            5 => 0x0001_7001,
            6 => self.short().into(),
            _ => self.word(),
        }
    }

    /// From -1 up to 1 in steps of 2^-15.
    pub fn share(&mut self) -> f32 {
        f32::from(i16::from_le_bytes(self.array())) / 32_768.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_read_from_the_front_and_then_zeros() {
        let mut input = Input::new(&[1, 2, 3, 4, 5, 6, 7]);
        assert_eq!((input.byte(), input.short(), input.word()), (1, 0x0302, 0x0706_0504));
        assert!(input.is_empty());
        assert_eq!((input.long(), input.below(3), input.index(9)), (0, 0, 0));
        assert!(!input.one_in(2));
        assert!(input.bytes(4).is_empty());
    }

    #[test]
    fn choices_stay_below_their_end() {
        let bytes: Vec<u8> = (0..=255).collect();
        let mut input = Input::new(&bytes);
        assert!((0..100).all(|_| input.below(7) < 7));
        assert!((0..10).all(|_| input.below(1000) < 1000));
        assert!((-1.0..1.0).contains(&input.share()));
    }
}
