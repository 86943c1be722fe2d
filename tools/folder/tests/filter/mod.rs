//! A filter of system calls.

#![allow(unsafe_code, clippy::cast_possible_truncation, reason = "a program of the kernel's")]

use nix::libc::{self, sock_filter, sock_fprog};

/// Lets system calls of this process end with an error.
pub(crate) fn refuse(calls: &[libc::c_long], errno: i32) -> Result<(), ()> {
    let filter = |code: u32, jt, jf, k| sock_filter { code: code as u16, jt, jf, k };
    let action =
        |action, data: i32| filter(libc::BPF_RET | libc::BPF_K, 0, 0, action | (data as u32));
    // The number of a call is the first word of its data.
    let mut filters = vec![filter(libc::BPF_LD | libc::BPF_W | libc::BPF_ABS, 0, 0, 0)];
    for call in calls {
        filters.push(filter(libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K, 0, 1, *call as u32));
        filters.push(action(libc::SECCOMP_RET_ERRNO, errno));
    }
    filters.push(action(libc::SECCOMP_RET_ALLOW, 0));
    let program = sock_fprog { len: filters.len() as u16, filter: filters.as_mut_ptr() };
    let [yes, none] = [1, 0_u64];
    // SAFETY: PR_SET_NO_NEW_PRIVS takes numbers; the kernel accesses no memory of this process.
    let set = unsafe { libc::prctl(libc::PR_SET_NO_NEW_PRIVS, yes, none, none, none) };
    let mode = u64::from(libc::SECCOMP_MODE_FILTER);
    // SAFETY: `program` has the address and the length of `filters`. Both live through the call,
    // and the kernel copies them before it returns.
    let filtered = unsafe { libc::prctl(libc::PR_SET_SECCOMP, mode, &raw const program) };
    if set == 0 && filtered == 0 { Ok(()) } else { Err(()) }
}
