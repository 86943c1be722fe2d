//! Reads the accelerator's counters of a step, and its sticky error.

use std::time::Duration;

use pgs_interface::control::{
    COUNTER_MAX, CYCLES_HI, CYCLES_LO, ERROR, ERROR_DETAIL, HAZARDS, IMPULSE_SUM_FRACTION_BITS,
    IMPULSE_SUM_HI, IMPULSE_SUM_LO, IMPULSE_SUM_MAX, SUM_RECEIVED, SUM_SENT, WAIT_CYCLES,
    WORK_CYCLES,
};

use super::Control;

/// The accelerator's sticky error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct StickyError {
    /// The register ERROR.
    pub(crate) raw: u32,
    /// The register `ERROR_DETAIL`.
    pub(crate) detail: u32,
}

/// The accelerator's counters of the last step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Counters {
    /// Cycles from start to done.
    pub(crate) cycles: u64,
    /// Cycles without stalls at hazards and without waits for streams.
    pub(crate) work: u32,
    /// Cycles of waiting for streams.
    pub(crate) waits: u32,
    /// Collisions that met a hazard.
    pub(crate) hazards: u32,
    /// Sums of the words received and sent.
    pub(crate) sums: (u32, u32),
    /// Sum of the accumulated normal impulses, N s, if it is below its maximum.
    pub(crate) impulse_sum: Option<f64>,
    /// The counters that stand at their maximum.
    pub(crate) saturated: Saturated,
}

/// Counters of a step that stopped at their maximum: the true count is the maximum or more.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Saturated {
    /// Cycles by the formula.
    pub work: bool,
    /// Cycles in which the accelerator waited for a stream.
    pub waits: bool,
    /// Collisions that met a hazard.
    pub hazards: bool,
    /// The sum of the impulses.
    pub impulse_sum: bool,
}

impl Saturated {
    /// Whether the stalls are unknown: they are all cycles less work and waits.
    #[must_use]
    pub const fn stalls(&self) -> bool {
        self.work || self.waits
    }
}

impl Control {
    /// The sticky error, if one is set.
    pub(crate) fn sticky_error(&self) -> Option<StickyError> {
        let raw = self.read(&ERROR);
        // The detail is read only after an error: a good step costs one access.
        (raw != 0).then(|| StickyError { raw, detail: self.read(&ERROR_DETAIL) })
    }

    /// Reads the counters of the step that has ended.
    pub(crate) fn counters(&self) -> Counters {
        let wide = |high: u32, low: u32| (u64::from(high) << 32) | u64::from(low);
        let hazards = self.read(&HAZARDS);
        let work = self.read(&WORK_CYCLES);
        let waits = self.read(&WAIT_CYCLES);
        let sums = (self.read(&SUM_RECEIVED), self.read(&SUM_SENT));
        let low = self.read(&IMPULSE_SUM_LO);
        let impulses = wide(self.read(&IMPULSE_SUM_HI), low);
        // Last: no step takes 0 cycles, so that 0 here tells of a reset at any of these reads.
        let high = self.read(&CYCLES_HI);
        let cycles = wide(high, self.read(&CYCLES_LO));
        let saturated = Saturated {
            work: work == COUNTER_MAX,
            waits: waits == COUNTER_MAX,
            hazards: hazards == COUNTER_MAX,
            impulse_sum: impulses == IMPULSE_SUM_MAX,
        };
        let impulse_sum = (!saturated.impulse_sum).then(|| impulse(impulses));
        Counters { cycles, work, waits, hazards, sums, impulse_sum, saturated }
    }
}

/// Fixed point to N s. Sums above 2^53 units (8.6e9 N s) are rounded.
#[allow(clippy::cast_precision_loss, reason = "rounding of sums above 2^53 is documented")]
pub(crate) const fn impulse(units: u64) -> f64 {
    units as f64 / (1_u64 << IMPULSE_SUM_FRACTION_BITS) as f64
}

/// The time of `cycles` at `clock_khz`, rounded down to nanoseconds; zero for a clock of 0.
pub(crate) fn time_of(cycles: u64, clock_khz: u32) -> Duration {
    let nanoseconds =
        (u128::from(cycles) * 1_000_000).checked_div(u128::from(clock_khz)).unwrap_or(0);
    Duration::from_nanos(u64::try_from(nanoseconds).unwrap_or(u64::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::platform::RegisterMap;
    use crate::platform::fake::FakeRegisters;

    #[test]
    fn the_detail_of_an_error_is_read_with_it() {
        let registers = FakeRegisters::default();
        let control = Control::new(registers.window(RegisterMap::Control));
        assert_eq!(control.sticky_error(), None);
        registers.with(|state| {
            state.values.insert(0x180, 0x0203);
            state.values.insert(0x184, 17);
        });
        assert_eq!(control.sticky_error(), Some(StickyError { raw: 0x0203, detail: 17 }));
    }

    #[test]
    #[allow(clippy::float_cmp, reason = "both are exact in binary")]
    fn impulses_are_counted_in_units_of_two_to_the_minus_twenty() {
        assert_eq!(impulse(1 << 20), 1.0);
        assert_eq!(impulse((1 << 32) + (1 << 19)), 4096.5);
        assert_eq!(impulse(u64::MAX), 17_592_186_044_416.0);
    }

    #[test]
    fn a_counter_at_its_maximum_is_no_number() {
        let registers = FakeRegisters::default();
        let control = Control::new(registers.window(RegisterMap::Control));
        let counted = |low: u32, others: u32| {
            registers.with(|state| {
                state.values.extend([(0x1A4, low), (0x1A8, u32::MAX)]);
                state.values.extend([(0x190, others), (0x194, others), (0x198, others)]);
            });
            control.counters()
        };
        let most = counted(u32::MAX - 1, u32::MAX - 1);
        assert_eq!(most.saturated, Saturated::default());
        assert_eq!(most.impulse_sum, Some(impulse(u64::MAX - 1)));
        let stopped = counted(u32::MAX, u32::MAX);
        let all = Saturated { work: true, waits: true, hazards: true, impulse_sum: true };
        assert_eq!((stopped.saturated, stopped.impulse_sum), (all, None));
        assert!(all.stalls() && !Saturated { impulse_sum: true, ..most.saturated }.stalls());
    }

    #[test]
    fn time_is_cycles_over_the_clock() {
        // 2,062,697 cycles at 275 MHz are 7.5007 ms; the thesis prints 7.49 ms beside them (T6.4).
        let time = time_of(2_062_697, 275_000);
        assert_eq!(time.as_micros(), 7500);
        assert_eq!(time_of(1, 0), Duration::ZERO);
        assert_eq!(time_of(u64::MAX, 1), Duration::from_nanos(u64::MAX));
    }
}
