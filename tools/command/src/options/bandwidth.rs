//! Formats a memory bandwidth.

use bitstream_model::Bandwidth;
use zynq_pgs::emulation::Build;

/// Formats a bandwidth for people.
pub fn bandwidth_text(bandwidth: Bandwidth) -> String {
    let build = Build { bandwidth: Some(bandwidth), ..Build::default() };
    let text = build.value("bandwidth").unwrap_or_default();
    match bandwidth {
        Bandwidth::Unlimited => text,
        Bandwidth::BytesPerSecond(_) => format!("{text} GB/s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bandwidth_has_its_unit_unless_it_is_unlimited() {
        assert_eq!(bandwidth_text(Bandwidth::ZCU102_SUSTAINED), "12.8 GB/s");
        assert_eq!(bandwidth_text(Bandwidth::Unlimited), "unlimited");
    }
}
