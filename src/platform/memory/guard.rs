//! A board whose memory for DMA is the guard alone: memory behind the fence of the bitstream, for a
//! test of the fence.

use std::sync::Arc;
use std::time::Duration;

use crate::platform::{DmaMemorySource, Platform, RegisterMap, RegisterWindow, Result};

/// A platform with the guard in place of its memory.
#[derive(Debug)]
pub(crate) struct GuardPlatform {
    board: Arc<dyn Platform>,
    guard: Box<dyn DmaMemorySource>,
}

impl GuardPlatform {
    /// The guard of a board; `None` if nothing is reserved behind its fence.
    pub(crate) fn of(board: &Arc<dyn Platform>) -> Result<Option<Self>> {
        Ok(board.guard()?.map(|guard| Self { board: Arc::clone(board), guard }))
    }
}

impl Platform for GuardPlatform {
    fn window(&self, map: RegisterMap) -> Result<Box<dyn RegisterWindow>> {
        self.board.window(map)
    }

    fn memory(&self) -> &dyn DmaMemorySource {
        &*self.guard
    }

    fn now(&self) -> Duration {
        self.board.now()
    }

    fn pause(&self, duration: Duration) {
        self.board.pause(duration);
    }

    fn wait_interrupt(&self, timeout: Duration) -> Result<Option<u32>> {
        self.board.wait_interrupt(timeout)
    }

    fn unmask_interrupt(&self) -> Result<()> {
        self.board.unmask_interrupt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::platform::uio_fake::{accelerator, add_node};
    use crate::platform::{
        HardwarePlatform, ManagerChoice, MemoryChoice, PlatformError, RegisterChoice,
    };

    #[test]
    fn the_guard_of_a_real_board_is_a_node_of_its_own_and_never_memory_for_steps() {
        let (_root, system) = accelerator();
        add_node(&system, 4, "pgs-memory", &[("memory", 0x5000_0000, 0x1_0000)]);
        let registers = RegisterChoice::Uio("pgs".to_owned());
        let (memory, manager) = (MemoryChoice::Automatic, ManagerChoice::Unasked);
        let board = HardwarePlatform::open(&system, registers, &memory, &manager).expect("opened");
        let board: Arc<dyn Platform> = Arc::new(board);
        assert!(GuardPlatform::of(&board).expect("listed").is_none(), "there is no such node");
        add_node(&system, 5, "pgs-guard", &[("guard", 0x5400_0000, 0x1_0000)]);
        let guard = GuardPlatform::of(&board).expect("opened").expect("it is there");
        assert_eq!(guard.memory().extent(), Some((0x5400_0000, 0x1_0000)));
        assert_eq!(guard.memory().name(), "pgs-guard");
        assert_eq!(board.memory().extent(), Some((0x5000_0000, 0x1_0000)));
        let (address, _) = guard.memory().allocate(4).expect("there is room");
        assert_eq!(address, 0x5400_0000);
        let busy = GuardPlatform::of(&board).expect_err("one user at a time");
        assert!(matches!(busy, PlatformError::Busy { .. }), "{busy}");
    }
}
