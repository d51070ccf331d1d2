//! Damaged inputs into everything that reads from outside: `cargo run --release -p tests --bin fuzz -- [SECONDS [TARGET [FIRST]]]`.
//!
//! So many seconds for each target (60), or for those with TARGET in their name, from input FIRST on (0). Prints inputs,
//! those taken for good, and findings; a finding is seen again by `fuzz -- 1 TARGET NUMBER`.

use std::{process::ExitCode, time::Duration};

use tests::fuzz;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, default: u64| arguments.get(at).map_or(Ok(default), |text| text.parse::<u64>());
    let (Ok(seconds), Ok(first)) = (number(0, 60), number(2, 0)) else {
        eprintln!("fuzz: expected SECONDS, TARGET and FIRST");
        return ExitCode::from(2);
    };
    let name = arguments.get(1).map_or("", String::as_str);
    let mut findings = 0;
    println!("{:<18} {:>12} {:>12} {:>9}", "target", "inputs", "taken", "findings");
    for mut target in fuzz::all() {
        if !target.name().contains(name) {
            continue;
        }
        let count = fuzz::attack(&mut *target, first, u64::MAX, Duration::from_secs(seconds));
        println!(
            "{:<18} {:>12} {:>12} {:>9}",
            target.name(),
            count.inputs,
            count.taken,
            count.findings.len()
        );
        for (number, words) in &count.findings {
            println!("    input {number}: {words}");
        }
        findings += count.findings.len();
    }
    if findings == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
