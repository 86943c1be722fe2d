//! Steps that the accelerator refuses: for each of its error codes one that leads to it.

use pgs_interface::control::{BODIES, COLLISIONS, CONTACT_ITERATIONS, ErrorCode};
use pgs_interface::profile::{Inertia, Variant};
use pgs_interface::register::Register;

use crate::packets::{Fault, FaultAt};
use crate::scene::Scene;

/// A step that is refused.
#[derive(Debug, Clone)]
pub struct Refusal {
    /// The mistake.
    pub name: &'static str,
    /// The error that it leads to.
    pub code: ErrorCode,
    /// The step.
    pub scene: Scene,
    /// A fault in its packets.
    pub fault: Option<FaultAt>,
    /// Registers that contradict the scene.
    pub registers: Vec<(Register, u32)>,
}

/// The index of a collision or a body that is wrong.
const WRONG: usize = 3;

/// Five bodies in a row, the last one static, and a collision of each with its neighbour.
fn scene(variant: Variant) -> Scene {
    Scene::row(variant, 5, (0..4).map(|body| [body + 1, body]))
}

/// At least one step for each error code of a design that streams the collisions once a pass.
/// `collisions_max` and `bodies_max` are the larger of the capacities of the accelerators.
#[must_use]
pub fn refusals(variant: Variant, bodies_max: u32, collisions_max: u32) -> Vec<Refusal> {
    let plain =
        |name, code| Refusal { name, code, scene: scene(variant), fault: None, registers: vec![] };
    let changed = |name, code, change: fn(&mut Scene)| {
        let mut refusal = plain(name, code);
        change(&mut refusal.scene);
        refusal
    };
    let faulty = |name, code, fault, segment, stream, beat| {
        let fault = Some(FaultAt { fault, segment, stream, beat });
        Refusal { fault, ..plain(name, code) }
    };
    let warm = |name, code, fault, segment, stream, beat| {
        let mut refusal = faulty(name, code, fault, segment, stream, beat);
        refusal.scene.arguments.warm_start = true;
        refusal
    };
    let told = |name, code, registers: &[(Register, u32)]| Refusal {
        registers: registers.to_vec(),
        ..plain(name, code)
    };
    let mut all = vec![
        changed("body index beyond the bodies", ErrorCode::BodyIndex, |scene| {
            scene.collisions[WRONG].bodies[0] = 5;
        }),
        changed("five contact points", ErrorCode::ContactCount, |scene| {
            scene.collisions[WRONG].count = 5;
        }),
        faulty("TLAST early, velocities", ErrorCode::TlastEarly, Fault::EarlyLast, 0, 1, 1),
        faulty("TLAST early, contact pass 2", ErrorCode::TlastEarly, Fault::EarlyLast, 2, 0, 3),
        faulty("TLAST early, poses", ErrorCode::TlastEarly, Fault::EarlyLast, 5, 3, 0),
        faulty("no TLAST, velocities", ErrorCode::TlastMissing, Fault::NoLast, 0, 2, 0),
        faulty("no TLAST, friction pass 1", ErrorCode::TlastMissing, Fault::NoLast, 3, 3, 0),
        faulty("no TLAST, poses", ErrorCode::TlastMissing, Fault::NoLast, 5, 0, 0),
        changed("shape index beyond the table", ErrorCode::ShapeIndex, |scene| {
            scene.bodies[WRONG].shape = 64;
        }),
        told(
            "more collisions than memory",
            ErrorCode::Capacity,
            &[(COLLISIONS, collisions_max + 1)],
        ),
        changed("two static bodies", ErrorCode::StaticPair, |scene| {
            scene.bodies[WRONG].shape = 1;
        }),
        changed("a body with itself", ErrorCode::SelfCollision, |scene| {
            scene.collisions[WRONG].bodies = [2; 2];
        }),
        told("no body", ErrorCode::Argument, &[(BODIES, 0)]),
        told("more bodies than memory", ErrorCode::Argument, &[(BODIES, bodies_max + 1)]),
        told("too many passes", ErrorCode::Argument, &[(CONTACT_ITERATIONS, 1 << 16)]),
        faulty("invalid bytes, velocities", ErrorCode::PartialBeat, Fault::Partial, 0, 0, 1),
        faulty("invalid bytes, contact pass 1", ErrorCode::PartialBeat, Fault::Partial, 1, 2, 2),
        warm("TLAST early, warm contact pass", ErrorCode::TlastEarly, Fault::EarlyLast, 1, 3, 3),
        warm("no TLAST, warm friction pass", ErrorCode::TlastMissing, Fault::NoLast, 4, 3, 0),
        warm("no TLAST, friction after warm", ErrorCode::TlastMissing, Fault::NoLast, 6, 3, 0),
        warm("invalid bytes, warm friction", ErrorCode::PartialBeat, Fault::Partial, 4, 3, 5),
    ];
    if variant.inertia == Inertia::World {
        all.extend([
            changed("two static by their own masses", ErrorCode::StaticPair, |scene| {
                scene.arguments.streamed_masses = true;
                for body in &mut scene.bodies[WRONG..] {
                    body.inverse_mass = 0;
                }
            }),
            // The shape means nothing here: the first mistake of the step is a later one.
            changed("with itself, any shape index", ErrorCode::SelfCollision, |scene| {
                scene.arguments.streamed_masses = true;
                scene.bodies[WRONG].shape = 64;
                scene.collisions[WRONG].bodies = [2; 2];
            }),
            faulty(
                "TLAST early, last row of a body",
                ErrorCode::TlastEarly,
                Fault::EarlyLast,
                0,
                3,
                3,
            ),
        ]);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use pgs_interface::profile::{FLOAT, HALF};

    #[test]
    fn every_code_is_there() {
        let world = Variant { inertia: Inertia::World, ..FLOAT.default_variant() };
        for variant in [FLOAT.default_variant(), world, HALF.default_variant()] {
            let all = refusals(variant, 1, 1);
            for code in ErrorCode::ALL {
                assert!(all.iter().any(|refusal| refusal.code == code), "{code:?}");
            }
        }
    }
}
