//! ADMISSION: which of the waiting jobs may start beside those that run, and for which one there is a reservation.

use super::{Claim, Row, Stands, Table};

impl Table<'_> {
    /// Workers that all of the jobs that are in need.
    pub(super) fn pinned(&self) -> usize {
        self.rows.iter().filter(|row| row.is_in).map(Row::floor).sum()
    }

    /// Says which of the waiting jobs may start beside those that run.
    pub(super) fn admit(&mut self, returns: Option<u32>) {
        // Of the reservation: when it could begin (s), and how many workers are left over then.
        let mut window: Option<(f64, usize)> = None;
        for row in 0..self.rows.len() {
            if self.rows[row].is_in || self.rows[row].waits.is_some() {
                continue;
            }
            if let Some(job) = returns {
                self.rows[row].waits = Some(format!("job {job}"));
                continue;
            }
            let claim = self.rows[row].claim;
            let needs = match self.needs(claim) {
                Ok(needs) => needs,
                Err(words) => {
                    self.rows[row].waits = Some(words);
                    continue;
                }
            };
            self.rows[row].needs = needs;
            if self.pinned() + needs <= self.workers.len() + self.spares().count() {
                while self.pinned() + needs > self.workers.len() && self.divide() {}
            }
            let fits = self.pinned() + needs <= self.workers.len();
            match &mut window {
                None if fits => self.rows[row].is_in = true,
                None => {
                    self.begins = if let Some(begins) = self.set_aside(row) {
                        // Nobody passes one for which others were stored.
                        window = Some((0.0, 0));
                        begins
                    } else {
                        window.insert(self.window(needs)).0
                    };
                    let told = if self.is_settled() { self.begins + self.collects() } else { f64::INFINITY };
                    self.done.reserved = Some((claim.job, told));
                    for other in self.behind(row) {
                        self.rows[other].passes = true;
                    }
                }
                Some((begins, over)) if fits => {
                    let least = self.workers.iter().map(|worker| worker.threads.max(1)).min().unwrap_or(1);
                    let takes = claim.left_s.map_or(f64::INFINITY, |left| left / f64::from(least));
                    let leaves_enough = takes > *begins && needs <= *over;
                    if leaves_enough {
                        *over -= needs;
                    }
                    let passes = takes <= *begins || leaves_enough;
                    (self.rows[row].is_in, self.rows[row].passes) = (passes, passes);
                }
                Some(_) => {}
            }
        }
    }

    /// Workers that a job needs, by its options and by memory.
    ///
    /// # Errors
    /// What it waits for, if all workers together are not enough.
    fn needs(&self, claim: &Claim<'_>) -> Result<usize, String> {
        let n = self.workers.len();
        let needs = claim.needs();
        if needs > n {
            if let Some(names) = claim.before.filter(|names| !names.is_empty()) {
                return Err(format!("its workers: 0 of {} are back", names.len()));
            }
            let workers = if needs == 1 { "worker" } else { "workers" };
            return Err(format!("{needs} {workers}, {} are idle", self.idle.len()));
        }
        let mut fastest: Vec<usize> = (0..n).collect();
        fastest.sort_by(|&a, &b| self.speed(b).total_cmp(&self.speed(a)));
        let enough = (needs..=n).find(|&n| self.lack(claim, fastest[..n].iter().copied()).is_none());
        enough.ok_or_else(|| self.lack(claim, fastest.into_iter()).unwrap_or_default())
    }

    /// When a job that needs so many workers could begin (s), if jobs end as they say, and how many are left over then.
    fn window(&mut self, needs: usize) -> (f64, usize) {
        let mut running: Vec<&mut Row<'_>> = self.rows.iter_mut().filter(|row| row.is_in).collect();
        let left = |row: &Row<'_>| row.claim.left_s.filter(|_| row.claim.runs).unwrap_or(f64::INFINITY);
        running.sort_by(|a, b| left(a).total_cmp(&left(b)));
        let mut free = self.workers.len() - running.iter().map(|row| row.floor()).sum::<usize>();
        for row in running {
            free += row.floor();
            row.is_awaited = true;
            if free >= needs {
                return (left(row), free - needs);
            }
        }
        (f64::INFINITY, 0)
    }

    /// How long workers take to come that are lent to jobs until a reservation (s): to a plan boundary, and until what is being dealt out
    /// has been.
    fn collects(&self) -> f64 {
        let gives = |row: &&Row<'_>| row.claim.runs && !row.is_awaited;
        self.rows.iter().filter(gives).map(|row| 2.0 * row.deals()).fold(0.0, f64::max)
    }

    /// Whether each job that is in has its workers for now. While some are on their way nobody knows how long those take that they leave.
    pub(super) fn is_settled(&self) -> bool {
        self.rows.iter().all(|row| !row.is_in || row.claim.runs)
            && self.workers.iter().all(|worker| !matches!(worker.stands, Stands::Called { .. }))
    }
}
