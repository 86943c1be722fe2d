//! Proves that the fence of the bitstream holds every DMA master: the ring or the buffer of one
//! master lies behind the fence, in memory that is reserved for this test, and the step must end
//! with a decode error of this master. Without a fence the step works, and changes nothing else.

use std::sync::Arc;

use pgs_interface::axi_dma::dmasr;
use pgs_interface::fence::Fence;

use super::bring_up::chain;
use super::pattern::Pattern;
use super::report::Outcome;
use crate::board::{Guarded, Master};
use crate::error::Error;
use crate::platform::Platform;
use crate::step::{Accelerator, Echo};

/// Bodies of a probe: few, and beats for every channel.
const BODIES: u32 = 7;

/// Probes every master.
pub(super) fn fence(accelerator: &mut Accelerator) -> Outcome {
    let Some(fence) = accelerator.capabilities().fence else {
        return not_proven(
            "the bitstream reports no fence: only the driver confines its DMA cores",
        );
    };
    let guard: Arc<dyn Platform> = match accelerator.guard() {
        Ok(Some(guard)) => Arc::new(guard),
        Ok(None) => {
            return not_proven(&format!(
                "no memory is reserved behind {fence}: add the node pgs-guard of \
                 device-tree/zynq-pgs-memory.dtsi"
            ));
        }
        Err(error) => return not_proven(&chain(&error)),
    };
    let extent = guard.memory().extent();
    let Some((at, bytes)) = extent.filter(|(at, bytes)| apart(&fence, *at, *bytes)) else {
        return not_proven(&format!("the guard does not lie behind {fence}: correct its address"));
    };
    let (mut open, mut masters) = (Vec::new(), 0);
    for core in 0..accelerator.capabilities().mm2s_channels {
        for master in Master::ALL {
            let guarded = Guarded { guard: &guard, core, master };
            masters += 1;
            match probe(accelerator, &guarded) {
                Ok(Held::Yes) => {}
                Ok(Held::No) => open.push(guarded.to_string()),
                Err(found) => {
                    return Outcome::failed(
                        format!("{guarded}: {found}"),
                        "a decode error of this master alone",
                        "see what the line echo says; load the bitstream again",
                    );
                }
            }
        }
    }
    if open.is_empty() {
        return Outcome::ok(format!(
            "{fence} holds {masters} masters: each met a decode error in the {bytes} bytes at \
             {at:#x}"
        ));
    }
    Outcome::failed(
        format!("{} in reach of {at:#x}, behind the fence {fence}", open.join(", ")),
        format!("a decode error of each of {masters} masters"),
        "give every master of the DMA cores this one segment in the block design, and exclude all \
         others (tools/vivado/build.tcl); until then only the driver confines them",
    )
}

fn not_proven(reason: &str) -> Outcome {
    Outcome::skipped(format!("not proven: {reason}"))
}

/// Whether none of these bytes lies in the fence.
fn apart(fence: &Fence, address: u64, bytes: u64) -> bool {
    address >= fence.end() || address.saturating_add(bytes) <= fence.base()
}

/// Whether the fence holds a master.
enum Held {
    Yes,
    No,
}

/// Takes a step with the memory of one master in the guard. The error is an end that says nothing
/// about the fence.
fn probe(accelerator: &mut Accelerator, guarded: &Guarded<'_>) -> Result<Held, String> {
    let pattern = Pattern::of(&accelerator.capabilities().variant);
    let bodies = pattern.bodies(0x300, BODIES);
    let echo = Echo {
        bodies: &bodies,
        short_pieces: false,
        fresh_buffers: true,
        filler: None,
        guarded: Some(*guarded),
    };
    let error = match accelerator.echo(&echo) {
        Ok(_) => return Ok(Held::No),
        Err(error) => error,
    };
    let expected = match guarded.master {
        Master::Sg => dmasr::SG_DEC_ERR,
        Master::Data(_) => dmasr::DMA_DEC_ERR,
    };
    let channels = match &error {
        Error::Step { diagnosis: Some(diagnosis), .. } => diagnosis.channels.as_slice(),
        _ => &[],
    };
    let of_master = channels.iter().find(|state| state.channel == guarded.channel());
    match of_master {
        Some(state) if state.status.errors() == expected.mask() && !error.must_reopen() => {
            Ok(Held::Yes)
        }
        _ => Err(chain(&error)),
    }
}
