//! TOP: `bolide top`, hosts and jobs of a master in a terminal, looked at once a second.
//!
//! Without a terminal it prints one table and ends; with `--json` one line of JSON.

use std::{
    collections::BTreeMap,
    io::IsTerminal,
    process::ExitCode,
    time::{Duration, Instant},
};

use protocol::request::{HostRow, Reply, Request, Share, State, Status};
use ratatui::{
    Frame,
    crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers},
    layout::{Constraint, Layout},
    style::{Color, Modifier, Style},
    text::Line,
    widgets::{Block, Borders, Cell, Row, Table},
};

use super::{Client, surprise};
use crate::command::ClientArgs;

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
        println!("{value}");
        return Ok(ExitCode::SUCCESS);
    }
    if !std::io::stdout().is_terminal() {
        print!("{}", plain(&seen));
        return Ok(ExitCode::SUCCESS);
    }
    let mut terminal = ratatui::try_init().map_err(|e| format!("terminal: {e}"))?;
    let result = show(&mut terminal, &mut client, seen, &at.master);
    ratatui::restore();
    result.map(|()| ExitCode::SUCCESS)
}

fn look(client: &mut Client) -> Result<Seen, String> {
    let Reply::Jobs(jobs) = client.ask(&Request::Jobs)? else { return Err(surprise()) };
    let Reply::Hosts(hosts) = client.ask(&Request::Hosts)? else { return Err(surprise()) };
    Ok(Seen { jobs, hosts, rates: BTreeMap::new() })
}

fn show(
    terminal: &mut ratatui::DefaultTerminal,
    client: &mut Client,
    mut seen: Seen,
    master: &str,
) -> Result<(), String> {
    let fault = |e: std::io::Error| format!("terminal: {e}");
    let mut looked = Instant::now();
    loop {
        terminal.draw(|frame| draw(frame, &seen, master)).map_err(fault)?;
        let left = LOOK_EVERY.saturating_sub(looked.elapsed());
        if event::poll(left).map_err(fault)?
            && let Event::Key(key) = event::read().map_err(fault)?
            && key.kind == KeyEventKind::Press
        {
            let interrupt = key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
            if interrupt || matches!(key.code, KeyCode::Char('q') | KeyCode::Esc) {
                return Ok(());
            }
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

/// Cells of a job: number, state, cycle, rate, balance, title, note.
fn job_cells(job: &Status, seen: &Seen) -> [String; 7] {
    let failure = job.ended.as_ref().and_then(|ended| ended.failure.clone());
    let digest = job.ended.as_ref().and_then(|ended| ended.digest.clone());
    let note = match (&job.waits_for, failure.or(digest)) {
        (Some(what), _) => format!("waits for {what}"),
        (None, Some(words)) => words,
        (None, None) => job.progress.clone(),
    };
    let running = job.state == State::Running;
    let balance = imbalance(&job.shares).filter(|_| running);
    [
        job.job.to_string(),
        job.state.name().to_owned(),
        job.cycle.to_string(),
        seen.rates.get(&job.job).map_or_else(|| "-".to_owned(), |rate| format!("{rate:.1}")),
        balance.map_or_else(|| "-".to_owned(), |ratio| format!("{ratio:.3}")),
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

const JOB_TITLES: [&str; 7] = ["job", "state", "cycle", "cycles/s", "balance", "title", "note"];
const HOST_TITLES: [&str; 7] = ["host", "state", "speed", "threads", "lanes", "elements", "note"];

fn plain(seen: &Seen) -> String {
    let hosts: Vec<_> = seen.hosts.iter().map(|host| host_cells(host, seen)).collect();
    let jobs: Vec<_> = seen.jobs.iter().rev().map(|job| job_cells(job, seen)).collect();
    format!("{}\n{}", columns(HOST_TITLES, &hosts), columns(JOB_TITLES, &jobs))
}

fn columns(titles: [&str; 7], rows: &[[String; 7]]) -> String {
    let widths: Vec<usize> = (0..7)
        .map(|i| rows.iter().map(|row| row[i].chars().count()).max().unwrap_or(0).max(titles[i].len()))
        .collect();
    let line = |cells: Vec<&str>| {
        let padded: Vec<String> =
            cells.iter().zip(&widths).map(|(cell, &width)| format!("{cell:<width$}")).collect();
        format!("{}\n", padded.join("  ").trim_end())
    };
    let body: String = rows.iter().map(|row| line(row.iter().map(String::as_str).collect())).collect();
    line(titles.to_vec()) + &body
}

fn colour(state: &str) -> Color {
    match state {
        "running" | "busy" => Color::Cyan,
        "done" | "idle" => Color::Green,
        "failed" | "lost" => Color::Red,
        _ => Color::Yellow,
    }
}

fn table<'a>(name: String, titles: [&'a str; 7], rows: Vec<[String; 7]>, wide: u16) -> Table<'a> {
    let soft = Style::default().add_modifier(Modifier::DIM);
    let rows = rows.into_iter().map(|cells| {
        let state = colour(&cells[1]);
        Row::new(cells.into_iter().enumerate().map(move |(i, text)| {
            Cell::from(text).style(if i == 1 { Style::default().fg(state) } else { Style::default() })
        }))
    });
    let widths = [
        Constraint::Length(wide),
        Constraint::Length(10),
        Constraint::Length(9),
        Constraint::Length(9),
        Constraint::Length(8),
        Constraint::Length(if wide > 6 { 10 } else { 40 }),
        Constraint::Min(10),
    ];
    Table::new(rows, widths)
        .header(Row::new(titles).style(soft))
        .block(Block::new().borders(Borders::TOP).title(name))
}

fn draw(frame: &mut Frame<'_>, seen: &Seen, master: &str) {
    let n_hosts = seen.hosts.len().max(1) as u16;
    let [head, hosts, jobs, foot] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length((n_hosts + 2).min(frame.area().height / 2)),
        Constraint::Min(3),
        Constraint::Length(1),
    ])
    .areas(frame.area());
    let count = |state| seen.jobs.iter().filter(|job| job.state == state).count();
    let summary = format!(
        "bolide at {master}: {} hosts, {} jobs running, {} queued",
        seen.hosts.iter().filter(|host| host.state != "lost").count(),
        count(State::Running),
        count(State::Queued)
    );
    frame.render_widget(Line::from(summary), head);
    let rows = seen.hosts.iter().map(|host| host_cells(host, seen)).collect();
    frame.render_widget(table(" Hosts ".to_owned(), HOST_TITLES, rows, 24), hosts);
    let rows = seen.jobs.iter().rev().map(|job| job_cells(job, seen)).collect();
    frame.render_widget(table(" Jobs ".to_owned(), JOB_TITLES, rows, 5), jobs);
    let help = Line::from("q leaves").style(Style::default().add_modifier(Modifier::DIM));
    frame.render_widget(help, foot);
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratatui::{Terminal, backend::TestBackend};

    fn seen() -> Seen {
        let share = |host: &str, speed, elements| Share { host: host.to_owned(), speed, elements };
        let job = Status {
            job: 3,
            title: "plates".to_owned(),
            state: State::Running,
            waits_for: None,
            cycle: 120,
            time: 1.0,
            progress: "cycle 120".to_owned(),
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
        let mut terminal = Terminal::new(TestBackend::new(100, 20)).expect("a terminal in memory");
        terminal.draw(|frame| draw(frame, &seen, "m:1")).expect("drawn");
        let drawn = terminal.backend().to_string();
        for words in ["bolide at m:1: 1 hosts", "Hosts", "Jobs", "plates", "50.0", "busy"] {
            assert!(drawn.contains(words), "{words} in\n{drawn}");
        }
    }
}
