//! The two-node truss: a straight bar that pulls and pushes along itself and does not bend.
//!
//! Its stress is uniaxial, so the bar thins as it stretches elastically and keeps its volume as it flows:
//! `V / V0 = 1 + (1 - 2 nu) sigma / E`, and its section is `V / L`. The strain of a step is `2 (L - L') / (L + L')`, the logarithmic
//! strain to third order. The elements are few and their arithmetic is short, so they are computed one at a time.
//!
//! A cable pulls and does not push. Its elastic strain is `ln(L / L0)` less its plastic strain, with `L0` its length without stress, and
//! where that is negative it is slack: so it pulls again at just the length at which it fell slack, and needs no memory for that.

use std::{fmt, mem::take};

use serde::{Deserialize, Serialize};

use super::{
    ElementVote, Fault, Step,
    group::{Call, ElementArrays, Group, all_alive, living, slots_of_bars},
    place::Nodal,
};
use crate::{
    flip::Target,
    lanes::{SET, scalar::Scalar},
    material::Material,
    piece::Piece,
    spin::Turning,
    state::{N_FIELDS, field},
    strength::{
        AnyStrength, StrengthLaw,
        plane_stress::{PlaneLaw, STEPS},
    },
};

/// Why trusses cannot be built.
#[derive(Clone, Debug, PartialEq)]
pub enum TrussError {
    /// The area is not a positive finite number.
    Area {
        /// What was given (area).
        area: f64,
    },
    /// The material does not bear the tension at the start.
    Tension {
        /// What was given (force).
        tension: f64,
        /// What it bears at most (force).
        most: f64,
    },
    /// Uniaxial stress does not know the law.
    Law {
        /// Name of the material.
        material: String,
        law: &'static str,
    },
}

impl fmt::Display for TrussError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            TrussError::Area { area } => {
                write!(f, "truss of area {area}, expected a positive area; give one")
            }
            TrussError::Tension { tension, most } => {
                write!(
                    f,
                    "cable under tension {tension:?}, expected at most {most:.3e}, where it yields or is a fifth longer; give less"
                )
            }
            TrussError::Law { material, law } => {
                write!(f, "trusses of {material:?}: {law} carries no tension; take a material with strength")
            }
        }
    }
}

impl std::error::Error for TrussError {}

/// Whether trusses of this area and material can be computed.
///
/// # Errors
/// [`TrussError`].
pub fn check(area: f64, material: &Material) -> Result<(), TrussError> {
    if !(area.is_finite() && area > 0.0) {
        return Err(TrussError::Area { area });
    }
    law_of(material).map(|_| ())
}

/// What makes trusses cables.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cable {
    /// Length without stress over that in the mesh: 1 without tension at the start.
    pub rest: f64,
}

/// The greatest elastic strain at the start.
const MOST_STRAIN: f64 = 0.2;

impl Cable {
    /// The cable that pulls with this force at the start.
    ///
    /// # Errors
    /// [`TrussError`] for a law without uniaxial stress, and a force at which the material yields or that stretches it by more than a fifth.
    pub fn under(tension: f64, area: f64, material: &Material) -> Result<Self, TrussError> {
        let law = law_of(material)?;
        let thinner = 1.0 - 2.0 * law.poisson;
        // By area without stress; it grows with the strain up to the most.
        let pull = |strain: f64| law.young * strain * thinner.mul_add(strain, 1.0) * libm::exp(-strain);
        let mut most = MOST_STRAIN;
        if law.strength.plastic() {
            let factor = law.strength.factor(Scalar(0.0), Scalar(material.initial_temperature()));
            most = most.min(law.strength.flow(Scalar(0.0), factor).0.0 / law.young);
        }
        let wanted = tension / area;
        if !(wanted >= 0.0 && wanted <= pull(most)) {
            return Err(TrussError::Tension { tension, most: area * pull(most) });
        }
        if wanted == 0.0 {
            return Ok(Self { rest: 1.0 });
        }
        let (mut low, mut high) = (0.0, most);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if pull(middle) < wanted {
                low = middle;
            } else {
                high = middle;
            }
        }
        Ok(Self { rest: libm::exp(-high) })
    }

    /// The fields of its elements that are not as in any other at the start: stress and energy.
    ///
    /// # Panics
    /// If the material has no strength.
    pub(crate) fn at_start(&self, material: &Material) -> [(usize, f64); 4] {
        let law = PlaneLaw::of(material).expect("the deck has checked the material");
        if self.rest == 1.0 {
            return [field::PRESSURE, field::SXX, field::SYY, field::ENERGY].map(|field| (field, 0.0));
        }
        let stress = -law.young * libm::log(self.rest);
        let thinner = (1.0 - 2.0 * law.poisson) / law.young;
        let energy = stress * stress / law.young * thinner.mul_add(stress / 3.0, 0.5);
        let p = -stress / 3.0;
        [(field::PRESSURE, p), (field::SXX, -2.0 * p), (field::SYY, p), (field::ENERGY, energy)]
    }
}

fn law_of(material: &Material) -> Result<PlaneLaw, TrussError> {
    PlaneLaw::of(material).map_err(|law| TrussError::Law { material: material.name.clone(), law })
}

/// The trusses of a block; arrays are by local element.
pub(crate) struct Trusses {
    n_nodes: usize,
    bars: Vec<[u32; 2]>,
    fields: [Vec<f64>; N_FIELDS],
    initial_volume: Vec<f64>,
    alive: Vec<u8>,
    elements: Vec<u32>,
    density: f64,
    law: PlaneLaw,
    /// Of cables, their area without stress.
    area_of_cable: Option<f64>,
}

impl Trusses {
    /// The elements of a piece, whose arrays they take.
    ///
    /// # Panics
    /// If the material has no strength.
    pub fn of(
        piece: &mut Piece,
        bars: Vec<[u32; 2]>,
        area_of_cable: Option<f64>,
        material: &Material,
    ) -> Self {
        Self {
            n_nodes: piece.nodes.len(),
            fields: take(&mut piece.fields),
            initial_volume: take(&mut piece.initial_volume),
            alive: all_alive(bars.len()),
            elements: take(&mut piece.elements),
            density: material.density,
            law: PlaneLaw::of(material).expect("the deck has checked the material"),
            bars,
            area_of_cable,
        }
    }

    /// Force, state and vote of one element.
    fn one(&mut self, e: usize, nodes: &mut Nodal<'_>, step: &Step, vote: &mut ElementVote) {
        let [a, b] = self.bars[e].map(|n| n as usize);
        let along: [f64; 3] = std::array::from_fn(|axis| nodes.x[axis][b] - nodes.x[axis][a]);
        let before: [f64; 3] = std::array::from_fn(|axis| {
            let apart = nodes.v[axis][b] - nodes.v[axis][a];
            (-step.dt).mul_add(apart, along[axis])
        });
        let (length, length_before) = (norm(along), norm(before));
        let volume = self.initial_volume[e];
        let at = |fields: &[Vec<f64>; N_FIELDS], k: usize| fields[k][e];
        let mut bar = Bar {
            stress: -3.0 * at(&self.fields, field::PRESSURE),
            plastic_strain: at(&self.fields, field::PLASTIC_STRAIN),
            temperature: at(&self.fields, field::TEMPERATURE),
        };
        let mut energy = at(&self.fields, field::ENERGY);
        let thinner = (1.0 - 2.0 * self.law.poisson) / self.law.young;
        let volume_of = |stress: f64| thinner.mul_add(stress, 1.0);
        let pull_before = bar.stress * volume_of(bar.stress) / length_before;
        if step.dt > 0.0 {
            let strain = 2.0 * (length - length_before) / (length + length_before);
            let trial = match self.area_of_cable {
                None => self.law.young.mul_add(strain, bar.stress),
                Some(area) => {
                    let elastic = libm::log(length * area / volume) - bar.plastic_strain;
                    self.law.young * elastic.max(0.0)
                }
            };
            update(&self.law, &mut bar, trial, strain / step.dt);
        }
        let relative_volume = volume_of(bar.stress);
        // Forces are by initial volume until they are given to the nodes.
        let pull = bar.stress * relative_volume / length;
        if step.dt > 0.0 {
            energy = (0.5 * (pull_before + pull)).mul_add(length - length_before, energy);
        }
        let force = pull * volume;
        if !(force.is_finite() && length > 0.0 && relative_volume > 0.0 && energy.is_finite()) {
            vote.offer_fault(Fault { element: self.elements[e], volume: relative_volume * volume });
            return;
        }
        for axis in 0..3 {
            let component = force * along[axis] / length;
            vote.force_bound = vote.force_bound.max(component.abs());
            let component = step.force_quantum.round(component);
            nodes.f[axis][a] += component;
            nodes.f[axis][b] -= component;
        }
        // Two masses of half the bar on a spring of stiffness E V / L^2.
        let courant = length * (self.density / (self.law.young * relative_volume)).sqrt();
        vote.offer_courant(courant, self.elements[e]);
        vote.internal += step.energy_quantum.round(energy * volume);
        if step.dt > 0.0 {
            let p = -bar.stress / 3.0;
            for (k, value) in [
                (field::PRESSURE, p),
                (field::SXX, -2.0 * p),
                (field::SYY, p),
                (field::ENERGY, energy),
                (field::PLASTIC_STRAIN, bar.plastic_strain),
                (field::TEMPERATURE, bar.temperature),
                (field::RELATIVE_VOLUME, relative_volume),
            ] {
                self.fields[k][e] = value;
            }
        }
    }
}

fn norm(x: [f64; 3]) -> f64 {
    x[0].mul_add(x[0], x[1].mul_add(x[1], x[2] * x[2])).sqrt()
}

/// What a bar remembers.
struct Bar {
    /// Stress along the bar, positive in tension.
    stress: f64,
    plastic_strain: f64,
    temperature: f64,
}

/// Takes the elastic `trial` stress of a strain of this `rate` and returns it to the yield stress.
fn update(law: &PlaneLaw, bar: &mut Bar, trial: f64, rate: f64) {
    bar.stress = trial;
    let strength: &AnyStrength = &law.strength;
    if !strength.plastic() {
        return;
    }
    let factor = strength.factor(Scalar(rate.abs()), Scalar(bar.temperature));
    let start = bar.plastic_strain;
    let size = trial.abs();
    if size <= strength.flow(Scalar(start), factor).0.0 {
        return;
    }
    let mut slip = 0.0_f64;
    for _ in 0..STEPS {
        let (flow, hardening) = strength.flow(Scalar(start + slip), factor);
        let excess = (-law.young).mul_add(slip, size) - flow.0;
        let next = (slip + excess / (law.young + hardening.0)).max(0.0);
        let small = (next - slip).abs() <= 1e-12 * next;
        slip = next;
        if small {
            break;
        }
    }
    let stress = (-law.young).mul_add(slip, size);
    bar.stress = stress.copysign(trial);
    bar.plastic_strain = start + slip;
    if strength.thermal() {
        bar.temperature += strength.heating() * stress * slip;
    }
}

impl Group for Trusses {
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
            initial_volume: self.initial_volume.clone(),
            fields: self.fields.clone(),
            own: Vec::new(),
            history: Vec::new(),
        }
    }

    fn into_image(self: Box<Self>, _x: &[Vec<f64>; 3]) -> ElementArrays {
        ElementArrays {
            initial_volume: self.initial_volume,
            fields: self.fields,
            own: Vec::new(),
            history: Vec::new(),
        }
    }

    fn visit(&self, visit: &mut dyn FnMut(f64)) {
        for values in &self.fields {
            values.iter().for_each(|&value| visit(value));
        }
    }

    fn take_out(&mut self, slot: usize) -> (u32, f64) {
        self.alive[slot / SET] &= !(1 << (slot % SET));
        (self.elements[slot], self.fields[field::ENERGY][slot] * self.initial_volume[slot])
    }

    fn first_stress(&mut self) -> Option<&mut f64> {
        self.fields[field::PRESSURE].first_mut()
    }

    fn numbers_mut(&mut self, target: Target) -> Vec<&mut [f64]> {
        match target {
            Target::Constants => vec![&mut self.initial_volume],
            Target::Elements => self.fields.iter_mut().map(Vec::as_mut_slice).collect(),
            _ => Vec::new(),
        }
    }
}
