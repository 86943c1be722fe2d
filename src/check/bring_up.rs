//! Tests everything that must hold before streaming, and returns an open accelerator.

use std::sync::Arc;

use pgs_interface::axi_dma::{LENGTH_WIDTH_MAX, LENGTH_WIDTH_MIN};
use pgs_interface::control::{IDENTIFICATION_VALUE, VERSION, VERSION_MAJOR, version};
use pgs_interface::number::StreamFormat;
use pgs_interface::profile::{Inertia, Variant};

use super::report::{Line, Lines, Outcome};
use crate::axi_dma::{DmaError, STATE_CHANGE};
use crate::board::{
    Core, Device, Found, check_given_width, check_memory, connect, drain_interrupt,
};
use crate::control_block::{Capabilities, Control, ControlError, IdentityError, identify};
use crate::error::OpenError;
use crate::platform::{AccessCounts, RegisterMap, Window};
use crate::step::Accelerator;

const SAME_DRIVER: &str = "use the driver that belongs to the bitstream";
const CLOCK: &str = "load the bitstream, and check that the clock of the PL runs";

/// Runs the stages of opening, one line each. `None` if the other lines make no sense.
///
/// The error is a board that cannot be reached at all.
pub(super) fn bring_up(
    found: Found,
    length_width: Option<u32>,
    lines: &mut Lines,
) -> Result<Option<Accelerator>, OpenError> {
    let Found { platform, description } = found;
    check_given_width(length_width)?;
    let counts = Arc::<AccessCounts>::default();
    let window = Window::open(&*platform, RegisterMap::Control, &counts)?;
    let Some(mut capabilities) = identity(&window, lines) else { return Ok(None) };

    if let Err(error) = check_memory(&*platform, &capabilities) {
        let next = "reserve the memory of the fence in the device tree, or build the bitstream for \
                    this memory (rtlgen generate --memory)";
        lines.stop(Line::Fence, Outcome::failed(chain(&error), "memory inside the fence", next));
        return Ok(None);
    }
    let mut cores = match connect(&*platform, &capabilities, &counts) {
        Ok(cores) => cores,
        Err(error) => {
            let expected = format!("a region for each of {} cores", capabilities.mm2s_channels);
            let next = "load the overlay that belongs to the bitstream";
            lines.stop(Line::Regions, Outcome::failed(chain(&error), expected, next));
            return Ok(None);
        }
    };
    lines.ok(Line::Regions, format!("the control block and {} DMA cores", cores.len()));

    let mut control = Control::new(window);
    // Each core is tested: several failures together point to their common reset.
    let mut failed: Vec<String> = cores
        .iter_mut()
        .filter_map(|core| core.reset(&*platform).err())
        .map(|error| match &error {
            DmaError::State { channel, found, .. } => format!("{channel} in reset ({found})"),
            error => chain(error),
        })
        .collect();
    failed.extend(control.reset(&*platform).err().map(|error| match &error {
        ControlError::Reset { found, .. } => {
            format!("the accelerator in reset (RESET {found:#x})")
        }
        error => chain(error),
    }));
    if !failed.is_empty() {
        let outcome = Outcome::failed(
            failed.join("; "),
            format!("every part out of reset within {STATE_CHANGE:?}"),
            "check whether the part's reset input is released, its clock runs, and its memory port \
             answers: an outstanding transfer holds a reset up",
        );
        lines.stop(Line::Reset, outcome);
        return Ok(None);
    }
    lines.ok(
        Line::Reset,
        format!("{} DMA cores and the accelerator, within {STATE_CHANGE:?}", cores.len()),
    );

    if let Some(error) = cores.iter().find_map(|core| core.check_mode().err()) {
        let next = match error {
            DmaError::Gone { .. } => CLOCK,
            _ => "build the bitstream's AXI DMA cores with their scatter-gather engine",
        };
        lines.stop(Line::Mode, Outcome::failed(chain(&error), "scatter-gather", next));
        return Ok(None);
    }
    lines.ok(Line::Mode, format!("scatter-gather on {} channels", 2 * cores.len()));

    let Some(width) = length(&mut cores, &capabilities, length_width, lines) else {
        return Ok(None);
    };
    capabilities.length_width = width;
    drain_interrupt(&*platform)?;
    let device = Device::assemble(platform, control, capabilities, counts, cores);
    Ok(Some(Accelerator::assemble(description, device)))
}

/// Tests identification, interface version and capabilities.
fn identity(window: &Window, lines: &mut Lines) -> Option<Capabilities> {
    let identified = identify(window);
    let refused = identified.as_ref().err().map(refused);
    let stop = refused.as_ref().map(|(line, _)| *line);
    if stop != Some(Line::Identification) {
        lines.ok(Line::Identification, format!("{IDENTIFICATION_VALUE:#010x} (\"PGS1\")"));
        if stop != Some(Line::Version) {
            let word = window.read32(VERSION.offset);
            let (major, minor) = (version::MAJOR.of(word), version::MINOR.of(word));
            lines.ok(Line::Version, format!("{major}.{minor}"));
        }
    }
    if let Some((line, outcome)) = refused {
        lines.stop(line, outcome);
        return None;
    }
    let capabilities = identified.ok()?;
    if let Some((found, expected)) = contradiction(&capabilities) {
        let next = "correct the capability registers of the bitstream";
        lines.stop(Line::Capabilities, Outcome::failed(found, expected, next));
        return None;
    }
    let queue = match capabilities.queue {
        0 => String::new(),
        depth => format!(", an issue queue of {depth} collisions"),
    };
    lines.ok(
        Line::Capabilities,
        format!(
            "profile {}, {} kHz, up to {} bodies and {} shapes{queue}",
            described(&capabilities.variant),
            capabilities.clock_khz,
            capabilities.body_capacity,
            match capabilities.variant.has_streamed_masses() {
                true => "any number of".to_owned(),
                false => capabilities.shape_capacity.to_string(),
            },
        ),
    );
    Some(capabilities)
}

/// Describes a profile: its streams, and their number formats unless they are f32 and isotropic.
fn described(variant: &Variant) -> String {
    let Variant { profile, numbers, inertia } = variant;
    let widths = |widths: &[u32]| match widths {
        [first, rest @ ..] if rest.iter().all(|width| width == first) => first.to_string(),
        mixed => mixed.iter().map(u32::to_string).collect::<Vec<_>>().join(", "),
    };
    let streams = [numbers.collisions, numbers.bodies, numbers.poses];
    let formats = if streams == [StreamFormat::F32; 3] {
        String::new()
    } else {
        let [collisions, velocities, poses] = streams.map(StreamFormat::name);
        format!(", collisions in {collisions}, velocities in {velocities} and poses in {poses}")
    };
    let inertia = match inertia {
        Inertia::Isotropic => "",
        Inertia::World => ", world inertia",
    };
    format!(
        "{}, {} + {} streams of {} bits{formats}{inertia}",
        profile.name,
        profile.mm2s_widths.len(),
        profile.s2mm_widths.len(),
        widths(profile.mm2s_widths),
    )
}

/// The line in which a refused bitstream fails, and its outcome.
fn refused(error: &IdentityError) -> (Line, Outcome) {
    let (line, found, expected, next) = match error {
        IdentityError::Gone => (
            Line::Identification,
            "all ones: nothing answers".to_owned(),
            format!("{IDENTIFICATION_VALUE:#010x}"),
            CLOCK,
        ),
        IdentityError::Identification { found } => (
            Line::Identification,
            format!("{found:#010x}"),
            format!("{IDENTIFICATION_VALUE:#010x} (\"PGS1\")"),
            "load the accelerator's bitstream, or correct the control block's address in the \
             device tree",
        ),
        IdentityError::Version { major, minor } => {
            (Line::Version, format!("{major}.{minor}"), format!("{VERSION_MAJOR}.x"), SAME_DRIVER)
        }
        IdentityError::Profile { found } => (
            Line::Capabilities,
            format!("profile {found}"),
            "a profile that this driver knows".to_owned(),
            SAME_DRIVER,
        ),
        IdentityError::Capability { register, found, expected } => (
            Line::Capabilities,
            format!("{register} {found:#010x}"),
            (*expected).to_owned(),
            SAME_DRIVER,
        ),
    };
    (line, Outcome::failed(found, expected, next))
}

/// Finds capabilities that contradict each other: the values found, and the values expected.
///
/// The capacity for bodies counts without regard to memory; the capacity for collisions is one of
/// the memory.
fn contradiction(capabilities: &Capabilities) -> Option<(String, String)> {
    let memory = u64::from(capabilities.memory_bytes);
    let records = [
        ("body", "bodies", capabilities.body_capacity, 1, capabilities.bytes_per_body),
        (
            "collision",
            "collisions",
            capabilities.collision_capacity,
            capabilities.collision_capacity,
            capabilities.bytes_per_collision,
        ),
    ];
    records.into_iter().find_map(|(one, what, capacity, least, bytes)| {
        if capacity == 0 {
            return Some((format!("room for no {what}"), format!("room for {what}")));
        }
        let needed = u64::from(least) * u64::from(bytes);
        (needed > memory).then(|| {
            let (what, take) = if least == 1 { (one, "takes") } else { (what, "take") };
            (
                format!("{least} {what} of {bytes} bytes, which {take} {needed} bytes"),
                format!("no more than the {memory} bytes of on-chip memory"),
            )
        })
    })
}

/// Tests the width of the length registers; the lines that follow use the width that was found.
fn length(
    cores: &mut [Core],
    capabilities: &Capabilities,
    given: Option<u32>,
    lines: &mut Lines,
) -> Option<u32> {
    let expected = given.unwrap_or(capabilities.length_width);
    let source = if given.is_some() { "as given" } else { "as the bitstream says" };
    let mut widths = Vec::new();
    for core in cores.iter_mut() {
        match core.length_widths() {
            Ok(of_core) => widths.extend(of_core),
            Err(error) => {
                let next = "check that the region belongs to an AXI DMA";
                let outcome = Outcome::failed(chain(&error), format!("{expected} bits"), next);
                lines.stop(Line::Length, outcome);
                return None;
            }
        }
    }
    let narrowest = widths.iter().map(|(_, width)| *width).min()?;
    let wrong: Vec<_> = widths.iter().filter(|(_, width)| *width != expected).collect();
    let channels = widths.len();
    if wrong.is_empty() {
        let narrow = match expected {
            LENGTH_WIDTH_MAX => "",
            _ => "; a width of 26 would take fewer descriptors",
        };
        let detail = format!("{expected} bits on {channels} channels, {source}{narrow}");
        lines.ok(Line::Length, detail);
        return Some(narrowest);
    }
    let found = if wrong.len() == channels && wrong.iter().all(|(_, width)| *width == narrowest) {
        format!("{narrowest} bits on all {channels} channels")
    } else {
        let of_channels: Vec<_> =
            wrong.iter().map(|(name, width)| format!("{name} {width} bits")).collect();
        of_channels.join(", ")
    };
    if !(LENGTH_WIDTH_MIN..=LENGTH_WIDTH_MAX).contains(&narrowest) {
        // Nothing can be transferred with this width, and the other lines would tell nothing.
        let next = format!(
            "an AXI DMA has {LENGTH_WIDTH_MIN} to {LENGTH_WIDTH_MAX} bits: check whether the \
             region is that of one"
        );
        let expected = format!("{expected} bits, {source}");
        lines.stop(Line::Length, Outcome::failed(found, expected, next));
        return None;
    }
    let next = format!(
        "build the AXI DMA cores with a length register of {LENGTH_WIDTH_MAX} bits (they have 14 \
         unless told otherwise) and say so in the bitstream's DMA register; until then, open the \
         board with a length width of {narrowest}"
    );
    lines.set(Line::Length, Outcome::failed(found, format!("{expected} bits, {source}"), next));
    Some(narrowest)
}

/// The text of an error with its causes.
pub(super) fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(error) = source {
        text = format!("{text}: {error}");
        source = error.source();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control_block::fake;
    use crate::platform::fake::FakeRegisters;
    use pgs_interface::profile::{FLOAT, HALF};

    #[test]
    fn capabilities_that_contradict_each_other_are_named() {
        let registers = FakeRegisters::default();
        fake::describe(&registers);
        let good = identify(&registers.window(RegisterMap::Control)).expect("well formed");
        assert_eq!(contradiction(&good), None);
        // 4 MiB hold 262,144 collisions of 16 bytes.
        let cases = [
            (Capabilities { memory_bytes: 23, ..good }, "1 body of 24 bytes, which takes 24"),
            (Capabilities { collision_capacity: 262_145, ..good }, "262145 collisions"),
            (Capabilities { body_capacity: 0, ..good }, "room for no bodies"),
        ];
        for (capabilities, text) in cases {
            let (found, _) = contradiction(&capabilities).expect(text);
            assert!(found.contains(text), "{found}");
        }
        // Indices may reach beyond the memory.
        assert_eq!(contradiction(&Capabilities { body_capacity: 174_763, ..good }), None);
    }

    #[test]
    fn a_profile_is_described_by_what_it_streams() {
        assert_eq!(described(&FLOAT.default_variant()), "float, 4 + 4 streams of 128 bits");
        let world = Variant { inertia: Inertia::World, ..FLOAT.default_variant() };
        assert_eq!(described(&world), "float, 4 + 4 streams of 128 bits, world inertia");
        assert_eq!(
            described(&HALF.default_variant()),
            "half, 3 + 3 streams of 128, 128, 64 bits, collisions in binary16, velocities in \
             binary16 and poses in binary16"
        );
    }

    #[test]
    fn a_capability_register_that_makes_no_sense_fails_the_third_line_alone() {
        let registers = FakeRegisters::default();
        fake::describe(&registers);
        registers.with(|state| state.values.insert(0x110, 0x0503));
        let mut lines = Lines::default();
        assert!(identity(&registers.window(RegisterMap::Control), &mut lines).is_none());
        let lines = lines.finish();
        assert_eq!(lines[1].outcome, Outcome::ok("2.0"));
        assert!(matches!(
            &lines[2].outcome,
            Outcome::Failed { found, .. } if found == "CHANNELS 0x00000503"
        ));
        assert!(matches!(&lines[3].outcome, Outcome::Skipped { .. }));
    }
}
