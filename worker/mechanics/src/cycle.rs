//! One cycle of a worker: contact, border elements, interior, totals, integrate.
//!
//! A [`Domain`] is all that a worker holds: blocks with their own copies of their nodes, the contact nodes and
//! faces of its work units, and *guests* (contact nodes that no block here has). Which nodes have several
//! copies, here or on other workers, is said by a [`Plan`]; their total forces are exact sums, so the
//! steps below give the same bits however blocks, workers and threads are cut.
//!
//! Between two plans a cycle is, in this order: [`Domain::begin`], [`Domain::contact`] (with the loads on faces), [`Domain::elements`] (border),
//! [`Domain::partials`], [`Domain::elements`] (interior), [`Domain::integrate`].

mod bodies;
mod plan;
mod seams;
#[cfg(test)]
mod tests;

use std::{collections::VecDeque, ops::Range};

use serde::{Deserialize, Serialize};

use crate::{
    block::{Block, Piece},
    contact::Contact,
    element::{ElementVote, Step},
    erosion::{Eroding, PieceErosion},
    home::Home,
    lanes::{SET, Width},
    load::face::{self, FaceVote, LoadedFace},
    nodes::{Advance, Booked, NodeSet, Nodes},
    setup::Setup,
    spin,
    vote::{Gone, Quanta, Vote, Watched},
    wall::{self, Pose, WallVote},
};

use bodies::Held;
pub use plan::{Guest, Neighbour, Plan};
use seams::Seams;

/// Measures the work of compute threads; the physics knows no clock of its own.
pub trait Meter: Sync {
    /// A mark on the calling thread.
    fn start(&self) -> u64;
    /// Books what the calling thread did since the mark.
    fn stop(&self, mark: u64, contact: bool);
}

/// A sub-domain as the master hands it out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Subdomain {
    /// Number of the sub-domain; the lowest that has a node owns it.
    pub id: u32,
    /// Its state, cut for the threads of its worker.
    pub pieces: Vec<Piece>,
    /// Global nodes of it that another sub-domain owns, ascending.
    pub unowned: Vec<u32>,
    /// Global nodes of it on the contact surface, ascending.
    pub surface: Vec<u32>,
}

/// Which element sets a pass computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Sets {
    /// Those that touch nodes of the exchange.
    Border,
    /// The others.
    Interior,
    /// All.
    All,
}

/// How much a domain holds under the plan in force: what its steps cost is in proportion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Load {
    /// Elements that are computed before partial forces travel.
    pub border: u64,
    /// Elements that are computed while they travel.
    pub interior: u64,
    /// Nodes that are integrated, copies and guests included.
    pub nodes: u64,
    /// Node-face pairs that are looked at each cycle.
    pub pairs: u64,
}

/// What a block without loads on faces says.
const NO_FACES: FaceVote = FaceVote { force_bound: 0.0, limit: f64::INFINITY };

/// No index.
const NONE: u32 = u32::MAX;

/// A block and what the domain keeps beside it.
struct Room {
    block: Block,
    /// Its elements are those of a rigid body: they are not computed.
    is_rigid: bool,
    border: Vec<Range<u32>>,
    interior: Vec<Range<u32>>,
    /// Which nodes are held, booked and on the contact surface.
    sets: Vec<NodeSet>,
    /// Positions at the sort in force, eight for each set with nodes on the surface.
    reference: [Vec<f64>; 3],
    /// Those at gatherings whose sorts do not act yet, oldest first.
    gathered: VecDeque<[Vec<f64>; 3]>,
    vote: ElementVote,
    booked: Booked,
    /// Faces with loads, and what they said of the cycle.
    faces: Vec<LoadedFace>,
    face_vote: FaceVote,
    /// What booked nodes gave each wall.
    walls: Vec<WallVote>,
    /// Where the part erodes.
    eroding: Option<Eroding>,
}

impl Room {
    /// Positions as of now of the sets with nodes on the surface.
    fn surface_positions(&self) -> [Vec<f64>; 3] {
        let touched = || (0..).zip(&self.sets).filter(|(_, set)| set.surface != 0);
        std::array::from_fn(|a| {
            touched().flat_map(|(set, _)| &self.block.x[a][set * SET..(set + 1) * SET]).copied().collect()
        })
    }

    /// Takes a copy of a node out of the sums and off the surface; true if it was the one that is booked. Reference positions
    /// of its set go with its last node on the surface.
    fn drop_node(&mut self, local: u32) -> bool {
        let (set, bit) = (local as usize / SET, 1 << (local as usize % SET));
        let booked = self.sets[set].booked & bit != 0;
        self.sets[set].booked &= !bit;
        let before = self.sets[set].surface;
        self.sets[set].surface &= !bit;
        if before != 0 && self.sets[set].surface == 0 {
            let at = SET * self.sets[..set].iter().filter(|set| set.surface != 0).count();
            for positions in std::iter::once(&mut self.reference).chain(&mut self.gathered) {
                for along in positions {
                    along.drain(at..at + SET);
                }
            }
        }
        booked
    }

    /// Which elements have eroded and how far the others are, where they can.
    fn erosion(&self) -> Option<PieceErosion> {
        self.eroding.as_ref().map(|eroding| eroding.state(&self.block))
    }

    fn is_booked(&self, local: u32) -> bool {
        self.sets[local as usize / SET].booked >> (local as usize % SET) & 1 == 1
    }
}

/// Copies of one node: a range of `Domain::copies`, its contact node and its guest.
struct Shared {
    copies: Range<u32>,
    contact: u32,
    guest: u32,
}

/// Contact nodes, packed, and where their positions come from.
struct ContactRoom {
    contact: Contact,
    /// (block, local node), or (NONE, guest).
    sources: Vec<(u32, u32)>,
    x: [Vec<f64>; 3],
    v: [Vec<f64>; 3],
    f: [Vec<f64>; 3],
}

/// Guests by index.
#[derive(Default)]
struct Guests {
    node: Vec<u32>,
    x: [Vec<f64>; 3],
    v: [Vec<f64>; 3],
    f: [Vec<f64>; 3],
    mass: Vec<f64>,
    constraint: Vec<u16>,
    sets: Vec<NodeSet>,
}

/// Everything a worker computes on.
pub struct Domain {
    setup: Setup,
    n_parts: usize,
    quanta: Quanta,
    width: Width,
    rooms: Vec<Room>,
    guests: Guests,
    contact: Option<ContactRoom>,
    /// Whether nodes turn anywhere in the run.
    moments: bool,
    exchange: Vec<Shared>,
    /// Shared here only, but for the nodes of seams.
    local: Vec<Shared>,
    seams: Seams,
    copies: Vec<(u32, u32)>,
    bodies: Vec<Held>,
    /// Pushes on bodies travel: there are other workers.
    sends_pushes: bool,
    home: Home,
    gather: Vec<(u32, u32)>,
    gauges: Vec<(u32, u32, u32)>,
    /// Element gauges: gauge, room, local element.
    element_gauges: Vec<(u32, u32, u32)>,
    /// Pairs of parts whose contact force is wanted.
    watched_pairs: Vec<[u32; 2]>,
    vote: Vote,
    /// `n`.
    cycle: u64,
    /// `t_n`.
    time: f64,
    /// What left with dropped nodes in this cycle.
    gone: Gone,
    /// The surface in force ends with this cycle.
    surface_ends: bool,
    /// Where the walls are and how they move in this step.
    poses: Vec<Pose>,
    /// Takes what guests give walls, which their owners book.
    unbooked: Vec<WallVote>,
}

impl Domain {
    /// Builds the blocks of the sub-domains at the start of a cycle. `gauges` are global node indices by gauge.
    pub fn new(
        setup: Setup,
        n_parts: usize,
        quanta: Quanta,
        (subdomains, cycle): (Vec<Subdomain>, u64),
        gauges: &[u32],
        width: Width,
    ) -> Self {
        let mut rooms: Vec<Room> = Vec::new();
        let pieces = subdomains.iter().flat_map(|subdomain| &subdomain.pieces);
        let home = Home::new(pieces.map(|piece| piece.nodes.as_slice()));
        let mut gather = Vec::new();
        for Subdomain { pieces, unowned, surface, .. } in subdomains {
            let first = rooms.len();
            for mut piece in pieces {
                let erosion = piece.erosion.take();
                let mut block = Block::of(piece, &setup.materials);
                let all = 0..block.n_sets();
                let material = &setup.materials[block.material as usize];
                let eroding = setup.erosion.of_part(block.part as usize).map(|criteria| {
                    Eroding::new(
                        criteria,
                        erosion.as_ref(),
                        &mut block,
                        material,
                        setup.control.safety_factor,
                    )
                });
                let faces = face::faces_of(&block, &setup.loads, material);
                let part = block.part;
                let is_rigid = setup.bodies.iter().any(|body| body.parts.binary_search(&part).is_ok());
                rooms.push(Room {
                    is_rigid,
                    sets: NodeSet::all(&block.constraint),
                    block,
                    border: Vec::new(),
                    interior: vec![all],
                    reference: Default::default(),
                    gathered: VecDeque::new(),
                    vote: ElementVote::default(),
                    booked: Booked::default(),
                    faces,
                    face_vote: NO_FACES,
                    walls: vec![WallVote::default(); setup.walls.len()],
                    eroding,
                });
            }
            let own = first as u32..rooms.len() as u32;
            let first_copy =
                |node: u32| home.get(node).iter().copied().find(|(block, _)| own.contains(block));
            for room in own.clone() {
                for local in 0..rooms[room as usize].block.nodes.len() as u32 {
                    let node = rooms[room as usize].block.nodes[local as usize];
                    let owned = unowned.binary_search(&node).is_err();
                    if owned && first_copy(node) == Some((room, local)) {
                        rooms[room as usize].sets[local as usize / SET].booked |= 1 << (local as usize % SET);
                    }
                }
            }
            for &node in &surface {
                if let Some((room, local)) = first_copy(node) {
                    if unowned.binary_search(&node).is_err() {
                        gather.push((room, local));
                    }
                    rooms[room as usize].sets[local as usize / SET].surface |= 1 << (local as usize % SET);
                }
            }
        }
        for room in &mut rooms {
            room.reference = room.surface_positions();
        }
        let gauges = gauges
            .iter()
            .enumerate()
            .filter_map(|(g, node)| {
                let &(room, local) =
                    home.get(*node).iter().find(|&&(r, l)| rooms[r as usize].is_booked(l))?;
                Some((g as u32, room, local))
            })
            .collect();
        let bodies = Held::all(&setup, &home, &mut rooms);
        Self {
            vote: Vote::empty(n_parts),
            cycle,
            time: 0.0,
            gone: Gone::default(),
            surface_ends: false,
            poses: Vec::with_capacity(setup.walls.len()),
            unbooked: vec![WallVote::default(); setup.walls.len()],
            setup,
            n_parts,
            quanta,
            width,
            rooms,
            guests: Guests::default(),
            contact: None,
            moments: false,
            exchange: Vec::new(),
            local: Vec::new(),
            seams: Seams::default(),
            copies: Vec::new(),
            bodies,
            sends_pushes: false,
            home,
            gather,
            gauges,
            element_gauges: Vec::new(),
            watched_pairs: Vec::new(),
        }
    }

    /// From now on votes say how these elements and contacts are; before the first plan is installed.
    pub fn watch(&mut self, watched: &Watched) {
        self.watched_pairs.clone_from(&watched.contacts);
        let place = |element: &u32| {
            let found = |room: &Room| room.block.elements.iter().position(|e| e == element);
            let mut rooms = (0..).zip(&self.rooms);
            rooms.find_map(|(index, room)| found(room).map(|local| (index, local as u32)))
        };
        let places = (0..).zip(&watched.elements);
        self.element_gauges = places
            .filter_map(|(gauge, element)| place(element).map(|(room, local)| (gauge, room, local)))
            .collect();
    }

    /// Number of elements held.
    pub fn n_elements(&self) -> usize {
        self.rooms.iter().map(|r| r.block.elements.len()).sum()
    }

    /// What it holds under the plan in force.
    pub fn load(&self) -> Load {
        let mut load = Load::default();
        for room in &self.rooms {
            let count = |sets: &[Range<u32>]| sets.iter().map(|s| room.block.n_elements_of(s)).sum::<u64>();
            load.border += count(&room.border);
            load.interior += count(&room.interior);
            load.nodes += room.block.nodes.len() as u64;
        }
        load.nodes += self.guests.node.len() as u64;
        load.pairs = self.contact.as_ref().map_or(0, |room| room.contact.n_pairs() as u64);
        load
    }

    /// A pass with a step of zero: changes nothing and gives the vote a run starts from.
    pub fn prepare(&mut self, meter: &dyn Meter) -> Vote {
        self.vote = Vote::empty(self.n_parts);
        self.elements(Sets::All, 0.0, meter);
        self.load_faces(meter);
        for room in &mut self.rooms {
            room.block.clear_forces();
            let v = &room.block.v;
            let on_surface = |i: usize| room.sets[i / SET].surface >> (i % SET) & 1 == 1;
            let nodes = (0..room.block.nodes.len()).filter(|&i| on_surface(i));
            let top = nodes.map(|i| speed_squared(v, i)).fold(0.0, f64::max);
            self.vote.contact_speed_squared = self.vote.contact_speed_squared.max(top);
            self.vote.contact_speed_ahead = self.vote.contact_speed_ahead.max(top.sqrt());
        }
        self.finish_vote()
    }

    /// Position and velocity of `nodes` (global), six numbers each, for workers that will have them as guests.
    ///
    /// # Errors
    /// If a node is not held here.
    pub fn transfer(&self, nodes: &[u32]) -> Result<Vec<f64>, String> {
        let mut out = Vec::with_capacity(6 * nodes.len());
        for node in nodes {
            let (room, local) = *self
                .home
                .get(*node)
                .first()
                .ok_or_else(|| format!("node {node} to transfer is not held"))?;
            let (block, i) = (&self.rooms[room as usize].block, local as usize);
            out.extend((0..3).map(|a| block.x[a][i]));
            out.extend((0..3).map(|a| block.v[a][i]));
        }
        Ok(out)
    }

    /// Positions of the owned surface nodes in the order the master expects; a sort will use them.
    pub fn gather(&mut self) -> Vec<f64> {
        for room in &mut self.rooms {
            room.gathered.push_back(room.surface_positions());
        }
        let mut out = Vec::with_capacity(3 * self.gather.len());
        for &(room, local) in &self.gather {
            let block = &self.rooms[room as usize].block;
            out.extend((0..3).map(|a| block.x[a][local as usize]));
        }
        out
    }

    /// A cycle begins at `time` with this quantum of forces, which an order may have made coarser.
    pub fn begin(&mut self, quantum: crate::exact::Quantum, time: f64) {
        self.quanta.force = quantum;
        self.time = time;
    }

    /// Contact forces of the work units at `x_n` and loads on faces; `dt` is `dt_{n-1}`.
    pub fn contact(&mut self, dt: f64, meter: &dyn Meter) {
        let mark = meter.start();
        if let Some(room) = &mut self.contact {
            room.pack(&self.rooms, &self.guests);
            for f in &mut room.f {
                f.fill(0.0);
            }
            let vote =
                room.contact.forces(&room.x, &room.v, dt, self.quanta.force, self.quanta.energy, &mut room.f);
            self.vote.add_contact(&vote);
            self.vote.contact_energies.merge(room.contact.energies());
            if !self.watched_pairs.is_empty() {
                self.vote.add_contacts(&room.contact.pair_votes());
            }
        }
        meter.stop(mark, true);
        self.load_faces(meter);
    }

    /// Adds the loads on faces to the forces of the blocks.
    fn load_faces(&mut self, meter: &dyn Meter) {
        if self.setup.loads.surfaces.is_empty() {
            return;
        }
        let Setup { loads, control, .. } = &self.setup;
        let (time, quantum) = (self.time, self.quanta.force);
        each(&mut self.rooms, |room| {
            let mark = meter.start();
            room.face_vote = face::apply(&mut room.faces, &mut room.block, loads, control, time, quantum);
            meter.stop(mark, false);
        });
    }

    /// Forces of element sets at `x_n`, added to forces that integration has cleared; `dt` is `dt_{n-1}`.
    pub fn elements(&mut self, sets: Sets, dt: f64, meter: &dyn Meter) {
        let control = &self.setup.control;
        let step = Step {
            dt,
            linear_viscosity: control.linear_viscosity,
            quadratic_viscosity: control.quadratic_viscosity,
            hourglass: control.hourglass,
            force_quantum: self.quanta.force,
            energy_quantum: self.quanta.energy,
            arm: self.quanta.arm,
        };
        let (materials, width, cycle) = (&self.setup.materials, self.width, self.cycle);
        let work = |room: &mut Room| {
            if room.is_rigid {
                return;
            }
            let mark = meter.start();
            let material = &materials[room.block.material as usize];
            if let Some(eroding) = room.eroding.as_mut().filter(|_| dt > 0.0) {
                if sets != Sets::Interior {
                    eroding.watch(&mut room.block, &room.border, &step, cycle, width);
                }
                if sets != Sets::Border {
                    eroding.watch(&mut room.block, &room.interior, &step, cycle, width);
                }
            }
            if sets != Sets::Interior {
                room.vote = ElementVote::default();
                room.block.compute(material, &room.border, &step, width, &mut room.vote);
            }
            if sets != Sets::Border {
                room.block.compute(material, &room.interior, &step, width, &mut room.vote);
            }
            meter.stop(mark, false);
        };
        each(&mut self.rooms, work);
    }

    /// Partial forces of the nodes of the exchange, three numbers each, with moments six, and behind them pushes on rigid bodies.
    pub fn partials(&mut self, meter: &dyn Meter) -> Vec<f64> {
        let mark = meter.start();
        self.push_bodies();
        let mut out = Vec::with_capacity(self.stride() * self.exchange.len() + self.n_pushes());
        for shared in &self.exchange {
            out.extend(self.sum(shared));
            if self.moments {
                out.extend(self.moment(shared));
            }
        }
        self.pack_pushes(&mut out);
        meter.stop(mark, false);
        out
    }

    fn sum(&self, shared: &Shared) -> [f64; 3] {
        let mut total = [0.0; 3];
        for &(room, local) in &self.copies[shared.copies.start as usize..shared.copies.end as usize] {
            let f = &self.rooms[room as usize].block.f;
            for a in 0..3 {
                total[a] += f[a][local as usize];
            }
        }
        if shared.contact != NONE
            && let Some(contact) = &self.contact
        {
            for a in 0..3 {
                total[a] += contact.f[a][shared.contact as usize];
            }
        }
        total
    }

    /// Numbers that travel for each entry of the exchange.
    fn stride(&self) -> usize {
        if self.moments { 6 } else { 3 }
    }

    fn moment(&self, shared: &Shared) -> [f64; 3] {
        let mut total = [0.0; 3];
        for &(room, local) in &self.copies[shared.copies.start as usize..shared.copies.end as usize] {
            if let Some(turning) = &self.rooms[room as usize].block.turning {
                for a in 0..3 {
                    total[a] += turning.m[a][local as usize];
                }
            }
        }
        total
    }

    fn set(&mut self, index: usize, of_exchange: bool, total: [f64; 3], moment: [f64; 3]) {
        let shared = if of_exchange { &self.exchange[index] } else { &self.local[index] };
        for &(room, local) in &self.copies[shared.copies.start as usize..shared.copies.end as usize] {
            let block = &mut self.rooms[room as usize].block;
            for a in 0..3 {
                block.f[a][local as usize] = total[a];
            }
            if let Some(turning) = &mut block.turning {
                for a in 0..3 {
                    turning.m[a][local as usize] = moment[a];
                }
            }
        }
        if shared.guest != NONE {
            for a in 0..3 {
                self.guests.f[a][shared.guest as usize] = total[a];
            }
        }
    }

    /// Puts the total forces in place, integrates all nodes from `x_n` to `x_{n+1}` and gives the vote of the cycle.
    /// `free_walls` are the poses of the walls of finite mass.
    ///
    /// # Errors
    /// If `totals` has not three numbers for each node of the exchange, and those of the pushes on rigid bodies.
    pub fn integrate(
        &mut self,
        totals: &[f64],
        dt_previous: f64,
        dt: f64,
        free_walls: &[Pose],
        meter: &dyn Meter,
    ) -> Result<Vote, String> {
        let (stride, n_pushes) = (self.stride(), self.n_pushes());
        if totals.len() != stride * self.exchange.len() + n_pushes {
            return Err(format!(
                "{} numbers of total forces for {} shared nodes, expected {stride} each, and {n_pushes} for rigid bodies",
                totals.len(),
                self.exchange.len()
            ));
        }
        let mark = meter.start();
        let (totals, pushes) = totals.split_at(totals.len() - n_pushes);
        for (i, total) in totals.chunks_exact(stride).enumerate() {
            let moment = if self.moments { [total[3], total[4], total[5]] } else { [0.0; 3] };
            self.set(i, true, [total[0], total[1], total[2]], moment);
        }
        for i in 0..self.local.len() {
            let total = self.sum(&self.local[i]);
            let moment = if self.moments { self.moment(&self.local[i]) } else { [0.0; 3] };
            self.set(i, false, total, moment);
        }
        self.seams.add_up(&mut self.rooms, self.contact.as_ref().map(|room| &room.f));
        meter.stop(mark, false);
        self.move_bodies(pushes, dt_previous, dt);
        let setup = &self.setup;
        wall::poses(&setup.walls, &setup.loads.curves, self.time, dt, free_walls, &mut self.poses);
        let advance = Advance {
            dt_previous,
            dt,
            time: self.time,
            constraints: &setup.constraints,
            walls: &setup.walls,
            poses: &self.poses,
            loads: &setup.loads,
            quanta: self.quanta,
        };
        let width = self.width;
        each(&mut self.rooms, |room| {
            let mark = meter.start();
            let block = &mut room.block;
            let mut nodes = Nodes {
                x: &mut block.x,
                v: &mut block.v,
                f: &mut block.f,
                mass: &block.mass,
                constraint: &block.constraint,
                sets: &room.sets,
                reference: &room.reference,
                walls: &mut room.walls,
            };
            room.booked = advance.run(&mut nodes, width);
            if let Some(turning) = &mut block.turning {
                let (kinetic, external) = spin::advance(&advance, turning, &block.constraint, &room.sets);
                room.booked.kinetic += kinetic;
                room.booked.external.merge(external);
            }
            if !room.faces.is_empty() {
                let half_steps = 0.5 * (dt_previous + dt);
                let work = face::work(&room.faces, block, half_steps, advance.quanta.energy);
                room.booked.external.merge(work);
            }
            if room.eroding.as_mut().is_some_and(Eroding::take_change) {
                // Loads leave with the faces of eroded elements.
                room.leave_out_dead();
                if !room.faces.is_empty() {
                    let material = &setup.materials[room.block.material as usize];
                    room.faces = face::faces_of(&room.block, &setup.loads, material);
                }
            }
            meter.stop(mark, false);
        });
        let guests = &mut self.guests;
        let mut nodes = Nodes {
            x: &mut guests.x,
            v: &mut guests.v,
            f: &mut guests.f,
            mass: &guests.mass,
            constraint: &guests.constraint,
            sets: &guests.sets,
            reference: &Default::default(),
            walls: &mut self.unbooked,
        };
        advance.run(&mut nodes, width);
        if std::mem::take(&mut self.surface_ends) {
            let mark = meter.start();
            self.vote.released = Some(self.spring_energies(dt));
            meter.stop(mark, true);
        }
        self.cycle += 1;
        Ok(self.finish_vote())
    }

    fn finish_vote(&mut self) -> Vote {
        let mut vote = std::mem::replace(&mut self.vote, Vote::empty(self.n_parts));
        for room in &mut self.rooms {
            let part = room.block.part as usize;
            vote.add_elements(part, &room.vote);
            vote.contact_limit = vote.contact_limit.min(room.face_vote.limit);
            vote.force_bound = vote.force_bound.max(room.face_vote.force_bound);
            vote.add_walls(&room.walls);
            room.walls.fill(WallVote::default());
            vote.parts[part].kinetic += room.booked.kinetic;
            vote.external.merge(room.booked.external);
            vote.parts[part].external.merge(room.booked.external);
            for a in 0..3 {
                vote.momentum[a] += room.booked.momentum[a];
            }
            vote.extents[part].merge(&room.booked.extent);
            vote.contact_speed_squared = vote.contact_speed_squared.max(room.booked.speed_squared);
            vote.contact_speed_ahead = vote.contact_speed_ahead.max(room.booked.speed_ahead);
            if let Some(eroding) = &mut room.eroding {
                let casualties = eroding.take_casualties();
                vote.add_eroded(&casualties.elements);
                vote.gone.internal += casualties.internal;
            }
        }
        self.vote_on_bodies(&mut vote);
        vote.gone.merge(&std::mem::take(&mut self.gone));
        for &(gauge, room, local) in &self.gauges {
            let (block, i) = (&self.rooms[room as usize].block, local as usize);
            let values =
                [block.x[0][i], block.x[1][i], block.x[2][i], block.v[0][i], block.v[1][i], block.v[2][i]];
            vote.gauges.push((gauge, values));
        }
        for &(gauge, room, local) in &self.element_gauges {
            vote.element_gauges.push((gauge, self.rooms[room as usize].block.element(local as usize)));
        }
        vote
    }

    /// The state of all blocks, to be put back into a global state.
    pub fn pieces(&self) -> Vec<Piece> {
        self.rooms.iter().map(|room| Piece { erosion: room.erosion(), ..room.block.piece() }).collect()
    }

    /// Number of blocks.
    pub fn n_blocks(&self) -> usize {
        self.rooms.len()
    }

    /// What the elements of a block made of `x_n`, between all its elements and integration: forces of its elements and
    /// of the loads on its faces by node, state by element, and its vote, hashed. It depends on the state of this block
    /// at the start of the cycle and on nothing else of the domain, so that whoever has that state can compute it again.
    ///
    /// # Errors
    /// If there is no such block.
    pub fn sample(&self, block: usize) -> Result<[u8; 16], String> {
        let n = self.rooms.len();
        let room = self.rooms.get(block).ok_or_else(|| format!("block {block} of {n} to sample"))?;
        Ok(crate::proof::of_block(&room.block, &room.vote))
    }

    /// Makes the pressure (of shells a stress) of the first element of every block wrong by one unit in the last place: what a faulty
    /// processor might do. For tests of who finds it.
    #[doc(hidden)]
    pub fn plant_fault(&mut self) {
        self.rooms.iter_mut().for_each(|room| room.block.plant_fault());
    }

    /// [`Domain::pieces`] of a domain that is not needed any more: it goes as they come.
    pub fn into_pieces(self) -> Vec<Piece> {
        let image = |room: Room| Piece { erosion: room.erosion(), ..room.block.into_piece() };
        self.rooms.into_iter().map(image).collect()
    }
}

/// Runs `work` on each room, in parallel on the current pool when there are several.
fn each(rooms: &mut [Room], work: impl Fn(&mut Room) + Send + Sync) {
    one_by_one(rooms, &work);
}

/// So many rooms are taken one by one at most: each is handed to the next thread by the one before.
const ONE_BY_ONE: usize = 32;

/// Whichever thread is free takes the next room: rooms of a small part and of a large one are not alike, and halves of the
/// list would leave a thread with all the large ones. Longer lists are halved first.
fn one_by_one(rooms: &mut [Room], work: &(impl Fn(&mut Room) + Send + Sync)) {
    match rooms {
        [] => {}
        [one] => work(one),
        [first, rest @ ..] if rest.len() < ONE_BY_ONE => {
            rayon::join(|| work(first), || one_by_one(rest, work));
        }
        many => {
            let (left, right) = many.split_at_mut(many.len() / 2);
            rayon::join(|| one_by_one(left, work), || one_by_one(right, work));
        }
    }
}

fn speed_squared(v: &[Vec<f64>; 3], i: usize) -> f64 {
    v[0][i] * v[0][i] + v[1][i] * v[1][i] + v[2][i] * v[2][i]
}

impl ContactRoom {
    /// Brings positions, and velocities if contact reads them, to those of now.
    fn pack(&mut self, rooms: &[Room], guests: &Guests) {
        pack(&self.sources, |room| positions(rooms, guests, room), &mut self.x);
        if self.contact.reads_velocities() {
            pack(&self.sources, |room| velocities(rooms, guests, room), &mut self.v);
        }
    }
}

/// Positions of the nodes of a block, or of the guests.
fn positions<'a>(rooms: &'a [Room], guests: &'a Guests, room: u32) -> &'a [Vec<f64>; 3] {
    if room == NONE { &guests.x } else { &rooms[room as usize].block.x }
}

/// Velocities of the nodes of a block, or of the guests.
fn velocities<'a>(rooms: &'a [Room], guests: &'a Guests, room: u32) -> &'a [Vec<f64>; 3] {
    if room == NONE { &guests.v } else { &rooms[room as usize].block.v }
}

/// Packs what `from` gives by block, node by node.
fn pack<'a>(sources: &[(u32, u32)], from: impl Fn(u32) -> &'a [Vec<f64>; 3], to: &mut [Vec<f64>; 3]) {
    for (i, &(room, local)) in sources.iter().enumerate() {
        let from = from(room);
        for a in 0..3 {
            to[a][i] = from[a][local as usize];
        }
    }
}
