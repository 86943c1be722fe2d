//! The contract's literal values: offsets, bits, layouts and reset values, typed here a second time
//! from PG021 and the accelerator's specification.

use zynq_pgs::interface::fence::{FENCE_UNIT, Fence};
use zynq_pgs::interface::{
    address_map, axi_dma, control, descriptor, profile, record, stripe, usr_access,
};

#[test]
fn regions_stand_where_the_block_design_puts_them() {
    let bases: Vec<_> = (0..4).map(address_map::dma_base).collect();
    assert_eq!(bases, [0xA000_0000, 0xA001_0000, 0xA002_0000, 0xA003_0000]);
    assert_eq!(address_map::DMA_BYTES, 0x1_0000);
    assert_eq!(address_map::CONTROL_BASE, 0xA004_0000);
    assert_eq!(address_map::CONTROL_BYTES, 0x1000);
    assert_eq!(address_map::INTERRUPT_SPI, 89);
    assert_eq!(address_map::DMA_COUNT_MAX, 4);
    assert_eq!(address_map::UIO_NODE, "pgs");
    assert_eq!(address_map::UIO_DMA_MAPS, ["dma0", "dma1", "dma2", "dma3"]);
    assert_eq!(address_map::UIO_CONTROL_MAP, "control");
    assert_eq!(address_map::DDR_LOW, 0..0x8000_0000);
    assert_eq!(address_map::DDR_HIGH, 0x8_0000_0000..0x8_8000_0000);
    assert_eq!((address_map::MEMORY_BASE, address_map::MEMORY_BYTES), (0x5000_0000, 0x400_0000));
    assert_eq!(address_map::UIO_MEMORY_NODE, "pgs-memory");
    assert_eq!((address_map::UIO_GUARD_NODE, address_map::GUARD_BYTES), ("pgs-guard", 0x1_0000));
}

/// `FENCE_BASE` and `FENCE_SIZE` count 64 KiB, and a size of 0 is no fence.
#[test]
fn the_fence_is_reported_in_units_of_64_kib() {
    assert_eq!(FENCE_UNIT, 0x1_0000);
    assert_eq!(Fence::to_registers(Some(Fence::default())), [0x5000, 0x400]);
    assert_eq!(Fence::to_registers(None), [0, 0]);
    let high = Fence::new(0x8_4000_0000, 0x4000_0000);
    assert_eq!(Fence::from_registers([0x8_4000, 0x4000]), Ok(high));
}

#[test]
fn axi_dma_registers_are_those_of_pg021() {
    let rows: Vec<_> = axi_dma::CHANNEL_REGISTERS
        .iter()
        .map(|register| (register.name, register.offset, register.reset))
        .collect();
    assert_eq!(
        rows,
        [
            ("DMACR", 0x00, 0x0001_0002),
            ("DMASR", 0x04, 0x0001_0001),
            ("CURDESC", 0x08, 0),
            ("CURDESC_MSB", 0x0C, 0),
            ("TAILDESC", 0x10, 0),
            ("TAILDESC_MSB", 0x14, 0),
            ("SA/DA", 0x18, 0),
            ("SA/DA_MSB", 0x1C, 0),
            ("LENGTH", 0x28, 0),
        ]
    );
    assert_eq!(axi_dma::S2MM_OFFSET, 0x30);
    assert_eq!((axi_dma::LENGTH_WIDTH_MIN, axi_dma::LENGTH_WIDTH_MAX), (8, 26));
}

#[test]
fn axi_dma_fields_are_those_of_pg021() {
    use axi_dma::{dmacr, dmasr};
    let control = [
        (dmacr::RS, 0x0000_0001),
        (dmacr::ALWAYS_ONE, 0x0000_0002),
        (dmacr::RESET, 0x0000_0004),
        (dmacr::KEYHOLE, 0x0000_0008),
        (dmacr::CYCLIC_BD, 0x0000_0010),
        (dmacr::IOC_IRQ_EN, 0x0000_1000),
        (dmacr::DLY_IRQ_EN, 0x0000_2000),
        (dmacr::ERR_IRQ_EN, 0x0000_4000),
        (dmacr::IRQ_THRESHOLD, 0x00FF_0000),
        (dmacr::IRQ_DELAY, 0xFF00_0000),
    ];
    let status = [
        (dmasr::HALTED, 0x0000_0001),
        (dmasr::IDLE, 0x0000_0002),
        (dmasr::SG_INCLD, 0x0000_0008),
        (dmasr::DMA_INT_ERR, 0x0000_0010),
        (dmasr::DMA_SLV_ERR, 0x0000_0020),
        (dmasr::DMA_DEC_ERR, 0x0000_0040),
        (dmasr::SG_INT_ERR, 0x0000_0100),
        (dmasr::SG_SLV_ERR, 0x0000_0200),
        (dmasr::SG_DEC_ERR, 0x0000_0400),
        (dmasr::IOC_IRQ, 0x0000_1000),
        (dmasr::DLY_IRQ, 0x0000_2000),
        (dmasr::ERR_IRQ, 0x0000_4000),
        (dmasr::IRQ_THRESHOLD_STS, 0x00FF_0000),
        (dmasr::IRQ_DELAY_STS, 0xFF00_0000),
    ];
    for (field, mask) in control.into_iter().chain(status) {
        assert_eq!(field.mask(), mask, "{}", field.name);
    }
    assert_eq!(dmasr::ERRORS, 0x770);
    assert_eq!(dmasr::IRQS, 0x7000);
}

#[test]
fn descriptors_are_those_of_pg021() {
    assert_eq!((descriptor::BYTES, descriptor::WORDS, descriptor::FETCHED_WORDS), (64, 16, 13));
    assert_eq!((descriptor::NXTDESC * 4, descriptor::NXTDESC_MSB * 4), (0x00, 0x04));
    assert_eq!((descriptor::BUFFER * 4, descriptor::BUFFER_MSB * 4), (0x08, 0x0C));
    assert_eq!((descriptor::CONTROL * 4, descriptor::STATUS * 4), (0x18, 0x1C));
    assert_eq!(descriptor::control::LENGTH.mask(), 0x03FF_FFFF);
    assert_eq!(descriptor::control::EOF.mask(), 1 << 26);
    assert_eq!(descriptor::control::SOF.mask(), 1 << 27);
    assert_eq!(descriptor::status::TRANSFERRED.mask(), 0x03FF_FFFF);
    assert_eq!(descriptor::status::RXEOF.mask(), 1 << 26);
    assert_eq!(descriptor::status::RXSOF.mask(), 1 << 27);
    assert_eq!(descriptor::status::DMA_INT_ERR.mask(), 1 << 28);
    assert_eq!(descriptor::status::DMA_SLV_ERR.mask(), 1 << 29);
    assert_eq!(descriptor::status::DMA_DEC_ERR.mask(), 1 << 30);
    assert_eq!(descriptor::status::CMPLTED.mask(), 1 << 31);
    assert_eq!(descriptor::status::ERRORS, 0x7000_0000);
}

#[test]
fn control_registers_stand_at_their_published_offsets() {
    let rows: Vec<_> =
        control::REGISTERS.iter().map(|register| (register.name, register.offset)).collect();
    assert_eq!(
        rows,
        [
            ("AP_CTRL", 0x00),
            ("GIE", 0x04),
            ("IER", 0x08),
            ("ISR", 0x0C),
            ("BODIES", 0x10),
            ("COLLISIONS", 0x18),
            ("CONTACT_ITERATIONS", 0x20),
            ("FRICTION_ITERATIONS", 0x28),
            ("FLAGS", 0x30),
            ("TIME_STEP", 0x38),
            ("POSITION_DRIFT", 0x40),
            ("POSITION_COEFFICIENT", 0x48),
            ("FRICTION", 0x50),
            ("ANGULAR_DAMPING", 0x58),
            ("GRAVITY_X", 0x60),
            ("GRAVITY_Y", 0x68),
            ("GRAVITY_Z", 0x70),
            ("SPIN_DAMPING", 0x78),
            ("IDENTIFICATION", 0x100),
            ("VERSION", 0x104),
            ("PROFILE", 0x108),
            ("FEATURES", 0x10C),
            ("CHANNELS", 0x110),
            ("MM2S_WIDTHS", 0x114),
            ("S2MM_WIDTHS", 0x118),
            ("ISSUE", 0x11C),
            ("CONTACT_DEPTH", 0x120),
            ("FRICTION_DEPTH", 0x124),
            ("CLOCK_KHZ", 0x128),
            ("BODY_CAPACITY", 0x12C),
            ("COLLISION_CAPACITY", 0x130),
            ("SHAPE_CAPACITY", 0x134),
            ("MEMORY_BYTES", 0x138),
            ("MEMORY_PER_RECORD", 0x13C),
            ("DMA", 0x140),
            ("NUMBERS", 0x144),
            ("QUEUE", 0x148),
            ("FENCE_BASE", 0x150),
            ("FENCE_SIZE", 0x154),
            ("ERROR", 0x180),
            ("ERROR_DETAIL", 0x184),
            ("CYCLES_LO", 0x188),
            ("CYCLES_HI", 0x18C),
            ("WORK_CYCLES", 0x190),
            ("WAIT_CYCLES", 0x194),
            ("HAZARDS", 0x198),
            ("SUM_RECEIVED", 0x19C),
            ("SUM_SENT", 0x1A0),
            ("IMPULSE_SUM_LO", 0x1A4),
            ("IMPULSE_SUM_HI", 0x1A8),
            ("RESET", 0x1C0),
        ]
    );
    assert_eq!(control::IDENTIFICATION_VALUE.to_be_bytes(), *b"PGS1");
    assert_eq!((control::VERSION_MAJOR, control::VERSION_MINOR), (2, 0));
    assert_eq!(control::VERSION.reset, 0x0002_0000);
    assert_eq!(control::IMPULSE_SUM_FRACTION_BITS, 20);
    assert_eq!(control::IMPULSE_SUM_MAX, 0xFFFF_FFFF_FFFF_FFFF);
    assert_eq!(control::COUNTER_MAX, 0xFFFF_FFFF);
    assert_eq!(control::ITERATIONS_MAX, 255);
    assert_eq!(
        (control::QUEUE_MAX, control::QUEUE_PATIENCE, control::NUMBERS_PER_BEAT),
        (256, 4, 4)
    );
}

#[test]
fn control_fields_follow_the_hls_convention_and_the_specification() {
    assert_eq!(control::ap_ctrl::START.mask(), 1 << 0);
    assert_eq!(control::ap_ctrl::DONE.mask(), 1 << 1);
    assert_eq!(control::ap_ctrl::IDLE.mask(), 1 << 2);
    assert_eq!(control::ap_ctrl::READY.mask(), 1 << 3);
    assert_eq!(control::ap_ctrl::AUTO_RESTART.mask(), 1 << 7);
    assert_eq!(control::AP_CTRL.reset, 1 << 2);
    assert_eq!(
        (control::irq::DONE.mask(), control::irq::READY.mask(), control::irq::ERROR.mask()),
        (1, 2, 4)
    );
    assert_eq!(control::flags::INTEGRATE.mask(), 1);
    assert_eq!(control::flags::KINEMATIC.mask(), 1 << 1);
    assert_eq!(control::flags::PAIR_FRICTION.mask(), 1 << 2);
    assert_eq!(control::flags::WARM_START.mask(), 1 << 3);
    assert_eq!(control::flags::IMPULSES_OUT.mask(), 1 << 4);
    assert_eq!(control::flags::STREAMED_MASSES.mask(), 1 << 5);
    assert_eq!(control::features::INTERLOCKED.mask(), 1 << 0);
    assert_eq!(control::features::WORLD_INERTIA.mask(), 1 << 1);
    let formats = [
        control::numbers::COLLISIONS,
        control::numbers::BODIES,
        control::numbers::ROWS,
        control::numbers::UPDATES,
        control::numbers::VELOCITIES,
        control::numbers::IMPULSES,
        control::numbers::POSES,
    ];
    assert_eq!(
        formats.map(|field| field.mask()),
        [0xF, 0xF0, 0xF00, 0xF000, 0x000F_0000, 0x00F0_0000, 0x0F00_0000]
    );
    assert_eq!(
        (control::channels::MM2S.mask(), control::channels::S2MM.mask()),
        (0x0000_00FF, 0x0000_FF00)
    );
    assert_eq!(
        (control::issue::INTERVAL.mask(), control::issue::COLLISIONS.mask()),
        (0x0000_FFFF, 0xFFFF_0000)
    );
    assert_eq!(
        (control::depth::FILL.mask(), control::depth::WINDOW.mask()),
        (0x0000_FFFF, 0xFFFF_0000)
    );
    assert_eq!(control::memory_per_record::BODY.mask(), 0x0000_FFFF);
    assert_eq!(control::memory_per_record::COLLISION.mask(), 0xFFFF_0000);
    assert_eq!(
        (control::dma::LENGTH_WIDTH.mask(), control::dma::ADDRESS_WIDTH.mask()),
        (0x00FF, 0xFF00)
    );
    assert_eq!((control::error::CODE.mask(), control::error::CHANNEL.mask()), (0x00FF, 0xFF00));
    assert_eq!(control::reset::RESET.mask(), 1);
    assert_eq!((control::SHAPE_TABLE, control::SHAPE_STRIDE), (0x400, 16));
    assert_eq!((control::SHAPE_INVERSE_MASS, control::SHAPE_INVERSE_INERTIA), (0, 4));
}

#[test]
fn error_codes_keep_their_numbers() {
    use control::ErrorCode;
    let codes: Vec<_> = ErrorCode::ALL.iter().map(|code| (*code as u32, *code)).collect();
    assert_eq!(
        codes,
        [
            (1, ErrorCode::BodyIndex),
            (2, ErrorCode::ContactCount),
            (3, ErrorCode::TlastEarly),
            (4, ErrorCode::TlastMissing),
            (5, ErrorCode::ShapeIndex),
            (6, ErrorCode::Capacity),
            (7, ErrorCode::StaticPair),
            (8, ErrorCode::SelfCollision),
            (9, ErrorCode::Argument),
            (10, ErrorCode::PartialBeat),
        ]
    );
    for (code, known) in codes {
        assert_eq!(ErrorCode::from_register(0x0300 | code), Some(known));
    }
    assert_eq!(ErrorCode::from_register(0), None);
}

#[test]
fn records_have_the_layout_of_the_record_table() {
    assert_eq!((record::BEAT_BYTES, record::LANES, record::WORD_LANE), (16, 4, 3));
    assert_eq!(record::CONTACT_POINTS, 4);
    assert_eq!((record::velocity::ROWS, record::velocity::WORLD_ROWS), (2, 4));
    assert_eq!((record::velocity::DIAGONAL, record::velocity::OFF_DIAGONAL), (2, 3));
    assert_eq!((record::velocity::LINEAR, record::velocity::ANGULAR), (0, 1));
    assert_eq!(record::collision::ROWS, 7);
    assert_eq!(record::collision::NORMAL, 0);
    assert_eq!((record::collision::BODY_A, record::collision::BODY_B), (1, 2));
    assert_eq!(record::collision::CONTACTS, 3);
    assert_eq!((record::collision::WARM_ROWS, record::collision::IMPULSES), (8, 7));
    assert_eq!(stripe::IMPULSES_STREAM, 0);
    let warm = |profile: &profile::Profile| profile.stripes.warm_collisions.map(|of| of.streams);
    assert_eq!(warm(&profile::FLOAT), Some(&[0, 1, 2, 3][..]));
    assert_eq!(warm(&profile::HALF), Some(&[0, 0, 0, 1, 1, 1, 2, 2][..]));
    assert_eq!(record::pose::ROWS, 2);
    assert_eq!((record::pose::POSITION, record::pose::ORIENTATION), (0, 1));
    assert_eq!(record::result::ROWS, 4);
    assert_eq!((record::result::POSITION, record::result::ORIENTATION), (0, 1));
    assert_eq!((record::result::LINEAR, record::result::ANGULAR), (2, 3));
}

#[test]
fn float_is_the_profile_of_the_thesis() {
    let float = profile::Profile::by_name("float").expect("the profile exists");
    assert_eq!(float, &profile::FLOAT);
    assert_eq!(profile::Profile::by_id(1), Some(float));
    assert_eq!(float.mm2s_widths, [128; 4]);
    assert_eq!(float.s2mm_widths, [128; 4]);
    assert_eq!((float.initiation_interval, float.collisions_per_issue), (2, 1));
    assert_eq!((float.contact.fill, float.contact.window), (374, 324));
    assert_eq!((float.friction.fill, float.friction.window), (314, 190));
    let [contact, friction] = float.world.expect("a build with world inertia");
    assert_eq!((contact.fill, contact.window), (388, 324));
    assert_eq!((friction.fill, friction.window), (328, 190));
    assert!(profile::NAIVE.world.is_none() && profile::HALF.world.is_none());
    let fills = profile::PROFILES.iter().map(|profile| profile.integration_fill);
    assert_eq!(fills.collect::<Vec<_>>(), [264, 264, 177]);
    assert_eq!((float.queue, profile::NAIVE.queue, profile::HALF.queue), (Some(64), None, None));
    assert_eq!(float.clock_khz, 275_000);
    assert_eq!(
        (float.default_variant().bytes_per_body(), float.default_variant().bytes_per_collision()),
        (24, 16)
    );
    assert_eq!(float.memory.bytes, 4 << 20);
    let words = float.default_variant().words();
    assert_eq!((words.velocity, words.collision, words.pose, words.result), (8, 28, 8, 16));
    let packed = profile::THESIS_WORDS;
    assert_eq!((packed.velocity, packed.collision, packed.pose, packed.result), (6, 27, 7, 6));
}

#[test]
fn the_other_profiles_are_those_of_the_specification() {
    let by_name = |name| profile::Profile::by_name(name).expect("the profile exists");
    let [naive, half] = ["naive", "half"].map(by_name);
    assert_eq!([naive.id, half.id], [2, 3]);
    // The numbers of profiles that are gone stay free.
    assert!((4..8).all(|id| profile::Profile::by_id(id).is_none()));
    assert_eq!(naive.mm2s_widths, [32]);
    assert_eq!(half.mm2s_widths, [128, 128, 64]);
    for profile in [naive, half] {
        assert_eq!(profile.mm2s_widths, profile.s2mm_widths);
    }
    let depths =
        |p: &profile::Profile| [p.contact, p.friction].map(|depth| (depth.fill, depth.window));
    assert_eq!(depths(naive), [(364, 316), (306, 182)]);
    assert_eq!(depths(half), [(285, 255), (222, 156)]);
    assert_eq!([naive, half].map(|p| p.clock_khz), [275_000, 250_000]);
    let issue = |p: &profile::Profile| (p.initiation_interval, p.collisions_per_issue);
    assert_eq!([naive, half].map(issue), [(28, 1), (3, 2)]);
    let per_record = |p: &'static profile::Profile| {
        let variant = p.default_variant();
        (variant.bytes_per_body(), variant.bytes_per_collision())
    };
    assert_eq!([naive, half].map(per_record), [(24, 16), (24, 8)]);
    let words = |p: &'static profile::Profile| {
        let words = p.default_variant().words();
        [words.velocity, words.collision, words.pose, words.result]
    };
    assert_eq!([naive, half].map(words), [[8, 28, 8, 16], [4, 14, 4, 8]]);
    assert_eq!(half.stripes.collisions.streams, [0, 0, 0, 1, 1, 1, 2]);
    assert_eq!(half.stripes.results.streams, [0, 0, 1, 1, 2]);
    assert!(half.stripes.collisions.padded && half.stripes.results.padded);
    let mut world = profile::FLOAT.default_variant();
    world.inertia = profile::Inertia::World;
    assert_eq!((world.words().velocity, world.bytes_per_body()), (16, 48));
    assert_eq!(half.default_variant().body_capacity(), 65_536);
}

#[test]
fn the_solver_has_bullets_constants() {
    use profile::solver;
    let bits = [
        (solver::TANGENT_Z, 0x3F35_04F3),
        (solver::SPIN_COSINE, 0x3F73_3333),
        (solver::SPIN_DAMPING, 0x3DCC_CCCD),
        (solver::ROTATION_LIMIT, 0x3F49_0FDA),
        (solver::SERIES_BELOW, 0x3A83_126F),
        (solver::SERIES_TERM, 0x3CAA_AAAB),
    ];
    for (value, expected) in bits {
        assert_eq!(value.to_bits(), expected, "{value}");
    }
}

#[test]
fn the_word_of_a_bitstream_for_its_loader_has_the_rate_of_the_pl_clock() {
    assert_eq!(usr_access::PL_CLOCK_MHZ, 100);
    assert_eq!(usr_access::word(100), 0x5047_0064);
    assert_eq!(usr_access::pl_clock_mhz(0x5047_0113), Some(275));
    for other in [0, 0x5047_0000, 0x0064_5047, 0xFFFF_FFFF, 0x5046_0064] {
        assert_eq!(usr_access::pl_clock_mhz(other), None, "{other:#x}");
    }
}
