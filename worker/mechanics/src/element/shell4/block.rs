//! A block of shells: the elements, their own copies of their nodes, and their state.

use std::ops::Range;

use super::{
    InPlane, SectionError, kernel, laminate,
    layers::{LAYER, Layers, PLASTIC_STRAIN, TEMPERATURE},
    plane::FOUR,
};
use crate::{
    element::{
        ElementVote,
        group::{Call, ElementArrays, Group, living},
        place::Nodal,
    },
    erosion::criteria::Criteria,
    exact::Quantum,
    flip::Target,
    lanes::{SET, Width},
    material::Material,
    mesh::{Section, quad_area, twice},
    spin::Turning,
    state::{N_FIELDS, field},
    strength::plane_stress::PlaneLaw,
};

/// What one cycle tells the shells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShellStep {
    /// The step that led from `x_{n-1}` to `x_n` (time).
    pub dt: f64,
    /// Corner forces are rounded to it (force).
    pub force_quantum: Quantum,
    /// Corner moments are rounded to it (force times length).
    pub moment_quantum: Quantum,
    /// Energies are rounded to it (energy).
    pub energy_quantum: Quantum,
}

/// The shells of a block, without its nodes. Arrays are by slot, which is the local element; phantoms follow.
pub(crate) struct Core {
    n_nodes: usize,
    n_elements: usize,
    /// Area times thickness at the start.
    initial_volume: Vec<f64>,
    corners: [Vec<u32>; 4],
    pub(super) state: State,
    element_mass: Vec<f64>,
    alive: Vec<u8>,
    elements: Vec<u32>,
    built: Built,
    pub(super) law: Law,
}

/// What the section says of all elements.
struct Built {
    /// Heights and weights of the points through the thickness.
    points: Vec<(f64, f64)>,
    in_plane: InPlane,
    is_membrane: bool,
    /// Share of the strain across the thickness that this follows: 1, or 0 where it stays.
    thinning: f64,
    /// Plastic strain at which a layer breaks.
    breaks: Option<f64>,
}

impl Built {
    /// Layers of all points in the plane.
    fn n_layers(&self) -> usize {
        self.points.len() * self.in_plane.points()
    }

    /// What the kernel is told, of layers of this law.
    fn constants<W: Layers>(&self, law: W, step: &ShellStep) -> kernel::Constants<'_, W> {
        kernel::Constants {
            law,
            points: &self.points,
            thinning: self.thinning,
            breaks: self.breaks,
            bends: f64::from(!self.is_membrane),
            second_moment: self.points.iter().map(|(height, weight)| 0.25 * weight * height * height).sum(),
            dt: step.dt,
            force_magic: step.force_quantum.magic(),
            moment_magic: step.moment_quantum.magic(),
            inverse_arm: step.force_quantum.value() / step.moment_quantum.value(),
            energy_magic: step.energy_quantum.magic(),
        }
    }
}

/// What the layers are made of.
pub(super) enum Law {
    Plain(PlaneLaw),
    Laminate(laminate::Stacked),
}

/// Numbers of the elements by slot. What a lane set has lies together, field after field: a cycle goes through memory once.
pub(super) struct State {
    n_fields: usize,
    values: Vec<f64>,
}

impl State {
    /// Of these fields by element, of which `of_slot` is the one in a slot.
    fn new(fields: &[Vec<f64>], n_slots: usize, of_slot: impl Fn(usize) -> usize) -> Self {
        let mut state = Self { n_fields: fields.len(), values: vec![0.0; fields.len() * n_slots] };
        for (field, values) in fields.iter().enumerate() {
            for slot in 0..n_slots {
                let place = state.place(field, slot);
                state.values[place] = values[of_slot(slot)];
            }
        }
        state
    }

    fn place(&self, field: usize, slot: usize) -> usize {
        (slot / SET * self.n_fields + field) * SET + slot % SET
    }

    pub fn at(&self, field: usize, slot: usize) -> f64 {
        self.values[self.place(field, slot)]
    }

    /// The numbers of each set: of the elements, and of their layers.
    fn sets_mut(&mut self) -> impl Iterator<Item = [&mut [f64]; 2]> {
        self.values.chunks_mut(self.n_fields * SET).map(|set| {
            let (own, layers) = set.split_at_mut(kernel::ELEMENT * SET);
            [own, layers]
        })
    }
}

/// The first field of a layer of a laminate.
pub(super) fn ply_field(point: usize) -> usize {
    kernel::ELEMENT + laminate::SHARED + point * laminate::BY_LAYER
}

/// The first field of any other layer; those of a point in the plane stand together.
pub(super) fn layer_field(layer: usize) -> usize {
    kernel::ELEMENT + layer * LAYER
}

/// Whether shells can be built of this: the points through the thickness and the law of the layers.
fn section_of(section: &Section, material: &Material) -> Result<(Vec<(f64, f64)>, Law), SectionError> {
    let Section { thickness, rule, .. } = *section;
    if !(thickness.is_finite() && thickness > 0.0) {
        return Err(SectionError::Thickness { thickness });
    }
    let points = rule.points().ok_or(SectionError::Points { rule })?;
    if section.is_membrane && (points.len() > 1 || section.laminate.is_some()) {
        return Err(SectionError::Membrane);
    }
    if section.laminate.is_some() && section.in_plane != InPlane::One {
        return Err(SectionError::InPlane);
    }
    if let Some(laminate) = &section.laminate {
        let law = material.strength.layers().filter(|_| !material.is_gas());
        let law = law.ok_or_else(|| SectionError::Plies { material: material.name.clone() })?;
        let (stacked, points) =
            laminate::Stacked::of(laminate, law, &points).map_err(SectionError::Laminate)?;
        return Ok((points, Law::Laminate(stacked)));
    }
    let law =
        PlaneLaw::of(material).map_err(|law| SectionError::Law { material: material.name.clone(), law })?;
    Ok((points, Law::Plain(law)))
}

impl Section {
    /// Whether shells of this section and material can be computed.
    ///
    /// # Errors
    /// [`SectionError`].
    pub fn check(&self, material: &Material) -> Result<(), SectionError> {
        section_of(self, material).map(|_| ())
    }
}

impl Core {
    /// Lays out the state of `quads.len()` elements in slots, eight to a set. `elements` are their global indices,
    /// `volume` their area times thickness at the start, `fields` their state, see [`crate::piece::Piece::own`], and of a laminate its
    /// history variables behind it.
    ///
    /// # Errors
    /// [`SectionError`].
    ///
    /// # Panics
    /// If there is no element, or arrays of the state are not by node and element.
    pub fn new(
        quads: &[[u32; 4]],
        n_nodes: usize,
        elements: &[u32],
        volume: &[f64],
        fields: &[Vec<f64>],
        section: &Section,
        material: &Material,
    ) -> Result<Core, SectionError> {
        let (points, law) = section_of(section, material)?;
        assert!(!quads.is_empty(), "a block without elements");
        let n_elements = quads.len();
        assert!(quads.iter().flatten().all(|&n| (n as usize) < n_nodes), "corners beyond {n_nodes} nodes");
        let n_fields = match law {
            Law::Plain(_) => layer_field(points.len() * section.in_plane.points()),
            Law::Laminate(_) => ply_field(points.len()),
        };
        assert!(fields.len() == n_fields, "{} fields of shells", fields.len());
        assert!(elements.len() == n_elements && volume.len() == n_elements, "{n_elements} elements");
        assert!(fields.iter().all(|f| f.len() == n_elements), "fields of {n_elements} elements");
        let n_slots = n_elements.next_multiple_of(SET);
        // Phantoms stand on the first element.
        let of_slot = |slot: usize| if slot < n_elements { slot } else { 0 };
        let by_slot = |array: &[f64]| -> Vec<f64> { (0..n_slots).map(|slot| array[of_slot(slot)]).collect() };
        Ok(Core {
            n_nodes,
            n_elements,
            initial_volume: volume.to_vec(),
            corners: std::array::from_fn(|i| (0..n_slots).map(|slot| quads[of_slot(slot)][i]).collect()),
            state: State::new(fields, n_slots, of_slot),
            element_mass: by_slot(&volume.iter().map(|v| material.density * v).collect::<Vec<f64>>()),
            alive: (0..n_slots / SET)
                .map(|set| (0..SET).map(|i| u8::from(set * SET + i < n_elements) << i).sum())
                .collect(),
            elements: (0..n_slots).map(|slot| elements.get(slot).copied().unwrap_or(u32::MAX)).collect(),
            built: Built {
                points,
                in_plane: section.in_plane,
                is_membrane: section.is_membrane,
                // Plies keep their thickness.
                thinning: f64::from(section.thins && section.laminate.is_none()),
                breaks: section.breaks,
            },
            law,
        })
    }

    /// What an element says of itself in the fields of solids: greatest plastic strain and temperature of its layers,
    /// energy, pressure and deviator of the mean stress in its own frame.
    fn summary(&self, element: usize, x: &[Vec<f64>; 3]) -> [f64; N_FIELDS] {
        let corners = self.corners.each_ref().map(|of_slot| of_slot[element] as usize);
        let area = quad_area(&corners.map(|n| std::array::from_fn(|axis| x[axis][n])));
        let volume = self.initial_volume[element];
        let mut fields = [0.0; N_FIELDS];
        let Built { points, in_plane, .. } = &self.built;
        let n_layers = self.built.n_layers();
        let mean_of = |of: &dyn Fn(usize) -> f64| {
            let sum = (0..n_layers).map(|p| points[p % points.len()].1 * of(p)).sum::<f64>();
            sum / in_plane.points() as f64
        };
        let mean: [f64; 5] = match &self.law {
            Law::Plain(_) => {
                let layer = |point: usize, i: usize| self.state.at(layer_field(point) + i, element);
                let most = |i: usize| (0..n_layers).map(|p| layer(p, i)).fold(f64::MIN, f64::max);
                fields[field::PLASTIC_STRAIN] = most(PLASTIC_STRAIN);
                fields[field::TEMPERATURE] = most(TEMPERATURE);
                std::array::from_fn(|i| mean_of(&|point| layer(point, i)))
            }
            Law::Laminate(stacked) => {
                fields[field::DAMAGE] = mean_of(&|point| self.ply(point, laminate::IS_GONE, element));
                let stresses: Vec<[f64; 5]> = (0..n_layers)
                    .map(|point| {
                        stacked.stress(point, self.direction(element), |i| self.ply(point, i, element))
                    })
                    .collect();
                std::array::from_fn(|i| mean_of(&|point| stresses[point][i]))
            }
        };
        let (xx, yy) = (mean[0], mean[1]);
        let pressure = -(xx + yy) / 3.0;
        fields[field::SXX] = xx + pressure;
        fields[field::SYY] = yy + pressure;
        (fields[field::SXY], fields[field::SYZ], fields[field::SZX]) = (mean[2], mean[3], mean[4]);
        fields[field::PRESSURE] = pressure;
        fields[field::ENERGY] = self.state.at(kernel::INTERNAL, element) / volume;
        fields[field::RELATIVE_VOLUME] = area * self.state.at(kernel::THICKNESS, element) / volume;
        fields
    }

    /// A number of a layer of a laminate.
    pub(super) fn ply(&self, point: usize, i: usize, element: usize) -> f64 {
        self.state.at(ply_field(point) + i, element)
    }

    /// The direction of angle 0 of a laminate in the frame of an element.
    pub(super) fn direction(&self, element: usize) -> [f64; 2] {
        [0, 1].map(|i| self.state.at(kernel::ELEMENT + i, element))
    }

    /// Number of arrays among those of the state that are no history variables.
    fn n_own(&self) -> usize {
        match self.law {
            Law::Plain(_) => self.state.n_fields,
            Law::Laminate(_) => kernel::ELEMENT,
        }
    }

    /// Adds forces and moments of the elements of `sets`, brings their state from `n-1` to `n` and adds their votes. The result does
    /// not depend on `width`.
    ///
    /// # Panics
    /// If node arrays are shorter than the nodes, a set is out of range or the machine lacks the width.
    pub(super) fn run(
        &mut self,
        nodes: Nodal<'_>,
        turning: &mut Turning,
        sets: &[Range<u32>],
        step: &ShellStep,
        width: Width,
        vote: &mut ElementVote,
    ) {
        let n_nodes = self.n_nodes;
        let lengths = nodes.x.iter().chain(&nodes.v).map(|a| a.len());
        let lengths = lengths.chain(nodes.f.iter().map(|a| a.len()));
        let lengths = lengths.chain(turning.w.iter().chain(&turning.m).map(Vec::len));
        let shortest = lengths.min().unwrap_or(0);
        assert!(shortest >= n_nodes, "node arrays of {shortest}, not of {n_nodes}");
        let n_sets = self.alive.len() as u32;
        assert!(sets.iter().all(|r| r.end <= n_sets), "sets {sets:?} of a block of {n_sets}");
        let view = kernel::View {
            corners: &self.corners,
            x: nodes.x,
            v: nodes.v,
            w: turning.w.each_ref().map(Vec::as_slice),
            f: nodes.f,
            m: turning.m.each_mut().map(Vec::as_mut_slice),
            state: &mut self.state.values,
            mass: &self.element_mass,
            alive: &self.alive,
            elements: &self.elements,
        };
        match &self.law {
            Law::Plain(law) => {
                let c = self.built.constants(*law, step);
                // SAFETY: node arrays and sets were checked just now, corners when they were taken in, and arrays by slot were built
                // in whole sets, with the layers of these points in the plane.
                unsafe {
                    match self.built.in_plane {
                        InPlane::One => width.run(kernel::Pass::<_, 1>::new(view, &c, sets, vote)),
                        InPlane::Four => width.run(kernel::Pass::<_, FOUR>::new(view, &c, sets, vote)),
                    }
                }
            }
            Law::Laminate(stacked) => {
                let c = self.built.constants(stacked.stack(), step);
                // SAFETY: likewise; a laminate has one point in the plane.
                width.run(unsafe { kernel::Pass::<_, 1>::new(view, &c, sets, vote) });
            }
        }
    }
}

impl Group for Core {
    fn reach(&self) -> usize {
        self.n_nodes
    }

    fn alive(&self) -> &[u8] {
        &self.alive
    }

    fn alive_mut(&mut self) -> &mut [u8] {
        &mut self.alive
    }

    fn n_elements(&self) -> usize {
        self.n_elements
    }

    fn global(&self, slot: usize) -> u32 {
        self.elements[slot]
    }

    fn slot(&self, element: usize) -> usize {
        element
    }

    fn corners(&self, element: usize) -> [u32; 8] {
        twice(self.corners.each_ref().map(|of_slot| of_slot[element]))
    }

    fn compute(
        &mut self,
        nodes: Nodal<'_>,
        turning: Option<&mut Turning>,
        call: &Call<'_>,
        vote: &mut ElementVote,
    ) {
        let step = ShellStep {
            dt: call.step.dt,
            force_quantum: call.step.force_quantum,
            moment_quantum: call.step.force_quantum.times(call.step.arm),
            energy_quantum: call.step.energy_quantum,
        };
        let turning = turning.expect("a block of shells was built with rotations");
        self.run(nodes, turning, call.sets, &step, call.width, vote);
    }

    fn element(&self, element: usize, x: &[Vec<f64>; 3]) -> [f64; N_FIELDS] {
        self.summary(element, x)
    }

    fn variables(&self, slot: usize) -> Vec<f64> {
        (self.n_own()..self.state.n_fields).map(|field| self.state.at(field, slot)).collect()
    }

    fn image(&self, x: &[Vec<f64>; 3]) -> ElementArrays {
        let all: Vec<_> = (0..self.n_elements).map(|e| self.summary(e, x)).collect();
        let of_field = |field| (0..self.n_elements).map(|e| self.state.at(field, e)).collect();
        ElementArrays {
            initial_volume: self.initial_volume.clone(),
            fields: std::array::from_fn(|field| all.iter().map(|summary| summary[field]).collect()),
            own: (0..self.n_own()).map(of_field).collect(),
            history: (self.n_own()..self.state.n_fields).map(of_field).collect(),
        }
    }

    fn into_image(self: Box<Self>, x: &[Vec<f64>; 3]) -> ElementArrays {
        self.image(x)
    }

    fn visit(&self, visit: &mut dyn FnMut(f64)) {
        for field in 0..self.state.n_fields {
            (0..self.n_elements).for_each(|element| visit(self.state.at(field, element)));
        }
    }

    fn met(&self, criteria: &Criteria, sets: &[Range<u32>]) -> Vec<u32> {
        if let Law::Laminate(_) = self.law {
            let is_gone = |&slot: &usize| {
                (0..self.built.n_layers()).all(|point| self.ply(point, laminate::IS_GONE, slot) >= 1.0)
            };
            return match criteria.failure {
                true => living(&self.alive, sets).filter(is_gone).map(|slot| slot as u32).collect(),
                false => Vec::new(),
            };
        }
        // What the layers break by; without that none has.
        let Some(limit) = self.built.breaks.filter(|_| criteria.plastic_strain.is_some()) else {
            return Vec::new();
        };
        let has_broken = |&slot: &usize| {
            let strain = |layer: usize| self.state.at(layer_field(layer) + PLASTIC_STRAIN, slot);
            (0..self.built.n_layers()).all(|layer| strain(layer) >= limit)
        };
        living(&self.alive, sets).filter(has_broken).map(|slot| slot as u32).collect()
    }

    fn take_out(&mut self, slot: usize) -> (u32, f64) {
        self.alive[slot / SET] &= !(1 << (slot % SET));
        (self.elements[slot], self.state.at(kernel::INTERNAL, slot))
    }

    fn first_stress(&mut self) -> Option<&mut f64> {
        self.state.values.get_mut(layer_field(0) * SET)
    }

    fn numbers_mut(&mut self, target: Target) -> Vec<&mut [f64]> {
        match target {
            Target::Constants => vec![&mut self.initial_volume, &mut self.element_mass],
            Target::Elements => self.state.sets_mut().map(|[own, _]| own).collect(),
            Target::Layers => self.state.sets_mut().map(|[_, layers]| layers).collect(),
            _ => Vec::new(),
        }
    }
}
