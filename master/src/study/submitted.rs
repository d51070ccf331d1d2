//! Runs of a study as jobs of a master: several in its queue at once.
//!
//! The title of a job ends in the identity of its run, so a study that was killed finds its jobs again, whatever numbers they have and whoever put
//! them there. The master may go and come back; a job that was cancelled is put into the queue again, one that is held because
//! masters or workers died of it is resumed. One that its user holds is waited for.

use std::{
    collections::BTreeMap,
    sync::Arc,
    time::{Duration, Instant},
};

use deck::{MAX_TITLE, bundle};
use protocol::{
    options::JobOptions,
    request::{Reply, Request, State, Status},
};
use tracing::warn;

use super::{
    cache::{Cache, FILES},
    course,
    place::{Finished, Place, RunError, Task},
    plan::Study,
};
use crate::{
    client::{Client, arguments::ClientArgs},
    deck_file,
    results::Summary,
};

/// How long a master that has gone is dialled.
const PATIENCE: Duration = Duration::from_secs(300);
const DIAL_EVERY: Duration = Duration::from_millis(500);
/// Seconds between states that a master keeps in memory of a run.
const KEEP_EVERY: f64 = 10.0;
/// How often jobs are looked at.
const LOOK_EVERY: Duration = Duration::from_millis(300);
/// How often a run is put into the queue, or resumed, before it counts as failed.
const MOST_TRIES: u32 = 5;

/// The queue of a master.
pub struct Submitted<'a> {
    study: &'a Study,
    at: ClientArgs,
    client: Client,
    cache: Arc<Cache>,
    /// Jobs at once.
    most: usize,
    jobs: BTreeMap<u32, Tracked>,
    /// What the master said last of all its jobs, and those that were put there since.
    listed: Option<Vec<Status>>,
    /// Runs that it did not take.
    refused: Vec<Finished>,
    looked: Instant,
}

/// A job of this study.
struct Tracked {
    task: Task,
    tries: u32,
}

impl<'a> Submitted<'a> {
    /// Connects to the master.
    ///
    /// # Errors
    /// If it does not answer.
    pub fn new(study: &'a Study, at: &ClientArgs, cache: Arc<Cache>, most: usize) -> Result<Self, String> {
        let (client, at) = (Client::new(at)?, at.clone());
        let (jobs, refused) = (BTreeMap::new(), Vec::new());
        Ok(Self { study, at, client, cache, most, jobs, listed: None, refused, looked: Instant::now() })
    }

    /// Asks the master, and once more when it is back if it went meanwhile. What is asked twice must do no harm.
    fn ask<T>(&mut self, mut what: impl FnMut(&mut Client) -> Result<T, String>) -> Result<T, String> {
        loop {
            match what(&mut self.client) {
                Err(why) if self.client.gone => self.dial_again(&why)?,
                other => return other,
            }
        }
    }

    /// What people see of a run in the queue: the values of its parameters, which tell it from the others, and the title of its deck.
    fn study_title(&self, task: &Task) -> String {
        let at = course::words(self.study, &task.point.values, None);
        let sample =
            if task.point.sample > 0 { format!(", sample {}", task.point.sample) } else { String::new() };
        format!("{at}{sample}: {}", task.prepared.title)
    }

    /// Puts a run into the queue, unless a job there already is that run.
    fn submit(&mut self, task: &Task) -> Result<u32, String> {
        let identity = &task.prepared.identity;
        let title = title_of(&self.study_title(task), identity);
        let options = bundle::Options { title: Some(title.clone()), ..self.study.options_at(&task.point) };
        let text = deck_file::gather_deck(&self.study.deck, &options)?;
        let asked = JobOptions { keep_every: Some(KEEP_EVERY), ..JobOptions::default() };
        loop {
            let jobs = match self.listed.take() {
                Some(jobs) => jobs,
                None => self.ask(Client::jobs)?,
            };
            let jobs = self.listed.insert(jobs);
            if let Some(status) = jobs.iter().rev().find(|status| is_usable(status, identity)) {
                return Ok(status.job);
            }
            match self.client.submit(task.prepared.name.clone(), text.clone(), asked.clone()) {
                Ok(job) => {
                    jobs.push(Status::queued(job, title));
                    return Ok(job);
                }
                // It may have taken the run before it went: that shows when it is back.
                Err(why) if self.client.gone => self.dial_again(&why)?,
                Err(why) => return Err(why),
            }
        }
    }

    /// Waits for a master that has gone.
    fn dial_again(&mut self, why: &str) -> Result<(), String> {
        warn!("{why}; dialling again for {} s", PATIENCE.as_secs());
        let since = Instant::now();
        self.listed = None;
        loop {
            std::thread::sleep(DIAL_EVERY);
            match Client::new(&self.at) {
                Ok(client) => {
                    self.client = client;
                    return Ok(());
                }
                Err(_) if since.elapsed() < PATIENCE => {}
                Err(last) => {
                    return Err(format!("{why}; then {last}; the same command goes on once it is back"));
                }
            }
        }
    }

    /// Takes the results of a job into the cache; gives the element-cycles of the run.
    fn gather(&mut self, job: u32, task: &Task) -> Result<u64, RunError> {
        let cache = Arc::clone(&self.cache);
        let Some(work) = cache.begin(&task.prepared.identity).map_err(RunError::Cache)? else { return Ok(0) };
        for name in FILES {
            let path = work.folder().join(name);
            self.ask(|client| client.fetch(job, name, &path)).map_err(RunError::Elsewhere)?;
        }
        let entry = cache.commit(work).map_err(RunError::Cache)?;
        let text =
            std::fs::read_to_string(entry.join(FILES[1])).map_err(|e| RunError::Elsewhere(e.to_string()))?;
        let summary: Summary = serde_json::from_str(&text).map_err(|e| RunError::Elsewhere(e.to_string()))?;
        Ok(summary.elements * summary.cycles)
    }

    /// Looks how a job stands; gives what it came to once it is over.
    fn look(&mut self, job: u32, status: Option<&Status>) -> Result<Option<Result<u64, RunError>>, String> {
        let state = status.map(|status| status.state);
        let Some(Tracked { task, tries }) = self.jobs.remove(&job) else { return Ok(None) };
        let again = tries < MOST_TRIES;
        // A failure says why a job is held, unless its user holds it.
        let user_holds = state == Some(State::Held) && status.is_some_and(|status| status.ended.is_none());
        match state {
            Some(State::Queued | State::Running) => {
                self.jobs.insert(job, Tracked { task, tries });
                Ok(None)
            }
            Some(State::Held) if user_holds => {
                self.jobs.insert(job, Tracked { task, tries });
                Ok(None)
            }
            Some(State::Done) => {
                let result = self.gather(job, &task);
                self.jobs.insert(job, Tracked { task, tries });
                Ok(Some(result))
            }
            Some(State::Held) if again => {
                let resumed = self.ask(|client| client.ask(&Request::Resume { job }));
                if !matches!(resumed, Ok(Reply::Done(_))) {
                    warn!("job {job} is held and cannot be resumed");
                }
                self.jobs.insert(job, Tracked { task, tries: tries + 1 });
                Ok(None)
            }
            // It was cancelled or removed.
            Some(State::Cancelled) | None if again => {
                let job = self.submit(&task)?;
                self.jobs.insert(job, Tracked { task, tries: tries + 1 });
                Ok(None)
            }
            Some(State::Failed | State::Held | State::Cancelled) | None => {
                let failure = status.and_then(|status| status.ended.clone()).and_then(|ended| ended.failure);
                let why = failure.unwrap_or_else(|| "it was cancelled or removed again and again".to_owned());
                self.jobs.insert(job, Tracked { task, tries });
                Ok(Some(Err(RunError::Elsewhere(format!("job {job}: {why}")))))
            }
        }
    }
}

impl Place for Submitted<'_> {
    fn has_room(&self, _: &Task) -> bool {
        self.jobs.len() < self.most
    }

    fn take(&mut self, task: Task, _: usize) -> Result<(), String> {
        match self.submit(&task) {
            Ok(job) => {
                self.jobs.insert(job, Tracked { task, tries: 1 });
            }
            Err(why) if self.client.gone => return Err(why),
            Err(why) => {
                self.refused.push(Finished { point: task.point, result: Err(RunError::Elsewhere(why)) });
            }
        }
        Ok(())
    }

    fn wait(&mut self, stop: bool) -> Result<Vec<Finished>, String> {
        if stop {
            // The jobs stay in the queue: the study finds them there.
            let stopped =
                |tracked: Tracked| Finished { point: tracked.task.point, result: Err(RunError::Stopped) };
            return Ok(std::mem::take(&mut self.jobs).into_values().map(stopped).collect());
        }
        std::thread::sleep(LOOK_EVERY.saturating_sub(self.looked.elapsed()));
        self.looked = Instant::now();
        let listed = self.ask(Client::jobs)?;
        let statuses: BTreeMap<u32, Status> = listed.iter().map(|s| (s.job, s.clone())).collect();
        self.listed = Some(listed);
        let mut finished = std::mem::take(&mut self.refused);
        for job in self.jobs.keys().copied().collect::<Vec<_>>() {
            if let Some(result) = self.look(job, statuses.get(&job))?
                && let Some(tracked) = self.jobs.remove(&job)
            {
                finished.push(Finished { point: tracked.task.point, result });
            }
        }
        Ok(finished)
    }
}

/// A deck's title with the identity of a run behind it, short enough to be one.
fn title_of(title: &str, identity: &str) -> String {
    let room = MAX_TITLE - identity.len() - 3;
    let title: String = title.chars().take(room).collect();
    format!("{title} [{identity}]")
}

/// Whether a job is a run of this identity and has or will have its results.
fn is_usable(status: &Status, identity: &str) -> bool {
    let is_run = status.title.strip_suffix(']').is_some_and(|title| title.ends_with(&format!("[{identity}")));
    is_run && matches!(status.state, State::Queued | State::Running | State::Done | State::Held)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_is_known_by_the_identity_at_the_end_of_its_title() {
        let identity = "0123456789abcdef0123456789abcdef";
        let title = title_of(&"x".repeat(300), identity);
        assert_eq!(title.chars().count(), MAX_TITLE);
        let status = |state| Status { state, ..Status::queued(1, title.clone()) };
        assert!(is_usable(&status(State::Running), identity));
        assert!(!is_usable(&status(State::Cancelled), identity));
        assert!(!is_usable(&status(State::Done), &identity.replace('0', "1")));
        assert!(!is_usable(&Status::queued(1, identity.to_owned()), identity));
    }
}
