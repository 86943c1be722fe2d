//! The phases of a step, which tell how far a failed step has come.
//!
//! A descriptor is complete when its data has left memory. The accelerator may be behind by the
//! content of its FIFOs, which in a small step can be a whole phase.

use std::fmt;

/// A part of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Phase {
    /// The velocities go in.
    Load,
    /// The collisions go in for a contact pass, from 1; a warm pass is the first.
    Contact(u32),
    /// The collisions go in for a friction pass, from 1; a warm pass is the first.
    Friction(u32),
    /// The poses go in.
    Poses,
    /// All data is sent; the results come out.
    Results,
}

impl Phase {
    /// A name for programs: `load`, `contact2`, `results`.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Load => "load".to_owned(),
            Self::Contact(pass) => format!("contact{pass}"),
            Self::Friction(pass) => format!("friction{pass}"),
            Self::Poses => "poses".to_owned(),
            Self::Results => "results".to_owned(),
        }
    }
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Load => f.write_str("the load of the velocities"),
            Self::Contact(pass) => write!(f, "contact pass {pass}"),
            Self::Friction(pass) => write!(f, "friction pass {pass}"),
            Self::Poses => f.write_str("the poses"),
            Self::Results => f.write_str("the results"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_follow_each_other() {
        let phases = [
            Phase::Load,
            Phase::Contact(1),
            Phase::Contact(2),
            Phase::Friction(1),
            Phase::Poses,
            Phase::Results,
        ];
        assert!(phases.is_sorted());
    }
}
