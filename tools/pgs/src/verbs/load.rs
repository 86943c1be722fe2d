//! The verb `load`: loads a bitstream into the logic, and an overlay into the device tree.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};

use crate::common::CommonArgs;
use crate::failure::{Cause, Failure, Verdict};
use crate::loading::{self, AtFault, Linux, LoadError, Request};
use crate::output::SCHEMA;
use crate::output::milliseconds;

const EXAMPLES: &str = "\
Examples on a board:
  pgs load zynq-pgs.bit.bin --overlay zynq-pgs.dtbo
  pgs load zynq-pgs.bit.bin
  pgs load --json /lib/firmware/xilinx/zynq-pgs/zynq-pgs.bit.bin
  pgs load zynq-pgs.bit.bin --manager fpga1    if several FPGA managers may be the ZynqMP's

Needs root and the vendor's kernel. A file outside the kernel's firmware folders is copied there
during loading. The command refuses to load while a program has a UIO node of the logic or /dev/mem
open. Without --replace-others it also refuses while another overlay is applied or a driver is
bound to the logic. Remove the overlay by rmdir /sys/kernel/config/device-tree/overlays/pgs; see
device-tree/README.md.";

/// Load a bitstream into the board through the kernel's FPGA manager.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct LoadArgs {
    /// Bitstream in bootgen's format (.bit.bin).
    file: PathBuf,
    /// Compiled overlay, applied after the bitstream is loaded.
    #[arg(long, value_name = "DTBO")]
    overlay: Option<PathBuf>,
    /// The bitstream is a partial one.
    #[arg(long)]
    partial: bool,
    /// Load although other overlays or kernel drivers are bound to the logic. They stay bound, and
    /// their behaviour with the new logic is unknown.
    #[arg(long)]
    replace_others: bool,
    /// Directory that holds the system's files, for tests.
    #[arg(long, hide = true, default_value = "/")]
    system_root: PathBuf,
}

impl From<LoadError> for Failure {
    fn from(error: LoadError) -> Self {
        let next = error.next();
        let cause = match error.at_fault() {
            AtFault::Caller => Cause::Input,
            AtFault::System => Cause::NoBoard,
            AtFault::Logic => Cause::Hardware,
        };
        Self::new(cause, error).next(next)
    }
}

/// Loads a bitstream.
pub(crate) fn run(
    args: &LoadArgs,
    common: &CommonArgs,
    out: &mut dyn Write,
) -> Result<Verdict, Failure> {
    let system = Linux { root: args.system_root.clone() };
    let request = Request {
        bitstream: args.file.clone(),
        overlay: args.overlay.clone(),
        partial: args.partial,
        manager: common.manager.clone(),
        replace_others: args.replace_others,
    };
    let loaded = loading::load(&system, &request)?;
    let kind = if args.partial { "partial" } else { "full" };
    if common.json {
        let nodes: Vec<Value> = loaded
            .nodes
            .iter()
            .map(|node| json!({ "device": node.device, "name": node.name }))
            .collect();
        let document = json!({
            "schema": SCHEMA,
            "verb": "load",
            "bitstream": {
                "file": args.file.display().to_string(),
                "bytes": loaded.bytes,
                "kind": kind,
                "firmware": loaded.firmware,
                "copied": loaded.copied,
            },
            "manager": {
                "device": loaded.manager,
                "name": loaded.manager_name,
                "state_before": loaded.state_before,
                "state": loaded.state,
            },
            "load_ms": milliseconds(loaded.time),
            "overlay": loaded.overlay,
            "uio_nodes": nodes,
        });
        writeln!(out, "{document:#}")?;
        return Ok(Verdict::Done);
    }

    writeln!(out, "bitstream  {}, {} bytes, {kind}", args.file.display(), loaded.bytes)?;
    writeln!(
        out,
        "manager    {} ({}): {} -> {}, {:.1} ms",
        loaded.manager,
        loaded.manager_name,
        loaded.state_before,
        loaded.state,
        milliseconds(loaded.time),
    )?;
    if let Some(overlay) = loaded.overlay {
        writeln!(out, "overlay    {overlay:?} applied")?;
    }
    for node in &loaded.nodes {
        writeln!(out, "uio node   {} {:?}", node.device, node.name)?;
    }
    if loaded.nodes.is_empty() {
        writeln!(out, "uio node   none: apply an overlay, see device-tree/README.md")?;
    }
    Ok(Verdict::Done)
}
