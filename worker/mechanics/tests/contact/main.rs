//! Contact against the verification figures: zone, joints, forces, bounces, edges, surface and sort.

mod bounce;
mod edges;
mod force;
mod patch;
mod sort;
mod surface;
mod tunnel;
mod world;
mod zone;
