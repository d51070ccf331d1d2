//! Contact: zone, joints, forces, surface and sort. The verification book has more of it, in these worlds.

mod clouds;
mod force;
mod patch;
mod sort;
mod surface;
mod world;
mod zone;
