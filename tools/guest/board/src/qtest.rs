//! Drives an interrupt line of a guest through QEMU's qtest socket.
//!
//! `set_irq_in PATH NAME NUMBER LEVEL` sets an input of a device; QEMU answers `OK`. Lines that
//! begin with `IRQ` are notices, not answers.
//!
//! Source: QEMU `softmmu/qtest.c`.

use std::io::{self, BufRead as _, BufReader, Write as _};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::server::Line;

/// The interrupt controller of QEMU's xlnx-zcu102.
const GIC: &str = "/machine/soc/gic";
/// Time limit of QEMU's answer.
const ANSWER_LIMIT: Duration = Duration::from_secs(20);

/// An interrupt line of the guest, over a qtest socket.
#[derive(Debug)]
pub struct QtestLine {
    stream: UnixStream,
    answers: BufReader<UnixStream>,
    spi: u32,
}

fn other(text: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, text)
}

impl QtestLine {
    /// Connects to a socket that QEMU creates within `limit`; the line is SPI `spi`.
    ///
    /// # Errors
    ///
    /// QEMU does not create the socket in time, or does not accept the line.
    pub fn connect(path: &Path, spi: u32, limit: Duration) -> io::Result<Self> {
        let started = Instant::now();
        let stream = loop {
            match UnixStream::connect(path) {
                Ok(stream) => break stream,
                Err(error) if started.elapsed() >= limit => return Err(error),
                Err(_) => std::thread::sleep(Duration::from_millis(10)),
            }
        };
        stream.set_read_timeout(Some(ANSWER_LIMIT))?;
        stream.set_write_timeout(Some(ANSWER_LIMIT))?;
        let answers = BufReader::new(stream.try_clone()?);
        let mut line = Self { stream, answers, spi };
        line.set(false)?;
        Ok(line)
    }
}

impl Line for QtestLine {
    fn set(&mut self, level: bool) -> io::Result<()> {
        let level = u8::from(level);
        let command = format!("set_irq_in {GIC} unnamed-gpio-in {} {level}\n", self.spi);
        self.stream.write_all(command.as_bytes())?;
        loop {
            let mut answer = String::new();
            if self.answers.read_line(&mut answer)? == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            if answer.starts_with("IRQ") {
                continue;
            }
            if answer.starts_with("OK") {
                return Ok(());
            }
            return Err(other(format!("expected OK to {command:?}, QEMU says {answer:?}")));
        }
    }

    fn guest_runs(&mut self) -> io::Result<bool> {
        self.stream.set_nonblocking(true)?;
        let found = self.answers.fill_buf().map(|bytes| (bytes.is_empty(), bytes.len()));
        self.stream.set_nonblocking(false)?;
        match found {
            Ok((ended, length)) => {
                // No request is open: these lines are notices, which are dropped.
                self.answers.consume(length);
                Ok(!ended)
            }
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(true),
            Err(error) if error.kind() == io::ErrorKind::ConnectionReset => Ok(false),
            Err(error) => Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::net::UnixListener;

    use super::*;

    /// A socket whose server gives these answers, one to each line, and then closes.
    fn with_qemu(
        answers: &'static [&'static str],
        act: impl FnOnce(io::Result<QtestLine>),
    ) -> Vec<String> {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("q");
        let listener = UnixListener::bind(&path).expect("a short path");
        let qemu = std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().expect("somebody connects");
            let mut lines = BufReader::new(stream.try_clone().expect("cloned"));
            let mut seen = Vec::new();
            for answer in answers {
                let mut line = String::new();
                lines.read_line(&mut line).expect("a line");
                seen.push(line);
                stream.write_all(answer.as_bytes()).expect("written");
            }
            seen
        });
        act(QtestLine::connect(&path, 89, ANSWER_LIMIT));
        qemu.join().expect("no panic")
    }

    #[test]
    fn levels_are_set_and_notices_are_no_answers() {
        let seen = with_qemu(&["OK\n", "IRQ raise 3\nOK\n"], |line| {
            let mut line = line.expect("connected");
            line.set(true).expect("set");
            while line.guest_runs().expect("readable") {
                std::thread::yield_now();
            }
        });
        let expected = [
            "set_irq_in /machine/soc/gic unnamed-gpio-in 89 0\n",
            "set_irq_in /machine/soc/gic unnamed-gpio-in 89 1\n",
        ];
        assert_eq!(seen, expected);
    }

    #[test]
    fn a_refusal_is_said_with_what_qemu_says() {
        with_qemu(&["FAIL Unknown device\n"], |line| {
            let error = line.expect_err("refused").to_string();
            assert!(error.contains("Unknown device") && error.contains(" 89 0"), "{error}");
        });
    }

    #[test]
    fn a_socket_that_does_not_come_is_an_error() {
        let missing = Path::new("/nonexistent/q");
        assert!(QtestLine::connect(missing, 89, Duration::ZERO).is_err());
    }
}
