//! Contact: zone, joints, forces, edges, surface and sort. The verification book has more of it, in these worlds.

mod clouds;
mod edges;
mod force;
mod patch;
mod sort;
mod surface;
mod world;
mod zone;
