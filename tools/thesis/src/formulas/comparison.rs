//! Compares with GPU and CPU: Tables 6.5 to 6.7 and 6.9 to 6.11, equation 6.5.
//!
//! Times and powers of other machines are the thesis'; only the accelerator's time is ours, and it
//! is modelled.

use crate::estimate::thesis::amdahl;
use crate::estimate::thesis::recorded::{
    ACCELERATED_SHARE, CPU, Design, GPU, Platform, ZCU102_WATTS,
};
use crate::estimate::{DESIGNS as ALL, Records, StepTime, thesis};
use crate::experiment::Part;
use crate::figure::{Figure as Chart, bars};
use crate::index::Row;
use bitstream_model::Bandwidth;
use pgs_interface::profile::Variant;

use super::scene::{Scene, difference};
use crate::table::{Cell, Kind, Table, text};

pub(super) fn tables(scene: &Scene) -> Vec<Table> {
    vec![platforms(), against(scene)]
}

fn platforms() -> Table {
    let mut table = Table::with_columns(
        "platforms",
        "The thesis' records of GPU, CPU and board (T6.5, T6.9)",
        &[
            ("platform", "platform"),
            ("ms", "ms"),
            ("watts", "W"),
            ("joules", "J"),
            ("recomputed_joules", "J from ms and W"),
            ("difference_percent", "difference"),
            ("kind", "kind"),
        ],
    );
    for platform in [GPU, CPU] {
        let joules = platform.watts * platform.latency_ms / 1e3;
        table.row([
            text(platform.name),
            Cell::Number(platform.latency_ms, 2),
            Cell::Number(platform.watts, 0),
            Cell::Number(platform.joules, 2),
            Cell::Number(joules, 3),
            difference(joules, platform.joules),
            Kind::Recorded.cell(),
        ]);
    }
    table.row([
        text("ZCU102"),
        Cell::Missing,
        Cell::Number(ZCU102_WATTS, 0),
        Cell::Missing,
        Cell::Missing,
        Cell::Missing,
        Kind::Recorded.cell(),
    ]);
    table.note(format!(
        "T6.2 and T6.3 give thermal design powers of {} and {} W for the same GPU and CPU; the 15 \
         W of the board are its maximum, not measured.",
        GPU.design_watts, CPU.design_watts
    ));
    table
}

/// The figures that follow from one latency.
struct Outcome {
    ms: f64,
}

impl Outcome {
    fn joules(&self) -> f64 {
        ZCU102_WATTS * self.ms / 1e3
    }
    fn speedup(&self, platform: &Platform) -> f64 {
        platform.latency_ms / self.ms
    }
    /// Computes with both energies unrounded, not with the printed ones.
    fn energy(&self, platform: &Platform) -> f64 {
        self.energy_at(platform.watts, platform)
    }
    /// The same with another power of the platform, W.
    fn energy_at(&self, watts: f64, platform: &Platform) -> f64 {
        watts * platform.latency_ms / 1e3 / self.joules()
    }
    fn whole_step(&self) -> f64 {
        amdahl(ACCELERATED_SHARE, self.speedup(&GPU))
    }
}

use Source::{Latency, Powers};

/// A figure of the thesis' comparison.
struct Figure {
    /// The thesis' table.
    table: fn(&Design) -> &'static str,
    name: String,
    /// The printed figure, if there is one.
    printed: fn(&Design) -> Option<f64>,
    /// How to compute the figure: from a latency, or from the thesis' powers alone.
    of: Source,
}

enum Source {
    Latency(fn(&Outcome) -> f64),
    Powers(f64),
}

/// The figures in the order of the thesis' tables of latency, speed-up and efficiency.
fn all_figures() -> Vec<Figure> {
    type Table = fn(&Design) -> &'static str;
    type Printed = fn(&Design) -> Option<f64>;
    let mut all = Vec::new();
    let mut add = |table: Table, name: &str, printed: Printed, of| {
        all.push(Figure { table, name: name.to_owned(), printed, of });
    };
    let latency: Table = |design| design.comparison;
    add(latency, "latency, ms", |it| Some(it.latency_ms), Latency(|it| it.ms));
    add(latency, "energy at 15 W, J", |it| Some(it.joules), Latency(Outcome::joules));
    let speedups: Table = |design| design.speedups;
    let [gpu, cpu] = [GPU, CPU].map(|platform| format!("speed-up over {}", platform.name));
    add(speedups, &gpu, |it| Some(it.speedup.gpu), Latency(|it| it.speedup(&GPU)));
    add(speedups, &cpu, |it| Some(it.speedup.cpu), Latency(|it| it.speedup(&CPU)));
    let efficiencies: Table = |design| design.efficiencies;
    let power: [Printed; 2] = [|it| Some(it.power.gpu), |it| Some(it.power.cpu)];
    for (platform, printed) in [GPU, CPU].into_iter().zip(power) {
        let name = format!("power efficiency over {}", platform.name);
        add(efficiencies, &name, printed, Powers(platform.watts / ZCU102_WATTS));
    }
    let [gpu, cpu] = [GPU, CPU].map(|platform| format!("energy efficiency over {}", platform.name));
    add(efficiencies, &gpu, |it| Some(it.energy.gpu), Latency(|it| it.energy(&GPU)));
    add(efficiencies, &cpu, |it| Some(it.energy.cpu), Latency(|it| it.energy(&CPU)));
    for platform in [GPU, CPU] {
        let name = format!("power efficiency, {} TDP", platform.name);
        add(efficiencies, &name, |_| None, Powers(platform.design_watts / ZCU102_WATTS));
    }
    let [gpu, cpu] = [GPU, CPU].map(|platform| format!("energy efficiency, {} TDP", platform.name));
    let of_gpu = Latency(|it| it.energy_at(GPU.design_watts, &GPU));
    let of_cpu = Latency(|it| it.energy_at(CPU.design_watts, &CPU));
    add(efficiencies, &gpu, |_| None, of_gpu);
    add(efficiencies, &cpu, |_| None, of_cpu);
    let whole: Printed = |it| Some(it.whole_step);
    add(|_| "eq 6.5", "whole step over GTX 980's", whole, Latency(Outcome::whole_step));
    all
}

fn against(scene: &Scene) -> Table {
    let mut table = Table::with_columns(
        "comparison",
        "Against the thesis' GPU and CPU (T6.5 to T6.7, T6.9 to T6.11, equation 6.5)",
        &[
            ("profile", "profile"),
            ("table", "table"),
            ("figure", "figure"),
            ("thesis", "thesis"),
            ("recomputed", "recomputed"),
            ("packed_unlimited", "ours"),
            ("difference_percent", "diff."),
            ("streamed_unlimited", "streamed"),
            ("streamed_peak", "17.07 GB/s"),
            ("streamed_sustained", "12.8 GB/s"),
            ("kind", "kind"),
        ],
    );
    for variant in &scene.variants {
        for figure in &all_figures() {
            add(&mut table, scene, variant, figure);
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

fn add(table: &mut Table, scene: &Scene, variant: &Variant, figure: &Figure) {
    let design = Design::of(variant.profile);
    let number = |value| Cell::Number(value, 2);
    let printed = design.and_then(figure.printed);
    let (recomputed, ours, kind) = match figure.of {
        Source::Powers(found) => {
            // Every figure of the row is the thesis'.
            if design.is_none() {
                return;
            }
            (Some(found), None, Kind::Recorded)
        }
        Source::Latency(of) => {
            let ms = |design: &Design| design.cycles as f64 / f64::from(design.profile.clock_khz);
            let recomputed = design.map(|design| of(&Outcome { ms: ms(design) }));
            let ours = |records, bandwidth| {
                let time = StepTime::new(variant, records, &scene.step, bandwidth);
                of(&Outcome { ms: time.seconds * 1e3 })
            };
            let all = [
                ours(Records::Packed, Bandwidth::Unlimited),
                ours(Records::Streamed, Bandwidth::Unlimited),
                ours(Records::Streamed, Bandwidth::ZCU102_PEAK),
                ours(Records::Streamed, Bandwidth::ZCU102_SUSTAINED),
            ];
            (recomputed, Some(all), Kind::Modelled)
        }
    };
    let off = match (printed, ours, recomputed) {
        (Some(printed), Some([packed, ..]), _) => scene.difference(packed, printed),
        (Some(printed), None, Some(recomputed)) => difference(recomputed, printed),
        _ => Cell::Missing,
    };
    let [packed, unlimited, peak, sustained] =
        ours.map_or([const { Cell::Missing }; 4], |ours| ours.map(number));
    table.row([
        text(variant.profile.name),
        text(design.map_or("-", figure.table)),
        text(&figure.name),
        Cell::known(printed, number),
        Cell::known(recomputed, number),
        packed,
        off,
        unlimited,
        peak,
        sustained,
        kind.cell(),
    ]);
}

/// Figures 6.1 and 6.2: speed-up and energy efficiency of each design over the thesis' GPU and CPU.
pub(super) fn figures(part: &mut Part) {
    let caption = "Times of GTX 980 and i7-3770 are the thesis' records; the accelerator's are our \
        model's, on the thesis' step. The thesis' figure has bars of its first design, and its \
        text prints no numbers of it. Our naive converts contacts within the passes, the thesis in \
        a kernel of its own whose rows go through memory: ours is a lower bound of its first \
        design. mixed, windowed and windowed16 are this project's own, and no boards: no hardware \
        has them, and no processor of this class can order collisions for the last two.";
    let (figure, row) = over_both(
        ("figure-6-1", "§6.5, Figure 6.1"),
        ["speed-up", "Speed-up of each design over GPU and CPU", caption],
        |design| [design.speedup.gpu, design.speedup.cpu],
        Outcome::speedup,
    );
    part.figure(figure, [row]);
    let caption = "Powers are the thesis': 288 W, 133 W, and 15 W for the board, its maximum and \
        not measured. The table of the comparison has the thermal design powers of its Tables 6.2 \
        and 6.3 beside them.";
    let (figure, row) = over_both(
        ("figure-6-2", "§6.5, Figure 6.2"),
        ["energy efficiency", "Energy efficiency of each design over GPU and CPU", caption],
        |design| [design.energy.gpu, design.energy.cpu],
        Outcome::energy,
    );
    part.figure(figure, [row]);
}

/// A chart of a figure over GPU and CPU, as printed and as ours, and its row: both designs of the
/// thesis.
fn over_both(
    id: (&'static str, &'static str),
    [what, title, caption]: [&str; 3],
    recorded: fn(&Design) -> [f64; 2],
    ours: fn(&Outcome, &Platform) -> f64,
) -> (Chart, Row) {
    let names = ["GPU, recorded", "GPU, modelled", "CPU, recorded", "CPU, modelled"];
    let (mut groups, mut values) = (Vec::new(), Vec::new());
    let [mut printed, mut modelled] = [Vec::new(), Vec::new()];
    for profile in ALL {
        let variant = profile.default_variant();
        let time = StepTime::new(&variant, Records::Packed, &thesis::step(), Bandwidth::Unlimited);
        let outcome = Outcome { ms: time.seconds * 1e3 };
        let [gpu, cpu] = [&GPU, &CPU].map(|platform| ours(&outcome, platform));
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
            let outcome = Outcome { ms: time.seconds * 1e3 };
            for (platform, printed) in [(&GPU, design.speedup.gpu), (&CPU, design.speedup.cpu)] {
                let ours = outcome.speedup(platform);
                assert!((ours / printed - 1.0).abs() < 0.02, "{printed} and {ours}");
            }
        }
    }
}
