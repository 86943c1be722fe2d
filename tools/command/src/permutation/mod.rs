//! Orders of the collisions that the command itself makes, before the driver gets the collisions.
//!
//! A board that waits on hazards solves the collisions one after the other in the order in which it
//! gets them. So a permuted list, sent as given, is a solution in that order.

mod cells;

use std::path::Path;

use scene::SplitMix64;
use zynq_pgs::order::InputBuffers;
use zynq_pgs::{Body, Collision, Shape};

use crate::failure::Failure;
use step_folder::npy::{self, Dimensions};

/// The order of the collisions on Bullet's GPU, if a folder has it.
const GPU_ORDER: &str = "gpu_order.npy";
/// The name of Bullet's GPU order.
const GPU: &str = "gpu";
/// The beginning of a random order; its seed follows.
const RANDOM: &str = "random=";

/// An order that the command makes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Permutation {
    /// A random order, another one in each step, from this seed.
    Random(u64),
    /// The order of Bullet's GPU.
    Gpu,
}

impl Permutation {
    /// The forms in which it is written.
    pub const FORMS: [(&'static str, &'static str); 2] = [
        (
            GPU,
            "As Bullet's GPU solves them: from the folder's gpu_order.npy, otherwise by the same \
             cells of 6 m and batches of 64",
        ),
        ("random=SEED", "At random, another order in each step; the same for a seed everywhere"),
    ];

    /// Reads it; none if the text has another form.
    pub fn of_word(word: &str) -> Option<Self> {
        if word == GPU {
            return Some(Self::Gpu);
        }
        word.strip_prefix(RANDOM)?.parse().ok().map(Self::Random)
    }

    /// As it is written.
    pub fn text(self) -> String {
        match self {
            Self::Random(seed) => format!("{RANDOM}{seed}"),
            Self::Gpu => GPU.to_owned(),
        }
    }
}

/// Puts the collisions of one step after the other in an order.
#[derive(Debug)]
pub struct Arranger {
    source: Source,
    buffers: InputBuffers,
    arranged: Vec<Collision>,
}

#[derive(Debug)]
enum Source {
    Random(SplitMix64),
    /// The order of the only step.
    Given(Vec<u32>),
    Cells,
}

impl Arranger {
    /// Prepares an order. `recorded` is the order of Bullet's GPU, where it is known.
    pub fn new(permutation: Permutation, recorded: Option<Vec<u32>>) -> Self {
        let source = match (permutation, recorded) {
            (Permutation::Random(seed), _) => Source::Random(SplitMix64::new(seed)),
            (Permutation::Gpu, Some(order)) => Source::Given(order),
            (Permutation::Gpu, None) => Source::Cells,
        };
        Self { source, buffers: InputBuffers::new(), arranged: Vec::new() }
    }

    /// The collisions of the next step in their order.
    pub fn arrange(
        &mut self,
        bodies: &[Body],
        shapes: &[Shape],
        collisions: &[Collision],
    ) -> &[Collision] {
        let made;
        let order = match &mut self.source {
            Source::Random(random) => {
                made = shuffled(random, collisions.len());
                &made
            }
            Source::Given(order) => order,
            Source::Cells => {
                made = cells::order(&self.buffers.gather(bodies, collisions, shapes));
                &made
            }
        };
        self.arranged.clear();
        self.arranged.extend(order.iter().filter_map(|index| {
            usize::try_from(*index).ok().and_then(|index| collisions.get(index)).copied()
        }));
        &self.arranged
    }
}

/// Fisher and Yates' shuffle of the numbers below `count`.
pub fn shuffled(random: &mut SplitMix64, count: usize) -> Vec<u32> {
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
pub fn recorded(folder: &Path, count: usize) -> Result<Option<Vec<u32>>, Failure> {
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
    use zynq_pgs::{CONTACT_POINTS, Contact};

    use super::*;

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
        for permutation in [Permutation::Gpu, Permutation::Random(0), Permutation::Random(u64::MAX)]
        {
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
                body_a: 0,
                body_b,
                normal: [0.0, 1.0, 0.0],
                count: 0,
                contacts: [Contact { point: [0.0; 3], distance: 0.0 }; CONTACT_POINTS],
            })
            .collect();
        let two_steps = |seed| {
            let mut arranger = Arranger::new(Permutation::Random(seed), None);
            let mut step = || arranger.arrange(&[], &[], &collisions).to_vec();
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

    #[test]
    fn a_folder_without_the_order_of_the_gpu_has_none() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/golden/pile5_step60");
        assert_eq!(recorded(&folder, 184).expect("no file"), None);
    }
}
