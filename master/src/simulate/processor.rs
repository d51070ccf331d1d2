//! The processor of one host: what runs on it when, in virtual time.
//!
//! Message work comes first, in the order it came, and stops everything else. Computation and sorts share what is left
//! equally, as processes do on a PC.

use std::collections::VecDeque;

/// One processor with work of type `W` on it.
pub struct Processor<W> {
    /// Relative speed: seconds of work per second.
    speed: f64,
    /// Message work: what is left (s at speed 1), and what it is.
    urgent: VecDeque<(f64, W)>,
    /// Everything else.
    shared: Vec<(f64, W)>,
    updated: f64,
    version: u64,
}

impl<W> Processor<W> {
    /// An idle processor.
    pub fn new(speed: f64) -> Self {
        Self { speed, urgent: VecDeque::new(), shared: Vec::new(), updated: 0.0, version: 0 }
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
        if let Some((left, _)) = self.urgent.front_mut() {
            *left -= done;
            return;
        }
        let part = done / self.shared.len().max(1) as f64;
        for (left, _) in &mut self.shared {
            *left -= part;
        }
    }

    /// Adds message work of `seconds` at speed 1.
    pub fn interrupt(&mut self, now: f64, seconds: f64, work: W) {
        self.advance(now);
        self.urgent.push_back((seconds, work));
    }

    /// Adds computation of `seconds` at speed 1.
    pub fn compute(&mut self, now: f64, seconds: f64, work: W) {
        self.advance(now);
        self.shared.push((seconds, work));
    }

    /// Runs at another speed from `now` on.
    pub fn set_speed(&mut self, now: f64, speed: f64) {
        self.advance(now);
        self.speed = speed;
    }

    /// When the next piece of work ends if none is added; none if idle.
    pub fn next_end(&self) -> Option<f64> {
        if let Some((left, _)) = self.urgent.front() {
            return Some(self.updated + left.max(0.0) / self.speed);
        }
        let least = self.shared.iter().map(|(left, _)| *left).reduce(f64::min)?;
        Some(self.updated + least.max(0.0) * self.shared.len() as f64 / self.speed)
    }

    /// Takes the piece of work that ends `now`, which [`Processor::next_end`] foresaw.
    pub fn finish(&mut self, now: f64) -> Option<W> {
        self.advance(now);
        if let Some((_, work)) = self.urgent.pop_front() {
            return Some(work);
        }
        let least =
            (0..self.shared.len()).reduce(|a, b| if self.shared[b].0 < self.shared[a].0 { b } else { a })?;
        Some(self.shared.remove(least).1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_computations_share_and_the_shorter_ends_first() {
        let mut p = Processor::new(1.0);
        p.compute(0.0, 4.0, 'a');
        p.compute(0.0, 1.0, 'b');
        assert_eq!(p.next_end(), Some(2.0));
        assert_eq!(p.finish(2.0), Some('b'));
        assert_eq!(p.next_end(), Some(5.0));
        assert_eq!(p.finish(5.0), Some('a'));
        assert_eq!(p.next_end(), None);
    }

    #[test]
    fn message_work_stops_computation() {
        let mut p = Processor::new(2.0);
        p.compute(0.0, 4.0, 'c');
        p.interrupt(1.0, 1.0, 'm');
        assert_eq!(p.next_end(), Some(1.5));
        assert_eq!(p.finish(1.5), Some('m'));
        assert_eq!(p.next_end(), Some(2.5));
    }

    #[test]
    fn a_slower_host_takes_longer_from_then_on() {
        let mut p = Processor::new(1.0);
        p.compute(0.0, 4.0, 'c');
        p.set_speed(2.0, 0.5);
        assert_eq!(p.next_end(), Some(6.0));
    }
}
