//! PACE: which worker a job waits for in vain, by the pace that the job itself has measured.
//!
//! A link's signs of life say that a process lives; they do not say that it computes. Workers go in step: when one stands still, all
//! others have sent what they can within two cycles, and the job hears nothing more. The worker that is furthest behind is then
//! *suspect*, and later *late*. Both limits are multiples of the longest silence that the job has outlived, and neither is shorter
//! than a fixed time, because a PC that swaps is silent for seconds. A message that is long on its way, such as a state over a slow
//! wire, is no silence: its bytes are counted.
//!
//! It reads no clock: times are seconds since the job began, and the caller says when it was busy itself.

/// The least silence after which a worker is suspect (s).
const SUSPECT_SECONDS: f64 = 5.0;
/// The least silence after which a worker is late (s), and the same once the job is to end: somebody waits for it.
const LATE_SECONDS: [f64; 2] = [20.0, 5.0];
/// The same limits as multiples of the longest silence so far.
const SUSPECT_SILENCES: f64 = 20.0;
const LATE_SILENCES: [f64; 2] = [60.0, 20.0];
/// What is granted in addition until every worker has sent a cycle (s per element of the problem): sub-domains are cut, unpacked and
/// made ready.
const LOAD_SECONDS_PER_ELEMENT: f64 = 2e-4;
/// Bytes that travel on the link of a worker between two looks when only signs of life do, at most.
const SIGNS_OF_LIFE: u64 = 1024;
/// What is left of the longest silence after each cycle, so that one long silence is forgotten within hundreds of cycles.
const FADING: f64 = 0.99;

/// A worker that the job waits for.
#[derive(Clone, Debug, PartialEq)]
pub struct Waiting {
    /// Its index in the job.
    pub worker: usize,
    /// How long nothing was heard (s).
    pub silence: f64,
    /// The longest silence so far (s).
    pub longest: f64,
    /// It is given up.
    pub late: bool,
}

/// What one worker of the epoch has sent.
#[derive(Clone, Copy, Debug)]
struct Place {
    worker: usize,
    /// 0 when it was dealt its work, 1 when it is ready, `c + 2` when it has sent cycle `c`.
    position: u64,
    heard: f64,
    /// Bytes of its link at the last look; none before the first.
    bytes: Option<u64>,
}

/// The pace of a job.
#[derive(Debug)]
pub struct Pace {
    n_elements: usize,
    places: Vec<Place>,
    /// What all have sent at least.
    everybody: u64,
    /// When the job had last done what it was told to do (s), and the same when workers were last asked where they stand.
    touched: f64,
    asked: f64,
    longest: f64,
}

impl Pace {
    /// Of a job that nobody computes yet.
    pub const fn new(n_elements: usize) -> Self {
        Self { n_elements, places: Vec::new(), everybody: 0, touched: 0.0, asked: 0.0, longest: 0.0 }
    }

    /// An epoch begins with these workers.
    pub fn begin(&mut self, at_work: &[usize], now: f64) {
        self.places =
            at_work.iter().map(|&worker| Place { worker, position: 0, heard: now, bytes: None }).collect();
        (self.everybody, self.touched) = (0, now);
    }

    /// A worker has sent a message of the epoch; with the position that it has come to, if the message says so.
    pub fn hear(&mut self, worker: usize, position: Option<u64>, now: f64) {
        self.longest = self.longest.max(now - self.touched);
        let before = self.least();
        if let Some(place) = self.places.iter_mut().find(|place| place.worker == worker) {
            place.heard = now;
            place.position = place.position.max(position.unwrap_or_default());
        }
        if self.least() > before {
            self.longest *= FADING;
        }
    }

    /// All workers have sent a cycle.
    pub fn hear_all(&mut self, position: u64, now: f64) {
        self.longest = self.longest.max(now - self.touched);
        if self.everybody < position {
            self.everybody = position;
            self.longest *= FADING;
        }
    }

    /// At a look, so many bytes have travelled on a worker's link since it stood. Where they are more than signs of life since the last
    /// look, a message is on its way, to it or from it.
    pub fn hear_bytes(&mut self, worker: usize, bytes: u64, now: f64) {
        let Some(place) = self.places.iter_mut().find(|place| place.worker == worker) else { return };
        let before = place.bytes.replace(bytes);
        if before.is_some_and(|before| bytes.saturating_sub(before) > SIGNS_OF_LIFE) {
            self.touched = now;
        }
    }

    /// A worker says where it stands, because it was asked.
    pub fn place(&mut self, worker: usize, position: u64) {
        if let Some(place) = self.places.iter_mut().find(|place| place.worker == worker) {
            place.position = place.position.max(position);
        }
    }

    /// Whether workers are to be asked where they stand before one is named: once in each silence, where votes of all come as one.
    pub fn asks(&mut self) -> bool {
        let asks = self.everybody > 0 && self.asked < self.touched;
        if asks {
            self.asked = self.touched;
        }
        asks
    }

    /// The job has done what a message asked for; while it did, no worker could make itself heard.
    pub fn touch(&mut self, now: f64) {
        self.touched = now;
    }

    /// The worker that is furthest behind, if the job has waited for too long; `ends` if somebody waits for its end.
    pub fn waits_for(&self, ends: bool, now: f64) -> Option<Waiting> {
        // Of equal positions, the worker that was heard first has been silent for longest.
        let least = self.least();
        let behind = self.places.iter().filter(|place| place.position.max(self.everybody) == least);
        let behind = behind.min_by(|a, b| a.heard.total_cmp(&b.heard))?;
        let loading = if least < 2 { LOAD_SECONDS_PER_ELEMENT * self.n_elements as f64 } else { 0.0 };
        let limit = |seconds: f64, silences: f64| seconds.max(silences * self.longest) + loading;
        let silence = now - self.touched;
        let late = silence >= limit(LATE_SECONDS[usize::from(ends)], LATE_SILENCES[usize::from(ends)]);
        let suspect = silence >= limit(SUSPECT_SECONDS, SUSPECT_SILENCES);
        let waiting = Waiting { worker: behind.worker, silence, longest: self.longest, late };
        (late || suspect).then_some(waiting)
    }

    fn least(&self) -> u64 {
        let least = self.places.iter().map(|place| place.position).min().unwrap_or_default();
        least.max(self.everybody)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Workers 3 and 5 compute cycles of 10 ms; the time after the last of them.
    fn computing(cycles: u64) -> (Pace, f64) {
        let mut pace = Pace::new(1000);
        pace.begin(&[3, 5], 0.0);
        let mut now = 0.0;
        for position in 1..cycles + 2 {
            for worker in [3, 5] {
                now += 0.005;
                pace.hear(worker, Some(position), now);
                pace.touch(now);
            }
        }
        (pace, now)
    }

    #[test]
    fn the_worker_that_is_behind_is_suspect_then_late_and_the_others_are_not() {
        let (mut pace, now) = computing(100);
        pace.hear(5, Some(102), now);
        pace.touch(now);
        assert_eq!(pace.waits_for(false, now + 4.9), None);
        let suspect = pace.waits_for(false, now + 5.1).expect("silent");
        assert!(suspect.worker == 3 && !suspect.late, "{suspect:?}");
        let late = pace.waits_for(false, now + 20.1).expect("silent");
        assert!(late.worker == 3 && late.late, "{late:?}");
        assert!(pace.waits_for(true, now + 5.1).is_some_and(|w| w.late), "somebody waits for the end");
    }

    #[test]
    fn of_workers_at_the_same_cycle_the_one_heard_first_is_behind() {
        let (pace, now) = computing(100);
        assert_eq!(pace.waits_for(false, now + 6.0).map(|w| w.worker), Some(3));
    }

    #[test]
    fn slow_cycles_are_granted_sixty_times_their_length_and_a_long_silence_is_forgotten() {
        let (mut pace, mut now) = computing(100);
        now += 9.0;
        pace.hear(3, Some(102), now);
        pace.hear(5, Some(102), now);
        pace.touch(now);
        assert_eq!(pace.waits_for(false, now + 100.0), None, "such silences happen here");
        for position in 103..800 {
            for worker in [3, 5] {
                now += 0.005;
                pace.hear(worker, Some(position), now);
                pace.touch(now);
            }
        }
        assert!(pace.waits_for(false, now + 20.1).is_some_and(|w| w.late));
    }

    #[test]
    fn a_state_over_a_slow_wire_is_no_silence_and_signs_of_life_are() {
        let (mut pace, mut now) = computing(100);
        let mut bytes = [5_000_000, 5_000_000];
        for _ in 0..45 {
            now += 1.0;
            for (worker, bytes) in [3, 5].into_iter().zip(&mut bytes) {
                *bytes += 600_000;
                pace.hear_bytes(worker, *bytes, now);
            }
            assert_eq!(pace.waits_for(false, now), None);
        }
        // Then worker 5 alone sends, then nobody.
        for second in 1..21 {
            now += 1.0;
            bytes[1] += if second < 10 { 600_000 } else { 40 };
            pace.hear_bytes(3, bytes[0], now);
            pace.hear_bytes(5, bytes[1], now);
        }
        assert!(pace.waits_for(false, now).is_some_and(|w| w.worker == 3 && !w.late && w.silence == 11.0));
        assert!(pace.waits_for(false, now + 9.0).is_some_and(|w| w.worker == 3 && w.late));
    }

    #[test]
    fn who_loads_is_granted_time_by_the_size_of_the_problem_and_a_busy_master_blames_nobody() {
        let mut pace = Pace::new(1_000_000);
        pace.begin(&[0, 1], 0.0);
        pace.hear(0, Some(1), 1.0);
        pace.touch(1.0);
        assert_eq!(pace.waits_for(false, 200.0), None);
        assert!(pace.waits_for(false, 282.0).is_some_and(|w| w.worker == 1 && w.late));
        let (mut pace, now) = computing(10);
        pace.touch(now + 100.0);
        assert_eq!(pace.waits_for(false, now + 101.0), None);
        assert_eq!(Pace::new(1).waits_for(true, 1e6), None, "nobody is at work");
    }
}
