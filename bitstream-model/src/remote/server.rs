//! This file lets a board serve drivers at a Unix socket, one after the other.

use std::fs;
use std::io;
use std::net::Shutdown;
use std::os::fd::OwnedFd;
use std::os::unix::fs::FileTypeExt as _;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use thiserror::Error;

use super::memory_file::{MemoryFile, MemoryFileError};
use super::visit::{Host, Visit};
use crate::config::{BoardConfig, ConfigError};
use crate::handle::EmulatedBoard;

/// Why a board cannot be served.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ServeError {
    /// There is no such board.
    #[error("the board cannot be built")]
    Config(#[from] ConfigError),
    /// It has no memory.
    #[error(transparent)]
    Memory(#[from] MemoryFileError),
    /// Another board is served there.
    #[error("a board is served at {} already: end that, or name another socket", path.display())]
    InUse {
        /// The socket.
        path: PathBuf,
    },
    /// Something that is no socket lies there.
    #[error("{} is no socket: remove it, or name another", path.display())]
    NoSocket {
        /// What.
        path: PathBuf,
    },
    /// The socket failed.
    #[error("the socket {} cannot be {act}", path.display())]
    Socket {
        /// What was tried.
        act: &'static str,
        /// Which.
        path: PathBuf,
        /// Why.
        #[source]
        source: io::Error,
    },
}

/// Ends a server from elsewhere: another thread, a signal's handler thread.
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
    /// Hangs up and lets [`Server::serve`] return.
    pub fn stop(&self) {
        self.0.asked.store(true, Ordering::SeqCst);
        // What is shut down already needs it no more.
        let _ = self.0.listener.shutdown(Shutdown::Both);
        let visitor = self.0.visitor.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(visitor) = &*visitor {
            let _ = visitor.shutdown(Shutdown::Both);
        }
    }

    fn is_asked(&self) -> bool {
        self.0.asked.load(Ordering::SeqCst)
    }

    /// Whom to hang up on.
    fn set_visitor(&self, stream: Option<UnixStream>) {
        *self.0.visitor.lock().unwrap_or_else(PoisonError::into_inner) = stream;
    }
}

/// A board at a socket. Dropping it removes the socket; the memory's file stays.
#[derive(Debug)]
pub struct Server {
    board: EmulatedBoard,
    /// Inode and bus address.
    memory: (u64, u64),
    listener: UnixListener,
    path: PathBuf,
    stopper: Stopper,
}

impl Server {
    /// Builds a board on that memory and opens the socket, in place of one that a server which was
    /// killed has left.
    ///
    /// # Errors
    /// [`ServeError`].
    pub fn bind(
        config: BoardConfig,
        memory: MemoryFile,
        socket: &Path,
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
            match UnixStream::connect(socket) {
                Ok(_) => return Err(ServeError::InUse { path }),
                Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => {
                    fs::remove_file(socket).map_err(failed("replaced"))?;
                }
                Err(error) => return Err(failed("reached")(error)),
            }
        }
        let granted = memory.addresses();
        let identity = (memory.inode(), granted.start);
        let board = EmulatedBoard::on_memory(config, Box::new(memory), vec![granted])?;
        let listener = UnixListener::bind(socket).map_err(failed("opened"))?;
        let same = listener.try_clone().map_err(failed("shared"))?;
        let stopper = Stopper(Arc::new(Stop {
            asked: AtomicBool::new(false),
            listener: UnixStream::from(OwnedFd::from(same)),
            visitor: Mutex::new(None),
        }));
        Ok(Self { board, memory: identity, listener, path, stopper })
    }

    /// The board, as its builder sees it.
    #[must_use]
    pub fn board(&self) -> &EmulatedBoard {
        &self.board
    }

    /// What ends it.
    #[must_use]
    pub fn stopper(&self) -> Stopper {
        self.stopper.clone()
    }

    /// Serves one driver after the other until it is stopped; `visited` is told of each that left,
    /// before the next is served.
    ///
    /// # Errors
    /// [`ServeError::Socket`] if no driver can come any more.
    pub fn serve(
        &mut self,
        mut visited: impl FnMut(&EmulatedBoard, Visit),
    ) -> Result<(), ServeError> {
        while !self.stopper.is_asked() {
            let stream = match self.listener.accept() {
                Ok((stream, _)) => stream,
                Err(_) if self.stopper.is_asked() => break,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                // It came and went.
                Err(error) if error.kind() == io::ErrorKind::ConnectionAborted => continue,
                Err(source) => {
                    return Err(ServeError::Socket {
                        act: "served",
                        path: self.path.clone(),
                        source,
                    });
                }
            };
            let failed =
                |source| ServeError::Socket { act: "shared", path: self.path.clone(), source };
            self.stopper.set_visitor(Some(stream.try_clone().map_err(failed)?));
            if self.stopper.is_asked() {
                break;
            }
            let visit = Host::new(&self.board, self.memory, stream).serve();
            self.stopper.set_visitor(None);
            visited(&self.board, visit);
        }
        Ok(())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        if let Err(error) = fs::remove_file(&self.path) {
            log::error!("cannot remove the socket {}: {error}", self.path.display());
        }
    }
}
