//! Contact: zone, joints, forces, edges, ties, surface and sort. The verification book has more of it, in these worlds.

#![expect(clippy::disallowed_methods, reason = "tests compare with the platform's functions")]

mod clouds;
mod edges;
mod force;
mod particles;
mod patch;
mod patches;
mod sort;
mod surface;
mod ties;
mod world;
mod zone;
