//! The processor of one host: what runs on it when, in virtual time.
//!
//! Message work comes first, then computation, then sorts, each in the order it came; the higher stops the lower. So a
//! sort takes what computing leaves idle, as a thread of low priority does on a PC.

use std::collections::VecDeque;

/// How urgent work is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rank {
    Message = 0,
    /// The tasks of a worker.
    Compute = 1,
    /// The master's sorts.
    Idle = 2,
}

/// One processor with work of type `W` on it.
pub struct Processor<W> {
    /// Relative speed: seconds of work per second.
    speed: f64,
    /// By rank: what is left (s at speed 1), and what it is.
    queues: [VecDeque<(f64, W)>; 3],
    updated: f64,
    version: u64,
}

impl<W> Processor<W> {
    /// An idle processor.
    pub fn new(speed: f64) -> Self {
        Self { speed, queues: [const { VecDeque::new() }; 3], updated: 0.0, version: 0 }
    }

    /// Relative speed now.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Changes with every change of work or speed; what was foreseen before is void then.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Runs up to `now` (s).
    fn advance(&mut self, now: f64) {
        let done = (now - self.updated) * self.speed;
        self.updated = now;
        self.version += 1;
        if let Some((left, _)) = self.queues.iter_mut().find_map(VecDeque::front_mut) {
            *left -= done;
        }
    }

    /// Adds work of `seconds` at speed 1.
    pub fn add(&mut self, now: f64, rank: Rank, seconds: f64, work: W) {
        self.advance(now);
        self.queues[rank as usize].push_back((seconds, work));
    }

    /// Runs at another speed from `now` on.
    pub fn set_speed(&mut self, now: f64, speed: f64) {
        self.advance(now);
        self.speed = speed;
    }

    /// When the next piece of work ends if none is added; none if idle.
    pub fn next_end(&self) -> Option<f64> {
        let (left, _) = self.queues.iter().find_map(VecDeque::front)?;
        Some(self.updated + left.max(0.0) / self.speed)
    }

    /// Takes the piece of work that ends `now`, which [`Processor::next_end`] foresaw.
    pub fn finish(&mut self, now: f64) -> Option<W> {
        self.advance(now);
        self.queues.iter_mut().find_map(VecDeque::pop_front).map(|(_, work)| work)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sort_takes_what_computing_leaves_idle() {
        let mut p = Processor::new(1.0);
        p.add(0.0, Rank::Idle, 4.0, 's');
        p.add(1.0, Rank::Compute, 2.0, 'c');
        assert_eq!(p.next_end(), Some(3.0));
        assert_eq!(p.finish(3.0), Some('c'));
        assert_eq!(p.next_end(), Some(6.0));
        assert_eq!(p.finish(6.0), Some('s'));
        assert_eq!(p.next_end(), None);
    }

    #[test]
    fn message_work_stops_computation() {
        let mut p = Processor::new(2.0);
        p.add(0.0, Rank::Compute, 4.0, 'c');
        p.add(1.0, Rank::Message, 1.0, 'm');
        assert_eq!(p.next_end(), Some(1.5));
        assert_eq!(p.finish(1.5), Some('m'));
        assert_eq!(p.next_end(), Some(2.5));
    }

    #[test]
    fn a_slower_host_takes_longer_from_then_on() {
        let mut p = Processor::new(1.0);
        p.add(0.0, Rank::Compute, 4.0, 'c');
        p.set_speed(2.0, 0.5);
        assert_eq!(p.next_end(), Some(6.0));
    }
}
