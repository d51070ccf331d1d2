//! The master: owns the problem, decides, adds partial forces, writes results.
//!
//! [`job`] is the pure session of one run; [`embedded`] drives it with workers in the same process;
//! `daemon` with workers over TCP.

pub mod balance;
pub mod certs;
pub mod command;
pub mod decompose;
pub mod embedded;
pub mod exchange;
pub mod job;
pub mod ledger;
pub mod results;
pub mod run;
pub mod snapshot;
pub mod sort;
