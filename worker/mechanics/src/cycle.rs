//! One cycle of a worker.
//!
//! A [`Domain`] is all that a worker holds: blocks with their own copies of their nodes, the contact nodes and
//! faces of its work units, and *ghosts* (contact nodes that no block here has). Which nodes have several
//! copies, here or on other workers, is said by a [`Plan`]; their total forces are exact sums, so the
//! lines of [`step`] give the same bits however blocks, workers and threads are cut.

mod assembly;
mod bodies;
mod deal;
mod ghosts;
mod held_block;
mod image;
mod meter;
mod plan;
mod report;
mod sharing;
pub mod standing;
#[cfg(test)]
mod tests;
mod touch;

use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use crate::{
    contact::Settings,
    copy_index::CopyIndex,
    cross_section,
    element::{ElementVote, Step},
    exact::Quanta,
    joint::{JointVote, Mechanism},
    lanes::Width,
    load::face,
    nodes::Advance,
    setup::Setup,
    time_step::TimeStep,
    vote::{Gone, Vote},
    wall::{self, Pose, WallVote},
};

pub use assembly::Subdomain;
use bodies::{Bodies, Held};
use ghosts::Ghosts;
use held_block::{HeldBlock, Order};
pub use meter::{Meter, Unmeasured};
pub use plan::{Ghost, Handed, Neighbour, Plan};
use sharing::{Exchange, Groups, Holders, Numbers};
pub use standing::{Added, Standing};
use touch::HeldContact;

/// The time of a cycle, its steps, and the quanta of its sums.
#[derive(Clone, Copy, Debug)]
pub struct Interval {
    /// `t_n` (time).
    pub time: f64,
    /// `dt_{n-1}`, which led to `x_n` (time).
    pub dt_previous: f64,
    /// `dt_n`, which leads to `x_{n+1}` (time).
    pub dt: f64,
    /// Quanta of the sums, which an order may have made coarser.
    pub quanta: Quanta,
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
    domain.begin(now.quanta, now.time);
    domain.contact(now.dt_previous, meter);
    domain.elements(Sets::Border, now.dt_previous, meter);
    let partials = domain.partials(meter);
    domain.elements(Sets::Interior, now.dt_previous, meter);
    let totals = exchange(domain, partials);
    domain.integrate(&totals, now.dt_previous, now.dt, free_walls, meter)
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
    order: Order,
    ghosts: Ghosts,
    /// Shares of the contact, one for each task of a thread; none without any.
    contact: Vec<HeldContact>,
    /// Whether nodes turn anywhere in the run.
    moments: bool,
    exchange: Exchange,
    groups: Groups,
    /// Whether any element touches a node of the exchange.
    has_border: bool,
    bodies: Vec<Held>,
    mechanism: Mechanism,
    joint_votes: Vec<JointVote>,
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
    /// Cycles between two with a row of the history.
    row_cycles: u32,
    /// They are read in this cycle.
    reads_sections: bool,
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
    /// A cycle begins at `time` with these quanta of its sums, which an order may have made coarser.
    pub fn begin(&mut self, quanta: Quanta, time: f64) {
        self.quanta = quanta;
        self.time = time;
    }

    /// Adds the loads on faces to the forces of the blocks; `dt` is `dt_{n-1}`.
    fn load_faces(&mut self, dt: f64, meter: &dyn Meter) {
        if self.setup.loads.surfaces.is_empty() {
            return;
        }
        let Setup { loads, control, .. } = &self.setup;
        let (time, quantum) = (self.time, self.quanta.force);
        self.order.deal(&mut self.held_blocks, meter, |held_block| {
            held_block.face_vote = face::apply(
                &mut held_block.faces,
                &mut held_block.block,
                loads,
                control,
                (time, dt),
                quantum,
            );
        });
    }

    /// Forces of element sets at `x_n`, added to forces that integration has cleared; `dt` is `dt_{n-1}`.
    pub fn elements(&mut self, sets: Sets, dt: f64, meter: &dyn Meter) {
        self.reads_sections =
            cross_section::are_due(self.row_cycles, &self.setup.control, (self.cycle, self.time, dt));
        if sets == Sets::Border && !self.has_border {
            self.held_blocks.iter_mut().for_each(|held_block| held_block.vote = ElementVote::default());
            return;
        }
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
        let reads_sections = self.reads_sections;
        let work = |held_block: &mut HeldBlock| {
            if held_block.is_rigid {
                return;
            }
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
                held_block.compute(true, material, (&step, width), reads_sections);
            }
            if sets != Sets::Border {
                held_block.compute(false, material, (&step, width), reads_sections);
            }
        };
        self.order.deal(&mut self.held_blocks, meter, work);
    }

    /// Partial forces of the nodes of the exchange, three numbers each, with moments six, with what contact keeps of nodes more, and behind
    /// them pushes on rigid bodies.
    pub fn partials(&mut self, meter: &dyn Meter) -> Vec<f64> {
        self.push_bodies(meter);
        let (numbers, n) = (self.numbers(), self.exchange.len());
        let mut out = Vec::with_capacity(numbers.stride() * n + self.n_pushes());
        out.resize(numbers.stride() * n, 0.0);
        let holders = Holders { blocks: &self.held_blocks, contact: &self.contact };
        self.exchange.pack(holders, numbers, &mut out, meter);
        self.pack_pushes(&mut out);
        out
    }

    /// Numbers of a node that has several holders.
    fn numbers(&self) -> Numbers {
        Numbers { moments: self.moments, n_history: self.n_history() }
    }

    /// Numbers that travel for each entry of the exchange.
    fn stride(&self) -> usize {
        self.numbers().stride()
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
        let (totals, pushes) = totals.split_at(totals.len() - n_pushes);
        let numbers = self.numbers();
        let holders = Holders { blocks: &self.held_blocks, contact: &self.contact };
        self.groups.add_up(holders, numbers, meter);
        self.move_bodies(pushes, dt_previous, dt);
        self.gauges_before = self.read_gauges();
        let setup = &self.setup;
        let (time, cycle, loads, quanta) = (self.time, self.cycle, &setup.loads, self.quanta);
        let step = TimeStep { dt_previous, dt, time, cycle, loads, quanta };
        let share_before = step.share_before();
        wall::poses(&setup.walls, &setup.loads.curves, self.time, dt, free_walls, &mut self.poses);
        let advance =
            Advance { step, constraints: &setup.constraints, walls: &setup.walls, poses: &self.poses };
        let (width, bodies) = (self.width, Bodies { held: &self.bodies, of: &setup.bodies });
        let (of_groups, contact) = (self.groups.totals(), &self.contact);
        let of_block = |held_block: &mut HeldBlock| {
            held_block.take_totals(totals, of_groups, contact, numbers);
            held_block.lead(bodies, &advance);
            held_block.integrate(&advance, setup, width);
        };
        let (ghosts, unbooked) = (&mut self.ghosts, &mut self.unbooked);
        let of_ghosts = || {
            ghosts.take_totals(totals, numbers);
            ghosts.lead(bodies, &advance);
            ghosts.integrate(&advance, unbooked, width);
        };
        // Whoever takes the first block takes them along.
        let of_ghosts = Mutex::new(Some(of_ghosts));
        let take_ghosts = || {
            let taken = of_ghosts.lock().unwrap_or_else(PoisonError::into_inner).take();
            if let Some(mut of_ghosts) = taken {
                of_ghosts();
            }
        };
        self.order.deal(&mut self.held_blocks, meter, |held_block| {
            take_ghosts();
            of_block(held_block);
        });
        if self.held_blocks.is_empty() {
            let mark = meter.start();
            take_ghosts();
            meter.stop(mark, false);
        }
        if std::mem::take(&mut self.surface_ends) {
            self.vote.released = Some(self.spring_energies(dt, meter));
        }
        self.cycle += 1;
        Ok(self.finish_vote(share_before))
    }
}
