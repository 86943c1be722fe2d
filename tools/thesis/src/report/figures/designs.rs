//! Figures 6.1 and 6.2: speed-up and energy efficiency of each design over the thesis' GPU and CPU.

use crate::estimate::thesis::recorded::{CPU, Design, GPU, Platform};
use crate::estimate::{DESIGNS, thesis};
use crate::estimate::{Records, StepTime};
use bitstream_model::Bandwidth;

use crate::experiment::Part;
use crate::figure::Figure;
use crate::figure::bars;
use crate::formulas::comparison::Outcome;
use crate::index::{Origin, Row};
use pgs_command::failure::Failure;

/// A design's figure over a machine: the thesis', if it has one, and ours.
type Beside = (Option<f64>, f64);

/// The speed-up of a profile over a machine.
fn beside(
    platform: &Platform,
    recorded: impl Fn(&Design) -> f64,
    ours: fn(&Outcome, &Platform) -> f64,
) -> Vec<(String, Beside)> {
    let shape = thesis::step();
    DESIGNS
        .iter()
        .map(|profile| {
            let variant = profile.default_variant();
            let time = StepTime::new(&variant, Records::Packed, &shape, Bandwidth::Unlimited);
            let printed = Design::of(profile).map(&recorded);
            let outcome = Outcome { ms: time.seconds * 1e3 };
            (profile.name.to_owned(), (printed, ours(&outcome, platform)))
        })
        .collect()
}

fn figure(
    id: &'static str,
    thesis: &'static str,
    title: &str,
    over: [&[(String, Beside)]; 2],
    caption: &str,
) -> Result<Figure, Failure> {
    let groups: Vec<String> = over[0].iter().map(|(name, _)| name.clone()).collect();
    let names = ["GPU, recorded", "GPU, modelled", "CPU, recorded", "CPU, modelled"];
    let values = over[0]
        .iter()
        .zip(over[1])
        .map(|((_, gpu), (_, cpu))| vec![gpu.0, Some(gpu.1), cpu.0, Some(cpu.1)]);
    let values: Vec<_> = values.collect();
    Ok(Figure {
        id,
        thesis,
        title: title.to_owned(),
        svg: bars("times", &groups, &names.map(str::to_owned), &values),
        caption: caption.to_owned(),
        origin: Origin::Modelled,
        playback: None,
    })
}

/// The row of a figure: both designs of the thesis.
fn row(figure: &Figure, over: &[Vec<(String, Beside)>; 2], what: &str) -> Row {
    let [gpu, cpu] = over;
    let designs = || gpu.iter().zip(cpu).filter(|((_, (printed, _)), _)| printed.is_some());
    let printed =
        |beside: &Beside| beside.0.map_or_else(String::new, |times| format!("{times:.2}"));
    let recorded = designs()
        .map(|((name, gpu), (_, cpu))| format!("{name} {} and {}", printed(gpu), printed(cpu)));
    let ours =
        designs().map(|((name, gpu), (_, cpu))| format!("{name} {:.2} and {:.2}", gpu.1, cpu.1));
    Row {
        thesis: figure.thesis.to_owned(),
        subject: format!("{what} over GPU and CPU"),
        recorded: recorded.collect::<Vec<_>>().join(", "),
        ours: ours.collect::<Vec<_>>().join(", "),
        origin: Origin::Modelled,
        command: "pgs thesis comparison".to_owned(),
        shown: figure.id.to_owned(),
    }
}

pub(crate) fn part() -> Result<Part, Failure> {
    let speed = [
        beside(&GPU, |design| design.speedup.gpu, Outcome::speedup),
        beside(&CPU, |design| design.speedup.cpu, Outcome::speedup),
    ];
    let energy = [
        beside(&GPU, |design| design.energy.gpu, Outcome::energy),
        beside(&CPU, |design| design.energy.cpu, Outcome::energy),
    ];
    let figures = vec![
        figure(
            "figure-6-1",
            "§6.5, Figure 6.1",
            "Speed-up of each design over GPU and CPU",
            [&speed[0], &speed[1]],
            "Times of GTX 980 and i7-3770 are the thesis' records; the accelerator's are our model's, on \
             the thesis' step. The thesis' figure has bars of its first design, and its text prints no numbers \
             of it. Our naive converts contacts within the passes, the thesis in a kernel of its own whose \
             rows go through memory: ours is a lower bound of its first design. mixed, windowed and \
             windowed16 are this project's own, and no boards: no hardware has them, and no processor \
             of this class can order collisions for the last two.",
        )?,
        figure(
            "figure-6-2",
            "§6.5, Figure 6.2",
            "Energy efficiency of each design over GPU and CPU",
            [&energy[0], &energy[1]],
            "Powers are the thesis': 288 W, 133 W, and 15 W for the board, its maximum and not measured. \
             The table of the comparison has the thermal design powers of its Tables 6.2 and 6.3 beside them.",
        )?,
    ];
    let rows = [(&figures[0], &speed, "speed-up"), (&figures[1], &energy, "energy efficiency")]
        .map(|(figure, over, what)| row(figure, over, what));
    Ok(Part { rows: rows.to_vec(), figures, ..Part::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_models_figures_are_near_the_recorded_ones() {
        for (platform, of) in [(&GPU, 0), (&CPU, 1)] {
            let recorded = move |design: &Design| [design.speedup.gpu, design.speedup.cpu][of];
            for (name, (printed, ours)) in beside(platform, recorded, Outcome::speedup) {
                let near = printed.is_none_or(|printed| (ours / printed - 1.0).abs() < 0.02);
                assert!(near, "{name}: {printed:?} and {ours}");
            }
        }
    }
}
