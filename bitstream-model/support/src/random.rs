//! Numbers from a seed, the same on every machine.

/// Steele, Lea and Flood: "Fast splittable pseudorandom number generators" (2014).
#[derive(Debug, Clone)]
pub struct SplitMix64(u64);

impl SplitMix64 {
    /// Starts the sequence of a seed.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// 64 bits.
    pub const fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// 32 bits.
    pub const fn word(&mut self) -> u32 {
        (self.next() >> 32) as u32
    }

    /// A number below `end`; 0 if `end` is 0.
    pub fn below(&mut self, end: usize) -> usize {
        // The upper half of the product is below `end`.
        usize::try_from((u128::from(self.next()) * end as u128) >> 64).unwrap_or(0)
    }

    /// A word below `end`, which is not 0.
    pub fn word_below(&mut self, end: u32) -> u32 {
        ((u64::from(self.word()) * u64::from(end)) >> 32) as u32
    }

    /// A word between two, both of them included.
    pub fn between(&mut self, low: u32, high: u32) -> u32 {
        low + self.word_below(high - low + 1)
    }

    /// One of a list, which is not empty.
    pub fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }

    /// From 0 up to, and without, 1, in steps that are exact in f32.
    pub fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / 16_777_216.0
    }

    /// From -1 up to, and without, 1, in steps that are exact in f32.
    pub fn sign(&mut self) -> f32 {
        (self.next() >> 40) as f32 / 8_388_608.0 - 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_that_were_published() {
        assert_eq!(SplitMix64::new(0).next(), 0xE220_A839_7B1D_CDAF);
        let mut random = SplitMix64::new(1_234_567);
        assert_eq!(random.next(), 6_457_827_717_110_365_317);
        assert_eq!(random.next(), 3_203_168_211_198_807_973);
    }

    #[test]
    fn every_kind_of_number_fills_its_range() {
        let mut random = SplitMix64::new(3);
        let (mut eight, mut least, mut most) = ([false; 8], 1.0_f32, -1.0_f32);
        for _ in 0..1000 {
            eight[random.below(8)] = true;
            let (unit, sign) = (random.unit(), random.sign());
            assert!((0.0..1.0).contains(&unit) && (-1.0..1.0).contains(&sign), "{unit} {sign}");
            (least, most) = (least.min(sign), most.max(sign));
        }
        assert_eq!(eight, [true; 8]);
        assert!(least < -0.99 && most > 0.99, "{least} to {most}");
    }
}
