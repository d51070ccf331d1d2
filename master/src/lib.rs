//! The master: owns the problem, decides, adds partial forces, writes results.
//!
//! [`job`] is the pure session of one run; a [`world`] has it and the sessions of its workers in one process, in which
//! [`embedded`] runs them, and [`drive`] has workers over links. [`daemon`] listens; the [`scheduler`] owns [`hosts`] and [`queue`], asks [`footprint`] for the memory of a job, and hears [`notice`]s: each
//! [`connection`] is one task that carries messages, which waits for one of the [`places`], the [`client_requests`] answers clients, the [`desk`] reads their decks, [`service`] runs one job of the queue. [`client`] is the other end of the client requests;
//! [`ca_folder`] has its tokens and revoked certificates, [`newcomer`] how a bare PC gets one; [`neighbour`] whose process calls on loopback; [`processes`] starts workers as
//! children for one run, [`add`] over ssh, [`as_service`] has Windows do it. [`mod@bench`] measures. [`simulate`] drives the sessions on an emulated cluster. [`mod@study`] runs a deck with many values of its parameters. [`program`] is the command line.

// What prints without asking whether it can be printed panics where a pipe is closed or a disk full; `shell` has what asks.
#![cfg_attr(not(test), deny(clippy::print_stdout, clippy::print_stderr))]

pub mod add;
pub mod as_service;
pub mod balance;
pub mod bench;
pub mod ca_folder;
pub mod certs;
pub mod check;
pub mod client;
pub mod client_requests;
pub mod command;
pub mod connection;
pub mod convert;
pub mod daemon;
pub mod deck_file;
pub mod decompose;
pub mod desk;
mod disk;
pub mod drive;
pub mod embedded;
pub mod erosion;
pub mod event;
pub mod exchange;
pub mod export;
pub mod files;
pub mod footprint;
pub mod fragments;
pub mod hosts;
pub mod http;
pub mod incident;
pub mod init;
pub mod interrupt;
pub mod job;
pub mod machine;
pub mod materials;
pub mod neighbour;
pub mod newcomer;
pub mod node_owners;
pub mod notice;
pub mod notify;
pub mod options;
pub mod output;
pub mod pace;
pub mod patches;
pub mod peers;
pub mod picture;
pub mod places;
pub mod processes;
pub mod program;
pub mod progress;
pub mod quality;
pub mod queue;
pub mod reading;
pub mod refine;
pub mod report;
pub mod results;
pub mod run;
pub mod run_totals;
pub mod scheduler;
pub mod scrub;
pub mod service;
pub mod shell;
pub mod simulate;
pub mod snapshot;
pub mod sort;
pub mod spool;
pub mod study;
pub mod summarise;
pub mod tree;
pub mod verify;
pub mod world;
