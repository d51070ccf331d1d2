//! STARTING: does what [`allotment`] says: starts jobs, gives workers to those that run, calls workers away from them.

use std::{
    sync::{Arc, Mutex, atomic::AtomicBool},
    time::Instant,
};

use deck::physics::GRIND_NS;
use protocol::{
    message::ToWorker,
    order::Place,
    request::{Ended, State},
};
use tracing::{info, warn};

use super::{Running, Scheduler, allotment};
use crate::{
    drive::{self, Input, WorkerLink},
    footprint,
    hosts::{self, Host},
    notice::Notice,
    queue::{Change, Entry},
    scheduler::allotment::{Arrangement, Call, Claim, Stands, Threads, Worker},
    service::{self, Order},
    snapshot::store,
};

impl Scheduler {
    /// Has each job the workers that it is to have, and says what each of those that wait waits for.
    pub(super) fn arrange(&mut self) {
        let waiting = self.queue.waiting();
        if let Some(pause) = self.pause.as_ref().filter(|pause| Instant::now() < pause.until) {
            let what = format!("{}; tried again within {} s", pause.why, pause.seconds);
            return waiting.iter().for_each(|entry| self.wait_for(entry.id, what.clone()));
        }
        let running = self.running.keys().filter_map(|&job| self.queue.get(job));
        let claims: Vec<Claim<'_>> = running
            .map(|entry| self.claim(entry, true))
            .chain(waiting.iter().map(|entry| self.claim(entry, false)))
            .collect();
        let workers: Vec<Worker<'_>> = self.hosts.connected().filter_map(|host| self.worker(host)).collect();
        let available = footprint::available();
        let Arrangement { threads, starts, joins, calls, stores, waits, .. } =
            allotment::arrange(&claims, &workers, self.started.elapsed(), available);
        for threads in threads {
            self.set_threads(threads);
        }
        for (job, what) in waits {
            self.wait_for(job, what);
        }
        for job in stores {
            self.set_aside(job);
        }
        for call in calls {
            self.call(call);
        }
        for (incarnation, job) in joins {
            self.join(incarnation, job);
        }
        for (job, incarnations) in starts {
            let links = incarnations.iter().filter_map(|incarnation| self.worker_links.get(incarnation));
            self.start(job, links.cloned().collect());
        }
    }

    /// A job as [`allotment`] sees it.
    fn claim<'a>(&'a self, entry: &'a Entry, runs: bool) -> Claim<'a> {
        let options = &entry.options;
        let most = if options.max_workers == 0 { usize::MAX } else { options.max_workers as usize };
        let left_s = if runs {
            self.status.get(&entry.id).and_then(|status| status.borrow().left_s)
        } else {
            let done = self.status.get(&entry.id).map_or(0, |status| status.borrow().cycle);
            let work = entry.size.elements as f64 * entry.size.cycles.saturating_sub(done) as f64;
            Some(1e-9 * GRIND_NS * work).filter(|seconds| *seconds > 0.0)
        };
        Claim {
            job: entry.id,
            elements: entry.size.elements,
            workers: [options.min_workers.max(1) as usize, most],
            speed: options.min_speed,
            memory: (1e9 * options.min_memory) as u64,
            priority: options.priority,
            owner: &entry.owner,
            runs,
            left_s,
            before: entry.before.as_deref().filter(|_| !runs),
            aside: entry.aside,
        }
    }

    /// A worker as [`allotment`] sees it; none for one that is welcomed and not yet reachable.
    fn worker<'a>(&'a self, host: &Host) -> Option<Worker<'a>> {
        let link = self.worker_links.get(&host.incarnation)?;
        let stands = match (&host.state, self.called.get(&host.incarnation)) {
            (hosts::State::Busy(_), Some(&Call { from, to, .. })) => Stands::Called { from, to },
            (&hosts::State::Busy(job), None) => Stands::At(job),
            _ => Stands::Idle,
        };
        Some(Worker {
            incarnation: host.incarnation,
            bearer: link.bearer(),
            threads: link.spec.threads,
            stands,
            process: host.nonce,
            divides: link.divides,
            region: &link.spec.region,
        })
    }

    /// Has a worker go on with other threads.
    fn set_threads(&mut self, Threads { worker, computes, apart }: Threads) {
        let Some(link) = self.worker_links.get_mut(&worker) else { return };
        if computes == 0 {
            // Before it hears of it: its answer is the end.
            link.delivery.expect_end();
        }
        // One that cannot be reached is found lost by its connection's task.
        if link.send(Place::default(), &ToWorker::Threads { computes, apart }).is_err() {
            return;
        }
        let name = link.spec.name.clone();
        if computes == 0 {
            info!("worker {name} gives its threads back");
            self.worker_links.remove(&worker);
            self.hosts.forget(worker);
            return;
        }
        link.compute_with(computes);
        info!(threads = computes, apart, "worker {name} goes on with other threads");
        self.hosts.compute_with(worker, &link.spec);
        if let Some(hosts::State::Busy(job)) = self.hosts.on(worker).map(|host| &host.state)
            && let Some(running) = self.running.get(job)
        {
            // A full line makes the next deal of its work worse, and nothing else.
            let _ = running.line.try_send(Input::Threads(worker, computes));
        }
    }

    /// Has a job stored, for one that came before it.
    fn set_aside(&mut self, job: u32) {
        if let Some(running) = self.running.get(&job)
            && self.queue.set_aside(job)
        {
            info!(job, "the job is stored for one that came before it");
            running.suspend();
        }
    }

    /// Has a job give a worker up at its next plan boundary.
    fn call(&mut self, call: Call) {
        let Some(Running { line, .. }) = self.running.get(&call.from) else { return };
        // A full line is asked at the next look.
        if line.try_send(Input::Yield(call.worker)).is_ok() {
            self.called.insert(call.worker, call);
            let worker = self.worker_links.get(&call.worker).map_or("", |link| &link.spec.name);
            match call.to {
                Some(to) => info!(job = call.from, "worker {worker} is called to job {to}"),
                None => info!(job = call.from, "worker {worker} is let go for a faster one"),
            }
        }
    }

    /// Gives an idle worker to a job that runs.
    fn join(&mut self, incarnation: u32, job: u32) {
        let (Some(link), Some(Running { line, .. })) =
            (self.worker_links.get(&incarnation), self.running.get(&job))
        else {
            return;
        };
        let (line, link) = (line.clone(), link.clone());
        info!(job, "worker {} joins the job", link.spec.name);
        self.hosts.occupy(&[incarnation], job);
        // A job that is over by then gives all its hosts back.
        tokio::spawn(async move { line.send(Input::Joined(link)).await.is_ok() });
    }

    /// Starts a job on these workers, on a thread of its own.
    fn start(&mut self, job: u32, worker_links: Vec<WorkerLink>) {
        let (Some(entry), Some(status)) = (self.queue.get(job), self.status.get(&job).cloned()) else {
            return;
        };
        let stop = Arc::new(AtomicBool::new(false));
        let line = drive::channel(worker_links.len());
        let running = Running { stop: Arc::clone(&stop), line: line.0.clone() };
        let incarnations: Vec<u32> = worker_links.iter().map(|worker_link| worker_link.incarnation).collect();
        let at_work = worker_links.iter().map(|worker_link| worker_link.spec.name.clone()).collect();
        let order = Order {
            number: job,
            name: entry.name.clone(),
            text: Arc::clone(&entry.text),
            options: entry.options.clone(),
            folder: entry.folder.clone(),
            snapshots: self.spool.snapshots(job),
            at_work_before: entry.before.as_ref().map(Vec::len),
            // Any of those that are there may come to it.
            workers_there: self.worker_links.len(),
            worker_links,
            line: Mutex::new(Some(line)),
            stop,
            status,
            board: self.board.clone(),
            notices: self.notices.clone(),
        };
        self.hosts.occupy(&incarnations, job);
        self.running.insert(job, running);
        self.queue.set_at_work(job, at_work, store::newest(&self.spool.snapshots(job)));
        info!(job, workers = incarnations.len(), "job starts");
        if let Err(why) = self.change(job, Change::Start, None) {
            warn!(job, "{why}");
        }
        let notices = self.notices.clone();
        let started = std::thread::Builder::new().name(format!("job-{job}")).spawn(move || {
            let (change, ended) = service::serve(&order);
            drop(order);
            // The scheduler is gone only when the daemon ends.
            let _ = notices.blocking_send(Notice::Over(job, change, Box::new(ended)));
        });
        if let Err(error) = started {
            let ended = Ended { failure: Some(format!("its thread: {error}")), ..Ended::default() };
            self.hear(Notice::Over(job, Change::Fail, Box::new(ended)));
        }
    }

    fn wait_for(&self, job: u32, what: String) {
        if let Some(status) = self.status.get(&job) {
            status.send_if_modified(|status| {
                let new = status.state == State::Queued && status.waits_for.as_ref() != Some(&what);
                if new {
                    status.waits_for = Some(what);
                }
                new
            });
        }
    }
}
