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
        &[
            ("profile", "profile"),
            ("contact_units", "contact units"),
            ("friction_units", "friction"),
            ("slot", "slot"),
            ("stream", "first pass"),
            ("behind", "last behind it"),
            ("fill", "fill"),
            ("passes", "solver"),
            ("load", "load beside it"),
            ("integration", "integration"),
            ("integration_fill", "its fill"),
            ("kind", "kind"),
        ],
    );
    for (variant, design) in designs {
        let step = WindowStep::longest(design, scene.step);
        let Some(cycles) = WindowCycles::new(variant, &step) else { continue };
        table.row([
            text(variant.profile.name),
            Cell::Whole(design.contact_units.into()),
            Cell::Whole(design.friction_units.into()),
            Cell::Whole(cycles.slot),
            Cell::Whole(cycles.stream),
            Cell::Whole(cycles.behind),
            Cell::Whole(cycles.fill),
            Cell::Whole(cycles.passes),
            Cell::Whole(cycles.load),
            Cell::Whole(cycles.integration),
            Cell::Whole(cycles.integration_fill),
            Kind::Modelled.cell(),
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
        "Slot: cycles in which every pass issues one entry. Load and integration run in parallel to the \
         passes; bodies without a collision follow, two cycles each, and the fill of the integration at the end. In the formula the passes take \
         turns. The emulated board has a scoreboard, which usually needs fewer cycles: a unit takes up \
         another pass when one has to wait.",
    );
    table
}

fn gains(scene: &Scene, designs: &[(&Variant, &Window)]) -> Table {
    let mut table = Table::new(
        "window_gains",
        "Collisions streamed once, against float, records as streamed",
        &[
            ("profile", "profile"),
            ("bytes", "bytes a step"),
            ("float_bytes", "float's"),
            ("bytes_ratio", "a fraction of"),
            ("ms_unlimited", "ms"),
            ("ms_sustained", "ms at 12.8 GB/s"),
            ("float_ms_sustained", "float's"),
            ("mib", "MiB on chip"),
            ("float_mib", "float's"),
            ("kind", "kind"),
        ],
    );
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
            text(variant.profile.name),
            Cell::Whole(bytes(variant)),
            Cell::Whole(bytes(&float)),
            text(format!("1/{ratio:.2}")),
            ms(variant, Bandwidth::Unlimited),
            ms(variant, Bandwidth::ZCU102_SUSTAINED),
            ms(&float, Bandwidth::ZCU102_SUSTAINED),
            on_chip(variant),
            on_chip(&float),
            Kind::Modelled.cell(),
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
        &[
            ("profile", "profile"),
            ("from", "from"),
            ("units", "units of a kind"),
            ("dsp", "DSP"),
            ("flip_flops", "flip-flops"),
            ("lookup_tables", "lookup tables"),
            ("fits", "fits"),
            ("kind", "kind"),
        ],
    );
    for (variant, _) in designs {
        let Some(logic) = WindowLogic::new(variant) else { continue };
        table.row([
            text(variant.profile.name),
            text(format!("{} {}", logic.from.profile.name, logic.from.results)),
            Cell::Whole(logic.units.into()),
            Cell::Share(logic.dsp.into()),
            Cell::Share(logic.flip_flops.into()),
            Cell::Share(logic.lookup_tables.into()),
            text(yes_or_no(logic.fits())),
            Kind::Modelled.cell(),
        ]);
        let left = 100_u32.saturating_sub(logic.lookup_tables);
        table.note(if logic.fits() {
            format!(
                "{}: {left} % of the lookup tables are left for places, scoreboard, delay lines and \
                 DMAs, which this table does not count. Only a synthesis can tell whether that is \
                 enough, and whether it closes timing.",
                variant.profile.name
            )
        } else {
            format!("{}: more than the device has. It does not fit.", variant.profile.name)
        });
    }
    table.note(
        "An extrapolation, without a synthesis: the thesis' design in the same arithmetic has one unit of \
         each kind, and its logic is multiplied by the number of units.",
    );
    table
}
