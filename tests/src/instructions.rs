//! Instructions of an element-cycle: a guard against slower code that needs no quiet machine.
//!
//! valgrind counts the instructions of a short and of a longer run of an example in this process, on one worker of one thread. Their difference,
//! over the element-cycles between them, is what a cycle takes, without the start. From run to run counts are the same to less than
//! one per cent; another compiler changes them, so the table names the one that it was written with.

use std::{
    collections::BTreeMap,
    path::PathBuf,
    process::{Command, Stdio},
};

use protocol::options::JobOptions;
use serde::{Deserialize, Serialize};

use crate::solve::{Workers, example, keyword, solve, without_states};

/// Examples, one for each kind of element and of contact; how many elements it has decides how many cycles are enough.
pub const CASES: [Case; 11] = [
    Case { example: "plates-joined", lanes: "avx2", cycles: [2, 12] },
    Case { example: "plates-joined", lanes: "scalar", cycles: [2, 7] },
    Case { example: "plates-free-slip", lanes: "avx2", cycles: [2, 12] },
    Case { example: "taylor-copper", lanes: "avx2", cycles: [100, 200] },
    Case { example: "sphere-6-km-s", lanes: "avx2", cycles: [2, 17] },
    Case { example: "explosive-on-plate", lanes: "avx2", cycles: [10, 60] },
    Case { example: "fragment-on-water-box", lanes: "avx2", cycles: [2, 12] },
    Case { example: "tube-crush", lanes: "avx2", cycles: [100, 200] },
    Case { example: "composite-panel", lanes: "avx2", cycles: [10, 30] },
    Case { example: "table-on-tubes", lanes: "avx2", cycles: [100, 350] },
    Case { example: "ball-on-shell.k", lanes: "avx2", cycles: [20, 70] },
];

/// What is counted.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Name of a deck in deck/examples, a keyword deck's with its ending.
    pub example: &'static str,
    /// Lane width.
    pub lanes: &'static str,
    /// Cycles of the short run and of the longer one.
    pub cycles: [u64; 2],
}

/// Instructions of an element-cycle by the name of a case, and the compiler of which they are.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Table {
    pub compiler: String,
    pub counts: BTreeMap<String, f64>,
}

impl Case {
    /// Its row of the table.
    pub fn name(&self) -> String {
        format!("{}, {}", self.example, self.lanes)
    }

    /// Runs so many cycles in this process and gives its element-cycles: what is counted.
    ///
    /// # Errors
    /// A run that fails.
    pub fn run(&self, cycles: u64) -> Result<f64, String> {
        let mut model = self.example.strip_suffix(".k").map_or_else(|| example(self.example), keyword);
        model.setup.control.end_cycle = cycles;
        let n_elements = model.mesh.n_elements() as f64;
        // A checkpoint in memory by the clock would be counted in a slow run only.
        let asked =
            JobOptions { lanes: Some(self.lanes.to_owned()), keep_every: Some(0.0), ..JobOptions::default() };
        let solved = solve(model, Workers { options: without_states(asked), ..Workers::default() })?;
        if solved.outcome.cycles_run != cycles {
            return Err(format!("{}: {} cycles, expected {cycles}", self.name(), solved.outcome.cycles_run));
        }
        Ok(n_elements * cycles as f64)
    }

    /// Counts the instructions of an element-cycle: this program runs under valgrind, twice, with the arguments `run NAME CYCLES`.
    ///
    /// # Errors
    /// No valgrind, or a run that fails.
    pub fn count(&self) -> Result<f64, String> {
        let [short, long] = self.cycles.map(|cycles| self.counted(cycles));
        let (short, long) = (short?, long?);
        Ok((long.0 - short.0) / (long.1 - short.1))
    }

    /// Instructions and element-cycles of a run.
    fn counted(&self, cycles: u64) -> Result<(f64, f64), String> {
        let program = std::env::current_exe().map_err(|e| format!("the path of this program: {e}"))?;
        let output = Command::new("valgrind")
            .args(["--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null"])
            .arg(program)
            .args(["run", &self.name(), &cycles.to_string()])
            .stdin(Stdio::null())
            .output()
            .map_err(|e| format!("valgrind: {e}"))?;
        let told = String::from_utf8_lossy(&output.stderr);
        let printed = String::from_utf8_lossy(&output.stdout);
        let counted = instructions_of(&told).zip(printed.trim().parse().ok());
        counted.filter(|_| output.status.success()).ok_or_else(|| {
            format!("{} under valgrind, {cycles} cycles: {}\n{told}", self.name(), output.status)
        })
    }
}

/// The number behind `I refs:`.
fn instructions_of(told: &str) -> Option<f64> {
    let (_, behind) = told.split_once("I   refs:").or_else(|| told.split_once("I refs:"))?;
    behind.lines().next()?.trim().replace(',', "").parse().ok()
}

/// Where the table is.
pub fn path() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("instructions.toml")
}

impl Table {
    /// The table of the repository.
    ///
    /// # Errors
    /// A file that cannot be read or is none.
    pub fn read() -> Result<Self, String> {
        let path = path();
        let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        toml::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))
    }

    /// What a count is beside the table's, in words, and whether that is too much: [`ALLOWED`] of the same compiler.
    pub fn judge(&self, name: &str, count: f64, compiler: &str) -> (String, bool) {
        let Some(before) = self.counts.get(name) else {
            return ("is not in the table".to_owned(), true);
        };
        let ratio = count / before;
        let same_compiler = self.compiler == compiler;
        let words = format!("{ratio:.3} of {before:.1}");
        if ratio > 1.0 + ALLOWED && same_compiler {
            (format!("{words}: more than {} allowed", 1.0 + ALLOWED), true)
        } else if ratio < 1.0 - ALLOWED && same_compiler {
            (format!("{words}: less; write the table again"), false)
        } else {
            (words, false)
        }
    }
}

/// By what share more instructions than the table's are allowed.
pub const ALLOWED: f64 = 0.02;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_count_is_read_and_judged_by_the_table() {
        assert_eq!(instructions_of("==7== \n==7== I refs:        12,345,678\n"), Some(12_345_678.0));
        assert_eq!(instructions_of("==7== I   refs:      99\n"), Some(99.0));
        assert_eq!(instructions_of("valgrind: no such file"), None);
        let table = Table {
            compiler: "rustc 1".to_owned(),
            counts: BTreeMap::from([("plates, avx2".to_owned(), 100.0)]),
        };
        for (count, compiler, fails) in [
            (101.9, "rustc 1", false),
            (102.1, "rustc 1", true),
            (90.0, "rustc 1", false),
            (130.0, "rustc 2", false),
        ] {
            assert_eq!(table.judge("plates, avx2", count, compiler).1, fails, "{count} {compiler}");
        }
        assert!(table.judge("others, avx2", 1.0, "rustc 1").1);
    }

    #[test]
    fn every_case_is_in_the_table_and_runs() {
        let table = Table::read().expect("the table");
        let names: Vec<String> = CASES.iter().map(Case::name).collect();
        assert!(names.iter().all(|name| table.counts.contains_key(name)), "{names:?} {table:?}");
        assert_eq!(table.counts.len(), CASES.len());
        let beams = CASES.iter().find(|case| case.example == "table-on-tubes").expect("it is there");
        let scalar = Case { lanes: "scalar", ..*beams };
        assert_eq!(scalar.run(3), Ok(3.0 * 364.0));
    }
}
