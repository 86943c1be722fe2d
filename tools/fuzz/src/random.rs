//! Makes the bytes of an execution: a function of seed, target and number alone, so that any
//! execution can be repeated alone, independently of the number of threads.

use pgs_support::random::SplitMix64;

/// Fills `bytes` with at most `longest` bytes for execution `number` of the target `target`.
///
/// One in eight inputs is mostly zeros, one in eight mostly ones: uniform bytes never reach these.
pub fn fill(bytes: &mut Vec<u8>, seed: u64, target: &str, number: u64, longest: usize) {
    // FNV-1a, so that targets do not share their inputs.
    let name = target.bytes().fold(0xCBF2_9CE4_8422_2325, |hash: u64, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3)
    });
    let mut mix = SplitMix64::new(seed);
    let mut random =
        SplitMix64::new(mix.next() ^ name ^ number.wrapping_mul(0xD134_2543_DE82_EF95));
    let shape = random.next();
    let length = (shape >> 8) % (longest as u64 + 1);
    bytes.clear();
    while (bytes.len() as u64) < length {
        let word = match shape % 8 {
            0 => random.next() & random.next() & random.next(),
            1 => random.next() | random.next() | random.next(),
            _ => random.next(),
        };
        bytes.extend(word.to_le_bytes());
    }
    bytes.truncate(usize::try_from(length).unwrap_or(longest));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(seed: u64, target: &str, number: u64) -> Vec<u8> {
        let mut bytes = vec![9; 3];
        fill(&mut bytes, seed, target, number, 64);
        bytes
    }

    #[test]
    fn an_input_depends_on_seed_target_and_number_alone() {
        let same = bytes(1, "one", 77);
        assert_eq!(same, bytes(1, "one", 77));
        for other in [bytes(2, "one", 77), bytes(1, "two", 77), bytes(1, "one", 78)] {
            assert_ne!(same, other);
        }
    }

    #[test]
    fn lengths_fill_their_range() {
        let lengths: Vec<usize> = (0..2000).map(|number| bytes(5, "x", number).len()).collect();
        assert!((0..=64).all(|length| lengths.contains(&length)));
        assert!(lengths.iter().all(|length| *length <= 64));
    }
}
