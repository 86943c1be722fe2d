//! Texts of builds: reading, writing, refusing.

use bitstream_model::EmulatedBoard;
use bitstream_model::interface::number::{Precision, StreamFormat};
use clap::ValueEnum;
use proptest::prelude::*;

use super::*;
use crate::options::build::LanesName;

fn build(text: &str) -> Result<BuildArgs, BuildError> {
    text.parse()
}

#[test]
fn a_build_is_written_as_it_is_read() {
    for text in [
        "naive",
        "float",
        "half",
        "mixed",
        "float,interlocked",
        "half,thesis16,f32,unchecked",
        "half,f32,unchecked,world",
        "half,binary16,arithmetic=binary16,interlocked,window=64,flush,isotropic",
        "float,bandwidth=unlimited,length-width=14,address-width=32",
        "mixed,bandwidth=17.07",
    ] {
        let build = build(text).expect(text);
        assert_eq!(build.to_string(), text);
        EmulatedBoard::new(build.config()).expect(text);
    }
}

#[test]
fn formats_that_no_text_says_are_said_in_words() {
    let of = |name: &str, change: fn(&mut Numbers)| {
        let profile = Profile::by_name(name).expect(name);
        let mut numbers = profile.numbers;
        change(&mut numbers);
        described(&BoardConfig { profile, numbers: Some(numbers), ..BoardConfig::default() })
    };
    assert_eq!(
        of("half", |numbers| numbers.velocities = Precision::F32),
        "half (streams: collisions binary16, velocities binary16, poses binary16; arithmetic: rows binary16, updates \
         binary16; on chip: velocities f32, impulses binary16)"
    );
    assert_eq!(
        of("half", |numbers| numbers.updates = Precision::F32),
        "half,f32 (streams: collisions binary16, velocities binary16, poses binary16; arithmetic: rows binary16, \
         updates f32; on chip: velocities binary16, impulses binary16)"
    );
    assert_eq!(of("half", |numbers| numbers.bodies = StreamFormat::Thesis16).find('('), Some(14));
    for text in ["float", "mixed,flush,world", "half,thesis16,f32", "half,f32,world"] {
        assert_eq!(described(&build(text).expect(text).config()), text);
    }
}

#[test]
fn words_may_stand_in_any_order() {
    let expected = build("half,thesis16,f32,unchecked,flush");
    assert_eq!(build("half,flush,unchecked,arithmetic=f32,format=thesis16"), expected);
}

#[test]
fn a_word_means_what_the_option_means() {
    let config = build("half,binary16,f32,unchecked,window=9,flush,world").expect("a build");
    let options = BuildArgs {
        profile: Profile::by_name("half"),
        format: Some(FormatName::Binary16),
        arithmetic: Some(ArithmeticName::F32),
        inertia: Some(InertiaName::World),
        hazards: Some(HazardsName::Unchecked),
        window: Some(9),
        subnormals: Some(SubnormalsName::Flush),
        ..BuildArgs::default()
    };
    assert_eq!(config, options);
}

#[test]
fn what_is_no_build_is_refused_with_what_is_known() {
    for text in ["", ",float", "Float", "unchecked", "float half"] {
        let error = build(text).expect_err(text);
        assert!(matches!(error, BuildError::Profile { .. }), "{error}");
        assert!(
            error.to_string().contains("(naive, float, half, mixed, windowed, windowed16)"),
            "{error}"
        );
    }
    for text in ["float,", "float,double", "float,window", "float,colour=red", "float, world"] {
        let error = build(text).expect_err(text);
        assert!(matches!(error, BuildError::Word { .. }), "{error}");
        for word in ["thesis16", "arithmetic=f32|binary16", "unchecked", "window=SLOTS", "world"] {
            assert!(error.to_string().contains(word), "{error}");
        }
    }
    let error = build("float,keep,flush").expect_err("twice");
    assert_eq!(error.to_string(), "subnormals is given twice");
    for text in ["float,window=0", "float,window=", "half,arithmetic=f64", "half,format=f32"] {
        let error = build(text).expect_err(text);
        assert!(matches!(error, BuildError::Value { .. }), "{error}");
        assert!(error.to_string().contains(": expected "), "{error}");
    }
}

#[test]
fn every_option_is_named_when_it_is_given() {
    for (text, option) in [
        ("float,thesis16", "--format"),
        ("float,f32", "--arithmetic"),
        ("float,unchecked", "--hazards"),
        ("float,address-width=32", "--address-width"),
    ] {
        let given = BuildArgs { profile: None, ..build(text).expect(text) };
        assert_eq!(given.board_option(), Some(option));
    }
    assert_eq!(build("float").expect("a build").board_option(), Some("--profile"));
    let lanes = Some(LanesName::Off);
    assert_eq!(BuildArgs { lanes, ..BuildArgs::default() }.board_option(), Some("--lanes"));
    // Detection and packing use them on a real board, too.
    assert_eq!(BuildArgs { threads: Some(1), ..BuildArgs::default() }.board_option(), None);
}

fn any_of<T: ValueEnum + fmt::Debug + 'static>() -> impl Strategy<Value = Option<T>> {
    prop::option::of(prop::sample::select(T::value_variants().to_vec()))
}

fn any_build() -> impl Strategy<Value = BuildArgs> {
    let rate = prop_oneof![
        Just(Bandwidth::Unlimited),
        (100_000_000_u64..=1_000_000_000_000).prop_map(Bandwidth::BytesPerSecond),
    ];
    (
        prop::sample::select(PROFILES.to_vec()),
        (any_of::<FormatName>(), any_of::<ArithmeticName>(), any_of::<InertiaName>()),
        (any_of::<HazardsName>(), any_of::<SubnormalsName>()),
        (prop::option::of(1..=u32::MAX), prop::option::of(rate)),
        (prop::option::of(8_u32..=26), prop::option::of(32_u32..=64)),
    )
        .prop_map(|(profile, (format, arithmetic, inertia), choices, numbers, widths)| {
            BuildArgs {
                profile: Some(profile),
                format,
                arithmetic,
                inertia,
                hazards: choices.0,
                subnormals: choices.1,
                window: numbers.0,
                bandwidth: numbers.1,
                length_width: widths.0,
                address_width: widths.1,
                ..BuildArgs::default()
            }
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
        let again = BuildArgs::of(&config);
        prop_assert_eq!(again.config(), config);
        // A text holds no option that equals its default.
        prop_assert!(again.to_string().len() <= built.to_string().len());
    }

    #[test]
    fn no_text_makes_the_parser_panic(text in "(half|float|),?[a-z0-9=,.]{0,30}") {
        let _ = build(&text);
    }
}
