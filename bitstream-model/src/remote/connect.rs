//! Connects to a board's socket in bounded time.

use std::fs;
use std::io;
use std::os::fd::AsRawFd as _;
use std::os::unix::fs::FileTypeExt as _;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

use nix::errno::Errno;
use nix::sys::socket::{
    AddressFamily, SockFlag, SockType, UnixAddr, connect as connect_to, setsockopt, socket, sockopt,
};
use nix::sys::time::TimeVal;

/// Connects to the socket at `path`. If the server does not accept connections and its backlog is
/// full, the call waits up to `limit`.
///
/// # Errors
/// The kernel's; `EAGAIN` if the limit is over, `ENOTSOCK` if `path` is not a socket.
pub fn connect(path: &Path, limit: Duration) -> io::Result<UnixStream> {
    let address = UnixAddr::new(path)?;
    let ours = socket(AddressFamily::Unix, SockType::Stream, SockFlag::SOCK_CLOEXEC, None)?;
    let seconds = i64::try_from(limit.as_secs()).unwrap_or(i64::MAX);
    let limit = TimeVal::new(seconds, limit.subsec_micros().into());
    // This limit is valid for the connection, too.
    setsockopt(&ours, sockopt::SendTimeout, &limit)?;
    loop {
        match connect_to(ours.as_raw_fd(), &address) {
            Ok(()) => return Ok(UnixStream::from(ours)),
            Err(Errno::EINTR) => {}
            // The kernel returns the same error for a file and for a socket without a server.
            Err(Errno::ECONNREFUSED) if is_other(path) => return Err(Errno::ENOTSOCK.into()),
            Err(errno) => return Err(errno.into()),
        }
    }
}

/// Whether `path` exists and is not a socket.
fn is_other(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|metadata| !metadata.file_type().is_socket())
}
