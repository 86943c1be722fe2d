//! Checks of the hardware against references that share no code with it.
