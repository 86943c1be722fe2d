//! This file says why a bitstream could not be loaded, whose fault it is and what to do.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;
use zynq_pgs::PlatformError;

use crate::failure::Cause;

/// Why loading was refused or failed.
#[derive(Debug, Error)]
pub(crate) enum LoadError {
    #[error("cannot read {}", path.display())]
    Unreadable { path: PathBuf, source: io::Error },
    #[error("{}: expected {expected}, found {found}", path.display())]
    Kind { path: PathBuf, expected: &'static str, found: &'static str },
    #[error("{name:?} below the firmware folder cannot be given to the kernel: {reason}")]
    Name { name: String, reason: &'static str },
    #[error("no FPGA manager in {}: this kernel cannot load a bitstream", class.display())]
    NoManager { class: PathBuf },
    #[error(
        "{manager} has no file \"firmware\" in {}: mainline kernels do not let a program load a \
         bitstream, the vendor's (linux-xlnx) does", directory.display()
    )]
    NoFirmwareFile { manager: String, directory: PathBuf },
    #[error("{manager} has no file \"flags\" in {}: it loads full bitstreams only", directory.display())]
    NoFlags { manager: String, directory: PathBuf },
    #[error("{device} is open in {users}: DMA cores may be running")]
    InUse { device: String, users: String },
    #[error("no overlays in {}: {reason}", searched.display())]
    NoOverlays { searched: PathBuf, reason: &'static str, mounted: bool },
    #[error("the overlay {} is there already, {status}", directory.display())]
    OverlayPresent { directory: PathBuf, status: String },
    #[error(
        "the UIO node {node:?} (/dev/{device}) is there already, from another overlay or from the base tree"
    )]
    NodePresent { node: String, device: String },
    #[error("cannot {act} {}", path.display())]
    File { act: &'static str, path: PathBuf, source: io::Error },
    #[error(transparent)]
    Platform(#[from] PlatformError),
    #[error("{manager} refused the bitstream; its state is {state:?}{detail}")]
    Refused { manager: String, state: String, detail: String, source: io::Error },
    #[error(
        "{manager} took the bitstream, but its state is {state:?} instead of \"operating\"{detail}"
    )]
    NotOperating { manager: String, state: String, detail: String },
    #[error(
        "the bitstream is loaded, but the kernel did not apply the overlay: expected status \"applied\", found {status:?}"
    )]
    NotApplied { status: String, source: Option<io::Error> },
    #[error("the bitstream is loaded and the overlay applied, but there is no UIO node \"pgs\"")]
    NoNode,
}

impl LoadError {
    pub(super) fn unreadable(path: &Path, source: io::Error) -> Self {
        Self::Unreadable { path: path.to_owned(), source }
    }

    pub(super) fn kind(path: &Path, expected: &'static str, found: &'static str) -> Self {
        Self::Kind { path: path.to_owned(), expected, found }
    }

    pub(super) fn file(act: &'static str, path: &Path, source: io::Error) -> Self {
        Self::File { act, path: path.to_owned(), source }
    }

    /// Whose fault it is.
    pub(crate) fn cause(&self) -> Cause {
        match self {
            Self::Unreadable { .. } | Self::Kind { .. } | Self::Name { .. } => Cause::Input,
            Self::Refused { .. } | Self::NotOperating { .. } => Cause::Hardware,
            _ => Cause::NoBoard,
        }
    }

    /// What to do.
    pub(crate) fn next(&self) -> String {
        match self {
            Self::Unreadable { .. } => "give the path of a file that can be read".to_owned(),
            Self::Kind { .. } => {
                "see device-tree/README.md for how the files are made".to_owned()
            }
            Self::Name { .. } => "rename the file, or give one from another folder".to_owned(),
            Self::NoManager { .. } => {
                "on the board: boot a kernel with CONFIG_FPGA_MGR_ZYNQMP_FPGA and a tree with its \
                 node; elsewhere there is nothing to load, and the other verbs take --board emulated"
                    .to_owned()
            }
            Self::NoFirmwareFile { .. } => {
                "boot the vendor's kernel, or load the bitstream at boot: from the boot image, or \
                 by U-Boot's `fpga load`"
                    .to_owned()
            }
            Self::NoFlags { .. } => "load a full bitstream, without --partial".to_owned(),
            Self::InUse { .. } => "stop them, then run the command again".to_owned(),
            Self::NoOverlays { mounted: false, searched, .. } => {
                format!("mount -t configfs configfs {}", searched.display())
            }
            Self::NoOverlays { .. } => "boot the vendor's kernel with CONFIG_OF_CONFIGFS, or put \
                                        the node into the base tree and leave out --overlay"
                .to_owned(),
            Self::OverlayPresent { directory, .. } => {
                format!(
                    "remove it by `rmdir {}`, or leave out --overlay to keep it",
                    directory.display()
                )
            }
            Self::NodePresent { .. } => {
                "leave out --overlay to keep it, or remove the overlay that made it".to_owned()
            }
            Self::File { source, .. } if source.kind() == io::ErrorKind::PermissionDenied => {
                "run the command as root".to_owned()
            }
            Self::File { .. } | Self::Platform(_) => {
                "look for the cause in the kernel's log: dmesg | tail".to_owned()
            }
            Self::Refused { .. } | Self::NotOperating { .. } => {
                "look into dmesg; is it a .bit.bin for this chip, made by bootgen -arch zynqmp? \
                 Do not touch the registers before the state is operating"
                    .to_owned()
            }
            Self::NotApplied { .. } => {
                "look into dmesg; was the base tree compiled with -@ (is there \
                 /proc/device-tree/__symbols__/gic)?"
                    .to_owned()
            }
            Self::NoNode => "is uio_pdrv_genirq there, and uio_pdrv_genirq.of_id=generic-uio on \
                             the kernel's command line? See `pgs list`"
                .to_owned(),
        }
    }
}
