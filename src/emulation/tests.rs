//! Texts of builds: reading, writing, refusing.

use std::fmt;

use bitstream_model::{Bandwidth, EmulatedBoard, Hazards};
use pgs_interface::fence::Fence;
use pgs_interface::number::Precision;
use pgs_interface::profile::{Inertia, PROFILES, Profile};
use proptest::prelude::*;

use super::{Build, BuildError};

fn build(text: &str) -> Result<Build, BuildError> {
    text.parse()
}

#[test]
fn a_build_is_written_as_it_is_read() {
    for text in [
        "naive",
        "float",
        "half",
        "float,interlocked",
        "half,f32,unchecked",
        "float,unchecked,world",
        "half,binary16,interlocked,window=64,isotropic",
        "float,queue=64",
        "float,interlocked,queue=0,window=9",
        "float,bandwidth=unlimited,length-width=14,address-width=32",
        "float,fence=0x40000000+512M",
        "float,bandwidth=17.07,threads=1,fast=off",
    ] {
        let build = build(text).expect(text);
        assert_eq!(build.to_string(), text);
        EmulatedBoard::new(build.config()).expect(text);
    }
}

#[test]
fn words_may_stand_in_any_order() {
    let expected = build("half,f32,unchecked,world");
    assert_eq!(build("half,world,unchecked,arithmetic=f32"), expected);
}

#[test]
fn a_word_means_what_the_option_means() {
    let text = "half,f32,unchecked,queue=0,window=9,world,bandwidth=unlimited,\
                length-width=14,address-width=32,fence=0x50000000+64M,threads=3,fast=off";
    let expected = Build {
        profile: Profile::by_name("half"),
        arithmetic: Some(Precision::F32),
        inertia: Some(Inertia::World),
        hazards: Some(Hazards::Unchecked),
        queue: Some(0),
        window: Some(9),
        bandwidth: Some(Bandwidth::Unlimited),
        length_width: Some(14),
        address_width: Some(32),
        fence: Some(Fence::default()),
        threads: Some(3),
        fast: Some(false),
    };
    assert_eq!(build(text), Ok(expected));
    for key in Build::keys() {
        let value = expected.value(key).expect(key);
        let mut alone = Build::default();
        alone.set(key, &value).expect(key);
        assert_eq!(alone.value(key), Some(value));
        assert_eq!(Build::keys().filter(|key| alone.value(key).is_some()).count(), 1);
    }
}

#[test]
fn a_text_that_is_no_build_is_refused_with_the_known_words() {
    for text in ["", ",float", "Float", "unchecked", "float half", "profile=half"] {
        let error = build(text).expect_err(text);
        assert!(matches!(error, BuildError::Profile { .. }), "{error}");
        assert!(error.to_string().contains("(naive, float, half)"), "{error}");
    }
    for text in
        ["float,", "float,double", "float,window", "float,colour=red", "float, world", "float,on"]
    {
        let error = build(text).expect_err(text);
        assert_eq!(
            error.to_string(),
            format!(
                "{:?} is no option of a build: give one of f32, binary16, \
                 interlocked, unchecked, queue=DEPTH, window=SLOTS, isotropic, world, bandwidth=GBPS|unlimited, length-width=BITS, \
                 address-width=BITS, fence=BASE+BYTES, threads=N, fast=on|off",
                text.split_once(',').expect("two words").1
            )
        );
    }
    for (text, key) in [("float,world,isotropic", "inertia"), ("float,half", "profile")] {
        let error = build(text).expect_err("twice");
        assert_eq!(error.to_string(), format!("{key} is given twice: give it once"));
    }
    for (text, expected) in [
        ("float,window=0", "window=0: expected a whole number from 1 to 4294967295"),
        ("float,window=", "window=: expected a whole number from 1 to 4294967295"),
        ("float,queue=257", "queue=257: expected a whole number from 0 to 256"),
        ("float,threads=0", "threads=0: expected a whole number from 1 to 31"),
        ("half,arithmetic=f64", "arithmetic=f64: expected f32 or binary16"),
    ] {
        assert_eq!(build(text).expect_err(text).to_string(), expected);
    }
    let unknown = Build::default().set("colour", "red").expect_err("no such option");
    assert!(matches!(unknown, BuildError::Word { .. }), "{unknown}");
    assert!(Build::names("colour").is_empty() && Build::default().value("colour").is_none());
}

fn any_of<T: Copy + fmt::Debug + 'static, const N: usize>(
    values: [T; N],
) -> impl Strategy<Value = Option<T>> {
    prop::option::of(prop::sample::select(values.to_vec()))
}

fn any_build() -> impl Strategy<Value = Build> {
    let rate = prop_oneof![
        Just(Bandwidth::Unlimited),
        (100_000_000_u64..=1_000_000_000_000).prop_map(Bandwidth::BytesPerSecond),
    ];
    let fences = ["0x10000+64K", "0x50000000+64M", "0x800000000+2G"];
    let fences = fences.map(|text| text.parse::<Fence>().expect(text));
    (
        prop::sample::select(PROFILES.to_vec()),
        any_of(Precision::ALL),
        (any_of([Inertia::Isotropic, Inertia::World]), any_of([true, false])),
        any_of([Hazards::Interlocked, Hazards::Unchecked]),
        (prop::option::of(1..=u32::MAX), prop::option::of(rate), prop::option::of(1_usize..=31)),
        prop::option::of(0_u32..=256),
        (prop::option::of(8_u32..=26), prop::option::of(32_u32..=64), any_of(fences)),
    )
        .prop_map(|(profile, arithmetic, choices, hazards, numbers, queue, widths)| Build {
            profile: Some(profile),
            arithmetic,
            inertia: choices.0,
            fast: choices.1,
            hazards,
            queue,
            window: numbers.0,
            bandwidth: numbers.1,
            threads: numbers.2,
            length_width: widths.0,
            address_width: widths.1,
            fence: widths.2,
        })
}

proptest! {
    #[test]
    fn every_build_survives_its_text(built in any_build()) {
        prop_assert_eq!(build(&built.to_string()), Ok(built));
    }

    #[test]
    fn a_board_is_what_its_text_says(built in any_build()) {
        let config = built.config();
        let again = Build::of(&config);
        prop_assert_eq!(again.config(), config);
        // A text holds no option that equals its default.
        prop_assert!(again.to_string().len() <= built.to_string().len());
    }

    #[test]
    fn no_text_makes_the_parser_panic(text in "(half|float|),?[a-z0-9=,.]{0,30}") {
        let _ = build(&text);
    }
}
