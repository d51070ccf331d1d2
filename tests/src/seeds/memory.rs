//! Memory of the hosts of one seed: what they say of it, and where their systems end a process for want of it.

use master::{
    event::WorkerSpec,
    footprint::{self, Bearer},
};

use super::{Bug, Play, Weather, What, spec};

/// Processes that may be ended by their systems for what the master deals them.
const STARVED: u64 = 4;

/// The memory of a machine on which others have taken most of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Small {
    /// Elements that it has memory for, as it says.
    says: u64,
    /// A process with more is ended. The mesh of a seed is coarse, so that shares are not what speeds say.
    holds: u64,
}

impl Small {
    /// Where a share of so many elements was too much.
    pub(super) fn beside(load: u64) -> Self {
        Self { says: load / 4, holds: load.saturating_sub(1) * 3 / 4 }
    }
}

impl Weather {
    /// The process of a host is gone, and another one starts there.
    pub(super) fn end(&mut self, host: usize) {
        self.hosts[host].alive = false;
        let noticed = self.now + 10 * self.draws.delay();
        self.put(noticed, What::Missed(host, "its system ended it"));
        let back = self.now + 20 * self.draws.delay();
        self.put(back, What::Comes);
    }

    /// A host is dealt so many elements; gives whether its system ends it for that.
    pub(super) fn starves(&mut self, host: usize, load: u64) -> bool {
        self.hosts[host].load = load;
        let Some(small) = self.hosts[host].small.filter(|small| load > small.holds) else { return false };
        self.small = Some(small);
        self.starved += 1;
        self.end(host);
        true
    }
}

impl Play {
    /// Whether hosts have no memory for the whole job, as the master asks: those at work but one that is lost, and one that comes.
    pub(super) fn lacks_memory(&self, without: Option<usize>, with: Option<usize>) -> bool {
        let Some(job) = &self.world.sessions.job else { return false };
        if self.plot.bug == Some(Bug::Greedy) {
            return false;
        }
        let at_work = job.at_work().iter().map(|&member| self.world.sessions.host_of(member));
        let hosts: Vec<(WorkerSpec, u64)> = at_work
            .filter(|host| Some(*host) != without)
            .chain(with)
            .map(|host| {
                let small = self.world.surroundings.hosts[host].small;
                // One that says nothing has enough.
                (spec(host), small.map_or(0, |small| footprint::of_share(small.says)))
            })
            .collect();
        let bearers: Vec<Bearer<'_>> = hosts
            .iter()
            .map(|(spec, memory)| Bearer { name: &spec.name, speed: spec.speed, memory: *memory })
            .collect();
        footprint::shortage(job.n_elements() as u64, None, &bearers).is_some()
    }

    /// What is wrong with how memory was dealt with, if anything is.
    pub(super) fn starvation(&self) -> Option<String> {
        let starved = self.world.surroundings.starved;
        (starved > STARVED).then(|| format!("{starved} processes were dealt more than their memory holds"))
    }
}
