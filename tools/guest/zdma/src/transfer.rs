//! Checks transfers: data, bounds of the written range, interrupts and their absence.

use std::error::Error;
use std::time::{Duration, Instant};

use zynq_pgs::interface::address_map::UIO_MEMORY_NODE;
use zynq_pgs::interface::record::{BEAT_BYTES, Beat};

use crate::Outcome;
use crate::checks::ZDMA_NODE;
use crate::engine::Engine;

/// Longest wait for an expected interrupt.
const LIMIT: Duration = Duration::from_secs(5);
/// Wait that must pass without an interrupt.
const QUIET: Duration = Duration::from_millis(100);
/// Beats of the largest transfer: 1 MiB.
const LARGEST: usize = (1 << 20) / BEAT_BYTES;
/// The content before and after the destination, which must stay.
const GUARD: Beat = Beat([0xFEED_BEEF, 0x0BAD_CAFE, 0x5555_AAAA, 0x1234_5678]);

/// Beats that are all different, and differ for every seed.
pub(crate) fn pattern(beats: usize, seed: u32) -> Vec<Beat> {
    let mut state = seed.wrapping_mul(2_654_435_761) | 1;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state
    };
    (0..beats).map(|_| Beat([next(), next(), next(), next()])).collect()
}

/// A prepared transfer: source filled, destination overwritten, guards around it.
struct Transfer {
    data: Vec<Beat>,
    from: u64,
    to: u64,
}

impl Transfer {
    /// Source in the lower half of the memory, destination in the upper, shifted by the seed.
    fn prepare(engine: &mut Engine, beats: usize, seed: u32) -> Result<Self, Box<dyn Error>> {
        let half = engine.memory.bytes() / 2;
        let beat = BEAT_BYTES as u64;
        let room = half / beat - beats as u64 - 2;
        let place = |seed: u32| u64::from(seed.wrapping_mul(40_503)) % room * beat;
        let (from, to) = (place(seed), half + beat + place(seed ^ 0x5A5A));
        let data = pattern(beats, seed);
        engine.memory.write(from, &data)?;
        let spoiled: Vec<Beat> = data.iter().map(|beat| Beat(beat.0.map(|word| !word))).collect();
        engine.memory.write(to, &spoiled)?;
        engine.memory.write(to - beat, &[GUARD])?;
        engine.memory.write(to + beats as u64 * beat, &[GUARD])?;
        Ok(Self { data, from, to })
    }

    fn start(&self, engine: &mut Engine) -> Result<(), Box<dyn Error>> {
        Ok(engine.start(self.from, self.to, self.data.len())?)
    }

    /// The destination holds the data, the source still does, and the guards stand.
    fn compare(&self, engine: &Engine) -> Result<(), Box<dyn Error>> {
        let mut read = vec![Beat::default(); self.data.len()];
        for (what, at) in [("source", self.from), ("destination", self.to)] {
            engine.memory.read(at, &mut read)?;
            if let Some(wrong) = read.iter().zip(&self.data).position(|(read, data)| read != data) {
                let text = format!("{what}: beat {wrong} of {} differs", self.data.len());
                return Err(text.into());
            }
        }
        for at in [self.to - BEAT_BYTES as u64, self.to + (self.data.len() * BEAT_BYTES) as u64] {
            let mut guard = [Beat::default()];
            engine.memory.read(at, &mut guard)?;
            if guard != [GUARD] {
                return Err(format!("wrote beside the destination, at {at:#x}").into());
            }
        }
        Ok(())
    }
}

/// Makes a transfer that ends with its interrupt; returns the count of interrupts and the time.
fn by_interrupt(
    engine: &mut Engine,
    beats: usize,
    seed: u32,
) -> Result<(u32, Duration), Box<dyn Error>> {
    let transfer = Transfer::prepare(engine, beats, seed)?;
    let begin = Instant::now();
    transfer.start(engine)?;
    let count = engine.device.wait_interrupt(LIMIT)?.ok_or("no interrupt came")?;
    let took = begin.elapsed();
    if !engine.is_done()? {
        return Err("an interrupt, but the transfer is not done".into());
    }
    engine.acknowledge()?;
    engine.device.unmask()?;
    transfer.compare(engine)?;
    Ok((count, took))
}

fn open() -> Result<Engine, Box<dyn Error>> {
    Ok(Engine::open(ZDMA_NODE, UIO_MEMORY_NODE)?)
}

/// Every power of two from 16 bytes to 1 MiB and its neighbours, then sizes of every octave alike;
/// each is compared, and none may fail.
pub(crate) fn thousand() -> Outcome {
    let mut engine = open()?;
    engine.enable_interrupt()?;
    let octaves = LARGEST.ilog2() + 1;
    let edges = (0..octaves).map(|power| 1usize << power).flat_map(|of| [of - 1, of, of + 1]);
    let edges = edges.filter(|beats| (1..=LARGEST).contains(beats));
    let others = (1..).map(|number: usize| {
        let octave = 1usize << ((number * 7) % octaves as usize);
        octave - (number % 97) % octave.div_ceil(2)
    });
    let (mut bytes, mut slowest, mut last) = (0, Duration::ZERO, None);
    for (seed, beats) in (1..=1000).zip(edges.chain(others)) {
        let failed = |error| format!("transfer {seed} ({} bytes): {error}", beats * BEAT_BYTES);
        let (count, took) = by_interrupt(&mut engine, beats, seed).map_err(failed)?;
        if last.is_some_and(|last: u32| count != last.wrapping_add(1)) {
            return Err(
                format!("transfer {seed}: the count jumped from {last:?} to {count}").into()
            );
        }
        (last, slowest) = (Some(count), slowest.max(took));
        bytes += beats * BEAT_BYTES;
    }
    engine.disable_interrupt()?;
    Ok(format!("0 errors, {bytes} bytes, one interrupt each, the slowest {slowest:?}"))
}

/// No interrupt comes, the wait ends in time, and polling finds the transfer done; afterwards
/// interrupts work again.
fn survive(engine: &mut Engine, seed: u32) -> Result<(), Box<dyn Error>> {
    let transfer = Transfer::prepare(engine, 256, seed)?;
    transfer.start(engine)?;
    let begin = Instant::now();
    if let Some(count) = engine.device.wait_interrupt(QUIET)? {
        return Err(format!("an interrupt came, number {count}").into());
    }
    let waited = begin.elapsed();
    if waited < QUIET || waited > LIMIT {
        return Err(format!("waited {waited:?}, asked for {QUIET:?}").into());
    }
    engine.poll_done(LIMIT)?;
    transfer.compare(engine)?;
    engine.acknowledge()?;
    Ok(())
}

/// The interrupt is disabled in the engine.
pub(crate) fn suppressed_in_engine() -> Outcome {
    let mut engine = open()?;
    for seed in 1..=5 {
        survive(&mut engine, seed)?;
    }
    engine.enable_interrupt()?;
    by_interrupt(&mut engine, 256, 6)?;
    engine.disable_interrupt()?;
    Ok("5 transfers found done by polling, then one by interrupt".to_owned())
}

/// The engine raises the interrupt, and the kernel masks it.
pub(crate) fn masked_in_kernel() -> Outcome {
    let mut engine = open()?;
    engine.enable_interrupt()?;
    for seed in 1..=5 {
        engine.device.mask()?;
        survive(&mut engine, seed)?;
    }
    engine.device.unmask()?;
    if engine.device.wait_interrupt(QUIET)?.is_some() {
        // A controller may have latched the edge; at most one interrupt may come.
        engine.device.unmask()?;
        if engine.device.wait_interrupt(QUIET)?.is_some() {
            return Err("interrupts without a cause".into());
        }
    }
    by_interrupt(&mut engine, 256, 6)?;
    engine.disable_interrupt()?;
    Ok("5 transfers found done by polling, then one by interrupt".to_owned())
}

/// The line is a level: an interrupt that is unmasked before its acknowledgement in the engine
/// comes again.
pub(crate) fn not_acknowledged() -> Outcome {
    let mut engine = open()?;
    engine.enable_interrupt()?;
    let transfer = Transfer::prepare(&mut engine, 64, 3)?;
    transfer.start(&mut engine)?;
    let first = engine.device.wait_interrupt(LIMIT)?.ok_or("no interrupt came")?;
    engine.device.unmask()?;
    let second = engine.device.wait_interrupt(LIMIT)?.ok_or("it did not come again")?;
    engine.acknowledge()?;
    engine.device.unmask()?;
    if let Some(third) = engine.device.wait_interrupt(QUIET)? {
        return Err(format!("acknowledged, and came again: {first}, {second}, {third}").into());
    }
    engine.disable_interrupt()?;
    transfer.compare(&engine)?;
    Ok(format!("came again as number {second} after {first}, and no more once acknowledged"))
}
