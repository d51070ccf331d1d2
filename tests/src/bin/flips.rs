//! Single bits that flip in a worker's memory: `cargo run --release -p tests --bin flips -- [COUNT [FIRST]]`.
//!
//! So many tries (100), from try FIRST on (0), each with every part of the run that [`tests::seeds::flips::FRACTIONS`] has computed twice.
//! Prints what became of them as tables, and in words the runs that ended with an error though all of them was computed twice. Fails
//! if one of those has other results than the undisturbed one. One try again, in words: `flips -- 1 NUMBER`.

use std::{process::ExitCode, time::Instant};

use tests::seeds::flips::{Campaign, End, Try, table};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, default: u64| arguments.get(at).map_or(Ok(default), |text| text.parse::<u64>());
    let (Ok(count), Ok(first), true) = (number(0, 100), number(1, 0), arguments.len() <= 2) else {
        eprintln!("flips: expected COUNT and FIRST, two numbers");
        return ExitCode::from(2);
    };
    let Ok(pool) = worker::daemon::compute_pool(1) else {
        eprintln!("flips: no thread to compute on");
        return ExitCode::FAILURE;
    };
    pool.install(|| {
        let started = Instant::now();
        let tries = Campaign::new().play_all(first..first + count);
        println!("{count} tries from {first}, {:.1} s\n\n{}", started.elapsed().as_secs_f64(), table(&tries));
        let all_twice = tries.last().map_or(&[][..], Vec::as_slice);
        let wrong: Vec<&Try> = all_twice.iter().filter(|each| each.is_wrong()).collect();
        let errors = all_twice.iter().filter(|each| each.end == End::Error);
        let told: Vec<&Try> = if count == 1 {
            tries.iter().flatten().collect()
        } else {
            wrong.iter().copied().chain(errors).collect()
        };
        told.iter().for_each(|each| println!("{:?}: {}", each.end, each.told));
        if wrong.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
    })
}
