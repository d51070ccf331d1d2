//! Contact against the verification figures: zone, joints, forces, bounces, surface and sort.

mod bounce;
mod force;
mod patch;
mod sort;
mod surface;
mod tunnel;
mod world;
mod zone;
