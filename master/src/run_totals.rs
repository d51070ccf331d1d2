//! The totals of a run: energies and momentum from votes, the worst ratios, rows of history.

use deck::model::Model;
use mechanics::{
    contact::PairEnergies,
    mesh::Part,
    rigid::{self, switch::Formation},
    state::{GlobalState, field},
    vote::{PartVote, Vote},
    wall::WallVote,
    work::Work,
};
use serde::{Deserialize, Serialize};

use crate::results::history::{GaugeRow, HistoryRow, HolderRow, PartEnergy};

mod bodies;
mod gauges;

pub use bodies::{BodyError, PartScale};
pub use gauges::{Dead, Gauges};

/// Energies of contact between two parts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PairSums {
    /// The parts, lower index first; equal for a part that meets itself.
    pub parts: [u32; 2],
    /// In springs now.
    pub contact: f64,
    /// Taken by friction so far.
    pub friction: f64,
    /// What springs lost so far where the surface changed by erosion.
    pub eroded: f64,
    /// In springs after the first cycle of the run.
    pub first: f64,
}

/// Sums over all cycles so far; stored in a snapshot as it stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunTotals {
    /// Hourglass work so far.
    pub hourglass: f64,
    /// Work of artificial viscosity so far (part of internal energy).
    pub viscosity: f64,
    /// Energy lost to friction so far.
    pub friction: f64,
    /// What was lost at walls up to the time of the last cycle booked.
    pub wall_loss: f64,
    /// What the impulses of that cycle lose after its time; the next cycle books it.
    pub wall_loss_ahead: f64,
    /// Walls and supports up to the time of the last cycle booked, and their work and loss after it.
    pub holders: Vec<(HolderRow, [f64; 2])>,
    /// Work done from outside up to the time of the last cycle booked: by supports, walls and loads.
    pub external: f64,
    /// Work that the impulses of that cycle do after its time; the next cycle books it.
    pub external_ahead: f64,
    /// The same by part; empty before the first cycle.
    pub external_ahead_of_parts: Vec<f64>,
    /// Internal energy of eroded elements, kinetic energy of nodes that were dropped, and what springs of contact had less on each
    /// new surface than on the one before it.
    pub eroded: f64,
    /// Momentum of those nodes.
    pub eroded_momentum: [f64; 3],
    /// Elements that have eroded.
    pub eroded_elements: u64,
    pub eroded_mass: f64,
    /// Total energy less external work after the first cycle; none before it.
    pub initial_total: Option<f64>,
    /// The first cycle in which anything had energy or work was done; none while all is at rest.
    pub first_stirred: Option<u64>,
    pub greatest_kinetic: f64,
    /// Greatest size of the external work so far.
    pub greatest_external: f64,
    /// Sums of each part after the first cycle, and up to now; empty before it.
    pub parts: [Vec<PartEnergy>; 2],
    /// What each part is judged by.
    pub scales: Vec<PartScale>,
    /// By part: the lowest part that it is one body with from the start, as nodes are shared or it is rigid.
    pub joined: Vec<usize>,
    /// The first time step that was booked (time); none before it.
    pub first_step: Option<f64>,
    /// Mass by part, as momentum is booked: a node that parts share counts with the first of them, a rigid body with its account.
    pub masses: Vec<f64>,
    /// Momentum before the first cycle.
    pub initial_momentum: [f64; 3],
    /// Greatest momentum of a part before the first cycle.
    pub part_momentum: f64,
    /// Largest `dt` over the true Courant limit.
    pub worst_courant: f64,
    /// Largest travel of a contact node in one cycle, in gaps.
    pub worst_gap_travel: f64,
    /// Deepest contact, in gaps.
    pub worst_penetration: f64,
    /// Energies of contact by pair of parts, ascending.
    pub contacts: Vec<PairSums>,
    /// What springs had at the start of the cycle to be booked next, on a surface that has ended; none where it stays.
    pub released: Option<PairEnergies>,
    /// Rigid bodies as the last vote had them.
    pub bodies: Vec<rigid::State>,
    /// What is left of the elements that gauges read.
    pub gauges: Gauges,
    pub last: HistoryRow,
}

impl RunTotals {
    /// Of a run that begins with `start`: its last row is that of the start.
    pub fn at_start(model: &Model, start: &GlobalState) -> Self {
        let mut totals = Self::new(model, &start.mass);
        let square = |v: [f64; 3]| v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
        let internal = |(part, first): (&Part, usize)| {
            let of = |e: usize| start.elements[field::ENERGY][e] * start.initial_volume[e];
            PartEnergy { internal: (first..first + part.n_elements()).map(of).sum(), ..PartEnergy::default() }
        };
        let mesh = &model.mesh;
        let parts: Vec<PartEnergy> = mesh.parts.iter().zip(mesh.element_offsets()).map(internal).collect();
        let mut is_of_body = vec![false; mesh.n_nodes()];
        let bodies = &model.setup.bodies;
        bodies.iter().flat_map(|body| &body.nodes).for_each(|&node| is_of_body[node as usize] = true);
        let of_node = |n: usize| {
            let turning = start.shells.spin.get(n).map_or(0.0, |w| start.shells.inertia[n] * square(*w));
            0.5 * start.mass[n].mul_add(square(start.v[n]), turning)
        };
        let of_bodies = bodies.iter().map(|body| {
            let [spin, momentum] = [body.start.spin, body.start.momentum];
            0.5 * body.mass.mul_add(square(body.start.velocity), (0..3).map(|a| spin[a] * momentum[a]).sum())
        });
        let kinetic = (0..mesh.n_nodes()).filter(|&n| !is_of_body[n]).map(of_node).chain(of_bodies).sum();
        let internal = parts.iter().map(|part| part.internal).sum();
        let momentum = totals.initial_momentum;
        totals.last = HistoryRow {
            kinetic,
            internal,
            total: kinetic + internal,
            momentum,
            parts,
            ..HistoryRow::default()
        };
        totals
    }

    /// Before the first cycle of a run.
    pub fn new(model: &Model, mass: &[f64]) -> Self {
        let momentum_of = |nodes: &mut dyn Iterator<Item = usize>| {
            nodes.fold([0.0; 3], |mut sum, n| {
                for (s, v) in sum.iter_mut().zip(model.velocity[n]) {
                    *s += mass[n] * v;
                }
                sum
            })
        };
        let norm = |p: [f64; 3]| (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
        let part_momentum = model
            .mesh
            .parts
            .iter()
            .map(|part| norm(momentum_of(&mut part.nodes.iter().map(|&n| n as usize))))
            .fold(0.0, f64::max);
        let mut initial_momentum = momentum_of(&mut (0..model.mesh.n_nodes()));
        // Nodes of a distorted mesh that turns have a little more or less than their body.
        for body in &model.setup.bodies {
            let of_nodes = momentum_of(&mut body.nodes.iter().map(|&n| n as usize));
            for a in 0..3 {
                initial_momentum[a] += body.mass * body.start.velocity[a] - of_nodes[a];
            }
        }
        Self {
            hourglass: 0.0,
            viscosity: 0.0,
            friction: 0.0,
            wall_loss: 0.0,
            wall_loss_ahead: 0.0,
            holders: vec![Default::default(); model.setup.n_holders()],
            external: 0.0,
            external_ahead: 0.0,
            external_ahead_of_parts: Vec::new(),
            eroded: 0.0,
            eroded_momentum: [0.0; 3],
            eroded_elements: 0,
            eroded_mass: 0.0,
            initial_total: None,
            first_stirred: None,
            greatest_kinetic: 0.0,
            greatest_external: 0.0,
            parts: Default::default(),
            scales: vec![PartScale::default(); model.mesh.parts.len()],
            joined: bodies::joined(model),
            first_step: None,
            masses: masses(model, mass),
            initial_momentum,
            part_momentum,
            worst_courant: 0.0,
            worst_gap_travel: 0.0,
            worst_penetration: 0.0,
            contacts: Vec::new(),
            released: None,
            bodies: Vec::new(),
            gauges: Gauges::of(model),
            last: HistoryRow::default(),
        }
    }

    /// Books the whole vote of a cycle that began at `time` with step `dt`; `gap` where there is contact.
    pub fn book(&mut self, vote: &Vote, cycle: u64, time: f64, dt: f64, gap: Option<f64>) {
        let sum = |f: &dyn Fn(&PartVote) -> f64| vote.parts.iter().map(f).sum::<f64>();
        self.hourglass += sum(&|p| p.hourglass);
        self.viscosity += sum(&|p| p.viscosity);
        self.friction += vote.friction;
        let lost = self.book_holders(&vote.walls, 0.5 * (self.last.dt + dt));
        self.wall_loss += std::mem::replace(&mut self.wall_loss_ahead, lost.after) + lost.before;
        // Votes count what is lost at walls as their work.
        self.external += std::mem::replace(&mut self.external_ahead, vote.external.after + lost.after)
            + (vote.external.before + lost.before);
        let kinetic = sum(&|p| p.kinetic);
        let internal = sum(&|p| p.internal);
        self.eroded += vote.gone.internal + vote.gone.kinetic;
        for (sum, lost) in self.eroded_momentum.iter_mut().zip(vote.gone.momentum) {
            *sum += lost;
        }
        self.book_pairs(&vote.contact_energies);
        if let Some(released) = std::mem::replace(&mut self.released, vote.released.clone()) {
            self.book_released(&released);
        }
        let total =
            kinetic + internal + self.hourglass + vote.contact + self.friction + self.eroded + self.wall_loss;
        let initial = *self.initial_total.get_or_insert(total - self.external);
        self.greatest_kinetic = self.greatest_kinetic.max(kinetic);
        self.greatest_external = self.greatest_external.max(self.external.abs());
        self.first_step.get_or_insert(dt);
        self.book_parts(&vote.parts, cycle);
        self.bodies.clone_from(&vote.bodies);
        let scale = self.scale();
        if scale > 0.0 {
            self.first_stirred.get_or_insert(cycle);
        }
        let error = if scale > 0.0 { (total - self.external - initial) / scale } else { 0.0 };
        self.worst_courant = self.worst_courant.max(dt / vote.courant);
        if let Some(gap) = gap {
            self.worst_gap_travel = self.worst_gap_travel.max(vote.contact_speed_squared.sqrt() * dt / gap);
            self.worst_penetration = self.worst_penetration.max(vote.worst_depth);
        }
        self.last = HistoryRow {
            cycle,
            time,
            dt,
            kinetic,
            internal,
            hourglass: self.hourglass,
            contact: vote.contact,
            friction: self.friction,
            eroded: self.eroded,
            eroded_elements: self.eroded_elements,
            eroded_mass: self.eroded_mass,
            wall_loss: self.wall_loss,
            external: self.external,
            total,
            error,
            momentum: vote.momentum,
            parts: self.parts[1].clone(),
            part_momenta: vote.parts.iter().map(|part| part.momentum).collect(),
            gauges: vote
                .gauges
                .iter()
                .map(|(_, g)| GaugeRow { x: [g[0], g[1], g[2]], v: [g[3], g[4], g[5]] })
                .collect(),
            element_gauges: vote.element_gauges.iter().map(|(_, state)| state.clone()).collect(),
            contacts: vote.contacts.clone(),
            sections: vote.sections.clone(),
            holders: self.holders.iter().map(|(row, _)| *row).collect(),
            joints: vote.joints.iter().map(|joint| [joint.force, joint.moment]).collect(),
        };
    }

    /// Books what a part lost as it became rigid, after the cycle booked last: work from outside that takes it.
    pub fn book_formation(&mut self, formation: &Formation) {
        self.external_ahead -= formation.lost;
        if let Some(ahead) = self.external_ahead_of_parts.get_mut(formation.part as usize) {
            *ahead -= formation.lost;
        }
    }

    /// Books what walls and supports gave the bodies by impulses over `half_steps`; gives what was lost at walls.
    fn book_holders(&mut self, votes: &[WallVote], half_steps: f64) -> Work {
        let mut lost = Work::default();
        for (index, (row, ahead)) in self.holders.iter_mut().enumerate() {
            let vote = votes.get(index).copied().unwrap_or_default();
            let [work, loss] = std::mem::replace(ahead, [vote.work.after, vote.loss.after]);
            row.work += work + vote.work.before;
            row.loss += loss + vote.loss.before;
            row.force = vote.impulse.map(|j| if half_steps > 0.0 { -j / half_steps } else { 0.0 });
            lost.merge(vote.loss);
        }
        lost
    }

    /// What energies are large or small beside: the greatest of the energy at first, the kinetic energy and the external work. Slow
    /// loading is not judged by the little kinetic energy that it has.
    pub fn scale(&self) -> f64 {
        let initial = self.initial_total.unwrap_or_default().abs();
        initial.max(self.greatest_kinetic).max(self.greatest_external)
    }

    fn pair(&mut self, parts: [u32; 2]) -> &mut PairSums {
        let at = self.contacts.binary_search_by_key(&parts, |pair| pair.parts).unwrap_or_else(|at| {
            self.contacts.insert(at, PairSums { parts, ..PairSums::default() });
            at
        });
        &mut self.contacts[at]
    }

    fn book_pairs(&mut self, votes: &PairEnergies) {
        self.contacts.iter_mut().for_each(|pair| pair.contact = 0.0);
        for vote in votes.pairs() {
            let pair = self.pair(vote.parts);
            pair.contact = vote.contact;
            pair.friction += vote.friction;
        }
    }

    /// Books what springs on the surface before had more than those on the new one have now, at the same positions.
    fn book_released(&mut self, before: &PairEnergies) {
        for vote in before.pairs() {
            self.pair(vote.parts).eroded += vote.contact;
            self.eroded += vote.contact;
        }
        for pair in &mut self.contacts {
            pair.eroded -= pair.contact;
            self.eroded -= pair.contact;
        }
    }

    /// Books the number and mass of the elements that eroded in the cycle booked last. Their mass is that of the deck: it stays at
    /// the nodes until those are dropped.
    pub fn book_eroded(&mut self, vote: &Vote, model: &Model) {
        if vote.eroded.is_empty() {
            return;
        }
        let offsets = model.mesh.element_offsets();
        for &element in &vote.eroded {
            let part = offsets.partition_point(|&first| first <= element as usize) - 1;
            let Some(of_part) = model.mesh.parts.get(part) else { continue };
            let local = element as usize - offsets[part];
            let volume = of_part.volume_of(local, &model.mesh.positions);
            self.eroded_mass += model.setup.materials[of_part.material as usize].density * volume;
            self.gauges.book(model, element, &of_part.nodes_of(local), (self.last.cycle, self.last.time));
        }
        self.eroded_elements += vote.eroded.len() as u64;
        self.last.eroded_elements = self.eroded_elements;
        self.last.eroded_mass = self.eroded_mass;
    }

    fn book_parts(&mut self, votes: &[PartVote], cycle: u64) {
        let [first, now] = &mut self.parts;
        now.resize(votes.len(), PartEnergy::default());
        self.external_ahead_of_parts.resize(votes.len(), 0.0);
        for ((part, ahead), vote) in now.iter_mut().zip(&mut self.external_ahead_of_parts).zip(votes) {
            (part.kinetic, part.internal) = (vote.kinetic, vote.internal);
            part.hourglass += vote.hourglass;
            part.viscosity += vote.viscosity;
            part.eroded += vote.gone;
            part.external += std::mem::replace(ahead, vote.external.after) + vote.external.before;
        }
        if first.is_empty() {
            first.clone_from(now);
            self.contacts.iter_mut().for_each(|pair| pair.first = pair.contact);
        }
        for (scale, part) in self.scales.iter_mut().zip(now) {
            scale.book(part, cycle);
        }
    }

    /// Energy that appeared or vanished since the first cycle.
    pub fn unexplained(&self) -> f64 {
        self.initial_total.map_or(0.0, |initial| self.last.total - self.external - initial)
    }

    /// The part whose own energy grew most since the first cycle: its index and what it gained; the first of equals.
    pub fn greediest_part(&self) -> Option<(usize, f64)> {
        let [first, now] = &self.parts;
        let gains = first.iter().zip(now).map(|(first, now)| now.own() - first.own()).enumerate();
        gains.fold(None, |best, (p, gain)| match best {
            Some((_, most)) if most >= gain => best,
            _ => Some((p, gain)),
        })
    }

    /// Change of momentum over the largest initial momentum of a part; 0 if all were at rest.
    pub fn momentum_error(&self) -> f64 {
        if self.part_momentum == 0.0 {
            return 0.0;
        }
        let change: f64 = (0..3)
            .map(|a| (self.last.momentum[a] + self.eroded_momentum[a] - self.initial_momentum[a]).powi(2))
            .sum();
        change.sqrt() / self.part_momentum
    }
}

/// Mass of each part, of nodes with these masses.
fn masses(model: &Model, mass: &[f64]) -> Vec<f64> {
    let mut counted = vec![false; model.mesh.n_nodes()];
    for body in &model.setup.bodies {
        body.nodes.iter().for_each(|&node| counted[node as usize] = true);
    }
    let of_part = |part: &Part| {
        let own = part.nodes.iter().filter(|&&node| !std::mem::replace(&mut counted[node as usize], true));
        own.map(|&node| mass[node as usize]).sum()
    };
    let mut masses: Vec<f64> = model.mesh.parts.iter().map(of_part).collect();
    for body in &model.setup.bodies {
        masses[body.account as usize] += body.mass;
    }
    masses
}
