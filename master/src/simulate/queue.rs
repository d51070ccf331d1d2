//! `--queue`: what the queue of a master makes of many jobs on the cluster's hosts: makespan over its bound, and who waits how long.
//!
//! Mixes of jobs are drawn from seeds. The master's own [`allotment`] decides; a job's cycle takes its elements over the speeds
//! of its workers, and a vote and its answer by the cluster's network. Workers come and go at plan boundaries, where
//! the state of the job travels to the master and back. Beside it stands one job at a time on all workers, first come first served.
//!
//! The bound is the greatest of these: all work that is still to come at any arrival over all speeds; each job alone on the workers that
//! suit it best.

use std::fmt::Write as _;

use serde::Serialize;

use super::cluster::Cluster;
use crate::{
    footprint::Bearer,
    scheduler::allotment::{self, Arrangement, Claim, Stands, Worker},
};

/// Cycles from one plan boundary to the next, as decks have it by default.
const PLAN_INTERVAL: f64 = 50.0;
/// Bytes of an element that travel when work is dealt out anew: its state to the master, and to its worker.
const BYTES_OF_ELEMENT: f64 = 600.0;
/// Seconds of an element-cycle at speed 1, as `--speed auto` has it: the cluster file's is that of old PCs, and what a job can use is
/// reckoned with those of today.
const ELEMENT_SECONDS: f64 = 100e-9;
/// Jobs of a mix: at least so many, and so many for each host.
const JOBS: (usize, f64) = (24, 6.0);
/// Elements of a job, from and to; cycles likewise. Both are drawn evenly by their logarithm.
const ELEMENTS: [f64; 2] = [27.0, 1e6];
const CYCLES: [f64; 2] = [2_000.0, 200_000.0];
/// Of jobs with so many elements for each host one of so many wants at least a third to two thirds of the hosts.
const WIDE: (f64, f64) = (2_000.0, 4.0);
/// An estimate of a job's time is wrong by at most this factor, either way.
const ESTIMATE: f64 = 2.0;

/// A job of a mix.
#[derive(Clone, Debug)]
struct Job {
    arrives: f64,
    elements: f64,
    cycles: f64,
    least: usize,
    /// What its forecast is wrong by.
    estimate: f64,
    /// Cycles done, and the workers that do them.
    done: f64,
    has: Vec<usize>,
    started: Option<f64>,
    /// It was stored for one before it.
    aside: bool,
    ended: Option<f64>,
    /// Work is being dealt out until then.
    deals_until: f64,
    /// Hosts that were given to it, to be taken in at the next boundary.
    joining: Vec<usize>,
    /// When it was promised to start at the latest, while it had the reservation.
    promised: Option<f64>,
}

impl Job {
    fn runs(&self) -> bool {
        !self.has.is_empty() && self.ended.is_none()
    }
}

/// Who decides.
type Policy = fn(&[Claim<'_>], &[Worker<'_>]) -> Arrangement;

/// One mix.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    pub seed: u64,
    pub jobs: usize,
    pub hosts: usize,
    /// Seconds that no arrangement undercuts.
    pub bound_s: f64,
    /// Makespan over the bound, and the same of one job at a time.
    pub over_bound: f64,
    pub one_at_a_time: f64,
    /// Mean of the times from arrival to end (s), and the same of one job at a time.
    pub mean_s: f64,
    pub mean_one_at_a_time_s: f64,
    /// The longest wait over the makespan.
    pub longest_wait: f64,
    /// Of jobs with a reservation: how many, and how much later than was promised the latest began (s).
    pub reservations: usize,
    pub latest_s: f64,
}

/// Numbers of a seed, from 0 to 1.
struct Draws(u64);

impl Draws {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, [from, to]: [f64; 2]) -> f64 {
        from * libm::pow(to / from, self.next())
    }
}

/// What things take on the hosts of a cluster file.
struct Costs<'a> {
    cluster: &'a Cluster,
}

impl Costs<'_> {
    /// A vote and its answer with so many workers.
    fn vote(&self, workers: usize) -> f64 {
        2.0 * (self.cluster.network.latency + self.cluster.network.message * workers as f64)
    }

    /// A cycle of a job on these workers.
    fn cycle(&self, elements: f64, workers: &[usize]) -> f64 {
        let speed: f64 = workers.iter().map(|&worker| self.cluster.speeds[worker]).sum();
        elements * ELEMENT_SECONDS / speed + self.vote(workers.len())
    }

    /// Dealing a job out anew.
    fn deal(&self, elements: f64) -> f64 {
        elements * BYTES_OF_ELEMENT * 8.0 / self.cluster.network.rate + self.vote(1)
    }

    /// What no arrangement of these jobs undercuts.
    fn bound(&self, jobs: &[Job]) -> f64 {
        let total: f64 = self.cluster.speeds.iter().sum();
        let mut slowest = self.cluster.speeds.clone();
        slowest.sort_by(f64::total_cmp);
        // Whoever computes a cycle is held for a vote at least, and so are as many as the job wants.
        let work = |job: &Job| {
            let held: f64 = slowest[..job.least].iter().sum();
            job.cycles * (job.elements * ELEMENT_SECONDS + held * self.vote(job.least))
        };
        let mut fastest: Vec<usize> = (0..self.cluster.speeds.len()).collect();
        fastest.sort_by(|&a, &b| self.cluster.speeds[b].total_cmp(&self.cluster.speeds[a]));
        let alone = |job: &Job| {
            let of = |n: usize| job.cycles * self.cycle(job.elements, &fastest[..n]);
            (job.least..=fastest.len()).map(of).fold(f64::INFINITY, f64::min)
        };
        let of_arrival = |first: &Job| {
            let later = jobs.iter().filter(|job| job.arrives >= first.arrives);
            (first.arrives + later.map(work).sum::<f64>() / total).max(first.arrives + alone(first))
        };
        jobs.iter().map(of_arrival).fold(0.0, f64::max)
    }
}

/// The jobs of a seed.
fn mix(seed: u64, costs: &Costs<'_>) -> Vec<Job> {
    let hosts = costs.cluster.speeds.len();
    let n = JOBS.0.max((JOBS.1 * hosts as f64) as usize);
    let mut draws = Draws(seed);
    let mut job = || {
        let (elements, cycles) = (draws.between(ELEMENTS).round(), draws.between(CYCLES).round());
        let wide = draws.next() * WIDE.1 < 1.0 && elements > WIDE.0 * hosts as f64;
        let least = if wide { (hosts as f64 * (1.0 + draws.next()) / 3.0).ceil() as usize } else { 1 };
        let estimate = draws.between([1.0 / ESTIMATE, ESTIMATE]);
        Job {
            arrives: draws.next(),
            elements,
            cycles,
            least,
            estimate,
            done: 0.0,
            has: Vec::new(),
            started: None,
            aside: false,
            ended: None,
            deals_until: 0.0,
            joining: Vec::new(),
            promised: None,
        }
    };
    let mut jobs: Vec<Job> = (0..n).map(|_| job()).collect();
    // Half of them are there at the start, the others come while the first half of the work is done.
    let half =
        0.5 * costs.bound(&jobs.iter().map(|job| Job { arrives: 0.0, ..job.clone() }).collect::<Vec<_>>());
    for (i, job) in jobs.iter_mut().enumerate() {
        job.arrives = if i % 2 == 0 { 0.0 } else { job.arrives * half };
    }
    jobs.sort_by(|a, b| a.arrives.total_cmp(&b.arrives));
    jobs
}

/// A mix under way.
struct Course<'a> {
    costs: &'a Costs<'a>,
    jobs: Vec<Job>,
    stands: Vec<Stands>,
    now: f64,
}

impl Course<'_> {
    /// When a job comes to its end, and to its next plan boundary if it has to change its workers there.
    fn next_of(&self, index: usize) -> f64 {
        let (job, number) = (&self.jobs[index], index as u32 + 1);
        let from = self.now.max(job.deals_until);
        let cycle = self.costs.cycle(job.elements, &job.has);
        let changes = !job.joining.is_empty()
            || self
                .stands
                .iter()
                .any(|stands| matches!(stands, Stands::Called { from, .. } if *from == number));
        let to_end = job.cycles - job.done;
        let boundary = PLAN_INTERVAL - job.done % PLAN_INTERVAL;
        from + cycle * if changes { boundary.min(to_end) } else { to_end }
    }

    /// Time passes.
    fn pass(&mut self, until: f64) {
        for job in self.jobs.iter_mut().filter(|job| job.runs()) {
            let computes = until - self.now.max(job.deals_until);
            if computes > 0.0 {
                job.done += computes / self.costs.cycle(job.elements, &job.has);
            }
        }
        self.now = until;
    }

    /// A job is at its end, or at a plan boundary where its workers change.
    fn arrive(&mut self, index: usize) {
        let number = index as u32 + 1;
        let now = self.now;
        let job = &mut self.jobs[index];
        if job.cycles - job.done < 1e-6 * job.cycles {
            job.ended = Some(now);
            self.free(number);
            return;
        }
        job.done = (job.done / PLAN_INTERVAL).round() * PLAN_INTERVAL;
        job.has.append(&mut job.joining);
        for (worker, stands) in self.stands.iter_mut().enumerate() {
            if matches!(stands, Stands::Called { from, .. } if *from == number) {
                job.has.retain(|&other| other != worker);
                *stands = Stands::Idle;
            }
        }
        job.deals_until = now + self.costs.deal(job.elements);
    }

    /// The workers of a job are idle.
    fn free(&mut self, number: u32) {
        for stands in &mut self.stands {
            if matches!(stands, Stands::At(job) | Stands::Called { from: job, .. } if *job == number) {
                *stands = Stands::Idle;
            }
        }
    }

    /// A job is stored where it is.
    fn store(&mut self, number: u32) {
        let job = &mut self.jobs[number as usize - 1];
        job.done = job.done.floor();
        job.has.clear();
        job.joining.clear();
        job.aside = true;
        self.free(number);
    }

    /// Lets the policy change what it will; true if it is to be asked again, for jobs were stored.
    fn arrange(&mut self, policy: Policy) -> bool {
        let claims: Vec<Claim<'_>> = self
            .jobs
            .iter()
            .enumerate()
            .filter(|(_, job)| job.arrives <= self.now && job.ended.is_none())
            .map(|(index, job)| Claim {
                speed: 0.0,
                memory: 0,
                job: index as u32 + 1,
                elements: job.elements as u64,
                workers: [job.least, usize::MAX],
                priority: 0,
                owner: "",
                runs: job.runs(),
                left_s: Some(match job.runs() {
                    true => (job.cycles - job.done) * self.costs.cycle(job.elements, &job.has),
                    false => (job.cycles - job.done) * job.elements * ELEMENT_SECONDS * job.estimate,
                }),
                before: job.aside.then_some(&[]),
                aside: job.aside,
            })
            .collect();
        let worker = |(index, &stands): (usize, &Stands)| Worker {
            incarnation: index as u32,
            bearer: Bearer { name: "", speed: self.costs.cluster.speeds[index], memory: 0 },
            threads: 1,
            stands,
            process: index as u64,
            divides: false,
            region: "",
        };
        let workers: Vec<Worker<'_>> = self.stands.iter().enumerate().map(worker).collect();
        let Arrangement { starts, joins, calls, stores, reserved, .. } = policy(&claims, &workers);
        drop(claims);
        if let Some((job, begins)) = reserved.filter(|(_, begins)| begins.is_finite()) {
            self.jobs[job as usize - 1].promised.get_or_insert(self.now + begins);
        }
        for call in calls {
            self.stands[call.worker as usize] = Stands::Called { from: call.from, to: call.to };
        }
        for (worker, job) in joins {
            self.stands[worker as usize] = Stands::At(job);
            self.jobs[job as usize - 1].joining.push(worker as usize);
        }
        for (job, workers) in starts {
            workers.iter().for_each(|&worker| self.stands[worker as usize] = Stands::At(job));
            let deal = self.costs.deal(self.jobs[job as usize - 1].elements);
            let started = &mut self.jobs[job as usize - 1];
            started.has = workers.into_iter().map(|worker| worker as usize).collect();
            started.started.get_or_insert(self.now);
            (started.aside, started.deals_until) = (false, self.now + deal);
        }
        stores.iter().for_each(|&job| self.store(job));
        !stores.is_empty()
    }

    /// Plays the mix to its end.
    fn play(mut self, policy: Policy) -> Result<Vec<Job>, String> {
        while self.jobs.iter().any(|job| job.ended.is_none()) {
            while self.arrange(policy) {}
            let running = (0..self.jobs.len()).filter(|&index| self.jobs[index].runs());
            let next = running.map(|index| (self.next_of(index), Some(index)));
            let arrivals =
                self.jobs.iter().filter(|job| job.arrives > self.now).map(|job| (job.arrives, None));
            let next = next.chain(arrivals).min_by(|a, b| a.0.total_cmp(&b.0));
            let (at, index) = next.ok_or("the queue stands still though jobs wait: a bug")?;
            self.pass(at);
            if let Some(index) = index {
                self.arrive(index);
            }
        }
        Ok(self.jobs)
    }
}

/// As the master decides.
fn of_master(claims: &[Claim<'_>], workers: &[Worker<'_>]) -> Arrangement {
    allotment::arrange(claims, workers, std::time::Duration::MAX, None)
}

/// One job at a time on all workers.
fn one_at_a_time(claims: &[Claim<'_>], workers: &[Worker<'_>]) -> Arrangement {
    let mut arrangement = Arrangement::default();
    if !claims.iter().any(|claim| claim.runs)
        && let Some(first) = claims.first()
    {
        arrangement.starts.push((first.job, workers.iter().map(|worker| worker.incarnation).collect()));
    }
    arrangement
}

/// Plays so many mixes on the hosts of a cluster.
///
/// # Errors
/// If a queue stands still: a bug.
pub fn run(cluster: &Cluster, seeds: u64) -> Result<Vec<Row>, String> {
    let costs = Costs { cluster };
    (1..=seeds).map(|seed| row(seed, &costs)).collect()
}

fn row(seed: u64, costs: &Costs<'_>) -> Result<Row, String> {
    let jobs = mix(seed, costs);
    let hosts = costs.cluster.speeds.len();
    let play = |policy| {
        let stands = vec![Stands::Idle; hosts];
        Course { costs, jobs: jobs.clone(), stands, now: 0.0 }.play(policy)
    };
    let makespan = |jobs: &[Job]| jobs.iter().filter_map(|job| job.ended).fold(0.0, f64::max);
    let mean = |jobs: &[Job]| {
        jobs.iter().filter_map(|job| Some(job.ended? - job.arrives)).sum::<f64>() / jobs.len() as f64
    };
    let (ours, others) = (play(of_master)?, play(one_at_a_time)?);
    let bound = costs.bound(&jobs);
    let waits = ours.iter().filter_map(|job| Some(job.started? - job.arrives));
    let late: Vec<f64> = ours.iter().filter_map(|job| Some(job.started? - job.promised?)).collect();
    Ok(Row {
        seed,
        jobs: jobs.len(),
        hosts,
        bound_s: bound,
        over_bound: makespan(&ours) / bound,
        one_at_a_time: makespan(&others) / bound,
        mean_s: mean(&ours),
        mean_one_at_a_time_s: mean(&others),
        longest_wait: waits.fold(0.0, f64::max) / makespan(&ours),
        reservations: late.len(),
        latest_s: late.into_iter().filter(|late| late.is_finite()).fold(0.0, f64::max),
    })
}

/// The rows in a few lines: medians and the worst.
pub fn print(title: &str, rows: &[Row]) -> String {
    let spread = |of: fn(&Row) -> f64| {
        let mut values: Vec<f64> = rows.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        let last = values.len().saturating_sub(1);
        [0, last / 2, last].map(|i| values.get(i).copied().unwrap_or(f64::NAN))
    };
    let (jobs, hosts) = rows.first().map_or((0, 0), |row| (row.jobs, row.hosts));
    let mut text = format!("{title}\n{} mixes of {jobs} jobs on {hosts} hosts, modelled\n", rows.len());
    let _ = writeln!(text, "{:36} {:>8} {:>8} {:>8}", "", "least", "middle", "most");
    type Line = (&'static str, fn(&Row) -> f64);
    let lines: [Line; 6] = [
        ("makespan over its bound", |row| row.over_bound),
        ("  one job at a time", |row| row.one_at_a_time),
        ("from arrival to end, mean (s)", |row| row.mean_s),
        ("  one job at a time (s)", |row| row.mean_one_at_a_time_s),
        ("longest wait over makespan", |row| row.longest_wait),
        ("start after its reservation (s)", |row| row.latest_s),
    ];
    for (name, of) in lines {
        let [least, middle, most] = spread(of);
        let _ = writeln!(text, "{name:36} {least:>8.3} {middle:>8.3} {most:>8.3}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::cluster;

    fn lab() -> Cluster {
        let text = include_str!("../../../deploy/clusters/mixed-lab.toml");
        cluster::read(text, "mixed-lab.toml").map_err(|faults| faults[0].to_string()).expect("a cluster file")
    }

    #[test]
    fn a_queue_comes_near_its_bound_and_nobody_starves() {
        let rows = run(&lab(), 12).expect("it comes to its end");
        for row in &rows {
            assert!(row.over_bound >= 1.0 - 1e-9, "nothing undercuts the bound: {row:?}");
            assert!(row.over_bound < 1.35 && row.one_at_a_time >= 1.0 - 1e-9, "{row:?}");
            assert!(row.longest_wait < 1.0 && row.mean_s < row.mean_one_at_a_time_s, "{row:?}");
        }
        assert_eq!(rows, run(&lab(), 12).expect("again"), "a seed says all");
        let text = print("lab", &rows);
        assert!(text.contains("makespan over its bound"), "{text}");
    }
}
