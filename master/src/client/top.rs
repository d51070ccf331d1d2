//! TOP: `bolide top`, hosts and jobs of a master in a terminal, looked at once a second.
//!
//! Without a terminal, or in one without escape sequences (`TERM=dumb`), it prints one table and ends; with `--json` one line of JSON.

use std::{
    collections::BTreeMap,
    io::IsTerminal,
    process::ExitCode,
    time::{Duration, Instant},
};

use protocol::request::{HostRow, Reply, Request, Share, State, Status};

use super::arguments::ClientArgs;
use super::{
    Client,
    screen::{Key, Screen, Tint},
    surprise,
};
use crate::shell::{obeys, print};

/// Between two looks.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// What was seen at one look.
struct Seen {
    jobs: Vec<Status>,
    hosts: Vec<HostRow>,
    /// Cycles per second of running jobs, once there were two looks.
    rates: BTreeMap<u32, f64>,
}

/// `bolide top`.
///
/// # Errors
/// Whatever went wrong on the way to the master, or with the terminal.
pub fn run(at: &ClientArgs) -> Result<ExitCode, String> {
    let mut client = Client::new(at)?;
    let seen = look(&mut client)?;
    if at.json {
        let value = serde_json::json!({ "jobs": seen.jobs, "hosts": seen.hosts });
        print(&value.to_string())?;
        return Ok(ExitCode::SUCCESS);
    }
    if !std::io::stdout().is_terminal() || !std::io::stdin().is_terminal() || !obeys() {
        print(&plain(&seen))?;
        return Ok(ExitCode::SUCCESS);
    }
    show(&mut client, seen, &at.master).map(|()| ExitCode::SUCCESS)
}

fn look(client: &mut Client) -> Result<Seen, String> {
    let Reply::Jobs(jobs) = client.ask(&Request::Jobs)? else { return Err(surprise()) };
    let Reply::Hosts(hosts) = client.ask(&Request::Hosts)? else { return Err(surprise()) };
    Ok(Seen { jobs, hosts, rates: BTreeMap::new() })
}

fn show(client: &mut Client, mut seen: Seen, master: &str) -> Result<(), String> {
    let fault = |e: std::io::Error| format!("terminal: {e}");
    let mut screen = Screen::open().map_err(fault)?;
    let mut looked = Instant::now();
    loop {
        let size = screen.size().map_err(fault)?;
        screen.show(&page(&seen, master, size)).map_err(fault)?;
        let left = LOOK_EVERY.saturating_sub(looked.elapsed());
        if screen.key(left).map_err(fault)? == Some(Key::Leave) {
            return Ok(());
        }
        if looked.elapsed() >= LOOK_EVERY {
            let passed = looked.elapsed().as_secs_f64();
            looked = Instant::now();
            let mut now = look(client)?;
            now.rates = rates(&seen.jobs, &now.jobs, passed);
            seen = now;
        }
    }
}

/// Cycles per second of the jobs that run.
fn rates(before: &[Status], now: &[Status], passed: f64) -> BTreeMap<u32, f64> {
    let rate = |job: &Status| {
        let then = before.iter().find(|b| b.job == job.job && b.state == State::Running)?;
        Some((job.job, job.cycle.saturating_sub(then.cycle) as f64 / passed))
    };
    now.iter().filter(|job| job.state == State::Running).filter_map(rate).collect()
}

/// Largest over mean of elements over speed; none without shares.
fn imbalance(shares: &[Share]) -> Option<f64> {
    let total: f64 = shares.iter().map(|s| s.elements as f64).sum();
    let speed: f64 = shares.iter().map(|s| s.speed).sum();
    let most = shares.iter().map(|s| s.elements as f64 / s.speed).fold(0.0, f64::max);
    (total > 0.0 && speed > 0.0).then(|| most * speed / total)
}

/// Cells of a job: number, state, time left, cycle, rate, title, note with the planned imbalance (the page shows the measured one).
fn job_cells(job: &Status, seen: &Seen) -> [String; 7] {
    let failure = job.ended.as_ref().and_then(|ended| ended.failure.clone());
    let digest = job.ended.as_ref().and_then(|ended| ended.digest.clone());
    let running = job.state == State::Running;
    let (left, more) = match job.progress.split_once(", ") {
        Some((left, more)) if running => (left.trim_end_matches(" left"), more),
        _ => ("-", ""),
    };
    let balance = imbalance(&job.shares).filter(|_| running);
    let balance = balance.map_or_else(String::new, |ratio| format!("; imbalance planned {ratio:.3}"));
    let note = match (&job.waits_for, failure.or(digest)) {
        (Some(what), _) => format!("waits for {what}"),
        (None, Some(words)) => words,
        (None, None) => format!("{more}{balance}"),
    };
    [
        job.job.to_string(),
        job.state.name().to_owned(),
        left.to_owned(),
        job.cycle.to_string(),
        seen.rates.get(&job.job).map_or_else(|| "-".to_owned(), |rate| format!("{rate:.1}")),
        job.title.chars().take(40).collect(),
        note,
    ]
}

/// Cells of a host: name, state, speed, threads, lanes, elements, note.
fn host_cells(host: &HostRow, seen: &Seen) -> [String; 7] {
    let running = seen.jobs.iter().filter(|job| job.state == State::Running);
    let share = running.flat_map(|job| &job.shares).find(|share| share.host == host.name);
    [
        host.name.clone(),
        host.state.clone(),
        host.speed.to_string(),
        host.threads.to_string(),
        host.lanes.clone(),
        share.map_or_else(|| "-".to_owned(), |share| share.elements.to_string()),
        host.note.clone(),
    ]
}

const JOB_TITLES: [&str; 7] = ["job", "state", "left", "cycle", "cycles/s", "title", "note"];
const HOST_TITLES: [&str; 7] = ["host", "state", "speed", "threads", "lanes", "elements", "note"];

fn plain(seen: &Seen) -> String {
    let all = |rows: &[[String; 7]], titles| columns(titles, rows, usize::MAX).join("\n");
    format!("{}\n\n{}\n", all(&hosts(seen), HOST_TITLES), all(&jobs(seen), JOB_TITLES))
}

fn hosts(seen: &Seen) -> Vec<[String; 7]> {
    seen.hosts.iter().map(|host| host_cells(host, seen)).collect()
}

/// The newest first.
fn jobs(seen: &Seen) -> Vec<[String; 7]> {
    seen.jobs.iter().rev().map(|job| job_cells(job, seen)).collect()
}

/// Titles and rows as lines of columns, cut where they are longer than `most` letters.
fn columns(titles: [&str; 7], rows: &[[String; 7]], most: usize) -> Vec<String> {
    let widths: Vec<usize> = (0..7)
        .map(|i| rows.iter().map(|row| row[i].chars().count()).max().unwrap_or(0).max(titles[i].len()))
        .collect();
    let line = |cells: Vec<&str>| {
        let padded: Vec<String> =
            cells.iter().zip(&widths).map(|(cell, &width)| format!("{cell:<width$}")).collect();
        // What comes from others may hold letters that a terminal obeys.
        padded.join("  ").trim_end().replace(char::is_control, " ").chars().take(most).collect()
    };
    let body = rows.iter().map(|row| line(row.iter().map(String::as_str).collect()));
    std::iter::once(line(titles.to_vec())).chain(body).collect()
}

fn tint(state: &str) -> Tint {
    match state {
        "running" | "busy" => Tint::Cyan,
        "done" | "idle" => Tint::Green,
        "failed" | "held" | "lost" => Tint::Red,
        _ => Tint::Yellow,
    }
}

/// A table under its name, at most `height` lines of `width` letters; states are coloured.
fn table(
    name: &str,
    titles: [&str; 7],
    rows: &[[String; 7]],
    (width, height): (usize, usize),
) -> Vec<String> {
    let lines = columns(titles, rows, width);
    let rule = format!(" {name} {}", "\u{2500}".repeat(width.saturating_sub(name.chars().count() + 2)));
    let states = rows.iter().map(|row| row[1].as_str());
    let coloured = lines.iter().skip(1).zip(states).map(|(line, state)| {
        // The first place where it stands alone is its column: what is before it is the name of a host or a number.
        let at = format!("  {state}");
        line.replacen(&at, &format!("  {}", tint(state).on(state)), 1)
    });
    let titles = Tint::Soft.on(&lines[0]);
    std::iter::once(rule).chain([titles]).chain(coloured).take(height).collect()
}

/// What the terminal shows, at most as many lines as it has.
fn page(seen: &Seen, master: &str, (width, height): (usize, usize)) -> Vec<String> {
    let count = |state| seen.jobs.iter().filter(|job| job.state == state).count();
    let summary = format!(
        "bolide at {master}: hosts {}, running {}, queued {}",
        seen.hosts.iter().filter(|host| !matches!(host.state.as_str(), "lost" | "left")).count(),
        count(State::Running),
        count(State::Queued)
    );
    let of_hosts = (seen.hosts.len().max(1) + 2).min(height / 2);
    let mut lines = vec![summary.chars().take(width).collect()];
    lines.extend(table("Hosts", HOST_TITLES, &hosts(seen), (width, of_hosts)));
    let left = height.saturating_sub(lines.len() + 1);
    lines.extend(table("Jobs", JOB_TITLES, &jobs(seen), (width, left)));
    lines.push(Tint::Soft.on("q leaves"));
    lines.truncate(height.max(1));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen() -> Seen {
        let share = |host: &str, speed, elements| Share { host: host.to_owned(), speed, elements };
        let job = Status {
            job: 3,
            title: "plates".to_owned(),
            state: State::Running,
            waits_for: None,
            cycle: 120,
            time: 1.0,
            time_unit: "ms".to_owned(),
            left_s: Some(720.0),
            progress: "12 min left, 34.0 %, cycle 120".to_owned(),
            shares: vec![share("a", 1.0, 100), share("b", 2.0, 260)],
            ended: None,
        };
        let host = HostRow {
            host: 0,
            name: "a".to_owned(),
            speed: 1.0,
            threads: 2,
            lanes: "avx2".to_owned(),
            address: "127.0.0.1:9".to_owned(),
            incarnation: 1,
            state: "busy".to_owned(),
            note: "job 3".to_owned(),
        };
        let before = Status { cycle: 20, ..job.clone() };
        let rates = rates(&[before], std::slice::from_ref(&job), 2.0);
        Seen { jobs: vec![job], hosts: vec![host], rates }
    }

    #[test]
    fn rate_and_balance_stand_beside_a_running_job() {
        let seen = seen();
        assert_eq!(seen.rates[&3], 50.0);
        // Elements over speed: 100 and 130; the mean is 360 over 3.
        assert_eq!(imbalance(&seen.jobs[0].shares), Some(130.0 / 120.0));
        let text = plain(&seen);
        assert!(text.contains("50.0") && text.contains("1.083"), "{text}");
        let lines = page(&seen, "m:1", (100, 20));
        let drawn = lines.join("\n");
        for words in ["bolide at m:1: hosts 1, ", "Hosts", "Jobs", "plates", "50.0", "\x1b[36mbusy\x1b[0m"] {
            assert!(drawn.contains(words), "{words} in\n{drawn}");
        }
    }

    #[test]
    fn eighty_columns_have_the_time_left_of_a_job_and_its_title() {
        let mut seen = seen();
        seen.jobs[0].title = "Sphere of steel on an aluminium plate".to_owned();
        seen.hosts[0].name = "pc-in-the-room-on-the-left@4711".to_owned();
        let lines = page(&seen, "m:1", (80, 24));
        let plain = lines.join("\n").replace("\x1b[36m", "").replace("\x1b[2m", "").replace("\x1b[0m", "");
        for line in plain.lines() {
            assert!(line.chars().count() <= 80, "{line}");
        }
        let job = plain.lines().find(|line| line.starts_with("3 ")).expect("the job");
        assert!(
            job.contains("running") && job.contains("12 min") && job.contains("Sphere of steel on an alu"),
            "{job}"
        );
        assert!(plain.contains("pc-in-the-room"), "{plain}");
    }

    #[test]
    fn a_page_fits_its_terminal_and_obeys_nobody_else() {
        let mut seen = seen();
        seen.jobs[0].title = "\x1b[2J".repeat(40);
        seen.jobs = vec![seen.jobs[0].clone(); 50];
        for (width, height) in [(100, 20), (20, 5), (1, 1), (0, 0)] {
            let lines = page(&seen, "m:1", (width, height));
            assert!(lines.len() <= height.max(1), "{} lines of {height}", lines.len());
            for line in &lines {
                let plain = ["\x1b[36m", "\x1b[2m", "\x1b[0m"]
                    .iter()
                    .fold(line.clone(), |l, code| l.replace(code, ""));
                assert!(!plain.contains('\x1b'), "{line:?}");
                assert!(plain.chars().count() <= width.max(9), "{plain:?} in {width}");
            }
        }
    }
}
