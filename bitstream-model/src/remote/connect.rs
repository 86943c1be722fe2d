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

/// Connects to the socket at `path`. A server that accepts nobody has room for some connections
/// that wait; the next one waits here, up to `limit`.
///
/// # Errors
/// The kernel's; `EAGAIN` if the limit is over, `ENOTSOCK` if something else than a socket lies
/// there.
pub fn connect(path: &Path, limit: Duration) -> io::Result<UnixStream> {
    let address = UnixAddr::new(path)?;
    let ours = socket(AddressFamily::Unix, SockType::Stream, SockFlag::SOCK_CLOEXEC, None)?;
    let seconds = i64::try_from(limit.as_secs()).unwrap_or(i64::MAX);
    let limit = TimeVal::new(seconds, limit.subsec_micros().into());
    // How long a connection may wait, too.
    setsockopt(&ours, sockopt::SendTimeout, &limit)?;
    loop {
        match connect_to(ours.as_raw_fd(), &address) {
            Ok(()) => return Ok(UnixStream::from(ours)),
            Err(Errno::EINTR) => {}
            // The kernel says the same of a file and of a socket that nobody serves.
            Err(Errno::ECONNREFUSED) if is_other(path) => return Err(Errno::ENOTSOCK.into()),
            Err(errno) => return Err(errno.into()),
        }
    }
}

/// Whether something else than a socket lies there.
fn is_other(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|metadata| !metadata.file_type().is_socket())
}
