//! The other end of [`SimulatorProcess`](super::SimulatorProcess) in Rust: serves an accelerator as
//! a simulator serves the Verilog. Tests use it where no simulator can be built.

use std::io::{self, Read, Write};

use super::process::{
    BUSY, CLOCK_LSB, INTERRUPT, LAST, PARTIAL, READ, RECORD, RUN, STREAMS, WRITE,
};
use super::{ExternalAccelerator, ExternalError, Offer, StreamBeat};
use pgs_interface::record::Beat;

/// The reason for which a request has no answer.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RequestError {
    /// The pipes of the client.
    #[error("a request cannot be read, or its answer not be written")]
    Pipe(#[from] io::Error),
    /// The accelerator.
    #[error(transparent)]
    Accelerator(#[from] ExternalError),
    /// The client speaks another protocol.
    #[error("there is no request {found}")]
    Request {
        /// The number of the request.
        found: u32,
    },
}

/// Serves an accelerator until the requests end.
///
/// # Errors
/// [`RequestError`] where a request cannot be answered.
pub fn serve(
    accelerator: &mut dyn ExternalAccelerator,
    requests: &mut dyn Read,
    answers: &mut dyn Write,
) -> Result<(), RequestError> {
    loop {
        let mut first_byte = [0];
        if requests.read(&mut first_byte)? == 0 {
            return Ok(());
        }
        let [request, first, second] = words(&mut first_byte.chain(&mut *requests))?;
        let answer = match request {
            READ => vec![accelerator.read(first)?],
            WRITE => {
                accelerator.write(first, second)?;
                vec![0]
            }
            RUN => run(accelerator, first, requests)?,
            RECORD => vec![0],
            found => return Err(RequestError::Request { found }),
        };
        let bytes: Vec<u8> = answer.into_iter().flat_map(u32::to_le_bytes).collect();
        answers.write_all(&bytes)?;
        answers.flush()?;
    }
}

fn words<const N: usize>(requests: &mut dyn Read) -> io::Result<[u32; N]> {
    let mut words = [0; N];
    for word in &mut words {
        let mut bytes = [0; 4];
        requests.read_exact(&mut bytes)?;
        *word = u32::from_le_bytes(bytes);
    }
    Ok(words)
}

fn run(
    accelerator: &mut dyn ExternalAccelerator,
    limit: u32,
    requests: &mut dyn Read,
) -> Result<Vec<u32>, RequestError> {
    let offered: [u32; STREAMS] = words(requests)?;
    let space: [u32; STREAMS] = words(requests)?;
    let mut offer = Offer { space: space.map(|space| space as usize).to_vec(), beats: Vec::new() };
    for offered in offered {
        let mut beats = Vec::new();
        for _ in 0..offered {
            let [a, b, c, d, marks] = words(requests)?;
            let (last, partial) = (marks & LAST != 0, marks & PARTIAL != 0);
            beats.push(StreamBeat { beat: Beat([a, b, c, d]), last, partial });
        }
        offer.beats.push(beats);
    }
    let clocked = accelerator.run(limit, &offer)?;
    let level = if clocked.interrupt { INTERRUPT } else { 0 } | if clocked.busy { BUSY } else { 0 };
    let count = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
    let mut answer = vec![clocked.clocks, level];
    let taken = |stream: usize| clocked.taken.get(stream).copied().unwrap_or(0);
    let sent = |stream: usize| clocked.sent.get(stream).map_or(0, Vec::len);
    answer.extend((0..STREAMS).map(taken).map(count));
    answer.extend((0..STREAMS).map(sent).map(count));
    for (stream, beats) in clocked.sent.iter().enumerate() {
        for (at, beat) in beats.iter().enumerate() {
            let clock = clocked.sent_at.get(stream).and_then(|clocks| clocks.get(at));
            let clock = clock.copied().unwrap_or(clocked.clocks.saturating_sub(1));
            answer.extend(beat.beat.0);
            answer.push(u32::from(beat.last) | clock << CLOCK_LSB);
        }
    }
    Ok(answer)
}
