//! Logs, once a board, every oddity that the driver has dealt with.

/// Something odd that costs no step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anomaly {
    /// A step ended and no interrupt said so.
    MissedInterrupt,
    /// Interrupts have not come for some steps.
    NoInterrupts,
    /// An interrupt came and no channel had anything to say.
    SpuriousInterrupt,
    /// They come one after the other.
    InterruptStorm,
    /// A channel did not stop for a new ring.
    NoHalt,
    /// A packet was complete, and its descriptors did not say so yet.
    LateStatus,
}

impl Anomaly {
    const fn text(self) -> &'static str {
        match self {
            Self::MissedInterrupt => "a step ended without an interrupt; found by looking",
            Self::NoInterrupts => {
                "no interrupts come: polling until one does; is the interrupt connected?"
            }
            Self::SpuriousInterrupt => {
                "an interrupt came that no channel had asked for; is the line shared?"
            }
            Self::InterruptStorm => {
                "interrupts come without end and end nothing: ignored until the step is over"
            }
            Self::NoHalt => "a channel did not stop in time; the board was reset before the step",
            Self::LateStatus => {
                "an interrupt came before the status of the descriptors was in memory; waiting for it"
            }
        }
    }
}

/// Which oddities were told.
#[derive(Debug, Default)]
pub(crate) struct Anomalies(u32);

impl Anomalies {
    /// Tells of an oddity unless it was told before; whether it was told.
    pub(crate) fn tell(&mut self, oddity: Anomaly) -> bool {
        let bit = 1 << oddity as u32;
        let first = self.0 & bit == 0;
        if first {
            self.0 |= bit;
            log::warn!("{}", oddity.text());
        }
        first
    }

    /// Whether an oddity was told.
    #[cfg(test)]
    pub(crate) fn told(&self, oddity: Anomaly) -> bool {
        self.0 & (1 << oddity as u32) != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_oddity_is_told_once() {
        let mut oddities = Anomalies::default();
        assert!(oddities.tell(Anomaly::LateStatus) && !oddities.tell(Anomaly::LateStatus));
        assert!(oddities.tell(Anomaly::MissedInterrupt));
        assert!(oddities.told(Anomaly::LateStatus) && !oddities.told(Anomaly::InterruptStorm));
    }
}
