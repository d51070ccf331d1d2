//! What goes wrong in the world of one seed, and when.

use std::sync::Arc;

use deck::Model;
use master::options::{CheckpointEvery, SessionOptions, VoteTree};
use protocol::options::{JobOptions, Route, SortBy};

use super::{Draws, Flip, Played, Seen, play};
use crate::solve::model;

/// One thing that goes wrong. Hosts are picked among those alive by a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A process is gone with all that it knew; another may start on its host.
    Crash {
        host: u64,
        /// Whether it is started again.
        returns: bool,
    },
    /// Nothing passes between master and worker for a while; if long, the master gives the worker up and it calls anew.
    Cut {
        host: u64,
        /// Longer than the master waits.
        long: bool,
    },
    /// The link between two workers ends with what is on it.
    PairCut {
        host: u64,
        /// The other, or the same: then nothing happens.
        other: u64,
    },
    /// A host becomes so many times as slow.
    Slow {
        host: u64,
        /// How many times.
        factor: u64,
    },
    /// From now on a host's elements are wrong by one unit in the last place.
    Spoil { host: u64 },
    /// A bit flips in a host's memory.
    Flip(Flip),
    /// The next writes find no room on the disk.
    Full {
        /// How many: rows, states and snapshots.
        writes: u64,
    },
    /// The master has no descriptor left: it opens no file and takes no caller.
    Files {
        /// How many of both fail.
        writes: u64,
    },
    /// Others take the memory of a host's machine: its process is ended, and one that starts there again has no memory for its share.
    Memory { host: u64 },
    /// A bit flips in a stored file, and the master is gone, so that the next one reads it.
    Rot,
    /// The master's machine loses power before the last rename of a snapshot was durable.
    PowerLoss,
    /// The task that a host computes never ends, and its link lives on.
    Stick { host: u64 },
    /// A bit flips in a frame that a host sends to the master.
    Garble { host: u64, bit: u32 },
    /// The clock jumps: what waits for a time is due now, or an hour later.
    Clock { ahead: bool },
    /// A worker comes.
    Join,
    /// Another job needs a host for a while.
    Yield { host: u64 },
    /// The master is gone, and starts anew from the disk.
    Master,
    /// The master is told to leave: it stores the run, and another one goes on with it.
    Leave,
}

/// What goes wrong, by the number of the happening before which it does.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Plot {
    /// Workers at the start.
    pub workers: usize,
    /// The cycle at which the disk gets a snapshot.
    pub snapshot_at: Option<u64>,
    /// Latest first.
    faults: Vec<(u64, Fault)>,
    /// A planted bug of the master.
    pub(super) bug: Option<Bug>,
}

/// A bug that is planted in the master, for seeds to find.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bug {
    /// Messages of epochs that are over reach it as if they were of now.
    Unfenced,
    /// What it compares of two computations of an interval are rows of the history and nothing else.
    Narrow,
    /// It goes on from a stored file whatever the checksum says.
    Trusting,
    /// It stores a snapshot before the states that this counts on are durable.
    Unsynced,
    /// It goes on where a row or state found no room.
    Careless,
    /// It takes frames whatever the checksum says.
    Deaf,
    /// It never gives up a worker whose link lives.
    Patient,
    /// A job fails of descriptors that its host does not have.
    Hasty,
    /// Once a job runs it asks for nobody's memory.
    Greedy,
}

impl Bug {
    /// Each with its name on the command line.
    pub const ALL: [(&str, Self); 9] = [
        ("unfenced", Self::Unfenced),
        ("narrow", Self::Narrow),
        ("trusting", Self::Trusting),
        ("unsynced", Self::Unsynced),
        ("careless", Self::Careless),
        ("deaf", Self::Deaf),
        ("patient", Self::Patient),
        ("hasty", Self::Hasty),
        ("greedy", Self::Greedy),
    ];
}

impl Plot {
    /// Nothing goes wrong.
    pub fn quiet(workers: usize) -> Self {
        Self { workers, ..Self::default() }
    }

    /// One thing goes wrong, before this happening.
    pub fn of(workers: usize, at: u64, fault: Fault) -> Self {
        Self { faults: vec![(at, fault)], ..Self::quiet(workers) }
    }

    /// The fault that is due, if one is.
    pub(super) fn due(&mut self, count: u64) -> Option<Fault> {
        if self.faults.last().is_some_and(|(at, _)| *at <= count) {
            self.faults.pop().map(|(_, fault)| fault)
        } else {
            None
        }
    }
}

/// The problem, the answer, and how many things happen on the way to it.
pub struct Stage {
    pub(super) model: Arc<Model>,
    pub(super) answer: Seen,
    length: u64,
}

/// Two small blocks that collide askew on a wall of finite mass, a plate of shells behind them, sand beside them, with friction, elastic
/// hourglass control and a gauge: a few cells, many cycles, and numbers of every kind that a worker can hold.
const DECK: &str = r#"
    title = "small blocks"
    units = "cm-g-us"
    [control]
    end_cycle = 60
    end_time = 1e3
    plan_interval = 7
    sort_lag = 4
    [[part]]
    name = "target"
    material = "AL_2024_T351"
    box = { origin = [0, 0, 0], size = [4, 3, 2], cells = [4, 3, 2] }
    hourglass = { kind = "assumed-strain", coefficient = 1.0 }
    [[part]]
    name = "sand"
    material = "SAND"
    velocity = [-0.03, 0, 0]
    box = { origin = [4.2, 0.6, 0.3], size = [2, 2, 1], cells = [2, 2, 1] }
    [[part]]
    name = "projectile"
    material = "STEEL_1006"
    velocity = [0.03, 0.01, -0.08]
    box = { origin = [1.3, 0.7, 2.2], size = [2, 2, 1], cells = [2, 2, 1] }
    [[part]]
    name = "plate"
    material = "AL_2024_T351"
    velocity = [0, 0, -0.14]
    shell = { thickness = 0.3 }
    plate = { origin = [1.2, 0.8, 3.4], side_i = [2, 0.1, 0], side_j = [0, 2, 0.1], cells = [2, 3] }
    [[material]]
    name = "SAND"
    density = 1.8
    eos = { type = "linear", bulk = 0.03 }
    [material.strength]
    type = "soil-foam"
    shear = 6e-4
    unloading = 0.03
    a0 = 1e-8
    a2 = 0.3
    points = [[0, 0], [0.05, 1e-4], [0.2, 1e-3]]
    [contact]
    gap_length = 0.15
    friction = 0.1
    [[wall]]
    point = [0, 0, -0.02]
    normal = [0, 0, 1]
    mass = 5000
    velocity = { z = 0.001 }
    parts = ["target"]
    [output]
    history_cycles = 3
    period = 2
    [[gauge]]
    name = "struck face"
    part = "target"
    point = [2, 1, 2]
"#;

pub(super) fn options(route: Route) -> SessionOptions {
    let asked = JobOptions { route: Some(route), sort_seed: Some(11), ..JobOptions::default() };
    SessionOptions { asked, waits: true, replay: true, ..SessionOptions::default() }
}

impl Stage {
    /// Plays it undisturbed.
    ///
    /// # Panics
    /// If that fails, or has no contact.
    pub fn new() -> Self {
        let model = Arc::new(model(DECK));
        let Played { solved, count, .. } = match play(&model, &options(Route::Master), 0, Plot::quiet(3)) {
            Ok(played) => played,
            Err(why) => panic!("the undisturbed run: {why}"),
        };
        assert!(solved.outcome.run_totals.worst_penetration > 0.0, "no contact");
        assert!(solved.states.len() > 3 && solved.rows.len() > 15, "{} states", solved.states.len());
        Self { model, answer: Seen::of(&solved), length: count }
    }

    pub fn plot(&self, seed: u64) -> (Plot, SessionOptions) {
        let mut draws = Draws::new(seed);
        let workers = 1 + draws.below(4) as usize;
        let route = [Route::Master, Route::Direct][draws.below(2) as usize];
        let keep = match draws.below(4) {
            0 => CheckpointEvery::Never,
            1 => CheckpointEvery::Cycles(1),
            2 => CheckpointEvery::Cycles(10),
            _ => CheckpointEvery::Seconds(0.002),
        };
        let snapshot_at = (draws.below(2) == 0).then(|| 1 + draws.below(50));
        let length = self.length;
        let mut at = 0;
        let mut faults: Vec<(u64, Fault)> = (0..draws.below(7))
            .map(|_| {
                // In one case of three close behind the one before: in its rollback.
                at = if draws.below(3) == 0 { at + draws.below(40) } else { draws.below(length) };
                let (host, other) = (draws.below(64), draws.below(64));
                let fault = match draws.below(29) {
                    0..=3 => Fault::Crash { host, returns: true },
                    4 | 5 => Fault::Crash { host, returns: false },
                    6 => Fault::Cut { host, long: false },
                    7 | 8 => Fault::Cut { host, long: true },
                    9 | 10 => Fault::PairCut { host, other },
                    11 => Fault::Slow { host, factor: 2 + draws.below(30) },
                    12 => Fault::Spoil { host },
                    13 => Fault::Join,
                    14 => Fault::Yield { host },
                    15 | 16 => Fault::Flip(Flip::draw(&mut draws)),
                    17 if host < 32 => Fault::Master,
                    17 => Fault::Leave,
                    18 => Fault::Full { writes: 1 + other },
                    19 | 20 => Fault::Rot,
                    21 => Fault::PowerLoss,
                    22 => Fault::Stick { host },
                    23 | 24 => Fault::Garble { host, bit: draws.below(1 << 20) as u32 },
                    25 => Fault::Files { writes: 1 + other },
                    26 | 27 => Fault::Memory { host },
                    _ => Fault::Clock { ahead: host < 32 },
                };
                (at, fault)
            })
            .collect();
        faults.sort_by_key(|(at, _)| std::cmp::Reverse(*at));
        let store = draws.below(2) == 0;
        // One bit flips at most, and then all is computed twice.
        let is_flip = |fault: &Fault| matches!(fault, Fault::Flip(_));
        let mut flips = 0;
        faults.retain(|(_, fault)| {
            flips += u32::from(is_flip(fault));
            flips <= 1 || !is_flip(fault)
        });
        let sometimes = [0.0, 0.0, 0.5, 1.0][draws.below(4) as usize];
        let mut options = SessionOptions { keep, store, ..options(route) };
        options.asked.verify = if flips > 0 { 1.0 } else { sometimes };
        // On route direct: votes to the master, by a tree of a hub and its neighbours, or by a deeper one.
        options.tree =
            [VoteTree::default(), VoteTree { from: 2, neighbours: 12 }, VoteTree { from: 2, neighbours: 0 }]
                [draws.below(3) as usize];
        // There the workers may sort.
        options.asked.sort_by = [SortBy::Auto, SortBy::Workers][draws.below(2) as usize];
        (Plot { snapshot_at, faults, ..Plot::quiet(workers) }, options)
    }

    /// Plays a seed; gives what it took, or how it went wrong, with the seed and its plot. A bug of the master may be planted.
    ///
    /// # Errors
    /// As said.
    pub fn play(&self, seed: u64, bug: Option<Bug>) -> Result<Played, String> {
        let (plot, options) = self.plot(seed);
        let plot = Plot { bug, ..plot };
        let told = format!(
            "seed {seed}: {plot:?}, {:?}, {:?}, {}",
            options.route(),
            options.keep,
            options.asked.verify
        );
        let played = play(&self.model, &options, seed, plot).map_err(|why| format!("{told}: {why}"))?;
        if Seen::of(&played.solved) != self.answer {
            let (ours, theirs) = (self.answer.digest(), &played.solved.outcome.digest);
            return Err(format!("{told}: another result than undisturbed, digest {theirs}, not {ours}"));
        }
        Ok(played)
    }
}

impl Default for Stage {
    fn default() -> Self {
        Self::new()
    }
}
