//! Describes each device: its use, its option, and the obstacle to its use.

use std::error::Error as _;

use bitstream_model::interface::address_map::{
    UIO_CONTROL_MAP, UIO_CONTROL_NODE, UIO_DMA_NODES, UIO_GUARD_NODE, UIO_MEMORY_NODE, UIO_NODE,
};
use serde_json::{Value, json};
use zynq_pgs::platform::{FpgaManager, NodePart, System, UnreadableNode, try_node, try_u_dma_buf};
use zynq_pgs::platform::{PlatformError, UioNode};

/// An error with its causes and next step, in one line.
pub(super) fn explained(error: &PlatformError) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text.push_str(&format!(": {cause}"));
        source = cause.source();
    }
    if let Some(next) = error.next_step() {
        text.push_str(&format!("; {next}"));
    }
    text
}

/// A UIO node.
#[derive(Debug)]
pub(super) struct Node {
    pub(super) node: UioNode,
    /// The obstacle to its use by default; none if it is usable, as far as a look without mapping
    /// tells.
    pub(super) obstacle: Option<String>,
    /// The option that uses the node under its own name, and the option's value.
    uses: Option<(&'static str, String)>,
}

impl Node {
    pub(super) fn new(node: UioNode, system: &System) -> Self {
        let (role, uses) = role(&node);
        // Other devices are not opened.
        let closed = match role.is_none() || uses.is_some() {
            true => try_node(system, &node).err(),
            false => None,
        };
        let obstacles: Vec<_> = role.into_iter().chain(closed.as_ref().map(explained)).collect();
        let obstacle = (!obstacles.is_empty()).then(|| obstacles.join("; "));
        Self { node, obstacle, uses }
    }

    pub(super) fn to_json(&self) -> Value {
        let UioNode { device, name, maps, .. } = &self.node;
        let map = |map: &zynq_pgs::platform::UioMap| json!({ "name": map.name, "address": map.address, "bytes": map.bytes });
        let maps: Vec<Value> = maps.iter().map(map).collect();
        let value_of = |option| match &self.uses {
            Some((found, value)) if *found == option => Some(value),
            _ => None,
        };
        json!({
            "device": device,
            "name": name,
            "maps": maps,
            "obstacle": self.obstacle,
            "in_logic": self.node.is_in_logic(),
            "part": self.node.part().map(part_text),
            "board_option": value_of("--board"),
            "memory_option": value_of("--memory"),
        })
    }
}

fn part_text(part: NodePart) -> &'static str {
    match part {
        NodePart::Accelerator => "accelerator",
        NodePart::Unnamed => "unnamed",
        NodePart::Region(region) => region,
        NodePart::Memory => "memory",
        _ => "other",
    }
}

/// The reason why a node is not used by default, and the option that uses it.
fn role(node: &UioNode) -> (Option<String>, Option<(&'static str, String)>) {
    let name = &node.name;
    let uio_name = |name: &str| format!("give it `linux,uio-name = {name:?}` in the device tree");
    let others = [UIO_CONTROL_NODE, UIO_MEMORY_NODE, UIO_GUARD_NODE];
    let parts = others.into_iter().chain(UIO_DMA_NODES);
    if name == UIO_NODE && node.map(UIO_CONTROL_MAP).is_err() {
        let reason =
            format!("no map named {UIO_CONTROL_MAP:?}: is this the accelerator's overlay?");
        return (Some(reason), None);
    }
    if parts.chain([UIO_NODE]).any(|ours| name == ours) {
        return (None, None);
    }
    let (what, option, own) = match node.part() {
        None if node.is_in_logic() => {
            return (Some("another device, in the programmable logic".to_owned()), None);
        }
        Some(NodePart::Accelerator) => {
            ("the accelerator", Some(("--board", format!("uio:{name}"))), UIO_NODE.to_owned())
        }
        Some(NodePart::Unnamed) => {
            let reason = format!(
                "regions where the accelerator's lie, without their names: give it `reg-names`, \
                 and {}; see device-tree/zynq-pgs.dtsi",
                uio_name(UIO_NODE)
            );
            return (Some(reason), None);
        }
        Some(NodePart::Region(region)) => {
            let board = name.strip_suffix(region).and_then(|rest| rest.strip_suffix('-'));
            let option = board.map(|board| ("--board", format!("uio:{board}")));
            ("a region of the accelerator", option, format!("{UIO_NODE}-{region}"))
        }
        Some(NodePart::Memory) => {
            let option = Some(("--memory", format!("uio:{name}")));
            ("memory for DMA", option, UIO_MEMORY_NODE.to_owned())
        }
        _ => return (Some("another device".to_owned()), None),
    };
    let how = match &option {
        Some((option, value)) => format!("take it with {option} {value}, or {}", uio_name(&own)),
        None => uio_name(&own),
    };
    (Some(format!("{what} under another name: {how}")), option)
}

/// A node whose description cannot be read.
pub(super) fn unreadable_json(node: &UnreadableNode) -> Value {
    json!({ "device": node.device, "name": node.name, "error": explained(&node.error) })
}

/// A buffer of the module u-dma-buf.
#[derive(Debug)]
pub(super) struct Buffer {
    pub(super) name: String,
    /// The best value of `--memory` for it; `None` if it cannot be used.
    pub(super) memory: Option<String>,
    pub(super) obstacle: Option<String>,
}

impl Buffer {
    pub(super) fn new(name: String, system: &System) -> Self {
        let error = try_u_dma_buf(system, &name).err();
        let memory = match error {
            None => Some(format!("u-dma-buf:{name}")),
            Some(PlatformError::NoMaintenance { .. }) => {
                Some(format!("u-dma-buf:{name}:write-combining"))
            }
            Some(_) => None,
        };
        Self { name, memory, obstacle: error.as_ref().map(explained) }
    }

    pub(super) fn text(&self) -> &str {
        self.obstacle.as_deref().unwrap_or("usable")
    }

    pub(super) fn to_json(&self) -> Value {
        json!({ "name": self.name, "memory_option": self.memory, "obstacle": self.obstacle })
    }
}

/// The state that an FPGA manager reports of its logic.
pub(super) fn state(manager: &FpgaManager) -> String {
    manager.state().unwrap_or_else(|error| explained(&error))
}
