//! The ways to build an emulated board wrongly: mistakes of a block design, a device tree or a boot
//! image that a driver's self-test must find.
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
    /// It is high whatever the sources say.
    StuckHigh,
}

/// Whether caches and memory agree on a buffer that was handed over.
///
/// `from_byte` is where in each buffer the disagreement begins: what lies before is as it should
/// be. The first hand-over of a buffer is in order too, for the caches hold none of it yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Coherency {
    /// They agree.
    #[default]
    Coherent,
    /// The device reads what the buffer held at its previous hand-over: the caches were not
    /// written back.
    StaleReads {
        /// First byte of each buffer that is stale.
        from_byte: usize,
    },
    /// The CPU finds what it handed over itself instead of what the device has written: the caches
    /// were not invalidated.
    StaleWrites {
        /// First byte of each buffer that is stale.
        from_byte: usize,
    },
}

/// A part that has a reset of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resettable {
    /// An AXI DMA.
    Dma(usize),
    /// The accelerator.
    Accelerator,
}

/// How a board is built wrongly. The default is: not at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quirks {
    /// What IDENTIFICATION reads: another design was loaded.
    pub identification: u32,
    /// What VERSION reads: a bitstream of another interface version.
    pub version: u32,
    /// Width of the cores' length registers, where it is not what the DMA register says. An AXI DMA
    /// has 14 bits unless it is told otherwise.
    pub length_register: Option<u32>,
    /// The interrupt line.
    pub interrupt: InterruptWiring,
    /// Caches and memory.
    pub coherency: Coherency,
    /// A part that stays in reset from power-up on.
    pub held_reset: Option<Resettable>,
    /// A stream between a DMA core and the accelerator that carries nothing.
    pub unconnected: Option<(usize, Direction)>,
}

impl Default for Quirks {
    fn default() -> Self {
        Self {
            identification: IDENTIFICATION.reset,
            version: VERSION.reset,
            length_register: None,
            interrupt: InterruptWiring::default(),
            coherency: Coherency::default(),
            held_reset: None,
            unconnected: None,
        }
    }
}

impl Quirks {
    /// What has a range: name, value, smallest and largest value.
    pub(crate) fn ranges(&self) -> impl Iterator<Item = (&'static str, u64, u64, u64)> {
        // Below what an AXI DMA can have too: what answers there may be none.
        let (low, high) = (1, LENGTH_WIDTH_MAX.into());
        self.length_register
            .into_iter()
            .map(move |width| ("true length register width", width.into(), low, high))
    }
}

/// `beats` with what `stale` holds from that byte on.
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
