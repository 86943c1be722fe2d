//! The equations on binary16 give the model's bits: each pass and the integration, operation by
//! operation in integer arithmetic, on random steps.

use std::collections::HashMap;

use bitstream_model::reference::{self, Body, Collision, Parameters};
use pgs_interface::number::Precision;
use pgs_interface::profile::Inertia;
use pgs_interface::profile::solver::{ROTATION_LIMIT, SERIES_TERM};
use pgs_support::random::SplitMix64;
use rtlgen::equations;
use rtlgen::graph::{Graph, Kind, NodeId, Operand, Operation};
use rustc_apfloat::ieee::{Double, Half, Single};
use rustc_apfloat::{Float as _, FloatConvert as _};

const SIGN: u32 = 0x8000;
const ONE: u32 = 0x3C00;

/// Values of ports, the first in front.
type Ports = HashMap<String, Vec<u32>>;

fn half(value: f32) -> u32 {
    bits(Single::from_bits(value.to_bits().into()).convert(&mut false).value)
}

fn bits(number: Half) -> u32 {
    if number.is_nan() { 0x7E00 } else { (number.to_bits() & 0xFFFF) as u32 }
}

fn number(bits: u32) -> Half {
    Half::from_bits(bits.into())
}

fn float(bits: u32) -> f32 {
    let wide: Single = number(bits).convert(&mut false).value;
    f32::from_bits((wide.to_bits() & 0xFFFF_FFFF) as u32)
}

/// A root in binary64, whose second rounding never meets a tie.
fn root(a: u32) -> u32 {
    let root = f64::from(float(a)).sqrt();
    bits(Double::from_bits(root.to_bits().into()).convert(&mut false).value)
}

/// An operation on the bits of its operands.
fn operate(operation: Operation, [a, b, c, d]: [u32; 4]) -> u32 {
    use Operation::{
        Add, And, Divide, Less, Maximum, MaximumOr, Minimum, MinimumOr, Multiply, NonZero, Or,
        Select, SineCosine, SquareRoot,
    };
    let maximum = |a, b| if number(a) > number(b) { a } else { b };
    let minimum = |a, b| if number(a) < number(b) { a } else { b };
    match operation {
        Add => bits((number(a) + number(b)).value),
        Multiply => bits((number(a) * number(b)).value),
        Divide => bits((number(a) / number(b)).value),
        SquareRoot => root(a),
        SineCosine => half(libm::cosf(float(a))) << 16 | half(libm::sinf(float(a))),
        Maximum => maximum(a, b),
        Minimum => minimum(a, b),
        Less => (number(a) < number(b)).into(),
        Select => {
            if a == 1 {
                b
            } else {
                c
            }
        }
        NonZero => (a == 1 && !number(b).is_zero()).into(),
        Or => a | b,
        And => a & b,
        MaximumOr => {
            if a == 1 {
                maximum(b, c)
            } else {
                d
            }
        }
        MinimumOr => {
            if a == 1 {
                minimum(b, c)
            } else {
                d
            }
        }
    }
}

/// The outputs of a graph.
fn evaluate(graph: &Graph, inputs: &Ports) -> Ports {
    let mut values: HashMap<NodeId, u32> = HashMap::new();
    for input in graph.inputs() {
        let given = inputs.get(&input.name).unwrap_or_else(|| panic!("no {}", input.name));
        assert_eq!(given.len(), input.nodes.len(), "{}", input.name);
        values.extend(input.nodes.iter().copied().zip(given.iter().copied()));
    }
    let read = |values: &HashMap<NodeId, u32>, operand: &Operand| {
        if operand.gate.is_some_and(|gate| values[&gate] == 0) {
            return SIGN;
        }
        let value = values[&operand.node];
        let value = match (graph.node(operand.node).kind.is_pair(), operand.upper) {
            (true, false) => value & 0xFFFF,
            (true, true) => value >> 16,
            _ => value,
        };
        if operand.negated { value ^ SIGN } else { value }
    };
    for id in graph.ids() {
        let node = graph.node(id);
        let value = match node.kind {
            Kind::Input(_) => continue,
            Kind::Constant(bits) => bits,
            Kind::Operation(operation) => {
                let mut operands = [0; 4];
                for (operand, slot) in node.operands.iter().zip(&mut operands) {
                    *slot = read(&values, operand);
                }
                operate(operation, operands)
            }
        };
        values.insert(id, value);
    }
    let outputs = graph.outputs().iter();
    outputs
        .map(|output| {
            let values = output.operands.iter().map(|operand| read(&values, operand)).collect();
            (output.name.clone(), values)
        })
        .collect()
}

/// A step as the accelerator takes it, on its words.
struct Step<'a> {
    parameters: &'a Parameters,
    masses: Vec<[u32; 2]>,
    velocities: Vec<[Vec<u32>; 2]>,
}

fn words(numbers: &[f32]) -> Vec<u32> {
    numbers.iter().copied().map(half).collect()
}

impl Step<'_> {
    /// A pass over a collision; the sum of its normal impulses after a contact pass.
    fn pass(
        &mut self,
        graph: &Graph,
        bodies: &[Body],
        collision: &Collision,
        impulses: &mut [u32; 4],
    ) -> u32 {
        let Collision { bodies: sides, normal, contacts, count } = collision;
        let parameters = self.parameters;
        let mut ports: Ports = HashMap::new();
        let mut set = |name: &str, values: &[u32]| ports.insert(name.into(), values.into());
        set("solves", &[1]);
        set("normal", &words(normal));
        for (name, side) in ["a", "b"].into_iter().zip(sides) {
            let [mass, inertia] = self.masses[*side];
            set(&format!("position_{name}"), &words(&bodies[*side].position));
            set(&format!("inverse_mass_{name}"), &[mass]);
            set(&format!("inverse_inertia_{name}"), &[inertia]);
            set(&format!("linear_{name}"), &self.velocities[*side][0]);
            set(&format!("angular_{name}"), &self.velocities[*side][1]);
        }
        let dt = number(half(parameters.time_step));
        set("per_second", &[bits((number(ONE) / dt).value)]);
        set("drift", &[half(parameters.position_drift)]);
        set("coefficient", &[half(parameters.position_coefficient)]);
        set("coefficient_of_friction", &[half(parameters.friction)]);
        set("spin_damping", &[half(parameters.spin_damping)]);
        set("per_count", &[bits((number(ONE) / number(half(*count as f32))).value)]);
        set("one_static", &[sides.iter().any(|side| self.masses[*side][0] & !SIGN == 0).into()]);
        for (i, contact) in contacts.iter().enumerate() {
            set(&format!("point{i}"), &words(&contact[..3]));
            set(&format!("distance{i}"), &[half(contact[3])]);
            set(&format!("used{i}"), &[(i < *count).into()]);
            set(&format!("impulse{i}"), &[impulses[i]]);
        }
        let outputs = evaluate(graph, &ports);
        for (name, side) in ["a", "b"].into_iter().zip(sides) {
            if bodies[*side].inverse_mass != 0.0 {
                let of = |part: &str| outputs[&format!("{part}_{name}")].clone();
                self.velocities[*side] = [of("linear"), of("angular")];
            }
        }
        for (i, impulse) in impulses.iter_mut().enumerate() {
            if let Some(output) = outputs.get(&format!("impulse{i}")) {
                *impulse = output[0];
            }
        }
        outputs.get("total").map_or(0, |total| total[0])
    }

    fn integrated(&self, graph: &Graph, body: &Body, velocity: &[Vec<u32>; 2]) -> Body {
        let parameters = self.parameters;
        let times = |a: Half, b: Half| (a * b).value;
        let dt = number(half(parameters.time_step));
        let of = |value: f32| number(half(value));
        let mut ports: Ports = HashMap::new();
        let mut set = |name: &str, values: &[u32]| ports.insert(name.into(), values.into());
        set("position", &words(&body.position));
        set("orientation", &words(&body.orientation));
        set("linear", &velocity[0]);
        set("angular", &velocity[1]);
        set("damping", &[half(parameters.angular_damping)]);
        set("integrates", &[1]);
        set("free", &[1]);
        set("time_step", &[bits(dt)]);
        set("half_step", &[bits(times(of(0.5), dt))]);
        set("series", &[bits(times(times(times(dt, dt), dt), of(SERIES_TERM)))]);
        set("speed_limit", &[bits((of(ROTATION_LIMIT) / dt).value)]);
        let falls = parameters.gravity.map(|g| bits(times(of(g), dt)));
        set("gravity_step", &falls);
        let outputs = evaluate(graph, &ports);
        let vector = |name: &str| [0, 1, 2].map(|axis| float(outputs[name][axis]));
        Body {
            position: vector("position"),
            orientation: [0, 1, 2, 3].map(|part| float(outputs["orientation"][part])),
            linear: vector("linear"),
            angular: vector("angular"),
            ..*body
        }
    }
}

/// A number of any size up to a power of two.
fn random(random: &mut SplitMix64, largest: f32) -> f32 {
    let fraction = random.between(0, 2_000_000) as f32 / 1e6 - 1.0;
    let smaller = random.pick(&[1.0, 1.0, 1.0, 1.0, 0.1, 0.01, 1e-3, 1e-5, 0.0]);
    fraction * smaller * largest
}

fn vector(source: &mut SplitMix64, largest: f32) -> [f32; 3] {
    [0; 3].map(|_| random(source, largest))
}

fn unit(source: &mut SplitMix64) -> [f32; 4] {
    let v = [0; 4].map(|_| random(source, 1.0) + 1e-3);
    let length = v.iter().map(|part| part * part).sum::<f32>().sqrt();
    v.map(|part| part / length)
}

fn scene(source: &mut SplitMix64) -> (Vec<Body>, Vec<Collision>, Parameters) {
    let wild = source.pick(&[1.0, 1.0, 100.0]);
    let bodies: Vec<Body> = (0..8)
        .map(|_| Body {
            inverse_mass: source.pick(&[0.0, 1.0, 0.3, 1e-6, 1e-9, 12.5]),
            inverse_inertia: source.pick(&[0.0, 1.0, 6.0, 0.02, 1e4]),
            position: vector(source, 10.0),
            orientation: unit(source),
            linear: vector(source, 8.0 * wild),
            angular: vector(source, 8.0 * wild),
        })
        .collect();
    let collisions = (0..12).filter_map(|_| {
        let [a, b] = [0; 2].map(|_| source.below(bodies.len()));
        let moves = [a, b].iter().any(|side| bodies[*side].inverse_mass != 0.0);
        let mut contacts = [[0.0; 4]; 4];
        for contact in &mut contacts {
            let near = vector(source, 0.5 * wild);
            let point = [0, 1, 2].map(|axis| bodies[a].position[axis] + near[axis]);
            *contact = [point[0], point[1], point[2], random(source, 0.05)];
        }
        let [x, y, z, _] = unit(source);
        let normal = source.pick(&[[x, y, z], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]);
        let count = source.between(1, 4) as usize;
        let collision = Collision { bodies: [a, b], normal, contacts, count };
        (a != b && moves).then_some(collision)
    });
    let collisions = collisions.collect();
    let parameters = Parameters {
        contact_iterations: 2,
        friction_iterations: 2,
        time_step: source.pick(&[1.0 / 60.0, 0.01, 0.5, 1e-4, 20.0]),
        position_drift: 0.005,
        position_coefficient: 0.2,
        friction: source.pick(&[0.7, 0.0, 1e-5]),
        spin_damping: 0.1,
        angular_damping: 0.98,
        gravity: [0.0, -9.8, 1e-4],
    };
    (bodies, collisions, parameters)
}

fn same(found: &Body, expected: &Body) -> bool {
    let numbers = |body: &Body| {
        let Body { position, orientation, linear, angular, .. } = body;
        [&position[..], orientation, linear, angular].concat()
    };
    let mut pairs = numbers(found).into_iter().zip(numbers(expected));
    pairs.all(|(a, b)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan())
}

#[test]
fn the_equations_in_binary16_give_the_models_bits() {
    let precision = Precision::Binary16;
    let contact = equations::contact(precision, 4, Inertia::Isotropic);
    let friction = equations::friction(precision, Inertia::Isotropic);
    let integration = equations::integration(precision);
    let mut source = SplitMix64::new(16);
    let (mut numbers, mut infinite) = (0, 0);
    for scene_number in 0..400 {
        let (bodies, collisions, parameters) = scene(&mut source);
        let mut step = Step {
            parameters: &parameters,
            masses: bodies
                .iter()
                .map(|body| [body.inverse_mass, body.inverse_inertia].map(half))
                .collect(),
            velocities: bodies
                .iter()
                .map(|body| match body.inverse_mass {
                    0.0 => [vec![0; 3], vec![0; 3]],
                    _ => [words(&body.linear), words(&body.angular)],
                })
                .collect(),
        };
        let mut impulses = vec![[0; 4]; collisions.len()];
        for (pass, graph) in [&contact, &contact, &friction, &friction].into_iter().enumerate() {
            for (collision, impulses) in collisions.iter().zip(&mut impulses) {
                let total = step.pass(graph, &bodies, collision, impulses);
                if pass == 1 {
                    *impulses = [total, 0, 0, 0];
                }
            }
        }
        let mut expected = bodies.clone();
        reference::step(precision, &mut expected, &collisions, &parameters);
        for (index, (body, expected)) in bodies.iter().zip(&expected).enumerate() {
            if body.inverse_mass == 0.0 {
                continue;
            }
            let found = step.integrated(&integration, body, &step.velocities[index]);
            assert!(same(&found, expected), "scene {scene_number}: {found:?}, not {expected:?}");
            numbers += 1;
            infinite += u32::from(found.linear.iter().any(|number| !number.is_finite()));
        }
    }
    assert!(numbers > 2_000 && infinite > 20 && infinite < numbers / 2, "{numbers}, {infinite}");
}
