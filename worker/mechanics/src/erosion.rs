//! Erosion: which elements leave a run, and what is left of them.
//!
//! [`Criteria`] say by part when an element is taken out. An element that meets one at the start of its pass of cycle `n` gives
//! no force in that cycle nor in any after it, has no vote, and keeps its last state; its internal energy is booked as
//! eroded in the vote of `n`, with the work that its last forces did in the second half of the step to `n`. Its faces stay on the
//! contact surface until that vote has been answered: from cycle `n + `[`SURFACE_LAG`] on they are gone and the faces that they hid
//! are outside. So neither cycle depends on how a run is cut, sorted or timed.
//!
//! Mass stays at the nodes. A node without any element left is *freed*: it flies on and keeps colliding, or it leaves the
//! run too, with its mass, momentum and kinetic energy booked, as [`Erosion::retain_inertia`] says.
//!
//! Strains of solids are those of the middle of an element, and effective ones: `sqrt(2/3 e:e)`, which is 1 where a bar of constant
//! volume is `e` = 2.718 times as long as at first.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::{
    block::Block,
    element::{Step, group::Scanned, modes::modes_of},
    lanes::{Width, scalar::Scalar},
    material::Material,
    state::{ALIVE, field},
    vectors::{cross, dot},
};

pub(crate) mod criteria;
mod limits;
mod scan;

pub use criteria::{Criteria, PieceErosion};
use limits::{Shape, Stress, Volume};
use scan::Scan;

/// Limit of a geometric strain where the deck gives none.
pub const GEOMETRIC_STRAIN: f64 = 1.5;

/// Cycles from that in which an element erodes to the first on the new surface: its vote comes with the next frame, the orders
/// that answer it act two cycles later, where positions travel, and the sort of those acts in the cycle after.
pub const SURFACE_LAG: u64 = 4;

/// What erodes in a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Erosion {
    /// Whether nodes that have lost all their elements keep their inertia and stay in the run.
    pub retain_inertia: bool,
    /// Criteria by part; none for a part that does not erode. Empty if nothing does.
    pub parts: Vec<Option<Criteria>>,
}

impl Default for Erosion {
    fn default() -> Self {
        Self { retain_inertia: true, parts: Vec::new() }
    }
}

impl Erosion {
    /// Whether any part erodes.
    pub fn is_on(&self) -> bool {
        self.parts.iter().any(Option::is_some)
    }

    /// Whether any part erodes by its incremental strain, which is then part of the state.
    pub fn counts_strain(&self) -> bool {
        self.parts.iter().flatten().any(|criteria| criteria.incremental_strain.is_some())
    }

    pub fn of_part(&self, part: usize) -> Option<&Criteria> {
        self.parts.get(part).and_then(Option::as_ref)
    }
}

/// What the elements of a block answer to erosion in a cycle.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Casualties {
    /// Global indices of the elements that eroded.
    pub elements: Vec<u32>,
    /// Their internal energy, and what they took of their nodes since, an exact sum.
    pub internal: f64,
}

/// The erosion of one block. Arrays are by slot.
pub(crate) struct Eroding {
    criteria: Criteria,
    /// Square of the sound speed of the material at rest.
    sound_square: f64,
    /// Safety factor over the limit of the time step: the frequency above which an element erodes.
    frequency: f64,
    eroded: Vec<u64>,
    strain: Vec<f64>,
    /// Inverse of the Jacobian at time zero, by rows, in units of the modes; empty without an instantaneous strain.
    inverse: [Vec<f64>; 9],
    /// Of this cycle.
    eroded_now: Casualties,
    /// Whether any element has eroded since [`Eroding::take_change`].
    changed: bool,
}

impl Eroding {
    /// Incremental strain by slot, for tests that flip bits in it.
    pub(crate) fn strain_mut(&mut self) -> &mut [f64] {
        &mut self.strain
    }

    /// The erosion of a block whose piece carried `state`; elements that have eroded are taken out of the block. A part without
    /// criteria has nothing to watch, and none of its elements has eroded.
    pub(crate) fn new(
        criteria: &Criteria,
        state: Option<&PieceErosion>,
        block: &mut Block,
        material: &Material,
        safety_factor: f64,
    ) -> Self {
        let n_slots = block.n_slots();
        // Whether the shape of now is compared with the initial one.
        let measures_shape = Shape::of(criteria).is_some();
        let mut eroding = Self {
            criteria: *criteria,
            sound_square: material.wave_modulus() / material.density,
            frequency: criteria.time_step.map_or(f64::INFINITY, |limit| safety_factor / limit),
            eroded: vec![ALIVE; n_slots],
            strain: vec![0.0; if criteria.incremental_strain.is_some() { n_slots } else { 0 }],
            inverse: std::array::from_fn(|_| vec![0.0; if measures_shape { n_slots } else { 0 }]),
            eroded_now: Casualties::default(),
            changed: false,
        };
        let Some(state) = state else { return eroding };
        for (e, &cycle) in state.eroded.iter().enumerate().take(block.n_elements()) {
            let slot = block.slot(e);
            eroding.eroded[slot] = cycle;
            if cycle != ALIVE {
                block.take_out(slot);
            }
            if let (Some(to), Some(from)) = (eroding.strain.get_mut(slot), state.strain.get(e)) {
                *to = *from;
            }
            if measures_shape && state.initial.len() == block.nodes.len() {
                let corners = block.corners(e).map(|n| state.initial[n as usize]);
                let axis = |a: usize| modes_of(corners.map(|x| Scalar(x[a]))).map(|mode| mode.0);
                let [x, y, z] = [0, 1, 2].map(|a| {
                    let [xi, eta, zeta, ..] = axis(a);
                    [xi, eta, zeta]
                });
                // Columns of the inverse of the matrix with these rows, times its determinant.
                let adjugate = [cross(y, z), cross(z, x), cross(x, y)];
                let determinant = dot(x, adjugate[0]);
                for (i, row) in eroding.inverse.iter_mut().enumerate() {
                    // An element without volume does not pass the checks of a run.
                    row[slot] = if determinant == 0.0 { 0.0 } else { adjugate[i % 3][i / 3] / determinant };
                }
            }
        }
        eroding
    }

    /// Takes the elements of `sets` that meet a criterion out of the block, before their forces of `cycle`.
    pub(crate) fn watch(
        &mut self,
        block: &mut Block,
        material: &Material,
        sets: &[Range<u32>],
        (step, cycle): (&Step, u64),
        width: Width,
    ) {
        let found = match block.scanned() {
            Some(scanned) => self.scan(scanned, block, sets, step, width),
            None => block.met(&self.criteria, sets),
        };
        for slot in found.into_iter().map(|slot| slot as usize) {
            let since = block.half_work(slot, step.dt, material);
            let (element, internal) = block.take_out(slot);
            self.eroded[slot] = cycle;
            self.eroded_now.elements.push(element);
            self.eroded_now.internal += step.energy_quantum.round(internal + since);
            self.changed = true;
        }
    }

    /// The slots of `sets` that a pass over the nodes and states of hexahedra finds.
    fn scan(
        &mut self,
        Scanned { layout, reach, alive, fields }: Scanned<'_>,
        block: &Block,
        sets: &[Range<u32>],
        step: &Step,
        width: Width,
    ) -> Vec<u32> {
        let Self { criteria, strain, inverse, .. } = self;
        let mut scan = Scan {
            layout,
            x: block.x.each_ref().map(Vec::as_slice),
            v: block.v.each_ref().map(Vec::as_slice),
            alive,
            fields: [
                (field::PLASTIC_STRAIN, criteria.plastic_strain),
                (field::DAMAGE, criteria.failure.then_some(1.0)),
                (field::TEMPERATURE, criteria.temperature),
            ]
            .map(|(field, limit)| limit.map(|limit| (fields[field], limit))),
            stress: Stress::of(criteria).map(|limits| {
                let stress = [field::SXX, field::SYY, field::SXY, field::SYZ, field::SZX, field::PRESSURE];
                (stress.map(|field| fields[field]), limits)
            }),
            volume: Volume::of(criteria).map(|limits| (fields[field::RELATIVE_VOLUME], limits)),
            shape: Shape::of(criteria).map(|limits| (&*inverse, limits)),
            strain: criteria.incremental_strain.map(|limit| (strain.as_mut_slice(), limit)),
            step: criteria.time_step.map(|_| (self.sound_square, self.frequency)),
            dt: step.dt,
        };
        scan::run(&mut scan, sets, reach, width)
    }

    /// What eroded since the last call.
    pub(crate) fn take_casualties(&mut self) -> Casualties {
        std::mem::take(&mut self.eroded_now)
    }

    /// Whether anything has eroded since the last call.
    pub(crate) fn take_change(&mut self) -> bool {
        std::mem::take(&mut self.changed)
    }

    /// The state, by local element, for a state.
    pub(crate) fn state(&self, block: &Block) -> PieceErosion {
        let n = block.n_elements();
        let strain = if self.strain.is_empty() { 0 } else { n };
        PieceErosion {
            eroded: (0..n).map(|e| self.eroded[block.slot(e)]).collect(),
            strain: (0..strain).map(|e| self.strain[block.slot(e)]).collect(),
            initial: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests;
