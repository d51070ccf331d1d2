//! ADD: starts workers on the hosts of a file over ssh, as PVM's console did.
//!
//! What runs on a host is a short script for `sh`, given to it on standard input, so that no shell of the user quotes
//! anything anew. It starts the worker in the background with its log in `~/.bolide`, waits until the log says that
//! the worker has joined, and ends: no connection of ssh stays. A worker that ends at once leaves the log of one before. Whatever ssh or the worker say against it is printed.

use std::{fmt::Write, process::ExitCode, process::Stdio, time::Duration};

use serde::Serialize;
use tokio::{io::AsyncWriteExt, process::Command, sync::Semaphore};

use crate::{
    command::AddArgs,
    shell::{print, quoted},
};

pub mod file;
use file::{Host, Way};

/// Connections of ssh at a time.
const AT_ONCE: usize = 32;
/// The longest that a host may take to answer, its wait for the worker included.
const LIMIT: Duration = Duration::from_secs(60);
/// Tenths of a second that the script waits for the worker to join.
const JOIN_TENTHS: u32 = 100;
/// Most bytes of a host's words that are printed.
const WORDS: usize = 600;

/// How it went with a host.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// The worker has joined.
    Joined,
    /// It runs, and goes on dialling a master that has not answered.
    Dialling,
    /// It does not run.
    Failed,
}

/// What is said of a host.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Answer {
    /// The host's name.
    pub host: String,
    /// How it went.
    pub outcome: Outcome,
    /// Id of the worker there.
    pub process: Option<u32>,
    /// The words of ssh, the host's shell or the worker, where it failed.
    pub words: String,
}

impl Answer {
    pub fn line(&self) -> String {
        let Self { host, outcome, process, words } = self;
        let process = process.unwrap_or_default();
        match outcome {
            Outcome::Joined => format!("{host:<24} started, joined (process {process} there)"),
            Outcome::Dialling => format!("{host:<24} started, {words} (process {process} there)"),
            Outcome::Failed => format!("{host:<24} failed: {words}"),
        }
    }
}

/// `bolide add`.
///
/// # Errors
/// Faults of the host file, no master, or how many hosts failed.
pub fn run(args: &AddArgs) -> Result<ExitCode, String> {
    let host_file = file::read_file(&args.hosts)?;
    let Some(master) = args.master.as_ref().or(host_file.master.as_ref()) else {
        return Err(format!(
            "{} names no master; write master = \"HOST:PORT\" into it, or --master",
            args.hosts.display()
        ));
    };
    let chosen = host_file.choose(&args.names)?;
    if args.dry_run {
        for host in &chosen {
            print(&format!("# {}", host.name))?;
            print(&format!("{} <<'END'\n{}END", shell_line(&ssh(host)), script(host, master)))?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .map_err(|e| format!("threads of ssh: {e}"))?;
    let answers = runtime.block_on(async {
        let places = std::sync::Arc::new(Semaphore::new(AT_ONCE));
        let tasks = chosen.iter().map(|host| {
            let (host, script, places) = ((*host).clone(), script(host, master), places.clone());
            tokio::spawn(async move {
                // The semaphore is never closed.
                let _place = places.acquire_owned().await;
                start(&host, &script).await
            })
        });
        let (mut answers, mut printed) = (Vec::new(), Ok(()));
        for (task, host) in tasks.collect::<Vec<_>>().into_iter().zip(&chosen) {
            let answer = task.await.unwrap_or_else(|e| failed(&host.name, &e.to_string()));
            if !args.json {
                // All are waited for, whether or not somebody reads of them.
                printed = printed.and(print(&answer.line()));
            }
            answers.push(answer);
        }
        printed.map(|()| answers)
    })?;
    if args.json {
        print(&serde_json::to_string(&answers).map_err(|e| e.to_string())?)?;
    }
    match answers.iter().filter(|answer| answer.outcome == Outcome::Failed).count() {
        0 => Ok(ExitCode::SUCCESS),
        failed => Err(format!("{failed} of {} hosts failed", answers.len())),
    }
}

/// The command of ssh for a host; it runs `sh` there on what comes by standard input.
fn ssh(host: &Host) -> Vec<String> {
    let Way { user, port, ssh, .. } = &host.way;
    // No questions: whoever needs a password typed in uses an agent or a key.
    let fixed =
        ["ssh", "-T", "-o", "BatchMode=yes", "-o", "ConnectTimeout=10", "-o", "ServerAliveInterval=5"];
    let mut words: Vec<String> = fixed.map(str::to_owned).to_vec();
    words.extend_from_slice(ssh);
    if let Some(user) = user {
        words.extend(["-l".to_owned(), user.clone()]);
    }
    if let Some(port) = port {
        words.extend(["-p".to_owned(), port.to_string()]);
    }
    words.extend(["--".to_owned(), host.address.clone(), "sh -s".to_owned()]);
    words
}

fn shell_line(words: &[String]) -> String {
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

/// The worker's command on its host.
fn worker(host: &Host, master: &str) -> String {
    let Way { path, speed, threads, certs, flags, .. } = &host.way;
    let mut words = vec![path.as_str(), "worker", "--master", master, "--name", &host.name, "--speed", speed];
    let threads = threads.map(|threads| threads.to_string());
    if let Some(threads) = &threads {
        words.extend(["--threads", threads]);
    }
    if let Some(certs) = certs {
        words.extend(["--certs", certs]);
    }
    words.extend(flags.iter().map(String::as_str));
    shell_line(&words.into_iter().map(str::to_owned).collect::<Vec<_>>())
}

/// What `sh` does on a host: says `joined PID` or `dialling PID`, or fails with the reason on standard error.
fn script(host: &Host, master: &str) -> String {
    let (path, worker, name) = (quoted(&host.way.path), worker(host, master), &host.name);
    let mut text = String::new();
    // Writing to a text cannot fail.
    let _ = write!(
        text,
        r#"mkdir -p "$HOME/.bolide" || exit 1
log="$HOME/.bolide/worker-{name}.log" new="$HOME/.bolide/worker-{name}.log.$$"
command -v {path} >/dev/null || {{ echo "no program "{path}" on $(uname -n)" >&2; exit 127; }}
BOLIDE_LOG=${{BOLIDE_LOG:-info}} nohup {worker} >"$new" 2>&1 </dev/null &
worker=$! tenths=0
while [ $tenths -lt {JOIN_TENTHS} ]; do
    if grep -q ' joined ' "$new"; then mv "$new" "$log"; echo "joined $worker"; exit 0; fi
    if ! kill -0 $worker 2>/dev/null; then
        grep '^bolide: ' "$new" >&2 || tail -n 2 "$new" >&2
        rm "$new"
        exit 1
    fi
    sleep 0.1
    tenths=$((tenths + 1))
done
mv "$new" "$log"
echo "dialling $worker"
"#
    );
    text
}

async fn start(host: &Host, script: &str) -> Answer {
    let words = ssh(host);
    let mut command = Command::new(&words[0]);
    command.args(&words[1..]).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = match command.kill_on_drop(true).spawn() {
        Ok(child) => child,
        Err(error) => return failed(&host.name, &format!("no ssh on this machine: {error}")),
    };
    if let Some(mut stdin) = child.stdin.take() {
        // Some hundred bytes, which a pipe holds; a ssh that ends before it reads them says why itself.
        let _ = stdin.write_all(script.as_bytes()).await;
    }
    match tokio::time::timeout(LIMIT, child.wait_with_output()).await {
        Err(_) => failed(&host.name, &format!("no answer for {} s", LIMIT.as_secs())),
        Ok(Err(error)) => failed(&host.name, &format!("ssh: {error}")),
        Ok(Ok(output)) => answer_of(
            &host.name,
            output.status.success(),
            &String::from_utf8_lossy(&output.stdout),
            &String::from_utf8_lossy(&output.stderr),
        )
        .unwrap_or_else(|words| {
            failed(&host.name, if words.is_empty() { "ssh ended without a word" } else { &words })
        }),
    }
}

/// Reads what a host printed; a profile of its user may have printed more.
fn answer_of(host: &str, well: bool, out: &str, err: &str) -> Result<Answer, String> {
    let said = out.lines().rev().find_map(|line| {
        let (outcome, process) = line.split_once(' ')?;
        let outcome = match outcome {
            "joined" => Outcome::Joined,
            "dialling" => Outcome::Dialling,
            _ => return None,
        };
        Some((outcome, process.trim().parse::<u32>().ok()?))
    });
    match said {
        Some((outcome, process)) if well => {
            let words = match outcome {
                Outcome::Dialling => {
                    format!("not joined yet: see ~/.bolide/worker-{host}.log there, and `bolide hosts`")
                }
                _ => String::new(),
            };
            Ok(Answer { host: host.to_owned(), outcome, process: Some(process), words })
        }
        _ => Err(one_line(err)),
    }
}

fn failed(host: &str, words: &str) -> Answer {
    Answer { host: host.to_owned(), outcome: Outcome::Failed, process: None, words: words.to_owned() }
}

/// Words of another machine on one line, without what would steer a terminal.
fn one_line(text: &str) -> String {
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let joined = lines.collect::<Vec<_>>().join("; ");
    joined.chars().filter(|c| !c.is_control()).take(WORDS).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn host(text: &str) -> Host {
        file::read(text, "hosts.toml").expect("no fault").hosts.remove(0)
    }

    #[test]
    fn ssh_is_given_what_the_file_says_and_never_asks() {
        let host = host(
            "[[host]]\nname = \"pc2\"\naddress = \"10.0.0.2\"\nuser = \"anna\"\nport = 2222\nssh = [\"-F\", \"my config\"]",
        );
        assert_eq!(
            shell_line(&ssh(&host)),
            "ssh -T -o BatchMode=yes -o ConnectTimeout=10 -o ServerAliveInterval=5 -F 'my config' -l anna -p 2222 -- \
             10.0.0.2 'sh -s'"
        );
    }

    #[test]
    fn words_of_the_file_reach_the_worker_as_they_are() {
        let host = host(
            "[[host]]\nname = \"pc2\"\nspeed = 2.5\nthreads = 3\npath = \"it's $HOME/`x`\"\ncerts = \"a b\"\nflags = [\"--pin\", \"0;1\"]",
        );
        let echoed = worker(&host, "pc1:7117").replacen(r"'it'\''s $HOME/`x`'", "printf '%s|'", 1);
        let said = std::process::Command::new("sh").args(["-c", &echoed]).output().expect("a shell");
        assert_eq!(
            String::from_utf8_lossy(&said.stdout),
            "worker|--master|pc1:7117|--name|pc2|--speed|2.5|--threads|3|--certs|a b|--pin|0;1|"
        );
    }

    #[test]
    fn the_last_line_of_the_script_counts_and_words_of_others_cannot_steer_a_terminal() {
        let answer = answer_of("a", true, "Welcome\njoined 17\n", "").expect("an answer");
        assert_eq!((answer.outcome, answer.process), (Outcome::Joined, Some(17)));
        assert_eq!(
            answer_of("a", false, "", "ssh: \x1b[31mno\nroute\n"),
            Err("ssh: [31mno; route".to_owned())
        );
        assert!(answer_of("a", true, "joined x\n", "").is_err());
    }
}
