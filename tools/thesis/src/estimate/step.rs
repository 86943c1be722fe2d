//! The size of a step, on which every formula depends.

/// Size of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepShape {
    /// Bodies B.
    pub bodies: u64,
    /// Collisions C.
    pub collisions: u64,
    /// Contact passes.
    pub contact_iterations: u64,
    /// Friction passes.
    pub friction_iterations: u64,
}

impl StepShape {
    /// Four contact and four friction passes.
    ///
    /// The thesis prints no number of passes; its Algorithm 2 has an "iteration limit" (§2.2.3).
    /// Eight are inferred from its cycles: a pass over 127,000 collisions (§4.4.1) takes 254,000
    /// cycles in float, and eight leave 30,697 of Table 6.4's 2,062,697 for load and integration,
    /// which take 31,590 by the formula. In half a pass takes 190,500, and eight leave 33,317 of
    /// Table 6.8's 1,557,317. The golden steps of Bullet have four passes of each kind.
    #[must_use]
    pub const fn new(bodies: u64, collisions: u64) -> Self {
        Self { bodies, collisions, contact_iterations: 4, friction_iterations: 4 }
    }

    /// Passes over the collisions; 0 without collisions.
    #[must_use]
    pub const fn passes(&self) -> u64 {
        if self.collisions == 0 { 0 } else { self.contact_iterations + self.friction_iterations }
    }
}
