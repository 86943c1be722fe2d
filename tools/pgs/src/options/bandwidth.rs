//! Parses and formats a memory bandwidth.

use bitstream_model::Bandwidth;

const BYTES_PER_GB: f64 = 1e9;
/// Faster than any memory: a larger number is a typing error.
const BANDWIDTH_MAX: f64 = 1000.0;
/// Slower than any memory.
const BANDWIDTH_MIN: f64 = 0.1;

/// Parses a bandwidth on the command line.
pub(crate) fn bandwidth(text: &str) -> Result<Bandwidth, String> {
    if text == "unlimited" {
        return Ok(Bandwidth::Unlimited);
    }
    let wrong = || {
        format!(
            "expected a number of GB/s from {BANDWIDTH_MIN} to {BANDWIDTH_MAX}, or \"unlimited\""
        )
    };
    let number: f64 = text.parse().map_err(|_| wrong())?;
    if !(BANDWIDTH_MIN..=BANDWIDTH_MAX).contains(&number) {
        return Err(wrong());
    }
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a whole number between 1e6 and 1e12 after the check"
    )]
    let rate = (number * BYTES_PER_GB).round() as u64;
    Ok(Bandwidth::BytesPerSecond(rate))
}

/// Formats a bandwidth for people.
pub(crate) fn bandwidth_text(bandwidth: Bandwidth) -> String {
    match bandwidth_gigabytes(bandwidth) {
        None => "unlimited".to_owned(),
        Some(rate) => format!("{rate} GB/s"),
    }
}

/// A bandwidth in GB/s; `None` if it is unlimited.
pub(crate) fn bandwidth_gigabytes(bandwidth: Bandwidth) -> Option<f64> {
    bandwidth_number(bandwidth).map(|rate| rate as f64 / BYTES_PER_GB)
}

/// A bandwidth for programs: bytes per second, `None` if it is unlimited.
pub(crate) fn bandwidth_number(bandwidth: Bandwidth) -> Option<u64> {
    match bandwidth {
        Bandwidth::Unlimited => None,
        Bandwidth::BytesPerSecond(rate) => Some(rate),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bandwidths_are_read_as_they_are_shown() {
        assert_eq!(bandwidth("12.8"), Ok(Bandwidth::ZCU102_SUSTAINED));
        assert_eq!(bandwidth("17.07"), Ok(Bandwidth::ZCU102_PEAK));
        assert_eq!(bandwidth("unlimited"), Ok(Bandwidth::Unlimited));
        assert_eq!(bandwidth_text(Bandwidth::ZCU102_SUSTAINED), "12.8 GB/s");
        for wrong in ["", "0", "-1", "nan", "inf", "1e9", "12.8GB", "Unlimited"] {
            bandwidth(wrong).expect_err(wrong);
        }
    }
}
