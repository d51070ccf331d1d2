//! The network: how long a message is on its way from one host to another, in virtual time.
//!
//! A hub is one collision domain: one message at a time, in the order they were ready. Its losses to collisions are
//! not modelled: with frames of full length a hub carries 95 % and more of its rate (Boggs, Mogul and Kent, Measured
//! capacity of an Ethernet, 1988). A switch has a queue by port in both directions; a message enters the receiver's
//! port while it still leaves the sender's.
//!
//! Hosts of one region share a switch or a hub. What goes to another region passes the sender's gateway and the receiver's, each of which has
//! a queue in both directions.

use crate::decompose;

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
    pub regions: Regions,
}

/// Which hosts are near each other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Regions {
    /// Name of each host's region; empty where it names none.
    pub of_host: Vec<String>,
    /// What is between two regions; none where one switch or hub has all hosts.
    pub between: Option<Between>,
}

/// The wire between the gateways of two regions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Between {
    /// Bits per second of a gateway in each direction.
    pub rate: f64,
    /// Time (s) from gateway to gateway.
    pub latency: f64,
}

impl Network {
    /// How long a message of `bytes` occupies a wire (s).
    pub fn occupation(&self, bytes: u64) -> f64 {
        self.bits(bytes) / self.rate
    }

    fn bits(&self, bytes: u64) -> f64 {
        let packets = bytes.div_ceil(self.payload).max(1);
        (bytes + packets * self.overhead) as f64 * 8.0
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
    /// Region of each host, where regions have gateways.
    regions: Vec<u32>,
    /// When the hub of each region is free, its gateway out and in, and the port of each host out and in (s).
    hubs: Vec<f64>,
    gateways: [Vec<f64>; 2],
    out: Vec<f64>,
    into: Vec<f64>,
}

/// Where the first bits of a message are to be, and when; and when the last are there (s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Way {
    pub port: Port,
    pub first: f64,
    pub last: f64,
}

/// What a message queues at on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Port {
    /// The gateway of the sender's region.
    Out,
    /// The gateway of the receiver's region.
    In,
    /// The receiver's own port, or the hub that it is on.
    Receiver,
}

/// Where a message is after it left its sender.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stage {
    /// It is at the receiver at this time (s).
    Arrives(f64),
    /// Its first bits reach a port: ask [`Traffic::enter`] then.
    Enters(Way),
}

impl Traffic {
    /// Idle wires between hosts.
    pub fn new(network: &Network, n_hosts: usize) -> Self {
        let names = |host: usize| network.regions.of_host.get(host).map_or("", String::as_str);
        let regions = match network.regions.between {
            Some(_) => decompose::regions((0..n_hosts).map(names)),
            None => vec![0; n_hosts],
        };
        let idle = || vec![0.0; n_hosts];
        Self {
            network: network.clone(),
            regions,
            hubs: idle(),
            gateways: [idle(), idle()],
            out: idle(),
            into: idle(),
        }
    }

    /// A message is ready to leave the first of two hosts for the other at `now`.
    pub fn leave(&mut self, now: f64, (from, to): (usize, usize), bytes: u64) -> Stage {
        let (time, latency) = (self.network.occupation(bytes), self.network.latency);
        let is_far = self.regions[from] != self.regions[to];
        let wire = match self.network.wires {
            Wires::Hub => &mut self.hubs[self.regions[from] as usize],
            Wires::Switch => &mut self.out[from],
        };
        let start = wire.max(now);
        *wire = start + time;
        let (first, last) = (start + latency, *wire + latency);
        match self.network.wires {
            _ if is_far => Stage::Enters(Way { port: Port::Out, first, last }),
            Wires::Hub => Stage::Arrives(last),
            Wires::Switch => Stage::Enters(Way { port: Port::Receiver, first, last: 0.0 }),
        }
    }

    /// The first bits of a message reach a port on its way from the first of two hosts to the other: where it is next.
    pub fn enter(&mut self, way: Way, (from, to): (usize, usize), bytes: u64) -> Stage {
        let Network { wires, latency, .. } = self.network;
        let between = self.network.regions.between.unwrap_or(Between { rate: self.network.rate, latency });
        let (theirs, ours) = (self.regions[from] as usize, self.regions[to] as usize);
        let (wire, rate) = match (way.port, wires) {
            (Port::Out, _) => (&mut self.gateways[0][theirs], between.rate),
            (Port::In, _) => (&mut self.gateways[1][ours], between.rate),
            (Port::Receiver, Wires::Hub) => (&mut self.hubs[ours], self.network.rate),
            (Port::Receiver, Wires::Switch) => (&mut self.into[to], self.network.rate),
        };
        let start = wire.max(way.first);
        *wire = (start + self.network.bits(bytes) / rate).max(way.last);
        let next = |port, latency: f64, end: f64| {
            Stage::Enters(Way { port, first: start + latency, last: end + latency })
        };
        match (way.port, wires) {
            (Port::Out, _) => next(Port::In, between.latency, *wire),
            (Port::In, _) => next(Port::Receiver, latency, *wire),
            (Port::Receiver, Wires::Hub) => Stage::Arrives(*wire + latency),
            (Port::Receiver, Wires::Switch) => Stage::Arrives(*wire),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn network(wires: Wires) -> Network {
        Network {
            wires,
            rate: 8e6,
            latency: 0.001,
            payload: 1000,
            overhead: 100,
            message: 1e-4,
            byte: 1e-8,
            regions: Regions::default(),
        }
    }

    #[test]
    fn a_hub_carries_one_message_at_a_time() {
        let mut traffic = Traffic::new(&network(Wires::Hub), 4);
        // 2,000 bytes in two packets of 1,100: 2.2 ms.
        let first = traffic.leave(0.0, (0, 1), 2000);
        let second = traffic.leave(0.0, (2, 3), 2000);
        assert_eq!(first, Stage::Arrives(0.0022 + 0.001));
        assert_eq!(second, Stage::Arrives(0.0044 + 0.001));
    }

    #[test]
    fn a_switch_carries_different_pairs_at_once_and_queues_at_a_port() {
        let mut traffic = Traffic::new(&network(Wires::Switch), 4);
        let way = Way { port: Port::Receiver, first: 0.001, last: 0.0 };
        let starts = [traffic.leave(0.0, (0, 1), 2000), traffic.leave(0.0, (2, 3), 2000)];
        assert_eq!(starts, [Stage::Enters(way); 2]);
        assert_eq!(traffic.enter(way, (0, 1), 2000), Stage::Arrives(0.001 + 0.0022));
        assert_eq!(traffic.enter(way, (2, 3), 2000), Stage::Arrives(0.001 + 0.0022));
        let third = traffic.enter(way, (0, 1), 2000);
        assert_eq!(third, Stage::Arrives(0.001 + 0.0022 + 0.0022), "the second waits at the port");
    }

    /// When a message arrives that is alone.
    fn alone(traffic: &mut Traffic, hosts: (usize, usize), bytes: u64) -> f64 {
        let mut stage = traffic.leave(0.0, hosts, bytes);
        loop {
            match stage {
                Stage::Arrives(time) => return time,
                Stage::Enters(way) => stage = traffic.enter(way, hosts, bytes),
            }
        }
    }

    #[test]
    fn between_regions_messages_queue_at_gateways_and_inside_one_they_do_not() {
        for wires in [Wires::Hub, Wires::Switch] {
            let names = ["a", "b", "a", "b"].map(str::to_owned).to_vec();
            let near = network(wires);
            let regions = Regions { of_host: names, between: Some(Between { rate: 8e5, latency: 0.5 }) };
            let far = Network { regions, ..near.clone() };
            let mut traffic = Traffic::new(&far, 4);
            assert_eq!(alone(&mut traffic, (0, 2), 2000), alone(&mut Traffic::new(&near, 4), (0, 2), 2000));
            // The wire between gateways takes ten times 2.2 ms.
            let mut traffic = Traffic::new(&far, 4);
            let first = alone(&mut traffic, (0, 1), 2000);
            assert!((first - (0.5 + 0.022 + 2.0 * 0.001)).abs() < 0.0023, "{first}");
            let second = alone(&mut traffic, (2, 3), 2000);
            assert!((second - first - 0.022).abs() < 1e-9, "{second} behind {first}");
            // The hub of the other region has carried what came.
            if wires == Wires::Switch {
                let back = alone(&mut traffic, (3, 0), 2000);
                assert!(back < second, "the other direction is free");
            }
        }
    }

    #[test]
    fn a_short_message_still_takes_a_packet() {
        assert_eq!(network(Wires::Hub).occupation(1), 101.0 * 8.0 / 8e6);
    }
}
