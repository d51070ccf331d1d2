//! Particles of a batch in one cycle: from positions to forces, votes, energies and radii.

use super::{
    super::{
        Settings,
        batch::Batch,
        force,
        history::History,
        pair::{Books, Cycle, Pairs},
    },
    BatchParticle,
};

/// `omega dt` of a particle between all its springs at most. One spring is held to the 0.4 of contact, which decides how well a bounce keeps its
/// energy; in a crowd many act together, and the leapfrog holds them up to 2.
const CROWD_OMEGA_DT: f64 = 1.0;

/// Distance of centres over the sum of radii within which their line has no direction: the pair keeps its energy and has no force.
const COINCIDENT: f64 = 1e-9;

/// A particle with what its pairs need.
#[derive(Clone, Copy, Debug)]
struct Ball {
    node: u32,
    part: u32,
    /// Of the whole ball (length).
    radius: f64,
    inverse_mass: f64,
    stiffness: f64,
    /// Stiffness by its mass ([`force::least`]).
    least: f64,
    is_new: bool,
}

/// A particle in one cycle.
#[derive(Clone, Copy, Debug, Default)]
struct Now {
    x: [f64; 3],
    /// Of the whole ball (length).
    whole: f64,
    /// At the start of the cycle (length).
    radius: f64,
    /// Whether it has been one for less than a cycle.
    is_new: bool,
}

/// The particles of one batch.
#[derive(Clone, Debug, Default)]
pub(in super::super) struct Particles {
    balls: Vec<Ball>,
    /// Which of them are computed here, and where the pairs of each begin; behind the last where they end.
    own: Vec<u32>,
    starts: Vec<u32>,
    /// The other ball of each pair, and the stiffness of their spring.
    others: Vec<(u32, f64)>,
    /// The cycle in which the new ones become particles.
    new_at: u64,
    ahead: f64,
    /// Where what a ball lacks is among the numbers of its node.
    lacks_at: usize,
    now: Vec<Now>,
}

impl Particles {
    /// Those of a batch, which must be sound.
    pub(in super::super) fn new(batch: &Batch, settings: &Settings) -> Self {
        let ball = |particle: &BatchParticle| {
            let node = &batch.nodes[particle.node as usize];
            Ball {
                node: particle.node,
                part: node.part,
                radius: particle.radius,
                inverse_mass: 1.0 / node.mass,
                stiffness: particle.stiffness,
                least: settings.least(node.part, node.mass),
                is_new: particle.is_new,
            }
        };
        let listed = &batch.listed.particles;
        let mut particles = Self {
            balls: listed.particles.iter().map(ball).collect(),
            new_at: batch.listed.exposed.at,
            ahead: settings.ahead_of_particles(),
            lacks_at: settings.first_of_particle(),
            ..Self::default()
        };
        for of_one in listed.pairs.chunk_by(|a, b| a[0] == b[0]) {
            particles.own.push(of_one[0][0]);
            particles.starts.push(particles.others.len() as u32);
            for &[own, other] in of_one {
                let [a, b] = [own, other].map(|i| &particles.balls[i as usize]);
                let stiffness =
                    force::between(settings.stiffness, [a.stiffness, b.stiffness], [a.least, b.least]);
                particles.others.push((other, stiffness));
            }
        }
        particles.starts.push(particles.others.len() as u32);
        particles
    }

    /// Brings places and radii to those of now.
    fn look(&mut self, x: &[Vec<f64>; 3], history: &History) {
        let Self { balls, now, new_at, lacks_at, .. } = self;
        let begins = history.cycle == *new_at;
        now.clear();
        now.extend(balls.iter().map(|ball| {
            let node = ball.node as usize;
            let lacks = if history.is_empty() { 0.0 } else { history.before(node)[*lacks_at] };
            Now {
                x: [x[0][node], x[1][node], x[2][node]],
                whole: ball.radius,
                radius: ball.radius - lacks,
                is_new: ball.is_new && begins,
            }
        }));
    }
}

/// The greatest radius that a pair leaves to the first of its balls, whose centres are so far apart that whole balls overlap.
#[inline(always)]
fn room(own: &Now, other: &Now, distance: f64) -> f64 {
    match (own.is_new, other.is_new) {
        (true, true) => distance * (own.whole / (own.whole + other.whole)),
        (true, false) => distance - other.radius,
        (false, _) => {
            let next = if other.is_new { other.whole } else { other.radius };
            let free = distance - (own.radius + next);
            if free > 0.0 { 0.5_f64.mul_add(free, own.radius) } else { own.radius }
        }
    }
}

impl Pairs for Particles {
    fn n_listed(&self) -> usize {
        self.others.len()
    }

    fn n_looked_at(&self) -> usize {
        self.others.len()
    }

    fn reads_velocities(&self) -> bool {
        false
    }

    #[inline(always)]
    fn forces(&mut self, cycle: &mut Cycle<'_>, Books { vote, by_pair }: &mut Books<'_>) -> f64 {
        if self.own.is_empty() {
            return 0.0;
        }
        self.look(cycle.x, cycle.history);
        let mut frequency2 = 0.0_f64;
        let crowd = 2.0 * (force::OMEGA_DT / CROWD_OMEGA_DT).powi(2);
        for (&index, bounds) in self.own.iter().zip(self.starts.windows(2)) {
            let (ball, own) = (&self.balls[index as usize], self.now[index as usize]);
            // Row sums of the springs by axis: no frequency of particles is greater than twice the greatest over the mass.
            let mut rows = [0.0; 3];
            let mut radius = own.whole;
            for &(other_index, stiffness) in &self.others[bounds[0] as usize..bounds[1] as usize] {
                let other = self.now[other_index as usize];
                let apart = [0, 1, 2].map(|a| own.x[a] - other.x[a]);
                let square = apart[2].mul_add(apart[2], apart[1].mul_add(apart[1], apart[0] * apart[0]));
                let whole = own.whole + other.whole;
                let ahead = whole + self.ahead;
                if square >= ahead * ahead {
                    continue;
                }
                let other_ball = &self.balls[other_index as usize];
                let inverse_mass = ball.inverse_mass + other_ball.inverse_mass;
                let voted = force::frequency2(stiffness, 1.0, inverse_mass);
                frequency2 = if voted > frequency2 { voted } else { frequency2 };
                let distance = square.sqrt();
                let has_line = distance > COINCIDENT * whole;
                let n = if has_line { apart.map(|c| c / distance) } else { [0.0; 3] };
                let sum = n[0].abs() + n[1].abs() + n[2].abs();
                for (row, n) in rows.iter_mut().zip(n) {
                    *row = (stiffness * sum).mul_add(n.abs(), *row);
                }
                if distance >= whole {
                    continue;
                }
                let room = room(&own, &other, distance);
                radius = if room < radius { room } else { radius };
                let depth = (own.radius + other.radius) - distance;
                if depth <= 0.0 || own.is_new || other.is_new {
                    continue;
                }
                let push = stiffness * depth;
                let mut force = [0.0; 3];
                for a in 0..3 {
                    force[a] = cycle.force_quantum.round(push * n[a]);
                    cycle.f[a][ball.node as usize] += force[a];
                    let magnitude = force[a].abs();
                    vote.force_bound =
                        if magnitude > vote.force_bound { magnitude } else { vote.force_bound };
                }
                if index < other_index {
                    vote.hits += 1;
                    let energy = cycle.energy_quantum.round(0.5 * push * depth);
                    vote.energy += energy;
                    by_pair.energies.add(ball.part, other_ball.part, energy, 0.0);
                    if let Some(tally) = &mut by_pair.forces {
                        tally.add((ball.part, other_ball.part), force);
                    }
                }
            }
            let row =
                rows.into_iter().fold(0.0_f64, |greatest, row| if row > greatest { row } else { greatest });
            let voted = crowd * (row * ball.inverse_mass);
            frequency2 = if voted > frequency2 { voted } else { frequency2 };
            if !cycle.history.is_empty() {
                cycle.history.after_mut(ball.node as usize)[self.lacks_at] = own.whole - radius;
            }
        }
        frequency2
    }
}
