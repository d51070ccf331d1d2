//! Everything a cycle needs beside the mesh and the state: small, sent whole to every worker.

use serde::{Deserialize, Serialize};

use crate::{
    burn::Detonation,
    constraint::Constraint,
    contact,
    erosion::Erosion,
    joint::Joint,
    load::Loads,
    material::Material,
    rigid::{Body, switch::Switch},
    wall::RigidWall,
};

/// The rules of a run. Equal on every worker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    /// Materials, indexed by [`crate::mesh::Part::material`].
    pub materials: Vec<Material>,
    /// Time step, viscosity, ends.
    pub control: Control,
    /// Contact, or none.
    pub contact: Option<contact::Settings>,
    /// Node constraints, indexed by [`crate::state::GlobalState::constraint`]; entry 0 is "free".
    pub constraints: Vec<Constraint>,
    pub walls: Vec<RigidWall>,
    /// Rigid bodies.
    pub bodies: Vec<Body>,
    /// Parts that are rigid for a time.
    pub switches: Vec<Switch>,
    /// What holds them together.
    pub joints: Vec<Joint>,
    /// Where explosives are lit.
    pub detonations: Vec<Detonation>,
    /// Curves, forces, gravity, loads on faces, relaxation.
    pub loads: Loads,
    /// Which parts erode and when.
    pub erosion: Erosion,
}

impl Setup {
    /// How many walls and supports book what nodes give them: supports stand behind the walls, by their number.
    pub fn n_holders(&self) -> usize {
        let supports = self.constraints.iter().flat_map(|held| held.supports).max().unwrap_or(0);
        self.walls.len() + usize::from(supports)
    }
}

/// Time step, damping and ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Control {
    /// Run until this time (time).
    pub end_time: f64,
    /// Run at most this many cycles.
    pub end_cycle: u64,
    /// Factor on the Courant limit; AUTODYN's default 0.6666 keeps isolated elements stable.
    pub safety_factor: f64,
    /// Greatest growth of the time step from one cycle to the next; 1.05.
    pub growth: f64,
    /// Energy that may appear or vanish, over the scale of the problem, before the run is stopped; 0.5.
    pub energy_error: f64,
    /// Least time step (time) before the run is stopped; 0 stands for 1e-4 of the first.
    pub time_step_floor: f64,
    /// Linear artificial viscosity coefficient; default 0.2.
    pub linear_viscosity: f64,
    /// Quadratic artificial viscosity coefficient; default 1.0 (enters squared).
    pub quadratic_viscosity: f64,
    /// Cycles from the trigger of a sort to the cycle it acts at.
    pub sort_lag: u32,
    /// Longest distance between plan boundaries (cycles).
    pub plan_interval: u32,
}
