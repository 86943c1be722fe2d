//! The design that records are packed for: variant, shapes, screening.

use pgs_interface::profile::Variant;

use crate::scene::Shape;
use crate::validate::Quick;

/// The target that records are packed for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Target<'a> {
    pub(crate) variant: &'a Variant,
    pub(crate) shapes: &'a [Shape],
    /// Whether velocity records bring the inverse mass of their body.
    pub(crate) streamed_masses: bool,
    /// The check of everything that is packed; `None` packs unchecked.
    pub(crate) quick: Option<&'a Quick<'a>>,
}
