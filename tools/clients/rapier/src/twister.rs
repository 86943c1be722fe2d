//! The random numbers of C++'s `std::mt19937` and `std::uniform_real_distribution<float>`, which
//! place the cubes of the Bullet client's pile.

const WORDS: usize = 624;
const SHIFT: usize = 397;

/// A Mersenne twister of 32 bits.
pub(crate) struct Twister {
    words: [u32; WORDS],
    next: usize,
}

impl Twister {
    pub(crate) fn new(seed: u32) -> Self {
        let mut words = [seed; WORDS];
        for (at, index) in (1..WORDS).zip(1_u32..) {
            let before = words[at - 1];
            words[at] = 1_812_433_253_u32.wrapping_mul(before ^ (before >> 30)).wrapping_add(index);
        }
        Self { words, next: WORDS }
    }

    fn word(&mut self) -> u32 {
        if self.next == WORDS {
            self.refill();
        }
        let mut word = self.words[self.next];
        self.next += 1;
        word ^= word >> 11;
        word ^= (word << 7) & 0x9d2c_5680;
        word ^= (word << 15) & 0xefc6_0000;
        word ^ (word >> 18)
    }

    fn refill(&mut self) {
        for at in 0..WORDS {
            let (this, next) = (self.words[at], self.words[(at + 1) % WORDS]);
            let joined = (this & 0x8000_0000) | (next & 0x7fff_ffff);
            let odd = if joined & 1 == 1 { 0x9908_b0df } else { 0 };
            self.words[at] = self.words[(at + SHIFT) % WORDS] ^ (joined >> 1) ^ odd;
        }
        self.next = 0;
    }

    /// A number from `low` on and below `high`.
    pub(crate) fn between(&mut self, low: f32, high: f32) -> f32 {
        let share = (self.word() as f32 / 2_f32.powi(32)).min(1.0_f32.next_down());
        share * (high - low) + low
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The C++ standard (rand.predef) names the 10,000th word of the default seed.
    #[test]
    fn the_words_are_those_of_the_standard() {
        let mut twister = Twister::new(5489);
        let last = (0..10_000).map(|_| twister.word()).last();
        assert_eq!(last, Some(4_123_659_995));
    }

    #[test]
    fn a_number_lies_between_its_bounds() {
        let mut twister = Twister::new(1);
        let numbers: Vec<_> = (0..1000).map(|_| twister.between(-0.1, 0.1)).collect();
        assert!(numbers.iter().all(|number| (-0.1..0.1).contains(number)));
        assert!(numbers.iter().any(|number| *number < -0.09));
        assert!(numbers.iter().any(|number| *number > 0.09));
    }
}
