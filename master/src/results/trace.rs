//! TRACE: what workers did in their last cycles, as trace events that Perfetto and chrome://tracing open.
//!
//! Times are wall-clock times of each host, in microseconds after the earliest span of all; hosts whose clocks differ
//! are shifted against each other by as much.

use std::path::Path;

use protocol::phase::Report;
use serde_json::json;

use super::{Error, write_whole};

/// Writes the trace of these workers.
///
/// # Errors
/// [`Error::Io`].
pub fn write(path: &Path, names: &[String], reports: &[Report]) -> Result<(), Error> {
    write_whole(path, |out| {
        serde_json::to_writer(&mut *out, &events(names, reports))?;
        std::io::Write::write_all(out, b"\n")
    })
}

fn events(names: &[String], reports: &[Report]) -> serde_json::Value {
    let spans = || reports.iter().flat_map(|report| &report.spans);
    let start = spans().map(|span| span.start_ns).min().unwrap_or(0);
    let microseconds = |ns: u64| ns as f64 * 1e-3;
    let mut events = Vec::with_capacity(names.len() + spans().count());
    for (index, (name, report)) in names.iter().zip(reports).enumerate() {
        events.push(json!({
            "ph": "M", "name": "process_name", "pid": index + 1, "args": { "name": name }
        }));
        for span in &report.spans {
            events.push(json!({
                "ph": "X", "name": span.phase.name(), "cat": "worker", "pid": index + 1, "tid": 0,
                "ts": microseconds(span.start_ns - start), "dur": microseconds(span.length_ns),
                "args": { "cycle": span.cycle }
            }));
        }
    }
    json!({ "displayTimeUnit": "ms", "traceEvents": events })
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::phase::{Phase, Span};

    #[test]
    fn every_span_is_a_complete_event_of_its_worker() {
        let span = |phase, start_ns| Span { phase, cycle: 7, start_ns, length_ns: 1500 };
        let report = |spans| Report { spans, ..Report::default() };
        let reports = [report(vec![span(Phase::Wait, 9_000)]), report(vec![span(Phase::Contact, 4_000)])];
        let value = events(&["a".to_owned(), "b".to_owned()], &reports);
        let events = value["traceEvents"].as_array().expect("a list");
        assert_eq!(events.len(), 4);
        assert_eq!((&events[1]["name"], &events[1]["ts"]), (&json!("wait"), &json!(5.0)));
        let second = json!({
            "ph": "X", "name": "contact", "cat": "worker", "pid": 2, "tid": 0, "ts": 0.0, "dur": 1.5,
            "args": { "cycle": 7 }
        });
        assert_eq!(events[3], second);
    }
}
