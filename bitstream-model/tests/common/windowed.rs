//! Packs a step for a design that streams the collisions once: places, marks, records in the order
//! in which bodies come and leave.

use pgs_interface::profile::{Flow, Variant, Window};
use pgs_interface::record::live;

use super::packing::{beats, collision_rows, deal, pose_rows, velocity_rows};
use super::scene::{Body, Collision, Lane, Step};

/// A step on its streams.
#[derive(Debug, Clone)]
pub(crate) struct Packed {
    pub(crate) lanes: Vec<Lane>,
    /// The bodies in the order in which they leave; static ones are not among them.
    pub(crate) leave: Vec<usize>,
}

/// The order of a step's bodies, and the index words of its collisions.
#[derive(Debug, Clone)]
pub(crate) struct Marked {
    /// Index words of every entry.
    pub(crate) words: Vec<[u32; 2]>,
    /// Moving bodies as they come alive.
    pub(crate) come: Vec<usize>,
    /// Moving bodies as they leave.
    pub(crate) leave: Vec<usize>,
}

/// Segments of a lane: velocities, collisions, poses.
pub(crate) const SEGMENTS: [usize; 3] = [0, 1, 2];

pub(crate) fn design(variant: &Variant) -> Option<&'static Window> {
    match &variant.profile.flow {
        Flow::Window(window) => Some(window),
        Flow::Passes => None,
    }
}

impl Step {
    fn moves(&self, body: usize) -> bool {
        self.shapes[self.bodies[body].shape as usize][0] != 0.0
    }

    /// Passes of the step; without passes no collision is streamed.
    fn passes(&self) -> usize {
        (self.iterations[0] + self.iterations[1]) as usize
    }

    /// The first and the last collision of each moving body.
    fn spans(&self) -> Vec<Option<[usize; 2]>> {
        let mut spans: Vec<Option<[usize; 2]>> = vec![None; self.bodies.len()];
        let sound = |(_, collision): &(usize, &Collision)| collision.count > 0 && self.passes() > 0;
        for (n, collision) in self.collisions.iter().enumerate().filter(sound) {
            for body in collision.bodies.map(|body| body as usize) {
                if self.moves(body) {
                    let [first, _] = spans[body].unwrap_or([n, n]);
                    spans[body] = Some([first, n]);
                }
            }
        }
        spans
    }

    /// For each entry n, the first entry that cannot leave the last pass before n has entered the
    /// first pass.
    ///
    /// An entry leaves a pass when the last uses of both its bodies have left it. So an entry `n`
    /// that waits for the first pass holds up, in the next pass, the first entry with a body that
    /// is used from `n` on; that entry holds up the pass behind, and so on.
    fn holds_up(&self, spans: &[Option<[usize; 2]>]) -> Vec<usize> {
        let passes = self.passes();
        let last = |collision: &Collision, n: usize| {
            let spans =
                collision.bodies.iter().filter_map(|body| spans.get(*body as usize)?.as_ref());
            spans.map(|[_, last]| *last).chain([n]).max().unwrap_or(n)
        };
        let lasts: Vec<usize> =
            self.collisions.iter().enumerate().map(|(n, c)| last(c, n)).collect();
        let mut at = 0;
        let held: Vec<usize> = (0..lasts.len())
            .map(|n| {
                while at < n && lasts[at] < n {
                    at += 1;
                }
                at
            })
            .collect();
        (0..lasts.len()).map(|n| (1..passes).fold(n, |n, _| held[n])).collect()
    }

    /// Index words of every entry, and the bodies as they come and as they leave.
    ///
    /// `None` if `slots` places are too few for the bodies that are alive or have not left yet.
    pub(crate) fn marked(&self, slots: u32) -> Option<Marked> {
        let spans = self.spans();
        let holds_up = self.holds_up(&spans);
        let (mut come, mut leave) = (Vec::new(), Vec::new());
        let mut place_of = vec![0; self.bodies.len()];
        // The last use of the body in each place.
        let mut taken: Vec<Option<usize>> = vec![None; slots as usize];
        let mut words = Vec::new();
        for (n, collision) in self.collisions.iter().enumerate() {
            let mut entry = [0; 2];
            for (word, body) in entry.iter_mut().zip(collision.bodies.map(|body| body as usize)) {
                let Some([first, last]) = spans.get(body).copied().flatten() else { continue };
                if collision.count == 0 {
                    continue;
                }
                if first == n {
                    let (start, places) = (come.len(), slots as usize - 1);
                    place_of[body] = (0..places)
                        .map(|k| 1 + (start + k) % places)
                        .find(|place| taken[*place].is_none_or(|last| last < holds_up[n]))?;
                    taken[place_of[body]] = Some(last);
                    come.push(body);
                    *word |= live::FIRST;
                }
                *word |= u32::try_from(place_of[body]).expect("13 bits");
                if last == n {
                    *word |= live::LAST;
                    leave.push(body);
                }
            }
            words.push(entry);
        }
        let rest =
            (0..self.bodies.len()).filter(|body| self.moves(*body) && spans[*body].is_none());
        let rest: Vec<usize> = rest.collect();
        come.extend(&rest);
        leave.extend(&rest);
        Some(Marked { words, come, leave })
    }

    /// The fewest places with which the step ends.
    pub(crate) fn fewest_slots(&self) -> u32 {
        (2..=8192).find(|slots| self.marked(*slots).is_some()).expect("a small step")
    }

    /// The longest way from a body's first collision to its last.
    pub(crate) fn longest_span(&self) -> usize {
        self.spans().into_iter().flatten().map(|[first, last]| last - first).max().unwrap_or(0)
    }

    /// The beats and packets on each stream.
    pub(crate) fn packed_once(&self, variant: &Variant) -> Packed {
        let slots = design(variant).expect("it has a window").slots;
        let Marked { words, come, leave } = self.marked(slots).expect("there are places");
        let lanes = self.lanes_of(variant, &words, &come, &leave);
        Packed { lanes, leave }
    }

    /// The streams for the index words `words` and the orders `come` and `leave`.
    pub(crate) fn lanes_of(
        &self,
        variant: &Variant,
        words: &[[u32; 2]],
        come: &[usize],
        leave: &[usize],
    ) -> Vec<Lane> {
        let profile = variant.profile;
        let numbers = variant.numbers;
        let velocities: Vec<_> = come
            .iter()
            .flat_map(|body| velocity_rows(variant, self, &self.bodies[*body], *body))
            .collect();
        let mut collisions: Vec<_> = self
            .collisions
            .iter()
            .zip(words)
            .flat_map(|(collision, words)| {
                collision_rows(variant, &Collision { bodies: *words, ..*collision })
            })
            .collect();
        let issue = profile.collisions_per_issue as usize * variant.collision_rows();
        collisions.resize(collisions.len().next_multiple_of(issue), [0; 4]);
        let poses: Vec<_> =
            leave.iter().flat_map(|body| pose_rows(numbers.poses, &self.bodies[*body])).collect();
        let (stripes, streams) = (&profile.stripes, profile.mm2s_widths.len());
        let none = || vec![Vec::new(); streams];
        let segments = [
            deal(&stripes.velocities, streams, beats(numbers.bodies, &velocities)),
            deal(&stripes.collisions, streams, beats(numbers.collisions, &collisions)),
            deal(&stripes.poses, streams, beats(numbers.poses, &poses)),
            none(),
            none(),
        ];
        let passes = self.passes() > 0;
        (0..streams)
            .map(|stream| {
                let segments = segments.each_ref().map(|segment| segment[stream].clone());
                let mut packets = SEGMENTS.to_vec();
                packets.retain(|segment| !segments[*segment].is_empty());
                packets.retain(|segment| passes || *segment != 1);
                Lane { segments, packets }
            })
            .collect()
    }

    /// The step with the moving bodies alone, in the order in which they leave.
    pub(crate) fn moving_in_order(&self, leave: &[usize]) -> Self {
        Self { bodies: leave.iter().map(|body| self.bodies[*body]).collect(), ..self.clone() }
    }

    /// The step with the bodies that are streamed, and its streams, on any profile.
    pub(crate) fn on(&self, variant: &Variant) -> (Self, Vec<Lane>) {
        if design(variant).is_none() {
            return (self.clone(), self.packed(variant));
        }
        let packed = self.packed_once(variant);
        (self.moving_in_order(&packed.leave), packed.lanes)
    }

    /// All bodies, from the results in the order in which they left.
    pub(crate) fn restored(&self, leave: &[usize], results: &[Body]) -> Vec<Body> {
        let mut bodies: Vec<Body> =
            self.bodies.iter().map(|body| Body { shape: 0, ..*body }).collect();
        for (body, result) in leave.iter().zip(results) {
            bodies[*body] = *result;
        }
        bodies
    }
}
