//! Injects faults while the driver takes steps: every step ends in bounded time, with the bits of a
//! step without faults or with an error that has changed nothing, and the next step works.

use std::time::Duration;

use bitstream_model::{
    BoardConfig, Consequence, CpuPort, EmulatedBoard, Fault, FaultKind, FaultPlan, ViolationKind,
    When,
};
use zynq_pgs::{Accelerator, BoardChoice, Body, Error, OpenOptions, StepParameters};

use super::scenes::{InvalidValues, Scene, bits, parameters};
use crate::boards;
use crate::input::Input;
use crate::tally::Tally;

/// Time limit of these steps on the accelerator.
const DEADLINE: Duration = Duration::from_millis(5);
/// Time that the driver may take beyond it, to stop and reset everything.
const RECOVERY: Duration = Duration::from_millis(150);
/// Steps with faults.
const STEPS: u32 = 3;

/// Fragments of a line with a plan, in the right and in the wrong place.
const PIECES: [&str; 25] = [
    "dma-dec-err",
    "stall",
    "corrupt=0xFF",
    "irq-drop",
    "slow",
    "reset-never",
    "power-lost",
    "reloaded",
    "accelerator-error=3",
    "@",
    "dma1.s2mm",
    "dma0.mm2s",
    "dma2",
    "accelerator",
    ",",
    ";",
    "=",
    "phase=contact1",
    "phase=load",
    "beat=7",
    "bd=0",
    "step=2",
    "times=3",
    "18446744073709551616",
    " ",
];

#[derive(Debug)]
struct Run {
    board: EmulatedBoard,
    port: CpuPort,
    accelerator: Accelerator,
    scene: Scene,
    parameters: StepParameters,
    /// The result of the step without faults.
    expected: Vec<u32>,
    tally: Tally,
}

/// One execution.
pub(super) fn run(bytes: &[u8]) -> Tally {
    let mut input = Input::new(bytes);
    if input.one_in(4) {
        read_line(&mut input);
    }
    let config = BoardConfig { strict: false, ..boards::any(&mut input) };
    let board = EmulatedBoard::new(config).expect("every choice can be built");
    let port = board.cpu_port();
    let mut tally = Tally::default();
    let plan = if input.one_in(8) {
        open_faulty(&mut input, &board, &config)
    } else if let Some(mut run) = Run::new(&mut input, &board) {
        let plan = run.take_steps(&mut input, &config);
        tally = run.tally;
        plan
    } else {
        tally.refused += 1;
        FaultPlan::default()
    };
    for violation in board.violations() {
        // A fault may halt a channel without the driver. An access outside the grants must never
        // happen.
        let behind_its_back = matches!(violation.kind, ViolationKind::DoorbellWhileHalted { .. });
        assert!(behind_its_back, "{plan}: {violation}");
    }
    assert!(port.now() < Duration::from_secs(60), "{:?} have passed", port.now());
    tally.faults += board.faults();
    tally.add_board(&board.counts());
    tally
}

/// Any line is a plan or is refused; a plan is read back as written.
fn read_line(input: &mut Input<'_>) {
    let mut line = String::new();
    for _ in 0..input.below(12) {
        match input.below(6) {
            0 => line.push(char::from(input.byte())),
            1 => line.push_str(&input.telling_word().to_string()),
            _ => line.push_str(input.pick(&PIECES)),
        }
    }
    match line.parse::<FaultPlan>() {
        Ok(plan) => check_line(&plan),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

fn check_line(plan: &FaultPlan) {
    let line = plan.to_string();
    assert_eq!(line.parse().as_ref(), Ok(plan), "{line}");
}

/// A plan of one to three faults.
fn plan(input: &mut Input<'_>, config: &BoardConfig) -> FaultPlan {
    let mut plan = FaultPlan::random(input.long(), config, 3, 3);
    for fault in &mut plan.faults {
        if input.one_in(4) {
            fault.step = Some(1 + input.below(STEPS));
        }
        if input.one_in(8) {
            fault.times = 1 + input.below(3);
        }
        if let Some(When::Access(access)) = &mut fault.when
            && input.one_in(2)
        {
            // Far enough for a reset, and for the start of every channel after it.
            *access = input.below(600).into();
        }
        if let FaultKind::Corrupt { mask } = &mut fault.kind {
            // At least one bit.
            *mask = input.word() | 1 << input.below(32);
        }
    }
    check_line(&plan);
    plan
}

fn open(port: &CpuPort) -> Result<Accelerator, Error> {
    let board = BoardChoice::Emulated(port.clone());
    Accelerator::open(OpenOptions { board, ..OpenOptions::default() })
}

/// Opens a board with faults: it opens or reports why not, in bounded time.
fn open_faulty(input: &mut Input<'_>, board: &EmulatedBoard, config: &BoardConfig) -> FaultPlan {
    let port = board.cpu_port();
    let plan = plan(input, config);
    board.inject(plan.clone());
    let opened = open(&port).map(drop);
    assert!(port.now() < Duration::from_secs(1), "it took {:?} to open", port.now());
    if let Err(error) = opened {
        assert!(matches!(error, Error::Open(_)), "{plan}: {error:?}");
    }
    plan
}

/// The bits of a step's results: the bodies, and the impulses if they come out.
fn outcome(bodies: &[Body], accelerator: &Accelerator) -> Vec<u32> {
    let mut outcome = bits(bodies);
    for impulses in accelerator.impulses() {
        let numbers = impulses.normal.iter().chain(&impulses.friction);
        outcome.extend(numbers.map(|number| number.to_bits()));
    }
    outcome
}

impl Run {
    /// Opens a board, and takes a step on it without faults; none if that step fails by its input,
    /// or has no bodies.
    fn new(input: &mut Input<'_>, board: &EmulatedBoard) -> Option<Self> {
        let port = board.cpu_port();
        let mut accelerator = open(&port).expect("nothing is wrong with the board");
        let mut scene = Scene::any(input, 8, 8, InvalidValues::Never);
        if scene.bodies.is_empty() {
            // Such a step does not reach the board.
            return None;
        }
        let variant = accelerator.capabilities().variant;
        scene.outgrow(input, &variant);
        accelerator.set_shapes(&scene.shapes).expect("every board takes isotropic shapes");
        let mut parameters = parameters(input, 3, InvalidValues::Never, &variant);
        scene.suit(input, &parameters, InvalidValues::Never);
        // With hazards, the result of a pipeline that does not wait depends on the arrival of
        // beats.
        parameters.order = None;
        parameters.deadline = Some(DEADLINE);
        let mut bodies = scene.bodies.clone();
        if let Err(error) = accelerator.step(&mut bodies, &scene.given(), &parameters) {
            assert!(!error.may_retry() && !error.must_reopen(), "nothing is wrong: {error:?}");
            return None;
        }
        let expected = outcome(&bodies, &accelerator);
        if input.one_in(4) {
            // The next step starts every channel.
            drop(accelerator);
            accelerator = open(&port).expect("nothing is wrong with the board");
            accelerator.set_shapes(&scene.shapes).expect("every board takes isotropic shapes");
        }
        let (board, tally) = (board.clone(), Tally { steps: 1, ..Tally::default() });
        Some(Self { board, port, accelerator, scene, parameters, expected, tally })
    }

    /// Takes steps with faults, and then without.
    fn take_steps(&mut self, input: &mut Input<'_>, config: &BoardConfig) -> FaultPlan {
        let plan = plan(input, config);
        self.under(input, &plan);
        plan
    }

    fn under(&mut self, input: &mut Input<'_>, plan: &FaultPlan) {
        if input.one_in(4) {
            self.parameters.retries = input.below(3);
        }
        self.board.inject(plan.clone());
        let survivable = |fault: &Fault| fault.kind.consequence() == Consequence::Survivable;
        let survivable = plan.faults.iter().all(survivable);
        for _ in 0..STEPS {
            let ended = self.step(plan);
            if let Err(error) = ended {
                assert!(!survivable, "{plan}: {error:?}");
                if error.must_reopen() {
                    return self.check_lost(plan);
                }
            }
        }
        self.board.clear_faults();
        // A fault that began unnoticed may still end a step, which then resets it.
        if let Err(error) = self.step(plan) {
            assert!(!survivable, "{plan}: {error:?}");
            if error.must_reopen() {
                return self.check_lost(plan);
            }
            self.step(plan).unwrap_or_else(|error| panic!("{plan}: no fault is left: {error:?}"));
        }
    }

    /// Takes a step, which must end in time, with the right bits or with none.
    fn step(&mut self, plan: &FaultPlan) -> Result<(), Error> {
        let mut bodies: Vec<Body> = self.scene.bodies.clone();
        let begin = self.port.now();
        let ended = self.accelerator.step(&mut bodies, &self.scene.given(), &self.parameters);
        let took = self.port.now() - begin;
        let limit = (DEADLINE + RECOVERY) * (1 + self.parameters.retries);
        assert!(took <= limit, "{plan}: the step took {took:?}");
        match ended {
            Ok(_) => {
                self.tally.steps += 1;
                if outcome(&bodies, &self.accelerator) != self.expected {
                    // Two wrong words may have the right sum.
                    let corrupt = |fault: &&Fault| matches!(fault.kind, FaultKind::Corrupt { .. });
                    let corrupt = plan.faults.iter().filter(corrupt).map(|fault| fault.times);
                    assert!(
                        corrupt.sum::<u32>() > 1,
                        "{plan}: not the bits of a step without faults"
                    );
                }
                Ok(())
            }
            Err(error) => {
                self.tally.refused += 1;
                assert_eq!(bits(&bodies), bits(&self.scene.bodies), "{plan}: touched: {error}");
                assert!(!error.is_input(), "{plan}: {error}");
                Err(error)
            }
        }
    }

    /// An accelerator that must be opened again reports it in every call, and touches nothing.
    fn check_lost(&mut self, plan: &FaultPlan) {
        let before = self.board.counts();
        let again = self.step(plan).expect_err("it was given up");
        assert!(matches!(again, Error::MustReopen), "{plan}: {again:?}");
        let shapes = self.accelerator.set_shapes(&self.scene.shapes);
        assert!(matches!(shapes, Err(Error::MustReopen)), "{plan}: {shapes:?}");
        let after = self.board.counts();
        assert_eq!(before.register_writes, after.register_writes, "{plan}: registers written");
    }
}
