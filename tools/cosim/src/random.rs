//! Random scenes of every kind that the interface permits, and of kinds that it refuses.

use pgs_interface::profile::solver::SPIN_DAMPING;
use pgs_interface::profile::{Inertia, Variant};
use pgs_interface::record::CONTACT_POINTS;
use pgs_interface::record::collision::{FRICTION_BITS, FRICTION_SHIFT};
use pgs_support::random::SplitMix64;

use crate::packets::{Fault, FaultAt, STREAMS};
use crate::scene::{Arguments, Body, Collision, Scene, Shape};

/// A step, and what is wrong with its packets.
#[derive(Debug, Clone)]
pub struct Case {
    /// The step.
    pub scene: Scene,
    /// A fault in its packets.
    pub fault: Option<FaultAt>,
}

/// Collisions in a queue of the usual depth.
const QUEUED_MOST: u32 = 64;

const SUBNORMAL: u32 = 0x0040_0001;
const NEGATIVE_ZERO: u32 = 0x8000_0000;
const NAN: u32 = 0x7FC0_1234;

struct Draw(SplitMix64);

impl Draw {
    /// A number below `limit`.
    fn below(&mut self, limit: u32) -> u32 {
        self.0.word_below(limit)
    }

    /// True once in `n` times.
    fn one_in(&mut self, n: u32) -> bool {
        self.below(n) == 0
    }

    /// A number from -`size` to `size`.
    fn number(&mut self, size: f32) -> f32 {
        let unit = f64::from(self.0.word()) / f64::from(u32::MAX);
        #[expect(clippy::cast_possible_truncation, reason = "any f32 will do")]
        let number = ((2.0 * unit - 1.0) * f64::from(size)) as f32;
        number
    }

    /// A component of a velocity or a position; now and then a special one.
    fn component(&mut self, size: f32) -> u32 {
        match self.below(24) {
            0 => 0,
            1 => NEGATIVE_ZERO,
            2 => SUBNORMAL | (self.below(2) << 31),
            _ => self.number(size).to_bits(),
        }
    }

    fn vector(&mut self, size: f32) -> [u32; 3] {
        [0; 3].map(|_| self.component(size))
    }

    /// A unit vector, along an axis or anywhere.
    fn unit(&mut self) -> [u32; 3] {
        if self.one_in(3) {
            let mut axis = [0.0_f32; 3];
            axis[self.below(3) as usize] = if self.one_in(2) { 1.0 } else { -1.0 };
            return axis.map(f32::to_bits);
        }
        let vector = [0; 3].map(|_| self.number(1.0));
        let length = vector.map(|x| x * x).iter().sum::<f32>().sqrt().max(1e-3);
        vector.map(|x| (x / length).to_bits())
    }

    fn shape(&mut self, moves: bool) -> Shape {
        let inverse_mass = match (moves, self.below(12)) {
            (false, _) => 0,
            // It moves, and counts as 0 in arithmetic.
            (true, 0) => SUBNORMAL,
            (true, _) => (self.number(2.0).abs() + 0.01).to_bits(),
        };
        let inverse_inertia =
            if moves && !self.one_in(8) { (self.number(3.0).abs() + 0.01).to_bits() } else { 0 };
        Shape { inverse_mass, inverse_inertia }
    }

    fn body(&mut self, shapes: u32) -> Body {
        let speed = if self.one_in(6) { 300.0 } else { 3.0 };
        Body {
            linear: self.vector(speed),
            angular: self.vector(speed),
            position: self.vector(5.0),
            orientation: self.orientation(),
            shape: self.below(shapes),
            inverse_inertia: [0; 6],
            inverse_mass: 0,
        }
    }

    fn orientation(&mut self) -> [u32; 4] {
        let parts = [0; 4].map(|_| self.number(1.0));
        let length = parts.map(|x| x * x).iter().sum::<f32>().sqrt().max(1e-3);
        parts.map(|x| (x / length).to_bits())
    }

    /// A collision of two bodies that are not both static; unused slots hold anything.
    fn collision(&mut self, scene: &Scene) -> Collision {
        let count = if self.one_in(12) { 0 } else { 1 + self.below(4) };
        let bodies = self.pair(scene);
        let position = |body: u32| scene.bodies[body as usize].position;
        let mut points = [[0; 4]; CONTACT_POINTS];
        for (slot, point) in points.iter_mut().enumerate() {
            let used = slot < count as usize;
            let [x, y, z] = self.vector(5.0);
            *point = match (used, self.one_in(2)) {
                (false, true) => [NAN, self.0.word(), NAN | NEGATIVE_ZERO, self.0.word()],
                _ => [x, y, z, self.number(0.05).to_bits()],
            };
        }
        let normal = self.unit();
        let impulses = [[0; 4]; 2];
        Collision { bodies, positions: bodies.map(position), normal, count, points, impulses }
    }

    fn pair(&mut self, scene: &Scene) -> [u32; 2] {
        let bodies = u32::try_from(scene.bodies.len()).unwrap_or(1);
        let moves = |body: u32| {
            let shape = scene.bodies[body as usize].shape as usize;
            scene.shapes[shape].inverse_mass != 0
        };
        // Few bodies: the pairs meet hazards.
        let few = if self.one_in(2) { bodies } else { bodies.min(6) };
        for _ in 0..1_000 {
            let pair = [self.below(few), self.below(bodies)];
            if pair[0] != pair[1] && (moves(pair[0]) || moves(pair[1])) {
                return pair;
            }
        }
        [0, 1]
    }

    /// Impulses for each collision, with any words for unused points; a fault in any packet.
    fn warm(&mut self, case: &mut Case) {
        let scene = &mut case.scene;
        scene.arguments.warm_start = true;
        for collision in &mut scene.collisions {
            let count = collision.count & !FRICTION_BITS;
            let [contact, friction] = &mut collision.impulses;
            for (point, impulse) in (0_u32..).zip(contact) {
                *impulse = match (point < count, self.below(8)) {
                    (false, 0) => NAN,
                    // A given impulse is applied as it is, even one that pulls.
                    (_, 1) => self.component(2.0),
                    _ => self.number(2.0).abs().to_bits(),
                };
            }
            for impulse in &mut friction[..2] {
                *impulse = self.component(1.0);
            }
        }
        let segments = 2 + scene.passes().iter().sum::<u32>();
        if let Some(fault) = &mut case.fault {
            fault.segment = self.below(segments) as usize;
        }
    }

    /// Inertias about world axes, any numbers. In two steps of three the bodies bring their masses,
    /// and nearly always the same bodies are static as by their shapes.
    fn world(&mut self, scene: &mut Scene) {
        scene.arguments.streamed_masses = !self.one_in(3);
        for body in &mut scene.bodies {
            let size = if self.one_in(3) { 0.0 } else { 2.0 };
            let diagonal = [0; 3].map(|_| (self.number(3.0).abs() + 0.01).to_bits());
            let [xx, yy, zz] = if self.one_in(8) { self.vector(3.0) } else { diagonal };
            let [xy, xz, yz] = self.vector(size);
            body.inverse_inertia = [xx, yy, zz, xy, xz, yz];
            let shape = scene.shapes.get(body.shape as usize);
            let of_shape = shape.map_or(1.0_f32.to_bits(), |shape| shape.inverse_mass);
            let moves = if self.one_in(200) { self.one_in(2) } else { of_shape != 0 };
            body.inverse_mass = match self.below(6) {
                0 => of_shape,
                1 if !moves => NEGATIVE_ZERO,
                _ => self.shape(moves).inverse_mass,
            };
            // The shape means nothing then.
            if scene.arguments.streamed_masses && self.one_in(2) {
                body.shape = self.0.word();
            }
        }
    }

    /// Something that the accelerator refuses.
    fn spoil(&mut self, case: &mut Case) {
        let scene = &mut case.scene;
        let bodies = u32::try_from(scene.bodies.len()).unwrap_or(1);
        let collisions = u32::try_from(scene.collisions.len()).unwrap_or(0);
        let at = if collisions > 0 { self.below(collisions) as usize } else { 0 };
        match (self.below(7), scene.collisions.get_mut(at)) {
            (0, Some(collision)) => collision.bodies[1] = bodies + self.below(3),
            (1, Some(collision)) => collision.count = 5 + self.below(200),
            (2, Some(collision)) => collision.bodies = [collision.bodies[0]; 2],
            (3, _) => {
                let body = self.below(bodies) as usize;
                scene.bodies[body].shape = 64 + self.below(1 << 20);
            }
            (kind, _) => {
                let fault = [Fault::EarlyLast, Fault::NoLast, Fault::Partial][kind as usize % 3];
                let segments = 2 + scene.arguments.contact_iterations;
                case.fault = Some(FaultAt {
                    fault,
                    segment: self.below(segments) as usize,
                    stream: self.below(4) as usize % STREAMS,
                    beat: self.below(1 << 20) as usize,
                });
            }
        }
    }
}

/// A case for an accelerator; the same for the same seed.
#[must_use]
pub fn case(seed: u64, variant: Variant) -> Case {
    let mut draw = Draw(SplitMix64::new(seed));
    let iterations = |draw: &mut Draw| if draw.one_in(5) { 0 } else { 1 + draw.below(3) };
    let arguments = Arguments {
        contact_iterations: iterations(&mut draw),
        friction_iterations: iterations(&mut draw),
        integrate: !draw.one_in(5),
        kinematic: false,
        pair_friction: false,
        warm_start: false,
        impulses_out: false,
        streamed_masses: false,
        in_order: false,
        numbers: [
            (1.0_f32 / 60.0).to_bits(),
            draw.number(0.02).abs().to_bits(),
            draw.number(1.0).abs().to_bits(),
            draw.number(1.0).abs().to_bits(),
            (1.0 - draw.number(0.1).abs()).to_bits(),
            SPIN_DAMPING.to_bits(),
        ],
        gravity: [draw.number(1.0).to_bits(), (-9.8_f32).to_bits(), draw.component(1.0)],
    };
    let mut shapes: Vec<Shape> = vec![draw.shape(true), draw.shape(false)];
    for _ in 0..draw.below(5) {
        let moves = !draw.one_in(4);
        shapes.push(draw.shape(moves));
    }
    let bodies = if draw.one_in(10) { 1 + draw.below(3) } else { 2 + draw.below(40) };
    let shape_count = u32::try_from(shapes.len()).unwrap_or(1);
    let mut scene =
        Scene { variant, shapes, bodies: Vec::new(), collisions: Vec::new(), arguments };
    scene.bodies = (0..bodies).map(|_| draw.body(shape_count)).collect();
    // One body at least moves, and a collision needs a second one.
    scene.bodies[0].shape = 0;
    if bodies > 1 && !draw.one_in(10) {
        let collisions = 1 + draw.below(60);
        scene.collisions = (0..collisions).map(|_| draw.collision(&scene)).collect();
    }
    let mut case = Case { scene, fault: None };
    if draw.one_in(6) {
        draw.spoil(&mut case);
    }
    // The draws above stay as they are.
    if draw.one_in(2) {
        let share = if draw.one_in(3) { 0.0 } else { draw.number(1.0).abs() };
        let [.., spin_damping] = &mut case.scene.arguments.numbers;
        *spin_damping = share.to_bits();
    }
    case.scene.arguments.kinematic = draw.one_in(2);
    if draw.one_in(2) {
        case.scene.arguments.pair_friction = true;
        for collision in &mut case.scene.collisions {
            // A binary16 number below 2, often a subnormal one.
            let friction = draw.below(1 << 14) >> if draw.one_in(4) { 5 } else { 0 };
            collision.count |= friction << FRICTION_SHIFT;
        }
    }
    if draw.one_in(2) {
        draw.warm(&mut case);
    }
    case.scene.arguments.impulses_out = draw.one_in(2);
    if draw.one_in(12) {
        // So light that J is 0.
        case.scene.shapes[0].inverse_mass = f32::MAX.to_bits();
    }
    if variant.inertia == Inertia::World {
        draw.world(&mut case.scene);
    }
    case.scene.arguments.in_order = draw.one_in(3);
    // More than a queue holds: some collisions over and over, which meet hazards.
    if draw.one_in(4) {
        let collisions = &mut case.scene.collisions;
        let few = u32::try_from(collisions.len()).unwrap_or(0);
        for _ in 0..if few > 0 { draw.below(2 * QUEUED_MOST) } else { 0 } {
            collisions.push(collisions[draw.below(few) as usize]);
        }
    }
    case
}

#[cfg(test)]
mod tests {
    use super::*;
    use pgs_interface::profile::FLOAT;

    const WORLD: Variant = Variant { inertia: Inertia::World, ..FLOAT.default_variant() };
    const FORMS: [Variant; 2] = [FLOAT.default_variant(), WORLD];

    #[test]
    fn a_seed_gives_the_same_case_and_another_one_another() {
        for variant in FORMS {
            assert_eq!(case(7, variant).scene, case(7, variant).scene);
            assert_ne!(case(7, variant).scene, case(8, variant).scene);
        }
    }

    #[test]
    fn every_kind_comes_up() {
        for variant in FORMS {
            let cases: Vec<Case> = (0..400).map(|seed| case(seed, variant)).collect();
            assert!(cases.iter().all(|case| case.scene.variant == variant));
            assert!(cases.iter().any(|case| case.fault.is_some()));
            assert!(cases.iter().any(|case| case.scene.collisions.is_empty()));
            assert!(cases.iter().any(|case| case.scene.bodies.len() == 1));
            for warm in [false, true] {
                for out in [false, true] {
                    let has = |case: &Case| {
                        let arguments = &case.scene.arguments;
                        (arguments.warm_start, arguments.impulses_out) == (warm, out)
                    };
                    assert!(cases.iter().any(|case| has(case) && case.fault.is_none()));
                    assert!(cases.iter().any(|case| has(case) && case.fault.is_some()));
                }
            }
            let queued = |case: &Case| !case.scene.arguments.in_order;
            assert!(cases.iter().any(|case| queued(case) && case.scene.collisions.len() > 128));
            assert!(cases.iter().any(|case| !queued(case) && case.scene.collisions.len() > 128));
            for count in 0..=5 {
                let has =
                    |collision: &Collision| (collision.count & !FRICTION_BITS).min(5) == count;
                assert!(cases.iter().any(|case| case.scene.collisions.iter().any(has)), "{count}");
            }
        }
    }

    #[test]
    fn masses_are_streamed_with_world_inertia_alone() {
        let streams = |variant| {
            let streamed = |seed| case(seed, variant).scene.arguments.streamed_masses;
            (0..400).filter(|seed| streamed(*seed)).count()
        };
        assert_eq!(streams(FORMS[0]), 0);
        assert!((200..350).contains(&streams(WORLD)));
    }
}
