//! Shells with nodes of their own, for tests and benchmarks of the element without a cycle.

use super::{
    Core, Rule, SectionError, ShellStep,
    block::{Law, layer_field, ply_field},
    kernel,
    layers::{LAYER, PLASTIC_STRAIN, TEMPERATURE},
};
use crate::{
    element::{ElementVote, group::Group, place::Nodal},
    lanes::{SET, Width},
    material::Material,
    mesh::{Section, laminate::direction, quad_area},
    spin::Turning,
    state::zeros,
};

/// Shells of one material and thickness with nodes of their own, for whoever drives them without a cycle. Node arrays are
/// by local node.
pub struct Shells {
    /// Position `x_n` by axis.
    pub x: [Vec<f64>; 3],
    /// Velocity `v_{n-1/2}` by axis.
    pub v: [Vec<f64>; 3],
    /// Nodal force by axis.
    pub f: [Vec<f64>; 3],
    /// Nodal mass: a quarter of each element's.
    pub mass: Vec<f64>,
    /// Rotations of the nodes.
    pub turning: Turning,
    core: Core,
}

impl Shells {
    /// Shells at rest and free of stress; corners run around the element, seen from its upper side to the left.
    ///
    /// # Errors
    /// [`SectionError`].
    ///
    /// # Panics
    /// If there is no element or a corner is no node.
    pub fn new(
        x: &[[f64; 3]],
        corners: &[[u32; 4]],
        thickness: f64,
        rule: Rule,
        material: &Material,
    ) -> Result<Shells, SectionError> {
        Self::of(x, corners, &Section::of(thickness, rule), material)
    }

    /// The same of any section.
    ///
    /// # Errors
    /// [`SectionError`], also where the axis of a laminate has no part in the plane of an element.
    ///
    /// # Panics
    /// As [`Shells::new`].
    pub fn of(
        x: &[[f64; 3]],
        corners: &[[u32; 4]],
        section: &Section,
        material: &Material,
    ) -> Result<Shells, SectionError> {
        section.check(material)?;
        let thickness = section.thickness;
        let (n_nodes, n_elements) = (x.len(), corners.len());
        let n_padded = n_nodes.next_multiple_of(SET);
        let mut inertia = vec![0.0; n_nodes];
        let mut fields = zeros(section.n_fields(), n_elements);
        fields[kernel::THICKNESS].fill(thickness);
        for layer in fields[kernel::ELEMENT..].chunks_mut(LAYER) {
            layer[TEMPERATURE].fill(material.initial_temperature());
        }
        if let Some(laminate) = &section.laminate {
            fields.resize_with(ply_field(section.n_layers()), || vec![0.0; n_elements]);
            for (e, corners) in corners.iter().enumerate() {
                let x = corners.map(|n| x[n as usize]);
                let direction =
                    direction(laminate.axis, material, &x).ok_or(SectionError::Axis { element: e })?;
                for (field, along) in fields[kernel::ELEMENT..].iter_mut().zip(direction) {
                    field[e] = along;
                }
            }
        }
        let mut masses = vec![0.0; n_padded];
        masses[n_nodes..].fill(1.0);
        let mut volumes = Vec::with_capacity(n_elements);
        for corners in corners {
            let area = quad_area(&corners.map(|n| x[n as usize]));
            let mass = material.density * area * thickness;
            volumes.push(area * thickness);
            for &node in corners {
                masses[node as usize] += 0.25 * mass;
                inertia[node as usize] += 0.25 * mass * (thickness * thickness / 12.0).max(area / 8.0);
            }
        }
        let elements: Vec<u32> = (0..n_elements as u32).collect();
        let zeros = || std::array::from_fn(|_| vec![0.0; n_padded]);
        Ok(Shells {
            x: std::array::from_fn(|axis| {
                let mut x: Vec<f64> = x.iter().map(|x| x[axis]).collect();
                x.resize(n_padded, 0.0);
                x
            }),
            v: zeros(),
            f: zeros(),
            mass: masses,
            turning: Turning::new(&vec![[0.0; 3]; n_nodes], inertia),
            core: Core::new(corners, n_nodes, &elements, &volumes, &fields, section, material)?,
        })
    }

    pub fn n_elements(&self) -> usize {
        self.core.n_elements()
    }

    /// Thickness of an element now (length).
    pub fn thickness(&self, element: usize) -> f64 {
        self.core.state.at(kernel::THICKNESS, element)
    }

    /// Energy that hourglass control has taken from an element since the start.
    pub fn hourglass_energy(&self, element: usize) -> f64 {
        self.core.state.at(kernel::HOURGLASS, element)
    }

    /// Stress of a layer in the frame of its element, xx, yy, xy, yz, zx, counted from below.
    pub fn stress(&self, element: usize, layer: usize) -> [f64; 5] {
        let core = &self.core;
        match &core.law {
            Law::Plain(_) => std::array::from_fn(|i| core.state.at(layer_field(layer) + i, element)),
            Law::Laminate(stacked) => {
                stacked.stress(layer, core.direction(element), |i| core.ply(layer, i, element))
            }
        }
    }

    /// The history variables of an element of a laminate: the direction of angle 0, then those of each layer.
    pub fn variables(&self, element: usize) -> Vec<f64> {
        self.core.variables(element)
    }

    /// Effective plastic strain of a layer.
    pub fn plastic_strain(&self, element: usize, layer: usize) -> f64 {
        self.core.state.at(layer_field(layer) + PLASTIC_STRAIN, element)
    }

    /// Sets forces and moments to zero, adds those of all elements at `x_n`, brings their state from `n-1` to `n` and
    /// answers their votes. The result does not depend on `width`.
    ///
    /// # Panics
    /// If node arrays changed their length or the machine lacks the width.
    pub fn compute(&mut self, step: &ShellStep, width: Width) -> ElementVote {
        for array in self.f.iter_mut().chain(&mut self.turning.m) {
            array.fill(0.0);
        }
        let mut vote = ElementVote::default();
        let all = 0..self.core.alive().len() as u32;
        let nodes = Nodal::of(&self.x, &self.v, &mut self.f);
        self.core.run(nodes, &mut self.turning, &[all], step, width, &mut vote);
        vote
    }
}
