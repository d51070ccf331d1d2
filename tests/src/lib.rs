//! What the tests of the whole system share.
//!
//! [`solve`] takes a deck through master and workers in this process; [`cluster`] runs real processes on loopback,
//! [`failpoint`] harms them, [`proxy`] stands between them, [`sshd`] beside them, [`browser`] and [`terminal`] look at
//! them; [`book`] holds the cases, [`case`] compares a figure with a published or derived one of `reference.toml` and says
//! how it went; [`fuzz`] damages what comes from outside, [`seeds`] plays the pure sessions in a world that goes wrong;
//! [`tetrahedra`] cuts hexahedra up; [`weekend`] has real processes harmed for hours; [`checker`] looks for nodes inside foreign bodies,
//! without asking the contact code.

pub mod bits;
pub mod book;
pub mod browser;
pub mod case;
pub mod checker;
pub mod cluster;
pub mod failpoint;
pub mod faults;
pub mod forms;
pub mod fuzz;
pub mod instructions;
pub mod left;
pub mod proxy;
pub mod seeds;
pub mod solve;
pub mod sshd;
pub mod terminal;
pub mod tetrahedra;
pub mod weekend;
