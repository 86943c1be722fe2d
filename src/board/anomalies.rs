//! Logs each kind of anomaly once per open board.

/// An anomaly of the board that the driver survives: no step fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anomaly {
    /// A step ended without an interrupt.
    MissedInterrupt,
    /// Several steps in a row ended without an interrupt.
    NoInterrupts,
    /// An interrupt came while no channel and no error was pending.
    SpuriousInterrupt,
    /// Interrupts follow each other without end.
    InterruptStorm,
    /// A channel did not stop for its new ring.
    NoHalt,
    /// A channel reported a complete packet before its descriptors did.
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
                "an interrupt came before the status of the descriptors was in memory; waiting \
                 for it"
            }
        }
    }
}

/// The anomalies that were logged, one bit each.
#[derive(Debug, Default)]
pub(crate) struct Anomalies(u32);

impl Anomalies {
    /// Logs an anomaly the first time; returns whether it did.
    pub(crate) fn tell(&mut self, anomaly: Anomaly) -> bool {
        let bit = 1 << anomaly as u32;
        let first = self.0 & bit == 0;
        if first {
            self.0 |= bit;
            log::warn!("{}", anomaly.text());
        }
        first
    }

    /// Whether an anomaly was logged.
    #[cfg(test)]
    pub(crate) fn told(&self, anomaly: Anomaly) -> bool {
        self.0 & (1 << anomaly as u32) != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_anomaly_is_told_once() {
        let mut anomalies = Anomalies::default();
        assert!(anomalies.tell(Anomaly::LateStatus) && !anomalies.tell(Anomaly::LateStatus));
        assert!(anomalies.tell(Anomaly::MissedInterrupt));
        assert!(anomalies.told(Anomaly::LateStatus) && !anomalies.told(Anomaly::InterruptStorm));
    }
}
