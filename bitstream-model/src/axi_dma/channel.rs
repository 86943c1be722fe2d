//! Models the registers of one DMA channel, with the effects of reads and writes.

use super::Build;
use super::effects::FaultEffects;
use crate::cast::{high, low, register};
use crate::stream::Stream;
use crate::violation::{Log, ViolationKind};
use pgs_interface::axi_dma::Direction;
use pgs_interface::axi_dma::{
    ADDRESS, ADDRESS_MSB, CHANNEL_REGISTERS, CURDESC, CURDESC_MSB, DMACR, DMASR, LENGTH, TAILDESC,
    TAILDESC_MSB, dmacr, dmasr,
};
use pgs_interface::descriptor;
use pgs_interface::record::BEAT_BYTES;

/// Clocks of one tick of the delay timer.
const DELAY_TICK: u64 = 125;

/// The engine's current work.
#[derive(Debug, Clone, Copy)]
pub(super) enum Work {
    /// Nothing: stopped, idle, or never started.
    None,
    /// Waiting for a descriptor.
    Fetch { address: u64, ready_at: u64 },
    /// Moving the data of a descriptor.
    Descriptor(Descriptor),
    /// Moving a direct transfer.
    Direct { moved: u32 },
}

/// A fetched descriptor.
#[derive(Debug, Clone, Copy)]
pub(super) struct Descriptor {
    pub(super) address: u64,
    pub(super) next: u64,
    pub(super) buffer: u64,
    pub(super) length: u32,
    pub(super) moved: u32,
    pub(super) eof: bool,
    /// S2MM: the packet's first beat went into this descriptor.
    pub(super) rxsof: bool,
}

#[derive(Debug, Clone, Copy)]
enum Transition {
    Run,
    Halt,
}

/// One direction of a core.
#[derive(Debug)]
pub(super) struct Channel {
    pub(super) direction: Direction,
    /// DMACR as last written, without Reset.
    pub(super) control: u32,
    /// Error and interrupt bits of DMASR.
    latched: u32,
    packets_to_go: u32,
    delay_until: Option<u64>,
    halted: bool,
    transition: Option<(u64, Transition)>,
    pub(super) idle: bool,
    pub(super) current: u64,
    /// The first descriptor since it had no work.
    pub(super) first: u64,
    pub(super) tail: u64,
    pub(super) address: u64,
    pub(super) length: u32,
    pub(super) work: Work,
    /// The descriptor after the last completed one.
    pub(super) resume: Option<u64>,
    /// A packet has begun and not ended.
    pub(super) in_packet: bool,
    /// The engine's clock; it may run a little behind the board's.
    pub(super) time: u64,
    /// Beats and descriptors of the packet that are done: moved, completed.
    pub(super) beats: u64,
    pub(super) descriptors: u32,
    pub(super) faulty: FaultEffects,
}

impl Channel {
    pub(super) fn new(direction: Direction) -> Self {
        Self {
            direction,
            control: DMACR.reset,
            latched: 0,
            packets_to_go: dmacr::IRQ_THRESHOLD.of(DMACR.reset),
            delay_until: None,
            halted: true,
            transition: None,
            idle: false,
            current: 0,
            first: 0,
            tail: 0,
            address: 0,
            length: 0,
            work: Work::None,
            resume: None,
            in_packet: false,
            time: 0,
            beats: 0,
            descriptors: 0,
            faulty: FaultEffects::default(),
        }
    }

    /// Drops the current work.
    pub(super) fn stop(&mut self) {
        self.work = Work::None;
    }

    /// Whether the engine has no work.
    pub(super) fn rests(&self) -> bool {
        matches!(self.work, Work::None)
    }

    /// Whether the channel waits for beats, for space or for work, and no other change is due in
    /// it.
    #[inline]
    pub(super) fn cannot_move(&self, stream: &Stream) -> bool {
        let waits = match self.direction {
            Direction::Mm2s => stream.space() == 0,
            Direction::S2mm => stream.len() == 0,
        };
        let works = match self.work {
            Work::None => !waits && self.direction == Direction::S2mm,
            Work::Fetch { .. } => true,
            Work::Descriptor(_) | Work::Direct { .. } => !waits,
        };
        !works && self.faulty.late.is_empty() && !self.faulty.extra && !self.faulty.discards
    }

    /// Whether nothing but beats can happen on the channel: it runs plainly, and no timer runs out.
    pub(super) fn is_plain(&self) -> bool {
        let odd = dmacr::KEYHOLE.mask() | dmacr::CYCLIC_BD.mask() | dmacr::IRQ_DELAY.mask();
        let runs = dmacr::RS.is_set(self.control) && !self.halted;
        runs && self.control & odd == 0 && self.transition.is_none() && self.faulty.none()
    }

    /// Whether an error has stopped the channel.
    pub(super) fn has_failed(&self) -> bool {
        self.latched & dmasr::ERRORS != 0 && !dmacr::RS.is_set(self.control)
    }

    /// Whether RS was cleared and the channel has not halted yet.
    pub(super) fn stopping(&self) -> bool {
        matches!(self.transition, Some((_, Transition::Halt)))
    }

    /// Delays the change of Halted that is under way.
    pub(super) fn halt_later(&mut self, cycles: u64) {
        if let Some((at, _)) = &mut self.transition {
            *at = at.saturating_add(cycles);
        }
    }

    pub(super) fn has(&self, at: u32) -> bool {
        CHANNEL_REGISTERS.iter().any(|row| row.offset == at)
    }

    fn status(&self, build: &Build) -> u32 {
        let mut value = self.latched;
        value = dmasr::HALTED.put(value, u32::from(self.halted));
        value = dmasr::IDLE.put(value, u32::from(self.idle && !self.halted));
        value = dmasr::SG_INCLD.put(value, u32::from(build.scatter_gather));
        value = dmasr::IRQ_THRESHOLD_STS.put(value, self.packets_to_go);
        match self.delay_until {
            Some(until) => {
                let ticks = until.saturating_sub(self.time).div_ceil(DELAY_TICK).min(255);
                dmasr::IRQ_DELAY_STS.put(value, register(ticks))
            }
            None => value,
        }
    }

    pub(super) fn read(&self, build: &Build, at: u32) -> Option<u32> {
        Some(match at {
            _ if at == DMACR.offset => self.control,
            _ if at == DMASR.offset => self.status(build),
            _ if at == CURDESC.offset => low(self.current),
            _ if at == CURDESC_MSB.offset => high(self.current),
            _ if at == TAILDESC.offset => low(self.tail),
            _ if at == TAILDESC_MSB.offset => high(self.tail),
            _ if at == ADDRESS.offset => low(self.address),
            _ if at == ADDRESS_MSB.offset => high(self.address),
            _ if at == LENGTH.offset => self.length,
            _ => return None,
        })
    }

    pub(super) fn write(
        &mut self,
        build: &Build,
        now: u64,
        at: u32,
        value: u32,
        log: &mut Log,
    ) -> Option<bool> {
        let wide = build.address_width > 32;
        let high_mask =
            if build.address_width >= 64 { u64::MAX } else { (1_u64 << build.address_width) - 1 };
        let set_low = |old: u64, mask: u32| (old & !0xFFFF_FFFF) | u64::from(value & mask);
        let set_high = |old: u64| ((old & 0xFFFF_FFFF) | (u64::from(value) << 32)) & high_mask;
        let descriptor_mask = !(register(descriptor::BYTES) - 1);
        let mut doorbell = false;
        match at {
            _ if at == DMACR.offset => self.write_control(build, now, value, log),
            _ if at == DMASR.offset => self.latched &= !(value & dmasr::IRQS),
            _ if at == CURDESC.offset || at == CURDESC_MSB.offset => {
                if !self.halted || dmacr::RS.is_set(self.control) {
                    let (core, direction) = (build.core, self.direction);
                    log.violation(ViolationKind::CurdescWhileRunning { core, direction });
                } else if at == CURDESC.offset {
                    self.current = set_low(self.current, descriptor_mask);
                } else if wide {
                    self.current = set_high(self.current);
                }
            }
            _ if at == TAILDESC.offset => {
                self.tail = set_low(self.tail, descriptor_mask);
                if !wide {
                    doorbell = self.ring_doorbell(build, now, log);
                }
            }
            _ if at == TAILDESC_MSB.offset => {
                if wide {
                    self.tail = set_high(self.tail);
                    doorbell = self.ring_doorbell(build, now, log);
                }
            }
            _ if at == ADDRESS.offset => self.address = set_low(self.address, u32::MAX),
            _ if at == ADDRESS_MSB.offset => {
                if wide {
                    self.address = set_high(self.address);
                }
            }
            _ if at == LENGTH.offset => doorbell = self.write_length(build, now, value, log),
            _ => return None,
        }
        Some(doorbell)
    }

    fn write_control(&mut self, build: &Build, now: u64, value: u32, log: &mut Log) {
        let was_running = dmacr::RS.is_set(self.control);
        let threshold = match dmacr::IRQ_THRESHOLD.of(value) {
            0 => dmacr::IRQ_THRESHOLD.of(self.control),
            new => new,
        };
        if threshold != dmacr::IRQ_THRESHOLD.of(self.control) {
            self.packets_to_go = threshold;
        }
        let writable = dmacr::RS.mask()
            | dmacr::KEYHOLE.mask()
            | dmacr::CYCLIC_BD.mask()
            | dmacr::IOC_IRQ_EN.mask()
            | dmacr::DLY_IRQ_EN.mask()
            | dmacr::ERR_IRQ_EN.mask()
            | dmacr::IRQ_DELAY.mask();
        self.control =
            dmacr::IRQ_THRESHOLD.put(value & writable, threshold) | dmacr::ALWAYS_ONE.mask();
        let runs = dmacr::RS.is_set(self.control);
        if runs && self.latched & dmasr::ERRORS != 0 {
            let (core, direction) = (build.core, self.direction);
            log.violation(ViolationKind::StartWithError { core, direction });
            self.control &= !dmacr::RS.mask();
        } else if runs != was_running {
            let what = if runs { Transition::Run } else { Transition::Halt };
            self.transition = Some((now + build.delays.halt, what));
        }
    }

    /// A doorbell in scatter-gather mode: starts or resumes the engine, or moves its pause point.
    fn ring_doorbell(&mut self, build: &Build, now: u64, log: &mut Log) -> bool {
        let (core, direction) = (build.core, self.direction);
        if self.halted || !dmacr::RS.is_set(self.control) {
            log.violation(ViolationKind::DoorbellWhileHalted { core, direction });
            return false;
        }
        if !build.scatter_gather {
            log.violation(ViolationKind::WrongMode { core, direction });
            return false;
        }
        if matches!(self.work, Work::None) {
            self.idle = false;
            let address = self.resume.unwrap_or(self.current);
            self.first = address;
            self.work = Work::Fetch { address, ready_at: now + build.delays.descriptor_fetch };
        }
        true
    }

    fn write_length(&mut self, build: &Build, now: u64, value: u32, log: &mut Log) -> bool {
        let (core, direction) = (build.core, self.direction);
        let mask = u32::MAX >> (32 - build.length_width);
        if self.halted {
            // A driver writes all ones to learn the register's width, and then 0 to restore it.
            self.length = value & mask;
            if value != u32::MAX && value != 0 {
                log.violation(ViolationKind::DoorbellWhileHalted { core, direction });
            }
            return false;
        }
        if build.scatter_gather {
            log.violation(ViolationKind::WrongMode { core, direction });
            return false;
        }
        if !dmacr::RS.is_set(self.control) {
            // Stopped, by software or by an error, and not halted yet.
            log.violation(ViolationKind::DoorbellWhileHalted { core, direction });
            return false;
        }
        if !matches!(self.work, Work::None) {
            log.violation(ViolationKind::LengthWhileBusy { core, direction });
            return false;
        }
        if value & !mask != 0 {
            let width = build.length_width;
            log.violation(ViolationKind::LengthTooWide { core, direction, wanted: value, width });
        }
        if value & mask == 0 {
            return false;
        }
        self.length = value & mask;
        let beat = BEAT_BYTES as u64;
        let whole_beats = self.direction == Direction::Mm2s || u64::from(self.length) % beat == 0;
        if !self.address.is_multiple_of(beat) || !whole_beats {
            let (address, length) = (self.address, self.length);
            log.violation(ViolationKind::Misaligned { core, direction, address, length });
        }
        self.idle = false;
        self.time = now;
        self.work = Work::Direct { moved: 0 };
        true
    }

    /// Changes the states that change by time alone; returns whether the channel has halted, which
    /// drops its work.
    pub(super) fn tick(&mut self, now: u64) -> bool {
        let due = self.transition.filter(|(at, _)| *at <= now);
        if let Some((_, what)) = due {
            self.transition = None;
            match what {
                Transition::Run => self.halted = false,
                Transition::Halt => {
                    self.halted = true;
                    self.idle = false;
                    self.work = Work::None;
                    self.resume = None;
                    self.in_packet = false;
                    (self.beats, self.descriptors) = (0, 0);
                }
            }
        }
        if self.delay_until.is_some_and(|until| until <= now) {
            self.delay_until = None;
            self.latched |= dmasr::DLY_IRQ.mask();
            self.packets_to_go = dmacr::IRQ_THRESHOLD.of(self.control);
        }
        matches!(due, Some((_, Transition::Halt)))
    }

    pub(super) fn next_event(&self) -> Option<u64> {
        let fetch = match self.work {
            Work::Fetch { ready_at, .. } => Some(ready_at),
            _ => None,
        };
        let late = self.faulty.late.iter().map(|(at, ..)| *at).min();
        let halt = self.transition.map(|(at, _)| at);
        // A slowed channel moves its next beat at its own time.
        let busy = matches!(self.work, Work::Descriptor(_) | Work::Direct { .. });
        let slow = (busy && self.faulty.slow > 0).then_some(self.time);
        [halt, self.delay_until, fetch, late, slow].into_iter().flatten().min()
    }

    pub(super) fn interrupt(&self) -> bool {
        // The enables of DMACR have the same bits as the interrupts of DMASR.
        self.latched & self.control & dmasr::IRQS != 0
    }

    /// A packet has ended at the engine's time.
    pub(super) fn packet_done(&mut self) {
        self.packets_to_go = self.packets_to_go.saturating_sub(1);
        if self.packets_to_go == 0 {
            self.latched |= dmasr::IOC_IRQ.mask();
            self.packets_to_go = dmacr::IRQ_THRESHOLD.of(self.control);
        }
        let delay = dmacr::IRQ_DELAY.of(self.control);
        if delay != 0 {
            self.delay_until = Some(self.time + u64::from(delay) * DELAY_TICK);
        }
    }

    /// A direct transfer has ended: it raises an interrupt whatever the threshold.
    pub(super) fn direct_done(&mut self) {
        self.latched |= dmasr::IOC_IRQ.mask();
        self.idle = true;
        self.work = Work::None;
        self.in_packet = false;
    }

    /// An error stops the channel; only a reset revives it.
    pub(super) fn fail(&mut self, build: &Build, bit: u32) {
        self.latched |= bit | dmasr::ERR_IRQ.mask();
        self.control &= !dmacr::RS.mask();
        self.work = Work::None;
        self.transition = Some((self.time + build.delays.halt, Transition::Halt));
    }
}
