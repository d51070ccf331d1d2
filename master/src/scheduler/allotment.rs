//! Which job has which workers: who starts on which, who is given more, who gives some up, and what each of the others waits for.
//!
//! [`arrange`] is a pure function of jobs and workers. It keeps nothing, so it is asked again whenever something has changed.
//! Its rules:
//!
//! - Each job has a *part* of the speeds: as much as it uses well ([`USED_WELL`]), else as much as the others. Owners
//!   have equal parts, whatever they submit; a job of higher priority has its part before the others.
//! - A job has workers of one region, because links between regions are slow; of another one too only if it needs more by its options or by
//!   memory.
//! - Jobs start in their order as long as each that runs keeps as many workers as it needs. One that starts takes what is idle, and
//!   calls workers of jobs that have more than their part; these go at the next plan boundary of their job.
//! - A job for which there are workers enough, but not beside those that run, has a *reservation*: jobs behind it start before it only if
//!   they end before it could begin, or leave it enough workers. Where jobs that came after it are all that keeps it from beginning, as many of
//!   them are stored and wait behind it. The jobs whose end it awaits give no worker to a job that can do without, and what is idle is lent
//!   only to jobs that are dealt out quickly enough to give it back.
//! - What is idle after that is given to those that have least of their part, as far as it helps them at all ([`HELPS`]).
//! - Work is dealt out anew where workers change, so a job whose end is near keeps those that it has.
//! - A job on one worker of which it uses half of the threads at most leaves the others to a job that lacks a worker; idle threads go back to
//!   the job on the same host, if they make it faster and nobody waits ([`slots`]).

use std::{collections::BTreeMap, time::Duration};

use crate::{
    footprint::{self, Bearer},
    progress::span,
};

pub use slots::Threads;
use turns::in_order;

mod admission;
mod aside;
mod calls;
mod idle;
mod parts;
mod slots;
#[cfg(test)]
mod tests;
mod turns;

/// Elements for each thread that a job uses well: 2,000 take some 120 us of a cycle, and a vote and its answer on an office network as long.
pub const USED_WELL: u64 = 2_000;
/// Elements for each thread that makes a job faster at all, where nobody else wants it.
pub const HELPS: u64 = 500;
/// How long an interrupted job waits for all of its workers before it goes on with those that are back; later ones are taken
/// in at plan boundaries.
const RETURN_LIMIT: Duration = Duration::from_secs(2);
/// Seconds for which dealing a job out anew holds it, by element: its state travels to the master and to the workers, some 600 bytes, at 1 Gb/s.
const DEAL: f64 = 5e-6;
/// Seconds for which it holds any job.
const DEAL_ANY: f64 = 0.2;
/// A job is given workers of another one when it has less than this of its part.
const SHORT_OF_ITS_PART: f64 = 0.5;
/// By how much a job may have more than its part for want of a worker that fits.
const SLACK: f64 = 1.1;
/// By how much faster a worker is for which a job gives another one up.
const FASTER: f64 = 1.5;

/// A worker that is connected.
#[derive(Clone, Copy, Debug)]
pub struct Worker<'a> {
    pub incarnation: u32,
    pub bearer: Bearer<'a>,
    pub threads: u32,
    pub stands: Stands,
    /// The slots of one process have the same number.
    pub process: u64,
    /// Whether it can give threads to another slot.
    pub divides: bool,
    /// Of the workers with fast links to each other.
    pub region: &'a str,
}

/// What a worker does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stands {
    Idle,
    /// It computes a job.
    At(u32),
    /// It computes the first job until a plan boundary, and is then for the second, or for whoever needs it.
    Called {
        from: u32,
        to: Option<u32>,
    },
    /// It is the slot that a division is about to open.
    Due,
}

/// A job that runs or waits.
#[derive(Clone, Debug)]
pub struct Claim<'a> {
    pub job: u32,
    pub elements: u64,
    /// Fewest and most workers.
    pub workers: [usize; 2],
    /// The least speed and the least memory (bytes) of its workers together; 0 for any.
    pub speed: f64,
    pub memory: u64,
    pub priority: i32,
    /// Who submitted it.
    pub owner: &'a str,
    pub runs: bool,
    /// Seconds to its end: of one that runs, with its workers; of one that waits, on one thread; none where nobody knows.
    pub left_s: Option<f64>,
    /// Of one that was interrupted: the workers that it had.
    pub before: Option<&'a [String]>,
    /// Whether it was stored for one before it, and keeps its place behind that.
    pub aside: bool,
}

impl Claim<'_> {
    /// Threads of which each has at most so many of its elements.
    fn threads(&self, elements: u64) -> u32 {
        u32::try_from(self.elements.div_ceil(elements)).unwrap_or(u32::MAX).max(1)
    }

    /// Workers that it needs by its options: what was begun with enough goes on with any.
    fn needs(&self) -> usize {
        if self.runs || self.before.is_some() { 1 } else { self.workers[0].max(1) }
    }

    /// What these workers lack of the speed and the memory that its options ask for, in words.
    fn lack<'b>(&self, workers: impl Iterator<Item = &'b Bearer<'b>>) -> Option<String> {
        if self.before.is_some() {
            return None;
        }
        let (speed, memory) =
            workers.fold((0.0, 0), |(speed, memory), worker| (speed + worker.speed, memory + worker.memory));
        if speed < self.speed {
            return Some(format!(
                "workers of a speed of {} together, those that it can have come to {speed}",
                self.speed
            ));
        }
        (memory < self.memory).then(|| {
            format!(
                "workers with {:.1} GB for it together, those that it can have come to {:.1} GB",
                footprint::gigabytes(self.memory),
                footprint::gigabytes(memory)
            )
        })
    }
}

/// What is to be done.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Arrangement {
    /// Workers whose threads change, before anything else is done.
    pub threads: Vec<Threads>,
    /// Jobs that start, and the workers that each starts on.
    pub starts: Vec<(u32, Vec<u32>)>,
    /// Workers that are given to jobs that run.
    pub joins: Vec<(u32, u32)>,
    pub calls: Vec<Call>,
    /// Jobs that are stored at their next cycle, for one that came before them.
    pub stores: Vec<u32>,
    /// What each of the others waits for.
    pub waits: Vec<(u32, String)>,
    /// The job for which there are workers enough, but not beside those that run, and when it could begin (s) if jobs end as they say;
    /// infinite where that is not known yet.
    pub reserved: Option<(u32, f64)>,
}

/// A worker that is to leave a job for another one, or because the job has a faster one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Call {
    pub worker: u32,
    pub from: u32,
    pub to: Option<u32>,
}

/// What is to be done with these jobs, waiting ones in the order in which they came, and these workers, so long after the master's
/// start and with so much memory `available` to the master.
pub fn arrange(
    claims: &[Claim<'_>],
    workers: &[Worker<'_>],
    since_start: Duration,
    available: Option<u64>,
) -> Arrangement {
    let mut table = Table::new(claims, workers, available);
    let returns = table.take_back(since_start);
    table.admit(returns);
    table.share();
    table.start();
    table.fill();
    table.give_idle();
    table.even_out();
    table.give_threads();
    table.tell(returns);
    table.done
}

/// A job in the making of an arrangement.
struct Row<'a> {
    claim: &'a Claim<'a>,
    /// Indices of the workers that it has and keeps, of those that are called to it, and of those that it is given now.
    has: Vec<usize>,
    coming: Vec<usize>,
    given: Vec<usize>,
    /// Workers that it needs, by its options and by memory.
    needs: usize,
    /// Runs, or may start now.
    is_in: bool,
    /// It has passed the one with the reservation, or runs and came after it.
    passes: bool,
    /// The one with the reservation waits for its end.
    is_awaited: bool,
    /// Its part of the speeds.
    part: f64,
    /// The speed with which it would take the time that it says it does.
    told_with: f64,
    /// What it waits for.
    waits: Option<String>,
}

impl Row<'_> {
    fn all(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        self.has.iter().chain(&self.coming).chain(&self.given).copied()
    }

    fn n(&self) -> usize {
        self.has.len() + self.coming.len() + self.given.len()
    }

    /// Whether it ends before other workers could be worth the time in which work is dealt out anew.
    fn ends_soon(&self) -> bool {
        self.claim.runs && self.claim.left_s.is_some_and(|left| left < 2.0 * self.deals())
    }

    /// Whether it lasts so long that having its part is worth dealing out two jobs anew.
    fn is_worth_changing(&self) -> bool {
        self.claim.left_s.is_none_or(|left| left > 20.0 * self.deals())
    }

    /// Seconds for which dealing the job out anew holds it.
    fn deals(&self) -> f64 {
        DEAL_ANY + DEAL * self.claim.elements as f64
    }

    /// Workers that nobody may take from it.
    fn floor(&self) -> usize {
        let keeps = self.claim.workers[0].min(self.has.len());
        if self.claim.runs { keeps.max(1) } else { self.needs }
    }
}

struct Table<'a> {
    /// Those that run, then those that wait, in the order in which they are to start.
    rows: Vec<Row<'a>>,
    workers: Vec<Worker<'a>>,
    /// Indices of workers that are idle and not given away: the region with most speed first, in each the fastest first.
    idle: Vec<usize>,
    available: Option<u64>,
    /// When the job with the reservation could begin (s).
    begins: f64,
    done: Arrangement,
}

impl<'a> Table<'a> {
    fn new(claims: &'a [Claim<'a>], workers: &[Worker<'a>], available: Option<u64>) -> Self {
        let (workers, threads) = slots::united(workers);
        let of = |job: u32, stands: &dyn Fn(Stands) -> Option<u32>| -> Vec<usize> {
            (0..workers.len()).filter(|&w| stands(workers[w].stands) == Some(job)).collect()
        };
        let row = |claim: &'a Claim<'a>| Row {
            claim,
            has: of(claim.job, &|stands| if let Stands::At(job) = stands { Some(job) } else { None }),
            coming: of(claim.job, &|stands| {
                if let Stands::Called { to, .. } = stands { to } else { None }
            }),
            given: Vec::new(),
            needs: claim.needs(),
            is_in: claim.runs,
            passes: false,
            is_awaited: false,
            part: 0.0,
            told_with: 1.0,
            waits: None,
        };
        let mut idle: Vec<usize> =
            (0..workers.len()).filter(|&w| workers[w].stands == Stands::Idle).collect();
        let speed = |worker: usize| workers[worker].bearer.speed;
        let mut of_region: BTreeMap<&str, f64> = BTreeMap::new();
        idle.iter()
            .for_each(|&worker| *of_region.entry(workers[worker].region).or_default() += speed(worker));
        idle.sort_by(|&a, &b| {
            let [here, there] = [a, b].map(|worker| workers[worker].region);
            let regions = of_region[there].total_cmp(&of_region[here]).then(here.cmp(there));
            regions.then(speed(b).total_cmp(&speed(a)))
        });
        let mut rows: Vec<Row<'_>> = in_order(claims).into_iter().map(row).collect();
        for row in rows.iter_mut().filter(|row| row.claim.runs) {
            let leaves = |w: &usize| matches!(workers[*w].stands, Stands::Called { from, .. } if from == row.claim.job);
            let leave = (0..workers.len()).filter(leaves);
            row.told_with = row.has.iter().copied().chain(leave).map(|w| workers[w].bearer.speed).sum();
        }
        Self {
            rows,
            workers,
            idle,
            available,
            begins: f64::INFINITY,
            done: Arrangement { threads, ..Arrangement::default() },
        }
    }

    fn speed(&self, worker: usize) -> f64 {
        self.workers[worker].bearer.speed
    }

    fn are_near(&self, one: usize, other: usize) -> bool {
        self.workers[one].region == self.workers[other].region
    }

    /// Whether a worker is in a region in which a job has others, or the job has none.
    fn is_near(&self, row: usize, worker: usize) -> bool {
        let mut others = self.rows[row].all().peekable();
        others.peek().is_none() || others.any(|other| self.are_near(other, worker))
    }

    fn speed_of(&self, row: usize) -> f64 {
        self.rows[row].all().map(|worker| self.speed(worker)).sum()
    }

    /// What a job would lack with these workers, in words.
    fn shortage(&self, claim: &Claim<'_>, workers: impl Iterator<Item = usize>) -> Option<String> {
        let bearers: Vec<Bearer<'_>> = workers.map(|worker| self.workers[worker].bearer).collect();
        // One that runs has its master's memory already.
        let available = self.available.filter(|_| !claim.runs);
        footprint::shortage(claim.elements, available, &bearers)
    }

    /// The same, or what they lack of what the job's options ask for.
    fn lack(&self, claim: &Claim<'_>, workers: impl Iterator<Item = usize> + Clone) -> Option<String> {
        claim
            .lack(workers.clone().map(|worker| &self.workers[worker].bearer))
            .or_else(|| self.shortage(claim, workers))
    }

    /// Starts interrupted jobs on the workers that they had; gives the first that still waits for some.
    fn take_back(&mut self, since_start: Duration) -> Option<u32> {
        let mut returns = None;
        if since_start >= RETURN_LIMIT {
            return returns;
        }
        for row in 0..self.rows.len() {
            let Some(names) = self.rows[row].claim.before.filter(|names| !names.is_empty()) else { continue };
            let is_its = |&worker: &usize| names.iter().any(|name| name == self.workers[worker].bearer.name);
            let back: Vec<usize> = self.idle.iter().copied().filter(is_its).collect();
            let claim = self.rows[row].claim;
            if back.len() < names.len() {
                self.rows[row].waits =
                    Some(format!("its workers: {} of {} are back", back.len(), names.len()));
                // What it had is kept for it.
                self.idle.retain(|worker| !back.contains(worker));
                returns = returns.or(Some(claim.job));
            } else if self.shortage(claim, back.iter().copied()).is_none() {
                self.idle.retain(|worker| !back.contains(worker));
                self.rows[row].given = back;
                self.rows[row].is_in = true;
            }
        }
        returns
    }

    /// Says which part of the speeds each job has that is in.
    fn share(&mut self) {
        let n = self.workers.len().max(1) as f64;
        let total: f64 = (0..self.workers.len()).map(|worker| self.speed(worker)).sum();
        let threads: u32 = self.workers.iter().map(|worker| worker.threads.max(1)).sum();
        let (of_worker, of_thread) = (total / n, total / f64::from(threads.max(1)));
        let divides = self.workers.iter().any(|worker| worker.divides);
        let inside: Vec<usize> = (0..self.rows.len()).filter(|&row| self.rows[row].is_in).collect();
        let wants = inside.iter().map(|&row| {
            let Row { claim, needs, .. } = &self.rows[row];
            let used_well = f64::from(claim.threads(USED_WELL)) * of_thread;
            let of_needed =
                if divides && *needs == 1 { used_well.min(of_worker) } else { *needs as f64 * of_worker };
            let least = of_needed.max(claim.speed);
            let most = used_well.max(least).min(claim.workers[1] as f64 * of_worker);
            parts::Want { priority: claim.priority, owner: claim.owner, least, most }
        });
        let wants: Vec<parts::Want<'_>> = wants.collect();
        for (row, part) in inside.into_iter().zip(parts::of(&wants, total)) {
            self.rows[row].part = part;
        }
    }

    /// Gives jobs that are in and have no workers what is idle, and calls what they lack.
    fn start(&mut self) {
        for row in 0..self.rows.len() {
            let claim = self.rows[row].claim;
            // One that runs has lost its workers.
            if !self.rows[row].is_in || (claim.runs && self.rows[row].n() > 0) {
                continue;
            }
            if self.rows[row].given.is_empty() {
                let coming: f64 = self.rows[row].coming.iter().map(|&worker| self.speed(worker)).sum();
                self.rows[row].given = self.pick(row, self.rows[row].part - coming);
            }
            let lacks = |table: &Self| {
                let Row { given, needs, .. } = &table.rows[row];
                given.len() < *needs || table.lack(claim, given.iter().copied()).is_some()
            };
            while lacks(self) && self.rows[row].n() < claim.workers[1] && self.divide() {
                self.rows[row].given.extend(self.idle.pop());
            }
            if lacks(self) {
                self.call(row);
            }
        }
    }

    /// Takes idle workers for a job: those that fit into `part`, the fastest first, then as many as it needs.
    fn pick(&mut self, row: usize, part: f64) -> Vec<usize> {
        let Row { claim, needs, .. } = &self.rows[row];
        let (claim, needs, most) = (*claim, *needs, claim.workers[1]);
        let is_its = |worker: usize| {
            claim
                .before
                .is_some_and(|names| names.iter().any(|name| name == self.workers[worker].bearer.name))
        };
        let mut left = self.idle.clone();
        left.sort_by_key(|&worker| !is_its(worker));
        let (mut picked, mut speed) = (Vec::new(), 0.0);
        left.retain(|&worker| {
            let is_near = picked.first().is_none_or(|&first| self.are_near(first, worker));
            let fits = is_near && picked.len() < most && speed + self.speed(worker) <= SLACK * part;
            if fits {
                picked.push(worker);
                speed += self.speed(worker);
            }
            !fits
        });
        let lacks =
            |picked: &[usize]| picked.len() < needs || self.lack(claim, picked.iter().copied()).is_some();
        while lacks(&picked) && picked.len() < most {
            let Some(slowest) = left.pop() else { break };
            picked.push(slowest);
        }
        self.idle.retain(|worker| !picked.contains(worker));
        picked
    }

    /// Puts down who starts, who joins, and what each of the others waits for.
    fn tell(&mut self, returns: Option<u32>) {
        let is_there = |worker: &usize| self.workers[*worker].stands != Stands::Due;
        let incarnations = |workers: &[usize]| -> Vec<u32> {
            let there = workers.iter().copied().filter(is_there);
            there.map(|worker| self.workers[worker].incarnation).collect()
        };
        let idle = self.workers.iter().filter(|worker| worker.stands == Stands::Idle).count();
        let soonest = self.rows.iter().filter(|row| row.claim.runs);
        let soonest = soonest.filter_map(|row| row.claim.left_s.map(|left| (left, row.claim.job)));
        let soonest = soonest.min_by(|a, b| a.0.total_cmp(&b.0));
        // A job that gives workers up ends later than it says.
        if let Some((_, begins)) = &mut self.done.reserved
            && !self.done.calls.is_empty()
        {
            *begins = f64::INFINITY;
        }
        let mut ahead = 0;
        for row in &self.rows {
            let claim = row.claim;
            if claim.runs {
                self.done
                    .joins
                    .extend(incarnations(&row.given).into_iter().map(|worker| (worker, claim.job)));
                continue;
            }
            let given: Vec<usize> = row.given.iter().copied().filter(is_there).collect();
            let lacks = || given.len() < row.needs || self.lack(claim, given.iter().copied()).is_some();
            if row.is_in && !lacks() {
                self.done.starts.push((claim.job, incarnations(&row.given)));
                continue;
            }
            let words = match &row.waits {
                Some(words) => words.clone(),
                None if given.len() < row.given.len() => "threads that another worker leaves it".to_owned(),
                None if row.is_in => {
                    let mut from: Vec<u32> =
                        row.coming.iter().filter_map(|&worker| self.comes_from(worker)).collect();
                    from.sort_unstable();
                    from.dedup();
                    match &from[..] {
                        [] => ends(soonest),
                        jobs => format!("workers of {} at the next plan boundary", named(jobs)),
                    }
                }
                None => match self.done.reserved {
                    Some((job, begins)) if job == claim.job => {
                        let noun = if row.needs == 1 { "worker" } else { "workers" };
                        let when = match begins.is_finite() {
                            true => format!("expected to start in about {}", span(begins.max(1.0))),
                            false => ends(soonest),
                        };
                        format!("{} {noun}, {idle} are idle; {when}", row.needs)
                    }
                    Some((job, _)) => format!("job {job}"),
                    None => ends(soonest),
                },
            };
            // Which is the one before it.
            let waits_for_reserved =
                !row.is_in && self.done.reserved.is_some_and(|(job, _)| job != claim.job);
            let words = match ahead {
                0 => words,
                _ if returns.is_some() || row.waits.is_some() => words,
                1 if waits_for_reserved => words,
                1 => format!("{words}; 1 job is before it"),
                ahead => format!("{words}; {ahead} jobs are before it"),
            };
            ahead += 1;
            self.done.waits.push((claim.job, words));
        }
    }

    /// The job that a worker leaves.
    fn comes_from(&self, worker: usize) -> Option<u32> {
        match self.workers[worker].stands {
            Stands::Idle | Stands::Due => None,
            Stands::At(job) | Stands::Called { from: job, .. } => Some(job),
        }
    }
}

/// Which job ends first, and when.
fn ends(soonest: Option<(f64, u32)>) -> String {
    match soonest {
        Some((left, job)) => format!("job {job} ends in about {}", span(left.max(1.0))),
        None => "a job that ends".to_owned(),
    }
}

/// Jobs as a sentence names them.
fn named(jobs: &[u32]) -> String {
    let numbers: Vec<String> = jobs.iter().map(u32::to_string).collect();
    let noun = if jobs.len() == 1 { "job" } else { "jobs" };
    format!("{noun} {}", numbers.join(", "))
}
