//! Orders that an experiment makes of a step's collisions, before the board gets these as given.
//!
//! A board that waits on hazards solves the collisions one after the other in the order in which it
//! gets them. So a permuted list, sent as given, is a solution in that order.

pub(crate) mod body_by_body;
mod cells;

use std::path::Path;

use pgs_command::failure::{Failure, Result};
use scene::SplitMix64;
use step_folder::npy::{self, Dimensions};
use zynq_pgs::order::InputBuffers;
use zynq_pgs::{Body, Collision, Shape};

use self::body_by_body::Ties;

/// The order of the collisions on Bullet's GPU, if a folder has it.
const GPU_ORDER: &str = "gpu_order.npy";
/// The beginning of a random order; its seed follows.
const RANDOM: &str = "random=";

/// An order that an experiment makes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Permutation {
    /// A random order, another one in each step, from this seed.
    Random(u64),
    /// The order of Bullet's GPU.
    Gpu,
    /// The thesis' Algorithm 3: few bodies alive, nearly all collisions hazardous.
    BodyByBody(Ties),
}

/// The orders without a seed, as they are written.
const WORDS: [(&str, Permutation); 4] = [
    ("gpu", Permutation::Gpu),
    ("body-by-body", Permutation::BodyByBody(Ties::LowestIndex)),
    ("body-by-body-oldest", Permutation::BodyByBody(Ties::Oldest)),
    ("body-by-body-newest", Permutation::BodyByBody(Ties::Newest)),
];

impl Permutation {
    /// The forms in which it is written.
    pub(crate) fn forms() -> impl Iterator<Item = &'static str> {
        WORDS.iter().map(|(word, _)| *word).chain(["random=SEED"])
    }

    /// Reads it; none if the text has another form.
    pub(crate) fn of_word(word: &str) -> Option<Self> {
        let seed = || word.strip_prefix(RANDOM)?.parse().ok().map(Self::Random);
        let known = WORDS.iter().find(|(known, _)| *known == word);
        known.map(|(_, order)| *order).or_else(seed)
    }

    /// As it is written.
    pub(crate) fn text(self) -> String {
        match (self, WORDS.iter().find(|(_, order)| *order == self)) {
            (Self::Random(seed), _) => format!("{RANDOM}{seed}"),
            (_, word) => word.map(|(word, _)| (*word).to_owned()).unwrap_or_default(),
        }
    }
}

/// Puts the collisions of one step after the other in an order.
#[derive(Debug)]
pub(crate) struct Arranger {
    permutation: Permutation,
    /// The numbers of random orders.
    random: SplitMix64,
    /// The order of Bullet's GPU in the only step, where it is known.
    recorded: Option<Vec<u32>>,
    buffers: InputBuffers,
    arranged: Vec<Collision>,
}

impl Arranger {
    /// Prepares an order. `recorded` is the order of Bullet's GPU, where it is known.
    pub(crate) fn new(permutation: Permutation, recorded: Option<Vec<u32>>) -> Self {
        let seed = if let Permutation::Random(seed) = permutation { seed } else { 0 };
        let (random, buffers) = (SplitMix64::new(seed), InputBuffers::new());
        Self { permutation, random, recorded, buffers, arranged: Vec::new() }
    }

    /// The collisions of the next step in their order. Where one of them has a body that does not
    /// exist they stay as given, so that the board's refusal names the place of this one.
    pub(crate) fn arrange<'a>(
        &'a mut self,
        bodies: &[Body],
        shapes: &[Shape],
        collisions: &'a [Collision],
    ) -> &'a [Collision] {
        let input = self.buffers.gather(bodies, collisions, shapes);
        let exists = |body: u32| usize::try_from(body).is_ok_and(|body| body < bodies.len());
        if input.taking_part().any(|(_, pair)| !pair.into_iter().all(exists)) {
            return collisions;
        }
        let order = match (self.permutation, &self.recorded) {
            (Permutation::Random(_), _) => shuffled(&mut self.random, collisions.len()),
            (Permutation::Gpu, Some(recorded)) => recorded.clone(),
            // By the cells of Bullet's GPU.
            (Permutation::Gpu, None) => cells::order(&input, bodies),
            (Permutation::BodyByBody(ties), _) => body_by_body::order(&input, ties),
        };
        let collision = |index: u32| collisions.get(usize::try_from(index).ok()?).copied();
        self.arranged.clear();
        self.arranged.extend(order.into_iter().filter_map(collision));
        &self.arranged
    }
}

/// Fisher and Yates' shuffle of the numbers below `count`.
pub(crate) fn shuffled(random: &mut SplitMix64, count: usize) -> Vec<u32> {
    let mut order: Vec<u32> = (0..).take(count).collect();
    for k in (1..count).rev() {
        order.swap(k, random.below(k + 1));
    }
    order
}

/// Reads the order of Bullet's GPU, a permutation of `count` collisions, if the folder has it.
///
/// # Errors
///
/// Fails where the file is no permutation of that many indices.
pub(crate) fn recorded(folder: &Path, count: usize) -> Result<Option<Vec<u32>>> {
    let path = &folder.join(GPU_ORDER);
    // Opening the file reports a name that cannot be looked up.
    if matches!(path.try_exists(), Ok(false)) {
        return Ok(None);
    }
    let shape = Dimensions(vec![Some(count)]);
    let (_, order) = npy::read::<u32>(path, &shape).map_err(Failure::input)?;
    let mut seen = vec![false; count];
    for (place, index) in order.iter().enumerate() {
        let first = usize::try_from(*index).ok().and_then(|index| seen.get_mut(index));
        if first.is_none_or(|seen| std::mem::replace(seen, true)) {
            let path = path.display();
            return Err(Failure::input(format!(
                "{path}: expected each index below {count} once, found {index} at {place}"
            )));
        }
    }
    Ok(Some(order))
}

#[cfg(test)]
mod tests {
    use zynq_pgs::scene::CONTACT_POINTS;
    use zynq_pgs::{Contact, Pose, Velocity};

    use super::*;

    fn body() -> Body {
        let pose = Pose { position: [0.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] };
        Body { pose, velocity: Velocity::default(), shape: 0 }
    }

    #[test]
    fn a_shuffle_is_a_permutation_and_far_from_the_order_given() {
        let order = shuffled(&mut SplitMix64::new(20_260_101), 1000);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..1000).collect::<Vec<_>>());
        let near = (0..).zip(&order).filter(|(k, index)| u32::abs_diff(*k, **index) < 100);
        assert!(near.count() < 300);
    }

    #[test]
    fn a_permutation_is_written_as_it_is_read() {
        let random = [0, u64::MAX].map(Permutation::Random);
        for permutation in WORDS.iter().map(|(_, order)| *order).chain(random) {
            assert_eq!(Permutation::of_word(&permutation.text()), Some(permutation));
        }
        for wrong in ["random", "random=", "random=-1", "random=x", "GPU", "gpu=1"] {
            assert_eq!(Permutation::of_word(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn each_step_of_a_random_order_has_another_one_and_a_seed_always_the_same() {
        let collisions: Vec<Collision> = (0..50)
            .map(|body_b| Collision {
                body_a: 50,
                body_b,
                normal: [0.0, 1.0, 0.0],
                count: 1,
                contacts: [Contact { point: [0.0; 3], distance: 0.0 }; CONTACT_POINTS],
            })
            .collect();
        let bodies = vec![body(); 51];
        let two_steps = |seed| {
            let mut arranger = Arranger::new(Permutation::Random(seed), None);
            let mut step = || arranger.arrange(&bodies, &[], &collisions).to_vec();
            [step(), step()]
        };
        let [first, second] = two_steps(7);
        assert_ne!(first, second);
        assert_eq!(two_steps(7), [first.clone(), second]);
        assert_ne!(two_steps(8)[0], first);
        let mut sorted = first;
        sorted.sort_by_key(|collision| collision.body_b);
        assert_eq!(sorted, collisions);
    }

    /// Orders of one step: each collision once, and the bodies' own order where a body does not
    /// exist.
    #[test]
    fn every_order_has_each_collision_once() {
        let contacts = [Contact { point: [0.0; 3], distance: 0.0 }; CONTACT_POINTS];
        let normal = [0.0, 1.0, 0.0];
        let of =
            |[body_a, body_b]: [u32; 2]| Collision { body_a, body_b, normal, count: 1, contacts };
        let pairs = [[0, 4], [4, 1], [1, 2], [2, 3], [3, 0], [2, 0], [4, 3]];
        let (bodies, shapes) = (vec![body(); 5], [Shape::isotropic(1.0, 1.0)]);
        for permutation in WORDS.iter().map(|(_, order)| *order).chain([Permutation::Random(3)]) {
            let mut arranger = Arranger::new(permutation, None);
            let mut collisions = pairs.map(of);
            let pair = |collision: &Collision| [collision.body_a, collision.body_b];
            let mut found: Vec<_> =
                arranger.arrange(&bodies, &shapes, &collisions).iter().map(pair).collect();
            found.sort_unstable();
            let mut expected = pairs;
            expected.sort_unstable();
            assert_eq!(found, expected, "{permutation:?}");
            collisions[3].body_b = 5;
            assert_eq!(arranger.arrange(&bodies, &shapes, &collisions), collisions);
        }
    }

    #[test]
    fn a_folder_without_the_order_of_the_gpu_has_none() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden/pile5_step60");
        assert_eq!(recorded(&folder, 184).expect("no file"), None);
    }
}
