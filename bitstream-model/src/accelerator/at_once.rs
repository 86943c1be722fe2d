//! Works on all records of a phase at once, for [`fast`](crate::fast): the same functions as record
//! by record.

use super::Accelerator;
use super::arithmetic::inertia::{Inertia, Isotropic, World};
use super::arithmetic::number::{Format, Half, Single, SingleFlushed};
use super::hazards::Entry;
use super::records::decode::Collision;
use super::records::segment::{Beats, Reader};
use pgs_interface::number::Precision;
use pgs_interface::profile;
use pgs_interface::record::CONTACT_POINTS;

impl Accelerator {
    /// Forgets passes: the bodies are as they were loaded.
    pub(crate) fn forget_passes(&mut self, beats: impl Beats) {
        let segment = self.velocities_in();
        let mut reader = Reader::new(segment.array(), 0, beats);
        let loaded = self.load_bodies(0..segment.array().records, &mut reader);
        debug_assert!(loaded.is_ok(), "they were loaded before");
        self.impulses.fill([0.0; CONTACT_POINTS]);
    }

    /// The bodies of a collision and which of them move, or `None` of padding. `None` altogether if
    /// it is wrong.
    pub(crate) fn entry(&self, count: usize, bodies: [u32; 2]) -> Option<Option<Entry>> {
        match count {
            0 => Some(None),
            _ => self.checked(count, bodies).ok().map(Some),
        }
    }

    /// Reads the collisions of a pass.
    pub(crate) fn read_collisions(
        &self,
        warm: bool,
        reader: &mut Reader<'_, impl Beats>,
        to: &mut Vec<Collision>,
    ) {
        let (count, mut together) = (self.arguments.collisions as usize, Vec::new());
        while to.len() < count {
            if warm {
                self.read_warm_issue(reader, &mut together);
                to.extend(together.iter().take(count - to.len()));
            } else {
                to.push(self.collision(reader));
            }
        }
    }

    /// Computes a pass over all its collisions, which are right, in an order of their numbers.
    pub(crate) fn compute_pass(&mut self, pass: u32, collisions: &[Collision], order: &[u32]) {
        if self.config.profile.flushes_subnormals {
            self.compute_of::<SingleFlushed>(pass, collisions, order);
        } else {
            self.compute_of::<Single>(pass, collisions, order);
        }
    }

    fn compute_of<S: Format>(&mut self, pass: u32, collisions: &[Collision], order: &[u32]) {
        match (self.variant.numbers.updates, self.variant.inertia) {
            (Precision::Binary16, profile::Inertia::Isotropic) => {
                self.compute_with::<Half, Isotropic>(pass, collisions, order);
            }
            (Precision::Binary16, profile::Inertia::World) => {
                self.compute_with::<Half, World>(pass, collisions, order);
            }
            (Precision::F32, profile::Inertia::Isotropic) => {
                self.compute_with::<S, Isotropic>(pass, collisions, order);
            }
            (Precision::F32, profile::Inertia::World) => {
                self.compute_with::<S, World>(pass, collisions, order);
            }
        }
    }

    fn compute_with<F: Format, I: Inertia>(
        &mut self,
        pass: u32,
        collisions: &[Collision],
        order: &[u32],
    ) {
        for index in order.iter().map(|number| *number as usize) {
            let collision = &collisions[index];
            let (count, bodies) = collision.head();
            if count == 0 {
                continue;
            }
            let sides = bodies.map(|body| body as usize);
            let masses = sides.map(|body| self.mass_of(body));
            let mut velocities = sides.map(|body| self.velocities[body]);
            let mut impulses = self.impulses[index];
            self.compute::<F, F, I>(pass, collision, &masses, &mut velocities, &mut impulses);
            self.impulses[index] = impulses;
            for ((body, mass), velocity) in sides.into_iter().zip(masses).zip(velocities) {
                if mass.inverse_mass != 0.0 {
                    self.velocities[body] = velocity;
                }
            }
        }
    }
}
