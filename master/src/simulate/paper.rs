//! The paper's tables 1 and 2: what stands beside the modelled figures.

pub struct PaperTable {
    /// Numbers of machines.
    pub hosts: &'static [usize],
    /// Seconds, and efficiency in whole percent, of benchmark 1 (joined) and 2 (free slip).
    pub cells: [&'static [(f64, f64)]; 2],
}

/// Table 1: 27,000 elements, DEC Alpha machines on 10 Mb/s Ethernet.
const TABLE_1: PaperTable = PaperTable {
    hosts: &[1, 2, 3, 4],
    cells: [
        &[(57.0, 100.0), (29.5, 97.0), (20.1, 95.0), (16.0, 89.0)],
        &[(59.5, 100.0), (31.2, 97.0), (21.4, 93.0), (17.4, 86.0)],
    ],
};

/// Table 2: 64,000 elements, Pentium II PCs on 100 Mb/s Ethernet.
const TABLE_2: PaperTable = PaperTable {
    hosts: &[1, 2, 4, 8, 16],
    cells: [
        &[(90.9, 100.0), (45.0, 100.0), (22.5, 100.0), (11.4, 99.0), (5.9, 96.0)],
        &[(94.0, 100.0), (47.8, 98.0), (24.4, 96.0), (12.3, 96.0), (6.4, 92.0)],
    ],
};

pub fn table(number: u64) -> Option<&'static PaperTable> {
    match number {
        1 => Some(&TABLE_1),
        2 => Some(&TABLE_2),
        _ => None,
    }
}

impl PaperTable {
    /// Seconds and efficiency (percent) of a benchmark (0 or 1) on so many hosts, if the table has it.
    pub fn cell(&self, benchmark: usize, hosts: usize) -> Option<(f64, f64)> {
        let at = self.hosts.iter().position(|&n| n == hosts)?;
        self.cells.get(benchmark)?.get(at).copied()
    }
}

/// How a modelled efficiency stands to a printed one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Above what would round to it.
    Ahead,
    /// Rounds to it.
    Within,
    /// Below.
    Behind,
}

impl Verdict {
    /// Of an efficiency (1 is perfect) against whole percents.
    pub fn of(efficiency: f64, paper_percent: f64) -> Self {
        let percent = 100.0 * efficiency;
        if percent >= paper_percent + 0.5 {
            Self::Ahead
        } else if percent >= paper_percent - 0.5 {
            Self::Within
        } else {
            Self::Behind
        }
    }

    /// The word in tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Ahead => "ahead",
            Self::Within => "within",
            Self::Behind => "behind",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_printed_speed_up_follows_from_the_printed_seconds() {
        for table in [TABLE_1, TABLE_2] {
            for cells in table.cells {
                for (&n, &(seconds, percent)) in table.hosts.iter().zip(cells) {
                    let efficiency = 100.0 * cells[0].0 / seconds / n as f64;
                    // The paper cuts 101 % to 100 and rounds 95.5 % either way.
                    assert!(
                        (efficiency.min(100.0) - percent).abs() < 2.0,
                        "{n}: {efficiency} against {percent}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_cell_is_ahead_only_past_its_rounding() {
        assert_eq!(Verdict::of(0.924, 92.0), Verdict::Within);
        assert_eq!(Verdict::of(0.925, 92.0), Verdict::Ahead);
        assert_eq!(Verdict::of(0.914, 92.0), Verdict::Behind);
    }
}
