//! The wire: messages, frames, handshakes, links and TLS.

mod codec;
mod frame;
mod handshake;
mod link;
mod memory;
mod tls;
