//! A block of shells: the elements, their own copies of their nodes, and their state.

use std::fmt;

use super::{Rule, kernel};
#[cfg(target_arch = "x86_64")]
use crate::lanes::{avx2::Avx2, avx512::Avx512};
use crate::{
    element::ElementVote,
    exact::Quantum,
    lanes::{SET, Width, scalar::Scalar},
    material::Material,
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

/// Why shells cannot be built.
#[derive(Clone, Debug, PartialEq)]
pub enum SectionError {
    /// The thickness is not a positive finite number.
    Thickness {
        /// What was given (length).
        thickness: f64,
    },
    /// There is no such rule of points.
    Points {
        /// What was asked for.
        rule: Rule,
    },
    /// Layers do not know the law.
    Law {
        /// Name of the material.
        material: String,
        /// What it is.
        law: &'static str,
    },
}

impl fmt::Display for SectionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SectionError::Thickness { thickness } => {
                write!(f, "shell thickness {thickness}, expected a positive length; give one")
            }
            SectionError::Points { rule } => {
                write!(
                    f,
                    "no rule {rule:?} through the thickness; take Gauss with 1 to 5 points or Lobatto with 3 to 5"
                )
            }
            SectionError::Law { material, law } => write!(
                f,
                "shells of {material:?}: {law} has no plane-stress form; take elastic, von Mises with linear hardening \
                 or Johnson-Cook"
            ),
        }
    }
}

impl std::error::Error for SectionError {}

/// Shells of one material and thickness. Node arrays are by local node.
pub struct Shells {
    /// Position `x_n` by axis.
    pub x: [Vec<f64>; 3],
    /// Velocity `v_{n-1/2}` by axis.
    pub v: [Vec<f64>; 3],
    /// Rotation rate by axis (1/time), the same in space for all elements of a node.
    pub w: [Vec<f64>; 3],
    /// Nodal force by axis.
    pub f: [Vec<f64>; 3],
    /// Nodal moment by axis (force times length).
    pub m: [Vec<f64>; 3],
    /// Nodal mass: a quarter of each element's.
    pub mass: Vec<f64>,
    /// Rotational inertia of a node about any axis: that of a quarter element, `mass * max(h^2 / 12, A / 8)`, so that
    /// bending and transverse shear never ask for a smaller step than the membrane.
    pub inertia: Vec<f64>,
    corners: [Vec<u32>; 4],
    state: Vec<Vec<f64>>,
    layers: Vec<Vec<f64>>,
    element_mass: Vec<f64>,
    alive: Vec<u8>,
    elements: Vec<u32>,
    points: Vec<(f64, f64)>,
    law: PlaneLaw,
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
        if !(thickness.is_finite() && thickness > 0.0) {
            return Err(SectionError::Thickness { thickness });
        }
        let points = rule.points().ok_or(SectionError::Points { rule })?;
        let law = PlaneLaw::of(material)
            .map_err(|law| SectionError::Law { material: material.name.clone(), law })?;
        assert!(!corners.is_empty(), "a block without elements");
        let (n_nodes, n_elements) = (x.len(), corners.len());
        assert!(corners.iter().flatten().all(|&n| (n as usize) < n_nodes), "corners beyond {n_nodes} nodes");
        assert!(n_nodes < 1 << 31, "{n_nodes} nodes in one block");
        let n_slots = n_elements.next_multiple_of(SET);
        // Phantoms stand on the first element.
        let of_slot = |slot: usize| if slot < n_elements { slot } else { 0 };
        let zeros = || std::array::from_fn(|_| vec![0.0; n_nodes]);
        let mut shells = Shells {
            x: std::array::from_fn(|axis| x.iter().map(|x| x[axis]).collect()),
            v: zeros(),
            w: zeros(),
            f: zeros(),
            m: zeros(),
            mass: vec![0.0; n_nodes],
            inertia: vec![0.0; n_nodes],
            corners: std::array::from_fn(|i| (0..n_slots).map(|slot| corners[of_slot(slot)][i]).collect()),
            state: vec![vec![0.0; n_slots]; kernel::ELEMENT],
            layers: vec![vec![0.0; n_slots]; kernel::LAYER * points.len()],
            element_mass: vec![1.0; n_slots],
            alive: (0..n_slots / SET)
                .map(|set| (0..SET).map(|i| u8::from(set * SET + i < n_elements) << i).sum())
                .collect(),
            elements: (0..n_slots as u32).collect(),
            points,
            law,
        };
        shells.state[kernel::THICKNESS].fill(thickness);
        for point in 0..shells.points.len() {
            shells.layers[point * kernel::LAYER + 6].fill(material.initial_temperature());
        }
        for (element, corners) in corners.iter().enumerate() {
            let r = corners.map(|n| x[n as usize]);
            let [d1, d2] = [(0, 2), (1, 3)].map(|(a, b): (usize, usize)| -> [f64; 3] {
                std::array::from_fn(|axis| r[b][axis] - r[a][axis])
            });
            let cross: [f64; 3] = std::array::from_fn(|i| {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                d1[j] * d2[k] - d1[k] * d2[j]
            });
            let area = 0.5 * cross.iter().map(|c| c * c).sum::<f64>().sqrt();
            let mass = material.density * area * thickness;
            shells.element_mass[element] = mass;
            for &node in corners {
                shells.mass[node as usize] += 0.25 * mass;
                shells.inertia[node as usize] += 0.25 * mass * (thickness * thickness / 12.0).max(area / 8.0);
            }
        }
        Ok(shells)
    }

    /// Number of elements.
    pub fn n_elements(&self) -> usize {
        self.alive.iter().map(|bits| bits.count_ones() as usize).sum()
    }

    /// Thickness of an element now (length).
    pub fn thickness(&self, element: usize) -> f64 {
        self.state[kernel::THICKNESS][element]
    }

    /// Energy that hourglass control has taken from an element since the start.
    pub fn hourglass_energy(&self, element: usize) -> f64 {
        self.state[kernel::HOURGLASS][element]
    }

    /// Stress of a layer in the frame of its element, xx, yy, xy, yz, zx, counted from below.
    pub fn stress(&self, element: usize, layer: usize) -> [f64; 5] {
        std::array::from_fn(|i| self.layers[layer * kernel::LAYER + i][element])
    }

    /// Effective plastic strain of a layer.
    pub fn plastic_strain(&self, element: usize, layer: usize) -> f64 {
        self.layers[layer * kernel::LAYER + 5][element]
    }

    /// Sets forces and moments to zero, adds those of all elements at `x_n`, brings their state from `n-1` to `n` and
    /// answers their votes. The result does not depend on `width`.
    ///
    /// # Panics
    /// If node arrays changed their length or the machine lacks the width.
    pub fn compute(&mut self, step: &ShellStep, width: Width) -> ElementVote {
        assert!(width.available(), "lane width {width} is not on this machine");
        let n_nodes = self.mass.len();
        let arrays = [&self.x, &self.v, &self.w, &self.f, &self.m];
        assert!(arrays.into_iter().flatten().all(|a| a.len() == n_nodes), "node arrays not of {n_nodes}");
        for array in self.f.iter_mut().chain(&mut self.m) {
            array.fill(0.0);
        }
        let constants = kernel::Constants {
            law: self.law,
            points: &self.points,
            dt: step.dt,
            force_magic: step.force_quantum.magic(),
            moment_magic: step.moment_quantum.magic(),
            energy_magic: step.energy_quantum.magic(),
        };
        let mut view = kernel::View {
            corners: &self.corners,
            x: self.x.each_ref().map(Vec::as_slice),
            v: self.v.each_ref().map(Vec::as_slice),
            w: self.w.each_ref().map(Vec::as_slice),
            f: self.f.each_mut().map(Vec::as_mut_slice),
            m: self.m.each_mut().map(Vec::as_mut_slice),
            state: &mut self.state,
            layers: &mut self.layers,
            mass: &self.element_mass,
            alive: &self.alive,
            elements: &self.elements,
        };
        let mut vote = ElementVote::default();
        // SAFETY: the machine has the width, node arrays were checked just now, corners when they were taken in, and
        // arrays by slot were built in whole sets.
        unsafe {
            match width {
                #[cfg(target_arch = "x86_64")]
                Width::Avx2 => on_avx2(&mut view, &constants, &mut vote),
                #[cfg(target_arch = "x86_64")]
                Width::Avx512 => on_avx512(&mut view, &constants, &mut vote),
                _ => kernel::compute::<Scalar>(&mut view, &constants, &mut vote),
            }
        }
        vote
    }
}

/// # Safety
/// As [`kernel::compute`], on a machine with AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn on_avx2(view: &mut kernel::View<'_>, c: &kernel::Constants<'_>, vote: &mut ElementVote) {
    // SAFETY: handed on from the caller.
    unsafe { kernel::compute::<Avx2>(view, c, vote) }
}

/// # Safety
/// As [`kernel::compute`], on a machine with AVX-512 F and DQ.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
unsafe fn on_avx512(view: &mut kernel::View<'_>, c: &kernel::Constants<'_>, vote: &mut ElementVote) {
    // SAFETY: handed on from the caller.
    unsafe { kernel::compute::<Avx512>(view, c, vote) }
}
