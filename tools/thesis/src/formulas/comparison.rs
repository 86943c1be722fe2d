//! Compares with GPU and CPU: Tables 6.5 to 6.7 and 6.9 to 6.11, equation 6.5.
//!
//! Times and powers of other machines are the thesis'; only the accelerator's time is ours, and it
//! is modelled.

use crate::estimate::thesis::amdahl;
use crate::estimate::thesis::recorded::{
    ACCELERATED_SHARE, CPU, Design, GPU, Platform, ZCU102_WATTS,
};
use crate::estimate::{Records, StepTime, thesis};
use crate::experiment::Part;
use crate::figure::{Figure as Chart, bars};
use crate::index::Row;
use bitstream_model::Bandwidth;
use pgs_interface::profile::{PROFILES, Variant};

use super::scene::{Scene, difference};
use crate::table::{Cell, Kind, Table, text};
use Source::{Latency, Powers};

pub(super) fn tables(scene: &Scene) -> Vec<Table> {
    vec![platforms(), against(scene)]
}

fn platforms() -> Table {
    let title = "The thesis' records of GPU, CPU and board (T6.5, T6.9)";
    let mut table = Table::new("platforms", title);
    for (name, watts, other) in [
        (GPU.name, GPU.watts, Some(GPU)),
        (CPU.name, CPU.watts, Some(CPU)),
        ("ZCU102", ZCU102_WATTS, None),
    ] {
        let joules = other.map(|other| (watts * other.latency_ms / 1e3, other.joules));
        table.row([
            ("platform", "platform", text(name)),
            ("ms", "ms", Cell::known(other, |other| Cell::Number(other.latency_ms, 2))),
            ("watts", "W", Cell::Number(watts, 0)),
            ("joules", "J", Cell::known(joules, |(_, printed)| Cell::Number(printed, 2))),
            (
                "recomputed_joules",
                "J from ms and W",
                Cell::known(joules, |(found, _)| Cell::Number(found, 3)),
            ),
            (
                "difference_percent",
                "difference",
                Cell::known(joules, |(found, printed)| difference(found, printed)),
            ),
            ("kind", "kind", Kind::Recorded.cell()),
        ]);
    }
    table.note(format!(
        "T6.2 and T6.3 give thermal design powers of {} and {} W for the same GPU and CPU; the 15 \
         W of the board are its maximum, not measured.",
        GPU.design_watts, CPU.design_watts
    ));
    table
}

/// A figure of the thesis' comparison, over GPU and CPU or alone.
struct Figure {
    /// Its name; `{}` stands for the platform's.
    name: &'static str,
    /// The thesis' table.
    table: fn(&Design) -> &'static str,
    /// The printed figures, if there are some: over GPU and CPU, or twice the one.
    printed: fn(&Design) -> Option<[f64; 2]>,
    /// The formula: from a time in ms, or from the thesis' powers alone.
    of: Source,
}

type Formula = fn(f64, &Platform) -> f64;

enum Source {
    Latency(Formula),
    Powers(fn(&Platform) -> f64),
}

fn joules(ms: f64) -> f64 {
    ZCU102_WATTS * ms / 1e3
}

fn speedup(ms: f64, platform: &Platform) -> f64 {
    platform.latency_ms / ms
}

/// Computes with both energies unrounded, not with the printed ones.
fn energy(ms: f64, platform: &Platform) -> f64 {
    platform.watts * platform.latency_ms / 1e3 / joules(ms)
}

/// The figures in the order of the thesis' tables of latency, speed-up and efficiency.
const FIGURES: [Figure; 8] = [
    Figure {
        name: "latency, ms",
        table: |design| design.comparison,
        printed: |design| Some([design.latency_ms; 2]),
        of: Latency(|ms, _| ms),
    },
    Figure {
        name: "energy at 15 W, J",
        table: |design| design.comparison,
        printed: |design| Some([design.joules; 2]),
        of: Latency(|ms, _| joules(ms)),
    },
    Figure {
        name: "speed-up over {}",
        table: |design| design.speedups,
        printed: |design| Some(design.speedup),
        of: Latency(speedup),
    },
    Figure {
        name: "power efficiency over {}",
        table: |design| design.efficiencies,
        printed: |design| Some(design.power),
        of: Powers(|platform| platform.watts / ZCU102_WATTS),
    },
    Figure {
        name: "energy efficiency over {}",
        table: |design| design.efficiencies,
        printed: |design| Some(design.energy),
        of: Latency(energy),
    },
    Figure {
        name: "power efficiency, {} TDP",
        table: |design| design.efficiencies,
        printed: |_| None,
        of: Powers(|platform| platform.design_watts / ZCU102_WATTS),
    },
    Figure {
        name: "energy efficiency, {} TDP",
        table: |design| design.efficiencies,
        printed: |_| None,
        of: Latency(|ms, it| energy(ms, &Platform { watts: it.design_watts, ..*it })),
    },
    Figure {
        name: "whole step over GTX 980's",
        table: |_| "eq 6.5",
        printed: |design| Some([design.whole_step; 2]),
        of: Latency(|ms, _| amdahl(ACCELERATED_SHARE, speedup(ms, &GPU))),
    },
];

fn against(scene: &Scene) -> Table {
    let mut table = Table::new(
        "comparison",
        "Against the thesis' GPU and CPU (T6.5 to T6.7, T6.9 to T6.11, equation 6.5)",
    );
    for variant in &scene.variants {
        for figure in &FIGURES {
            let platforms = if figure.name.contains("{}") { 2 } else { 1 };
            for (k, platform) in [GPU, CPU].iter().enumerate().take(platforms) {
                add(&mut table, scene, variant, figure, (k, platform));
            }
        }
    }
    table.note(
        "Recomputed: from the thesis' own cycles, clock and powers, unrounded. Ours: packed \
         records without a wait for memory, as the thesis counts; then records as streamed, at \
         unlimited, 17.07 and 12.8 GB/s. Time and power of GPU and CPU, the board's 15 W and the \
         share of 60 % in equation 6.5 are the thesis'; no figure was measured here.",
    );
    table.note(format!(
        "TDP: with the {} and {} W that T6.2 and T6.3 print for the same GPU and CPU, in place of \
         the {} and {} W that the thesis divides by.",
        GPU.design_watts, CPU.design_watts, GPU.watts, CPU.watts
    ));
    table.note(
        "The thesis divides energies that it has rounded to two digits; 133 W over 15 W is 8.87, \
         not 8.67. Its Figures 6.1 and 6.2 chart its first design, naive, and its text prints no \
         numbers of it. Ours is a lower bound of it: the thesis converts contacts in a kernel of \
         its own, whose rows go through memory, ours within the passes.",
    );
    table
}

fn add(
    table: &mut Table,
    scene: &Scene,
    variant: &Variant,
    figure: &Figure,
    (k, platform): (usize, &Platform),
) {
    let design = Design::of(variant.profile);
    let printed = design.and_then(figure.printed).map(|both| both[k]);
    let (recomputed, ours, off, kind) = match figure.of {
        // Every figure of the row is the thesis'.
        Source::Powers(_) if design.is_none() => return,
        Source::Powers(of) => {
            let found = of(platform);
            let off = Cell::known(printed, |printed| difference(found, printed));
            (Some(found), [None; 4], off, Kind::Recorded)
        }
        Source::Latency(of) => {
            let thesis = design.map(|it| it.cycles as f64 / f64::from(it.profile.clock_khz));
            let ours = [
                (Records::Packed, Bandwidth::Unlimited),
                (Records::Streamed, Bandwidth::Unlimited),
                (Records::Streamed, Bandwidth::ZCU102_PEAK),
                (Records::Streamed, Bandwidth::ZCU102_SUSTAINED),
            ]
            .map(|(records, bandwidth)| {
                let time = StepTime::new(variant, records, &scene.step, bandwidth);
                of(time.seconds * 1e3, platform)
            });
            let off = Cell::known(printed, |printed| scene.difference(ours[0], printed));
            (thesis.map(|ms| of(ms, platform)), ours.map(Some), off, Kind::Modelled)
        }
    };
    let number = |value| Cell::known(value, |value| Cell::Number(value, 2));
    let [packed, unlimited, peak, sustained] = ours.map(number);
    table.row([
        ("profile", "profile", text(variant.profile.name)),
        ("table", "table", text(design.map_or("-", figure.table))),
        ("figure", "figure", text(figure.name.replace("{}", platform.name))),
        ("thesis", "thesis", number(printed)),
        ("recomputed", "recomputed", number(recomputed)),
        ("packed_unlimited", "ours", packed),
        ("difference_percent", "diff.", off),
        ("streamed_unlimited", "streamed", unlimited),
        ("streamed_peak", "17.07 GB/s", peak),
        ("streamed_sustained", "12.8 GB/s", sustained),
        ("kind", "kind", kind.cell()),
    ]);
}

/// Figures 6.1 and 6.2: speed-up and energy efficiency of each design over the thesis' GPU and CPU.
pub(super) fn figures(part: &mut Part) {
    let caption = "Times of GTX 980 and i7-3770 are the thesis' records; the accelerator's are our \
        model's, on the thesis' step. The thesis' figure has bars of its first design, and its \
        text prints no numbers of it. Our naive converts contacts within the passes, the thesis in \
        a kernel of its own whose rows go through memory: ours is a lower bound of its first \
        design.";
    let (figure, row) = over_both(
        ("figure-6-1", "§6.5, Figure 6.1"),
        ["speed-up", "Speed-up of each design over GPU and CPU", caption],
        |design| design.speedup,
        speedup,
    );
    part.figure(figure, [row]);
    let caption = "Powers are the thesis': 288 W, 133 W, and 15 W for the board, its maximum and \
        not measured. The table of the comparison has the thermal design powers of its Tables 6.2 \
        and 6.3 beside them.";
    let (figure, row) = over_both(
        ("figure-6-2", "§6.5, Figure 6.2"),
        ["energy efficiency", "Energy efficiency of each design over GPU and CPU", caption],
        |design| design.energy,
        energy,
    );
    part.figure(figure, [row]);
}

/// A chart of a figure over GPU and CPU, as printed and as ours, and its row: both designs of the
/// thesis.
fn over_both(
    id: (&'static str, &'static str),
    [what, title, caption]: [&str; 3],
    recorded: fn(&Design) -> [f64; 2],
    ours: Formula,
) -> (Chart, Row) {
    let names = ["GPU, recorded", "GPU, modelled", "CPU, recorded", "CPU, modelled"];
    let (mut groups, mut values) = (Vec::new(), Vec::new());
    let [mut printed, mut modelled] = [Vec::new(), Vec::new()];
    for profile in PROFILES {
        let variant = profile.default_variant();
        let time = StepTime::new(&variant, Records::Packed, &thesis::step(), Bandwidth::Unlimited);
        let [gpu, cpu] = [&GPU, &CPU].map(|platform| ours(time.seconds * 1e3, platform));
        let of_thesis = Design::of(profile).map(recorded);
        let [of_gpu, of_cpu] = [0, 1].map(|of| of_thesis.map(|both| both[of]));
        groups.push(profile.name.to_owned());
        values.push(vec![of_gpu, Some(gpu), of_cpu, Some(cpu)]);
        if let Some([of_gpu, of_cpu]) = of_thesis {
            printed.push(format!("{} {of_gpu:.2} and {of_cpu:.2}", profile.name));
            modelled.push(format!("{} {gpu:.2} and {cpu:.2}", profile.name));
        }
    }
    let svg = bars("times", &groups, &names.map(str::to_owned), &values);
    let figure = Chart::new(id, title, svg, caption).modelled();
    let subject = format!("{what} over GPU and CPU");
    let row = figure.row(subject, printed.join(", "), modelled.join(", "));
    (figure, row)
}

#[cfg(test)]
mod tests {
    use pgs_interface::profile::{FLOAT, HALF};

    use super::*;

    #[test]
    fn the_models_figures_are_near_the_recorded_ones() {
        for design in [Design::of(&FLOAT), Design::of(&HALF)] {
            let design = design.expect("a design of the thesis");
            let variant = design.profile.default_variant();
            let time =
                StepTime::new(&variant, Records::Packed, &thesis::step(), Bandwidth::Unlimited);
            for (platform, printed) in [(&GPU, design.speedup[0]), (&CPU, design.speedup[1])] {
                let ours = speedup(time.seconds * 1e3, platform);
                assert!((ours / printed - 1.0).abs() < 0.02, "{printed} and {ours}");
            }
        }
    }
}
