//! The workers that elements are cut for, and where an order of them is divided, again and again.

/// Workers to deal elements out to.
#[derive(Clone, Copy, Debug)]
pub struct Fleet<'a> {
    /// Relative speed of each.
    pub speeds: &'a [f64],
    /// Region of each, by number: links inside one are faster than those between two. Empty where all are near each other.
    pub regions: &'a [u32],
}

impl<'a> Fleet<'a> {
    /// Workers of these speeds that are all near each other.
    pub fn near(speeds: &'a [f64]) -> Self {
        Self { speeds, regions: &[] }
    }

    /// The same workers with other speeds.
    pub fn with<'b>(&self, speeds: &'b [f64]) -> Fleet<'b>
    where
        'a: 'b,
    {
        Fleet { speeds, regions: self.regions }
    }

    /// An order of the workers to try: 0 as given, 1 the fastest first, others shuffled by a small generator. Those of one region
    /// stay together.
    pub fn order(&self, seed: u64) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.speeds.len()).collect();
        match seed {
            0 => {}
            1 => order.sort_by(|&a, &b| self.speeds[b].total_cmp(&self.speeds[a])),
            _ => {
                let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
                for i in (1..order.len()).rev() {
                    state ^= state << 13;
                    state ^= state >> 7;
                    state ^= state << 17;
                    order.swap(i, (state % (i as u64 + 1)) as usize);
                }
            }
        }
        order.sort_by_key(|&worker| self.region(worker));
        order
    }

    /// Whether two workers are in one region.
    pub fn are_near(&self, one: usize, other: usize) -> bool {
        self.region(one) == self.region(other)
    }

    pub fn region(&self, worker: usize) -> u32 {
        self.regions.get(worker).copied().unwrap_or(0)
    }
}

/// Numbers of regions by their names, in the order in which they come.
pub fn regions<'a>(names: impl Iterator<Item = &'a str>) -> Vec<u32> {
    let mut known: Vec<&str> = Vec::new();
    names
        .map(|name| {
            let number = known.iter().position(|known| *known == name).unwrap_or(known.len());
            if number == known.len() {
                known.push(name);
            }
            number as u32
        })
        .collect()
}

/// Where the workers of an order are divided, again and again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Halves {
    /// In the middle.
    Count,
    /// Where both sides are as fast.
    Speed,
}

/// Some workers of a fleet, in an order.
#[derive(Clone, Copy, Debug)]
pub struct Crew<'a> {
    pub fleet: Fleet<'a>,
    pub workers: &'a [usize],
    pub halves: Halves,
}

impl<'a> Crew<'a> {
    /// Speed of all.
    pub fn speed(&self) -> f64 {
        self.workers.iter().map(|&worker| self.fleet.speeds[worker]).sum()
    }

    pub fn fastest(&self) -> usize {
        let speeds = self.fleet.speeds;
        let faster = |best, worker: usize| if speeds[worker] > speeds[best] { worker } else { best };
        self.workers.iter().copied().fold(self.workers[0], faster)
    }

    /// Whether all are in one region.
    pub fn is_near(&self) -> bool {
        self.workers.windows(2).all(|two| self.fleet.are_near(two[0], two[1]))
    }

    /// How much of the speed of all the first so many have.
    pub fn share(&self, first: usize) -> f64 {
        self.divided(first)[0].speed() / self.speed()
    }

    /// How many workers are on the first side: two choices, which may be one. Regions are divided from each other before their workers are.
    pub fn splits(&self) -> [usize; 2] {
        let n = self.workers.len();
        let is_border = |at: &usize| !self.fleet.are_near(self.workers[at - 1], self.workers[*at]);
        let mut borders = (1..n).filter(is_border).peekable();
        let all = self.speed();
        let side = |at: usize| self.divided(at)[0].speed();
        let by_speed = |at: usize| (2.0 * side(at) - all).abs();
        let nearest = |a: usize, b: usize| if by_speed(b) < by_speed(a) { b } else { a };
        match self.halves {
            _ if borders.peek().is_some() => [borders.reduce(nearest).unwrap_or(1); 2],
            Halves::Count => [n / 2, n - n / 2],
            Halves::Speed => [(1..n).reduce(nearest).unwrap_or(1); 2],
        }
    }

    /// The first so many and the others.
    pub fn divided(&self, at: usize) -> [Self; 2] {
        let (first, others) = self.workers.split_at(at);
        [Self { workers: first, ..*self }, Self { workers: others, ..*self }]
    }
}
