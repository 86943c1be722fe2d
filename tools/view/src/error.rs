//! The reasons why a recording or a picture becomes no file.

use std::io;

use scene::Geometry;
use thiserror::Error;
use zynq_pgs::Pose;

/// A file's format cannot hold a recording.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "expected at most {most} bytes in {what}, found {found}: record fewer frames, or fewer bodies"
)]
pub struct TooLarge {
    /// The part of the file.
    pub what: &'static str,
    /// Its size in bytes.
    pub found: u64,
    /// The largest size that the format holds.
    pub most: u64,
}

impl TooLarge {
    /// Refuses a size beyond 32 bits.
    pub(crate) fn check(what: &'static str, found: u64) -> Result<u32, Self> {
        let most = u64::from(u32::MAX);
        u32::try_from(found).map_err(|_| Self { what, found, most })
    }
}

/// A recording or a picture that cannot become a file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ViewError {
    /// The time of a frame.
    #[error(
        "expected a finite time of step {step}, found {found}: give a shorter time step, or take \
         fewer steps"
    )]
    Time {
        /// The step.
        step: u32,
        /// Its time, s.
        found: f32,
    },
    /// The pose of a body.
    #[error(
        "expected a finite pose of body {body} after step {step}, with an orientation that is not \
         0, found position {:?} and orientation {:?}: record the steps before \
         it", pose.position, pose.orientation
    )]
    Pose {
        /// The step.
        step: u32,
        /// The body.
        body: usize,
        /// Its pose.
        pose: Pose,
    },
    /// The file's format cannot hold it.
    #[error(transparent)]
    TooLarge(#[from] TooLarge),
    /// More kinds of bodies than a byte can tell apart.
    #[error(
        "expected at most {most} kinds of bodies on a page, found {found}: record fewer bodies, \
         or write them as arrays"
    )]
    TooManyKinds {
        /// The kinds of the recording.
        found: usize,
        /// The most that a page holds.
        most: usize,
    },
    /// A hull of too few points.
    #[error(
        "expected a geometry with a surface, found the {} of kind {kind} without one: give it \
         four points or more that span a volume", geometry.name()
    )]
    NoSurface {
        /// Its number among the kinds of bodies.
        kind: usize,
        /// The geometry.
        geometry: Geometry,
    },
    /// The size of a picture.
    #[error(
        "expected a picture of 1 to {side} pixels a side and at most {pixels} in all, found \
         {width} by {height}"
    )]
    Size {
        /// Pixels across.
        width: u16,
        /// Pixels down.
        height: u16,
        /// The most a side.
        side: u16,
        /// The most in all.
        pixels: u32,
    },
    /// The camera of a picture.
    #[error(
        "expected a camera at finite places, found its eye at {eye:?} and its target at \
         {target:?}: give it finite ones, or record fewer steps"
    )]
    Camera {
        /// The eye, m.
        eye: [f32; 3],
        /// Its target, m.
        target: [f32; 3],
    },
    /// The page of a run cannot be served.
    #[error("the page of the run cannot be served at {address}: give a free port of this machine")]
    Live {
        /// Its address.
        address: std::net::SocketAddr,
        /// The reason.
        source: io::Error,
    },
    /// The poses cannot be compressed.
    #[error("the poses cannot be compressed")]
    Compression(#[source] io::Error),
    /// The document cannot be written as JSON.
    #[error("the document cannot be written as JSON")]
    Json(#[source] serde_json::Error),
    /// The pixels cannot be encoded.
    #[error("the picture cannot be encoded as PNG")]
    Png(#[source] png::EncodingError),
}
