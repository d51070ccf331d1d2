//! Nodes without elements that press on each other: elastic balls, crowds that are born overlapping, the time step, and lists of any age.

use mechanics::{
    contact::{Batch, Contact, Exclusions, Kind, Settings, Surface, WorkUnit, sort},
    exact::Quantum,
    lanes::Width,
    mesh::Mesh,
};

use crate::world::{BULK, Random, add_block, block, materials, settings};

/// Nodes of a mesh of which no element is left, in free flight but for contact.
struct Cloud {
    surface: Surface,
    settings: Settings,
    /// By surface node.
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    mass: Vec<f64>,
    /// What contact keeps, by surface node.
    kept: Vec<Vec<f64>>,
    /// Batches that share the units, from the last sort.
    contacts: Vec<(Batch, Contact)>,
    sorted: Vec<[f64; 3]>,
    cycle: u64,
    energy: f64,
    step: f64,
    hits: u64,
    /// Kinetic and contact energy at the positions of the last forces, both exact for the leapfrog.
    total: f64,
}

impl Cloud {
    fn new(mesh: &Mesh, settings: Settings) -> Self {
        let n_parts = mesh.parts.len();
        let settings = Settings { erodes: true, particles: vec![true; n_parts], ..settings };
        let of = |alive: bool| {
            let erodes = vec![true; n_parts];
            let mut surface = Surface::eroded(mesh, &materials(), &|_| alive, &erodes, true);
            surface.find_particles(mesh, &materials(), &settings, &vec![0.0; n_parts]);
            surface
        };
        let (before, mut surface) = (of(true), of(false));
        assert!(before.particles.is_empty());
        assert_eq!(surface.particles.len(), mesh.n_nodes());
        surface.note_exposed(&before, 0);
        let x: Vec<[f64; 3]> = surface.nodes.iter().map(|&n| mesh.positions[n as usize]).collect();
        let mass: Vec<f64> = surface.particles.iter().map(|p| (2.0 * p.radius).powi(3)).collect();
        let n = x.len();
        Self {
            kept: vec![vec![0.0; settings.n_history()]; n],
            surface,
            settings,
            v: vec![[0.0; 3]; n],
            x,
            mass,
            contacts: Vec::new(),
            sorted: Vec::new(),
            cycle: 0,
            energy: 0.0,
            step: f64::INFINITY,
            hits: 0,
            total: 0.0,
        }
    }

    fn sort(&mut self, n_batches: usize) {
        let units = sort(&self.surface, &self.x, &self.settings, &Exclusions::default());
        let mut ours: Vec<Vec<&WorkUnit>> = vec![Vec::new(); n_batches];
        for (i, unit) in units.iter().enumerate() {
            assert_eq!(unit.kind, Kind::Particles, "there are no faces");
            ours[7 * i % n_batches].push(unit);
        }
        let (surface, mass) = (&self.surface, &self.mass);
        let gather = |units: Vec<&WorkUnit>| {
            let mass = |node: u32| mass[surface.node_index(node).expect("on the surface") as usize];
            let batch = Batch::gather(surface, &units, &mass, &Exclusions::default());
            assert!(batch.is_sound(self.settings.n_parts()));
            let x = [0, 1, 2].map(|a| batch.nodes.iter().map(|n| self.x[self.index(n.global)][a]).collect());
            let contact = Contact::new(&batch, &self.settings, &x, Width::best());
            (batch, contact)
        };
        let contacts = ours.into_iter().map(gather).collect();
        self.contacts = contacts;
        self.sorted = self.x.clone();
    }

    fn index(&self, global: u32) -> usize {
        self.surface.node_index(global).expect("on the surface") as usize
    }

    /// Total forces at the positions of now.
    fn forces(&mut self) -> Vec<[f64; 3]> {
        let mut total = vec![[0.0; 3]; self.x.len()];
        let mut kept = vec![vec![0.0; self.settings.n_history()]; self.x.len()];
        (self.energy, self.step, self.hits) = (0.0, f64::INFINITY, 0);
        let quantum = Quantum::for_reference(BULK, 46);
        let mut contacts = std::mem::take(&mut self.contacts);
        for (batch, contact) in &mut contacts {
            let of = |v: &Vec<[f64; 3]>| -> [Vec<f64>; 3] {
                [0, 1, 2].map(|a| batch.nodes.iter().map(|n| v[self.index(n.global)][a]).collect())
            };
            let (x, v) = (of(&self.x), of(&self.v));
            let mut f = [0; 3].map(|_| vec![0.0; batch.nodes.len()]);
            for (i, node) in batch.nodes.iter().enumerate() {
                contact.history.before_mut(i).copy_from_slice(&self.kept[self.index(node.global)]);
            }
            contact.history.cycle = self.cycle;
            let vote = contact.forces(&x, &v, 0.0, quantum, quantum, &mut f);
            self.energy += vote.energy;
            self.step = self.step.min(vote.dt);
            self.hits += vote.hits;
            for (i, node) in batch.nodes.iter().enumerate() {
                let n = self.index(node.global);
                (0..3).for_each(|a| total[n][a] += f[a][i]);
                kept[n].iter_mut().zip(contact.history.after(i)).for_each(|(sum, after)| *sum += after);
            }
        }
        self.contacts = contacts;
        self.kept = kept;
        total
    }

    fn advance(&mut self, dt: f64) {
        let forces = self.forces();
        self.total = self.energy;
        for (n, force) in forces.iter().enumerate() {
            for a in 0..3 {
                let before = self.v[n][a];
                self.v[n][a] += force[a] / self.mass[n] * dt;
                self.total += 0.5 * self.mass[n] * before * self.v[n][a];
                self.x[n][a] += self.v[n][a] * dt;
            }
        }
        self.cycle += 1;
    }

    /// Sorts when nodes have moved so far against each other that lists may be stale.
    fn sort_if_due(&mut self, n_batches: usize) {
        let mut extents = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for (x, sorted) in self.x.iter().zip(&self.sorted) {
            for a in 0..3 {
                extents[0][a] = extents[0][a].min(x[a] - sorted[a]);
                extents[1][a] = extents[1][a].max(x[a] - sorted[a]);
            }
        }
        if (0..3).any(|a| extents[1][a] - extents[0][a] > 0.7 * self.settings.slack) {
            self.sort(n_batches);
        }
    }

    fn kinetic(&self) -> f64 {
        let square = |v: &[f64; 3]| v.iter().map(|v| v * v).sum::<f64>();
        self.v.iter().zip(&self.mass).map(|(v, m)| 0.5 * m * square(v)).sum()
    }

    fn momentum(&self) -> [f64; 3] {
        [0, 1, 2].map(|a| self.v.iter().zip(&self.mass).map(|(v, m)| m * v[a]).sum())
    }

    /// What the ball of a node lacks of its radius.
    fn lacks(&self, n: usize) -> f64 {
        *self.kept[n].last().expect("it has a history")
    }
}

/// Two balls of a block of 2 x 2 x 2 cells of size 1, nodes `a` and `b`, which are whole; the others are far away.
fn two([a, b]: [usize; 2]) -> Cloud {
    let mut cloud = Cloud::new(&block([2, 2, 2], 1.0), settings(1, 0.1, 0.4));
    for (i, x) in cloud.x.iter_mut().enumerate() {
        *x = [0.0, 0.0, 50.0 * (1.0 + i as f64)];
    }
    cloud.x[a] = [-1.0, 0.0, 0.0];
    cloud.x[b] = [1.0, 0.0, 0.0];
    // Their first cycle, in which nobody is near.
    cloud.sort(1);
    cloud.forces();
    cloud.cycle = 1;
    cloud
}

fn fly(cloud: &mut Cloud, dt: f64, n: usize) -> u64 {
    let mut hits = 0;
    for _ in 0..n {
        cloud.sort_if_due(1);
        cloud.advance(dt);
        hits += cloud.hits;
    }
    hits
}

/// The middle node and a corner: a ball as large as a cell, and one of an eighth of its volume.
const MIDDLE: usize = 13;
const CORNER: usize = 0;

#[test]
fn a_ball_is_as_large_as_the_volume_of_its_node() {
    let cloud = two([MIDDLE, CORNER]);
    let radii = [CORNER, 1, 4, MIDDLE].map(|n| cloud.surface.particles[n].radius);
    let expected = [0.125_f64, 0.25, 0.5, 1.0].map(|volume| 0.5 * volume.cbrt());
    for (radius, expected) in radii.into_iter().zip(expected) {
        assert!((radius - expected).abs() < 1e-15, "{radius} for {expected}");
    }
    let volume: f64 = cloud.mass.iter().sum();
    assert!((volume - 8.0).abs() < 1e-12, "the cubes have {volume} of 8");
}

#[test]
fn balls_that_meet_head_on_part_as_elastic_spheres() {
    for second in [4, CORNER] {
        let mut cloud = two([MIDDLE, second]);
        (cloud.v[MIDDLE], cloud.v[second]) = ([0.02, 0.0, 0.0], [-0.01, 0.0, 0.0]);
        let [m, n] = [MIDDLE, second].map(|node| cloud.mass[node]);
        let (before, kinetic) = (cloud.momentum(), cloud.kinetic());
        // As close to its limit as a run goes, and finer.
        for (part, tolerance) in [(1.0, 0.03), (0.1, 3e-4)] {
            let mut cloud = Cloud { cycle: 1, ..two([MIDDLE, second]) };
            (cloud.v[MIDDLE], cloud.v[second]) = ([0.02, 0.0, 0.0], [-0.01, 0.0, 0.0]);
            // The step that a pair allows.
            cloud.x[MIDDLE][0] = cloud.x[second][0] - 0.8;
            cloud.sort(1);
            cloud.forces();
            let dt = part * cloud.step;
            cloud.x[MIDDLE] = [-1.0, 0.0, 0.0];
            let hits = fly(&mut cloud, dt, (200.0 / dt) as usize);
            assert!(hits > 3, "{hits} hits");
            assert_eq!(cloud.hits, 0, "they have parted");
            let exchanged =
                [(m * 0.02 - n * 0.01 - n * 0.03) / (m + n), (m * 0.02 - n * 0.01 + m * 0.03) / (m + n)];
            for (node, expected) in [MIDDLE, second].into_iter().zip(exchanged) {
                let v = cloud.v[node][0];
                assert!((v - expected).abs() < tolerance * 0.03, "{node}: {v} for {expected}");
            }
            let after = cloud.momentum();
            assert!((after[0] - before[0]).abs() < 1e-15 && after[1] == 0.0, "{before:?}, {after:?}");
            let error = cloud.kinetic() / kinetic - 1.0;
            assert!(error.abs() < tolerance, "energy error {error} with {part} of the step");
        }
    }
}

#[test]
fn balls_that_meet_aside_keep_what_is_across_their_line() {
    let mut cloud = two([MIDDLE, 4]);
    let sum = cloud.surface.particles[MIDDLE].radius + cloud.surface.particles[4].radius;
    // The line of centres at the touch makes 30 degrees with the flight; slow, so that it turns by little in the hit.
    cloud.x[4][1] = 0.5 * sum;
    let speed = 1e-3;
    cloud.v[MIDDLE] = [speed, 0.0, 0.0];
    let moment = |cloud: &Cloud| -> f64 {
        [MIDDLE, 4]
            .iter()
            .map(|&n| cloud.mass[n] * (cloud.x[n][0] * cloud.v[n][1] - cloud.x[n][1] * cloud.v[n][0]))
            .sum()
    };
    let (kinetic, momentum, spin) = (cloud.kinetic(), cloud.momentum(), moment(&cloud));
    assert!(fly(&mut cloud, 0.05, 50_000) > 3);
    let n = [0.75_f64.sqrt(), 0.5];
    let [m, other] = [cloud.mass[MIDDLE], cloud.mass[4]];
    let taken = 2.0 * other / (m + other) * speed * n[0];
    let expected = [speed - taken * n[0], -taken * n[1]];
    for a in 0..2 {
        assert!(
            (cloud.v[MIDDLE][a] - expected[a]).abs() < 0.01 * speed,
            "{:?}, {expected:?}",
            cloud.v[MIDDLE]
        );
    }
    let after = cloud.momentum();
    assert!((0..3).all(|a| (after[a] - momentum[a]).abs() < 1e-15), "{momentum:?}, {after:?}");
    assert!((moment(&cloud) - spin).abs() < 1e-10 * speed, "{spin}, {}", moment(&cloud));
    assert!((cloud.kinetic() / kinetic - 1.0).abs() < 1e-3);
}

#[test]
fn a_grid_that_is_pressed_together_is_half_as_stiff_as_the_solid() {
    let mut cloud = Cloud::new(&block([4, 4, 4], 1.0), settings(1, 0.1, 0.4));
    cloud.sort(1);
    cloud.forces();
    cloud.cycle = 1;
    let strain = 0.01;
    cloud.x.iter_mut().for_each(|x| x[2] *= 1.0 - strain);
    let forces = cloud.forces();
    // What the nodes inside above the middle plane are pushed up by: a cell of it carries the force of one column.
    let above = |n: usize| cloud.x[n][2] > 2.0 && cloud.mass[n] == 1.0;
    let columns = 9.0;
    let up: f64 = (0..cloud.x.len()).filter(|&n| above(n)).map(|n| forces[n][2]).sum();
    let stress = up / columns;
    assert!((stress - 0.5 * BULK * strain).abs() < 1e-9 * BULK, "{stress}");
}

/// A block of 4 x 4 x 4 cells that is crushed at random to a third of its height and less before it fails, with random velocities.
fn crushed(speed: f64, seed: u64) -> Cloud {
    let mut cloud = Cloud::new(&block([4, 4, 4], 1.0), settings(1, 0.1, 0.4));
    let mut random = Random(seed);
    for (x, v) in cloud.x.iter_mut().zip(&mut cloud.v) {
        x[2] *= 0.3;
        (0..3).for_each(|a| x[a] += random.within(-0.1, 0.1));
        *v = random.point(-speed, speed);
    }
    cloud
}

#[test]
fn a_crowd_that_is_born_overlapping_does_not_burst() {
    let mut cloud = crushed(0.0, 3);
    cloud.sort(1);
    for _ in 0..20 {
        cloud.advance(0.1);
        assert_eq!((cloud.energy, cloud.kinetic()), (0.0, 0.0), "cycle {}", cloud.cycle);
    }
    let lacking = (0..cloud.x.len()).filter(|&n| cloud.lacks(n) > 0.0).count();
    assert!(lacking > 100, "{lacking} of {} lack", cloud.x.len());
    // The same with whole balls would hold this.
    cloud.kept.iter_mut().for_each(|kept| kept.fill(0.0));
    cloud.forces();
    assert!(cloud.energy > 1.0, "{}", cloud.energy);
}

#[test]
fn a_crowd_keeps_its_energy_and_momentum_and_its_balls_become_whole() {
    let mut cloud = crushed(0.05, 5);
    cloud.sort(1);
    let (kinetic, momentum) = (cloud.kinetic(), cloud.momentum());
    let (mut hits, mut worst, mut pressed) = (0, 0.0_f64, 0.0_f64);
    for _ in 0..3000 {
        cloud.sort_if_due(1);
        cloud.advance(0.1);
        hits += cloud.hits;
        worst = worst.max((cloud.total / kinetic - 1.0).abs());
        pressed = pressed.max(cloud.energy / kinetic);
    }
    assert!(hits > 1000 && pressed > 0.02, "{hits} hits, at most {pressed} of the energy in springs");
    assert!(worst < 0.005, "energy error {worst}");
    let after = cloud.momentum();
    assert!((0..3).all(|a| (after[a] - momentum[a]).abs() < 1e-12), "{momentum:?}, {after:?}");
    let lacking = (0..cloud.x.len()).filter(|&n| cloud.lacks(n) != 0.0).count();
    assert_eq!(lacking, 0, "they have flown apart");
}

/// Of a ball that is born inside others that are whole and press on each other.
#[test]
fn a_ball_that_is_born_among_old_ones_pushes_none_of_them() {
    let mut cloud = two([MIDDLE, 4]);
    let newborn = 10;
    cloud.x[4] = [-0.2, 0.0, 0.0];
    cloud.x[newborn] = [-0.7, 0.1, 0.0];
    cloud.surface.exposed.particles = vec![newborn as u32];
    cloud.surface.exposed.at = 7;
    cloud.cycle = 7;
    cloud.sort(1);
    let forces = cloud.forces();
    assert_eq!(cloud.hits, 1, "the two old ones");
    assert!(forces[MIDDLE][0] < 0.0 && forces[newborn] == [0.0; 3]);
    let energy = cloud.energy;
    cloud.cycle = 8;
    cloud.forces();
    assert!((cloud.energy - energy).abs() < 1e-12, "{energy}, {}", cloud.energy);
    // From then on it resists being pushed.
    cloud.x[newborn][0] -= 0.05;
    assert!(cloud.forces()[newborn][0].abs() > 1e-3);
}

#[test]
fn the_voted_step_holds_the_fastest_motion_of_a_crowd() {
    let mut cloud = crushed(0.05, 11);
    cloud.sort(1);
    for _ in 0..100 {
        cloud.sort_if_due(1);
        cloud.advance(0.1);
    }
    let base = cloud.forces();
    let step = cloud.step;
    assert!(cloud.hits > 10);
    // Power iteration on the matrix of M^-1 K by differences, of balls that keep their radii.
    let (x, kept) = (cloud.x.clone(), cloud.kept.clone());
    let mut random = Random(2);
    let mut mode: Vec<[f64; 3]> = x.iter().map(|_| random.point(-1.0, 1.0)).collect();
    let mut square = 0.0;
    for _ in 0..200 {
        let size = mode.iter().flatten().map(|c| c * c).sum::<f64>().sqrt();
        mode.iter_mut().flatten().for_each(|c| *c /= size);
        let by = 1e-6;
        cloud
            .x
            .iter_mut()
            .zip(&x)
            .zip(&mode)
            .for_each(|((to, x), m)| *to = [0, 1, 2].map(|a| x[a] + by * m[a]));
        cloud.kept.clone_from(&kept);
        let forces = cloud.forces();
        for (n, m) in mode.iter_mut().enumerate() {
            *m = [0, 1, 2].map(|a| -(forces[n][a] - base[n][a]) / by / cloud.mass[n]);
        }
        square = mode.iter().flatten().map(|c| c * c).sum::<f64>().sqrt();
    }
    let omega_dt = square.sqrt() * step;
    assert!((0.05..1.0).contains(&omega_dt), "omega dt {omega_dt}");
}

#[test]
fn lists_of_any_age_and_any_cut_give_the_same_bits() {
    let run = |every: u64, n_batches: usize| {
        let mut cloud = crushed(0.05, 17);
        cloud.sort(n_batches);
        let mut steps = Vec::new();
        for _ in 0..400 {
            if every > 0 && cloud.cycle.is_multiple_of(every) {
                cloud.sort(n_batches);
            }
            cloud.sort_if_due(n_batches);
            cloud.advance(0.1);
            steps.push((cloud.step, cloud.energy, cloud.hits));
        }
        (cloud.x, cloud.v, cloud.kept, steps)
    };
    let one = run(0, 1);
    assert!(one.3.iter().any(|step| step.2 > 10));
    for (every, n_batches) in [(1, 1), (7, 1), (0, 2), (3, 5)] {
        assert!(one == run(every, n_batches), "sorted every {every}, {n_batches} batches");
    }
}

#[test]
fn balls_at_one_place_have_no_force_and_fly_on() {
    let mut cloud = two([MIDDLE, 4]);
    cloud.x[4] = cloud.x[MIDDLE];
    cloud.sort(1);
    let forces = cloud.forces();
    assert_eq!(forces[4], [0.0; 3]);
    assert!(cloud.energy > 0.0 && cloud.step.is_finite());
    cloud.v[4] = [1e3, 0.0, 0.0];
    fly(&mut cloud, 0.1, 10);
    assert!(cloud.x.iter().flatten().all(|x| x.is_finite()));
}

#[test]
fn parts_that_do_not_meet_do_not_press_and_each_part_presses_itself() {
    let mut mesh = block([1, 1, 1], 1.0);
    add_block(&mut mesh, [1, 1, 1], [0.0; 3], 1.0);
    for (between, expected) in [(true, true), (false, false)] {
        let mut settings = settings(2, 0.1, 0.4);
        settings.interacts = vec![false, between, between, false];
        let mut cloud = Cloud::new(&mesh, settings);
        for (i, x) in cloud.x.iter_mut().enumerate() {
            *x = [50.0 * i as f64, 0.0, 0.0];
        }
        cloud.x[1] = [0.4, 0.0, 0.0];
        cloud.x[8] = [0.0, 0.4, 0.0];
        cloud.cycle = 1;
        cloud.sort(1);
        let forces = cloud.forces();
        assert!(forces[0][0] < 0.0, "of one part");
        assert_eq!(forces[0][1] < 0.0, expected, "of two");
    }
}

/// Two cubes that share four nodes, of which the parts that are flagged have particles.
#[test]
fn a_joined_node_is_a_particle_of_its_lowest_part() {
    let mut mesh = block([1, 1, 1], 1.0);
    add_block(&mut mesh, [1, 1, 1], [0.0, 0.0, 1.0], 1.0);
    // The lower side of the second cube is the upper one of the first.
    (0..4).for_each(|i| mesh.parts[1].nodes[i] = 4 + i as u32);
    let found = |particles: [bool; 2]| -> Vec<(u32, f64)> {
        let settings = Settings { particles: particles.to_vec(), ..settings(2, 0.1, 0.4) };
        let mut surface = Surface::eroded(&mesh, &materials(), &|_| false, &[true; 2], true);
        surface.find_particles(&mesh, &materials(), &settings, &[0.0; 2]);
        let of =
            |p: &mechanics::contact::Particle| (surface.nodes[p.node as usize], (2.0 * p.radius).powi(3));
        surface.particles.iter().map(of).collect()
    };
    let [lower, upper] = [found([true, false]), found([false, true])];
    let nodes = |found: &[(u32, f64)]| found.iter().map(|(node, _)| *node).collect::<Vec<_>>();
    assert_eq!(nodes(&lower), [0, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(nodes(&upper), [12, 13, 14, 15]);
    for (node, volume) in lower.into_iter().chain(upper) {
        let expected = if (4..8).contains(&node) { 0.25 } else { 0.125 };
        assert!(
            (volume - expected).abs() < 1e-14,
            "node {node} has {volume}, both elements give it {expected}"
        );
    }
}
