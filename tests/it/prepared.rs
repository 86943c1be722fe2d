//! Tests any sequence of submitting, preparing, starting, waiting, dropping and forgetting, with
//! faults of the board in between. Every step that ends well has the bits of a step that was alone,
//! the board records no violation, and the step that was prepared last starts.
#![cfg(feature = "emulation")]

use std::collections::BTreeMap;
use std::mem::ManuallyDrop;
use std::time::Duration;

use crate::common::{open_with, row};
use bitstream_model::interface::profile::Profile;
use bitstream_model::{BoardConfig, Direction, EmulatedBoard, Fault, FaultKind};
use proptest::prelude::*;
use zynq_pgs::{
    Accelerator, Body, Collision, Error, InFlight, InputError, Prepared, Shape, StepParameters,
    Velocity,
};

/// The end of a step that has been on the board for some clocks.
#[derive(Debug, Clone, Copy)]
enum End {
    Wait,
    /// Waits, and starts one of the prepared steps behind it, counted from the last.
    WaitAndStart(usize),
    Drop,
    Forget,
}

/// One step: its source, the steps that are prepared meanwhile, and its end.
#[derive(Debug, Clone)]
struct Act {
    /// Whether shapes are loaded before.
    shapes: bool,
    /// The channel that stalls.
    stall: Option<(usize, bool)>,
    /// The prepared step to start, counted from the last. `None` submits a step of `cubes` cubes.
    start: Option<usize>,
    cubes: u8,
    prepare: Vec<u8>,
    clocks: u64,
    end: End,
}

fn act() -> impl Strategy<Value = Act> {
    let end = prop_oneof![
        3 => Just(End::Wait),
        5 => (0_usize..3).prop_map(End::WaitAndStart),
        1 => Just(End::Drop),
        1 => Just(End::Forget),
    ];
    let stall = prop_oneof![5 => Just(None), 1 => (0_usize..4, any::<bool>()).prop_map(Some)];
    let start = prop_oneof![1 => Just(None), 1 => (0_usize..3).prop_map(Some)];
    let prepare = prop::collection::vec(1_u8..30, 0..3);
    (prop::bool::weighted(0.1), stall, start, 1_u8..30, prepare, 0_u64..4_000, end).prop_map(
        |(shapes, stall, start, cubes, prepare, clocks, end)| Act {
            shapes,
            stall,
            start,
            cubes,
            prepare,
            clocks,
            end,
        },
    )
}

const SHAPES: [Shape; 2] = [Shape::STATIC, Shape::isotropic(1.0, 0.4)];

/// Cubes that fall on the ground, each with its own speed.
fn scene(cubes: u8) -> (Vec<Body>, Vec<Collision>) {
    row(cubes.into(), 2.2, |x| Velocity {
        linear: [0.1 * x, -1.0 - x, 0.3],
        angular: [0.2, 0.0, -0.1 * x],
    })
}

fn open(config: BoardConfig) -> (EmulatedBoard, Accelerator) {
    open_with(config, None, &SHAPES)
}

/// A driver of one board, and the test's knowledge of its prepared steps.
struct Trial {
    config: BoardConfig,
    board: EmulatedBoard,
    /// The prepared steps with their number of cubes, the last one last.
    prepared: Vec<(Prepared, u8)>,
    /// Whether neither the last step nor its shapes were replaced.
    last_can_start: bool,
    alone: BTreeMap<u8, Vec<Body>>,
}

impl Trial {
    /// The results of a step that has a board for itself.
    fn alone(&mut self, cubes: u8) -> &[Body] {
        let config = self.config;
        self.alone.entry(cubes).or_insert_with(|| {
            let (_, mut accelerator) = open(config);
            let (mut bodies, collisions) = scene(cubes);
            let parameters = StepParameters::default();
            accelerator.step(&mut bodies, &collisions, &parameters).expect("a good step");
            bodies
        })
    }

    /// Checks the outcome of a step.
    fn check_end<T>(&mut self, cubes: u8, bodies: &[Body], ended: &Result<T, Error>) {
        match ended {
            Ok(_) => assert_eq!(bodies, self.alone(cubes)),
            Err(error) => {
                assert!(error.may_retry(), "{error}");
                assert_eq!(bodies, scene(cubes).0);
            }
        }
    }

    /// The index of a prepared step that is counted from the last.
    fn place(&self, from_last: usize) -> Option<usize> {
        self.prepared.len().checked_sub(from_last + 1)
    }

    /// Checks why a prepared step was not started.
    fn check_refusal(&self, place: usize, error: &Error) {
        let gone =
            matches!(error, Error::Input(InputError::NotPrepared | InputError::ShapesChanged));
        assert!(gone, "{error}");
        assert!(!self.last_can_start || place + 1 < self.prepared.len(), "{error}");
    }

    /// Continues a step on the board as `act` demands, and the steps that start behind it.
    fn continue_flight(&mut self, mut flight: InFlight<'_>, mut cubes: u8, act: &Act) {
        let clock = u64::from(self.config.profile.clock_khz);
        let mut behind = 0;
        loop {
            for number in &act.prepare {
                let (bodies, collisions) = scene(*number);
                let parameters = StepParameters::default();
                let packed = flight.prepare(&bodies, &collisions, &parameters);
                self.prepared.push((packed.expect("it fits"), *number));
                self.last_can_start = true;
            }
            let port = self.board.cpu_port();
            port.pause(Duration::from_nanos(act.clocks * 1_000_000 / clock));
            let (mut bodies, _) = scene(cubes);
            let next = match act.end {
                End::WaitAndStart(from_last) if behind < 3 => self.place(from_last),
                _ => None,
            };
            let Some(next) = next else {
                return match act.end {
                    End::Drop => drop(flight),
                    End::Forget => {
                        let _forgotten = ManuallyDrop::new(flight);
                    }
                    _ => {
                        let ended = flight.wait(&mut bodies);
                        self.check_end(cubes, &bodies, &ended);
                    }
                };
            };
            let (ended, started) = flight.wait_and_start(&mut bodies, &self.prepared[next].0);
            self.check_end(cubes, &bodies, &ended);
            match started {
                Ok(started) => (flight, cubes) = (started, self.prepared[next].1),
                Err(error) => return self.check_refusal(next, &error),
            }
            behind += 1;
        }
    }

    fn run_step(&mut self, accelerator: &mut Accelerator, act: &Act) {
        if act.shapes {
            accelerator.set_shapes(&SHAPES).expect("they fit");
            self.last_can_start = false;
        }
        if let Some((core, sent)) = act.stall {
            let direction = if sent { Direction::Mm2s } else { Direction::S2mm };
            self.board.inject(Fault::new(FaultKind::Stall).on(core, direction));
        }
        if let Some(place) = act.start.and_then(|from_last| self.place(from_last)) {
            let (prepared, cubes) = &self.prepared[place];
            let cubes = *cubes;
            match accelerator.start(prepared) {
                Ok(flight) => self.continue_flight(flight, cubes, act),
                Err(error) => self.check_refusal(place, &error),
            }
            return;
        }
        let (bodies, collisions) = scene(act.cubes);
        // The last step may have been started; packing then goes into its bank.
        self.last_can_start = false;
        let flight = accelerator.submit(&bodies, &collisions, &StepParameters::default());
        self.continue_flight(flight.expect("it fits"), act.cubes, act);
    }
}

fn board(number: usize) -> BoardConfig {
    let profile = |name| Profile::by_name(name).expect("a profile");
    match number {
        0 => BoardConfig::default(),
        1 => BoardConfig { length_width: 8, address_width: 64, ..BoardConfig::default() },
        2 => BoardConfig { profile: profile("half"), ..BoardConfig::default() },
        _ => BoardConfig { profile: profile("naive"), ..BoardConfig::default() },
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn steps_end_well_in_any_order_of_calls(
        number in 0_usize..4,
        acts in prop::collection::vec(act(), 1..12),
    ) {
        let config = board(number);
        let (board, mut accelerator) = open(config);
        let mut trial = Trial {
            config,
            board: board.clone(),
            prepared: Vec::new(),
            last_can_start: false,
            alone: BTreeMap::new(),
        };
        for act in &acts {
            trial.run_step(&mut accelerator, act);
            prop_assert_eq!(board.violations(), []);
        }
        // The next step works whatever the sequence left.
        board.clear_faults();
        let (mut bodies, collisions) = scene(7);
        accelerator.step(&mut bodies, &collisions, &StepParameters::default()).expect("ready");
        prop_assert_eq!(&bodies[..], trial.alone(7));
        drop(accelerator);
        prop_assert_eq!(board.violations(), []);
    }
}
