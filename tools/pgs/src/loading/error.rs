//! The errors of loading a bitstream: who is at fault, and the next step.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;
use zynq_pgs::platform::PlatformError;

use super::chip::Chip;
use super::progress::Stage;

/// The party at fault when loading fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AtFault {
    /// The command line, or a file named on it.
    Caller,
    /// The kernel: its configuration, other programs, rights.
    System,
    /// The programmable logic, which did not take the bitstream.
    Logic,
}

/// Why loading was refused or failed.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of each says it")]
pub enum LoadError {
    #[error("cannot read {}", path.display())]
    Unreadable { path: PathBuf, source: io::Error },
    #[error("{}: expected a bitstream (.bit.bin), found {found}", path.display())]
    Bitstream { path: PathBuf, found: String, next: String },
    #[error("{}: expected a bitstream for {part}, found one for {found}", path.display())]
    OtherChip { path: PathBuf, found: Chip, part: Chip },
    #[error("{}: the bitstream breaks off after {bytes} bytes, {how}", path.display())]
    CutOff { path: PathBuf, bytes: usize, how: String },
    #[error("{}: the bitstream cannot be judged: {reason}", path.display())]
    Unjudged { path: PathBuf, reason: String },
    /// Loaded all the same, but is no good answer to a check.
    #[error(
        "{}: the bitstream cannot be judged: nothing but zeros follows its sync word",
        path.display()
    )]
    Empty { path: PathBuf },
    #[error("{}: expected a compiled overlay (.dtbo), found {found}", path.display())]
    Overlay { path: PathBuf, found: String },
    #[error(
        "{}: the overlay has the kernel load {firmware:?} (its firmware-name), and the bitstream \
         given is {given:?}", path.display()
    )]
    OwnFirmware { path: PathBuf, firmware: String, given: String },
    #[error(
        "{}: the overlay sets the PL clock 0 to {sets_hz} Hz, and the bitstream asks for {wanted} \
         MHz (its USR_ACCESS): at another rate the logic miscalculates or hangs the processor",
        path.display()
    )]
    OtherClock { path: PathBuf, sets_hz: u32, wanted: u32 },
    #[error("{name:?} below the firmware folder cannot be given to the kernel: {reason}")]
    Name { name: String, reason: &'static str },
    #[error("loading needs an FPGA manager, and --manager none names none")]
    Unasked,
    #[error("no FPGA manager in {}: this kernel cannot load a bitstream", class.display())]
    NoManager { class: PathBuf },
    #[error(
        "{manager} has no file \"firmware\" in {}: mainline kernels do not let a program load a \
         bitstream, the vendor's (linux-xlnx) does", directory.display()
    )]
    NoFirmwareFile { manager: String, directory: PathBuf },
    #[error("{device} is open in {users}: DMA cores may be running")]
    InUse { device: String, users: String },
    #[error(
        "{device} is locked by a program that does not show in /proc here: DMA cores may be running"
    )]
    Locked { device: String },
    #[error(
        "other overlays are there, whose drivers may be bound to the logic: {}",
        listed(overlays)
    )]
    OtherOverlays { overlays: Vec<(PathBuf, String)> },
    #[error("drivers of the kernel are bound to the logic: {drivers}")]
    Drivers { drivers: String },
    #[error("no overlays in {}: {reason}", searched.display())]
    NoOverlays { searched: PathBuf, reason: &'static str, mounted: bool },
    #[error("the overlay {} is there already, {status}", directory.display())]
    OverlayPresent { directory: PathBuf, status: String },
    #[error(
        "the UIO node {node:?} (/dev/{device}) is there already, from another overlay or from the \
         base tree"
    )]
    NodePresent { node: String, device: String },
    /// A file of the kernel.
    #[error("cannot use {}", path.display())]
    Attribute { path: PathBuf, source: io::Error },
    /// The bitstream could not be copied to the kernel's firmware folder.
    #[error("cannot copy the bitstream to {}", path.display())]
    Copy { path: PathBuf, bytes: u64, source: io::Error },
    #[error(transparent)]
    Platform(#[from] PlatformError),
    #[error("{manager} refused the bitstream; its state is {state:?}{detail}")]
    Refused { manager: String, firmware: String, state: String, detail: String, source: io::Error },
    #[error(
        "{manager} took the bitstream, but its state is {state:?} instead of \"operating\"{detail}"
    )]
    NotOperating { manager: String, state: String, detail: String },
    #[error(
        "the bitstream is loaded, but the kernel did not apply the overlay: expected status \
         \"applied\", found {status:?}"
    )]
    NotApplied { status: String, source: Option<io::Error> },
    #[error("the bitstream is loaded and the overlay applied, but there is no UIO node \"pgs\"")]
    NoNode,
    #[error("interrupted: {}", match stage {
        Stage::Untouched => "the kernel was given no bitstream, and the logic is as it was",
        Stage::Programming => {
            "the kernel was loading the bitstream: the logic may be empty, half programmed, or \
             running"
        }
        Stage::Programmed => "the bitstream is loaded; an overlay may be applied or not",
    })]
    Interrupted { stage: Stage },
}

/// Lists overlays with their status.
fn listed(overlays: &[(PathBuf, String)]) -> String {
    let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let each = overlays.iter().map(|(path, status)| format!("{:?} ({status})", name(path)));
    each.collect::<Vec<_>>().join(", ")
}

const DMESG: &str = "look for the cause in the kernel's log: dmesg | tail";

impl LoadError {
    pub(super) fn unreadable(path: &Path, source: io::Error) -> Self {
        Self::Unreadable { path: path.to_owned(), source }
    }

    pub(super) fn own_firmware(path: &Path, firmware: &str, given: &str) -> Self {
        let (firmware, given) = (firmware.to_owned(), given.to_owned());
        Self::OwnFirmware { path: path.to_owned(), firmware, given }
    }

    pub(super) fn attribute(path: &Path, source: io::Error) -> Self {
        Self::Attribute { path: path.to_owned(), source }
    }

    /// The party at fault.
    #[must_use]
    pub fn at_fault(&self) -> AtFault {
        match self {
            Self::Unreadable { .. }
            | Self::Bitstream { .. }
            | Self::OtherChip { .. }
            | Self::CutOff { .. }
            | Self::Unjudged { .. }
            | Self::Empty { .. }
            | Self::Overlay { .. }
            | Self::OwnFirmware { .. }
            | Self::OtherClock { .. }
            | Self::Name { .. }
            | Self::Unasked => AtFault::Caller,
            Self::Refused { source, .. } if source.kind() == io::ErrorKind::NotFound => {
                AtFault::System
            }
            Self::Refused { .. } | Self::NotOperating { .. } => AtFault::Logic,
            _ => AtFault::System,
        }
    }

    /// The next step.
    #[must_use]
    pub fn next(&self) -> String {
        match self {
            Self::Unreadable { path, source } => unreadable(path, source),
            Self::Bitstream { next, .. } => next.clone(),
            Self::OtherChip { .. } => "build the design for this chip; or name the board's chip \
                                       with --part, if it is another"
                .to_owned(),
            Self::CutOff { .. } => "copy the file again, and compare its length with the \
                                    original's; or load it as it is with --unjudged"
                .to_owned(),
            Self::Unjudged { reason, .. } if reason.contains("encrypted") => {
                "load it by fpgautil -f, which passes the key's kind on; or as it is with \
                 --unjudged"
                    .to_owned()
            }
            Self::Unjudged { .. } | Self::Empty { .. } => {
                "if it is for this chip, load it as it is with --unjudged; otherwise see \
                 device-tree/README.md for how the files are made"
                    .to_owned()
            }
            Self::OwnFirmware { firmware, .. } => format!(
                "give an overlay without a firmware-name, as zynq-pgs.dtbo; or let this one load \
                 the bitstream, from /lib/firmware/{firmware}: fpgautil -b FILE -o OVERLAY"
            ),
            Self::OtherClock { wanted, .. } => format!(
                "give the overlay of this bitstream: assigned-clock-rates = <{wanted}000000> in \
                 device-tree/zynq-pgs-fabric.dtsi, built again; or load both as they are with \
                 --unjudged"
            ),
            Self::Overlay { found, .. } if found.contains("source") => {
                "compile it: dtc -@ -I dts -O dtb -o x.dtbo x.dtso".to_owned()
            }
            Self::Overlay { found, .. } if found.contains("without a node") => {
                "give the overlay of this bitstream (device-tree/README.md); or apply it all the \
                 same with --unjudged"
                    .to_owned()
            }
            Self::Overlay { .. } => {
                "give the file that dtc -@ made; see device-tree/README.md".to_owned()
            }
            Self::Name { .. } => "rename the file, or give one from another folder".to_owned(),
            Self::Unasked => "leave out --manager, or name one, as fpga0".to_owned(),
            Self::NoManager { .. } => {
                "on the board: boot a kernel with CONFIG_FPGA_MGR_ZYNQMP_FPGA and a tree with its \
                 node; elsewhere there is nothing to load, and the other verbs take --board \
                 emulated"
                    .to_owned()
            }
            Self::NoFirmwareFile { .. } => {
                "boot the vendor's kernel, or load the bitstream at boot: from the boot image, or \
                 by U-Boot's `fpga load`"
                    .to_owned()
            }
            Self::InUse { .. } => "stop them, then run the command again".to_owned(),
            Self::Locked { device } => {
                let file = device.split(' ').next().unwrap_or_default();
                format!("stop it, in its container or as `fuser {file}` names it on the host")
            }
            Self::OtherOverlays { overlays } => {
                let paths = overlays.iter().map(|(path, _)| path.display().to_string());
                format!(
                    "remove them: `xmutil unloadapp` if dfx-mgr applied them, else rmdir {}; or \
                     load all the same with --replace-others",
                    paths.collect::<Vec<_>>().join(" ")
                )
            }
            Self::Drivers { .. } => "remove the overlay that made their devices (`xmutil \
                                     unloadapp`, rmdir), or unbind them: echo DEVICE > \
                                     /sys/bus/platform/drivers/DRIVER/unbind; or load all the same \
                                     with --replace-others"
                .to_owned(),
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
            Self::Attribute { source, .. } => attribute(source).to_owned(),
            Self::Copy { path, bytes, source } => copy(path, *bytes, source),
            Self::Platform(error) => error.next_step().unwrap_or_else(|| {
                "see what there is with `pgs list`, then run the command again".to_owned()
            }),
            Self::Refused { firmware, source, .. } => refused(firmware, source),
            Self::NotOperating { .. } => {
                "look into dmesg; is it a .bit.bin for this chip, made by bootgen -arch zynqmp? \
                 Do not touch the registers before the state is operating"
                    .to_owned()
            }
            Self::NotApplied { source: Some(source), .. }
                if source.kind() == io::ErrorKind::PermissionDenied =>
            {
                attribute(source).to_owned()
            }
            Self::NotApplied { .. } => {
                "look into dmesg; was the base tree compiled with -@ (are gic and zynqmp_clk in \
                 /proc/device-tree/__symbols__)?"
                    .to_owned()
            }
            Self::Interrupted { stage: Stage::Untouched } => "run the command again".to_owned(),
            Self::Interrupted { stage: Stage::Programming } => {
                "touch no register: load the bitstream again".to_owned()
            }
            Self::Interrupted { stage: Stage::Programmed } => {
                "see `pgs list` for the node of an overlay".to_owned()
            }
            Self::NoNode => "is uio_pdrv_genirq there, and uio_pdrv_genirq.of_id=generic-uio on \
                             the kernel's command line? See `pgs list`"
                .to_owned(),
        }
    }
}

/// The next step after a file of the caller that cannot be read.
fn unreadable(path: &Path, source: &io::Error) -> String {
    match source.kind() {
        io::ErrorKind::NotFound => format!(
            "there is no {}: give the path of the file, and in a container one inside it",
            path.display()
        ),
        io::ErrorKind::PermissionDenied => {
            format!("run the command as root, or let it read {}", path.display())
        }
        _ => format!("check the disk or network that holds {}", path.display()),
    }
}

/// The next step after a file of the kernel that cannot be used.
fn attribute(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::PermissionDenied => {
            "run the command as root; in a container: outside of it, or with --privileged"
        }
        io::ErrorKind::ReadOnlyFilesystem => {
            "/sys is mounted read-only here, as in a container: run the command outside of it, or \
             mount it writable (docker run --privileged)"
        }
        io::ErrorKind::ResourceBusy => "another program is loading: wait for it to end, then retry",
        _ => DMESG,
    }
}

/// The next step after a bitstream that cannot be copied to the kernel's firmware folder.
fn copy(path: &Path, bytes: u64, source: &io::Error) -> String {
    let folder = path.parent().unwrap_or(path).display();
    let elsewhere = "name the folder of the file to the kernel, which looks there first: printf %s \
                     FOLDER > /sys/module/firmware_class/parameters/path (as root), then run the \
                     command again";
    match source.kind() {
        io::ErrorKind::ReadOnlyFilesystem => format!("{folder} is read-only: {elsewhere}"),
        io::ErrorKind::PermissionDenied => {
            format!("run the command as root, which may write {folder}; or {elsewhere}")
        }
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            format!("make room for {bytes} bytes in {folder}; or {elsewhere}")
        }
        io::ErrorKind::AlreadyExists if path.exists() => {
            format!("remove {}, which an earlier command has left", path.display())
        }
        _ => format!("see whether {folder} is a folder that can be written; or {elsewhere}"),
    }
}

/// The next step after a bitstream that the manager refused.
fn refused(firmware: &str, source: &io::Error) -> String {
    match source.kind() {
        io::ErrorKind::NotFound => format!(
            "the kernel does not find {firmware:?}: it looks in the folder that \
             /sys/module/firmware_class/parameters/path names and in /lib/firmware, of the system \
             and not of a container"
        ),
        io::ErrorKind::ResourceBusy => {
            "another program is loading: wait for it to end, then retry".to_owned()
        }
        io::ErrorKind::OutOfMemory => {
            "the kernel has no memory in one piece for the bitstream: enlarge its CMA pool \
             (cma=256M on its command line), or load after a reboot"
                .to_owned()
        }
        io::ErrorKind::TimedOut => {
            "the logic did not start in time: is it a bitstream for this chip, and the board's \
             power in order? dmesg | tail says more"
                .to_owned()
        }
        _ => "look into dmesg; is it a .bit.bin for this chip, made by bootgen -arch zynqmp? Do \
            not touch the registers before the state is operating"
            .to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn each_answer_of_the_kernel_has_a_next_step_of_its_own() {
        use io::ErrorKind::{
            NotFound, Other, OutOfMemory, PermissionDenied, ReadOnlyFilesystem, ResourceBusy,
            StorageFull, TimedOut,
        };
        let error = io::Error::from;
        let path = Path::new("/lib/firmware/pgs-load-7.bit.bin");
        let copies = [ReadOnlyFilesystem, PermissionDenied, StorageFull, Other]
            .map(|kind| copy(path, 12_345, &error(kind)));
        assert!(copies[0].contains("/sys/module/firmware_class/parameters/path"), "{}", copies[0]);
        assert!(copies[1].contains("as root"), "{}", copies[1]);
        assert!(copies[2].contains("12345 bytes in /lib/firmware"), "{}", copies[2]);
        let refusals =
            [NotFound, ResourceBusy, OutOfMemory, TimedOut, Other].map(|k| refused("x", &error(k)));
        assert!(refusals[0].contains("not of a container"), "{}", refusals[0]);
        let files = [NotFound, PermissionDenied, Other].map(|k| unreadable(path, &error(k)));
        let attributes = [PermissionDenied, ReadOnlyFilesystem, ResourceBusy, Other]
            .map(|kind| attribute(&error(kind)).to_owned());
        for texts in [&copies[..], &refusals, &files, &attributes] {
            assert_eq!(texts.iter().collect::<BTreeSet<_>>().len(), texts.len(), "{texts:#?}");
        }
    }
}
