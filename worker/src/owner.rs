//! OWNER: a worker steps back while the people whose PC it is on need that PC, and comes back when they have not for a while.
//!
//! [`Owner`] is pure: it takes what the system shows ([`Signs`]) with the time, and says why the worker is to stay away, if it is. [`watch`] asks the
//! system four times a second, so that a worker knows within one. [`Share`] slows the compute thread down.

use std::{
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU32, Ordering},
    },
    time::{Duration, Instant},
};

use system::{Signs, clock, owner::Watch};
use tokio::{sync::watch, time::MissedTickBehavior};
use tracing::info;

pub mod hours;

use hours::Hours;

/// Between two looks.
const LOOK_EVERY: Duration = Duration::from_millis(250);

/// When a worker steps back, and how far.
#[derive(Clone, Debug, PartialEq)]
pub struct Rules {
    /// The part of its time that it computes while the owner needs the PC; 0 for none, then it leaves its job. None if owners do not come first.
    pub share: Option<f64>,
    /// Processors that other programs keep busy in two looks one after the other before the owner counts as at work.
    pub load: f64,
    /// How long the owner must not have needed the PC before the worker comes back.
    pub quiet: Duration,
    /// When this host may work.
    pub hours: Option<Hours>,
}

impl Rules {
    /// Whether there is anything to look at.
    fn are_any(&self) -> bool {
        self.share.is_some() || self.hours.is_some()
    }
}

/// Whether a worker is to step back: the memory between looks.
#[derive(Debug)]
pub struct Owner {
    rules: Rules,
    /// Whether other programs were busy at the last look.
    busy: bool,
    /// The end of the quiet time, and why it began.
    until: Option<(Duration, String)>,
}

/// What a worker is to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Standing {
    /// Compute.
    Free,
    /// Compute a share of its time, and why.
    Slow(String),
    /// Leave its job and stay away, and why.
    Away(String),
}

impl Owner {
    /// Who has not been seen yet.
    pub const fn new(rules: Rules) -> Self {
        Self { rules, busy: false, until: None }
    }

    /// Takes a look: what the system shows since the last one, `now` since any fixed time, and the minute of the week.
    pub fn look(&mut self, signs: &Signs, now: Duration, minute: u32) -> Standing {
        if let Some(hours) = &self.rules.hours
            && !hours.contain(minute)
        {
            return Standing::Away(format!("this host works {hours}"));
        }
        let Some(share) = self.rules.share else { return Standing::Free };
        let busy = signs.others > self.rules.load;
        let was_busy = std::mem::replace(&mut self.busy, busy);
        // While the worker stays away, one look at a busy PC is enough.
        let need = need(signs, busy && (was_busy || self.until.is_some()));
        if let Some(why) = need {
            self.until = Some((now + self.rules.quiet, why));
        }
        match &self.until {
            Some((until, why)) if now < *until => match share {
                0.0 => Standing::Away(why.clone()),
                _ => Standing::Slow(why.clone()),
            },
            _ => {
                self.until = None;
                Standing::Free
            }
        }
    }
}

/// Why the owner needs the PC, if so.
fn need(signs: &Signs, busy: bool) -> Option<String> {
    if signs.typed {
        Some("its owner types".to_owned())
    } else if signs.logged_in {
        Some("somebody logged in".to_owned())
    } else if let Some(heat) = signs.hot {
        Some(format!("it is hot ({heat:.0} degrees Celsius)"))
    } else if signs.on_battery {
        Some("it is on battery".to_owned())
    } else {
        busy.then(|| "its owner's programs are at work".to_owned())
    }
}

/// The part of its time that a compute thread may work, which changes at any moment.
#[derive(Clone, Debug)]
pub struct Share(Arc<(AtomicU32, Mutex<Option<String>>)>);

impl Default for Share {
    fn default() -> Self {
        Self(Arc::new((AtomicU32::new(Self::WHOLE), Mutex::new(None))))
    }
}

impl Share {
    /// All of it, in thousandths.
    const WHOLE: u32 = 1000;
    /// The longest pause: a message of the master must not wait long.
    const LONGEST_PAUSE: Duration = Duration::from_secs(1);

    fn set(&self, share: f64, why: Option<&str>) {
        self.0.0.store((share * f64::from(Self::WHOLE)) as u32, Ordering::Relaxed);
        let words = why.map(|why| format!("works {:.0} % of the time: {why}", 100.0 * share));
        *self.0.1.lock().unwrap_or_else(PoisonError::into_inner) = words;
    }

    /// How large a part it is, and why, where it is not all of it.
    pub fn words(&self) -> Option<String> {
        self.0.1.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// How long to pause after so much work.
    pub fn pause(&self, worked: Duration) -> Duration {
        match self.0.0.load(Ordering::Relaxed) {
            Self::WHOLE.. => Duration::ZERO,
            share => {
                let share = f64::from(share.max(1)) / f64::from(Self::WHOLE);
                worked.mul_f64((1.0 - share) / share).min(Self::LONGEST_PAUSE)
            }
        }
    }
}

/// Looks at the machine from now on; tells why the worker is to stay away, where it is, and sets its share.
pub(crate) fn watch(rules: &Rules, share: &Share) -> watch::Receiver<Option<String>> {
    let (tell, told) = watch::channel(None);
    if !rules.are_any() {
        return told;
    }
    let (mut owner, share, slow) = (Owner::new(rules.clone()), share.clone(), rules.share.unwrap_or(0.0));
    let (mut machine, start, mut last) = (Watch::new(), Instant::now(), Standing::Free);
    let mut look = move || {
        let standing = owner.look(&machine.look(), start.elapsed(), clock::minute_of_week());
        if standing == last {
            return;
        }
        let (part, words, away) = match &standing {
            Standing::Free => (1.0, None, None),
            Standing::Slow(why) => (slow, Some(why.as_str()), None),
            // Until it has left, the others wait for it.
            Standing::Away(why) => (1.0, None, Some(why.clone())),
        };
        match &standing {
            Standing::Free => info!("nobody else needs this host any more"),
            Standing::Slow(why) => info!("{why}: working {:.0} % of the time", 100.0 * slow),
            Standing::Away(why) => info!("{why}: staying away"),
        }
        share.set(part, words);
        tell.send_replace(away);
        last = standing;
    };
    look();
    tokio::spawn(async move {
        let mut tick = tokio::time::interval(LOOK_EVERY);
        tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tick.tick().await;
            look();
        }
    });
    told
}

#[cfg(test)]
mod tests {
    use super::*;

    fn owner(share: f64) -> Owner {
        Owner::new(Rules { share: Some(share), load: 0.5, quiet: Duration::from_secs(300), hours: None })
    }

    fn away(why: &str) -> Standing {
        Standing::Away(why.to_owned())
    }

    /// Looks four times a second at `others` processors busy, for so many looks from a second on.
    fn looks(owner: &mut Owner, from: f64, others: f64, n: u32) -> Vec<Standing> {
        let at = |i| Duration::from_secs_f64(from + 0.25 * f64::from(i));
        (0..n).map(|i| owner.look(&Signs { others, ..Signs::default() }, at(i), 0)).collect()
    }

    #[test]
    fn two_looks_at_busy_programs_drive_it_away_until_they_have_been_quiet_for_long_enough() {
        let mut owner = owner(0.0);
        let busy = away("its owner's programs are at work");
        assert_eq!(looks(&mut owner, 0.0, 0.3, 4), vec![Standing::Free; 4], "the background");
        assert_eq!(looks(&mut owner, 1.0, 2.0, 3), [Standing::Free, busy.clone(), busy.clone()]);
        assert_eq!(looks(&mut owner, 200.0, 0.0, 1), std::slice::from_ref(&busy));
        // A single busy look begins the quiet time anew.
        assert_eq!(looks(&mut owner, 300.0, 1.0, 1), std::slice::from_ref(&busy));
        assert_eq!(looks(&mut owner, 599.5, 0.0, 4), [busy.clone(), busy, Standing::Free, Standing::Free]);
        // A short load is no owner.
        assert_eq!(looks(&mut owner, 700.0, 2.0, 1), [Standing::Free]);
        assert_eq!(looks(&mut owner, 700.25, 0.1, 1), [Standing::Free]);
    }

    #[test]
    fn who_types_or_logs_in_is_seen_at_once_and_so_are_battery_and_heat() {
        for (signs, why) in [
            (Signs { typed: true, ..Signs::default() }, "its owner types"),
            (Signs { logged_in: true, ..Signs::default() }, "somebody logged in"),
            (Signs { on_battery: true, ..Signs::default() }, "it is on battery"),
            (Signs { hot: Some(95.5), ..Signs::default() }, "it is hot (96 degrees Celsius)"),
        ] {
            assert_eq!(owner(0.0).look(&signs, Duration::ZERO, 0), away(why));
            assert_eq!(owner(0.25).look(&signs, Duration::ZERO, 0), Standing::Slow(why.to_owned()));
            let mut none = Owner::new(Rules { share: None, load: 0.5, quiet: Duration::ZERO, hours: None });
            assert_eq!(none.look(&signs, Duration::ZERO, 0), Standing::Free);
        }
    }

    #[test]
    fn outside_its_hours_a_host_stays_away_and_within_them_it_comes_at_once() {
        let hours = Some("Mon-Fri 18:00-08:00".parse().expect("hours"));
        let mut owner = Owner::new(Rules { share: None, load: 0.5, quiet: Duration::from_secs(300), hours });
        let mut at = |hour: u32| owner.look(&Signs::default(), Duration::ZERO, 60 * hour);
        assert_eq!(at(12), away("this host works Mon-Fri 18:00-08:00"));
        assert_eq!(at(18), Standing::Free);
    }

    #[test]
    fn a_share_is_kept_by_pauses() {
        let (share, work) = (Share::default(), Duration::from_millis(100));
        assert_eq!(share.pause(work), Duration::ZERO);
        share.set(0.25, Some("its owner types"));
        assert_eq!(share.words().as_deref(), Some("works 25 % of the time: its owner types"));
        assert_eq!(share.pause(work), Duration::from_millis(300));
        share.set(0.0, None);
        assert_eq!(share.pause(work), Share::LONGEST_PAUSE);
        share.set(1.0, None);
        assert_eq!(share.pause(work), Duration::ZERO);
    }
}
