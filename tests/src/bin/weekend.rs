//! A weekend in small: `cargo run --release -p tests --bin weekend -- [MINUTES [SEED]]`, 120 minutes unless said otherwise.
//!
//! A master, five workers, jobs of mixed sizes, and something that goes wrong every two seconds; see [`tests::weekend`]. Uses
//! `bolide-under-test` beside this program: build it first with `cargo build --release -p tests`. Prints what went wrong, what became of
//! the jobs, and the curves of memory, descriptors and spool; ends with failure if anything was not as it must be.

use std::{process::ExitCode, time::Duration};

use tests::weekend::Weekend;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, default: f64| arguments.get(at).map_or(Ok(default), |text| text.parse::<f64>());
    let (Ok(minutes), Ok(seed)) = (number(0, 120.0), number(1, 1.0)) else {
        eprintln!("weekend: expected MINUTES and SEED, two numbers");
        return ExitCode::from(2);
    };
    match play(minutes, seed as u64) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(why) => {
            eprintln!("weekend: {why}");
            ExitCode::FAILURE
        }
    }
}

fn play(minutes: f64, seed: u64) -> Result<bool, String> {
    let bolide = std::env::current_exe().map_err(|e| e.to_string())?.with_file_name("bolide-under-test");
    let mut weekend = Weekend::begin(&bolide, seed)?;
    let good = weekend.play(Duration::from_secs_f64(60.0 * minutes.clamp(0.0, 1e5)));
    let all: u64 = weekend.acts.values().sum();
    println!("{minutes} minutes, seed {seed}: {all} acts");
    for (act, times) in &weekend.acts {
        println!("  {times:5} {}", act.name());
    }
    let seen = &weekend.seen;
    println!(
        "{} jobs submitted; {} done with the digest of the undisturbed run, {} failed as their deck must, {} cancelled, {} times one was held \
         and resumed; {} requests without an answer",
        seen.submitted, seen.done, seen.failed, seen.cancelled, seen.held, seen.unanswered
    );
    seen.reasons.iter().for_each(|reason| println!("  held: {reason}"));
    println!("{} wrong", seen.wrong.len());
    seen.wrong.iter().for_each(|wrong| println!("  WRONG: {wrong}"));
    print!("{}", weekend.curves.table());
    Ok(good)
}
