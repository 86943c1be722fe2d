//! Fuzz targets: the emulated board, the driver and the loader under random input.
//!
//! A target is a function of bytes that panics when it finds something. A [`campaign`] runs it on
//! bytes made from a seed, on a stable toolchain; `fuzz_targets/` passes the same functions to
//! libFuzzer, which needs a nightly toolchain.
//!
//! ```
//! let registers = fuzz::targets::by_name("registers").ok_or("no such target")?;
//! let tally = (registers.run)(&[1, 2, 3]);
//! assert_eq!(tally.steps, 0);
//! # Ok::<(), &str>(())
//! ```

pub mod boards;
pub mod campaign;
pub mod input;
pub mod random;
pub mod tally;
pub mod targets;

/// The bare-metal host of the emulated board's own tests. It packs a step from the interface's
/// tables, independently of the driver.
#[path = "../../../bitstream-model/tests/common/mod.rs"]
mod host;
