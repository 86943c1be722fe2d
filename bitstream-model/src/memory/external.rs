//! Lets a board work on external memory: a guest's memory in an emulator, for example.
//!
//! External buffers do not move on a hand-over. The device reaches the granted ranges all the time,
//! as on a real board, and ownership is the driver's business alone.

use std::fmt;
use std::io;
use std::ops::Range;

use crate::memory::Denied;
use pgs_interface::record::{BEAT_BYTES, Beat};

/// Physical memory outside the board. Addresses are bus addresses, inside a granted range.
pub trait DeviceMemory: fmt::Debug + Send {
    /// Reads beats from a multiple of a beat.
    ///
    /// # Errors
    /// Any reason why the memory cannot answer; the DMA sees a decode error.
    fn read_beats(&mut self, address: u64, to: &mut [Beat]) -> io::Result<()>;

    /// Writes beats to a multiple of a beat.
    ///
    /// # Errors
    /// As [`Self::read_beats`].
    fn write_beats(&mut self, address: u64, from: &[Beat]) -> io::Result<()>;

    /// Reads words of a descriptor from a multiple of 4.
    ///
    /// # Errors
    /// As [`Self::read_beats`].
    fn read_words(&mut self, address: u64, to: &mut [u32]) -> io::Result<()>;

    /// Writes the status word of a descriptor. A reader that sees the descriptor complete must see
    /// all beats that were written before.
    ///
    /// # Errors
    /// As [`Self::read_beats`].
    fn write_word(&mut self, address: u64, value: u32) -> io::Result<()>;
}

/// Memory outside the board that is accessed byte by byte, as a file is.
pub trait ByteMemory: fmt::Debug + Send {
    /// Reads bytes.
    ///
    /// # Errors
    /// As [`DeviceMemory::read_beats`].
    fn read(&self, address: u64, to: &mut [u8]) -> io::Result<()>;

    /// Writes bytes.
    ///
    /// # Errors
    /// As [`DeviceMemory::read_beats`].
    fn write(&self, address: u64, from: &[u8]) -> io::Result<()>;

    /// Writes a word, its uppermost byte last: it holds the flags that complete a descriptor.
    ///
    /// # Errors
    /// As [`DeviceMemory::read_beats`].
    fn write_upwards(&self, address: u64, value: u32) -> io::Result<()> {
        let bytes = value.to_le_bytes();
        self.write(address, &bytes[..3])?;
        self.write(address + 3, &bytes[3..])
    }
}

impl<M: ByteMemory> DeviceMemory for M {
    fn read_beats(&mut self, address: u64, to: &mut [Beat]) -> io::Result<()> {
        self.read(address, bytemuck::cast_slice_mut(to))
    }

    fn write_beats(&mut self, address: u64, from: &[Beat]) -> io::Result<()> {
        self.write(address, bytemuck::cast_slice(from))
    }

    fn read_words(&mut self, address: u64, to: &mut [u32]) -> io::Result<()> {
        self.read(address, bytemuck::cast_slice_mut(to))
    }

    fn write_word(&mut self, address: u64, value: u32) -> io::Result<()> {
        self.write_upwards(address, value)
    }
}

/// Memory outside the board, and the ranges that the device may touch.
#[derive(Debug)]
pub(crate) struct ExternalMemory {
    memory: Box<dyn DeviceMemory>,
    granted: Vec<Range<u64>>,
    /// Scratch space for beats between the memory and the device.
    beats: Vec<Beat>,
}

impl ExternalMemory {
    pub(crate) fn new(memory: Box<dyn DeviceMemory>, granted: Vec<Range<u64>>) -> Self {
        Self { memory, granted, beats: Vec::new() }
    }

    /// Checks that the device may touch these bytes.
    pub(crate) fn check(&self, address: u64, bytes: u64) -> Result<(), Denied> {
        let range =
            self.granted.iter().find(|range| range.contains(&address)).ok_or(Denied::Unmapped)?;
        if bytes > range.end - address { Err(Denied::PastEnd) } else { Ok(()) }
    }

    fn scratch(&mut self, count: usize) -> (&mut dyn DeviceMemory, &mut [Beat]) {
        if self.beats.len() < count {
            self.beats.resize(count, Beat::default());
        }
        (&mut *self.memory, &mut self.beats[..count])
    }

    pub(crate) fn read(&mut self, address: u64, count: usize) -> Result<&[Beat], Denied> {
        self.check(address, (count * BEAT_BYTES) as u64)?;
        let (memory, beats) = self.scratch(count);
        memory.read_beats(address, beats).map_err(|error| no_answer(address, &error))?;
        Ok(beats)
    }

    pub(crate) fn write(
        &mut self,
        address: u64,
        count: usize,
        fill: impl FnOnce(&mut [Beat]),
    ) -> Result<(), Denied> {
        self.check(address, (count * BEAT_BYTES) as u64)?;
        let (memory, beats) = self.scratch(count);
        fill(beats);
        memory.write_beats(address, beats).map_err(|error| no_answer(address, &error))
    }

    pub(crate) fn read_words(&mut self, address: u64, to: &mut [u32]) -> Result<(), Denied> {
        self.check(address, (to.len() * 4) as u64)?;
        self.memory.read_words(address, to).map_err(|error| no_answer(address, &error))
    }

    pub(crate) fn write_word(&mut self, address: u64, value: u32) -> Result<(), Denied> {
        self.check(address, 4)?;
        self.memory.write_word(address, value).map_err(|error| no_answer(address, &error))
    }
}

/// Logs the cause: a violation reports the driver's mistakes, and this failure is none.
fn no_answer(address: u64, error: &io::Error) -> Denied {
    log::error!("board: the memory at {address:#x} does not answer: {error}");
    Denied::NoAnswer
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A few beats at 0x1000, and a hole at 0x1020.
    #[derive(Debug, Default)]
    struct Few([Beat; 4]);

    impl Few {
        fn place(address: u64, count: usize) -> io::Result<Range<usize>> {
            let first = usize::try_from((address - 0x1000) / 16).map_err(io::Error::other)?;
            if (first..first + count).contains(&2) {
                return Err(io::Error::other("a hole"));
            }
            Ok(first..first + count)
        }
    }

    impl DeviceMemory for Few {
        fn read_beats(&mut self, address: u64, to: &mut [Beat]) -> io::Result<()> {
            to.copy_from_slice(&self.0[Self::place(address, to.len())?]);
            Ok(())
        }

        fn write_beats(&mut self, address: u64, from: &[Beat]) -> io::Result<()> {
            self.0[Self::place(address, from.len())?].copy_from_slice(from);
            Ok(())
        }

        fn read_words(&mut self, address: u64, to: &mut [u32]) -> io::Result<()> {
            let beats = &self.0[Self::place(address, to.len().div_ceil(4))?];
            for (to, from) in to.iter_mut().zip(beats.iter().flat_map(|beat| beat.0)) {
                *to = from;
            }
            Ok(())
        }

        fn write_word(&mut self, address: u64, value: u32) -> io::Result<()> {
            let place = Self::place(address & !15, 1)?.start;
            self.0[place].0[usize::try_from(address % 16 / 4).map_err(io::Error::other)?] = value;
            Ok(())
        }
    }

    fn external() -> ExternalMemory {
        ExternalMemory::new(Box::new(Few::default()), vec![0x1000..0x1040, 0x8000..0x8010])
    }

    #[test]
    fn written_beats_and_words_are_read_back_through_both_views() {
        let mut external = external();
        external.write(0x1000, 2, |beats| beats[1] = Beat([5, 6, 7, 8])).expect("granted");
        external.write_word(0x1014, 9).expect("granted");
        assert_eq!(external.read(0x1010, 1).expect("granted"), [Beat([5, 9, 7, 8])]);
        let mut words = [0; 2];
        external.read_words(0x1010, &mut words).expect("granted");
        assert_eq!(words, [5, 9]);
    }

    #[test]
    fn memory_that_is_not_granted_is_never_touched() {
        let mut external = external();
        assert_eq!(external.read(0x1030, 2).err(), Some(Denied::PastEnd));
        assert_eq!(external.read(0x1040, 1).err(), Some(Denied::Unmapped));
        assert_eq!(external.read(0xFF0, 1).err(), Some(Denied::Unmapped));
        assert_eq!(external.write_word(0x8010, 1).err(), Some(Denied::Unmapped));
        let written = external.write(0x1030, 2, |_| panic!("nothing to fill"));
        assert_eq!(written.err(), Some(Denied::PastEnd));
    }

    #[test]
    fn a_failing_memory_is_reported_as_no_answer() {
        let mut external = external();
        assert_eq!(external.read(0x1010, 2).err(), Some(Denied::NoAnswer));
        assert_eq!(external.write(0x1020, 1, |_| ()).err(), Some(Denied::NoAnswer));
    }
}
