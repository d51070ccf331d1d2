//! Blocks of hexahedra against themselves on other widths, topologies and cuts, laws and waves in them. Closed forms of single
//! elements are cases of the verification book, which has the bodies from here.

#![expect(clippy::disallowed_methods, reason = "tests compare with the platform's functions")]

mod bits;
mod bodies;
mod eight_points;
mod energy;
mod hourglass;
mod laws;
mod tet10;
mod uniform;
mod waves;
