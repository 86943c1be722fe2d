//! Counts relative deviations in bins of a logarithmic scale, four a decade.

use serde::Serialize;

/// Lower edges of the four bins of a decade: powers of ten by quarters of the exponent.
const QUARTERS: [f64; 4] =
    [1.0, 1.778_279_410_038_922_8, 3.162_277_660_168_379_5, 5.623_413_251_903_491];
/// Smallest deviation with a bin, percent. An f32 changes by 6e-6 % at least.
const LEAST: f64 = 1e-6;
/// Decades with bins.
const DECADES: usize = 12;

/// Numbers by their relative deviation, |new - original| / |original|.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Histogram {
    /// The edges of the bins, one more than bins.
    pub(crate) edges_percent: Vec<f64>,
    /// The numbers in each bin; a bin includes its lower edge.
    pub(crate) counts: Vec<u64>,
    /// Numbers that do not deviate.
    pub(crate) equal: u64,
    /// Numbers that deviate by less than the lowest edge.
    pub(crate) below: u64,
    /// Numbers that deviate by the highest edge or more.
    pub(crate) above: u64,
    /// Numbers whose original is 0 and that have no relative deviation.
    pub(crate) original_zero: u64,
}

impl Histogram {
    /// Counts pairs (original, new) of finite numbers.
    pub(crate) fn of(pairs: impl IntoIterator<Item = (f32, f32)>) -> Self {
        let edges_percent = edges();
        let mut found = Self {
            counts: vec![0; edges_percent.len().saturating_sub(1)],
            edges_percent,
            equal: 0,
            below: 0,
            above: 0,
            original_zero: 0,
        };
        for (original, new) in pairs {
            found.add(f64::from(original), f64::from(new));
        }
        found
    }

    fn add(&mut self, original: f64, new: f64) {
        let difference = (new - original).abs();
        if original == 0.0 {
            self.original_zero += 1;
        } else if difference == 0.0 {
            self.equal += 1;
        } else {
            let percent = difference / original.abs() * 100.0;
            match self.edges_percent.partition_point(|edge| *edge <= percent) {
                0 => self.below += 1,
                edges => match self.counts.get_mut(edges - 1) {
                    Some(count) => *count += 1,
                    None => self.above += 1,
                },
            }
        }
    }

    /// Adds the counts of another one.
    pub(crate) fn include(&mut self, other: &Self) {
        for (count, more) in self.counts.iter_mut().zip(&other.counts) {
            *count += more;
        }
        self.equal += other.equal;
        self.below += other.below;
        self.above += other.above;
        self.original_zero += other.original_zero;
    }

    /// The share of numbers that deviate by less than each edge, percent.
    pub(crate) fn below(&self) -> Vec<(f64, f64)> {
        let Self { edges_percent, counts, equal, below, above, .. } = self;
        let all = equal + below + above + counts.iter().sum::<u64>();
        let share = |count: u64| 100.0 * count as f64 / (all as f64).max(1.0);
        let mut sum = equal + below;
        let mut points = Vec::with_capacity(edges_percent.len());
        for (edge, count) in edges_percent.iter().zip(counts.iter().chain([above])) {
            points.push((*edge, share(sum)));
            if sum == all {
                break;
            }
            sum += count;
        }
        points
    }

    /// The shares of the numbers by decade, among all whose original is not 0: the lower edge of
    /// the decade in percent, and the share. The first is of the numbers below the lowest edge.
    pub(crate) fn decades(&self) -> Vec<(f64, f64)> {
        let all = self.equal + self.below + self.above + self.counts.iter().sum::<u64>();
        let share = |count: u64| count as f64 / (all as f64).max(1.0);
        let lowest = std::iter::once((0.0, share(self.equal + self.below)));
        let each = self
            .counts
            .chunks(QUARTERS.len())
            .zip(self.edges_percent.iter().step_by(QUARTERS.len()));
        let each = each.map(|(bins, edge)| (*edge, share(bins.iter().sum())));
        let highest = self.edges_percent.last().map(|edge| (*edge, share(self.above)));
        lowest.chain(each).chain(highest).collect()
    }
}

/// The edges of the bins. Products alone, so that they are the same on every machine.
fn edges() -> Vec<f64> {
    let mut decade = LEAST;
    let mut edges = Vec::with_capacity(DECADES * QUARTERS.len() + 1);
    for _ in 0..DECADES {
        edges.extend(QUARTERS.map(|quarter| decade * quarter));
        decade *= 10.0;
    }
    edges.push(decade);
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_number_is_counted_once_in_the_bin_of_its_deviation() {
        let found = Histogram::of([
            (1.0, 1.0),
            (0.0, 5.0),
            // 100 %, 1 %, and a million times 100 %.
            (2.0, 4.0),
            (-1.0, -1.01),
            (1.0, 2e7),
        ]);
        assert_eq!((found.equal, found.original_zero, found.above, found.below), (1, 1, 1, 0));
        let full: Vec<f64> = (found.counts.iter().zip(&found.edges_percent))
            .filter_map(|(count, edge)| (*count > 0).then_some(*edge))
            .collect();
        assert_eq!(full.len(), 2);
        assert!((0.5..=1.01).contains(&full[0]) && (56.0..=100.01).contains(&full[1]), "{full:?}");
        assert_eq!(found.counts.iter().sum::<u64>(), 2);
    }

    #[test]
    fn shares_below_rise_to_all_numbers() {
        let points = Histogram::of([(1.0, 1.0), (1.0, 1.005), (1.0, 1.5)]).below();
        assert!(points.windows(2).all(|pair| pair[0].1 <= pair[1].1));
        let at =
            |edge: f64| points.iter().find(|point| point.0 >= edge * 0.999).expect("an edge").1;
        assert!((at(0.1) - 100.0 / 3.0).abs() < 1e-9 && (at(1.0) - 200.0 / 3.0).abs() < 1e-9);
    }

    #[test]
    fn shares_by_decade_add_up_and_histograms_do() {
        let mut found = Histogram::of([(1.0, 1.0), (1.0, 1.5), (1.0, 1.6), (1.0, 1.002)]);
        let decades = found.decades();
        assert_eq!(decades.len(), DECADES + 2);
        let sum: f64 = decades.iter().map(|(_, share)| share).sum();
        assert!((sum - 1.0).abs() < 1e-12);
        let tens = decades.iter().find(|(edge, _)| (9.9..10.1).contains(edge)).expect("10 %");
        assert!((tens.1 - 0.5).abs() < 1e-12);
        let one = found.clone();
        found.include(&one);
        assert_eq!(found.counts.iter().sum::<u64>(), 6);
        assert_eq!(found.equal, 2);
    }
}
