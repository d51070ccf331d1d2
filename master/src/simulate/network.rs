//! The network: how long a message is on its way from one host to another, in virtual time.
//!
//! A hub is one collision domain: one message at a time, in the order they were ready. Its losses to collisions are
//! not modelled: with frames of full length a hub carries 95 % and more of its rate (Boggs, Mogul and Kent, Measured
//! capacity of an Ethernet, 1988). A switch has a queue by port in both directions; a message enters the receiver's
//! port while it still leaves the sender's.

/// What carries messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wires {
    /// One collision domain for all hosts.
    Hub,
    /// A queue by port in both directions.
    Switch,
}

/// A network and its costs.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    /// Hub or switch.
    pub wires: Wires,
    /// Bits per second of a wire.
    pub rate: f64,
    /// Time (s) from the last bit sent to the last bit received on an idle network.
    pub latency: f64,
    /// Bytes of a message that one packet takes.
    pub payload: u64,
    /// Bytes that each packet costs beside them: headers, gaps, acknowledgements.
    pub overhead: u64,
    /// Processor time (s at speed 1) of a message at each end.
    pub message: f64,
    /// Processor time (s at speed 1) of a byte at each end.
    pub byte: f64,
}

impl Network {
    /// How long a message of `bytes` occupies a wire (s).
    pub fn occupation(&self, bytes: u64) -> f64 {
        let packets = bytes.div_ceil(self.payload).max(1);
        (bytes + packets * self.overhead) as f64 * 8.0 / self.rate
    }

    /// Processor time (s at speed 1) of a message of `bytes` at one end.
    pub fn handling(&self, bytes: u64) -> f64 {
        self.byte.mul_add(bytes as f64, self.message)
    }

    /// The same network with the costs of messages, bytes and latency scaled.
    pub fn scaled(&self, factor: f64) -> Self {
        Self {
            latency: self.latency * factor,
            message: self.message * factor,
            byte: self.byte * factor,
            ..self.clone()
        }
    }
}

/// The wires in use. Calls come in the order of time.
pub struct Traffic {
    network: Network,
    /// When the hub is free, or the port of each host: out, in (s).
    hub: f64,
    out: Vec<f64>,
    into: Vec<f64>,
}

/// Where a message is after it left its sender.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    /// It is at the receiver at this time (s).
    Arrives(f64),
    /// At this time (s) its first bits reach the receiver's port: ask [`Traffic::enter`] then.
    Enters(f64),
}

impl Traffic {
    /// Idle wires between hosts.
    pub fn new(network: &Network, n_hosts: usize) -> Self {
        Self { network: network.clone(), hub: 0.0, out: vec![0.0; n_hosts], into: vec![0.0; n_hosts] }
    }

    /// A message is ready to leave host `from` at `now`.
    pub fn leave(&mut self, now: f64, from: usize, bytes: u64) -> Stage {
        let time = self.network.occupation(bytes);
        match self.network.wires {
            Wires::Hub => {
                self.hub = self.hub.max(now) + time;
                Stage::Arrives(self.hub + self.network.latency)
            }
            Wires::Switch => {
                let start = self.out[from].max(now);
                self.out[from] = start + time;
                Stage::Enters(start + self.network.latency)
            }
        }
    }

    /// The first bits of a message reach the port of host `to` at `now`: when it has arrived (s).
    pub fn enter(&mut self, now: f64, to: usize, bytes: u64) -> f64 {
        let start = self.into[to].max(now);
        self.into[to] = start + self.network.occupation(bytes);
        self.into[to]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn network(wires: Wires) -> Network {
        Network { wires, rate: 8e6, latency: 0.001, payload: 1000, overhead: 100, message: 1e-4, byte: 1e-8 }
    }

    #[test]
    fn a_hub_carries_one_message_at_a_time() {
        let mut traffic = Traffic::new(&network(Wires::Hub), 4);
        // 2,000 bytes in two packets of 1,100: 2.2 ms.
        let first = traffic.leave(0.0, 0, 2000);
        let second = traffic.leave(0.0, 2, 2000);
        assert_eq!(first, Stage::Arrives(0.0022 + 0.001));
        assert_eq!(second, Stage::Arrives(0.0044 + 0.001));
    }

    #[test]
    fn a_switch_carries_different_pairs_at_once_and_queues_at_a_port() {
        let mut traffic = Traffic::new(&network(Wires::Switch), 4);
        let starts = [traffic.leave(0.0, 0, 2000), traffic.leave(0.0, 2, 2000)];
        assert_eq!(starts, [Stage::Enters(0.001); 2]);
        assert_eq!(traffic.enter(0.001, 1, 2000), 0.001 + 0.0022);
        assert_eq!(traffic.enter(0.001, 3, 2000), 0.001 + 0.0022);
        assert_eq!(traffic.enter(0.001, 1, 2000), 0.001 + 0.0022 + 0.0022, "the second waits at the port");
    }

    #[test]
    fn a_short_message_still_takes_a_packet() {
        assert_eq!(network(Wires::Hub).occupation(1), 101.0 * 8.0 / 8e6);
    }
}
