//! Runs one step on the board behind UIO nodes, without the driver: a test of a guest and its board
//! alone.
#![allow(clippy::print_stdout, reason = "a command line tool")]

use std::process::ExitCode;
use std::time::Duration;

use bitstream_model::interface::address_map::{
    CONTROL_BASE, DMA_BYTES, UIO_CONTROL_MAP, UIO_DMA_MAPS, UIO_MEMORY_NODE, UIO_NODE, dma_base,
};
use bitstream_model::interface::record::Beat;
use guest_board::one_cube::{self, Machine};
use zynq_pgs::platform::PlatformError;
use zynq_pgs::platform::{ReservedMemory, UioDevice, UioWindow};

/// Time limit of the step.
const PATIENCE: Duration = Duration::from_secs(30);

struct Board {
    device: UioDevice,
    dmas: Vec<UioWindow>,
    control: UioWindow,
    memory: ReservedMemory,
}

impl Board {
    fn open() -> Result<Self, PlatformError> {
        let device = UioDevice::open(UIO_NODE)?;
        let dmas: Result<Vec<_>, _> =
            UIO_DMA_MAPS.into_iter().map(|map| device.window(map)).collect();
        let control = device.window(UIO_CONTROL_MAP)?;
        let memory = ReservedMemory::open(UIO_MEMORY_NODE)?;
        Ok(Self { dmas: dmas?, control, memory, device })
    }

    /// The window of an address, and the offset in it.
    fn place(&mut self, address: u64) -> (&mut UioWindow, u32) {
        let dma = self.dmas.iter_mut().enumerate().find_map(|(core, window)| {
            let offset = u32::try_from(address.checked_sub(dma_base(core))?).ok()?;
            (offset < DMA_BYTES).then_some((window, offset))
        });
        // The window refuses an offset outside of it.
        let offset = address.checked_sub(CONTROL_BASE).and_then(|at| u32::try_from(at).ok());
        dma.unwrap_or((&mut self.control, offset.unwrap_or(u32::MAX)))
    }
}

impl Machine for Board {
    type Error = PlatformError;

    fn read(&mut self, address: u64) -> Result<u32, PlatformError> {
        let (window, at) = self.place(address);
        window.read32(at)
    }

    fn write(&mut self, address: u64, value: u32) -> Result<(), PlatformError> {
        let (window, at) = self.place(address);
        window.write32(at, value)
    }

    fn memory(&self) -> u64 {
        self.memory.address()
    }

    fn store(&mut self, at: u64, beats: &[Beat]) -> Result<(), PlatformError> {
        self.memory.write(at, beats)
    }

    fn load(&mut self, at: u64, beats: &mut [Beat]) -> Result<(), PlatformError> {
        self.memory.read(at, beats)
    }

    fn wait_interrupt(&mut self, timeout: Duration) -> Result<bool, PlatformError> {
        Ok(self.device.wait_interrupt(timeout)?.is_some())
    }

    fn unmask_interrupt(&mut self) -> Result<(), PlatformError> {
        self.device.unmask()
    }
}

fn main() -> ExitCode {
    let ran = Board::open().map_err(one_cube::StepError::Machine);
    match ran.and_then(|mut board| one_cube::run(&mut board, PATIENCE)) {
        Ok(cycles) => {
            println!("ok one cube through UIO: Bullet's bits, 1 interrupt, {cycles} cycles");
            ExitCode::SUCCESS
        }
        Err(error) => {
            let source = std::error::Error::source(&error).map(ToString::to_string);
            println!("FAIL one cube through UIO: {error} {}", source.unwrap_or_default());
            ExitCode::FAILURE
        }
    }
}
