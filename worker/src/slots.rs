//! SLOTS: the threads of a worker's process, which several small jobs share.
//!
//! A process begins with one slot that has all threads: a connection to the master, a session and a pool. Where other jobs wait, the master has
//! a slot give threads that its job hardly uses to a new one, which calls as a worker of its own, and has them given back when nobody needs them
//! ([`ToWorker::Threads`](protocol::message::ToWorker::Threads)). No bit depends on it, so a job under way just goes on.

use std::sync::{
    Arc,
    atomic::{AtomicU32, Ordering},
};

use protocol::{
    Error, Result,
    handshake::{Hello, SPEEDS},
};
use tokio::sync::mpsc;

/// The threads of one slot.
#[derive(Clone, Debug)]
pub struct Slot {
    now: Arc<AtomicU32>,
    /// Threads of the whole process.
    of_process: u32,
    /// Has a slot opened with so many threads; none where the process does not divide.
    open: Option<mpsc::UnboundedSender<u32>>,
}

impl Slot {
    /// With `threads` of the `of_process` that the process has; more slots are asked for by `open`.
    pub fn new(threads: u32, of_process: u32, open: Option<mpsc::UnboundedSender<u32>>) -> Self {
        Self { now: Arc::new(AtomicU32::new(threads)), of_process, open }
    }

    /// Of a process that does not divide.
    pub fn whole(threads: u32) -> Self {
        Self::new(threads, threads, None)
    }

    /// How many it has; 0 once another slot has them.
    pub fn threads(&self) -> u32 {
        self.now.load(Ordering::Relaxed)
    }

    /// Computes with `computes` threads from now on, and has a slot opened for the `apart` others.
    ///
    /// # Errors
    /// [`Error::Message`] if they are not its own, or more than the process has.
    pub fn divide(&self, computes: u32, apart: u32) -> Result<()> {
        let has = self.threads();
        if apart == 0 && computes <= self.of_process {
            self.now.store(computes, Ordering::Relaxed);
            return Ok(());
        }
        let open = self.open.as_ref().filter(|_| computes > 0 && computes.checked_add(apart) == Some(has));
        let Some(open) = open else {
            return Err(Error::Message(format!(
                "asked to compute with {computes} threads and to give {apart} away, has {has} of the {} of its process",
                self.of_process
            )));
        };
        self.now.store(computes, Ordering::Relaxed);
        // The receiver is gone when the process ends.
        let _ = open.send(apart);
        Ok(())
    }

    /// What it offers of what the process does: threads, and speed and memory in proportion.
    pub fn offer(&self, whole: &Hello, hello: &mut Hello) {
        hello.threads = self.threads();
        let part = f64::from(hello.threads) / f64::from(self.of_process.max(1));
        hello.speed = (whole.speed * part).max(*SPEEDS.start());
        hello.memory = (whole.memory as f64 * part) as u64;
    }
}

/// The name of another slot of a worker: which process of its host it is, and which slot.
pub fn name_of(worker: &str, slot: u32) -> String {
    let mark = if worker.contains('@') { '.' } else { '@' };
    format!("{worker}{mark}{slot}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::handshake::{Role, host_of};

    #[test]
    fn a_slot_gives_threads_away_and_takes_them_back_but_none_that_it_has_not() {
        let (open, mut asked) = mpsc::unbounded_channel();
        let slot = Slot::new(8, 8, Some(open));
        slot.divide(2, 6).expect("its own");
        assert_eq!((slot.threads(), asked.try_recv()), (2, Ok(6)));
        for (computes, apart) in [(2, 6), (0, 2), (9, 0), (u32::MAX, 3)] {
            let why = slot.divide(computes, apart).expect_err("not its own").to_string();
            assert!(why.contains("has 2 of the 8"), "{why}");
        }
        slot.divide(8, 0).expect("given back");
        assert_eq!(slot.threads(), 8);
        slot.divide(0, 0).expect("another one has them");
        assert_eq!(slot.threads(), 0);
        assert!(Slot::whole(4).divide(1, 3).is_err(), "nobody opens it");
    }

    #[test]
    fn a_slot_offers_its_part_under_a_name_of_its_host() {
        let whole = Hello { memory: 8_000, ..Hello::new(Role::Worker, "pc", 4.0, 8, "scalar", 1) };
        let mut hello = whole.clone();
        Slot::new(2, 8, None).offer(&whole, &mut hello);
        assert_eq!((hello.threads, hello.speed, hello.memory), (2, 1.0, 2_000));
        for (name, second) in [("pc", "pc@2"), ("pc@77", "pc@77.2")] {
            assert_eq!(name_of(name, 2), second);
            assert_eq!(host_of(second), "pc");
            Hello { name: second.to_owned(), ..whole.clone() }.check().expect("a name");
        }
    }
}
