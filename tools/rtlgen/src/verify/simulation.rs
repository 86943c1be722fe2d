//! A simulator process built by Verilator: operands of one cycle after the other go in, results
//! come out.

use std::fs;
use std::io::{self, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::thread;

use pgs_interface::number::Precision;
use tempfile::TempDir;

use super::Error;
use super::vectors::Vector;
use super::verilator;
use crate::sources::{self, Source};

/// Cycles that the simulator takes and gives at once.
pub const BATCH: usize = 4_096;

/// Words of a cycle's operands.
const OPERANDS: usize = 4;

/// Words of a cycle's results.
pub const RESULTS: usize = 14;

/// The outputs of all operators in one cycle, in the order of `operators_top.v`.
pub type Outputs = [u32; RESULTS];

/// The simulator's own Verilog.
fn top(precision: Precision) -> Source<'static> {
    let text = match precision {
        Precision::F32 => include_str!("operators_top.v"),
        Precision::Binary16 => include_str!("operators_half_top.v"),
    };
    Source { file: TOP, text }
}

const TOP: &str = "operators_top.v";

/// A built simulator of the operators. Its folder is removed with it.
#[derive(Debug)]
pub struct Simulator {
    program: PathBuf,
    _folder: TempDir,
}

impl Simulator {
    /// Builds the simulator from the operators of a precision in the repository, in a temporary
    /// folder.
    ///
    /// # Errors
    ///
    /// A tool is missing, or the build fails.
    pub fn build(precision: Precision) -> Result<Self, Error> {
        Self::build_from(precision, &sources::operators(precision))
    }

    /// Builds it from other files, for example with a fault in one of them.
    ///
    /// # Errors
    ///
    /// As [`Simulator::build`].
    pub fn build_from(precision: Precision, operators: &[Source<'_>]) -> Result<Self, Error> {
        const PURPOSE: &str = "the simulation of the operators";
        verilator::require(PURPOSE)?;
        let folder = verilator::place()?;
        let write = |file: &str, text: &str| {
            fs::write(folder.path().join(file), text).map_err(Error::io("write the sources"))
        };
        for Source { file, text } in operators.iter().chain([&top(precision)]) {
            write(file, text)?;
        }
        write("operators_main.cpp", include_str!("operators_main.cpp"))?;
        verilate(folder.path())?;
        Ok(Self { program: folder.path().join("obj/Voperators_top"), _folder: folder })
    }

    /// Clocks the operators through vectors, and calls `check` with the vectors of each batch and
    /// the outputs of the same cycles. Vectors that do not fill the last batch are not clocked.
    ///
    /// # Errors
    ///
    /// The process cannot be started, or ends early.
    pub fn run(
        &self,
        vectors: impl Iterator<Item = Vector> + Send,
        mut check: impl FnMut(&[Vector], &[Outputs]),
    ) -> Result<(), Error> {
        let mut child = Command::new(&self.program)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(Error::io("start the simulator"))?;
        let done = clock(&mut child, vectors, &mut check);
        // The thread that fed the process has ended and closed its pipe, so that it ends, too.
        let status = child.wait().map_err(Error::io("wait for the simulator"))?;
        let Progress { results, vectors } = done.map_err(Error::io("read from the simulator"))?;
        if results < vectors || !status.success() {
            return Err(Error::Ended { results, vectors, status });
        }
        Ok(())
    }
}

/// Verilates and compiles the files in a folder.
fn verilate(folder: &Path) -> Result<(), Error> {
    let sizes = format!("-O2 -DBATCH={BATCH} -DOPERANDS={OPERANDS} -DRESULTS={RESULTS}");
    let files = [TOP, "operators_main.cpp"].map(str::to_owned);
    verilator::build(
        folder,
        &verilator::Build { top: "operators_top", flags: &sizes, files: &files, waveform: false },
    )
}

/// Vectors that went in and results that came out.
struct Progress {
    results: u64,
    vectors: u64,
}

/// Feeds the process from a thread of its own, while this one reads and checks: the pipes hold less
/// than a batch.
fn clock(
    child: &mut Child,
    vectors: impl Iterator<Item = Vector> + Send,
    check: &mut impl FnMut(&[Vector], &[Outputs]),
) -> io::Result<Progress> {
    let (Some(mut stdin), Some(mut stdout)) = (child.stdin.take(), child.stdout.take()) else {
        return Err(io::Error::other("no pipes"));
    };
    let (sender, receiver) = mpsc::sync_channel::<Vec<Vector>>(4);
    let mut progress = Progress { results: 0, vectors: 0 };
    thread::scope(|scope| {
        scope.spawn(move || {
            let mut vectors = vectors;
            let mut bytes = Vec::with_capacity(BATCH * OPERANDS * 4);
            loop {
                let batch: Vec<Vector> = vectors.by_ref().take(BATCH).collect();
                if batch.len() < BATCH {
                    break;
                }
                bytes.clear();
                for Vector { a, b, radicand, argument } in &batch {
                    for word in [a, b, radicand, argument] {
                        bytes.extend(word.to_ne_bytes());
                    }
                }
                // If the process or the reader has ended, the reader knows why.
                if sender.send(batch).is_err() || stdin.write_all(&bytes).is_err() {
                    break;
                }
            }
        });
        let mut bytes = vec![0; BATCH * RESULTS * 4];
        let mut outputs = vec![[0; RESULTS]; BATCH];
        for batch in receiver {
            progress.vectors += batch.len() as u64;
            match stdout.read_exact(&mut bytes) {
                Ok(()) => progress.results += batch.len() as u64,
                Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => break,
                Err(error) => return Err(error),
            }
            let words = bytes.chunks_exact(4).map(|word| {
                let mut bytes = [0; 4];
                bytes.copy_from_slice(word);
                u32::from_ne_bytes(bytes)
            });
            outputs.as_flattened_mut().iter_mut().zip(words).for_each(|(slot, word)| *slot = word);
            check(&batch, &outputs);
        }
        Ok(progress)
    })
}
