//! The beams of a block, one at a time.

use std::{mem::take, ops::Range};

use super::{
    AXIAL, ELEMENT, ENERGY, FIBRE, PLASTIC_STRAIN, STATIONS, TEMPERATURE, fibre::Fibre, scaled,
    section::BeamSection,
};
use crate::{
    element::{
        ElementVote, Fault, Step,
        group::{Call, ElementArrays, Group, all_alive, living, slots_of_bars},
        place::Nodal,
    },
    erosion::criteria::Criteria,
    flip::Target,
    lanes::SET,
    material::Material,
    piece::Piece,
    spin::Turning,
    state::{N_FIELDS, field},
    strength::plane_stress::PlaneLaw,
    vectors::{cross, dot},
};

/// The beams of a block; arrays are by local element.
pub(crate) struct Beams {
    n_nodes: usize,
    bars: Vec<[u32; 2]>,
    initial_volume: Vec<f64>,
    /// See [`ELEMENT`] and [`FIBRE`]: of each station the fibres, in order.
    own: Vec<Vec<f64>>,
    alive: Vec<u8>,
    elements: Vec<u32>,
    density: f64,
    section: BeamSection,
    fibres: Vec<[f64; 3]>,
    law: PlaneLaw,
}

/// Lengths and axes of a beam at both ends and in the middle of a step.
struct Motion {
    length: f64,
    length_before: f64,
    /// At the end.
    axes: [[f64; 3]; 3],
    /// Change of length.
    drawn: f64,
    /// Twist of the second end against the first.
    twist: f64,
    /// Rotations of the ends against the line of the nodes, about `e2` and `e3`.
    turned: [[f64; 2]; 2],
}

/// About one axis: what the end rotations make of curvature and shear.
#[derive(Clone, Copy)]
struct Bending {
    /// `E I / L`.
    stiffness: f64,
    phi: f64,
}

impl Bending {
    /// Moments of the ends of an elastic beam by these rotations.
    fn moments(self, [a, b]: [f64; 2]) -> [f64; 2] {
        let Self { stiffness, phi } = self;
        let scale = stiffness / (1.0 + phi);
        [scale * ((4.0 + phi) * a + (2.0 - phi) * b), scale * ((2.0 - phi) * a + (4.0 + phi) * b)]
    }

    /// Curvature times length at a station.
    fn curvature(self, [a, b]: [f64; 2], place: f64) -> f64 {
        (b - a) + 3.0 * place * (a + b) / (1.0 + self.phi)
    }

    fn shear(self, [a, b]: [f64; 2]) -> f64 {
        0.5 * self.phi / (1.0 + self.phi) * (a + b)
    }
}

impl Beams {
    /// The elements of a piece, whose arrays they take.
    ///
    /// # Panics
    /// If beams cannot be of the material.
    pub fn of(piece: &mut Piece, bars: Vec<[u32; 2]>, section: &BeamSection, material: &Material) -> Self {
        let own = take(&mut piece.own);
        assert!(own.len() == section.n_fields(), "{} arrays of beams", own.len());
        let law = PlaneLaw::of(material).expect("the deck has checked the material");
        Self {
            n_nodes: piece.nodes.len(),
            own,
            initial_volume: take(&mut piece.initial_volume),
            alive: all_alive(bars.len()),
            elements: take(&mut piece.elements),
            density: material.density,
            section: *section,
            // An elastic beam knows its forces without fibres.
            fibres: if law.yields() { section.places() } else { Vec::new() },
            law,
            bars,
        }
    }

    /// About `e2` and about `e3`.
    fn bending(&self, initial_length: f64) -> [Bending; 2] {
        std::array::from_fn(|about| {
            let along = self.section.shear[1 - about];
            let stiffness = self.law.young * self.section.inertia[about] / initial_length;
            let flexible = self.law.shear() * along * initial_length;
            Bending { stiffness, phi: if along > 0.0 { 12.0 * stiffness / flexible } else { 0.0 } }
        })
    }

    /// How an element moved in the step; none where its line vanished or turned over.
    fn motion(&self, e: usize, nodes: &Nodal<'_>, turning: &Turning, dt: f64) -> Option<Motion> {
        let [a, b] = self.bars[e].map(|n| n as usize);
        let chord: [f64; 3] = std::array::from_fn(|i| nodes.x[i][b] - nodes.x[i][a]);
        let apart: [f64; 3] = std::array::from_fn(|i| nodes.v[i][b] - nodes.v[i][a]);
        let [wa, wb] = [a, b].map(|n| [0, 1, 2].map(|i| turning.w[i][n]));
        let at = |back: f64| -> ([f64; 3], f64) {
            let line: [f64; 3] = std::array::from_fn(|i| chord[i] - back * apart[i]);
            let length = dot(line, line).sqrt();
            (scaled(line, 1.0 / length), length)
        };
        let (e1, length) = at(0.0);
        let (before, length_before) = at(dt);
        let (middle, length_middle) = at(0.5 * dt);
        let e2_before = [0, 1, 2].map(|i| self.own[i][e]);
        let closing = 1.0 + dot(before, e1);
        let shortest = length.min(length_before).min(length_middle);
        if !(shortest > 0.0 && shortest.is_finite() && closing > 0.1) {
            return None;
        }
        // The least rotation from line to line, then half of the rolls of the nodes.
        let share = dot(e2_before, e1) / closing;
        let carried: [f64; 3] = std::array::from_fn(|i| e2_before[i] - share * (before[i] + e1[i]));
        let mean: [f64; 3] = std::array::from_fn(|i| 0.5 * (wa[i] + wb[i]));
        let half = 0.5 * dt * dot(mean, middle);
        let (cosine, sine) = ((1.0 - half * half) / (1.0 + half * half), 2.0 * half / (1.0 + half * half));
        let beside = cross(e1, carried);
        let normal = |to: [f64; 3], line: [f64; 3]| -> [f64; 3] {
            let share = dot(to, line);
            let flat: [f64; 3] = std::array::from_fn(|i| to[i] - share * line[i]);
            scaled(flat, 1.0 / dot(flat, flat).sqrt())
        };
        let e2 = normal(std::array::from_fn(|i| cosine * carried[i] + sine * beside[i]), e1);
        let e2_middle = normal(std::array::from_fn(|i| e2[i] + e2_before[i]), middle);
        let e3_middle = cross(middle, e2_middle);
        // The line turns about e2 by -(apart . e3) / length and about e3 by (apart . e2) / length.
        let line = [dot(apart, e3_middle) / length_middle, -dot(apart, e2_middle) / length_middle];
        let against = |w: [f64; 3], axis: [f64; 3], line: f64| dt * (dot(w, axis) + line);
        let spin: [f64; 3] = std::array::from_fn(|i| wb[i] - wa[i]);
        Some(Motion {
            length,
            length_before,
            axes: [e1, e2, cross(e1, e2)],
            drawn: length - length_before,
            twist: dt * dot(spin, middle),
            turned: [
                [wa, wb].map(|w| against(w, e2_middle, line[0])),
                [wa, wb].map(|w| against(w, e3_middle, line[1])),
            ],
        })
    }

    /// Axial force, torque, moments of the ends about `e2` and `e3` after the increments of a step.
    fn forces(&mut self, e: usize, motion: &Motion, initial_length: f64, dt: f64) -> [f64; 6] {
        let strain = 2.0 * motion.drawn / (motion.length + motion.length_before);
        let bending = self.bending(initial_length);
        if self.fibres.is_empty() {
            let old: [f64; 6] = std::array::from_fn(|i| self.own[AXIAL + i][e]);
            let [[ya, yb], [za, zb]] = [0, 1].map(|about| bending[about].moments(motion.turned[about]));
            let drawn = self.law.young * self.section.area * strain;
            let twisted = self.law.shear() * self.section.torsion / initial_length * motion.twist;
            let more = [drawn, twisted, ya, yb, za, zb];
            return std::array::from_fn(|i| old[i] + more[i]);
        }
        let polar = self.section.inertia[0] + self.section.inertia[1];
        // Of the strain of a fibre by twist and shear, so that the stiffness of the whole is that of the section.
        let warped = (self.section.torsion / polar).sqrt();
        let shared = self.section.shear.map(|shear| (shear / self.section.area).sqrt());
        // Rotation about e2 shears along e3, about e3 against e2.
        let slide = [-bending[1].shear(motion.turned[1]), bending[0].shear(motion.turned[0])];
        let rate_of_twist = motion.twist / initial_length;
        let (mut axial, mut torque) = (0.0, 0.0);
        let mut moments = [[0.0; 2]; 2];
        let mut sheared = [0.0; 2];
        for (station, (place, weight)) in STATIONS.into_iter().enumerate() {
            let curved =
                [0, 1].map(|about| bending[about].curvature(motion.turned[about], place) / initial_length);
            let mut bent = [0.0; 2];
            for (f, &[y, z, area]) in self.fibres.iter().enumerate() {
                let first = ELEMENT + (station * self.fibres.len() + f) * FIBRE;
                let own = &mut self.own[first..first + FIBRE];
                let mut fibre = Fibre {
                    stress: own[0][e],
                    shear: [own[1][e], own[2][e]],
                    plastic_strain: own[PLASTIC_STRAIN][e],
                    temperature: own[TEMPERATURE][e],
                };
                let slid = [
                    shared[0] * slide[0] - warped * z * rate_of_twist,
                    shared[1] * slide[1] + warped * y * rate_of_twist,
                ];
                fibre.update(&self.law, strain + z * curved[0] - y * curved[1], slid, dt);
                if self.section.breaks.is_some_and(|limit| fibre.plastic_strain >= limit) {
                    (fibre.stress, fibre.shear) = (0.0, [0.0; 2]);
                }
                let Fibre { stress, shear, plastic_strain, temperature } = fibre;
                for (array, value) in
                    own.iter_mut().zip([stress, shear[0], shear[1], plastic_strain, temperature])
                {
                    array[e] = value;
                }
                let area = area * weight;
                axial += area * stress;
                bent[0] += area * z * stress;
                bent[1] -= area * y * stress;
                torque += area * warped * (y * shear[1] - z * shear[0]);
                sheared[0] -= area * shared[0] * shear[0];
                sheared[1] += area * shared[1] * shear[1];
            }
            for about in 0..2 {
                let lever = 3.0 * place / (1.0 + bending[about].phi);
                moments[about][0] += bent[about] * (lever - 1.0);
                moments[about][1] += bent[about] * (lever + 1.0);
            }
        }
        for about in 0..2 {
            let phi = bending[about].phi;
            // About e2 the shear along e3.
            let half = 0.5 * initial_length * sheared[1 - about] * phi / (1.0 + phi);
            moments[about] = moments[about].map(|moment| moment + half);
        }
        let [[ya, yb], [za, zb]] = moments;
        [axial, torque, ya, yb, za, zb]
    }

    /// Forces, moments, state and vote of one element.
    fn one(
        &mut self,
        e: usize,
        nodes: &mut Nodal<'_>,
        turning: &mut Turning,
        step: &Step,
        vote: &mut ElementVote,
    ) {
        let [a, b] = self.bars[e].map(|n| n as usize);
        let volume = self.initial_volume[e];
        let initial_length = volume / self.section.area;
        let Some(motion) = self.motion(e, nodes, turning, step.dt) else {
            vote.offer_fault(Fault { element: self.elements[e], volume: 0.0 });
            return;
        };
        let old: [f64; 6] = std::array::from_fn(|i| self.own[AXIAL + i][e]);
        let mut energy = self.own[ENERGY][e];
        let mut new = old;
        if step.dt > 0.0 {
            new = self.forces(e, &motion, initial_length, step.dt);
            let [[ya, yb], [za, zb]] = motion.turned;
            let moved = [motion.drawn, motion.twist, ya, yb, za, zb];
            energy += (0..6).map(|i| 0.5 * (old[i] + new[i]) * moved[i]).sum::<f64>();
        }
        let length = motion.length;
        let finite = energy.is_finite() && new.iter().all(|force| force.is_finite());
        if !finite {
            vote.offer_fault(Fault { element: self.elements[e], volume: length * self.section.area });
            return;
        }
        let [axial, torque, ya, yb, za, zb] = new;
        let [e1, e2, e3] = motion.axes;
        let pull = [axial, -(za + zb) / length, (ya + yb) / length];
        let moment_quantum = step.force_quantum.times(step.arm);
        for i in 0..3 {
            let force = pull[0] * e1[i] + pull[1] * e2[i] + pull[2] * e3[i];
            vote.force_bound = vote.force_bound.max(force.abs());
            let force = step.force_quantum.round(force);
            nodes.f[i][a] += force;
            nodes.f[i][b] -= force;
            for (node, [along, y, z]) in [(a, [-torque, ya, za]), (b, [torque, yb, zb])] {
                let moment = along * e1[i] + y * e2[i] + z * e3[i];
                vote.force_bound = vote.force_bound.max(moment.abs() / step.arm);
                turning.m[i][node] -= moment_quantum.round(moment);
            }
        }
        vote.offer_courant(self.courant(initial_length, length), self.elements[e]);
        vote.internal += step.energy_quantum.round(energy);
        if step.dt > 0.0 {
            for (i, value) in e2.into_iter().chain(new).chain([energy]).enumerate() {
                self.own[i][e] = value;
            }
        }
    }

    /// The time step that the fastest of the motions of a free elastic beam allows.
    fn courant(&self, initial_length: f64, length: f64) -> f64 {
        let half_mass = 0.5 * self.density * self.section.area * initial_length;
        let inertia = half_mass * self.section.polar();
        let drawn = 2.0 * self.law.young * self.section.area / (length * half_mass);
        let twisted = 2.0 * self.law.shear() * self.section.torsion / (initial_length * inertia);
        let bent = self.bending(initial_length).map(|Bending { stiffness, phi }| {
            let alike = 6.0 * stiffness / (1.0 + phi) * (1.0 / inertia + 4.0 / (half_mass * length * length));
            alike.max(2.0 * stiffness / inertia)
        });
        2.0 / drawn.max(twisted).max(bent[0]).max(bent[1]).sqrt()
    }

    /// Plastic strains of the fibres of a station.
    fn strains(&self, e: usize, station: usize) -> impl Iterator<Item = f64> + '_ {
        let n = self.fibres.len();
        let first = ELEMENT + station * n * FIBRE;
        (0..n).map(move |f| self.own[first + f * FIBRE + PLASTIC_STRAIN][e])
    }

    /// What an element says of itself in the fields of solids: the mean stress along it, greatest plastic strain and temperature of its
    /// fibres, energy.
    fn summary(&self, e: usize, x: &[Vec<f64>; 3]) -> [f64; N_FIELDS] {
        let [a, b] = self.bars[e].map(|n| n as usize);
        let chord: [f64; 3] = std::array::from_fn(|i| x[i][b] - x[i][a]);
        let volume = self.initial_volume[e];
        let p = -self.own[AXIAL][e] / self.section.area / 3.0;
        let temperatures = self.own[ELEMENT..].iter().skip(TEMPERATURE).step_by(FIBRE);
        let mut fields = [0.0; N_FIELDS];
        fields[field::SXX] = -2.0 * p;
        fields[field::SYY] = p;
        fields[field::PRESSURE] = p;
        fields[field::ENERGY] = self.own[ENERGY][e] / volume;
        let strains = (0..STATIONS.len()).flat_map(|station| self.strains(e, station));
        fields[field::PLASTIC_STRAIN] = strains.fold(0.0, f64::max);
        fields[field::TEMPERATURE] = temperatures.map(|values| values[e]).fold(0.0, f64::max);
        fields[field::RELATIVE_VOLUME] = dot(chord, chord).sqrt() * self.section.area / volume;
        fields
    }
}

impl Group for Beams {
    slots_of_bars!();

    fn compute(
        &mut self,
        mut nodes: Nodal<'_>,
        turning: Option<&mut Turning>,
        call: &Call<'_>,
        vote: &mut ElementVote,
    ) {
        let turning = turning.expect("a block of beams was built with rotations");
        let alive = take(&mut self.alive);
        for e in living(&alive, call.sets) {
            self.one(e, &mut nodes, turning, call.step, vote);
        }
        self.alive = alive;
    }

    fn element(&self, element: usize, x: &[Vec<f64>; 3]) -> [f64; N_FIELDS] {
        self.summary(element, x)
    }

    fn image(&self, x: &[Vec<f64>; 3]) -> ElementArrays {
        let all: Vec<_> = (0..self.bars.len()).map(|e| self.summary(e, x)).collect();
        ElementArrays {
            initial_volume: self.initial_volume.clone(),
            fields: std::array::from_fn(|field| all.iter().map(|summary| summary[field]).collect()),
            own: self.own.clone(),
            history: Vec::new(),
        }
    }

    fn into_image(self: Box<Self>, x: &[Vec<f64>; 3]) -> ElementArrays {
        self.image(x)
    }

    fn visit(&self, visit: &mut dyn FnMut(f64)) {
        for values in &self.own {
            values.iter().for_each(|&value| visit(value));
        }
    }

    fn take_out(&mut self, slot: usize) -> (u32, f64) {
        self.alive[slot / SET] &= !(1 << (slot % SET));
        (self.elements[slot], self.own[ENERGY][slot])
    }

    fn met(&self, criteria: &Criteria, sets: &[Range<u32>]) -> Vec<u32> {
        // What the fibres break by; without that none has.
        let Some(limit) = self.section.breaks.filter(|_| criteria.plastic_strain.is_some()) else {
            return Vec::new();
        };
        if self.fibres.is_empty() {
            return Vec::new();
        }
        let has_parted = |&e: &usize| {
            (0..STATIONS.len()).any(|station| self.strains(e, station).all(|strain| strain >= limit))
        };
        living(&self.alive, sets).filter(has_parted).map(|slot| slot as u32).collect()
    }

    fn first_stress(&mut self) -> Option<&mut f64> {
        self.own[AXIAL].first_mut()
    }

    fn numbers_mut(&mut self, target: Target) -> Vec<&mut [f64]> {
        match target {
            Target::Constants => vec![&mut self.initial_volume],
            Target::Elements => self.own.iter_mut().map(Vec::as_mut_slice).collect(),
            _ => Vec::new(),
        }
    }
}
