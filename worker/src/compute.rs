//! Does what a session asks: the domain, the lanes, the clock of compute threads.

use std::{
    sync::atomic::{AtomicU64, Ordering},
    time::Instant,
};

use mechanics::{
    cycle::{Domain, Load, Meter, Sets, Unmeasured},
    flip::Target,
    lanes::Width,
};
use protocol::{
    message::{Assign, Work, sampled_block},
    phase::Phase,
};
use system::clock::thread_cpu_ns;

use crate::{
    session::{Outcome, Task},
    sorter::Sorter,
    stopwatch::Lap,
    team::Team,
};

/// Elements of a worker from which on the memory of what was sent of them is looked after.
const MANY: usize = 1 << 17;

/// Counts thread-CPU time of compute threads (ns), and keeps them awake where they have nothing else to do.
#[derive(Debug, Default)]
pub struct ThreadClock {
    team: Option<Team>,
    all: AtomicU64,
    contact: AtomicU64,
    dealt: AtomicU64,
}

impl Meter for ThreadClock {
    fn start(&self) -> u64 {
        thread_cpu_ns()
    }

    fn stop(&self, mark: u64, contact: bool) {
        self.book(thread_cpu_ns().saturating_sub(mark), contact);
    }

    fn dealt(&self, mark: u64) {
        self.dealt.fetch_add(thread_cpu_ns().saturating_sub(mark), Ordering::Relaxed);
    }

    fn together(&self, n: usize, work: &(dyn Fn() + Sync)) {
        match &self.team {
            Some(team) => team.together(n, work),
            None => Unmeasured.together(n, work),
        }
    }

    fn stop_dealt(&self, mark: u64, contact: bool) {
        let now = thread_cpu_ns();
        self.book(now.saturating_sub(mark), contact);
        self.dealt.fetch_add(now.saturating_sub(mark), Ordering::Relaxed);
    }
}

impl ThreadClock {
    /// The same threads, nothing counted.
    fn afresh(&self) -> Self {
        Self { team: self.team.clone(), ..Self::default() }
    }

    fn book(&self, used: u64, contact: bool) {
        self.all.fetch_add(used, Ordering::Relaxed);
        if contact {
            self.contact.fetch_add(used, Ordering::Relaxed);
        }
    }

    /// Thread-CPU time that the thread which runs tasks spent where all threads work (ns): what else it spends is serial.
    pub fn dealt_ns(&self) -> u64 {
        self.dealt.load(Ordering::Relaxed)
    }

    /// What has been counted so far.
    pub fn work(&self) -> Work {
        Work {
            compute_ns: self.all.load(Ordering::Relaxed),
            contact_ns: self.contact.load(Ordering::Relaxed),
        }
    }
}

/// Positions for a sort, if one is due; a blocking one replaces those under way.
fn gathered(domain: &mut Domain, gather: bool, blocking: bool, clock: &ThreadClock) -> Vec<f64> {
    if blocking {
        domain.end_surface();
    }
    if gather { domain.gather(clock) } else { Vec::new() }
}

/// A worker's domain and clock. `run` is called by one thread at a time; blocks spread over the current rayon pool.
#[derive(Default)]
pub struct Machine {
    domain: Option<Domain>,
    /// Where this worker sorts what it holds.
    sorter: Option<Sorter>,
    clock: ThreadClock,
    laps: Laps,
}

/// Phases of the tasks since they were last taken.
#[derive(Default)]
struct Laps(Vec<Lap>);

impl Laps {
    fn time<T>(&mut self, phase: Phase, work: impl FnOnce() -> T) -> T {
        let from = Instant::now();
        let result = work();
        self.0.push(Lap { phase, from, to: Instant::now() });
        result
    }
}

impl Machine {
    /// Without a job, on a pool that computes for others as well.
    pub fn new() -> Self {
        Self::default()
    }

    /// Without a job, on a pool that computes for nobody else: between two dealings of a cycle this team keeps its threads awake.
    pub fn alone(team: Team) -> Self {
        Self { clock: ThreadClock { team: Some(team), ..ThreadClock::default() }, ..Self::default() }
    }

    /// The calling thread is in another pool now, which this team keeps awake: places for its threads would go to members in the pool before.
    pub fn change_team(&mut self, team: Team) {
        self.clock.team = Some(team);
    }

    /// Drops the domain, and what has been counted.
    pub fn forget(&mut self) {
        *self = Self { clock: self.clock.afresh(), ..Self::default() };
    }

    /// What the domain holds; nothing without one.
    pub fn load(&self) -> Load {
        self.domain.as_ref().map(Domain::load).unwrap_or_default()
    }

    /// Thread-CPU time of its tasks so far, over all epochs of a job; what it takes to load them is not in it.
    pub fn work(&self) -> Work {
        self.clock.work()
    }

    /// See [`ThreadClock::dealt_ns`].
    pub fn dealt_ns(&self) -> u64 {
        self.clock.dealt_ns()
    }

    /// What the tasks since the last call took, by wall clock, in their order.
    pub fn take_laps(&mut self) -> impl Iterator<Item = Lap> + use<> {
        std::mem::take(&mut self.laps.0).into_iter()
    }

    /// See [`Domain::plant_fault`].
    #[doc(hidden)]
    pub fn plant_fault(&mut self) {
        self.domain.iter_mut().for_each(Domain::plant_fault);
    }

    /// See [`Domain::flip_bit`]; nothing without a domain.
    #[doc(hidden)]
    pub fn flip_bit(&mut self, target: Target, place: u64, bit: u32) -> bool {
        self.domain.as_mut().is_some_and(|domain| domain.flip_bit(target, place, bit))
    }

    /// Does one task. Failures are outcomes.
    pub fn run(&mut self, task: Task) -> Outcome {
        self.try_run(task).unwrap_or_else(Outcome::Failed)
    }

    fn try_run(&mut self, task: Task) -> Result<Outcome, String> {
        if let Task::Load { assign, prepare } = task {
            return self.build(*assign, prepare);
        }
        if let Task::WorkerState { last: true } = task {
            let domain = self.domain.take().ok_or("a state without an assignment")?;
            let pieces = self.laps.time(Phase::Other, || domain.into_pieces());
            return Ok(Outcome::WorkerState { pieces, work: self.clock.work() });
        }
        let (clock, laps) = (&self.clock, &mut self.laps);
        let domain = self.domain.as_mut().ok_or("a task without an assignment")?;
        let sorter = || "a task of a sort where the master sorts".to_owned();
        Ok(match task {
            Task::Load { .. } => return Err("a second assignment".to_owned()),
            Task::Transfer { nodes } => {
                Outcome::Transferred(laps.time(Phase::Other, || domain.transfer(&nodes))?)
            }
            Task::Elements { dt_previous, quanta, time } => {
                domain.begin(quanta, time);
                laps.time(Phase::Interior, || domain.elements(Sets::All, dt_previous, clock));
                Outcome::Computed
            }
            Task::Install { mut plan, sorted, ghost_state, dt_previous, gather, blocking } => {
                laps.time(Phase::Contact, || {
                    let (mark, dealt) = (clock.start(), clock.dealt_ns());
                    if let Some((gathered_at, around)) = sorted {
                        let sorter = self.sorter.as_mut().ok_or_else(sorter)?;
                        sorter.complete(gathered_at, &around, &mut plan)?;
                    }
                    domain.install(&plan, &ghost_state, clock)?;
                    // What was dealt has been booked.
                    clock.stop(mark + (clock.dealt_ns() - dealt), true);
                    let gathered = gathered(domain, gather, blocking, clock);
                    domain.contact(dt_previous, clock);
                    Ok::<_, String>(Outcome::Forces { partials: domain.partials(clock), gathered })
                })?
            }
            Task::Border { dt_previous, quanta, time, gather, blocking } => {
                let gathered = laps.time(Phase::Contact, || {
                    let gathered = gathered(domain, gather, blocking, clock);
                    domain.begin(quanta, time);
                    domain.contact(dt_previous, clock);
                    gathered
                });
                laps.time(Phase::Border, || {
                    domain.elements(Sets::Border, dt_previous, clock);
                    Outcome::Forces { partials: domain.partials(clock), gathered }
                })
            }
            Task::Interior { dt_previous } => {
                laps.time(Phase::Interior, || domain.elements(Sets::Interior, dt_previous, clock));
                Outcome::Computed
            }
            Task::Integrate { totals, dt_previous, dt, walls } => {
                let vote = laps
                    .time(Phase::Integrate, || domain.integrate(&totals, dt_previous, dt, &walls, clock))?;
                Outcome::Integrated(Box::new(vote))
            }
            Task::Sample { cycle } => laps.time(Phase::Other, || match domain.n_blocks() {
                0 => Ok::<_, String>(Outcome::Sampled([0; 16])),
                n => Ok(Outcome::Sampled(domain.sample(sampled_block(cycle, n))?)),
            })?,
            Task::Spread { cycle } => laps.time(Phase::Contact, || {
                let sorter = self.sorter.as_mut().ok_or_else(sorter)?;
                let mark = clock.start();
                let patches = sorter.spread(cycle, domain)?;
                clock.stop(mark, true);
                Ok::<_, String>(Outcome::Spread(patches))
            })?,
            Task::Sort { gathered_at, patches } => laps.time(Phase::Contact, || {
                let sorter = self.sorter.as_mut().ok_or_else(sorter)?;
                let mark = clock.start();
                let (sorted, wants) = sorter.sort(gathered_at, patches, domain)?;
                clock.stop(mark, true);
                Ok::<_, String>(Outcome::Sorted { gathered_at, sorted: Box::new(sorted), wants })
            })?,
            Task::WorkerState { .. } => laps
                .time(Phase::Other, || Outcome::WorkerState { pieces: domain.pieces(), work: clock.work() }),
        })
    }

    fn build(&mut self, assign: Assign, prepare: bool) -> Result<Outcome, String> {
        let width = match &assign.lanes {
            Some(name) => {
                let width: Width = name.parse().map_err(|e| format!("{e}"))?;
                if !width.available() {
                    return Err(format!("lanes {width}: this machine lacks them; it has {}", Width::best()));
                }
                width
            }
            None => Width::best(),
        };
        // The domain of the epoch before goes first: there need not be room for two.
        (self.domain, self.sorter) = (None, None);
        let clock = self.clock.afresh();
        let settings = assign.setup.contact.clone().filter(|_| assign.sorting.is_some());
        let mut domain = Domain::new(
            assign.setup,
            assign.n_parts as usize,
            assign.quanta,
            (assign.subdomains, assign.cycle),
            &assign.gauges,
            width,
        );
        if domain.n_elements() >= MANY {
            // Their pieces went as blocks were made of them.
            system::allocator::return_free_pages();
        }
        domain.place_bodies(&assign.bodies)?;
        domain.watch(&assign.watched);
        domain.install(&assign.plan, &assign.ghost_state, &clock)?;
        let vote = prepare.then(|| Box::new(domain.prepare(&clock)));
        if let Some(sorting) = assign.sorting {
            self.sorter = Some(Sorter::new(*sorting, settings.as_ref(), &domain)?);
        }
        self.domain = Some(domain);
        Ok(Outcome::Loaded { vote, lanes: width.to_string() })
    }
}
