//! The box-on-plane scene of the thesis, with collision detection.
