//! A small step on a board of its own, recorded, with everything that the board counts beside it.

use bitstream_model::recording::Recording;
use bitstream_model::{BoardConfig, Counts, EmulatedBoard, Fault, PacketCount, RegisterAccess};
use step_trace::TracedStep;
use zynq_pgs::{
    Accelerator, BoardChoice, Body, Collision, Contact, OpenOptions, Pose, Shape, StepParameters,
    StepReport, Velocity,
};

/// The number of cubes in a row on the ground.
const CUBES: u32 = 40;

/// A recorded step.
pub(crate) struct Taken {
    pub(crate) config: BoardConfig,
    pub(crate) recording: Recording,
    pub(crate) report: Option<StepReport>,
    /// The board's counters before and after the step.
    pub(crate) counts: [Counts; 2],
    pub(crate) packets: Vec<PacketCount>,
    /// The board's own log, which keeps the last accesses.
    pub(crate) accesses: Vec<RegisterAccess>,
    pub(crate) bodies: Vec<Body>,
}

fn body(x: f32, y: f32, shape: u32) -> Body {
    Body {
        pose: Pose { position: [x, y, 0.0], orientation: [0.0, 0.0, 0.0, 1.0] },
        velocity: Velocity {
            linear: [0.0, if shape == 0 { 0.0 } else { -1.0 }, 0.0],
            angular: [0.0; 3],
        },
        shape,
    }
}

impl Taken {
    pub(crate) fn new(config: BoardConfig) -> Self {
        Self::with(config, None)
    }

    /// The second step of a board, with a fault if one is given.
    pub(crate) fn with(config: BoardConfig, fault: Option<Fault>) -> Self {
        Self::repeated(config, fault, 0)
    }

    /// The same; the driver repeats the step up to `retries` times.
    pub(crate) fn repeated(config: BoardConfig, fault: Option<Fault>, retries: u32) -> Self {
        let board = EmulatedBoard::new(config).expect("a board that can be built");
        let choice = BoardChoice::Emulated(board.cpu_port());
        let options = OpenOptions { board: choice, ..OpenOptions::default() };
        let mut accelerator = Accelerator::open(options).expect("an emulated board");
        let shapes = [Shape::STATIC, Shape::isotropic(1.0, 1.5)];
        accelerator.set_shapes(&shapes).expect("two shapes");
        let mut bodies = vec![body(0.0, -1.0, 0)];
        let mut collisions = Vec::new();
        for (cube, x) in (1..=CUBES).zip((0..).map(|place: u8| 3.0 * f32::from(place))) {
            bodies.push(body(x, 0.99, 1));
            let corner = |dx, z| Contact { point: [x + dx, -0.01, z], distance: -0.01 };
            let contacts =
                [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
            collisions.push(Collision {
                body_a: 0,
                body_b: cube,
                normal: [0.0, -1.0, 0.0],
                count: 4,
                contacts,
            });
        }
        let parameters =
            StepParameters::thesis().with_contact_iterations(3).with_friction_iterations(2);
        accelerator.step(&mut bodies, &collisions, &parameters).expect("no fault");
        if let Some(fault) = fault {
            board.inject(fault);
        }
        let before = board.counts();
        board.record();
        let parameters = parameters.with_retries(retries);
        let report = accelerator.step(&mut bodies, &collisions, &parameters).ok();
        let (after, packets) = (board.counts(), board.packets());
        let accesses = board.register_accesses();
        let recording = board.take_recording().expect("it was recorded");
        Self { config, recording, report, counts: [before, after], packets, accesses, bodies }
    }

    pub(crate) fn traced(&self) -> TracedStep<'_> {
        let report = self.report.as_ref();
        TracedStep { recording: &self.recording, design: "a design", report }
    }
}

#[test]
fn a_recorded_step_of_the_driver_is_the_step() {
    let taken = Taken::new(BoardConfig::default());
    let bare = Taken::new(BoardConfig { fast: false, ..BoardConfig::default() });
    assert_eq!(taken.bodies, bare.bodies);
    assert_eq!(taken.recording, bare.recording);
    let [report, without] = [&taken, &bare].map(|one| one.report.as_ref().expect("no fault"));
    assert_eq!(report.cycles, without.cycles);
    let stages = taken.recording.stages.iter().map(|stage| stage.span.clocks()).sum::<u64>();
    assert_eq!(stages, report.cycles.total);
}
