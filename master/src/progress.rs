//! How far a run is, in words, and how long it will take: for the terminal, the journal and the page.

use deck::model::Model;
use mechanics::state::GlobalState;

use crate::{
    event::{Limit, Progress},
    results,
};

/// Where a session of a run began: what was computed before says nothing of its pace.
#[derive(Clone, Copy, Debug, Default)]
pub struct Begun {
    pub cycle: u64,
    /// Part of the whole (0 to 1).
    pub share: f64,
}

impl Begun {
    /// At a state of a run.
    pub fn at(model: &Model, state: &GlobalState) -> Self {
        Self { cycle: state.cycle, share: share(model, state.time, state.cycle) }
    }

    /// Seconds to the end of a run that is so far `elapsed` seconds after it began here; none before it is farther than it was then.
    pub fn left(&self, share: f64, elapsed: f64) -> Option<f64> {
        let left = elapsed * (1.0 - share) / (share - self.share);
        Some(left).filter(|left| share > self.share && left.is_finite())
    }
}

/// The part of a run that is computed at a time or after so many cycles (0 to 1).
fn share(model: &Model, time: f64, cycle: u64) -> f64 {
    let control = &model.setup.control;
    (time / control.end_time).max(cycle as f64 / control.end_cycle as f64).clamp(0.0, 1.0)
}

/// How far a run is, in words, and the seconds to its end, `elapsed` seconds after it began. The time left comes first, up to a comma.
pub fn progress_line(
    model: &Model,
    progress: &Progress,
    begun: Begun,
    elapsed: f64,
) -> (String, f64, Option<f64>) {
    let share = share(model, progress.time, progress.cycle);
    let limit = match (progress.limit, progress.element) {
        (Limit::Courant, Some(element)) => format!("element {element}"),
        (limit, _) => format!("{limit:?}").to_lowercase(),
    };
    let left_s = begun.left(share, elapsed);
    let left = left_s.map_or_else(|| "starting".to_owned(), |left| format!("{} left", span(left)));
    let unit = results::Units::named(&model.units).time;
    let rate = progress.cycle.saturating_sub(begun.cycle) as f64 / elapsed.max(1e-3);
    let line = format!(
        "{left}, {:.1} %, cycle {}, t {:.4e} {unit}, step {:.2e} {unit} by {limit}, {rate:.0} cycles/s",
        100.0 * share,
        progress.cycle,
        progress.time,
        progress.dt
    );
    (line, share, left_s)
}

/// A time that a person waits for.
pub fn span(seconds: f64) -> String {
    match seconds {
        s if s < 120.0 => format!("{s:.0} s"),
        s if s < 7200.0 => format!("{:.0} min", s / 60.0),
        s if s < 172_800.0 => format!("{:.1} h", s / 3600.0),
        s => format!("{:.1} days", s / 86_400.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_left_is_reckoned_from_what_was_computed_since_a_run_went_on() {
        let text = include_str!("../../tests/decks/plates-small.toml");
        let model = deck::read(text, "small").expect("without faults");
        let end = model.setup.control.end_time;
        let begun = Begun { cycle: 700, share: share(&model, 0.5 * end, 700) };
        let at = |share: f64, cycle| Progress {
            time: share * end,
            cycle,
            dt: 1.0,
            limit: Limit::Courant,
            element: None,
        };
        // A tenth in ten seconds: forty are left for the other four, and not the seven that half of it in ten would make.
        let (line, share, left) = progress_line(&model, &at(0.6, 900), begun, 10.0);
        assert!(
            (share - 0.6).abs() < 1e-12 && left.is_some_and(|left| (left - 40.0).abs() < 1e-6),
            "{left:?}"
        );
        assert!(line.starts_with("40 s left, 60.0 %") && line.ends_with("20 cycles/s"), "{line}");
        // A rewind to before it, and the very start.
        assert!(progress_line(&model, &at(0.4, 600), begun, 10.0).0.starts_with("starting, "));
        assert_eq!(begun.left(0.5, 0.0), None);
        assert_eq!(Begun::default().left(0.5, 10.0), Some(10.0));
    }
}
