//! Records on the streams: the place of rows in beats, and of beats on streams.

pub(crate) mod array;
pub(crate) mod decode;
pub(crate) mod results;
pub(crate) mod segment;
pub(crate) mod striping;
