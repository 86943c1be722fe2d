//! Passes an open file beside the bytes of a message on a Unix socket.
#![allow(unsafe_code, reason = "the kernel hands a received file over as a number")]

use std::fs::File;
use std::io::{self, IoSlice, IoSliceMut};
use std::os::fd::{AsFd, AsRawFd as _, FromRawFd as _, OwnedFd, RawFd};
use std::os::unix::net::UnixStream;

use nix::cmsg_space;
use nix::errno::Errno;
use nix::sys::socket::{ControlMessage, ControlMessageOwned, MsgFlags, recvmsg, sendmsg};

/// Most files that the kernel passes with one message (`SCM_MAX_FD`).
const FILES_MAX: usize = 253;

/// Sends bytes with a file beside them; returns the number of bytes that were sent.
///
/// # Errors
/// The kernel's.
pub fn send_file(stream: &UnixStream, bytes: &[u8], file: impl AsFd) -> io::Result<usize> {
    let files = [file.as_fd().as_raw_fd()];
    let beside = [ControlMessage::ScmRights(&files)];
    let bytes = [IoSlice::new(bytes)];
    Ok(sendmsg::<()>(stream.as_raw_fd(), &bytes, &beside, MsgFlags::MSG_NOSIGNAL, None)?)
}

/// Receives bytes, and the files that come beside them; returns the number of bytes.
///
/// # Errors
/// The kernel's; `EMFILE` if this process may not open the files.
pub fn receive_files(stream: &UnixStream, bytes: &mut [u8]) -> io::Result<(usize, Vec<File>)> {
    let mut beside = cmsg_space!([RawFd; FILES_MAX]);
    let mut bytes = [IoSliceMut::new(bytes)];
    let (stream, flags) = (stream.as_raw_fd(), MsgFlags::MSG_CMSG_CLOEXEC);
    let received = recvmsg::<()>(stream, &mut bytes, Some(&mut beside), flags)?;
    // The buffer has room for all: files are missing only where the process may open no more.
    let messages = received.cmsgs().map_err(|_| Errno::EMFILE)?;
    let numbers = messages.flat_map(|message| match message {
        ControlMessageOwned::ScmRights(numbers) => numbers,
        _ => Vec::new(),
    });
    let own = |number| {
        // SAFETY: `recvmsg` has just opened this descriptor for this message, and its number is
        // nowhere else: the file that is made of it is its only owner.
        File::from(unsafe { OwnedFd::from_raw_fd(number) })
    };
    let files = numbers.map(own).collect();
    Ok((received.bytes, files))
}

#[cfg(test)]
mod tests {
    use std::io::{Read as _, Seek as _, Write as _};

    use super::*;

    #[test]
    fn a_file_that_was_sent_is_the_same_file_at_the_other_end() {
        let (ours, theirs) = UnixStream::pair().expect("a pair");
        let mut file = tempfile::tempfile().expect("a file");
        assert_eq!(send_file(&ours, b"here", &file).expect("sent"), 4);
        file.write_all(b"later").expect("written");
        let mut bytes = [0; 8];
        let (count, mut files) = receive_files(&theirs, &mut bytes).expect("received");
        assert_eq!(&bytes[..count], b"here");
        let mut found = String::new();
        files[0].rewind().expect("rewound");
        files[0].read_to_string(&mut found).expect("read");
        assert_eq!((files.len(), found.as_str()), (1, "later"));

        (&ours).write_all(b"alone").expect("sent");
        let (count, files) = receive_files(&theirs, &mut bytes).expect("received");
        assert_eq!((count, files.len()), (5, 0));
        drop(ours);
        assert_eq!(receive_files(&theirs, &mut bytes).expect("closed").0, 0);
    }
}
