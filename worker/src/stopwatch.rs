//! STOPWATCH: wall-clock time of a worker by phase, kept by whatever runs a session; the session knows no clock.
//!
//! Totals run from the first cycle on. What is between two laps is waiting. The last few cycles are kept as spans.

use std::{
    collections::VecDeque,
    time::{Duration, Instant, SystemTime, UNIX_EPOCH},
};

use protocol::phase::{Phase, Report, SPANS_LIMIT, Span, TRACED_CYCLES};

/// Gaps shorter than this are a runtime's own steps between two tasks: counted, but not worth a span.
const SHORTEST_SPAN: Duration = Duration::from_micros(1);

/// Something done, from when to when.
#[derive(Clone, Copy, Debug)]
pub struct Lap {
    pub phase: Phase,
    /// Its start.
    pub from: Instant,
    /// Its end.
    pub to: Instant,
}

/// Laps of one worker in one job.
#[derive(Debug)]
pub struct Stopwatch {
    start: Instant,
    /// The same on the host's clock (ns since 1970).
    start_ns: u64,
    /// The end of the last lap; none before the first cycle.
    end: Option<Instant>,
    report: Report,
    spans: VecDeque<Span>,
}

impl Default for Stopwatch {
    fn default() -> Self {
        Self::new()
    }
}

impl Stopwatch {
    /// Before the first cycle.
    pub fn new() -> Self {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self {
            start: Instant::now(),
            start_ns: nanoseconds(since),
            end: None,
            report: Report::default(),
            spans: VecDeque::new(),
        }
    }

    /// Books a lap of `cycle`, and the waiting before it. Laps before the first border phase belong to no cycle.
    pub fn book(&mut self, cycle: u64, lap: Lap) {
        let Some(end) = self.end.or(matches!(lap.phase, Phase::Border | Phase::Contact).then_some(lap.from))
        else {
            return;
        };
        if lap.from > end {
            self.add(cycle, Lap { phase: Phase::Wait, from: end, to: lap.from });
        }
        self.add(cycle, lap);
        self.end = Some(lap.to);
    }

    fn add(&mut self, cycle: u64, Lap { phase, from, to }: Lap) {
        let length = to.saturating_duration_since(from);
        let length_ns = nanoseconds(length);
        self.report.ns[phase as usize] += length_ns;
        while self.spans.len() >= SPANS_LIMIT
            || self.spans.front().is_some_and(|span| span.cycle + TRACED_CYCLES <= cycle)
        {
            self.spans.pop_front();
        }
        let start_ns = self.start_ns + nanoseconds(from.saturating_duration_since(self.start));
        match self.spans.back_mut() {
            // One frame to each neighbour, one after another, is one phase.
            Some(last) if last.phase == phase && last.cycle == cycle => {
                last.length_ns = (start_ns + length_ns).saturating_sub(last.start_ns);
            }
            _ if length < SHORTEST_SPAN => {}
            _ => self.spans.push_back(Span { phase, cycle, start_ns, length_ns }),
        }
    }

    /// All of it so far; what concerns links is the runtime's to fill in.
    pub fn report(&self) -> Report {
        Report { spans: self.spans.iter().copied().collect(), ..self.report.clone() }
    }
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_waiting_and_only_the_last_cycles_keep_their_spans() {
        let mut watch = Stopwatch::new();
        let ms = Duration::from_millis;
        let start = watch.start;
        let lap = |phase, from: u64, to: u64| Lap { phase, from: start + ms(from), to: start + ms(to) };
        watch.book(0, lap(Phase::Other, 0, 50));
        for cycle in 0..40 {
            let at = 100 + 10 * cycle;
            watch.book(cycle, lap(Phase::Border, at, at + 2));
            watch.book(cycle, lap(Phase::Send, at + 2, at + 3));
            watch.book(cycle, lap(Phase::Send, at + 3, at + 4));
            watch.book(cycle, lap(Phase::Integrate, at + 7, at + 10));
        }
        let report = watch.report();
        let milliseconds = |phase| report.seconds(phase) * 1e3;
        for (phase, expected) in [
            (Phase::Border, 80.0),
            (Phase::Send, 80.0),
            (Phase::Wait, 120.0),
            (Phase::Integrate, 120.0),
            (Phase::Other, 0.0),
        ] {
            assert!((milliseconds(phase) - expected).abs() < 1e-6, "{phase:?}: {}", milliseconds(phase));
        }
        assert_eq!(report.spans.len(), 4 * TRACED_CYCLES as usize);
        assert_eq!(report.spans[0].cycle, 40 - TRACED_CYCLES);
        for pair in report.spans.windows(2) {
            assert_eq!(pair[0].start_ns + pair[0].length_ns, pair[1].start_ns, "spans touch");
        }
    }
}
