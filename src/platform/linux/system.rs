//! Knows the paths at which Linux shows devices, in one type, so that a test can use others.

use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

use crate::platform::{PlatformError, Result, UioMap, UioNode};

/// Where Linux lists the UIO nodes.
pub const UIO_CLASS: &str = "/sys/class/uio";

/// Where a Linux system shows its devices. The default is the system that the program runs on.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct System {
    /// Descriptions of the UIO nodes.
    pub uio: PathBuf,
    /// Descriptions of the u-dma-buf buffers.
    pub u_dma_buf: PathBuf,
    /// The same for the older module, udmabuf.
    pub udmabuf: PathBuf,
    /// The FPGA managers, which know the state of programmable logic.
    pub fpga_manager: PathBuf,
    /// Device files.
    pub dev: PathBuf,
    /// The map of physical memory, `/proc/iomem`.
    pub iomem: PathBuf,
}

impl System {
    /// The system whose files lie below `root`.
    #[must_use]
    pub fn under(root: &Path) -> Self {
        Self {
            uio: root.join(UIO_CLASS.trim_start_matches('/')),
            u_dma_buf: root.join("sys/class/u-dma-buf"),
            udmabuf: root.join("sys/class/udmabuf"),
            fpga_manager: root.join("sys/class/fpga_manager"),
            dev: root.join("dev"),
            iomem: root.join("proc/iomem"),
        }
    }
}

impl Default for System {
    fn default() -> Self {
        Self::under(Path::new("/"))
    }
}

/// Opens a device file to read and write; `flags` as for `open`.
pub(crate) fn open_device(path: &Path, flags: i32) -> Result<File> {
    let file = OpenOptions::new().read(true).write(true).custom_flags(flags).open(path);
    file.map_err(|source| obstacle(path, source))
}

/// Tries whether the device file of a node can be opened to read and write.
///
/// # Errors
/// Why not; [`PlatformError::next_step`] says what to do.
pub fn try_node(system: &System, node: &UioNode) -> Result<(), PlatformError> {
    let path = system.dev.join(&node.device);
    let file = open_device(&path, nix::libc::O_NONBLOCK)?;
    let page = page_bytes(&path)?;
    let end = |map: &UioMap| (u64::from(map.index) * page).saturating_add(map.bytes);
    require_bytes(&file, &path, node.maps.iter().map(end).max().unwrap_or(0))
}

/// Refuses a plain file that is shorter than the device whose place it takes: an access past its
/// end ends the process.
pub(crate) fn require_bytes(file: &File, path: &Path, expected: u64) -> Result<()> {
    let metadata = file.metadata().map_err(|source| obstacle(path, source))?;
    if metadata.is_file() && metadata.len() < expected {
        let (path, found) = (path.to_owned(), metadata.len());
        return Err(PlatformError::NotADevice { path, expected, found });
    }
    Ok(())
}

/// Why a device file could not be opened.
pub(crate) fn obstacle(path: &Path, source: io::Error) -> PlatformError {
    let path = path.to_owned();
    match source.kind() {
        io::ErrorKind::PermissionDenied => PlatformError::Permission { path, source },
        io::ErrorKind::NotFound => PlatformError::NoDevice { path },
        _ => PlatformError::File { act: "open", path, source },
    }
}

/// The system's page size; an error names `path`, the file to be mapped.
pub(crate) fn page_bytes(path: &Path) -> Result<u64> {
    let bytes = nix::unistd::sysconf(nix::unistd::SysconfVar::PAGE_SIZE);
    let source = match bytes {
        Ok(Some(bytes)) if bytes > 0 => return Ok(bytes.unsigned_abs()),
        Ok(_) => io::Error::new(io::ErrorKind::Unsupported, "the system gives no page size"),
        Err(errno) => errno.into(),
    };
    Err(PlatformError::File { act: "find the page size for", path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::platform::uio_fake::accelerator;
    use crate::platform::uio_nodes;

    #[test]
    fn the_default_is_the_running_system() {
        let System { uio, u_dma_buf, udmabuf, fpga_manager, dev, iomem } = System::default();
        assert_eq!(uio, Path::new(UIO_CLASS));
        assert_eq!(u_dma_buf, Path::new("/sys/class/u-dma-buf"));
        assert_eq!(udmabuf, Path::new("/sys/class/udmabuf"));
        assert_eq!(fpga_manager, Path::new("/sys/class/fpga_manager"));
        assert_eq!((dev.as_path(), iomem.as_path()), (Path::new("/dev"), Path::new("/proc/iomem")));
    }

    #[test]
    fn a_plain_file_is_no_device_file_of_a_node_that_is_longer() {
        let (_root, system) = accelerator();
        let node = uio_nodes(&system.uio).expect("listed").remove(0);
        try_node(&system, &node).expect("long enough to be mapped");
        for length in [0, 1, 0x5000] {
            let file = File::create(system.dev.join(&node.device)).expect("emptied");
            file.set_len(length).expect("resized");
            let error = try_node(&system, &node).expect_err("too short");
            assert!(
                matches!(error, PlatformError::NotADevice { found, .. } if found == length),
                "{error}"
            );
        }
    }

    #[test]
    fn a_missing_device_file_and_missing_rights_are_told_from_another_failure() {
        let root = tempfile::tempdir().expect("a directory");
        let missing = open_device(&root.path().join("uio0"), 0).expect_err("there is none");
        assert!(matches!(missing, PlatformError::NoDevice { .. }), "{missing}");
        // The superuser may open anything: what the kernel says to others is made here.
        for errno in [nix::errno::Errno::EACCES, nix::errno::Errno::EPERM] {
            let error = obstacle(Path::new("/dev/uio0"), errno.into());
            assert!(matches!(error, PlatformError::Permission { .. }), "{error}");
        }
        let directory = open_device(root.path(), 0).expect_err("a directory is no device");
        assert!(matches!(directory, PlatformError::File { .. }), "{directory}");
    }
}
