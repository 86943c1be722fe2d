//! Everything that only saves time: switch it off, and every result bit, the work cycles and the stalls stay the same.

pub(crate) mod batch;
pub(crate) mod deferred;
pub(crate) mod flow;
