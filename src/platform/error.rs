//! Names each obstacle between the driver and a board's registers, memory and interrupt.
//!
//! The message says what to do. Where that depends on the kernel's answer,
//! [`PlatformError::next_step`] says it.

use std::path::PathBuf;

use pgs_interface::fence::Fence;
use thiserror::Error;

/// The outcome of a request to the platform.
pub(crate) type Result<T, E = PlatformError> = std::result::Result<T, E>;

/// Why a request to the platform failed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PlatformError {
    /// The emulated board refused a request for its memory.
    #[error("cannot {act} DMA memory ({what} {value:#x})")]
    Memory {
        /// The attempt, as a verb.
        act: &'static str,
        /// The meaning of `value`: a length in bytes, or an address.
        what: &'static str,
        /// The length or the address.
        value: u64,
        /// Why.
        #[source]
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// Memory lies where the DMA cores cannot reach it.
    #[error(
        "a buffer of {bytes} bytes at {address:#x} is out of reach of DMA cores with \
         {address_width}-bit addresses: reserve memory below 2^{address_width}"
    )]
    OutOfReach {
        /// Bus address of the buffer.
        address: u64,
        /// Its length, bytes.
        bytes: u64,
        /// Width of the cores' addresses, bits.
        address_width: u32,
    },
    /// Memory lies outside the segment that the bitstream confines its DMA cores to.
    #[error(
        "{bytes} bytes at {address:#x} of the memory {region:?} lie outside the fence {fence} of \
         the bitstream, where no DMA core reaches them: reserve the memory of the fence in the \
         device tree, or build the bitstream for this memory with `rtlgen generate --memory`"
    )]
    OutsideFence {
        /// The memory: a UIO node, a u-dma-buf, or a file.
        region: String,
        /// Bus address of the buffer, or of the memory as a whole.
        address: u64,
        /// Its length, bytes.
        bytes: u64,
        /// The fence.
        fence: Fence,
    },
    /// A range does not lie inside its buffer.
    #[error("{bytes} bytes at offset {offset} do not lie in a buffer of {buffer_bytes} bytes")]
    OutOfBuffer {
        /// First byte asked for.
        offset: u64,
        /// Number of bytes asked for.
        bytes: u64,
        /// Length of the buffer, bytes.
        buffer_bytes: u64,
    },
    /// A register region is too short.
    #[error(
        "register region {region} has {found} bytes, at least {expected} are needed: is this the \
         device tree of the bitstream?"
    )]
    ShortRegion {
        /// Name of the region.
        region: String,
        /// Bytes needed.
        expected: u32,
        /// Bytes found.
        found: u64,
    },
    /// The use of a file failed.
    #[error("cannot {act} {}", path.display())]
    File {
        /// The attempt, as a verb.
        act: &'static str,
        /// Which file.
        path: PathBuf,
        /// Why.
        #[source]
        source: std::io::Error,
    },
    /// A file of the kernel holds something else than a number.
    #[error("expected a number in {}, found {found:?}", path.display())]
    NotANumber {
        /// Which file.
        path: PathBuf,
        /// Its text.
        found: String,
    },
    /// There is no such UIO node.
    #[error(
        "no UIO node named {wanted:?} (found: {}): is the overlay loaded? see \
         device-tree/README.md",
        if found.is_empty() { "none" } else { found }
    )]
    NoNode {
        /// The requested name.
        wanted: String,
        /// The names of all nodes.
        found: String,
    },
    /// Several UIO nodes have one name.
    #[error(
        "several UIO nodes are named {wanted:?} ({devices}): give each its own `linux,uio-name` in \
         the device tree, or remove the overlay of the others"
    )]
    SeveralNodes {
        /// The requested name.
        wanted: String,
        /// The nodes that have it.
        devices: String,
    },
    /// A node lacks a region.
    #[error(
        "UIO node {node:?} has no map named {map:?} (found: {}): is this the accelerator's \
         overlay? `reg-names` gives the names",
        if found.is_empty() { "none" } else { found }
    )]
    NoMap {
        /// Name of the node.
        node: String,
        /// Name of the missing map.
        map: String,
        /// The names of the node's maps.
        found: String,
    },
    /// A device file may not be opened.
    #[error("no right to open {}", path.display())]
    Permission {
        /// Which file.
        path: PathBuf,
        /// The kernel's answer.
        #[source]
        source: std::io::Error,
    },
    /// There is no device file.
    #[error("there is no device file {}", path.display())]
    NoDevice {
        /// Which file.
        path: PathBuf,
    },
    /// A plain file lies in the place of a device file.
    #[error(
        "{} is a plain file of {found} bytes, expected a device with at least {expected}: remove \
         it, and let udev make the device file (udevadm trigger)",
        path.display()
    )]
    NotADevice {
        /// The file.
        path: PathBuf,
        /// Bytes of the device's regions.
        expected: u64,
        /// Bytes of the file.
        found: u64,
    },
    /// The programmable logic is not programmed, or the kernel does not know that it is.
    #[error(
        "no bitstream is loaded as far as the kernel knows: expected \"operating\" in {}, found \
         {found:?}; refusing to touch the programmable logic",
        path.display()
    )]
    NoBitstream {
        /// The file with the manager's state.
        path: PathBuf,
        /// The state.
        found: String,
    },
    /// There is no such FPGA manager.
    #[error(
        "no FPGA manager {wanted:?} (found: {})",
        if found.is_empty() { "none" } else { found }
    )]
    NoManager {
        /// The requested manager.
        wanted: String,
        /// All managers, with their names.
        found: String,
    },
    /// Several FPGA managers may be the logic's own.
    #[error("several FPGA managers are named as the ZynqMP's own (found: {found})")]
    SeveralManagers {
        /// All managers, with their names.
        found: String,
    },
    /// FPGA managers exist, and none is known to be the logic's own.
    #[error(
        "no FPGA manager is named {:?} (found: {found}): if one of those programs this logic, \
         name it with --manager, as fpga0; if the logic is known to be programmed, --manager none \
         (`OpenOptions::manager`)",
        super::ZYNQMP_MANAGER
    )]
    OtherManagers {
        /// All managers, with their names.
        found: String,
    },
    /// A UIO node has no interrupt.
    #[error(
        "UIO node {node:?} ({device}) carries no interrupt: add `interrupts` to its device-tree \
         node, or do without"
    )]
    NoInterrupt {
        /// Name of the node.
        node: String,
        /// The kernel's name for it.
        device: String,
    },
    /// The kernel took the logic away while it was open.
    #[error(
        "{why} while it was open: no register is touched any more; load the bitstream and its \
         overlay again if need be, then open the board again"
    )]
    Lost {
        /// The part that went away, in words.
        why: String,
    },
    /// An access does not lie in its region.
    #[error(
        "{bytes} bytes at {at:#x} do not lie aligned in region {region} of {region_bytes} bytes"
    )]
    OutOfRegion {
        /// Name of the region.
        region: String,
        /// First byte asked for.
        at: u64,
        /// Number of bytes asked for.
        bytes: u64,
        /// Length of the region, bytes.
        region_bytes: u64,
    },
    /// A region is larger than the address space.
    #[error("region {region} of {bytes} bytes does not fit the address space: correct its `reg`")]
    TooLarge {
        /// Name of the region.
        region: String,
        /// Its length, bytes.
        bytes: u64,
    },
    /// Reserved memory does not begin on a beat.
    #[error("memory {region} at {address:#x} must begin on a multiple of 16: correct its `reg`")]
    Misaligned {
        /// Name of the region.
        region: String,
        /// Where it begins.
        address: u64,
    },
    /// There is no room left for DMA buffers.
    #[error(
        "no room for a DMA buffer of {wanted} bytes: {largest} are free in one piece, of {total} \
         in all; reserve more memory, see device-tree/README.md"
    )]
    Exhausted {
        /// Bytes asked for.
        wanted: u64,
        /// The largest piece that is free, bytes.
        largest: u64,
        /// The whole pool, bytes.
        total: u64,
    },
    /// A buffer is not in the state that a request presumes.
    #[error("the DMA buffer at {address:#x} is not {state}")]
    NotGivenOut {
        /// Its bus address.
        address: u64,
        /// The presumed state, as "with the CPU".
        state: &'static str,
    },
    /// There is no such u-dma-buf.
    #[error(
        "no u-dma-buf named {wanted:?} (found: {}): is the module loaded, with a buffer of that \
         name? see device-tree/README.md",
        if found.is_empty() { "none" } else { found }
    )]
    NoUDmaBuf {
        /// The requested name.
        wanted: String,
        /// The names of all u-dma-buf buffers.
        found: String,
    },
    /// A u-dma-buf has the wrong mode, and the mode cannot be changed.
    #[error(
        "u-dma-buf {name:?} has sync_mode {found}, which cannot give {wanted}, and 2 cannot be \
         written to {}",
        path.display()
    )]
    SyncMode {
        /// Name of the buffer.
        name: String,
        /// Its mode.
        found: u64,
        /// The required kinds of memory.
        wanted: &'static str,
        /// Where to change the mode.
        path: PathBuf,
        /// The kernel's answer.
        #[source]
        source: std::io::Error,
    },
    /// The caches of a u-dma-buf cannot be maintained.
    #[error("cached DMA buffers need cache maintenance, which {} does not give", path.display())]
    NoMaintenance {
        /// The attribute that requests maintenance.
        path: PathBuf,
        /// The kernel's answer.
        #[source]
        source: std::io::Error,
    },
    /// A u-dma-buf does not keep the mode that was written.
    #[error(
        "u-dma-buf {name:?} was given sync_mode {written} for {wanted}, and says {found:?} in {}: \
         set `sync-mode = <2>` in its device-tree node",
        path.display()
    )]
    SyncModeRefused {
        /// Name of the buffer.
        name: String,
        /// The written mode.
        written: u64,
        /// The mode that the attribute shows afterwards.
        found: String,
        /// The required kinds of memory.
        wanted: &'static str,
        /// The attribute.
        path: PathBuf,
    },
    /// A memory region cannot serve as DMA memory.
    #[error("memory {region} of {bytes} bytes at {address:#x} cannot be used: {reason}")]
    UnusableMemory {
        /// Name of the region.
        region: String,
        /// Its address.
        address: u64,
        /// Its length, bytes.
        bytes: u64,
        /// Why, and what to do.
        reason: &'static str,
    },
    /// There is no memory for DMA.
    #[error(
        "no memory for DMA: neither a u-dma-buf named {u_dma_buf:?} nor a UIO node named {node:?}; \
         add one (see device-tree/README.md), or name another with --memory"
    )]
    NoMemory {
        /// Name of the missing u-dma-buf.
        u_dma_buf: &'static str,
        /// Name of the missing UIO node.
        node: &'static str,
    },
    /// Another user holds the lock of a device file.
    #[error(
        "{} is locked: another program, or another accelerator of this one, uses it; end that \
         first, or share it: one accelerator steps several worlds in turn (docs/library.md, Two \
         worlds on one board)",
        path.display()
    )]
    Busy {
        /// The locked file.
        path: PathBuf,
    },
    /// A map is mapped already.
    #[error("map {map:?} of UIO node {node:?} is mapped already: drop its window first")]
    MappedAlready {
        /// Name of the node.
        node: String,
        /// Name of the map.
        map: String,
    },
    /// A property of the device tree has an unusable value.
    #[error("expected {expected} in {}, found {found:02x?}: correct the device \
             tree", path.display())]
    DeviceTree {
        /// Which property.
        path: PathBuf,
        /// The expected value, in words.
        expected: &'static str,
        /// Its bytes.
        found: Vec<u8>,
    },
    /// Kernel and device tree disagree on the length of a region.
    #[error(
        "region {region}: the kernel gives it {kernel} bytes in whole pages, `reg` in the device \
         tree {}; refusing to guess where it ends: correct its `reg`",
        found.map_or_else(|| "nothing".to_owned(), |bytes| format!("{bytes} bytes"))
    )]
    RegionLength {
        /// Name of the region.
        region: String,
        /// Length by the kernel, from the region's first byte to the end of its last page.
        kernel: u64,
        /// Length by the device tree, if it has that region.
        found: Option<u64>,
    },
    /// The kernel refuses an access through `/dev/mem`.
    #[error(
        "the kernel does not let {} be {act} at {address:#x}: it needs root, and a kernel with \
         STRICT_DEVMEM gives only what it does not use; prefer a UIO node",
        path.display()
    )]
    DevMemRefused {
        /// The refused act, as a participle.
        act: &'static str,
        /// Where.
        address: u64,
        /// The file.
        path: PathBuf,
        /// The kernel's answer.
        #[source]
        source: std::io::Error,
    },
    /// A range lies outside the windows that were configured for `/dev/mem`.
    #[error(
        "{bytes} bytes at {address:#x} lie in none of the windows configured for /dev/mem; \
         refusing to map them"
    )]
    OutOfWindows {
        /// First byte asked for.
        address: u64,
        /// Number of bytes asked for.
        bytes: u64,
    },
    /// A window for `/dev/mem` overlaps memory that the kernel uses.
    #[error(
        "the window at {address:#x} overlaps the kernel's memory {ram}: reserve it with `no-map` \
         in the device tree first"
    )]
    KernelMemory {
        /// First byte of the window.
        address: u64,
        /// The memory, as `/proc/iomem` lists it.
        ram: String,
    },
    /// The connection to a board's socket failed.
    #[error("cannot connect to a board at {}", socket.display())]
    NoServer {
        /// The socket.
        socket: PathBuf,
        /// The kernel's answer.
        #[source]
        source: std::io::Error,
    },
    /// Another driver has the served board.
    #[error(
        "the board served at {} has another driver: end that first, or share it: one accelerator \
         steps several worlds in turn (docs/library.md, Two worlds on one board)",
        socket.display()
    )]
    ServerBusy {
        /// The socket.
        socket: PathBuf,
    },
    /// The process that serves a board does not answer the first message.
    #[error(
        "the board served at {} says nothing within {limit:?}: a step of another driver keeps it \
         busy, or its process hangs; try again, or serve it again",
        socket.display()
    )]
    ServerSilent {
        /// The socket.
        socket: PathBuf,
        /// The longest time for an answer.
        limit: std::time::Duration,
    },
    /// The system of a served board does not give memory for another driver.
    #[error(
        "the board served at {} has no memory for this driver: make room there, or serve it with a \
         smaller --memory-mib",
        socket.display()
    )]
    ServerNoMemory {
        /// The socket.
        socket: PathBuf,
        /// The error of the server's kernel.
        #[source]
        source: std::io::Error,
    },
    /// The memory that came from a served board is not what the messages promise.
    #[error(
        "the board served at {} sent no memory that can be used: expected one sealed file of the \
         announced length, found {found}; serve the board with the `pgs` of this driver",
        socket.display()
    )]
    ServerMemory {
        /// The socket.
        socket: PathBuf,
        /// What came.
        found: String,
    },
    /// The process that serves a board speaks another version of the messages.
    #[error(
        "{} serves version {found} of the messages, expected {expected}: serve the board with the \
         `pgs` of this driver",
        socket.display()
    )]
    OtherServer {
        /// The socket.
        socket: PathBuf,
        /// Version of this driver's messages.
        expected: u32,
        /// Version of the other side's.
        found: u32,
    },
    /// The process that serves a board refuses this driver, whose version is the right one.
    #[error(
        "the board served at {} answers the first message with {found:?}, expected Done: serve the \
         board with the `pgs` of this driver",
        socket.display()
    )]
    ServerRefuses {
        /// The socket.
        socket: PathBuf,
        /// The answer.
        found: pgs_interface::message::Status,
    },
    /// The process that serves a board is gone, or sends nonsense.
    #[error("the board served at {} is lost: serve it again, and open it again", socket.display())]
    ServerLost {
        /// The socket.
        socket: PathBuf,
        /// How.
        #[source]
        source: std::sync::Arc<std::io::Error>,
    },
}
