//! The springs of a block. They are few and their arithmetic is short, so they are computed one at a time.

use std::mem::take;

use super::{
    DAMPED, FORCE, N_OWN, PLASTIC, Plastic, RATES, SLIP, STIFF, Spring, drawn_on, longest_step, norm, rate,
};
use crate::{
    element::{
        ElementVote, Fault, Step,
        group::{Call, ElementArrays, Group, all_alive, living, slots_of_bars},
        place::Nodal,
    },
    flip::Target,
    lanes::SET,
    piece::Piece,
    spin::Turning,
    state::{N_FIELDS, field},
};

/// Arrays are by local element.
pub(crate) struct Springs {
    n_nodes: usize,
    bars: Vec<[u32; 2]>,
    spring: Spring,
    /// [`Elastic::stiffness`](super::Elastic).
    stiffness: f64,
    fields: [Vec<f64>; N_FIELDS],
    own: Vec<Vec<f64>>,
    /// Length at time zero, which stands for the volume.
    initial_length: Vec<f64>,
    alive: Vec<u8>,
    elements: Vec<u32>,
}

impl Springs {
    /// The elements of a piece, whose arrays they take.
    ///
    /// # Panics
    /// If the piece has not the arrays of springs.
    pub fn of(piece: &mut Piece, bars: Vec<[u32; 2]>, spring: Spring) -> Self {
        assert!(piece.own.len() == N_OWN, "{} arrays of springs, expected {N_OWN}", piece.own.len());
        Self {
            n_nodes: piece.nodes.len(),
            fields: take(&mut piece.fields),
            own: take(&mut piece.own),
            initial_length: take(&mut piece.initial_volume),
            alive: all_alive(bars.len()),
            elements: take(&mut piece.elements),
            stiffness: spring.elastic.stiffness(),
            bars,
            spring,
        }
    }

    /// Force, state and vote of one element.
    fn one(&mut self, e: usize, nodes: &mut Nodal<'_>, step: &Step, vote: &mut ElementVote) {
        let [a, b] = self.bars[e].map(|n| n as usize);
        let along: [f64; 3] = std::array::from_fn(|axis| nodes.x[axis][b] - nodes.x[axis][a]);
        let apart: [f64; 3] = std::array::from_fn(|axis| nodes.v[axis][b] - nodes.v[axis][a]);
        let along_before: [f64; 3] = std::array::from_fn(|axis| (-step.dt).mul_add(apart[axis], along[axis]));
        let (length, length_before) = (norm(along), norm(along_before));
        let initial = self.initial_length[e];
        let elongation = length - initial + self.spring.offset;
        let mut plastic = Plastic { elongation: self.own[PLASTIC][e], slip: self.own[SLIP][e] };
        let elastic = self.spring.elastic.force(elongation, &mut plastic);
        // The velocities are those of half a step ago.
        let rate = rate(along, apart);
        let before = RATES.map(|own| self.own[own][e]);
        let force = elastic + self.spring.damper.force(drawn_on(rate, before));
        let mut energy = self.fields[field::ENERGY][e];
        if step.dt > 0.0 {
            let mean = 0.5 * (self.own[FORCE][e] + force);
            energy = mean.mul_add((length - length_before) / initial, energy);
        }
        if !(force.is_finite() && length > 0.0 && energy.is_finite()) {
            vote.offer_fault(Fault { element: self.elements[e], volume: length });
            return;
        }
        for axis in 0..3 {
            let component = force * along[axis] / length;
            vote.force_bound = vote.force_bound.max(component.abs());
            let component = step.force_quantum.round(component);
            nodes.f[axis][a] += component;
            nodes.f[axis][b] -= component;
        }
        // Across itself a spring is as stiff as its force over its length.
        let across = force.abs() / length;
        let stiffer =
            if across > self.stiffness && self.stiffness > 0.0 { across / self.stiffness } else { 1.0 };
        let limit = longest_step(stiffer * self.own[STIFF][e], self.own[DAMPED][e]);
        vote.offer_courant(limit, self.elements[e]);
        vote.internal += step.energy_quantum.round(energy * initial);
        if step.dt > 0.0 {
            self.own[FORCE][e] = force;
            [self.own[RATES[0]][e], self.own[RATES[1]][e]] = [rate, before[0]];
            self.own[PLASTIC][e] = plastic.elongation;
            self.own[SLIP][e] = plastic.slip;
            self.fields[field::ENERGY][e] = energy;
            self.fields[field::PLASTIC_STRAIN][e] = plastic.slip / initial;
            self.fields[field::RELATIVE_VOLUME][e] = length / initial;
        }
    }
}

impl Group for Springs {
    slots_of_bars!();

    fn compute(
        &mut self,
        mut nodes: Nodal<'_>,
        _turning: Option<&mut Turning>,
        call: &Call<'_>,
        vote: &mut ElementVote,
    ) {
        let alive = take(&mut self.alive);
        for e in living(&alive, call.sets) {
            self.one(e, &mut nodes, call.step, vote);
        }
        self.alive = alive;
    }

    fn element(&self, element: usize, _x: &[Vec<f64>; 3]) -> [f64; N_FIELDS] {
        self.fields.each_ref().map(|values| values[element])
    }

    fn image(&self, _x: &[Vec<f64>; 3]) -> ElementArrays {
        ElementArrays {
            initial_volume: self.initial_length.clone(),
            fields: self.fields.clone(),
            own: self.own.clone(),
            history: Vec::new(),
        }
    }

    fn into_image(self: Box<Self>, _x: &[Vec<f64>; 3]) -> ElementArrays {
        ElementArrays {
            initial_volume: self.initial_length,
            fields: self.fields,
            own: self.own,
            history: Vec::new(),
        }
    }

    fn visit(&self, visit: &mut dyn FnMut(f64)) {
        for values in self.fields.iter().chain(&self.own) {
            values.iter().for_each(|&value| visit(value));
        }
    }

    fn take_out(&mut self, slot: usize) -> (u32, f64) {
        self.alive[slot / SET] &= !(1 << (slot % SET));
        (self.elements[slot], self.fields[field::ENERGY][slot] * self.initial_length[slot])
    }

    fn first_stress(&mut self) -> Option<&mut f64> {
        self.own[FORCE].first_mut()
    }

    fn numbers_mut(&mut self, target: Target) -> Vec<&mut [f64]> {
        let (state, constants) = self.own.split_at_mut(STIFF);
        match target {
            Target::Constants => {
                let lengths = std::iter::once(&mut self.initial_length);
                lengths.chain(constants).map(Vec::as_mut_slice).collect()
            }
            Target::Elements => self.fields.iter_mut().chain(state).map(Vec::as_mut_slice).collect(),
            _ => Vec::new(),
        }
    }
}
