//! Serves a board to drivers at a Unix socket, one driver after the other.

use std::fs;
use std::io;
use std::net::Shutdown;
use std::ops::Range;
use std::os::fd::OwnedFd;
use std::os::unix::fs::FileTypeExt as _;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use nix::errno::Errno;
use pgs_support::Process;
use thiserror::Error;

use super::connect::connect;
use super::connection::Ended;
use super::memory::{Memories, MemoryError};
use super::pending::{Caller, PendingConnections};
use super::visit::{Session, Visit};
use crate::config::{BoardConfig, ConfigError};
use crate::external::ExternalAccelerator;
use crate::handle::EmulatedBoard;

/// Time limit for another server at the same socket to accept a connection.
const IN_USE_LIMIT: Duration = Duration::from_secs(1);

/// Why a board cannot be served.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ServeError {
    /// The configuration is invalid.
    #[error("the board cannot be built")]
    Config(#[from] ConfigError),
    /// There is no memory for the first driver.
    #[error("the board has no memory")]
    Memory(#[from] MemoryError),
    /// Another board is served there.
    #[error(
        "a board is served at {} already: end that server, or name another socket",
        path.display()
    )]
    InUse {
        /// The socket.
        path: PathBuf,
    },
    /// The path exists and is not a socket.
    #[error("{} is not a socket: remove it, or name another path", path.display())]
    NoSocket {
        /// The path.
        path: PathBuf,
    },
    /// The socket failed.
    #[error("the socket {} cannot be {act}", path.display())]
    Socket {
        /// The operation that failed: "opened", "served", ...
        act: &'static str,
        /// The socket.
        path: PathBuf,
        /// The kernel's error.
        #[source]
        source: io::Error,
    },
}

/// Stops a server from another thread, such as a signal handler's.
#[derive(Debug, Clone)]
pub struct Stopper(Arc<Stop>);

#[derive(Debug)]
struct Stop {
    asked: AtomicBool,
    /// The same socket as the server's.
    listener: UnixStream,
    visitor: Mutex<Option<UnixStream>>,
}

impl Stopper {
    /// Closes the driver's connection and makes [`Server::serve`] return.
    pub fn stop(&self) {
        self.0.asked.store(true, Ordering::SeqCst);
        // An error means that the socket is shut down already.
        let _ = self.0.listener.shutdown(Shutdown::Both);
        let visitor = self.0.visitor.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(visitor) = &*visitor {
            let _ = visitor.shutdown(Shutdown::Both);
        }
    }

    fn is_asked(&self) -> bool {
        self.0.asked.load(Ordering::SeqCst)
    }

    /// Sets the driver's connection, which [`stop`](Self::stop) closes.
    fn set_visitor(&self, stream: Option<UnixStream>) {
        *self.0.visitor.lock().unwrap_or_else(PoisonError::into_inner) = stream;
    }
}

/// A board at a socket. Dropping it removes the socket, but not in a child that the process has
/// forked.
#[derive(Debug)]
pub struct Server {
    board: EmulatedBoard,
    memory: Memories,
    pending: PendingConnections,
    path: PathBuf,
    stopper: Stopper,
    opener: Process,
}

impl Server {
    /// Builds a board, around another accelerator if there is one, and opens the socket. `memory`
    /// has the bus addresses of each driver's memory: a multiple of
    /// [`MEMORY_UNIT`](pgs_interface::message::MEMORY_UNIT) bytes. It replaces the socket of a
    /// server that was killed.
    ///
    /// # Errors
    /// [`ServeError`].
    pub fn bind(
        config: BoardConfig,
        memory: Range<u64>,
        socket: &Path,
        accelerator: Option<Box<dyn ExternalAccelerator>>,
    ) -> Result<Self, ServeError> {
        let path = socket.to_owned();
        let failed = |act| {
            let path = path.clone();
            move |source| ServeError::Socket { act, path, source }
        };
        if let Ok(metadata) = fs::symlink_metadata(socket) {
            if !metadata.file_type().is_socket() {
                return Err(ServeError::NoSocket { path });
            }
            match connect(socket, IN_USE_LIMIT) {
                Ok(_) => return Err(ServeError::InUse { path }),
                Err(error) => match error.raw_os_error().map(Errno::from_raw) {
                    Some(Errno::ECONNREFUSED) => {
                        fs::remove_file(socket).map_err(failed("replaced"))?;
                    }
                    // A server listens, and accepts no connection.
                    Some(Errno::EAGAIN) => return Err(ServeError::InUse { path }),
                    _ => return Err(failed("reached")(error)),
                },
            }
        }
        let memory = Memories::new(memory)?;
        let (on, granted) = (Box::new(memory.of_board()), vec![memory.addresses()]);
        let board = EmulatedBoard::on_memory(config, on, granted, accelerator)?;
        let listener = UnixListener::bind(socket).map_err(failed("opened"))?;
        let same = listener.try_clone().map_err(failed("shared"))?;
        let stopper = Stopper(Arc::new(Stop {
            asked: AtomicBool::new(false),
            listener: UnixStream::from(OwnedFd::from(same)),
            visitor: Mutex::new(None),
        }));
        let pending = PendingConnections::new(listener).map_err(failed("shared"))?;
        Ok(Self { board, memory, pending, path, stopper, opener: Process::this() })
    }

    /// The board, as its builder sees it.
    #[must_use]
    pub fn board(&self) -> &EmulatedBoard {
        &self.board
    }

    /// Sets how long the server waits for a driver that owes it a request or does not read an
    /// answer, 5 s by default. It holds for drivers that connect from now on; a driver that has the
    /// memory may pause between two requests as long as it likes.
    pub fn set_driver_limit(&mut self, limit: Duration) {
        self.pending.set_limit(limit);
    }

    /// A handle that stops the server.
    #[must_use]
    pub fn stopper(&self) -> Stopper {
        self.stopper.clone()
    }

    /// Serves one driver after the other until [`Stopper::stop`]. Calls `visited` after each driver
    /// has left, before it serves the next. A connection that comes while a driver has the board
    /// does not count: its hello gets [`Status::Busy`](pgs_interface::message::Status::Busy).
    ///
    /// # Errors
    /// [`ServeError::Socket`] if the socket accepts no more connections.
    pub fn serve(
        &mut self,
        mut visited: impl FnMut(&EmulatedBoard, Visit),
    ) -> Result<(), ServeError> {
        let failed = |act, source| ServeError::Socket { act, path: self.path.clone(), source };
        while !self.stopper.is_asked() {
            if let Some(error) = self.pending.failure() {
                return Err(failed("served", error));
            }
            let caller = match self.pending.caller() {
                None => {
                    self.pending.wait_for(None, None).map_err(|error| failed("served", error))?;
                    continue;
                }
                Some(Caller::Ended(ended)) => Err(ended),
                Some(Caller::Requesting(connection)) => match connection.stream() {
                    Ok(stream) => {
                        self.stopper.set_visitor(Some(stream));
                        Ok(connection)
                    }
                    Err(error) => Err(Ended::Broken(error)),
                },
            };
            if self.stopper.is_asked() {
                break;
            }
            let visit = match caller {
                Ok(connection) => {
                    Session::new(&self.board, &mut self.memory, connection, &mut self.pending)
                        .serve()
                }
                Err(ended) => Visit { requests: 0, ended, left_running: self.board.is_running() },
            };
            self.stopper.set_visitor(None);
            visited(&self.board, visit);
        }
        Ok(())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        if !self.opener.is_this() {
            return;
        }
        if let Err(error) = fs::remove_file(&self.path) {
            log::error!("cannot remove the socket {}: {error}", self.path.display());
        }
    }
}
