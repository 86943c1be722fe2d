//! Starts QEMU with its own model of the AXI DMA, and speaks qtest to it.
//!
//! qtest is lines of text: a command (`readl ADDRESS`, `writel ADDRESS VALUE`, `read ADDRESS SIZE`,
//! `write ADDRESS SIZE DATA`) is answered by `OK` and perhaps a value. `IRQ raise N` and
//! `IRQ lower N` come in between, whenever they happen.
//!
//! Source: QEMU, system/qtest.c (protocol), `hw/microblaze/petalogix_ml605_mmu.c` (the machine).

use std::fmt::Write as _;
use std::io::{BufRead as _, BufReader, ErrorKind, Write as _};
use std::net::UdpSocket;
use std::os::fd::AsFd as _;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use tempfile::TempDir;

const QEMU: &str = "qemu-system-microblazeel";
/// How long QEMU may take to start, to answer, or to put a frame on the cable.
const PATIENCE: Duration = Duration::from_secs(20);
/// The most attempts to start QEMU: another program may take the port that was found free.
const STARTS: usize = 3;

/// The cable's end in the test, and the machine at its other end.
pub(crate) type Started = (Machine, UdpSocket);

/// A machine without a program: qtest alone controls it.
#[derive(Debug)]
pub(crate) struct Machine {
    qemu: Qemu,
    lines: BufReader<UnixStream>,
    /// The received part of the next line.
    line: Vec<u8>,
    interrupt: bool,
}

/// The process, which ends with this value.
#[derive(Debug)]
struct Qemu {
    child: Child,
    folder: TempDir,
}

impl Qemu {
    /// Its output on stderr.
    fn said(&self) -> String {
        std::fs::read_to_string(self.folder.path().join("stderr")).unwrap_or_default()
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        // Both fail only if it has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Machine {
    /// A machine with its cable plugged in; `None` if QEMU is not installed.
    pub(crate) fn start() -> Option<Started> {
        if !answers(Command::new(QEMU).arg("--version")) {
            return None;
        }
        let mut failures = Vec::new();
        for _ in 0..STARTS {
            match Self::try_start() {
                Ok(started) => return Some(started),
                Err(failure) => failures.push(failure),
            }
        }
        panic!("{QEMU} did not start: {failures:?}");
    }

    fn try_start() -> Result<Started, String> {
        let folder = tempfile::tempdir().expect("a folder");
        let socket = folder.path().join("qtest");
        let listener = UnixListener::bind(&socket).expect("a socket");
        let cable = UdpSocket::bind("127.0.0.1:0").expect("a port");
        let there = UdpSocket::bind("127.0.0.1:0").expect("a port").local_addr().expect("bound");
        let here = cable.local_addr().expect("bound");
        // From now on datagrams of others are not seen.
        cable.connect(there).expect("an address of this machine");
        cable.set_read_timeout(Some(PATIENCE)).expect("not zero");

        let nic = format!(
            "socket,udp={here},localaddr={there},model=xlnx.axi-ethernet,mac=52:54:00:12:34:56"
        );
        let child = command(&socket, &nic, &folder).spawn().expect("a process");
        let mut qemu = Qemu { child, folder };
        let stream = accept(&listener, &mut qemu)?;
        stream.set_write_timeout(Some(PATIENCE)).expect("not zero");
        let lines = BufReader::new(stream);
        Ok((Self { qemu, lines, line: Vec::new(), interrupt: false }, cable))
    }

    /// One 32-bit read on the bus.
    pub(crate) fn read32(&mut self, address: u64) -> u32 {
        let answer = self.command(&format!("readl {address:#x}"));
        let digits = answer.strip_prefix("0x").expect("a number");
        let value = u64::from_str_radix(digits, 16).expect("hexadecimal");
        u32::try_from(value).expect("32 bits")
    }

    /// One 32-bit write on the bus.
    pub(crate) fn write32(&mut self, address: u64, value: u32) {
        self.command(&format!("writel {address:#x} {value:#x}"));
    }

    /// Bytes of the machine's memory.
    pub(crate) fn read(&mut self, address: u64, bytes: usize) -> Vec<u8> {
        let answer = self.command(&format!("read {address:#x} {bytes}"));
        let digits = answer.strip_prefix("0x").expect("a number");
        assert_eq!(digits.len(), 2 * bytes, "as much as was asked for");
        (0..bytes)
            .map(|at| u8::from_str_radix(&digits[2 * at..2 * at + 2], 16).expect("hexadecimal"))
            .collect()
    }

    /// Writes bytes into the machine's memory.
    pub(crate) fn write(&mut self, address: u64, bytes: &[u8]) {
        let mut line = format!("write {address:#x} {} 0x", bytes.len());
        for byte in bytes {
            write!(line, "{byte:02x}").expect("a string takes everything");
        }
        self.command(&line);
    }

    /// Watches the interrupt input of a device, by its path in QEMU.
    pub(crate) fn watch_interrupt(&mut self, device: &str) {
        self.command(&format!("irq_intercept_in {device}"));
    }

    /// Whether the interrupt is raised, as far as has been heard.
    pub(crate) fn interrupt(&self) -> bool {
        self.interrupt
    }

    /// Waits until the interrupt is raised; returns whether it is.
    pub(crate) fn wait_interrupt(&mut self, timeout: Duration) -> bool {
        let until = Instant::now() + timeout;
        while !self.interrupt {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break;
            }
            if let Some(line) = self.next_line(left) {
                assert!(self.notice(&line), "nothing was asked, but QEMU says {line:?}");
            }
        }
        self.interrupt
    }

    fn command(&mut self, command: &str) -> String {
        let sent = self.lines.get_mut().write_all(format!("{command}\n").as_bytes());
        sent.unwrap_or_else(|error| panic!("{command:?}: {error}; QEMU: {}", self.qemu.said()));
        let until = Instant::now() + PATIENCE;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let line = self
                .next_line(left)
                .unwrap_or_else(|| panic!("no answer to {command:?} within {PATIENCE:?}"));
            if !self.notice(&line) {
                let answer = line.strip_prefix("OK");
                return answer.unwrap_or_else(|| panic!("{command:?}: {line}")).trim().to_owned();
            }
        }
    }

    /// Records a line about the interrupt; returns whether the line is one.
    fn notice(&mut self, line: &str) -> bool {
        match line.strip_prefix("IRQ ") {
            Some(change) => {
                self.interrupt = change.starts_with("raise");
                true
            }
            None => false,
        }
    }

    /// The next line; `None` if it does not come in time.
    fn next_line(&mut self, timeout: Duration) -> Option<String> {
        let timeout = timeout.max(Duration::from_millis(1));
        self.lines.get_ref().set_read_timeout(Some(timeout)).expect("not zero");
        match self.lines.read_until(b'\n', &mut self.line) {
            Ok(_) if self.line.ends_with(b"\n") => {
                let line = String::from_utf8(std::mem::take(&mut self.line)).expect("text");
                Some(line.trim_end().to_owned())
            }
            Ok(_) => panic!("QEMU has ended: {}", self.qemu.said()),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                None
            }
            Err(error) => panic!("{error}; QEMU: {}", self.qemu.said()),
        }
    }
}

/// Whether a program exists and succeeds.
fn answers(command: &mut Command) -> bool {
    command
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

/// A program that ends with the thread that starts it: the kernel sees to it where the test is
/// killed, and nothing is dropped.
fn tied(program: &str) -> Command {
    let setpriv = || {
        let mut command = Command::new("setpriv");
        command.args(["--pdeathsig", "KILL"]);
        command
    };
    if !answers(setpriv().arg("true")) {
        return Command::new(program);
    }
    let mut command = setpriv();
    command.arg(program);
    command
}

/// The machine whose AXI DMA has an Ethernet MAC at its streams, which has a UDP socket as cable.
fn command(socket: &Path, nic: &str, folder: &TempDir) -> Command {
    let stderr = std::fs::File::create(folder.path().join("stderr")).expect("a file");
    let mut command = tied(QEMU);
    command
        .args(["-M", "petalogix-ml605", "-m", "256M", "-accel", "tcg", "-display", "none"])
        // A branch to itself at the reset vector. A processor that is stopped instead (-S) would
        // hold up the network.
        .args(["-device", "loader,addr=0x0,data=0xb8000000,data-len=4", "-nodefaults"])
        .args(["-qtest", &format!("unix:{}", socket.display()), "-qtest-log", "/dev/null"])
        .args(["-nic", nic])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(stderr);
    command
}

/// QEMU's connection, or what it said when it ended instead.
fn accept(listener: &UnixListener, qemu: &mut Qemu) -> Result<UnixStream, String> {
    let until = Instant::now() + PATIENCE;
    while Instant::now() < until {
        let mut waiting = [PollFd::new(listener.as_fd(), PollFlags::POLLIN)];
        if poll(&mut waiting, PollTimeout::from(100u8)).is_ok_and(|ready| ready > 0) {
            return Ok(listener.accept().expect("somebody is there").0);
        }
        if let Some(status) = qemu.child.try_wait().expect("a child of this process") {
            return Err(format!("{status}: {}", qemu.said()));
        }
    }
    Err(format!("no connection within {PATIENCE:?}: {}", qemu.said()))
}
