//! The verb `list`: lists the boards of the system, and the obstacles to their use.

mod inventory;

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};
use zynq_pgs::platform::{
    System, UioListing, fpga_managers, require_bitstream, u_dma_buf_names, uio_listing,
};

use inventory::{Buffer, Node, explained, state, unreadable_json};
use pgs_command::board;
use pgs_command::common::{BoardOptions, CommonArgs};
use pgs_command::failure::{Failure, Result, Verdict};
use pgs_command::output::SCHEMA;
use pgs_command::output::facts::whole;

const EXAMPLES: &str = "\
Examples:
  pgs list
  pgs list --json

A UIO node is recognised by its regions, independently of its name; its line shows the option that
uses it.";

/// List the boards of this system, with the reason where one is unusable
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ListArgs {
    /// Directory that holds the system's files, for tests.
    #[arg(long, hide = true, default_value = "/")]
    system_root: PathBuf,
    #[command(flatten)]
    pub(crate) board: BoardOptions,
}

/// Columns of a label.
const LABEL: usize = 12;

/// Lists the boards.
pub(crate) fn run(args: &ListArgs, common: &CommonArgs, out: &mut dyn Write) -> Result<Verdict> {
    let system = System::under(&args.system_root);
    let (kind, reason) = board::choose(&common.board, &system);
    let chosen = board::kind_text(kind);
    let (listing, error) = match uio_listing(&system.uio) {
        Ok(listing) => (listing, None),
        Err(error) => (UioListing::default(), Some(explained(&error))),
    };
    let UioListing { nodes, unreadable, .. } = listing;
    let nodes: Vec<_> = nodes.into_iter().map(|node| Node::new(node, &system)).collect();
    let buffers = u_dma_buf_names(&system).into_iter().map(|name| Buffer::new(name, &system));
    let buffers: Vec<_> = buffers.collect();
    let managers = fpga_managers(&system.fpga_manager).unwrap_or_default();
    let logic_error = require_bitstream(&system, &common.manager).err();
    if common.json {
        let logic_error = logic_error.map(|error| Failure::input(error).chain());
        let managers: Vec<Value> = managers
            .iter()
            .map(|m| json!({ "device": m.device, "name": m.name, "state": state(m) }))
            .collect();
        let document = json!({
            "schema": SCHEMA,
            "verb": "list",
            "board": { "kind": chosen, "reason": reason },
            "uio_nodes": nodes.iter().map(Node::to_json).collect::<Vec<_>>(),
            "uio_error": error,
            "unreadable_uio_nodes": unreadable.iter().map(unreadable_json).collect::<Vec<_>>(),
            "u_dma_bufs": buffers.iter().map(|buffer| &buffer.name).collect::<Vec<_>>(),
            "u_dma_buf_states": buffers.iter().map(Buffer::to_json).collect::<Vec<_>>(),
            "fpga_managers": managers,
            "logic_error": logic_error,
            "emulated": { "available": true },
        });
        writeln!(out, "{document:#}")?;
        return Ok(Verdict::Done);
    }

    let mut line =
        |label: &str, text: String| whole(out, &format!("{label:<LABEL$}"), LABEL, &text);
    line("would open", format!("{chosen} ({reason})"))?;
    if let Some(error) = error {
        line("uio nodes", format!("cannot be listed: {error}"))?;
    } else if nodes.is_empty() && unreadable.is_empty() {
        line("uio nodes", format!("none in {}", system.uio.display()))?;
    }
    for Node { node, obstacle, .. } in &nodes {
        let state = obstacle.as_deref().unwrap_or("usable");
        line("uio node", format!("{} {:?}: {state}", node.device, node.name))?;
        for map in &node.maps {
            let label = format!("  map {}", map.index);
            line(&label, format!("{:?} at {:#x}, {} bytes", map.name, map.address, map.bytes))?;
        }
    }
    for node in &unreadable {
        let error = explained(&node.error);
        line("uio node", format!("{} cannot be read: {error}", node.device))?;
    }
    for buffer in &buffers {
        line("u-dma-buf", format!("{:?}: {}", buffer.name, buffer.text()))?;
    }
    for manager in &managers {
        line("fpga", format!("{manager}: {}", state(manager)))?;
    }
    if let Some(error) = logic_error {
        line("logic", explained(&error))?;
    }
    line("emulated", "always available".to_owned())?;
    Ok(Verdict::Done)
}
