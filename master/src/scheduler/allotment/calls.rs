//! CALLS: which workers a job calls that lacks some, and from which jobs.

use super::{Call, Row, SHORT_OF_ITS_PART, SLACK, Table};

impl Table<'_> {
    /// Calls workers of jobs that have more than their part, until a job has its own and as many as it needs.
    pub(super) fn call(&mut self, row: usize) {
        // What the job with the reservation waits for is not to take longer.
        if self.rows[row].passes {
            return;
        }
        loop {
            let Row { claim, needs, part, .. } = &self.rows[row];
            let short = part - self.speed_of(row);
            let must = self.rows[row].n() < *needs
                || (!claim.runs && self.lack(claim, self.rows[row].all()).is_some());
            if !must && (short <= 0.25 * part || self.rows[row].n() >= claim.workers[1]) {
                return;
            }
            let Some((from, worker)) = self.spare(row, short, must) else { return };
            self.rows[from].has.retain(|&other| other != worker);
            self.rows[row].coming.push(worker);
            let (from, to) = (self.rows[from].claim.job, Some(self.rows[row].claim.job));
            self.done.calls.push(Call { worker: self.workers[worker].incarnation, from, to });
        }
    }

    /// The worker that can be spared best for a job that is `short` of speed: of the job that has most above its part, one that fits. If it
    /// `must` have one, any that its job can go on without.
    fn spare(&self, to: usize, short: f64, must: bool) -> Option<(usize, usize)> {
        let above = |row: usize| -> f64 {
            let has: f64 = self.rows[row].has.iter().map(|&worker| self.speed(worker)).sum();
            has - self.rows[row].part
        };
        // Rather than that a long job is dealt out anew, another one waits for jobs that end meanwhile.
        let lacks = self.rows[to].needs.saturating_sub(self.rows[to].n()).max(1);
        let others_end = self.ends(lacks);
        let mut from: Vec<usize> = (0..self.rows.len())
            .filter(|&row| {
                let Row { claim, has, .. } = &self.rows[row];
                let gives = above(row) > 0.0 || (must && claim.priority <= self.rows[to].claim.priority);
                row != to
                    && (must || !self.rows[row].is_awaited)
                    && claim.runs
                    && gives
                    && has.len() > self.rows[row].floor()
                    && 2.0 * self.rows[row].deals() < others_end
                    && !self.rows[row].ends_soon()
            })
            .collect();
        from.sort_by(|&a, &b| above(b).total_cmp(&above(a)));
        let goes_on = |row: usize, without: usize| {
            let others = self.rows[row].has.iter().copied().filter(|&worker| worker != without);
            self.lack(self.rows[row].claim, others).is_none()
        };
        let of = |fits: &dyn Fn(usize, f64) -> bool, fastest: bool| {
            from.iter().find_map(|&row| {
                let has = self.rows[row].has.iter().copied();
                let near = has.filter(|&worker| must || self.is_near(to, worker));
                let fitting = near.filter(|&worker| fits(row, self.speed(worker)) && goes_on(row, worker));
                let by_speed = |a: &usize, b: &usize| self.speed(*a).total_cmp(&self.speed(*b));
                let best = if fastest { fitting.max_by(by_speed) } else { fitting.min_by(by_speed) };
                best.map(|worker| (row, worker))
            })
        };
        of(&|row, speed| speed <= SLACK * above(row) && speed <= 1.25 * short.max(0.0), true)
            .or_else(|| if must { of(&|_, _| true, false) } else { None })
    }

    /// When so many workers are idle because their jobs have ended (s).
    fn ends(&self, workers: usize) -> f64 {
        let running = self.rows.iter().filter(|row| row.claim.runs);
        let mut ends: Vec<(f64, usize)> =
            running.filter_map(|row| Some((row.claim.left_s?, row.has.len()))).collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut idle = 0;
        let enough = ends.into_iter().find(|(_, has)| {
            idle += has;
            idle >= workers
        });
        enough.map_or(f64::INFINITY, |(left, _)| left)
    }

    /// Has jobs that have much less than their part call workers of those that have more.
    pub(super) fn even_out(&mut self) {
        for row in 0..self.rows.len() {
            let Row { claim, coming, part, .. } = &self.rows[row];
            if claim.runs && coming.is_empty() && self.rows[row].is_worth_changing() && self.may_borrow(row) {
                let has = self.speed_of(row);
                if has < SHORT_OF_ITS_PART * part {
                    self.call(row);
                }
            }
        }
    }
}
