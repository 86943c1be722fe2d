//! Tells the user what to do after a failure, by the kernel's error number or state.

use std::io;
use std::path::Path;

use nix::errno::Errno;

use super::PlatformError;

impl PlatformError {
    /// The user's next step, if it depends on the kernel's answer; `None` if the message names it.
    #[must_use]
    pub fn next_step(&self) -> Option<String> {
        match self {
            Self::File { act: "lock", path, source } if is_unsupported(source) => {
                Some(of_lock(path))
            }
            Self::File { path, source, .. } | Self::Permission { path, source } => {
                Some(of_file(path, source))
            }
            Self::NoDevice { path } => Some(format!(
                "does udev run, and has the kernel such a device? In a container: give it the \
                 device (docker run --device {})",
                path.display()
            )),
            Self::NoBitstream { found, .. } => Some(of_state(found)),
            Self::NoManager { .. } => Some(format!("name one that is there {MANAGER}")),
            Self::SeveralManagers { .. } => {
                Some(format!("name the one that programs this logic {MANAGER}"))
            }
            Self::OtherManagers { .. } => Some(format!(
                "if one of them programs this logic, name it {MANAGER}; if the logic is known to \
                 be programmed, --manager none"
            )),
            Self::DevMemRefused { source, .. } => Some(of_dev_mem(source)),
            Self::NoMaintenance { path, source } => Some(of_maintenance(path, source)),
            Self::SyncMode { path, source, .. } => Some(of_mode(path, source)),
            Self::NoServer { socket, source } => Some(of_socket(socket, source)),
            _ => None,
        }
    }
}

/// How the user names an FPGA manager.
const MANAGER: &str =
    "with --manager, as fpga1 (`OpenOptions::manager`); `pgs list` shows them with their states";

/// After a state in which the logic does not run.
fn of_state(state: &str) -> String {
    match state {
        // A bitstream that was loaded past the kernel does not change this state.
        "unknown" | "power off" | "power up" => {
            "load a bitstream, for example with `pgs load`; if one was loaded past the kernel, as \
             by JTAG, say so with --manager none (`OpenOptions::manager`): an access to logic \
             that is not programmed hangs the processor"
        }
        _ => {
            "the last attempt to load has failed, or is not over: see dmesg | tail, then load \
              again with `pgs load`"
        }
    }
    .to_owned()
}

/// The error number, if the kernel gave one.
fn errno(source: &io::Error) -> Option<Errno> {
    source.raw_os_error().map(Errno::from_raw)
}

/// After a failure at a device file or an attribute.
fn of_file(path: &Path, source: &io::Error) -> String {
    let path = path.display();
    match errno(source) {
        Some(Errno::EACCES) => "install the udev rule of device-tree/, join its group and log in \
                                again, or run as root"
            .to_owned(),
        Some(Errno::EPERM) => format!(
            "in a container: give it the device (docker run --device {path}); elsewhere: run as \
             root, and see whether the kernel is locked down (/sys/kernel/security/lockdown)"
        ),
        Some(Errno::EROFS) => format!(
            "{path} is on a file system that is mounted read-only, as /sys is in a container: \
             mount it writable there, or run outside"
        ),
        Some(Errno::ENOENT) => "the device went away, or is another than expected: see what there \
                                is with `pgs list`"
            .to_owned(),
        Some(Errno::ENODEV | Errno::ENXIO) => format!(
            "no driver is behind {path} any more: apply the overlay again, then see `pgs list`"
        ),
        Some(Errno::EBUSY) => format!(
            "another program or a driver of the kernel has it: end that first (fuser -v {path})"
        ),
        Some(Errno::EMFILE | Errno::ENFILE) => FEWER_FILES.to_owned(),
        Some(Errno::ENOMEM | Errno::EAGAIN) => {
            "free memory, or raise the limits on it (ulimit -v, ulimit -l)".to_owned()
        }
        Some(Errno::EINVAL) => {
            "the kernel has another region there: is its `reg` whole pages, and \
                                is this the overlay of the bitstream?"
                .to_owned()
        }
        Some(Errno::ENOLCK | Errno::ENOSYS | Errno::EOPNOTSUPP) => {
            format!("{path} is on a file system that cannot do it: is it a device file?")
        }
        _ => "look for the cause in the kernel's log: dmesg | tail".to_owned(),
    }
}

/// Whether the kernel cannot do it for any file there.
fn is_unsupported(source: &io::Error) -> bool {
    matches!(errno(source), Some(Errno::ENOLCK | Errno::ENOSYS | Errno::EOPNOTSUPP))
}

/// After a lock that the file system, or a sandbox, does not give.
fn of_lock(path: &Path) -> String {
    let shared_memory = Path::new("/dev/shm");
    let device = path.starts_with("/dev") && !path.starts_with(shared_memory);
    let path = path.display();
    let lacks = format!("the file system of {path} has no locks (as NFS without its lock service)");
    if device {
        format!(
            "{lacks}, or a sandbox refuses flock: take the device file that udev makes; in a \
             container, give it the device (docker run --device {path})"
        )
    } else {
        let other = shared_memory.join("pgs").display().to_string();
        format!(
            "{lacks}: serve the board with its memory elsewhere, and name it: --memory file:{other}"
        )
    }
}

/// After a failure at physical memory.
fn of_dev_mem(source: &io::Error) -> String {
    let node = "apply the overlay, and use its UIO node instead (--board uio)";
    match errno(source) {
        Some(Errno::EACCES) => format!("run as root; or {node}"),
        _ => format!(
            "{node}: this kernel (STRICT_DEVMEM, lockdown) or this container (CAP_SYS_RAWIO) does \
             not give the memory even to root"
        ),
    }
}

/// After a failed connection to a board's socket.
fn of_socket(socket: &Path, source: &io::Error) -> String {
    let path = socket.display();
    let serve = format!("start one with `pgs serve --socket {path}`");
    match errno(source) {
        Some(Errno::ENOENT) => {
            format!("no board is served there: {serve}, or name the socket of another")
        }
        Some(Errno::ECONNREFUSED) => {
            format!("the socket is there, and nobody serves a board at it any more: {serve}")
        }
        Some(Errno::ENOTSOCK | Errno::EPROTOTYPE | Errno::ENOTDIR | Errno::ELOOP) => {
            format!("{path} is not a board's socket: name the one that its `pgs serve` names")
        }
        Some(Errno::EACCES | Errno::EPERM) => format!(
            "a board may be served there: run as the user who serves it, or let that user give the \
             right to write to {path} and to search its folders (chmod, chgrp)"
        ),
        Some(Errno::EAGAIN) => format!(
            "who listens there accepts nobody: end the other connections to {path}, or serve the \
             board again"
        ),
        Some(Errno::EMFILE | Errno::ENFILE) => FEWER_FILES.to_owned(),
        Some(Errno::ENAMETOOLONG) => {
            "the kernel takes paths of sockets of at most 107 bytes: serve the board at a shorter \
             one, or name it from a nearer folder"
                .to_owned()
        }
        _ => format!("see whether the `pgs serve` of {path} still runs; otherwise {serve}"),
    }
}

/// The way out for a process with too many open files.
const FEWER_FILES: &str = "close files, or raise the limit on open ones (ulimit -n)";

/// After a failure to maintain the caches of a u-dma-buf, which still works without caches.
fn of_maintenance(path: &Path, source: &io::Error) -> String {
    let name = path.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy();
    let without =
        format!("take the buffer without caches: --memory u-dma-buf:{name}:write-combining");
    let (path, folder) = (path.display(), path.parent().unwrap_or(path).display());
    match errno(source) {
        Some(Errno::EROFS) => format!(
            "{without}; or make {folder} writable: /sys is mounted read-only here, as in a \
             container"
        ),
        Some(Errno::EACCES | Errno::EPERM) => format!(
            "{without}; or install the udev rule of device-tree/ and join its group, or run as \
             root, so that {path} may be written"
        ),
        Some(Errno::ENOENT | Errno::EINVAL) => format!(
            "{without}; or install a newer u-dma-buf module: this one does not maintain ranges \
             (1.4.2 and later do)"
        ),
        _ => format!("{without}; and look for the cause in the kernel's log: dmesg | tail"),
    }
}

/// After a failure to change the unsuitable mode of a u-dma-buf.
fn of_mode(path: &Path, source: &io::Error) -> String {
    let tree = "set `sync-mode = <2>` in its device-tree node";
    let write = format!("echo 2 > {}", path.display());
    match errno(source) {
        Some(Errno::EROFS) => format!(
            "/sys is mounted read-only here, as in a container: outside of it, as root, {write}; \
             or {tree}"
        ),
        Some(Errno::EACCES | Errno::EPERM) => format!("as root, {write}; or {tree}"),
        _ => format!("{tree}, or install a newer u-dma-buf module"),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    fn file(errno: Errno) -> PlatformError {
        PlatformError::File { act: "open", path: "/dev/uio0".into(), source: errno.into() }
    }

    fn maintenance(errno: Errno) -> PlatformError {
        let path = "/sys/class/u-dma-buf/mine/sync_for_cpu".into();
        PlatformError::NoMaintenance { path, source: errno.into() }
    }

    fn mode(errno: Errno) -> PlatformError {
        PlatformError::SyncMode {
            name: "mine".to_owned(),
            found: 1,
            wanted: "buffers",
            path: "/sys/class/u-dma-buf/mine/sync_mode".into(),
            source: errno.into(),
        }
    }

    fn next(error: &PlatformError) -> String {
        error.next_step().expect("the kernel's answer decides")
    }

    #[test]
    fn each_answer_of_the_kernel_has_a_next_step_of_its_own() {
        let errnos = [
            (Errno::EACCES, "udev rule"),
            (Errno::EPERM, "--device /dev/uio0"),
            (Errno::EROFS, "mounted read-only"),
            (Errno::ENOENT, "pgs list"),
            (Errno::ENODEV, "apply the overlay again"),
            (Errno::EBUSY, "fuser -v /dev/uio0"),
            (Errno::EMFILE, "ulimit -n"),
            (Errno::ENOMEM, "free memory"),
            (Errno::EINVAL, "whole pages"),
            (Errno::EOPNOTSUPP, "is it a device file?"),
            (Errno::EIO, "dmesg"),
        ];
        for (errno, text) in errnos {
            let next = next(&file(errno));
            assert!(next.contains(text), "{errno}: {next}");
        }
        let different: BTreeSet<_> = errnos.iter().map(|(errno, _)| next(&file(*errno))).collect();
        assert_eq!(different.len(), errnos.len());
    }

    #[test]
    fn a_lock_that_the_file_system_lacks_is_told_by_what_the_file_is() {
        for (path, text) in [
            ("/dev/uio0", "--device /dev/uio0"),
            ("/dev/shm/board.memory", "--memory file:/dev/shm/pgs"),
            ("/home/nfs/board.memory", "--memory file:/dev/shm/pgs"),
        ] {
            for errno in [Errno::ENOLCK, Errno::EOPNOTSUPP, Errno::ENOSYS] {
                let source = errno.into();
                let next = next(&PlatformError::File { act: "lock", path: path.into(), source });
                assert!(next.contains(text) && next.contains("has no locks"), "{errno}: {next}");
                assert!(next.contains(path) && !next.contains("is it a device file"), "{next}");
            }
        }
    }

    #[test]
    fn a_buffer_that_cannot_be_maintained_is_offered_without_caches() {
        for (errno, text) in [
            (Errno::EROFS, "container"),
            (Errno::EACCES, "udev rule"),
            (Errno::EINVAL, "newer u-dma-buf module"),
            (Errno::EIO, "dmesg"),
        ] {
            let next = next(&maintenance(errno));
            assert!(next.starts_with("take the buffer without caches"), "{next}");
            assert!(next.contains("--memory u-dma-buf:mine:write-combining"), "{next}");
            assert!(next.contains(text), "{errno}: {next}");
        }
    }

    #[test]
    fn a_mode_that_cannot_be_written_names_the_device_tree() {
        for (errno, text) in [
            (Errno::EROFS, "outside of it"),
            (Errno::EACCES, "as root, echo 2 > /sys/class/u-dma-buf/mine/sync_mode"),
            (Errno::EINVAL, "newer"),
        ] {
            let next = next(&mode(errno));
            assert!(next.contains(text) && next.contains("sync-mode = <2>"), "{errno}: {next}");
        }
    }

    #[test]
    fn logic_that_does_not_run_is_loaded_or_known_to_run() {
        let state = |found: &str| {
            next(&PlatformError::NoBitstream { path: "state".into(), found: found.to_owned() })
        };
        assert!(state("unknown").contains("JTAG") && state("unknown").contains("--manager none"));
        assert!(state("write error").contains("dmesg"), "{}", state("write error"));
        assert!(!state("write error").contains("--manager"), "{}", state("write error"));
    }

    #[test]
    fn rights_to_memory_are_told_from_a_kernel_that_gives_it_to_nobody() {
        let refused = |errno: Errno| PlatformError::DevMemRefused {
            act: "mapped",
            address: 0,
            path: "/dev/mem".into(),
            source: errno.into(),
        };
        assert!(next(&refused(Errno::EACCES)).starts_with("run as root"));
        let next = next(&refused(Errno::EPERM));
        assert!(next.contains("even to root") && next.contains("--board uio"), "{next}");
    }

    #[test]
    fn a_device_file_that_is_missing_names_udev_and_the_container() {
        let next = next(&PlatformError::NoDevice { path: "/dev/uio3".into() });
        assert!(next.contains("udev") && next.contains("--device /dev/uio3"), "{next}");
    }
}
