//! The board as the solver of a Rapier world: contacts go in, velocities and poses come out.

use std::collections::HashMap;

use rapier3d::prelude::*;
use zynq_pgs::{
    Accelerator, Body, Collision, Contact, LastStep, OpenOptions, Place, StepParameters, StepReport,
};

use crate::reduce::{Point, reduced};
use crate::sets::{GRAVITY, Sets, TIME_STEP};

/// The share of the last step's impulses that a step begins with.
const KEPT_IMPULSES: f32 = 0.85;
/// A contact that has moved by more in a step is a new one, m.
const REACH: f32 = 0.05;
/// The share of the penetration that goes in a step, and the largest speed that it takes, m/s.
const PENETRATION_SHARE: f32 = 0.2;
const PENETRATION_SPEED: f32 = 3.0;
/// The distance at which Rapier finds contacts ahead, m.
const PREDICTION: f32 = 0.02;
/// The board applies the friction of a collision at the centre of its points. Two points at one
/// edge give a face friction at two places, which resists a twist.
const POINTS: usize = 2;
/// A pass favours its last collisions, and a tower would lean to one side.
const REVERSE_EVERY: u32 = 3;

/// A collision in every step: two colliders, one of their manifolds, one of its groups of points.
type Part = (ColliderHandle, ColliderHandle, usize, usize);

/// An accelerator, and the bodies of a world in its layout.
pub(crate) struct Board {
    accelerator: Accelerator,
    parameters: StepParameters,
    detection: CollisionPipeline,
    bodies: Vec<Body>,
    /// Parallel to `bodies`.
    handles: Vec<RigidBodyHandle>,
    index: HashMap<RigidBodyHandle, u32>,
    collisions: Vec<Collision>,
    /// Parallel to `collisions`.
    parts: Vec<Part>,
    last: LastStep,
    /// The collisions of the last step, and their numbers.
    before: Vec<Collision>,
    numbers: HashMap<Part, u32>,
    steps: u32,
    report: Option<StepReport>,
}

impl Board {
    /// Opens a board for a world, whose bodies are all there.
    pub(crate) fn open(
        options: OpenOptions,
        passes: u32,
        sets: &Sets,
    ) -> Result<Self, zynq_pgs::Error> {
        let mut accelerator = Accelerator::open(options)?;
        let parameters = StepParameters::default()
            .with_time_step(TIME_STEP)
            // With these two the distance of a point is the speed at which it may close.
            .with_position_drift(0.0)
            .with_position_coefficient(TIME_STEP)
            .with_angular_damping(1.0)
            .with_spin_damping(0.0)
            .with_gravity(GRAVITY.to_array())
            .with_contact_iterations(passes)
            .with_friction_iterations(passes)
            .with_pair_friction(true)
            .with_integrate(true)
            .with_warm_start(true)
            .with_impulses_out(true);
        let (mut shapes, mut bodies) = (vec![zynq_pgs::Shape::STATIC], Vec::new());
        let (mut handles, mut index) = (Vec::new(), HashMap::new());
        for (at, (handle, body)) in (0..).zip(sets.bodies.iter()) {
            let shape = shape_of(body);
            let known = shapes.iter().position(|known| *known == shape);
            let place = known.unwrap_or_else(|| {
                shapes.push(shape);
                shapes.len() - 1
            });
            handles.push(handle);
            index.insert(handle, at);
            // A board without streamed masses refuses more shapes than its table has.
            let shape = u32::try_from(place).unwrap_or(u32::MAX);
            bodies.push(Body { shape, ..placed(body) });
        }
        accelerator.set_shapes(&shapes)?;
        Ok(Self {
            accelerator,
            parameters,
            detection: CollisionPipeline::new(),
            bodies,
            handles,
            index,
            collisions: Vec::new(),
            parts: Vec::new(),
            last: LastStep::default(),
            before: Vec::new(),
            numbers: HashMap::new(),
            steps: 0,
            report: None,
        })
    }

    /// The report of the last step.
    pub(crate) fn report(&self) -> Option<&StepReport> {
        self.report.as_ref()
    }

    /// Takes one step: Rapier finds the contacts, the board solves and integrates.
    pub(crate) fn step(&mut self, sets: &mut Sets) -> Result<(), zynq_pgs::Error> {
        self.detection.step(
            PREDICTION,
            &mut sets.islands,
            &mut sets.broad_phase,
            &mut sets.narrow_phase,
            &mut sets.bodies,
            &mut sets.colliders,
            &(),
            &(),
        );
        self.gather(sets);
        self.steps += 1;
        if self.steps.is_multiple_of(REVERSE_EVERY) {
            self.collisions.reverse();
            self.parts.reverse();
        }
        let places = self.places();
        let placed = self.last.placed(&self.collisions, &places, KEPT_IMPULSES)?;
        let report = self.accelerator.step(&mut self.bodies, &placed, &self.parameters)?;
        self.report = Some(report);
        self.last.commit(&self.collisions, self.accelerator.impulses())?;
        std::mem::swap(&mut self.before, &mut self.collisions);
        self.numbers = self.parts.iter().copied().zip(0..).collect();
        self.scatter(sets);
        Ok(())
    }

    /// The place of each collision in the last step.
    fn places(&self) -> Vec<Place> {
        let place = |(new, part): (&Collision, &Part)| {
            let number = *self.numbers.get(part)?;
            let old = self.before.get(number as usize)?;
            Some(Place::nearest(number, old, new, REACH))
        };
        let all = self.collisions.iter().zip(&self.parts);
        all.map(|both| place(both).unwrap_or(Place::NEW)).collect()
    }

    /// Makes the collisions of the step.
    fn gather(&mut self, sets: &Sets) {
        self.collisions.clear();
        self.parts.clear();
        for pair in sets.narrow_phase.contact_pairs() {
            // Rapier's normal points from its first body to its second, the board's from B to A.
            let colliders = [pair.collider1, pair.collider2].map(|at| sets.colliders.get(at));
            let [Some(of_b), Some(of_a)] = colliders else { continue };
            let index_of = |collider: &Collider| {
                collider.parent().and_then(|handle| self.index.get(&handle).copied())
            };
            let (Some(body_b), Some(body_a)) = (index_of(of_b), index_of(of_a)) else { continue };
            for (number, manifold) in pair.manifolds().iter().enumerate() {
                let place = match manifold.subshape_pos1() {
                    Some(part) => *of_b.position() * *part,
                    None => *of_b.position(),
                };
                let points = manifold
                    .points
                    .iter()
                    .map(|point| Point { place: place * point.local_p1, distance: point.dist });
                let normal = manifold.data.normal.to_array();
                for (group, some) in reduced(points.collect()).chunks(POINTS).enumerate() {
                    let mut contacts = [Contact::default(); 4];
                    for (to, from) in contacts.iter_mut().zip(some) {
                        let (point, distance) =
                            (from.place.to_array(), closing_speed(from.distance));
                        *to = Contact { point, distance };
                    }
                    let count = some.len() as u32;
                    let collision = Collision { body_a, body_b, normal, count, contacts };
                    self.collisions.push(collision.with_friction(manifold.data.friction));
                    self.parts.push((pair.collider1, pair.collider2, number, group));
                }
            }
        }
    }

    /// Gives the bodies of the world their new poses and velocities.
    fn scatter(&self, sets: &mut Sets) {
        for (handle, body) in self.handles.iter().zip(&self.bodies) {
            let Some(to) = sets.bodies.get_mut(*handle).filter(|to| to.is_dynamic()) else {
                continue;
            };
            let turn = Rotation::from_array(body.pose.orientation) * inertia_frame(to).inverse();
            let centre = Vector::from_array(body.pose.position);
            let origin = centre - turn * to.mass_properties().local_mprops.local_com;
            to.set_position(Pose::from_parts(origin, turn), false);
            to.set_linvel(Vector::from_array(body.velocity.linear), false);
            to.set_angvel(Vector::from_array(body.velocity.angular), false);
        }
    }
}

/// The speed at which a point may close, m/s. Below 0 the bodies must part. A gap closes within the
/// step at most.
fn closing_speed(distance: f32) -> f32 {
    let speed = distance / TIME_STEP;
    if distance > 0.0 { speed } else { (speed * PENETRATION_SHARE).max(-PENETRATION_SPEED) }
}

/// The turn from a body's own axes to the axes of its inertia.
fn inertia_frame(body: &RigidBody) -> Rotation {
    body.mass_properties().local_mprops.principal_inertia_local_frame
}

fn shape_of(body: &RigidBody) -> zynq_pgs::Shape {
    if !body.is_dynamic() {
        return zynq_pgs::Shape::STATIC;
    }
    let properties = &body.mass_properties().local_mprops;
    let inverse_inertia = properties.inv_principal_inertia.to_array();
    zynq_pgs::Shape { inverse_inertia, ..zynq_pgs::Shape::isotropic(properties.inv_mass, 0.0) }
}

/// A body of shape 0 where a body of Rapier is. Its axes are the axes of its inertia.
fn placed(body: &RigidBody) -> Body {
    let turn = *body.rotation() * inertia_frame(body);
    let pose =
        zynq_pgs::Pose { position: body.center_of_mass().to_array(), orientation: turn.to_array() };
    let (linear, angular) = (body.linvel().to_array(), body.angvel().to_array());
    Body { pose, velocity: zynq_pgs::Velocity { linear, angular }, shape: 0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::World;

    #[test]
    fn penetration_goes_by_its_share_and_a_gap_closes_in_one_step() {
        assert!((closing_speed(0.01) - 0.6).abs() < 1e-6);
        assert!((closing_speed(-0.01) + 0.12).abs() < 1e-6);
        assert_eq!(closing_speed(-1.0).to_bits(), (-PENETRATION_SPEED).to_bits());
    }

    /// The place of a brick after its fall on an edge. Its collider is turned and moved by `part`
    /// against the body, and the body the other way.
    fn fallen(part: Pose) -> Result<Pose, zynq_pgs::Error> {
        let choice = "emulated:float,world".parse().unwrap_or_default();
        let options = OpenOptions { board: choice, ..OpenOptions::default() };
        let mut world = World::of_board(options, 10);
        world.sets.add_ground();
        let start = Pose::from_parts(Vector::new(0.0, 1.5, 0.0), Rotation::from_rotation_x(0.5));
        let body = RigidBodyBuilder::dynamic().can_sleep(false).pose(start * part.inverse());
        let collider = ColliderBuilder::cuboid(0.25, 0.5, 1.0).position(part);
        let handle = world.sets.bodies.insert(body);
        world.sets.colliders.insert_with_parent(collider, handle, &mut world.sets.bodies);
        world.step(45)?;
        let body = world.sets.bodies.get(handle).map_or(Pose::IDENTITY, |body| *body.position());
        Ok(body * part)
    }

    #[test]
    fn a_body_may_have_its_centre_and_its_axes_of_inertia_elsewhere() -> Result<(), zynq_pgs::Error>
    {
        let straight = fallen(Pose::IDENTITY)?;
        let turn = Rotation::from_rotation_z(1.0) * Rotation::from_rotation_x(0.7);
        let turned = fallen(Pose::from_parts(Vector::new(0.5, -0.25, 1.0), turn))?;
        let apart = (straight.translation - turned.translation).length();
        assert!(apart < 5e-3, "{straight:?} and {turned:?}");
        let upright = |pose: Pose| pose.rotation * Vector::Y;
        let angle = upright(straight).dot(upright(turned));
        assert!(angle > 0.9999, "{straight:?} and {turned:?}");
        assert!(upright(straight).y > 0.95, "it lies on its face: {straight:?}");
        Ok(())
    }
}
