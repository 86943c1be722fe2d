//! Shows the designs that stream the collisions once: cycles, bytes, memory, logic.

use crate::estimate::{MemoryUse, Records, StepCycles, StepTime, StepTraffic, Window};
use bitstream_model::Bandwidth;
use pgs_interface::profile::{FLOAT, Variant};

use super::scene::{Scene, mib, whole};
use crate::table::{Cell, Kind, Table, text};

/// The tables, if one of these designs is among the profiles.
pub(super) fn tables(scene: &Scene) -> Vec<Table> {
    let mut scene = scene.clone();
    scene.variants.retain(|variant| Window::of(variant.profile).is_some());
    if scene.variants.is_empty() {
        return Vec::new();
    }
    vec![cycles(&scene), gains(&scene), logic(&scene)]
}

fn cycles(scene: &Scene) -> Table {
    let title =
        "Collisions streamed once: cycles of a step whose order needs all of the delay lines";
    let mut table = scene.table("window_cycles", title, Kind::Modelled, |variant| {
        let (profile, step) = (variant.profile, &scene.step);
        Window::of(profile).map(|design| {
            let cycles = StepCycles::new(variant, Records::Streamed, step);
            let traffic = StepTraffic::new(variant, Records::Streamed, step);
            let behind = design.behind(profile, step);
            let integration = traffic.poses.cycles.max(traffic.results.cycles);
            [
                ("contact_units", "contact units", whole(design.units)),
                ("friction_units", "friction", whole(design.units)),
                ("slot", "slot", whole(design.slot(profile, step))),
                ("stream", "first pass", whole(cycles.pass)),
                ("behind", "last behind it", whole(behind)),
                ("fill", "fill", whole(cycles.fill - behind)),
                ("passes", "solver", whole(cycles.pass + cycles.fill)),
                ("load", "load beside it", whole(traffic.velocities.cycles)),
                ("integration", "integration", whole(integration)),
                ("integration_fill", "its fill", whole(cycles.integration_fill)),
            ]
        })
    });
    for variant in &scene.variants {
        let (profile, step) = (variant.profile, &scene.step);
        let Some(design) = Window::of(profile) else { continue };
        let fill =
            StepCycles::new(variant, Records::Streamed, step).fill - design.behind(profile, step);
        table.note(format!(
            "{}: (C + {} x {lag}) x {} + {fill}. An order with a longest span of s entries needs a \
             lag of s + ceil(window / slot) + 1 instead of {lag}.",
            profile.name,
            step.passes().saturating_sub(1),
            design.slot(profile, step),
            lag = design.lag,
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

fn gains(scene: &Scene) -> Table {
    let title = "Collisions streamed once, against float, records as streamed";
    let mut table = scene.table("window_gains", title, Kind::Modelled, |variant| {
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
        [[
            ("bytes", "bytes a step", whole(bytes(variant))),
            ("float_bytes", "float's", whole(bytes(&float))),
            ("bytes_ratio", "a fraction of", text(format!("1/{ratio:.2}"))),
            ("ms_unlimited", "ms", ms(variant, Bandwidth::Unlimited)),
            ("ms_sustained", "ms at 12.8 GB/s", ms(variant, Bandwidth::ZCU102_SUSTAINED)),
            ("float_ms_sustained", "float's", ms(&float, Bandwidth::ZCU102_SUSTAINED)),
            ("mib", "MiB on chip", on_chip(variant)),
            ("float_mib", "float's", on_chip(&float)),
        ]]
    });
    table.note(
        "Memory on chip does not depend on the scene: delay lines and places have a fixed size.",
    );
    table
}

fn logic(scene: &Scene) -> Table {
    let title =
        "Collisions streamed once: logic, percent of the XCZU9EG, extrapolated from the thesis";
    let mut table = scene.table("window_logic", title, Kind::Modelled, |variant| {
        Window::of(variant.profile).map(|design| {
            let (from, logic) = design.logic(variant);
            let [dsp, flip_flops, lookup_tables] = logic.map(|percent| Cell::Share(percent.into()));
            [
                ("from", "from", text(format!("{} {}", from.profile.name, from.results))),
                ("units", "units of a kind", whole(design.units)),
                ("dsp", "DSP", dsp),
                ("flip_flops", "flip-flops", flip_flops),
                ("lookup_tables", "lookup tables", lookup_tables),
                ("fits", "fits", text("not counted")),
            ]
        })
    });
    for variant in &scene.variants {
        let Some(design) = Window::of(variant.profile) else { continue };
        let (_, [.., lookup_tables]) = design.logic(variant);
        table.note(format!(
            "{}: {} % of the lookup tables are left for places, scoreboard, delay lines and DMAs, \
             which this table does not count.",
            variant.profile.name,
            100 - lookup_tables
        ));
    }
    table.note(
        "An extrapolation: the thesis' design in the same arithmetic has one unit of each kind, \
         and its logic is multiplied by the number of units. Whether a design fits is said of \
         Verilog whose cells were counted, and these designs have none.",
    );
    table
}
