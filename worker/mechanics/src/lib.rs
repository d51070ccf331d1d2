//! The physics of Bolide: pure computation over arrays, with no socket, clock or log.
//!
//! A problem is a [`mesh::Mesh`] (what never changes) plus a [`setup::Setup`] (materials, contact,
//! boundaries, control) plus a [`state::GlobalState`] (what a cycle changes). A worker holds the state as
//! [`block::Block`]s, each with its own copies of its nodes; a node held by several blocks is *shared*
//! and stays equal to the bit because every holder integrates it from the same exact total force
//! ([`exact`]).
//!
//! Units are any consistent set; the deck names it and nothing here depends on it. Stress is positive in
//! tension, pressure positive in compression. Hexahedron corners are numbered
//! 0(000) 1(100) 2(110) 3(010) 4(001) 5(101) 6(111) 7(011).
//!
//! One cycle `n`, as [`cycle::step`] and the worker's session go through it:
//! 1. contact forces of this worker's work units at `x_n`;
//! 2. forces of the element sets that touch shared nodes (border);
//! 3. partial forces of shared nodes travel;
//! 4. forces of the interior element sets meanwhile;
//! 5. total forces arrive; all nodes are integrated to `v_{n+1/2}`, `x_{n+1}`;
//! 6. votes (time step, displacement spread, energies) join the next frame.

#![cfg_attr(test, expect(clippy::disallowed_methods, reason = "tests compare with the platform's functions"))]

pub mod block;
pub mod burn;
pub mod constraint;
pub mod contact;
mod copy_index;
pub mod cross_section;
pub mod cycle;
pub mod digest;
pub mod draw;
pub mod element;
mod eos;
pub mod erosion;
pub mod exact;
pub mod failure;
#[doc(hidden)]
pub mod flip;
mod fused;
pub mod initial;
pub mod joint;
pub mod lanes;
pub mod law;
pub mod load;
pub mod material;
pub mod mesh;
pub mod nodes;
pub mod piece;
pub mod proof;
pub mod rigid;
pub mod sample;
pub mod setup;
pub(crate) mod spin;
pub mod state;
pub mod strength;
pub mod time_step;
mod vectors;
pub mod vote;
pub mod wall;
pub mod work;
