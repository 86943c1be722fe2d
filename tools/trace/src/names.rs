//! Names the parts of a board and the stages of a step, the same in every file.

use bitstream_model::interface::address_map::{CONTROL_BASE, CONTROL_BYTES, DMA_BASE, DMA_STRIDE};
use bitstream_model::interface::axi_dma::{CHANNEL_REGISTERS, S2MM_OFFSET};
use bitstream_model::interface::control::{REGISTERS, SHAPE_TABLE};
use bitstream_model::interface::register::Register;
use bitstream_model::recording::{ChannelRecording, Stage};
use bitstream_model::{Direction, RegisterAccess, StepPhase};

/// The name of a channel, in small letters: `mm2s0`.
pub(crate) fn channel_scope(channel: &ChannelRecording) -> String {
    format!("{}{}", direction(channel.direction).to_lowercase(), channel.core)
}

/// The name of a channel for people: `MM2S 0`.
pub(crate) fn channel(channel: &ChannelRecording) -> String {
    format!("{} {}", direction(channel.direction), channel.core)
}

fn direction(direction: Direction) -> &'static str {
    match direction {
        Direction::Mm2s => "MM2S",
        Direction::S2mm => "S2MM",
    }
}

/// The name of a register: `dma0 MM2S TAILDESC`.
pub(crate) fn register(address: u64) -> String {
    let unknown = || format!("{address:#x}");
    let find = |rows: &[Register], offset: u32| {
        rows.iter().find(|row| row.offset == offset).map(|row| row.name)
    };
    if let Some(offset) = address.checked_sub(CONTROL_BASE) {
        let Some(offset) = u32::try_from(offset).ok().filter(|offset| *offset < CONTROL_BYTES)
        else {
            return unknown();
        };
        return match find(REGISTERS, offset) {
            Some(name) => format!("control {name}"),
            None if offset >= SHAPE_TABLE => "control shape table".to_owned(),
            None => unknown(),
        };
    }
    let Some(offset) = address.checked_sub(DMA_BASE) else { return unknown() };
    let core = offset / DMA_STRIDE;
    let Ok(offset) = u32::try_from(offset % DMA_STRIDE) else { return unknown() };
    let (half, offset) = match offset.checked_sub(S2MM_OFFSET) {
        Some(offset) => (Direction::S2mm, offset),
        None => (Direction::Mm2s, offset),
    };
    match find(&CHANNEL_REGISTERS, offset) {
        Some(name) => format!("dma{core} {} {name}", direction(half)),
        None => unknown(),
    }
}

/// A register access, with its value: `dma0 MM2S TAILDESC <- 0x40`.
pub(crate) fn access(access: &RegisterAccess) -> String {
    let arrow = if access.write { "<-" } else { "->" };
    format!("{} {arrow} {:#x}", register(access.address), access.value)
}

/// The name of a stage of the accelerator.
pub(crate) fn stage(stage: Stage) -> String {
    match stage {
        Stage::Load => "load".to_owned(),
        Stage::Contact(pass) => format!("contact {pass}"),
        Stage::Friction(pass) => format!("friction {pass}"),
        Stage::Integrate => "integrate".to_owned(),
    }
}

/// The name of a packet by the records in it.
pub(crate) fn packet(phase: Option<StepPhase>) -> String {
    match phase {
        None => "packet".to_owned(),
        Some(StepPhase::Load) => "velocities".to_owned(),
        Some(StepPhase::Contact(pass)) => format!("contact {pass}"),
        Some(StepPhase::Friction(pass)) => format!("friction {pass}"),
        Some(StepPhase::Poses) => "poses".to_owned(),
        Some(StepPhase::Results) => "results".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_register_is_named_by_its_address() {
        for (address, name) in [
            (0xA000_0010, "dma0 MM2S TAILDESC"),
            (0xA002_0034, "dma2 S2MM DMASR"),
            (0xA004_0000, "control AP_CTRL"),
            (0xA004_0410, "control shape table"),
            (0xA004_1000, "0xa0041000"),
            (0x1000, "0x1000"),
        ] {
            assert_eq!(register(address), name);
        }
    }
}
