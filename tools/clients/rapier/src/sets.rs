//! Rapier's sets of a world, and measures of them.

use rapier3d::parry::query::contact;
use rapier3d::prelude::*;

/// The time step of every scene, s.
pub(crate) const TIME_STEP: f32 = 1.0 / 60.0;
/// Gravity, m/s².
pub(crate) const GRAVITY: Vector = Vector::new(0.0, -9.81, 0.0);

/// The bodies of a world, and the memory of its collision detection.
pub(crate) struct Sets {
    pub(crate) bodies: RigidBodySet,
    pub(crate) colliders: ColliderSet,
    pub(crate) islands: IslandManager,
    pub(crate) broad_phase: BroadPhaseBvh,
    pub(crate) narrow_phase: NarrowPhase,
}

impl Sets {
    pub(crate) fn new() -> Self {
        Self {
            bodies: RigidBodySet::new(),
            colliders: ColliderSet::new(),
            islands: IslandManager::new(),
            broad_phase: BroadPhaseBvh::new(),
            narrow_phase: NarrowPhase::new(),
        }
    }

    /// Adds a body. The friction of a pair is the product of both, as in Bullet.
    fn add(
        &mut self,
        body: RigidBodyBuilder,
        collider: ColliderBuilder,
        friction: f32,
    ) -> RigidBodyHandle {
        let handle = self.bodies.insert(body);
        let collider =
            collider.friction(friction).friction_combine_rule(CoefficientCombineRule::Multiply);
        self.colliders.insert_with_parent(collider, handle, &mut self.bodies);
        handle
    }

    /// Adds a fixed box.
    pub(crate) fn add_fixed(&mut self, half_edges: Vector, pose: Pose, friction: f32) {
        let collider = ColliderBuilder::cuboid(half_edges.x, half_edges.y, half_edges.z);
        self.add(RigidBodyBuilder::fixed().pose(pose), collider, friction);
    }

    /// Adds a ground, whose surface is the plane y = 0.
    pub(crate) fn add_ground(&mut self) {
        let below = Pose::from_translation(Vector::new(0.0, -10.0, 0.0));
        self.add_fixed(Vector::new(200.0, 10.0, 200.0), below, 0.5);
    }

    /// Adds a cube of 1 m and 1 kg that never sleeps.
    pub(crate) fn add_cube(&mut self, pose: Pose, friction: f32) -> RigidBodyHandle {
        let body = RigidBodyBuilder::dynamic().can_sleep(false).pose(pose);
        self.add(body, ColliderBuilder::cuboid(0.5, 0.5, 0.5).density(1.0), friction)
    }

    /// The place of a body.
    pub(crate) fn place(&self, body: RigidBodyHandle) -> Vector {
        self.bodies.get(body).map_or(Vector::ZERO, |body| body.translation())
    }

    /// The kinetic energy of all bodies, J. `gravity_ahead` is the speed that gravity has added for
    /// the next step already, m/s.
    pub(crate) fn kinetic_energy(&self, gravity_ahead: Vector) -> f64 {
        let moving = self.bodies.iter().filter(|(_, body)| body.is_dynamic());
        let energies = moving.map(|(_, body)| {
            let (ahead, speed) = (body.linvel(), body.linvel() - gravity_ahead);
            let correction = 0.5 * body.mass() * (speed.length_squared() - ahead.length_squared());
            f64::from(body.kinetic_energy() + correction)
        });
        energies.fold(0.0, |sum, energy| sum + energy)
    }

    /// The deepest penetration of two bodies where they are now, mm. Rapier's manifolds would not
    /// do: it keeps the distances of contacts that have moved little.
    pub(crate) fn deepest(&self) -> f64 {
        let depths = self.narrow_phase.contact_pairs().map(|pair| {
            let colliders = [pair.collider1, pair.collider2].map(|at| self.colliders.get(at));
            let [Some(a), Some(b)] = colliders else { return 0.0 };
            let [place_a, place_b] = [a, b].map(|collider| self.place_of(collider));
            let found = contact(&place_a, a.shape(), &place_b, b.shape(), 0.0);
            found.ok().flatten().map_or(0.0, |contact| -contact.dist)
        });
        1e3 * f64::from(depths.fold(0.0, f32::max))
    }

    /// The place of a collider by the pose of its body, which it follows at the next step.
    fn place_of(&self, collider: &Collider) -> Pose {
        let body = collider.parent().and_then(|handle| self.bodies.get(handle));
        match (body, collider.position_wrt_parent()) {
            (Some(body), Some(part)) => *body.position() * *part,
            _ => *collider.position(),
        }
    }
}
