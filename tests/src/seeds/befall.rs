//! What a fault does to the world of a seed.

use master::{
    event::Event,
    job::Job,
    world::{End, World},
};
use protocol::message::ToMaster;

use super::{Bug, Fault, Play, Process, What, memory::Small};

impl Play {
    pub(super) fn befall(&mut self, fault: Fault) -> Result<(), String> {
        let (weather, sessions) = (&mut self.world.surroundings, &self.world.sessions);
        let now = weather.now;
        let alive: Vec<usize> = (0..weather.hosts.len())
            .filter(|&host| weather.hosts[host].alive && sessions.hosts[host].member.is_some())
            .collect();
        let pick = |number: u64| (!alive.is_empty()).then(|| alive[(number % alive.len() as u64) as usize]);
        match fault {
            Fault::Crash { host, returns } => {
                let Some(host) = pick(host) else { return Ok(()) };
                weather.hosts[host].alive = false;
                let noticed = now + 10 * weather.draws.delay();
                weather.put(noticed, What::Missed(host, "it crashed"));
                if returns {
                    // Before or after its ghost is noticed.
                    let back = now + 20 * weather.draws.delay();
                    weather.put(back, What::Comes);
                }
            }
            Fault::Cut { host, long } => {
                let Some(host) = pick(host) else { return Ok(()) };
                let until = now + 50 * weather.draws.delay();
                let Process { up, down, .. } = &mut weather.hosts[host];
                (up.cut_until, down.cut_until) = (until, until);
                if long {
                    weather.put(until - (until - now) / 2, What::Missed(host, "it was silent"));
                    weather.put(until + 10, What::Comes);
                }
            }
            Fault::PairCut { host, other } => {
                let (Some(host), Some(other)) = (pick(host), pick(other)) else { return Ok(()) };
                // What was under way between them is gone; each finds out by itself.
                let between = [host, other].map(End::Host);
                weather.happenings.retain(|_, what| {
                    !matches!(what, What::Arrives(parcel)
                        if between == [parcel.from, parcel.to] || between == [parcel.to, parcel.from])
                });
                self.cut_pair(host, other)?;
                self.cut_pair(other, host)?;
            }
            Fault::Slow { host, factor } => {
                if let Some(host) = pick(host) {
                    weather.hosts[host].slow = factor;
                }
            }
            Fault::Spoil { host } => {
                // One errs at a time: where all do, the master suspects itself and ends the job.
                let one_errs = alive.iter().any(|&host| weather.hosts[host].spoilt);
                if let Some(host) = pick(host).filter(|_| alive.len() > 1 && !one_errs) {
                    weather.hosts[host].spoilt = true;
                }
            }
            Fault::Flip(flip) => {
                // What makes the only worker's numbers infinite ends the run, with the reason.
                if let Some(host) = pick(flip.host).filter(|_| alive.len() > 1) {
                    weather.hosts[host].flip = Some(flip);
                }
            }
            Fault::Full { writes } => weather.disk.full = writes,
            Fault::Files { writes } => weather.disk.files = writes,
            Fault::Memory { host } => {
                if let Some(host) = pick(host).filter(|&host| weather.hosts[host].load > 0) {
                    weather.small = Some(Small::beside(weather.hosts[host].load));
                    weather.end(host);
                }
            }
            Fault::Rot => {
                weather.disk.rot(&mut weather.draws);
                self.without_master();
            }
            Fault::PowerLoss => {
                weather.disk.lose_rename(&mut weather.draws);
                self.without_master();
            }
            Fault::Stick { host } => {
                let Some(host) = pick(host) else { return Ok(()) };
                weather.hosts[host].stuck = true;
                if self.plot.bug != Some(Bug::Patient) {
                    let noticed = now + 200 * weather.draws.delay();
                    weather.put(noticed, What::Missed(host, "it makes no progress"));
                    weather.put(noticed + 10, What::Comes);
                }
            }
            Fault::Garble { host, bit } => {
                if let Some(host) = pick(host) {
                    weather.hosts[host].garbled = Some(bit);
                    let back = now + 50 * weather.draws.delay();
                    weather.put(back, What::Comes);
                }
            }
            Fault::Clock { ahead } => {
                let timers: Vec<u64> = weather
                    .happenings
                    .iter()
                    .filter(|(_, what)| matches!(what, What::Timer(_)))
                    .map(|(number, _)| *number)
                    .collect();
                for number in timers {
                    let Some(what) = weather.happenings.remove(&number) else { continue };
                    let at = if ahead { now } else { now + 3_600_000_000 };
                    weather.put(at, what);
                }
            }
            Fault::Yield { host } => {
                // Another one has other threads from now on: work is dealt out by what they are.
                if let Some(member) = pick(host + 1).and_then(|host| sessions.hosts[host].member) {
                    self.world.apply(Event::Threads(member, 1 + host as u32 % 4))?;
                }
                let sessions = &self.world.sessions;
                if let Some(member) = pick(host).and_then(|host| sessions.hosts[host].member) {
                    self.world.apply(Event::Yield(member))?;
                }
            }
            Fault::Join => weather.put(now, What::Comes),
            Fault::Master => self.without_master(),
            Fault::Leave => self.world.apply(Event::Suspend)?,
        }
        Ok(())
    }

    /// The master is gone; its workers give it up, and others call the next one.
    pub(super) fn without_master(&mut self) {
        let World { sessions, surroundings: weather, .. } = &mut self.world;
        sessions.job = None;
        for host in 0..sessions.hosts.len() {
            weather.hosts[host].alive = false;
            sessions.part(host);
        }
        let back = weather.now + 10 * weather.draws.delay();
        weather.put(back, What::MasterReturns);
    }

    /// A worker finds its link to another ended: what may be lost goes again, relayed.
    fn cut_pair(&mut self, host: usize, other: usize) -> Result<(), String> {
        let (weather, sessions) = (&mut self.world.surroundings, &self.world.sessions);
        let Some(position) = sessions.position(other) else { return Ok(()) };
        let epoch = sessions.hosts[host].session.epoch();
        let (of, pairs) = &mut weather.hosts[host].pairs;
        if sessions.job.as_ref().map(Job::epoch) != Some(epoch) || *of != epoch {
            return Ok(());
        }
        if let Some((kept, _)) = pairs.lose(position) {
            for message in kept {
                self.world.send(host, ToMaster::Relay { to: position, message })?;
            }
        }
        Ok(())
    }
}
