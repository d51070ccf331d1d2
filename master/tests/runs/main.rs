//! Runs through the program or the library, in this process, and what they leave.

mod bad_physics;
mod epochs;
mod init;
mod links;
mod outcome;
mod picture;
mod replay;
mod results;
mod shipped;
mod simulate;
mod watched;
