//! Formats numbers for people: groups of digits, five digits, bounds.

/// Writes a whole number with a comma between groups of three digits.
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Writes five digits, with an exponent where they would not fit into seven columns.
pub fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e6).contains(&size) {
        let whole = format!("{:.0}", size.trunc()).len();
        format!("{value:.*}", 5_usize.saturating_sub(whole))
    } else {
        format!("{value:.2e}")
    }
}

/// The direction of a bound that a saturated counter leaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bound {
    /// A lower bound.
    AtLeast,
    /// An upper bound.
    AtMost,
}

impl Bound {
    /// Writes a count in words; it is a bound if a counter is saturated.
    pub fn words(self, saturated: bool, count: u64) -> String {
        let count = grouped(count);
        match (saturated, self) {
            (false, _) => count,
            (true, Self::AtLeast) => format!("at least {count}"),
            (true, Self::AtMost) => format!("at most {count}"),
        }
    }
}

/// Writes a number with its sign.
pub fn signed(value: f64) -> String {
    if value > 0.0 { format!("+{}", number(value)) } else { number(value) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_grouped_from_the_right() {
        assert_eq!(grouped(0), "0");
        assert_eq!(grouped(999), "999");
        assert_eq!(grouped(1000), "1,000");
        assert_eq!(grouped(2_066_270), "2,066,270");
    }

    #[test]
    fn a_bound_is_told_in_words() {
        let most = u64::from(u32::MAX);
        assert_eq!(Bound::AtLeast.words(true, most), "at least 4,294,967,295");
        assert_eq!(Bound::AtMost.words(true, 7), "at most 7");
        assert_eq!(Bound::AtMost.words(false, 1234), "1,234");
    }

    #[test]
    fn numbers_have_five_digits_and_never_lose_their_size() {
        for (value, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (1.0, "1.0000"),
            (0.017_6, "0.0176"),
            (99.98, "99.980"),
            (100.0, "100.00"),
            (-123.456, "-123.46"),
            (123_456.7, "123457"),
            (1e6, "1.00e6"),
            (3.05e-5, "3.05e-5"),
        ] {
            assert_eq!(number(value), text);
        }
        assert_eq!([signed(2.0), signed(-2.0), signed(0.0)], ["+2.0000", "-2.0000", "0"]);
    }
}
