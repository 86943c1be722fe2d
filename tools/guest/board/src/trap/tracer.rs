//! The tracer: stops a program at system calls and at accesses to registers.
//!
//! Source: ptrace(2); Linux `arch/arm64/kernel/ptrace.c` (arguments of a system call can be changed
//! at its entry).

use std::collections::HashMap;
use std::ffi::OsString;
use std::fs;
use std::os::unix::process::CommandExt as _;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use nix::errno::Errno;
use nix::libc::{self, user_regs_struct};
use nix::sys::ptrace::{self, Options};
use nix::sys::signal::{Signal, kill};
use nix::sys::wait::{WaitPidFlag, WaitStatus, waitpid};
use nix::unistd::{Pid, SysconfVar, sysconf};
use zynq_pgs::platform::{PlatformError, uio_nodes};
use zynq_pgs::platform::{System, UioDevice, UioWindow};

use super::{Node, Regions};
use crate::instruction::{self, Registers};
use crate::mailbox::{self, Access, Client, MailboxError};

/// Time limit of the host's answer.
const LIMIT: Duration = Duration::from_secs(30);
/// The register that carries the number of a system call.
const SYSCALL: usize = 8;

/// Counts of forwarded accesses.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Counts {
    /// Reads of registers.
    pub reads: u64,
    /// Writes of registers.
    pub writes: u64,
    /// Mapped register regions.
    pub regions: u64,
}

/// Why tracing a program failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TraceError {
    /// The mailbox's UIO node, or the board's.
    #[error(transparent)]
    Platform(#[from] PlatformError),
    /// The host.
    #[error(transparent)]
    Mailbox(#[from] MailboxError<PlatformError>),
    /// The kernel.
    #[error("cannot {act}")]
    Kernel {
        /// The attempted action.
        act: &'static str,
        /// The reason.
        #[source]
        source: Errno,
    },
    /// The program cannot be started.
    #[error("cannot start {program:?}")]
    Start {
        /// The program.
        program: OsString,
        /// The reason.
        #[source]
        source: std::io::Error,
    },
    /// The system has no board to forward to.
    #[error("expected a UIO node of the accelerator, found none: is this the guest's device tree?")]
    NoNode,
    /// An access to a register other than a 32-bit load or store.
    #[error(
        "expected a 32-bit load or store, found instruction {instruction:#010x} at {pc:#x}, which \
         touches the registers at {address:#x}: nothing else may reach an AXI-Lite slave"
    )]
    NotARegisterAccess {
        /// The instruction.
        instruction: u32,
        /// Its address.
        pc: u64,
        /// The accessed address, as the kernel reports it for the signal.
        address: u64,
    },
    /// A mapping of registers that cannot be forwarded.
    #[error("{what} of the register mapping at {address:#x} is not supported by this tracer")]
    NotPassedOn {
        /// The mapping.
        what: &'static str,
        /// Its address.
        address: u64,
    },
}

fn kernel(act: &'static str) -> impl FnOnce(Errno) -> TraceError {
    move |source| TraceError::Kernel { act, source }
}

/// Asks to be traced, and executes the program. Returns only if that fails.
#[must_use]
pub fn become_traced(program: &[OsString]) -> TraceError {
    if let Err(errno) = ptrace::traceme() {
        return kernel("ask to be traced")(errno);
    }
    let Some((name, arguments)) = program.split_first() else { return TraceError::NoNode };
    let source = Command::new(name).args(arguments).exec();
    TraceError::Start { program: name.clone(), source }
}

/// Runs a program, and forwards its register accesses; returns its exit code and the counts.
///
/// The program's time is not bounded, as in a shell.
///
/// # Errors
///
/// [`TraceError`]; the program is killed then.
pub fn run(program: &[OsString]) -> Result<(u8, Counts), TraceError> {
    let system = System::default();
    let nodes = Node::of_the_board(&uio_nodes(&system.uio)?, &system.dev);
    if nodes.is_empty() {
        return Err(TraceError::NoNode);
    }
    let page = UioDevice::open(mailbox::NODE)?.window(mailbox::MAP)?;
    let host = Client::open(page, LIMIT)?;
    let page_bytes = sysconf(SysconfVar::PAGE_SIZE)
        .ok()
        .flatten()
        .and_then(|bytes| u64::try_from(bytes).ok())
        .ok_or(TraceError::Kernel { act: "learn the page size", source: Errno::EINVAL })?;

    let this = "/proc/self/exe";
    let start = |source| TraceError::Start { program: this.into(), source };
    let child = Command::new(this).arg("--traced").args(program).spawn().map_err(start)?;
    let child = i32::try_from(child.id())
        .map(Pid::from_raw)
        .map_err(|_| TraceError::Kernel { act: "name the process", source: Errno::ERANGE })?;
    let traced = trace(child, nodes, page_bytes, host);
    if traced.is_err() {
        // The program may have ended by itself.
        let _ = kill(child, Signal::SIGKILL);
    }
    traced
}

/// Traces a process that asks for it, to its end.
fn trace(
    child: Pid,
    nodes: Vec<Node>,
    page_bytes: u64,
    host: Client<UioWindow>,
) -> Result<(u8, Counts), TraceError> {
    // The program's first stop is the end of its exec; a failed exec ends it before.
    match waitpid(child, None).map_err(kernel("wait for the program"))? {
        WaitStatus::Stopped(..) => {}
        WaitStatus::Exited(_, code) => return Ok((exit_code(code), Counts::default())),
        _ => return Ok((u8::MAX, Counts::default())),
    }
    let options =
        Options::PTRACE_O_TRACESYSGOOD | Options::PTRACE_O_TRACECLONE | Options::PTRACE_O_EXITKILL;
    ptrace::setoptions(child, options).map_err(kernel("set options of the trace"))?;
    ptrace::syscall(child, None).map_err(kernel("let the program run"))?;
    let threads = HashMap::from([(child, None)]);
    let (regions, counts) = (Regions::default(), Counts::default());
    Tracer { child, nodes, page_bytes, host, regions, threads, counts }.run()
}

fn exit_code(code: i32) -> u8 {
    u8::try_from(code).unwrap_or(u8::MAX)
}

/// A thread's system call.
#[derive(Debug, Clone, Copy)]
enum Call {
    /// Any other call.
    Other,
    /// A mapping of registers.
    Map { bytes: u64, physical: u64, rights: u64 },
    /// Another mapping, which may replace one of registers.
    MapOther { bytes: u64 },
    /// An unmapping.
    Unmap { start: u64, bytes: u64 },
}

struct Tracer {
    child: Pid,
    nodes: Vec<Node>,
    page_bytes: u64,
    host: Client<UioWindow>,
    regions: Regions,
    /// The current call of each thread.
    threads: HashMap<Pid, Option<Call>>,
    counts: Counts,
}

impl Tracer {
    fn run(mut self) -> Result<(u8, Counts), TraceError> {
        loop {
            let any = Pid::from_raw(-1);
            let status = waitpid(any, Some(WaitPidFlag::__WALL));
            let stopped = match status.map_err(kernel("wait for the program"))? {
                WaitStatus::Exited(pid, code) if pid == self.child => {
                    return Ok((exit_code(code), self.counts));
                }
                WaitStatus::Signaled(pid, signal, _) if pid == self.child => {
                    return Ok((exit_code(128 + signal as i32), self.counts));
                }
                WaitStatus::PtraceSyscall(pid) => self.system_call(pid).map(|()| (pid, None)),
                WaitStatus::Stopped(pid, Signal::SIGSEGV) => {
                    let signal = |made: bool| (!made).then_some(Signal::SIGSEGV);
                    self.register_access(pid).map(|made| (pid, signal(made)))
                }
                WaitStatus::Stopped(pid, signal) => {
                    // A new thread begins with a stop of its own.
                    let new = self.threads.insert(pid, None).is_none();
                    Ok((pid, (!new || signal != Signal::SIGSTOP).then_some(signal)))
                }
                WaitStatus::PtraceEvent(pid, ..) => Ok((pid, None)),
                WaitStatus::Exited(pid, _) | WaitStatus::Signaled(pid, ..) => {
                    self.threads.remove(&pid);
                    continue;
                }
                _ => continue,
            };
            let (thread, signal) = match stopped {
                // Another thread has ended the program: the next wait reports it.
                Err(TraceError::Kernel { source: Errno::ESRCH, .. }) => continue,
                stopped => stopped?,
            };
            match ptrace::syscall(thread, signal) {
                // It was killed: the next wait reports it.
                Ok(()) | Err(Errno::ESRCH) => {}
                Err(errno) => return Err(kernel("let the program run")(errno)),
            }
        }
    }

    /// A thread enters or leaves a system call.
    fn system_call(&mut self, thread: Pid) -> Result<(), TraceError> {
        let mut registers = ptrace::getregs(thread).map_err(kernel("read registers"))?;
        match self.threads.insert(thread, None).flatten() {
            None => {
                let call = self.entered(thread, &mut registers)?;
                self.threads.insert(thread, Some(call));
                Ok(())
            }
            Some(call) => self.left(thread, call, &mut registers),
        }
    }

    fn entered(&self, thread: Pid, registers: &mut user_regs_struct) -> Result<Call, TraceError> {
        let [first, second, third, _, file, offset, ..] = registers.regs;
        let touches = || self.regions.touch(first, second);
        let number = i64::try_from(registers.regs[SYSCALL]).unwrap_or(-1);
        match number {
            libc::SYS_mmap => {
                let Some((physical, _)) = self.registers_behind(thread, file, offset) else {
                    return Ok(Call::MapOther { bytes: second });
                };
                let call = Call::Map { bytes: second, physical, rights: third };
                // No rights.
                registers.regs[2] = 0;
                ptrace::setregs(thread, *registers).map_err(kernel("write registers"))?;
                Ok(call)
            }
            libc::SYS_munmap => Ok(Call::Unmap { start: first, bytes: second }),
            libc::SYS_mprotect if touches() => {
                Err(TraceError::NotPassedOn { what: "a change of rights", address: first })
            }
            libc::SYS_mremap if touches() => {
                Err(TraceError::NotPassedOn { what: "a move", address: first })
            }
            _ => Ok(Call::Other),
        }
    }

    fn left(
        &mut self,
        thread: Pid,
        call: Call,
        registers: &mut user_regs_struct,
    ) -> Result<(), TraceError> {
        let result = registers.regs[0];
        // Errors are -4095 to -1.
        let failed = result > u64::MAX - 4095;
        match call {
            Call::Map { bytes, physical, rights } => {
                // Restores the program's arguments.
                registers.regs[2] = rights;
                ptrace::setregs(thread, *registers).map_err(kernel("write registers"))?;
                if !failed {
                    self.counts.regions += 1;
                    let bytes = bytes.next_multiple_of(self.page_bytes);
                    self.regions.add(result, bytes, physical);
                }
            }
            Call::MapOther { bytes } if !failed => {
                self.regions.remove(result, bytes.next_multiple_of(self.page_bytes));
            }
            Call::Unmap { start, bytes } if !failed => {
                self.regions.remove(start, bytes.next_multiple_of(self.page_bytes));
            }
            Call::MapOther { .. } | Call::Unmap { .. } | Call::Other => {}
        }
        Ok(())
    }

    /// Physical address and length of the registers at an offset of a file, if the file is a
    /// board's node.
    fn registers_behind(&self, thread: Pid, file: u64, offset: u64) -> Option<(u64, u64)> {
        let file = i32::try_from(file).ok().filter(|file| *file >= 0)?;
        let path: PathBuf = fs::read_link(format!("/proc/{thread}/fd/{file}")).ok()?;
        self.nodes.iter().find(|node| node.path == path)?.map_at(offset, self.page_bytes)
    }

    /// Handles a segmentation fault: makes the access if it is one to a register.
    fn register_access(&mut self, thread: Pid) -> Result<bool, TraceError> {
        let mut registers = ptrace::getregs(thread).map_err(kernel("read registers"))?;
        let pc = registers.pc;
        // Reads two instructions at once, never beyond the program's last page.
        let place = usize::try_from(pc & !7).map(std::ptr::without_provenance_mut);
        let Ok(place) = place else { return Ok(false) };
        let pair = match ptrace::read(thread, place) {
            Ok(pair) => pair,
            Err(errno @ Errno::ESRCH) => return Err(kernel("read an instruction")(errno)),
            Err(_) => return Ok(false),
        };
        let instruction = instruction::of_pair(pair.cast_unsigned(), pc);
        let mut general = Registers { x: registers.regs, sp: registers.sp };
        let Some(access) = instruction::decode(instruction, &general) else {
            return self.foreign(instruction, &registers);
        };
        let Some(address) = self.regions.physical(access.address) else { return Ok(false) };
        let request = if access.store {
            self.counts.writes += 1;
            Access::Write { address, value: general.stored(&access) }
        } else {
            self.counts.reads += 1;
            Access::Read { address }
        };
        log::trace!("{request}");
        let loaded = self.host.request(request)?;
        general.complete(&access, loaded);
        (registers.regs, registers.sp) = (general.x, general.sp);
        registers.pc = pc.wrapping_add(4);
        ptrace::setregs(thread, registers).map_err(kernel("write registers"))?;
        Ok(true)
    }

    /// An instruction that cannot be forwarded is an error if a base register points to registers.
    fn foreign(&self, instruction: u32, at: &user_regs_struct) -> Result<bool, TraceError> {
        let base = usize::try_from((instruction >> 5) & 31).unwrap_or_default();
        let address = at.regs.get(base).copied().unwrap_or(at.sp);
        // Offsets of pairs and bytes stay within a page of the base.
        match self.regions.touch(address.saturating_sub(4096), 8192) {
            true => Err(TraceError::NotARegisterAccess { instruction, pc: at.pc, address }),
            false => Ok(false),
        }
    }
}
