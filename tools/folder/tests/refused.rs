//! A file is replaced where a file system or a sandbox refuses to set its owner and mode, or to
//! sync it.

mod filter;

use std::fs::{self, Permissions};
use std::io::{self, Write as _};
use std::os::unix::fs::{PermissionsExt as _, chown};

use filter::refuse;
use nix::libc;
use pgs_support::in_forked_child;
use step_folder::replace::replace;

/// As a file system whose files have one owner and one mode does, or a sandbox: in a child, because
/// the kernel never takes a filter back.
#[test]
fn a_file_is_replaced_where_owner_mode_and_fsync_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a");
    fs::write(&path, "earlier").expect("written");
    fs::set_permissions(&path, Permissions::from_mode(0o600)).expect("owned");
    // Where it cannot be, the new file has the owner that it would have anyway.
    let _ = chown(&path, Some(1234), Some(1235));
    let calls = [
        libc::SYS_fchmod,
        libc::SYS_fchmodat,
        libc::SYS_fchown,
        libc::SYS_fchownat,
        libc::SYS_fsync,
        libc::SYS_fdatasync,
    ];
    let refused = [libc::EPERM, libc::ENOSYS, libc::EINVAL].map(|errno| {
        in_forked_child(|| {
            if refuse(&calls, errno).is_err() {
                return 8;
            }
            match replace(&path, |file| file.write_all(b"new")) {
                Ok(()) => 7,
                Err(_) => 1,
            }
        })
    });
    if refused == [Some(8); 3] {
        let _ = writeln!(io::stderr(), "skipped: refused calls (no filter of system calls)");
        return;
    }
    assert_eq!(refused, [Some(7); 3]);
    assert_eq!(fs::read_to_string(&path).expect("there"), "new");
    assert_eq!(fs::read_dir(folder.path()).expect("there").count(), 1, "no file is left over");

    let full = in_forked_child(|| {
        let filtered = refuse(&[libc::SYS_fsync], libc::ENOSPC).is_ok();
        let written = replace(&path, |file| file.write_all(b"lost"));
        u8::from(filtered && written.is_err())
    });
    assert_eq!(full, Some(1), "what did not reach the disk is no result");
    assert_eq!(fs::read_to_string(&path).expect("there"), "new");
}
