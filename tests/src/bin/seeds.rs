//! Plays many seeds of the world that goes wrong: `cargo run --release -p tests --bin seeds -- [COUNT [FIRST]]`.
//!
//! 10,000 seeds from 0 unless said otherwise. Prints how many, how long, what happened; a seed that goes wrong is printed
//! with its plot, and the program ends with failure. One seed again: `seeds -- 1 SEED`.

use std::{process::ExitCode, time::Instant};

use tests::seeds::Stage;

fn main() -> ExitCode {
    let mut numbers = std::env::args().skip(1).map(|text| text.parse::<u64>());
    let (Ok(count), Ok(first)) = (numbers.next().unwrap_or(Ok(10_000)), numbers.next().unwrap_or(Ok(0)))
    else {
        eprintln!("seeds: expected COUNT and FIRST, two numbers");
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
        let (mut wrong, mut happened, mut lost) = (0_u64, 0, 0);
        for seed in first..first + count {
            match stage.play(seed) {
                Ok(played) => {
                    happened += played.count;
                    lost += played.solved.outcome.losses.len();
                }
                Err(why) => {
                    wrong += 1;
                    eprintln!("{why}");
                }
            }
        }
        println!(
            "{count} seeds from {first}: {wrong} wrong; {happened} happenings, {lost} losses in the last lives of masters, {:.1} s",
            started.elapsed().as_secs_f64()
        );
        if wrong == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
    })
}
