//! NOTIFY: whom a user wants told when a run, a job or a study is over: a command, a webhook, an address of mail.

use std::{
    path::{Path, PathBuf},
    process::{ExitCode, Stdio},
    sync::mpsc,
    thread::JoinHandle,
    time::{Duration, Instant},
};

use clap::Args;
use protocol::request::{Ended, State};
use tracing::warn;

use crate::{machine::host_name, shell::tell};

pub mod mail;
pub mod webhook;

/// The longest that an ending master waits for those who are being told.
const END_LIMIT: Duration = Duration::from_secs(10);

/// Whom to tell.
#[derive(Args, Clone, Debug, Default)]
pub struct NotifyArgs {
    /// When it is over run this in a shell, with BOLIDE_JOB, BOLIDE_STATE (done, failed, stopped or held), BOLIDE_FOLDER and BOLIDE_REASON set
    #[arg(long, value_name = "COMMAND")]
    pub notify: Option<String>,
    /// When it is over post JSON to this address of http or https, as Slack, Mattermost and others take it
    #[arg(long, value_name = "URL", value_parser = webhook::url)]
    pub webhook: Option<String>,
    /// When it is over send mail to this address through this host's sendmail
    #[arg(long, value_name = "ADDRESS", value_parser = mail::address)]
    pub mail: Option<String>,
}

/// What is over, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Over {
    /// The deck, the study or the number of the job.
    pub job: String,
    /// The same for whoever reads many: with the deck and the user of a job.
    pub title: String,
    /// One of `done`, `failed`, `stopped` (by a user) and `held` (until a user looks at it).
    pub state: &'static str,
    /// Where the results are on this host.
    pub folder: Option<PathBuf>,
    /// Why it failed, or empty.
    pub reason: String,
}

impl Over {
    /// A command of this process, by what it came to.
    pub fn of(job: &str, folder: Option<&Path>, result: &Result<ExitCode, String>) -> Self {
        let (state, reason) = match result {
            Err(why) => ("failed", why.clone()),
            Ok(code) if *code == ExitCode::SUCCESS => ("done", String::new()),
            Ok(_) => ("stopped", String::new()),
        };
        let folder = folder.map(|folder| std::path::absolute(folder).unwrap_or(folder.to_owned()));
        Self { job: job.to_owned(), title: job.to_owned(), state, folder, reason }
    }

    /// A job of a master's queue; `deck` is the name of its file, `user` is empty where nobody is known.
    pub fn of_job(
        job: u32,
        (deck, user): (&str, &str),
        state: State,
        folder: Option<PathBuf>,
        ended: &Ended,
    ) -> Self {
        let by = if user.is_empty() { String::new() } else { format!(" by {user}") };
        let state = if state == State::Cancelled { "stopped" } else { state.name() };
        let reason = ended.failure.clone().unwrap_or_default();
        Self { job: job.to_string(), title: format!("job {job} ({deck}){by}"), state, folder, reason }
    }

    /// One line for people.
    fn line(&self) -> String {
        format!("bolide: {} is {} on {}", self.title, self.state, host_name())
    }
}

impl NotifyArgs {
    /// Whether anybody is to be told.
    pub const fn is_some(&self) -> bool {
        self.notify.is_some() || self.webhook.is_some() || self.mail.is_some()
    }

    /// Looks, before hours of computing, whether this host can tell them.
    ///
    /// # Errors
    /// If mail is wanted of a host without sendmail.
    pub fn check(&self) -> Result<(), String> {
        self.mail.as_ref().map_or(Ok(()), |_| mail::sendmail().map(|_| ()))
    }

    /// Tells them all; gives what kept it from some. None of that changes what is over.
    pub fn tell(&self, over: &Over) -> Vec<String> {
        let command = self.notify.as_ref().map(|words| run(words, over));
        let webhook = self.webhook.as_ref().map(|url| webhook::post(url, over));
        let mail = self.mail.as_ref().map(|address| mail::send(address, over));
        [command, webhook, mail].into_iter().flatten().filter_map(Result::err).collect()
    }

    /// [`tell`](Self::tell) of a command of this process; faults go to standard error.
    pub fn tell_of(&self, job: &str, folder: Option<&Path>, result: &Result<ExitCode, String>) {
        self.tell(&Over::of(job, folder, result)).iter().for_each(|fault| tell(fault));
    }
}

/// Runs words in a shell with what is over in its environment.
fn run(words: &str, over: &Over) -> Result<(), String> {
    let mut shell = system::children::shell(words);
    shell.stdin(Stdio::null());
    shell.env("BOLIDE_JOB", &over.job).env("BOLIDE_STATE", over.state);
    shell.env("BOLIDE_REASON", over.reason.replace('\0', " "));
    shell.env("BOLIDE_FOLDER", over.folder.clone().unwrap_or_default());
    match shell.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("--notify {words}: {status}")),
        Err(error) => Err(format!("--notify {words}: {error}")),
    }
}

/// A thread of a master that tells of one job after the other, so that the scheduler waits for nobody.
pub struct Notifier {
    over: mpsc::Sender<Over>,
    thread: JoinHandle<()>,
}

impl Notifier {
    /// None where nobody is to be told.
    ///
    /// # Errors
    /// If this host cannot tell them, or has no thread left.
    pub fn start(args: &NotifyArgs) -> Result<Option<Self>, String> {
        if !args.is_some() {
            return Ok(None);
        }
        args.check()?;
        let (sender, over) = mpsc::channel::<Over>();
        let args = args.clone();
        let tell = move || {
            for over in over {
                args.tell(&over).iter().for_each(|fault| warn!(job = over.job, "{fault}"));
            }
        };
        let thread = std::thread::Builder::new().name("notify".to_owned()).spawn(tell);
        let thread = thread.map_err(|error| format!("thread of --notify: {error}"))?;
        Ok(Some(Self { over: sender, thread }))
    }

    /// Tells of this one after those before it.
    pub fn tell(&self, over: Over) {
        // The thread ends only after this sender.
        let _ = self.over.send(over);
    }

    /// Waits for those who are being told, for a while.
    pub fn end(self) {
        drop(self.over);
        let until = Instant::now() + END_LIMIT;
        while !self.thread.is_finished() && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_is_told_what_is_over_and_how() {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("told");
        let words = format!(
            "printf '%s|%s|%s|%s' \"$BOLIDE_JOB\" \"$BOLIDE_STATE\" \"$BOLIDE_FOLDER\" \"$BOLIDE_REASON\" > {}",
            out.display()
        );
        let args = NotifyArgs { notify: Some(words), ..NotifyArgs::default() };
        let told = |over: &Over| {
            assert_eq!(args.tell(over), Vec::<String>::new());
            std::fs::read_to_string(&out).expect("it was told")
        };
        let of = |result, folder| told(&Over::of("7", folder, &result));
        assert_eq!(of(Ok(ExitCode::SUCCESS), Some(Path::new("/tmp/x"))), "7|done|/tmp/x|");
        assert_eq!(of(Ok(ExitCode::from(130)), None), "7|stopped||");
        assert_eq!(of(Err("no disk; it's full".to_owned()), None), "7|failed||no disk; it's full");
        let held = Ended { failure: Some("lost".to_owned()), ..Ended::default() };
        let job = Over::of_job(7, ("plate.toml", "anna"), State::Held, None, &held);
        assert_eq!(told(&job), "7|held||lost");
        assert_eq!(job.line(), format!("bolide: job 7 (plate.toml) by anna is held on {}", host_name()));
    }
}
