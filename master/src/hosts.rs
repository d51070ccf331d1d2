//! HOSTS: who is or was connected, what each offers, and what each is doing.
//!
//! A plain table: it knows no socket and no clock. A host's link and the way to its job stand beside it in the daemon.

use std::collections::{BTreeMap, VecDeque};

use protocol::{handshake::Hello, request::HostRow};

use crate::{event::WorkerSpec, notice::End};

/// Most hosts that are gone and remembered.
pub const LOST_LIMIT: usize = 1000;

/// What a host is doing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum State {
    /// Connected, without a job.
    Idle,
    /// Computing this job.
    Busy(u32),
    /// Not connected any more, and why: its connection broke, or its job dropped it.
    Lost(String),
    /// It said good-bye, and why.
    Left(String),
}

impl State {
    /// Whether it is not connected.
    const fn is_gone(&self) -> bool {
        matches!(self, Self::Lost(_) | Self::Left(_))
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct Host {
    /// Its number, from 0; a host that returns keeps it.
    pub number: u32,
    /// Its name, unique among the connected.
    pub name: String,
    /// Relative speed.
    pub speed: f64,
    pub threads: u32,
    /// Lane set.
    pub lanes: String,
    /// Empty where it names none.
    pub region: String,
    /// Where it called from.
    pub address: String,
    /// Drawn at the start of its process.
    pub nonce: u64,
    /// Its connection.
    pub incarnation: u32,
    /// What it is doing.
    pub state: State,
    /// Silent for so long that it may be dead: in words.
    pub suspect: Option<String>,
    /// Of one that computes only a part of its time for a job: in words.
    pub slow: Option<String>,
}

/// Every host that is or was connected.
#[derive(Debug, Default)]
pub struct Hosts {
    by_number: BTreeMap<u32, Host>,
    next: u32,
    /// Name and nonce of those that a job dropped, and why, oldest first.
    barred: VecDeque<(String, u64, String)>,
}

impl Hosts {
    /// Takes a greeting in on connection `incarnation`; gives the host's number, and the connection that the same
    /// process had before and is to be ended, if any.
    ///
    /// # Errors
    /// The reason to refuse it: another process of that name is connected, or a job dropped it.
    pub fn admit(
        &mut self,
        hello: &Hello,
        address: &str,
        incarnation: u32,
    ) -> Result<(u32, Option<u32>), String> {
        if let Some((name, _, why)) =
            self.barred.iter().find(|(n, nonce, _)| *n == hello.name || *nonce == hello.nonce)
        {
            return Err(format!(
                "worker {name} was {why}; look after its machine, then start it under another --name, or restart the master"
            ));
        }
        let known = self.by_number.values_mut().find(|host| host.name == hello.name);
        let mut ended = None;
        let number = match known {
            Some(host) => {
                if !host.state.is_gone() {
                    if host.nonce != hello.nonce {
                        return Err(format!(
                            "a worker named {:?} is connected from {}; start this one with another --name",
                            host.name, host.address
                        ));
                    }
                    ended = Some(host.incarnation);
                }
                host.number
            }
            None => {
                self.forget_the_oldest_gone();
                self.next += 1;
                self.next - 1
            }
        };
        self.by_number.insert(
            number,
            Host {
                number,
                name: hello.name.clone(),
                speed: hello.speed,
                threads: hello.threads,
                lanes: hello.lanes.clone(),
                region: hello.region.clone(),
                address: address.to_owned(),
                nonce: hello.nonce,
                incarnation,
                state: State::Idle,
                suspect: None,
                slow: None,
            },
        );
        Ok((number, ended))
    }

    /// The host on a connection.
    pub fn on(&self, incarnation: u32) -> Option<&Host> {
        self.by_number.values().find(|host| host.incarnation == incarnation)
    }

    /// A connection has ended; what an older connection of a returned host says is not heard. Of a worker that its job
    /// dropped neither the name nor the process is taken in again.
    pub fn gone(&mut self, incarnation: u32, why: &str, end: End) {
        let Some(host) = self.by_number.values_mut().find(|host| host.incarnation == incarnation) else {
            return;
        };
        (host.suspect, host.slow) = (None, None);
        host.state = match end {
            End::Left => State::Left(why.to_owned()),
            End::Lost | End::Dropped => State::Lost(why.to_owned()),
        };
        if end == End::Dropped {
            if self.barred.len() >= LOST_LIMIT {
                self.barred.pop_front();
            }
            self.barred.push_back((host.name.clone(), host.nonce, why.to_owned()));
        }
    }

    /// A host is silent, in words, or is heard again.
    pub fn suspect(&mut self, incarnation: u32, note: Option<String>) {
        if let Some(host) = self.by_number.values_mut().find(|host| host.incarnation == incarnation) {
            host.suspect = note;
        }
    }

    /// A host computes a part of its time only, in words, or all of it again.
    pub fn slow(&mut self, incarnation: u32, note: Option<String>) {
        if let Some(host) = self.by_number.values_mut().find(|host| host.incarnation == incarnation) {
            host.slow = note;
        }
    }

    /// Those that are connected, by number.
    pub fn connected(&self) -> impl Iterator<Item = &Host> {
        self.by_number.values().filter(|host| !host.state.is_gone())
    }

    /// A connection goes on with the threads and the speed of this.
    pub fn compute_with(&mut self, incarnation: u32, spec: &WorkerSpec) {
        if let Some(host) = self.by_number.values_mut().find(|host| host.incarnation == incarnation) {
            (host.threads, host.speed) = (spec.threads, spec.speed);
        }
    }

    /// Another connection of its process has its threads: nobody asks for it any more.
    pub fn forget(&mut self, incarnation: u32) {
        self.by_number.retain(|_, host| host.incarnation != incarnation);
    }

    /// These connections compute a job from now on.
    pub fn occupy(&mut self, incarnations: &[u32], job: u32) {
        for host in self.by_number.values_mut() {
            if incarnations.contains(&host.incarnation) && host.state == State::Idle {
                host.state = State::Busy(job);
            }
        }
    }

    /// A job that goes on has released one.
    pub fn free(&mut self, incarnation: u32, job: u32) {
        for host in self.by_number.values_mut() {
            if host.incarnation == incarnation && host.state == State::Busy(job) {
                (host.state, host.slow) = (State::Idle, None);
            }
        }
    }

    /// A job is over: its hosts that are still connected are idle.
    pub fn release(&mut self, job: u32) {
        for host in self.by_number.values_mut() {
            if host.state == State::Busy(job) {
                (host.state, host.slow) = (State::Idle, None);
            }
        }
    }

    /// The table as clients see it.
    pub fn rows(&self) -> Vec<HostRow> {
        let row = |host: &Host| {
            let (state, note) = match &host.state {
                State::Idle => ("idle", String::new()),
                State::Busy(job) => ("busy", format!("job {job}")),
                State::Lost(why) => ("lost", why.clone()),
                State::Left(why) => ("left", why.clone()),
            };
            let region = (!host.region.is_empty()).then(|| format!("region {}", host.region));
            let words = [Some(note), region, host.slow.clone(), host.suspect.clone()];
            let words: Vec<String> = words.into_iter().flatten().filter(|words| !words.is_empty()).collect();
            let note = words.join(", ");
            HostRow {
                host: host.number,
                name: host.name.clone(),
                speed: host.speed,
                threads: host.threads,
                lanes: host.lanes.clone(),
                address: host.address.clone(),
                incarnation: host.incarnation,
                state: state.to_owned(),
                note,
            }
        };
        self.by_number.values().map(row).collect()
    }

    fn forget_the_oldest_gone(&mut self) {
        let gone = || self.by_number.values().filter(|host| host.state.is_gone());
        if gone().count() < LOST_LIMIT {
            return;
        }
        if let Some(oldest) = gone().min_by_key(|host| host.incarnation).map(|host| host.number) {
            self.by_number.remove(&oldest);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::handshake::Role;

    fn hello(name: &str, nonce: u64) -> Hello {
        Hello::new(Role::Worker, name, 1.0, 1, "scalar", nonce)
    }

    #[test]
    fn a_returned_process_replaces_its_ghost_and_another_one_is_refused() {
        let mut hosts = Hosts::default();
        assert_eq!(hosts.admit(&hello("a", 1), "x", 1), Ok((0, None)));
        assert_eq!(hosts.admit(&hello("b", 2), "y", 2), Ok((1, None)));
        let refused = hosts.admit(&hello("a", 9), "z", 3).expect_err("a is there");
        assert!(refused.contains("\"a\" is connected from x"), "{refused}");
        assert_eq!(hosts.admit(&hello("a", 1), "x2", 4), Ok((0, Some(1))));
        hosts.gone(1, "the ghost's end", End::Lost);
        assert_eq!(hosts.on(4).map(|h| &h.state), Some(&State::Idle));
        hosts.gone(4, "gone", End::Lost);
        assert_eq!(hosts.admit(&hello("a", 9), "z", 5), Ok((0, None)), "the place is free again");
    }

    #[test]
    fn who_was_dropped_is_refused_by_name_and_by_nonce_with_the_reason() {
        let mut hosts = Hosts::default();
        hosts.admit(&hello("a", 1), "x", 1).expect("new");
        hosts.suspect(1, Some("suspect: silent".to_owned()));
        assert_eq!(hosts.rows()[0].note, "suspect: silent");
        hosts.gone(1, "dropped: block 2 came to other numbers", End::Dropped);
        assert_eq!(hosts.rows()[0].note, "dropped: block 2 came to other numbers");
        for returned in [hello("a", 1), hello("a", 7), hello("b", 1)] {
            let refused = hosts.admit(&returned, "x", 2).expect_err("dropped");
            assert!(refused.contains("worker a was dropped: block 2 came to other numbers"), "{refused}");
        }
        assert_eq!(hosts.admit(&hello("b", 7), "x", 3), Ok((1, None)));
    }

    #[test]
    fn a_job_occupies_its_hosts_until_it_is_over() {
        let mut hosts = Hosts::default();
        for (i, name) in ["a", "b", "c"].into_iter().enumerate() {
            hosts.admit(&hello(name, i as u64), "x", i as u32 + 1).expect("new");
        }
        let idle = |hosts: &Hosts| -> Vec<u32> {
            hosts.connected().filter(|h| h.state == State::Idle).map(|h| h.incarnation).collect()
        };
        hosts.occupy(&[1, 2], 7);
        hosts.slow(1, Some("works 25 % of the time: its owner types".to_owned()));
        assert_eq!(hosts.rows()[0].note, "job 7, works 25 % of the time: its owner types");
        hosts.gone(2, "cable", End::Lost);
        assert_eq!(idle(&hosts), [3]);
        hosts.release(7);
        assert_eq!(idle(&hosts), [1, 3]);
        assert_eq!((hosts.rows()[0].note.as_str(), hosts.rows()[1].note.as_str()), ("", "cable"));
        hosts.occupy(&[1, 3], 8);
        hosts.free(3, 7);
        assert_eq!(idle(&hosts), [0_u32; 0], "job 7 has it no more");
        hosts.free(3, 8);
        assert_eq!(idle(&hosts), [3]);
    }

    #[test]
    fn lost_hosts_are_remembered_up_to_a_limit() {
        let mut hosts = Hosts::default();
        for i in 0..LOST_LIMIT as u32 + 5 {
            hosts.admit(&hello(&format!("pc-{i}"), u64::from(i)), "x", i + 1).expect("new");
            hosts.gone(i + 1, "gone", End::Lost);
        }
        assert_eq!(hosts.rows().len(), LOST_LIMIT);
        assert_eq!(hosts.rows()[0].name, "pc-5");
    }
}
