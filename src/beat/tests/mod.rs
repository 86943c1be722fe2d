//! Packing and screening against the reference that packs one record at a time.

mod pack;
mod pool;
mod screen;
mod screen_bodies;
mod screen_properties;
mod warm;
