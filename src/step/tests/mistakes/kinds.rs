//! This file lists what can be planted: mistakes of a driver, troubles of a board; and what is seen.

use bitstream_model::Direction;

/// A channel: number of the core, direction.
pub(crate) type ChannelId = (usize, Direction);

/// What a worse driver would do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mistake {
    /// Believes in 26 bits, whatever bitstream and cores say.
    LengthWidthAssumed,
    /// Writes `TAILDESC_MSB` before TAILDESC.
    UpperHalfFirst,
    /// Cuts the addresses of buffers to 32 bits.
    AddressCut,
    /// Takes a channel for halted as soon as it was told to stop.
    HaltNotAwaited,
    /// Resets by MM2S, and takes it that S2MM goes on as before.
    OneDirectionReset,
    /// Has no deadlines: for it no time passes.
    NoDeadline,
    /// Does not look at these bits of DMASR.
    StatusUnseen(u32),
    /// Does not look at these bits of a descriptor's status.
    DescriptorUnseen(u32),
    /// Hands descriptors over as the board has left them.
    StatusNotCleared,
    /// Asks for an interrupt every fourth packet.
    ThresholdRaised,
    /// Lets interrupts through before it acknowledges.
    UnmaskedFirst,
    /// Does not look again after letting interrupts through.
    NoSecondLook,
    /// Takes an interrupt for the end of the step.
    InterruptBelieved,
    /// Does not write its caches back before a buffer goes to the device.
    NotCleaned,
    /// Does not discard its caches when a buffer comes back.
    NotInvalidated,
    /// Takes received packets to be as long as their buffers.
    LengthIgnored,
    /// Its lengths spill into the next bit, which ends a packet.
    LengthSpills,
    /// Starts the receivers after the senders.
    ReceiversLast,
    /// Takes its buffers back after a time-out without a reset.
    NotReset,
    /// Takes the end of the senders for the end of the step.
    IdleBelieved,
    /// The last descriptor is a beat too long, if it ends with its buffer.
    BeatTooLong(ChannelId),
    /// The last descriptor lies a beat too high, if it ends with its buffer.
    BeatTooHigh(ChannelId),
    /// The last descriptor points to a buffer that was freed.
    FreedBuffer(ChannelId),
    /// The last descriptor points to a buffer that the CPU holds.
    CpuBuffer(ChannelId),
}

/// What a board does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Trouble {
    /// These bits of DMASR are set.
    Status(ChannelId, u32),
    /// These bits are set in the last descriptor of a chain that is done.
    Descriptor(ChannelId, u32),
    /// Received packets are a beat short.
    ShortPacket(usize),
    /// The second descriptor of a chain is stale: a descriptor error of the core's.
    StaleDescriptor(ChannelId),
    /// So many interrupts come for nothing.
    Spurious(u32),
    /// Waits end as soon as all senders are idle, without an interrupt.
    SendersIdle,
    /// A channel never runs.
    NeverRuns(ChannelId),
    /// A core stays in reset.
    NeverOutOfReset(usize),
    /// The accelerator stays in reset.
    AcceleratorInReset,
    /// `ap_done` never comes.
    NeverDone,
    /// The driver does not run for a while between the two halves of a doorbell.
    Preempted,
    /// A doorbell gets lost.
    DoorbellLost(ChannelId),
}

/// What happened at the board's door.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Event {
    Read(usize, u32),
    Write(usize, u32, u32),
    /// A wait began.
    Wait,
    /// It ended with an interrupt.
    Woke,
    /// Interrupts are let through; the level of the line at that moment.
    Unmask(bool),
    /// A buffer is taken back; whether no engine runs.
    TakeBack(bool),
}
