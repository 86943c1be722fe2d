//! A step's input and output as plain numbers.

use bitstream_model::BoardConfig;
use pgs_interface::control::{self, flags};
use pgs_interface::profile::{FLOAT, Variant};
use pgs_interface::record::Beat;

use super::Host;
use super::packing;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Body {
    pub(crate) shape: u32,
    pub(crate) position: [f32; 3],
    pub(crate) orientation: [f32; 4],
    pub(crate) linear: [f32; 3],
    pub(crate) angular: [f32; 3],
}

/// Unturned, at rest, at the origin.
pub(crate) const AT_REST: Body = Body {
    shape: MOVING,
    position: [0.0; 3],
    orientation: [0.0, 0.0, 0.0, 1.0],
    linear: [0.0; 3],
    angular: [0.0; 3],
};

#[derive(Debug, Clone, Copy)]
pub(crate) struct Collision {
    pub(crate) bodies: [u32; 2],
    pub(crate) count: u32,
    pub(crate) normal: [f32; 3],
    pub(crate) positions: [[f32; 3]; 2],
    /// x, y, z, distance.
    pub(crate) contacts: [[f32; 4]; 4],
}

/// The static entry of [`Step::shapes`].
pub(crate) const STATIC: u32 = 0;
/// The entry of a point mass of 1 kg.
pub(crate) const MOVING: u32 = 1;

#[derive(Debug, Clone)]
pub(crate) struct Step {
    /// Inverse mass, inverse inertia.
    pub(crate) shapes: Vec<[f32; 2]>,
    /// World inverse inertia of each body (xx, yy, zz, xy, xz, yz); its shape's if the list is
    /// shorter.
    pub(crate) inertias: Vec<[f32; 6]>,
    pub(crate) bodies: Vec<Body>,
    pub(crate) collisions: Vec<Collision>,
    /// The friction of each collision; without any, all have that of the step.
    pub(crate) frictions: Vec<f32>,
    /// The impulses of each collision, normal and of friction, that a warm start begins with;
    /// without any there is none.
    pub(crate) impulses: Vec<[[f32; 4]; 2]>,
    pub(crate) impulses_out: bool,
    /// Whether it passes by an issue queue.
    pub(crate) in_order: bool,
    /// The inverse mass that each body brings with its world inertia; without any, all have their
    /// shape's.
    pub(crate) masses: Vec<f32>,
    /// Contact and friction passes.
    pub(crate) iterations: [u32; 2],
    pub(crate) integrate: bool,
    pub(crate) time_step: f32,
    pub(crate) drift: f32,
    pub(crate) coefficient: f32,
    pub(crate) friction: f32,
    pub(crate) damping: f32,
    pub(crate) gravity: [f32; 3],
}

impl Step {
    /// Half a second with gravity 8 m/s², so that small numbers stay exact; no bias.
    pub(crate) fn new(bodies: Vec<Body>, collisions: Vec<Collision>) -> Self {
        Self {
            shapes: vec![[0.0, 0.0], [1.0, 0.0]],
            inertias: Vec::new(),
            bodies,
            collisions,
            frictions: Vec::new(),
            impulses: Vec::new(),
            impulses_out: false,
            in_order: false,
            masses: Vec::new(),
            iterations: [4, 4],
            integrate: true,
            time_step: 0.5,
            drift: 0.0,
            coefficient: 0.0,
            friction: 0.5,
            damping: 1.0,
            gravity: [0.0, -8.0, 0.0],
        }
    }

    /// Bodies that fall, each with a state of its own.
    pub(crate) fn falling(count: u16) -> Self {
        let body = |k: u16| {
            let k = f32::from(k);
            Body { position: [k, 2.0 * k, -1.0], linear: [1.0, -k, 0.5], ..AT_REST }
        };
        Self::new((0..count).map(body).collect(), Vec::new())
    }

    /// The bodies of [`falling`](Self::falling) a step later: moved by v / 2, then 4 m/s faster
    /// downward.
    pub(crate) fn fallen(count: u16) -> Vec<Body> {
        let body = |k: u16| {
            let k = f32::from(k);
            Body {
                shape: 0,
                position: [k + 0.5, 2.0 * k - 0.5 * k, -0.75],
                linear: [1.0, -k - 4.0, 0.5],
                ..AT_REST
            }
        };
        (0..count).map(body).collect()
    }

    /// A static ground and `bodies` point masses on it, which collide with it in turn: body k in
    /// collision k - 1.
    pub(crate) fn on_ground(bodies: u16, collisions: usize) -> Self {
        let ground = Body { shape: STATIC, position: [0.0, -1.0, 0.0], ..AT_REST };
        let mass = |k: u16| Body {
            position: [f32::from(k), 1.0, 0.0],
            linear: [0.0, -1.0, 0.0],
            ..AT_REST
        };
        let all = std::iter::once(ground).chain((1..=bodies).map(mass)).collect();
        let collisions = (1..=bodies)
            .cycle()
            .take(collisions)
            .map(|k| ground_contact(k, [0.0, -1.0, 0.0]))
            .collect();
        Self::new(all, collisions)
    }

    /// Whether it goes through the issue queue of a board.
    pub(crate) fn is_queued(&self, config: &BoardConfig) -> bool {
        config.queue_depth() > 0 && !self.in_order
    }

    /// Writes the arguments and the shape table.
    pub(crate) fn write_arguments(&self, host: &Host) {
        let number = |length: usize| u32::try_from(length).expect("the tests' steps are small");
        host.set_control(control::BODIES, number(self.bodies.len()));
        host.set_control(control::COLLISIONS, number(self.collisions.len()));
        host.set_control(control::CONTACT_ITERATIONS, self.iterations[0]);
        host.set_control(control::FRICTION_ITERATIONS, self.iterations[1]);
        let word = flags::INTEGRATE.put(0, self.integrate.into());
        let word = flags::PAIR_FRICTION.put(word, (!self.frictions.is_empty()).into());
        let word = flags::WARM_START.put(word, (!self.impulses.is_empty()).into());
        let word = flags::STREAMED_MASSES.put(word, (!self.masses.is_empty()).into());
        let word = flags::IMPULSES_OUT.put(word, self.impulses_out.into());
        let word = flags::IN_ORDER.put(word, self.in_order.into());
        host.set_control(control::FLAGS, word);
        let [x, y, z] = self.gravity;
        for (register, value) in [
            (control::TIME_STEP, self.time_step),
            (control::POSITION_DRIFT, self.drift),
            (control::POSITION_COEFFICIENT, self.coefficient),
            (control::FRICTION, self.friction),
            (control::ANGULAR_DAMPING, self.damping),
            (control::GRAVITY_X, x),
            (control::GRAVITY_Y, y),
            (control::GRAVITY_Z, z),
        ] {
            host.set_control(register, value.to_bits());
        }
        for (entry, [mass, inertia]) in self.shapes.iter().enumerate() {
            let at = control::SHAPE_TABLE + number(entry) * control::SHAPE_STRIDE;
            let register = |offset| control::BODIES.moved(offset);
            host.set_control(register(at + control::SHAPE_INVERSE_MASS), mass.to_bits());
            host.set_control(register(at + control::SHAPE_INVERSE_INERTIA), inertia.to_bits());
        }
    }

    /// World inverse inertia of a body.
    pub(crate) fn world_inertia(&self, body: usize) -> [f32; 6] {
        self.inertias.get(body).copied().unwrap_or_else(|| {
            let [_, k] = self.shapes[self.bodies[body].shape as usize];
            [k, k, k, 0.0, 0.0, 0.0]
        })
    }

    /// The beats and packets on each stream of `float`.
    pub(crate) fn lanes(&self) -> Vec<Lane> {
        self.packed(&FLOAT.default_variant())
    }

    /// Sum of all words that the accelerator receives.
    pub(crate) fn sum_of_input(&self, variant: &Variant) -> u32 {
        self.packed(variant).iter().fold(0, |sum, lane| {
            lane.packets.iter().fold(sum, |sum, segment| sum_words(sum, &lane.segments[*segment]))
        })
    }
}

/// One stream: its segments, and its packets as indices of segments.
#[derive(Debug, Clone, Default)]
pub(crate) struct Lane {
    /// Velocities, collisions, poses; collisions with their normal impulses and with their friction
    /// impulses, if these have other beats.
    pub(crate) segments: [Vec<Beat>; 5],
    pub(crate) packets: Vec<usize>,
}

fn vec3(bits: [u32; 3]) -> [f32; 3] {
    bits.map(f32::from_bits)
}

/// Bullet's own cube that rests on the ground, as bits (see the golden vectors, `one_cube`).
pub(crate) fn one_cube() -> Step {
    let ground = Body { shape: STATIC, position: [0.0, -400.0, 0.0], ..AT_REST };
    let cube = Body {
        shape: MOVING,
        position: vec3([0x3E7F_E7F0, 0x3F7E_B861, 0xBF00_0431]),
        orientation: [0xB6DB_A5C8, 0x398F_D07F, 0xB6CD_DEFE, 0x3F80_0000].map(f32::from_bits),
        linear: vec3([0xB940_21DF, 0xBE27_42B5, 0x3947_72CA]),
        angular: vec3([0x3945_746A, 0x3746_D8B6, 0x393E_3619]),
    };
    let contacts = [
        [0x3F9F_FCA5, 0xBBA3_CE42, 0xBF00_F4DA, 0xBBA4_3737],
        [0xBF3F_E2DD, 0xBBA2_FB00, 0x3F00_209D, 0xBBA2_FB00],
        [0xBF40_2AC4, 0xBBA3_D680, 0xBFBF_EFB0, 0xBBA3_D680],
        [0x3FA0_0E91, 0xBBA3_C900, 0x3EFF_B16C, 0xBBA3_C900],
    ]
    .map(|contact| contact.map(f32::from_bits));
    let collision = Collision {
        bodies: [0, 1],
        count: 4,
        normal: [0.0, -1.0, 0.0],
        positions: [ground.position, cube.position],
        contacts,
    };
    Step {
        shapes: vec![[0.0, 0.0], [1.0, f32::from_bits(0x3EBC_3782)]],
        time_step: f32::from_bits(0x3C88_8889),
        drift: f32::from_bits(0x3BA3_D70A),
        coefficient: f32::from_bits(0x3E4C_CCCD),
        friction: f32::from_bits(0x3F33_3333),
        damping: f32::from_bits(0x3F7D_70A4),
        gravity: vec3([0, 0xC11C_CCCD, 0]),
        ..Step::new(vec![ground, cube], vec![collision])
    }
}

/// A contact of static body 0 with body `k`, at the middle of both, pushing along -`normal`.
pub(crate) fn ground_contact(k: u16, normal: [f32; 3]) -> Collision {
    Collision {
        bodies: [0, k.into()],
        count: 1,
        normal,
        positions: [[f32::from(k), -1.0, 0.0], [f32::from(k), 1.0, 0.0]],
        contacts: [[f32::from(k), 0.0, 0.0, 0.0]; 4],
    }
}

pub(crate) fn sum_words(sum: u32, beats: &[Beat]) -> u32 {
    beats.iter().flat_map(|beat| beat.0).fold(sum, u32::wrapping_add)
}

/// Result beats on each stream of `float`.
pub(crate) fn result_beats(bodies: usize) -> Vec<usize> {
    packing::result_beats(&FLOAT.default_variant(), bodies)
}

/// The bodies from the result beats of the streams of `float`.
pub(crate) fn unpack(streams: &[Box<[Beat]>], bodies: usize) -> Vec<Body> {
    packing::unpack(&FLOAT.default_variant(), streams, bodies)
}

/// A body as bits, for comparisons that see the sign of zero.
pub(crate) fn bits(body: &Body) -> [[u32; 4]; 4] {
    let wide = |[x, y, z]: [f32; 3]| [x.to_bits(), y.to_bits(), z.to_bits(), 0];
    [wide(body.position), body.orientation.map(f32::to_bits), wide(body.linear), wide(body.angular)]
}

/// A register somewhere else.
trait Moved {
    fn moved(self, offset: u32) -> Self;
}

impl Moved for pgs_interface::register::Register {
    fn moved(self, offset: u32) -> Self {
        Self { offset, ..self }
    }
}
