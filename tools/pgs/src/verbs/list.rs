//! The verb `list`: which boards there are, and what keeps one from being used.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;

use bitstream_model::interface::address_map::{
    UIO_CONTROL_MAP, UIO_CONTROL_NODE, UIO_DMA_NODES, UIO_MEMORY_NODE, UIO_NODE,
};
use clap::Args;
use serde_json::{Value, json};
use zynq_pgs::platform::{System, require_bitstream, u_dma_buf_names};
use zynq_pgs::{UIO_CLASS, UioNode, uio_nodes};

use super::SCHEMA;
use crate::args::CommonArgs;
use crate::board;
use crate::failure::{Failure, Verdict};

const EXAMPLES: &str = "\
Examples:
  pgs list
  pgs list --json";

/// List the boards: UIO nodes, DMA buffers, what is inaccessible and why, and the emulated board.
#[derive(Debug, Clone, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ListArgs {}

/// Why a node cannot be used; `None` if it can, as far as that shows without mapping it.
fn obstacle(node: &UioNode) -> Option<String> {
    let parts = [UIO_CONTROL_NODE, UIO_MEMORY_NODE].into_iter().chain(UIO_DMA_NODES);
    if !parts.chain([UIO_NODE]).any(|name| node.name == name) {
        return Some("another device".to_owned());
    }
    if node.name == UIO_NODE && !node.maps.iter().any(|map| map.name == UIO_CONTROL_MAP) {
        return Some(format!(
            "no map named {UIO_CONTROL_MAP:?}: is this the accelerator's overlay?"
        ));
    }
    let path = Path::new("/dev").join(&node.device);
    let error = OpenOptions::new().read(true).write(true).open(&path).err()?;
    Some(format!("cannot open {}: {error}: is the udev rule installed?", path.display()))
}

/// Lists what there is.
pub(crate) fn run(
    _: &ListArgs,
    common: &CommonArgs,
    out: &mut dyn Write,
) -> Result<Verdict, Failure> {
    let (kind, reason) = board::choose(&common.board);
    let chosen = board::kind_text(kind);
    let system = System::default();
    let buffers = u_dma_buf_names(&system);
    let logic_error = require_bitstream(&system).err().map(|error| Failure::input(error).chain());
    let (nodes, error) = match uio_nodes(Path::new(UIO_CLASS)) {
        Ok(nodes) => (nodes, None),
        Err(error) => (Vec::new(), Some(Failure::input(error).chain())),
    };
    if common.json {
        let nodes: Vec<Value> = nodes
            .iter()
            .map(|node| {
                let maps: Vec<Value> = node
                    .maps
                    .iter()
                    .map(|m| json!({ "name": m.name, "address": m.address, "bytes": m.bytes }))
                    .collect();
                json!({
                    "device": node.device,
                    "name": node.name,
                    "maps": maps,
                    "obstacle": obstacle(node),
                })
            })
            .collect();
        let document = json!({
            "schema": SCHEMA,
            "verb": "list",
            "board": { "kind": chosen, "reason": reason },
            "uio_nodes": nodes,
            "uio_error": error,
            "u_dma_bufs": buffers,
            "logic_error": logic_error,
            "emulated": { "available": true },
        });
        writeln!(out, "{document:#}")?;
        return Ok(Verdict::Done);
    }

    writeln!(out, "would open  {chosen} ({reason})")?;
    if let Some(error) = error {
        writeln!(out, "uio nodes   cannot be listed: {error}")?;
    } else if nodes.is_empty() {
        writeln!(out, "uio nodes   none in {UIO_CLASS}")?;
    }
    for node in &nodes {
        let state = obstacle(node).unwrap_or_else(|| "usable".to_owned());
        writeln!(out, "uio node    {} {:?}: {state}", node.device, node.name)?;
        for map in &node.maps {
            writeln!(
                out,
                "  map {}     {:?} at {:#x}, {} bytes",
                map.index, map.name, map.address, map.bytes
            )?;
        }
    }
    for name in &buffers {
        writeln!(out, "u-dma-buf   {name:?}")?;
    }
    if let Some(error) = logic_error {
        writeln!(out, "logic       {error}")?;
    }
    writeln!(out, "emulated    always available")?;
    Ok(Verdict::Done)
}
