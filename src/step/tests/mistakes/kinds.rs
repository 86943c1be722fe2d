//! Lists the mistakes of a driver, the troubles of a board, and the events between them.

use bitstream_model::Direction;

/// A channel: number of the core, direction.
pub(crate) type ChannelId = (usize, Direction);

/// The mistake of a worse driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mistake {
    /// Believes in 26 bits, whatever bitstream and cores report.
    LengthWidthAssumed,
    /// Writes `TAILDESC_MSB` before TAILDESC.
    UpperHalfFirst,
    /// Cuts the addresses of buffers to 32 bits.
    AddressCut,
    /// Takes a channel for halted right after the request to stop.
    HaltNotAwaited,
    /// Resets through MM2S, and assumes that S2MM goes on as before.
    OneDirectionReset,
    /// Does not read back what it has written, neither CURDESC nor GIE.
    StartBelieved,
    /// Has no deadlines: no time passes for it.
    NoDeadline,
    /// Ignores these bits of DMASR.
    StatusUnseen(u32),
    /// Ignores these bits of a descriptor's status.
    DescriptorUnseen(u32),
    /// Hands descriptors over with the board's status still in them.
    StatusNotCleared,
    /// Asks for an interrupt every fourth packet.
    ThresholdRaised,
    /// Unmasks interrupts before it acknowledges.
    UnmaskedFirst,
    /// Does not read the status again after unmasking interrupts.
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

/// The trouble that a board makes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Trouble {
    /// These bits of DMASR are set.
    Status(ChannelId, u32),
    /// These bits are set in the last descriptor of a complete chain.
    Descriptor(ChannelId, u32),
    /// Received packets are a beat short.
    ShortPacket(usize),
    /// The second descriptor of a chain is stale, which is a descriptor error of the core.
    StaleDescriptor(ChannelId),
    /// This number of interrupts comes without a cause.
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

/// An event between driver and board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Event {
    Read(usize, u32),
    Write(usize, u32, u32),
    /// A wait began.
    Wait,
    /// The wait ended with an interrupt.
    Woke,
    /// The driver unmasks interrupts; the level of the line at that moment.
    Unmask(bool),
    /// The driver takes a buffer back; whether no engine runs.
    TakeBack(bool),
}
