//! Records on the streams: where rows lie in beats, and beats on streams.

pub(crate) mod array;
pub(crate) mod decode;
pub(crate) mod results;
pub(crate) mod segment;
pub(crate) mod striping;
