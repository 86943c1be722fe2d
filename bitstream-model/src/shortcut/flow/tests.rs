use super::records::issues_held;
use super::*;
use crate::accelerator::records::striping::PerStream;
use crate::config::{Bandwidth, BoardConfig};
use pgs_interface::profile::{FLOAT, HALF, Profile};

/// A design, the beats of an issue on each of its inputs, and the logarithm of their cycles.
type Design = (&'static Profile, PerStream, [u32; STREAMS_MAX]);
const OF_FLOAT: Design = (&FLOAT, [2, 2, 2, 1], [0; STREAMS_MAX]);
const OF_HALF: Design = (&HALF, [3, 3, 1, 0], [0, 0, 1, 0]);

/// Issues that each take the design's interval, and the slices in which they were taken.
struct Even {
    share: PerStream,
    interval: u64,
    slices: Vec<(usize, usize, u64)>,
}

impl Records for Even {
    const RESULTS: bool = false;

    fn ready(&self, _: usize, held: &PerEngine, _: usize) -> usize {
        issues_held(&self.share, held)
    }

    fn cycles_max(&self, _: usize, records: usize) -> u64 {
        records as u64 * self.interval
    }

    fn beats(&self, _: usize, records: usize) -> (PerStream, PerStream) {
        (self.share.map(|share| records * share), [0; STREAMS_MAX])
    }

    fn enter(&mut self, first: usize, records: usize, cycles: u64) -> u64 {
        self.slices.push((first, records, cycles));
        records as u64 * self.interval
    }
}

/// A flow of a pass over many collisions, from a state of the FIFOs on.
fn flow(
    (profile, share, beat_shift): Design,
    bandwidth: Bandwidth,
    depth: usize,
    held: PerStream,
) -> (Flow, Even) {
    let config = BoardConfig { profile, bandwidth, ..BoardConfig::default() };
    let cores = profile.mm2s_widths.len();
    let records = 127_746;
    let mut state =
        FlowState { held: PerEngine::default(), ahead: [0; STREAMS_MAX], turn: Turn::default() };
    let mut limits = Limits { cycles: 1_000_000, records, beats: PerEngine::default() };
    for k in 0..STREAMS_MAX {
        limits.beats[2 * k] = records * share[k];
        // Nothing is where nothing comes.
        state.held[2 * k] = if share[k] > 0 { held[k] } else { 0 };
    }
    let rules = Rules { cores, beat_shift, depth, arbiter: Arbiter::new(&config, cores) };
    let interval = profile.initiation_interval.into();
    let issues = Even { share, interval, slices: Vec::new() };
    (Flow { rules, limits, state, flowed: Flowed::default() }, issues)
}

const SUSTAINED: Bandwidth = Bandwidth::ZCU102_SUSTAINED;

#[test]
fn periods_passed_over_give_what_each_slice_would_have_given() {
    let bandwidths = [
        Bandwidth::Unlimited,
        SUSTAINED,
        Bandwidth::ZCU102_PEAK,
        Bandwidth::BytesPerSecond(3_700_000_000),
        Bandwidth::BytesPerSecond(7_123_456_789),
        Bandwidth::BytesPerSecond(100_000_000),
    ];
    let designs = [OF_FLOAT, OF_HALF];
    for (bandwidth, design) in bandwidths.iter().flat_map(|b| designs.map(|design| (*b, design))) {
        for (depth, held) in [(512, [0; 4]), (16, [3, 1, 0, 9]), (64, [0, 7, 64, 2])] {
            let case = format!("{} {bandwidth:?} {depth}", design.0.name);
            let (mut each, mut issues) = flow(design, bandwidth, depth, held);
            each.run(&mut issues);
            // With a period that an earlier flow has left, too.
            let mut periods = Periods::new();
            for _ in 0..2 {
                let (mut evenly, mut gone_through) = flow(design, bandwidth, depth, held);
                evenly.run_evenly(&mut gone_through, 158, &mut periods);
                assert_eq!((evenly.flowed, evenly.state), (each.flowed, each.state), "{case}");
                // The last ones are the same one by one.
                let last = |slices: &[(usize, usize, u64)]| -> Vec<_> {
                    let from = each.flowed.records - 158;
                    let tells = |slice: &&(usize, usize, u64)| slice.0 + slice.1 > from;
                    slices.iter().filter(tells).copied().collect()
                };
                assert_eq!(last(&gone_through.slices), last(&issues.slices), "{case}");
            }
        }
    }
}

#[test]
fn most_of_a_pass_on_the_board_that_everybody_has_is_passed_over() {
    for (design, held) in [(OF_FLOAT, [0; 4]), (OF_HALF, [0; 4]), (OF_FLOAT, [512, 503, 428, 399])]
    {
        let (mut each, mut issues) = flow(design, SUSTAINED, 512, held);
        each.run(&mut issues);
        let mut periods = Periods::new();
        // The first pass finds the period, the next ones know it.
        for part in [4, 12] {
            let (mut evenly, mut gone_through) = flow(design, SUSTAINED, 512, held);
            evenly.run_evenly(&mut gone_through, 158, &mut periods);
            let (some, all) = (gone_through.slices.len(), issues.slices.len());
            assert!(some < all / part, "{}: {some} of {all}", design.0.name);
        }
    }
}
