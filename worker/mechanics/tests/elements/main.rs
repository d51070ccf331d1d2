//! Blocks of hexahedra against closed forms, against themselves on other widths, topologies and cuts.

mod bits;
mod bodies;
mod book;
mod energy;
mod laws;
mod waves;
