//! Builds an emulated board wrongly: mistakes of a block design, a device tree or a boot image that
//! a driver's self-test must find.
//!
//! Unlike a [`Fault`](crate::Fault), which happens once, they last as long as the board.

use pgs_interface::axi_dma::Direction;
use pgs_interface::axi_dma::LENGTH_WIDTH_MAX;
use pgs_interface::control::{IDENTIFICATION, VERSION};
use pgs_interface::record::{BEAT_BYTES, Beat};

/// Where the interrupt line leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InterruptWiring {
    /// From all sources to the processor.
    #[default]
    Connected,
    /// Nowhere: no source reaches the processor.
    Disconnected,
    /// Nowhere: the processor sees a high level at all times.
    StuckHigh,
}

/// Whether caches and memory agree on a buffer that was handed over.
///
/// `from_byte` is the beginning of the disagreement in each buffer: the bytes before it are
/// coherent. The first hand-over of a buffer is coherent too, because no cache holds it yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Coherency {
    /// They agree.
    #[default]
    Coherent,
    /// The device reads the content of the previous hand-over: the caches were not written back.
    StaleReads {
        /// First byte of each buffer that is stale.
        from_byte: usize,
    },
    /// The CPU reads the content that it handed over itself, not the device's stores: the caches
    /// were not invalidated.
    StaleWrites {
        /// First byte of each buffer that is stale.
        from_byte: usize,
    },
}

/// A master of a DMA core, with an address map of its own in the block design.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Master {
    /// Descriptors of both channels.
    Sg,
    /// Data of a channel.
    Data(Direction),
}

impl Master {
    /// All masters of a core.
    pub const ALL: [Self; 3] = [Self::Sg, Self::Data(Direction::Mm2s), Self::Data(Direction::S2mm)];
}

/// A part that has a reset of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resettable {
    /// An AXI DMA.
    Dma(usize),
    /// The accelerator.
    Accelerator,
}

/// The mistakes in the build of a board. The default is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quirks {
    /// Value of IDENTIFICATION: another one means another design.
    pub identification: u32,
    /// Value of VERSION: another one means a bitstream of another interface version.
    pub version: u32,
    /// Value of QUEUE, whatever queue the design has.
    pub queue: Option<u32>,
    /// True width of the cores' length registers, if the control block's DMA register gives another
    /// one. The default of an AXI DMA is 14 bits.
    pub length_register: Option<u32>,
    /// The interrupt line.
    pub interrupt: InterruptWiring,
    /// Caches and memory.
    pub coherency: Coherency,
    /// A part that stays in reset from power-up on.
    pub held_reset: Option<Resettable>,
    /// A stream between a DMA core and the accelerator that carries nothing.
    pub unconnected: Option<(usize, Direction)>,
    /// Masters of DMA cores that the fence does not hold: the block design gives them more.
    pub unfenced: &'static [(usize, Master)],
    /// Whether the device tree reserves no guard behind the fence.
    pub no_guard: bool,
}

impl Default for Quirks {
    fn default() -> Self {
        Self {
            identification: IDENTIFICATION.reset,
            version: VERSION.reset,
            queue: None,
            length_register: None,
            interrupt: InterruptWiring::default(),
            coherency: Coherency::default(),
            held_reset: None,
            unconnected: None,
            unfenced: &[],
            no_guard: false,
        }
    }
}

impl Quirks {
    /// The quirks with a range: name, value, smallest and largest value.
    pub(crate) fn ranges(&self) -> impl Iterator<Item = (&'static str, u64, u64, u64)> {
        // Also below the 8 bits of an AXI DMA: another core may answer there.
        let (low, high) = (1, LENGTH_WIDTH_MAX.into());
        self.length_register
            .into_iter()
            .map(move |width| ("true length register width", width.into(), low, high))
    }
}

/// `beats` with the beats of `stale` from byte `from_byte` on.
pub(crate) fn stale_from(
    from_byte: usize,
    mut beats: Box<[Beat]>,
    stale: Option<&[Beat]>,
) -> Box<[Beat]> {
    let Some(stale) = stale else { return beats };
    for (beat, stale) in beats.iter_mut().zip(stale).skip(from_byte.div_ceil(BEAT_BYTES)) {
        *beat = *stale;
    }
    beats
}
