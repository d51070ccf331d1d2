//! Plays many seeds of the world that goes wrong: `cargo run --release -p tests --bin seeds -- [COUNT [FIRST [BUG]]]`.
//!
//! 10,000 seeds from 0 unless said otherwise. Prints how many, how long, what happened; a seed that goes wrong is printed
//! with its plot, and the program ends with failure. One seed again: `seeds -- 1 SEED`. With BUG the master has a planted one, which some of
//! the seeds must find: `unfenced`, it hears messages of epochs that are over; `narrow`, it compares of two computations of an interval
//! rows of the history and nothing else; `trusting`, it looks at no checksum of a stored file; `unsynced`, it stores a snapshot before the
//! states that this counts on are durable; `careless`, it goes on where the disk has no room for results; `deaf`, it looks at no checksum of a
//! frame; `patient`, it never gives up a worker that computes nothing; `hasty`, a job fails of descriptors that its
//! host does not have; `greedy`, it asks for nobody's memory once a job runs.

use std::{process::ExitCode, time::Instant};

use tests::seeds::{Bug, Stage};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, default: u64| arguments.get(at).map_or(Ok(default), |text| text.parse::<u64>());
    let bug = match arguments.get(2) {
        None => Ok(None),
        Some(word) => {
            let named = Bug::ALL.iter().find(|(name, _)| name == word);
            named.map(|(_, bug)| Some(*bug)).ok_or(word)
        }
    };
    let (Ok(count), Ok(first), Ok(bug)) = (number(0, 10_000), number(1, 0), bug) else {
        let names: Vec<&str> = Bug::ALL.iter().map(|(name, _)| *name).collect();
        eprintln!("seeds: expected COUNT and FIRST, two numbers, and nothing or one of {}", names.join(", "));
        return ExitCode::from(2);
    };
    // One thread: what a seed does may not depend on another.
    let pool = worker::daemon::compute_pool(1);
    let Ok(pool) = pool else {
        eprintln!("seeds: no thread to compute on");
        return ExitCode::FAILURE;
    };
    pool.install(|| {
        let started = Instant::now();
        let stage = Stage::new();
        let (mut wrong, mut happened, mut lost, mut lent) = (0_u64, 0, 0, 0);
        for seed in first..first + count {
            match stage.play(seed, bug) {
                Ok(played) => {
                    happened += played.count;
                    lost += played.solved.outcome.losses.len();
                    lent += played.lent;
                }
                Err(why) => {
                    wrong += 1;
                    eprintln!("{why}");
                }
            }
        }
        println!(
            "{count} seeds from {first}: {wrong} wrong; {happened} happenings, {lost} losses in the last lives of masters, {lent} workers lent to other jobs, {:.1} s",
            started.elapsed().as_secs_f64()
        );
        // A planted bug that nobody finds is the failure.
        if (wrong == 0) == bug.is_none() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
    })
}
