//! Refuses outputs of a call that share bytes with another of its arguments.
//!
//! Inputs may lie over each other; an output lies alone. Arrays of one structure may alternate:
//! their elements are compared, not their ends.

use crate::failure::Failure;

/// The bytes of an argument: `count` elements of `bytes` bytes, `stride` bytes apart.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    name: &'static str,
    first: usize,
    stride: usize,
    bytes: usize,
    count: usize,
}

impl Span {
    /// An array that ends within the address space.
    pub(super) fn new<T>(name: &'static str, first: usize, stride: usize, count: usize) -> Self {
        Self { name, first, stride, bytes: size_of::<T>(), count }
    }

    /// One value; null is none.
    pub(crate) fn of<T>(name: &'static str, value: *const T) -> Self {
        Self::new::<T>(name, value.addr(), size_of::<T>(), usize::from(!value.is_null()))
    }

    /// The same of `bytes` bytes.
    pub(super) fn of_size(self, bytes: usize) -> Self {
        Self { bytes, stride: bytes, ..self }
    }

    /// The first byte of the element at an index.
    fn at(&self, index: usize) -> usize {
        self.first.saturating_add(index.saturating_mul(self.stride))
    }

    /// The byte behind the last element.
    fn end(&self) -> usize {
        self.at(self.count.saturating_sub(1)).saturating_add(self.bytes)
    }

    /// Whether an element of one shares a byte with an element of the other.
    fn meets(&self, other: &Self) -> bool {
        let apart = self.end() <= other.first || other.end() <= self.first;
        if apart || self.count == 0 || other.count == 0 {
            return false;
        }
        // With one stride the places within it decide, but for the ends: most callers have an array
        // of structures.
        if self.stride == other.stride && self.first.abs_diff(other.first) < self.stride {
            let [low, high] = if self.first <= other.first { [self, other] } else { [other, self] };
            let distance = high.first - low.first;
            return distance < low.bytes || (distance + high.bytes > low.stride && low.count > 1);
        }
        // The element that ends first meets no later one.
        let (mut a, mut b) = (0, 0);
        while a < self.count && b < other.count {
            let (here, there) = (self.at(a), other.at(b));
            let here_end = here.saturating_add(self.bytes);
            let there_end = there.saturating_add(other.bytes);
            if here < there_end && there < here_end {
                return true;
            }
            if here_end <= there_end {
                a += 1;
            } else {
                b += 1;
            }
        }
        false
    }
}

/// Refuses an output that shares bytes with another output or with an input.
pub(crate) fn refuse_overlap(
    outputs: &[Span],
    inputs: impl Iterator<Item = Span> + Clone,
) -> Result<(), Failure> {
    for (at, output) in outputs.iter().enumerate() {
        let mut others = outputs[at + 1..].iter().copied().chain(inputs.clone());
        if let Some(other) = others.find(|other| output.meets(other)) {
            return Err(Failure::argument(format!(
                "the {} and the {} share bytes, and the call writes the former: give each memory \
                 of its own",
                output.name, other.name
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(first: usize, stride: usize, bytes: usize, count: usize) -> Span {
        Span { name: "span", first, stride, bytes, count }
    }

    /// Every byte of every element, one by one.
    fn by_hand(a: &Span, b: &Span) -> bool {
        let bytes = |span: &Span| -> Vec<usize> {
            (0..span.count)
                .flat_map(|k| (0..span.bytes).map(move |byte| (k, byte)))
                .map(|(k, byte)| span.first + k * span.stride + byte)
                .collect()
        };
        let all = bytes(b);
        bytes(a).iter().any(|byte| all.contains(byte))
    }

    #[test]
    fn two_spans_meet_where_they_share_a_byte() {
        let mut seen = [0, 0];
        for (one, two) in [(4, 4), (12, 16), (12, 12), (16, 12), (12, 40)] {
            for (bytes, others) in [(12, 16), (4, 12), (12, 12), (12, 4)] {
                let (one, two) = (one.max(bytes), two.max(others));
                for start in (0..160).step_by(4) {
                    for (count, other_count) in [(0, 3), (1, 1), (1, 5), (3, 4), (5, 1)] {
                        let a = span(80, one, bytes, count);
                        let b = span(start, two, others, other_count);
                        let expected = by_hand(&a, &b);
                        assert_eq!((a.meets(&b), b.meets(&a)), (expected, expected), "{a:?} {b:?}");
                        seen[usize::from(expected)] += 1;
                    }
                }
            }
        }
        assert!(seen.iter().all(|count| *count > 300), "{seen:?}");
    }

    #[test]
    fn inputs_may_lie_over_each_other_and_outputs_may_not() {
        let (a, b) = (span(0, 64, 12, 10), span(12, 64, 16, 10));
        let apart =
            |outputs: &[Span], inputs: &[Span]| refuse_overlap(outputs, inputs.iter().copied());
        assert_eq!(apart(&[a, b], &[span(28, 64, 4, 10)]), Ok(()));
        assert_eq!(apart(&[], &[a, a]), Ok(()));
        assert_eq!(apart(&[a, span(640, 64, 12, 10)], &[b, b]), Ok(()));
        assert!(apart(&[a, a], &[]).is_err());
        let refused = apart(&[b], &[span(24, 64, 8, 1)]).expect_err("they share bytes");
        assert!(refused.text.contains("share bytes"), "{}", refused.text);
    }
}
