//! The design that records are packed for: variant, shapes, screening.

use pgs_interface::profile::Variant;

use crate::scene::Shape;
use crate::validate::Quick;

/// What records are packed for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Target<'a> {
    pub(crate) variant: &'a Variant,
    pub(crate) shapes: &'a [Shape],
    /// Looks at everything on its way; without it nothing is wrong.
    pub(crate) quick: Option<&'a Quick<'a>>,
}
