//! One cycle of a worker.
//!
//! A [`Domain`] is all that a worker holds: blocks with their own copies of their nodes, the contact nodes and
//! faces of its work units, and *ghosts* (contact nodes that no block here has). Which nodes have several
//! copies, here or on other workers, is said by a [`Plan`]; their total forces are exact sums, so the
//! lines of [`step`] give the same bits however blocks, workers and threads are cut.

mod assembly;
mod bodies;
mod ghosts;
mod held_block;
mod image;
mod plan;
mod report;
mod sharing;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

use crate::{
    contact::Settings,
    copy_index::CopyIndex,
    element::{ElementVote, Step},
    erosion::Eroding,
    exact::Quantum,
    lanes::Width,
    load::face,
    nodes::{Advance, Nodes, share_before},
    setup::Setup,
    spin,
    vote::{Gone, Quanta, Vote},
    wall::{self, Pose, WallVote},
};

pub use assembly::Subdomain;
use bodies::Held;
use ghosts::{Ghosts, HeldContact};
use held_block::{HeldBlock, each};
pub use plan::{Ghost, Neighbour, Plan};
use sharing::{Exchange, Groups};

/// The time of a cycle, its steps, and the quantum of its forces.
#[derive(Clone, Copy, Debug)]
pub struct Interval {
    /// `t_n` (time).
    pub time: f64,
    /// `dt_{n-1}`, which led to `x_n` (time).
    pub dt_previous: f64,
    /// `dt_n`, which leads to `x_{n+1}` (time).
    pub dt: f64,
    /// Quantum of forces, which an order may have made coarser.
    pub quantum: Quantum,
}

/// One cycle from `x_n` to `x_{n+1}`: the documented steps, one line each. A worker's session does them task by task, because
/// messages travel between them; whoever computes alone calls this.
///
/// `exchange` makes totals of the partial forces, between the forces of all elements and integration. Alone, they are the totals.
///
/// # Errors
/// As [`Domain::integrate`].
pub fn step(
    domain: &mut Domain,
    now: &Interval,
    free_walls: &[Pose],
    exchange: impl FnOnce(&Domain, Vec<f64>) -> Vec<f64>,
    meter: &dyn Meter,
) -> Result<Vote, String> {
    domain.begin(now.quantum, now.time);
    domain.contact(now.dt_previous, meter);
    domain.elements(Sets::Border, now.dt_previous, meter);
    let partials = domain.partials(meter);
    domain.elements(Sets::Interior, now.dt_previous, meter);
    let totals = exchange(domain, partials);
    domain.integrate(&totals, now.dt_previous, now.dt, free_walls, meter)
}

/// Measures the work of compute threads; the physics knows no clock of its own.
pub trait Meter: Sync {
    /// A mark on the calling thread.
    fn start(&self) -> u64;
    /// Books what the calling thread did since the mark.
    fn stop(&self, mark: u64, contact: bool);
}

/// Which element sets a pass computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Sets {
    /// Those that touch nodes of the exchange.
    Border,
    Interior,
    All,
}

/// How much a domain holds under the plan in force: what its steps cost is in proportion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Load {
    /// Elements that are computed before partial forces travel.
    pub border: u64,
    /// Elements that are computed while they travel.
    pub interior: u64,
    /// Nodes that are integrated, copies and ghosts included.
    pub nodes: u64,
    /// Node-face pairs that are looked at each cycle.
    pub pairs: u64,
}

/// No index.
const NONE: u32 = u32::MAX;

/// Everything a worker computes on.
pub struct Domain {
    setup: Setup,
    n_parts: usize,
    quanta: Quanta,
    width: Width,
    held_blocks: Vec<HeldBlock>,
    ghosts: Ghosts,
    contact: Option<HeldContact>,
    /// Whether nodes turn anywhere in the run.
    moments: bool,
    exchange: Exchange,
    groups: Groups,
    bodies: Vec<Held>,
    /// Pushes on bodies travel: there are other workers.
    sends_pushes: bool,
    copy_index: CopyIndex,
    gather: Vec<(u32, u32)>,
    gauges: Vec<(u32, u32, u32)>,
    /// Positions and velocities of their nodes before integration; empty outside of it.
    gauges_before: Vec<[f64; 6]>,
    /// Element gauges: gauge, block, local element.
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
    /// Takes what ghosts give walls, which their owners book.
    unbooked: Vec<WallVote>,
}

impl Domain {
    /// A cycle begins at `time` with this quantum of forces, which an order may have made coarser.
    pub fn begin(&mut self, quantum: Quantum, time: f64) {
        self.quanta.force = quantum;
        self.time = time;
    }

    /// Contact forces of the work units at `x_n` and loads on faces; `dt` is `dt_{n-1}`.
    pub fn contact(&mut self, dt: f64, meter: &dyn Meter) {
        let mark = meter.start();
        if let Some(packed) = &mut self.contact {
            packed.pack(&self.held_blocks, &self.ghosts);
            packed.contact.history.cycle = self.cycle;
            for f in &mut packed.f {
                f.fill(0.0);
            }
            let vote = packed.contact.forces(
                &packed.x,
                &packed.v,
                dt,
                self.quanta.force,
                self.quanta.energy,
                &mut packed.f,
            );
            self.vote.add_contact(&vote);
            self.vote.contact_energies.merge(packed.contact.energies());
            if !self.watched_pairs.is_empty() {
                self.vote.add_contacts(&packed.contact.pair_votes());
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
        each(&mut self.held_blocks, |held_block| {
            let mark = meter.start();
            held_block.face_vote =
                face::apply(&mut held_block.faces, &mut held_block.block, loads, control, time, quantum);
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
            force_quantum: self.quanta.force,
            energy_quantum: self.quanta.energy,
            arm: self.quanta.arm,
        };
        let (materials, width, cycle) = (&self.setup.materials, self.width, self.cycle);
        let work = |held_block: &mut HeldBlock| {
            if held_block.is_rigid {
                return;
            }
            let mark = meter.start();
            let material = &materials[held_block.block.material as usize];
            if let Some(eroding) = held_block.eroding.as_mut().filter(|_| dt > 0.0) {
                if sets != Sets::Interior {
                    eroding.watch(&mut held_block.block, material, &held_block.border, (&step, cycle), width);
                }
                if sets != Sets::Border {
                    eroding.watch(
                        &mut held_block.block,
                        material,
                        &held_block.interior,
                        (&step, cycle),
                        width,
                    );
                }
            }
            if sets != Sets::Interior {
                held_block.vote = ElementVote::default();
                held_block.block.compute(material, &held_block.border, &step, width, &mut held_block.vote);
            }
            if sets != Sets::Border {
                held_block.block.compute(material, &held_block.interior, &step, width, &mut held_block.vote);
            }
            meter.stop(mark, false);
        };
        each(&mut self.held_blocks, work);
    }

    /// Partial forces of the nodes of the exchange, three numbers each, with moments six, with what contact keeps of nodes more, and behind
    /// them pushes on rigid bodies.
    pub fn partials(&mut self, meter: &dyn Meter) -> Vec<f64> {
        let mark = meter.start();
        self.push_bodies();
        let mut out = Vec::with_capacity(self.stride() * self.exchange.len() + self.n_pushes());
        let numbers = (self.moments, self.n_history());
        self.exchange.pack(&self.held_blocks, self.contact.as_ref(), numbers, &mut out);
        self.pack_pushes(&mut out);
        meter.stop(mark, false);
        out
    }

    /// Numbers that travel for each entry of the exchange.
    fn stride(&self) -> usize {
        (if self.moments { 6 } else { 3 }) + self.n_history()
    }

    /// Numbers that contact keeps of each node.
    fn n_history(&self) -> usize {
        self.setup.contact.as_ref().map_or(0, Settings::n_history)
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
        let numbers = (self.moments, self.n_history());
        self.exchange.put(totals, numbers, &mut self.held_blocks, &mut self.ghosts);
        let of_contact = self.contact.as_ref().map(|contact| &contact.f);
        self.groups.add_up(&mut self.held_blocks, of_contact, self.moments);
        if let Some(packed) = &self.contact {
            packed.keep(&mut self.held_blocks);
        }
        meter.stop(mark, false);
        self.move_bodies(pushes, dt_previous, dt);
        self.gauges_before = self.read_gauges();
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
        each(&mut self.held_blocks, |held_block| {
            let mark = meter.start();
            let block = &mut held_block.block;
            let mut nodes = Nodes {
                x: &mut block.x,
                v: &mut block.v,
                f: &mut block.f,
                mass: &block.mass,
                constraint: &block.constraint,
                sets: &held_block.sets,
                reference: &held_block.reference,
                walls: &mut held_block.walls,
            };
            held_block.booked = advance.run(&mut nodes, width);
            if let Some(turning) = &mut block.turning {
                let (kinetic, external) =
                    spin::advance(&advance, turning, &block.constraint, &held_block.sets);
                held_block.booked.kinetic += kinetic;
                held_block.booked.external.merge(external);
            }
            if !held_block.faces.is_empty() {
                let half_steps = 0.5 * (dt_previous + dt);
                let work = face::work(&held_block.faces, block, half_steps, advance.quanta.energy);
                held_block.booked.external.merge(work);
            }
            if dt_previous == 0.0 {
                held_block.booked.external.put_off();
            }
            if held_block.eroding.as_mut().is_some_and(Eroding::take_change) {
                // Loads leave with the faces of eroded elements.
                held_block.leave_out_dead();
                if !held_block.faces.is_empty() {
                    let material = &setup.materials[held_block.block.material as usize];
                    held_block.faces = face::faces_of(&held_block.block, &setup.loads, material);
                }
            }
            meter.stop(mark, false);
        });
        let ghosts = &mut self.ghosts;
        let mut nodes = Nodes {
            x: &mut ghosts.x,
            v: &mut ghosts.v,
            f: &mut ghosts.f,
            mass: &ghosts.mass,
            constraint: &ghosts.constraint,
            sets: &ghosts.sets,
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
        Ok(self.finish_vote(share_before(dt_previous, dt)))
    }
}
