//! METRICS: `/metrics` as Prometheus reads it.

use std::fmt::Write;

use axum::{extract::State, http::header, response::IntoResponse};
use protocol::request::{HostRow, State as JobState, Status};

use super::{api_state::ApiState, board};
use crate::notice::{Notice, ask};

/// The table.
pub async fn text(State(api_state): State<ApiState>) -> impl IntoResponse {
    let jobs = ask(&api_state.notices, Notice::Jobs).await.unwrap_or_default();
    let hosts = ask(&api_state.notices, Notice::Hosts).await.unwrap_or_default();
    let content = [(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")];
    (content, render(&api_state, &jobs, &hosts))
}

fn render(api_state: &ApiState, jobs: &[Status], hosts: &[HostRow]) -> String {
    let mut out = String::new();
    family(&mut out, "bolide_jobs", "gauge", "Jobs by state.");
    for state in [
        JobState::Queued,
        JobState::Running,
        JobState::Done,
        JobState::Failed,
        JobState::Held,
        JobState::Cancelled,
    ] {
        let count = jobs.iter().filter(|job| job.state == state).count();
        sample(&mut out, "bolide_jobs", &[("state", state.name())], count as f64);
    }
    family(&mut out, "bolide_hosts", "gauge", "Hosts by state.");
    for state in ["idle", "busy", "lost", "left"] {
        let count = hosts.iter().filter(|host| host.state == state).count();
        sample(&mut out, "bolide_hosts", &[("state", state)], count as f64);
    }
    family(&mut out, "bolide_host_speed", "gauge", "Relative speed of a host, as given.");
    for host in hosts {
        sample(&mut out, "bolide_host_speed", &[("host", &host.name)], host.speed);
    }
    family(&mut out, "bolide_host_load", "gauge", "Part of its time that a busy host computes.");
    for host in hosts.iter().filter(|host| host.state == "busy") {
        if let Some(load) = api_state.board.load(&host.name) {
            sample(&mut out, "bolide_host_load", &[("host", &host.name)], load);
        }
    }
    let running: Vec<_> = jobs.iter().filter(|job| job.state == JobState::Running).collect();
    let briefs: Vec<_> = running
        .iter()
        .filter_map(|job| api_state.board.job_view(job.job).map(|s| (job, board::lock(&s).brief().clone())))
        .collect();
    family(&mut out, "bolide_job_cycle", "gauge", "Cycles completed by a running job.");
    for job in &running {
        sample(&mut out, "bolide_job_cycle", &[("job", &job.job.to_string())], job.cycle as f64);
    }
    family(&mut out, "bolide_job_progress", "gauge", "Part of a running job that is done, 0 to 1.");
    for (job, brief) in &briefs {
        sample(&mut out, "bolide_job_progress", &[("job", &job.job.to_string())], brief.share);
    }
    family(&mut out, "bolide_job_cycles_per_second", "gauge", "Cycles per second of a running job.");
    for (job, brief) in &briefs {
        sample(&mut out, "bolide_job_cycles_per_second", &[("job", &job.job.to_string())], brief.rate);
    }
    family(&mut out, "bolide_job_imbalance", "gauge", "Slowest worker over mean of a running job.");
    for (job, brief) in &briefs {
        if let Some(imbalance) = brief.imbalance {
            sample(&mut out, "bolide_job_imbalance", &[("job", &job.job.to_string())], imbalance);
        }
    }
    out
}

/// Writing to a string cannot fail.
fn family(out: &mut String, name: &str, kind: &str, help: &str) {
    let _ = writeln!(out, "# HELP {name} {help}\n# TYPE {name} {kind}");
}

fn sample(out: &mut String, name: &str, labels: &[(&str, &str)], value: f64) {
    let labels: Vec<String> =
        labels.iter().map(|(key, text)| format!("{key}=\"{}\"", escape(text))).collect();
    let _ = writeln!(out, "{name}{{{}}} {value}", labels.join(","));
}

fn escape(text: &str) -> String {
    text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_cannot_end_early() {
        let mut out = String::new();
        sample(&mut out, "m", &[("host", "a\"} 1\nb\\")], 0.5);
        assert_eq!(out, "m{host=\"a\\\"} 1\\nb\\\\\"} 0.5\n");
    }
}
