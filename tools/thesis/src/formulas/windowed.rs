//! Shows the designs that stream the collisions once: cycles, bytes, memory, logic.

use crate::estimate::{
    MemoryUse, Records, StepTime, StepTraffic, Window, WindowCycles, WindowLogic, WindowStep,
};
use bitstream_model::Bandwidth;
use pgs_interface::profile::{FLOAT, Variant};

use super::scene::{Scene, mib, yes_or_no};
use crate::table::{Cell, Kind, Table, text};

/// The tables, if one of these designs is among the profiles.
pub(super) fn tables(scene: &Scene) -> Vec<Table> {
    let designs: Vec<(&Variant, &Window)> = scene
        .variants
        .iter()
        .filter_map(|variant| Some((variant, Window::of(variant.profile)?)))
        .collect();
    if designs.is_empty() {
        return Vec::new();
    }
    vec![cycles(scene, &designs), gains(scene, &designs), logic(&designs)]
}

fn cycles(scene: &Scene, designs: &[(&Variant, &Window)]) -> Table {
    let mut table = Table::new(
        "window_cycles",
        "Collisions streamed once: cycles of a step whose order needs all of the delay lines",
    );
    for (variant, design) in designs {
        let step = WindowStep::longest(design, scene.step);
        let Some(cycles) = WindowCycles::new(variant, &step) else { continue };
        table.row([
            ("profile", "profile", text(variant.profile.name)),
            ("contact_units", "contact units", Cell::Whole(design.contact_units.into())),
            ("friction_units", "friction", Cell::Whole(design.friction_units.into())),
            ("slot", "slot", Cell::Whole(cycles.slot)),
            ("stream", "first pass", Cell::Whole(cycles.stream)),
            ("behind", "last behind it", Cell::Whole(cycles.behind)),
            ("fill", "fill", Cell::Whole(cycles.fill)),
            ("passes", "solver", Cell::Whole(cycles.passes)),
            ("load", "load beside it", Cell::Whole(cycles.load)),
            ("integration", "integration", Cell::Whole(cycles.integration)),
            ("integration_fill", "its fill", Cell::Whole(cycles.integration_fill)),
            ("kind", "kind", Kind::Modelled.cell()),
        ]);
        table.note(format!(
            "{}: (C + {} x {}) x {} + {}. An order with a longest span of s entries needs a lag of \
             s + ceil(window / slot) + 1 instead of {}.",
            variant.profile.name,
            scene.step.passes().saturating_sub(1),
            step.lag,
            cycles.slot,
            cycles.fill,
            step.lag,
        ));
    }
    table.note(
        "Slot: cycles in which every pass issues one entry. Load and integration run in parallel \
         to the passes; bodies without a collision follow, two cycles each, and the fill of the \
         integration at the end. In the formula the passes take turns. The emulated board has a \
         scoreboard, which usually needs fewer cycles: a unit takes up \
         another pass when one has to wait.",
    );
    table
}

fn gains(scene: &Scene, designs: &[(&Variant, &Window)]) -> Table {
    let mut table =
        Table::new("window_gains", "Collisions streamed once, against float, records as streamed");
    for (variant, _) in designs {
        let float = Variant { inertia: variant.inertia, ..FLOAT.default_variant() };
        let bytes = |v: &Variant| StepTraffic::new(v, Records::Streamed, &scene.step).bytes();
        let ms = |v: &Variant, bandwidth| {
            let time = StepTime::new(v, Records::Streamed, &scene.step, bandwidth);
            Cell::Number(time.seconds * 1e3, 3)
        };
        let on_chip = |v: &Variant| {
            let memory = MemoryUse::new(v, scene.step.bodies, scene.step.collisions);
            Cell::Number(mib(memory.block_ram()), 2)
        };
        let ratio = bytes(&float) as f64 / bytes(variant).max(1) as f64;
        table.row([
            ("profile", "profile", text(variant.profile.name)),
            ("bytes", "bytes a step", Cell::Whole(bytes(variant))),
            ("float_bytes", "float's", Cell::Whole(bytes(&float))),
            ("bytes_ratio", "a fraction of", text(format!("1/{ratio:.2}"))),
            ("ms_unlimited", "ms", ms(variant, Bandwidth::Unlimited)),
            ("ms_sustained", "ms at 12.8 GB/s", ms(variant, Bandwidth::ZCU102_SUSTAINED)),
            ("float_ms_sustained", "float's", ms(&float, Bandwidth::ZCU102_SUSTAINED)),
            ("mib", "MiB on chip", on_chip(variant)),
            ("float_mib", "float's", on_chip(&float)),
            ("kind", "kind", Kind::Modelled.cell()),
        ]);
    }
    table.note(
        "Memory on chip does not depend on the scene: delay lines and places have a fixed size.",
    );
    table
}

fn logic(designs: &[(&Variant, &Window)]) -> Table {
    let mut table = Table::new(
        "window_logic",
        "Collisions streamed once: logic, percent of the XCZU9EG, extrapolated from the thesis",
    );
    for (variant, _) in designs {
        let Some(logic) = WindowLogic::new(variant) else { continue };
        table.row([
            ("profile", "profile", text(variant.profile.name)),
            ("from", "from", text(format!("{} {}", logic.from.profile.name, logic.from.results))),
            ("units", "units of a kind", Cell::Whole(logic.units.into())),
            ("dsp", "DSP", Cell::Share(logic.dsp.into())),
            ("flip_flops", "flip-flops", Cell::Share(logic.flip_flops.into())),
            ("lookup_tables", "lookup tables", Cell::Share(logic.lookup_tables.into())),
            ("fits", "fits", text(yes_or_no(logic.fits()))),
            ("kind", "kind", Kind::Modelled.cell()),
        ]);
        let left = 100_u32.saturating_sub(logic.lookup_tables);
        table.note(if logic.fits() {
            format!(
                "{}: {left} % of the lookup tables are left for places, scoreboard, delay lines \
                 and DMAs, which this table does not count. Only a synthesis can tell whether that \
                 is enough, and whether it closes timing.",
                variant.profile.name
            )
        } else {
            format!("{}: more than the device has. It does not fit.", variant.profile.name)
        });
    }
    table.note(
        "An extrapolation, without a synthesis: the thesis' design in the same arithmetic has one \
         unit of each kind, and its logic is multiplied by the number of units.",
    );
    table
}
