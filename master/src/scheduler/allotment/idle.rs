//! IDLE: who is given the workers that are idle once every job that may start has its own.

use super::{Call, FASTER, HELPS, Row, SLACK, Table};

/// A worker is lent to a job until a reservation if that is as many times away as dealing the job out takes.
const LENT: f64 = 4.0;

impl Table<'_> {
    /// Gives idle workers to the jobs that have least of their part, as far as they fit into it.
    pub(super) fn fill(&mut self) {
        let mut left = Vec::new();
        for worker in std::mem::take(&mut self.idle) {
            let fits = |row: &usize| {
                let part = self.rows[*row].part;
                let empty = self.rows[*row].n() == 0;
                self.can_take(*row, worker)
                    && (empty || self.speed_of(*row) + self.speed(worker) <= SLACK * part)
            };
            let filled = |row: usize| self.speed_of(row) / self.rows[row].part.max(f64::MIN_POSITIVE);
            match (0..self.rows.len()).filter(fits).min_by(|&a, &b| filled(a).total_cmp(&filled(b))) {
                Some(row) => self.rows[row].given.push(worker),
                None => left.push(worker),
            }
        }
        self.idle = left;
    }

    /// Gives what is still idle to the jobs that have longest to go, as far as they are faster with it.
    pub(super) fn give_idle(&mut self) {
        let mut rows: Vec<usize> = (0..self.rows.len()).filter(|&row| self.rows[row].is_in).collect();
        rows.sort_by(|&a, &b| self.left(b).total_cmp(&self.left(a)));
        for row in rows {
            let before = (self.idle.clone(), self.rows[row].given.clone(), self.left(row));
            let mut leave = Vec::new();
            for worker in std::mem::take(&mut self.idle) {
                let slower =
                    self.slowest(row).filter(|&other| FASTER * self.speed(other) <= self.speed(worker));
                match slower {
                    _ if !self.can_take(row, worker) => self.idle.push(worker),
                    _ if self.helps(row) => self.rows[row].given.push(worker),
                    Some(slower) => {
                        self.rows[row].has.retain(|&other| other != slower);
                        self.rows[row].given.push(worker);
                        leave.push(slower);
                    }
                    None => self.idle.push(worker),
                }
            }
            let gains = before.2 - self.left(row) > 2.0 * self.rows[row].deals();
            if self.rows[row].claim.runs
                && !gains
                && before.2.is_finite()
                && self.rows[row].n() > self.rows[row].given.len()
            {
                // Dealing out anew would take longer than it saves.
                self.rows[row].has.append(&mut leave);
                (self.idle, self.rows[row].given) = (before.0, before.1);
                continue;
            }
            let from = self.rows[row].claim.job;
            let incarnation = |worker: usize| self.workers[worker].incarnation;
            let calls = leave.into_iter().map(|worker| Call { worker: incarnation(worker), from, to: None });
            self.done.calls.extend(calls);
        }
    }

    /// The slowest worker of a job that runs.
    fn slowest(&self, row: usize) -> Option<usize> {
        let has = self.rows[row].has.iter().copied().filter(|_| self.rows[row].claim.runs);
        has.min_by(|&a, &b| self.speed(a).total_cmp(&self.speed(b)))
    }

    /// Whether an idle worker may be given to a job.
    fn can_take(&self, row: usize, worker: usize) -> bool {
        let Row { claim, given, needs, is_in, .. } = &self.rows[row];
        let n = self.rows[row].n();
        *is_in
            && (n == 0 || self.may_borrow(row))
            && (claim.runs || given.len() >= *needs)
            // One whose workers are all lost waits for any.
            && (n == 0 || !self.rows[row].ends_soon())
            && n < claim.workers[1]
            && self.is_near(row, worker)
            && self.shortage(claim, self.rows[row].all().chain([worker])).is_none()
    }

    /// Whether the job with the reservation begins so late that a worker more is worth dealing this one out anew, twice.
    pub(super) fn may_borrow(&self, row: usize) -> bool {
        LENT * self.rows[row].deals() < self.begins
    }

    /// Whether a job is faster with one more worker.
    fn helps(&self, row: usize) -> bool {
        let has: u32 = self.rows[row].all().map(|worker| self.workers[worker].threads.max(1)).sum();
        has == 0 || has < self.rows[row].claim.threads(HELPS)
    }

    /// Seconds to the end of a job, with the workers that it has now.
    fn left(&self, row: usize) -> f64 {
        let Row { claim, told_with, .. } = &self.rows[row];
        let now = self.speed_of(row).max(f64::MIN_POSITIVE);
        claim.left_s.map_or(f64::INFINITY, |left| left * told_with / now)
    }
}
