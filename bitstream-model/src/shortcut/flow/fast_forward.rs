//! Lets a stretch of a board's time pass at once: counts what flows in it, then makes the board as it
//! is afterwards.

use super::periods::Periods;
use super::records::{Bodies, Issues};
use super::{Flow, FlowState, Flowed, Limits, PerEngine, Rules};
use crate::accelerator::Phase;
use crate::accelerator::defer::Defer;
use crate::accelerator::records::results::Results;
use crate::accelerator::records::segment::Segment;
use crate::accelerator::records::striping::{ROWS_IN, STREAMS_MAX};
use crate::board::short_cut::{ShortCut, Stretch};
use crate::memory::Source;
use crate::shortcut::deferred::{BodyRows, Coming, Deferred};
use crate::stream::Stream;
use pgs_interface::axi_dma::Direction;
use pgs_interface::record::velocity;
use pgs_interface::stripe::IMPULSES_STREAM;

/// Where the next beats of each input are, the ones in its FIFO before the ones about to come, and
/// how many.
type Sources = [(Source, usize); STREAMS_MAX];

/// The short cut of a board: deferred arithmetic, and stretches of time that pass at once.
#[derive(Debug)]
pub(crate) struct FastForward {
    deferred: Deferred,
    periods: PerPass,
}

/// The recorded flows of the collisions, of each kind of pass.
#[derive(Debug)]
struct PerPass {
    usual: Periods,
    /// With impulses that come in.
    warm: Periods,
    /// With impulses that go out.
    sending: Periods,
}

impl FastForward {
    pub(crate) fn new(deferred: Deferred) -> Self {
        let [usual, warm, sending] = [(); 3].map(|()| Periods::new());
        Self { deferred, periods: PerPass { usual, warm, sending } }
    }
}

impl ShortCut for FastForward {
    fn defer(&mut self) -> &mut (dyn Defer + 'static) {
        &mut self.deferred
    }

    fn fast_forward(&mut self, stretch: Stretch<'_>) -> u64 {
        let Self { deferred, periods } = self;
        let Some(phase) = stretch.accelerator.undisturbed() else { return 0 };
        let passed = match *phase {
            Phase::Pass { number, segment } => {
                collisions(deferred, periods, stretch, number, segment)
            }
            Phase::Load(segment) => bodies(deferred, stretch, segment, None),
            Phase::Integrate { poses, results } => bodies(deferred, stretch, poses, Some(results)),
            _ => None,
        };
        passed.unwrap_or(0)
    }
}

/// A flow that begins on a board. `limits` hold for it.
fn begin(stretch: &Stretch<'_>, limits: Limits) -> Flow {
    let mut state =
        FlowState { held: PerEngine::default(), ahead: [0; STREAMS_MAX], turn: *stretch.turn };
    let mut beat_shift = [0; STREAMS_MAX];
    for (k, core) in stretch.cores.iter().enumerate() {
        state.held[2 * k] = stretch.inputs[k].len();
        state.held[2 * k + 1] = stretch.outputs.get(k).map_or(0, |output| output.len());
        state.ahead[k] = core.ahead(stretch.now);
        beat_shift[k] = core.beat_shift();
    }
    let (cores, depth) = (stretch.cores.len(), stretch.inputs[0].depth());
    let rules = Rules { cores, beat_shift, depth, arbiter: stretch.arbiter };
    Flow { rules, limits, state, flowed: Flowed::default() }
}

/// The inputs have got the beats of a flow, which stay where they are.
fn pass_inputs(inputs: &mut [Stream], flow: &Flow, coming: &Coming) {
    for (k, (stream, coming)) in inputs.iter_mut().zip(coming).enumerate() {
        let read = flow.flowed.beats[2 * k];
        if let Some((source, _)) = coming.filter(|_| read > 0) {
            stream.push_span(source, read);
        }
    }
}

/// The cores have moved the beats of a flow.
fn pass_cores(stretch: &mut Stretch<'_>, flow: &Flow) {
    let Flowed { cycles, beats, .. } = flow.flowed;
    for (k, core) in stretch.cores.iter_mut().enumerate() {
        let (read, written) = (beats[2 * k], beats[2 * k + 1]);
        core.pass_over(Direction::Mm2s, read);
        core.pass_over(Direction::S2mm, written);
        core.set_ahead(stretch.now + cycles, flow.state.ahead[k]);
        stretch.moved.beats_read += read as u64;
        stretch.moved.beats_written += written as u64;
    }
    *stretch.turn = flow.state.turn;
}

/// Whether the outputs are empty, and no S2MM does anything as long as they are.
fn outputs_rest(Stretch { now, cores, outputs, .. }: &Stretch<'_>) -> bool {
    outputs.iter().all(|stream| stream.len() == 0)
        && cores.iter().all(|core| core.rests_without_beats(*now))
}

/// The beats about to come to each input, if its MM2S does nothing but move them.
fn coming(Stretch { now, cores, memory, .. }: &Stretch<'_>) -> Option<Coming> {
    let mut coming = Coming::default();
    for (coming, core) in coming.iter_mut().zip(&**cores) {
        let (at, beats) = core.undisturbed(Direction::Mm2s, *now)?;
        *coming = Some((memory.source(at, beats).ok()??, beats));
    }
    Some(coming)
}

/// Lets the collisions of a pass flow; returns the cycles that have passed.
fn collisions(
    deferred: &mut Deferred,
    periods: &mut PerPass,
    mut stretch: Stretch<'_>,
    number: u32,
    mut segment: Segment,
) -> Option<u64> {
    let now = stretch.now;
    let arguments = &stretch.accelerator.arguments;
    let (warm, sends) = (arguments.is_warm(number), arguments.sends_impulses(number));
    if !deferred.takes_collisions() || !sends && !outputs_rest(&stretch) {
        return None;
    }
    let mut writes = [(0, 0); STREAMS_MAX];
    if sends {
        writes[IMPULSES_STREAM] = impulses_leave(&stretch)?;
    }
    let coming = coming(&stretch)?;
    let Stretch { accelerator, inputs, memory, .. } = &mut stretch;
    let ahead =
        deferred.collisions_ahead(accelerator, number, &segment, inputs, &coming, memory)?;
    let mut limits =
        Limits { cycles: stretch.until - now, records: ahead.issues, beats: PerEngine::default() };
    for (k, beats) in coming.iter().enumerate() {
        limits.beats[2 * k] = beats.map_or(0, |(_, beats)| beats);
        limits.beats[2 * k + 1] = writes[k].1;
    }
    let mut flow = begin(&stretch, limits);
    let accelerator = &mut *stretch.accelerator;
    let done = segment.done;
    if sends {
        let issues = Issues::<true> { accelerator, deferred, ahead, done };
        run(&mut flow, issues, &mut periods.sending);
    } else {
        let issues = Issues::<false> { accelerator, deferred, ahead, done };
        run(&mut flow, issues, if warm { &mut periods.warm } else { &mut periods.usual });
    }
    let Flowed { cycles, waits, records, .. } = flow.flowed;
    if cycles == 0 {
        return None;
    }
    if sends {
        let Stretch { accelerator, outputs, memory, .. } = &mut stretch;
        writes[IMPULSES_STREAM].1 = flow.flowed.beats[2 * IMPULSES_STREAM + 1];
        let (_, mut places) = memory.lend(Sources::default(), writes)?;
        let place = std::mem::take(&mut places[IMPULSES_STREAM]);
        deferred.pass_over_impulses(accelerator, number, (done, records), outputs, place);
    }
    pass_cores(&mut stretch, &flow);
    let Stretch { accelerator, inputs, .. } = stretch;
    pass_inputs(inputs, &flow, &coming);
    deferred.pass_over_issues(accelerator, number, &mut segment, records, inputs);
    accelerator.pass_over(cycles, waits, Phase::Pass { number, segment });
    Some(cycles)
}

/// Lets the issues of a pass flow.
fn run<const IMPULSES: bool>(
    flow: &mut Flow,
    mut issues: Issues<'_, IMPULSES>,
    periods: &mut Periods,
) {
    match issues.ahead.last {
        Some(last) => flow.run_evenly(&mut issues, last, periods),
        None => flow.run(&mut issues),
    }
}

/// Where the next impulses go, and for how many there is room, if nothing happens on the outputs but that
/// these leave.
fn impulses_leave(stretch: &Stretch<'_>) -> Option<(u64, usize)> {
    let Stretch { now, cores, outputs, memory, .. } = stretch;
    let others = || (0..cores.len()).filter(|k| *k != IMPULSES_STREAM);
    let rest = others().all(|k| {
        outputs.get(k).is_none_or(|output| output.len() == 0) && cores[k].rests_without_beats(*now)
    });
    let (at, beats) = cores[IMPULSES_STREAM].undisturbed(Direction::S2mm, *now)?;
    (rest && memory.may_write(at, beats)).then_some((at, beats))
}

/// Lets bodies flow, which are loaded, or integrated with these results; returns the cycles that
/// have passed.
fn bodies(
    deferred: &mut Deferred,
    mut stretch: Stretch<'_>,
    mut segment: Segment,
    results: Option<Results>,
) -> Option<u64> {
    let turns = deferred.bodies()?;
    let rows_of_body = if results.is_some() { ROWS_IN } else { deferred.rows_of_velocity() };
    if results.is_none() && !outputs_rest(&stretch) {
        return None;
    }
    let coming = coming(&stretch)?;
    let sources = sources(&stretch, &coming)?;
    let mut limits = Limits {
        cycles: stretch.until - stretch.now,
        // The last bodies end packets.
        records: (segment.left() + 1).saturating_sub(turns.streams.div_ceil(rows_of_body)),
        beats: PerEngine::default(),
    };
    let mut writes = [(0, 0); STREAMS_MAX];
    for (k, core) in stretch.cores.iter().enumerate() {
        limits.beats[2 * k] = coming[k].map_or(0, |(_, beats)| beats);
        if results.is_some() {
            let (at, beats) = core.undisturbed(Direction::S2mm, stretch.now)?;
            stretch.memory.may_write(at, beats).then_some(())?;
            (writes[k].0, limits.beats[2 * k + 1]) = (at, beats);
        }
    }
    if results.is_none() {
        let memory = &*stretch.memory;
        let good = deferred.bodies_with_shape(&segment, &sources, limits.cycles, memory)?;
        limits.records = limits.records.min(good);
    }
    let mut flow = begin(&stretch, limits);
    let done = segment.done;
    match turns.streams {
        4 => flow_of::<4>(&mut flow, done, rows_of_body, results.is_some()),
        3 => flow_of::<3>(&mut flow, done, rows_of_body, results.is_some()),
        2 => flow_of::<2>(&mut flow, done, rows_of_body, results.is_some()),
        _ => flow_of::<1>(&mut flow, done, rows_of_body, results.is_some()),
    }
    let Flowed { cycles, waits, records, beats } = flow.flowed;
    if cycles == 0 {
        return None;
    }
    let mut reads = sources;
    let [before, after] = [done, done + records].map(|bodies| turns.counts(rows_of_body * bodies));
    for k in 0..stretch.cores.len() {
        reads[k].1 = after[k] - before[k];
        writes[k].1 = beats[2 * k + 1];
    }
    let Stretch { accelerator, inputs, outputs, memory, .. } = &mut stretch;
    let (views, places) = memory.lend(reads, writes)?;
    let rows = BodyRows { views, turns, rows: rows_of_body, first: done };
    pass_inputs(inputs, &flow, &coming);
    let phase = match results {
        None => {
            deferred.pass_over_loaded(accelerator, &mut segment, records, rows, inputs);
            Phase::Load(segment)
        }
        Some(mut results) => {
            let streams = (&mut **inputs, &mut **outputs);
            deferred.pass_over_integrated(
                accelerator,
                &mut segment,
                records,
                rows,
                streams,
                places,
            );
            results.pass(records);
            Phase::Integrate { poses: segment, results }
        }
    };
    accelerator.pass_over(cycles, waits, phase);
    pass_cores(&mut stretch, &flow);
    Some(cycles)
}

/// Lets bodies of `rows` rows each flow on `STREAMS` streams.
fn flow_of<const STREAMS: usize>(flow: &mut Flow, done: usize, rows: usize, results: bool) {
    match (rows, results) {
        (_, true) => flow.run(&mut Bodies::<STREAMS, ROWS_IN, true> { done }),
        (velocity::WORLD_ROWS, false) => {
            flow.run(&mut Bodies::<STREAMS, { velocity::WORLD_ROWS }, false> { done });
        }
        (_, false) => flow.run(&mut Bodies::<STREAMS, ROWS_IN, false> { done }),
    }
}

/// The next beats of each input, if the ones in its FIFO lie before the ones about to come, in the
/// same buffer.
fn sources(stretch: &Stretch<'_>, coming: &Coming) -> Option<Sources> {
    let mut sources = Sources::default();
    for (source, (stream, coming)) in sources.iter_mut().zip(stretch.inputs.iter().zip(coming)) {
        let ((next, beats), held) = ((*coming)?, stream.len());
        let first = match stream.piece(0, held) {
            (0, _) => next,
            (count, Some(first)) if count == held => first,
            _ => return None,
        };
        if first.further(held as u64) != next {
            return None;
        }
        *source = (first, held + beats);
    }
    Some(sources)
}
