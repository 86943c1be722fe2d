//! Plants mistakes with the memory that driver and device pass to each other.

use std::time::Duration;

use bitstream_model::BoardConfig;
use pgs_interface::record::Beat;

use super::kinds::{Mistake, Trouble};
use super::planted::Planted;
use super::{Bench, Verdict, assert_reported, chain_of, clean, found};
use crate::StepParameters;
use crate::board::bank::Bank;
use crate::check::Outcome;
use crate::check::check_found;
use crate::platform::{Access, CpuBuffer, DeviceBuffer, PlatformError};
use crate::step::tests::{bits, scene};

#[test]
fn mistake_13_caches_not_maintained() {
    for mistake in [Mistake::NotCleaned, Mistake::NotInvalidated] {
        // Never silent: either the sums of words differ, or the accelerator refuses old beats. The
        // sizes use the same buffers again, with other contents.
        assert_reported(mistake, "", |mistake| {
            clean(BoardConfig::default(), mistake, &[90, 20, 50])
        });
        // The self-test finds it before the first step.
        assert_reported(mistake, "coherency", |mistake| {
            let planted = Planted::new(BoardConfig::default(), mistake, None);
            planted.opened();
            let report = check_found(found(&planted), None).map_err(|error| error.to_string())?;
            let failed =
                |line: &&crate::check::CheckLine| matches!(line.outcome, Outcome::Failed { .. });
            match report.lines.iter().filter(failed).map(|line| line.name).collect::<Vec<_>>() {
                lines if lines.is_empty() => Ok(()),
                lines => Err(lines.join(", ")),
            }
        });
    }
}

/// Checks that a step fails whose received packets are a beat short.
fn short(mistake: Option<Mistake>, core: usize) -> Verdict {
    let trouble = Some(Trouble::ShortPacket(core));
    let mut bench = Bench::open(BoardConfig::default(), mistake, trouble)?;
    let (result, bodies) = bench.step_with(20, &StepParameters::default());
    let Err(error) = result else { return Err("taken as whole".to_owned()) };
    assert!(error.may_retry(), "{error}");
    let text = chain_of(&error);
    assert!(text.contains(&format!("dma{core} S2MM")), "{text}");
    assert_eq!(bits(&bodies), bits(&scene(20).0));
    bench.planted.end_trouble();
    bench.step(20)?;
    bench.close()
}

#[test]
fn mistake_14_received_length_ignored() {
    for core in 0..4 {
        assert_reported(Mistake::LengthIgnored, "taken as whole", |mistake| short(mistake, core));
    }
}

#[test]
fn mistake_17_buffer_used_again_after_a_time_out() {
    assert_reported(Mistake::NotReset, "the CPU owns the buffer", |mistake| {
        let mut bench = Bench::open(BoardConfig::default(), mistake, None)?;
        // The step has no time at all: the deadline passes while the engines work.
        let deadline = Some(Duration::from_nanos(1));
        let parameters = StepParameters { deadline, ..StepParameters::default() };
        let (result, bodies) = bench.step_with(900, &parameters);
        let error = result.expect_err("no time");
        assert_eq!(bits(&bodies), bits(&scene(900).0), "{error}");
        // The first size uses the same buffers; the second needs others, and the driver frees the
        // first.
        for cubes in [900, 3000] {
            bench.step(cubes)?;
        }
        bench.close()
    });
}

/// Whether a type implements a trait. The compiler prefers the type's own constant to the trait's.
macro_rules! implements {
    ($type:ty: $($bound:tt)+) => {{
        #[allow(dead_code, reason = "only the compiler reads it")]
        struct Probe<T: ?Sized>(std::marker::PhantomData<T>);
        #[allow(dead_code, reason = "where every type has the trait")]
        trait Otherwise {
            const HOLDS: bool = false;
        }
        impl<T: ?Sized> Otherwise for Probe<T> {}
        #[allow(dead_code, reason = "where no type has the trait")]
        impl<T: ?Sized + $($bound)+> Probe<T> {
            const HOLDS: bool = true;
        }
        Probe::<$type>::HOLDS
    }};
}

/// The types rule this mistake out: a platform has no way to make it.
#[test]
fn mistake_19_slices_of_a_buffer_that_the_device_writes() {
    // Handing over uses up the type that has slices, and the resulting type has none.
    let _: fn(CpuBuffer, usize, Access) -> Result<DeviceBuffer, PlatformError> =
        CpuBuffer::into_device;
    let _: fn(DeviceBuffer) -> Result<CpuBuffer, PlatformError> = DeviceBuffer::into_cpu;
    let ways = [
        implements!(DeviceBuffer: Clone),
        implements!(DeviceBuffer: AsRef<[Beat]>),
        implements!(DeviceBuffer: AsMut<[Beat]>),
        implements!(DeviceBuffer: std::ops::Deref),
    ];
    assert_eq!(ways, [false; 4], "copied or read through");
    // The same checks on a worse type.
    let ways = [
        implements!(Vec<Beat>: Clone),
        implements!(Vec<Beat>: AsRef<[Beat]>),
        implements!(Vec<Beat>: AsMut<[Beat]>),
        implements!(Vec<Beat>: std::ops::Deref),
    ];
    assert_eq!(ways, [true; 4]);
    // A port holds either type, and gives no beat away while the device has the buffers.
    let mut bench = Bench::open(BoardConfig::default(), None, None).expect("a board that opens");
    bench.step(20).expect("a step");
    let device = &mut bench.accelerator.device;
    const FIRST: Bank = Bank::First;
    let reachable = |device: &mut crate::board::Device| {
        device
            .ports_mut()
            .map(|port| port.beats(FIRST).len() + port.beats_mut(FIRST).len())
            .sum::<usize>()
    };
    assert!(reachable(device) > 0, "the CPU holds them between steps");
    for port in device.ports_mut() {
        port.hand_over(FIRST, 1).expect("handed over");
    }
    assert_eq!(reachable(device), 0);
    for port in device.ports_mut() {
        port.take_back(FIRST).expect("nothing runs");
    }
    assert!(reachable(device) > 0);
    bench.close().expect("nothing went wrong");
}
