//! Finds and opens a board through the kernel: UIO, `/dev/mem`, sysfs and the device tree.

pub(crate) mod dev_mem;
pub(crate) mod device_tree;
pub(crate) mod fpga;
pub(crate) mod lock;
pub(crate) mod mapped;
pub(crate) mod sysfs;
pub(crate) mod system;
pub(crate) mod uio;
pub(crate) mod uio_device;
pub(crate) mod uio_listing;
pub(crate) mod uio_window;
