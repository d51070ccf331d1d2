//! Von Mises yield with the saturating hardening of Voce (1948): `Y = yield_stress + q (1 - e^(-b e))`, e the plastic strain.
//!
//! E. Voce, The relationship between stress and strain for homogeneous deformation, J. Inst. Metals 74 (1948) 537.

use super::{Deviator, History, Strain, StrengthLaw, newton};
use crate::{
    lanes::{Lane, functions::exp},
    law::declared,
};

declared! {
    /// Constants of the law.
    pub struct Voce = "voce" {
        /// G (stress).
        shear: STRESS, Positive;
        /// Initial yield stress.
        yield_stress: STRESS, Positive;
        /// What hardening adds to it in the end (stress).
        q: STRESS, NotNegative;
        /// How fast: after a plastic strain of `1/b`, 63 % of it.
        b: NONE, NotNegative;
    }
}

impl StrengthLaw for Voce {
    #[inline(always)]
    fn shear(&self) -> f64 {
        self.shear
    }

    #[inline(always)]
    fn flow<L: Lane>(&self, strain: L, factor: L) -> (L, L) {
        let (q, b) = (L::splat(self.q), L::splat(self.b));
        let left = q * exp(-(b * strain));
        ((L::splat(self.yield_stress) + (q - left)) * factor, b * left * factor)
    }

    #[inline(always)]
    fn least_flow<L: Lane>(&self, _strain: L, _temperature: L) -> L {
        L::splat(self.yield_stress)
    }

    #[inline(always)]
    fn update<L: Lane>(
        &self,
        trial: Deviator<L>,
        _strain: Strain<L>,
        history: &mut History<L>,
        active: L::Mask,
    ) -> Deviator<L> {
        let one = L::splat(1.0);
        let sigma = trial.mises_square().sqrt();
        let yields = self.flow(history.plastic_strain, one).0.less(sigma);
        if !L::any(L::both(yields, active)) {
            return trial;
        }
        newton::returned(self, &trial, sigma, one, yields, history)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        block::Block,
        element::{ElementVote, Step},
        exact::Quantum,
        lanes::{Width, scalar::Scalar},
        material::{Eos, Failure, Material, Strength},
        mesh::Topology,
        piece::Piece,
        state::{ShellState, field},
        strength::plane_stress::{Layer, Plane, PlaneLaw, sheared},
    };

    /// AA6061-like.
    const LAW: Voce = Voce { shear: 26e9, yield_stress: 240e6, q: 120e6, b: 14.0 };

    fn closed_form(strain: f64) -> f64 {
        LAW.yield_stress + LAW.q * (1.0 - (-LAW.b * strain).exp())
    }

    #[test]
    fn one_step_of_any_size_ends_on_the_curve() {
        for before in [0.0, 0.02, 0.3] {
            for overshoot in [1e3, 1e7, 1e9, 3e10] {
                let sigma = closed_form(before) + overshoot;
                let mut trial = Deviator::<Scalar>::zero();
                trial.xy = Scalar(sigma / 3f64.sqrt());
                let mut history = History { plastic_strain: Scalar(before), temperature: Scalar(0.0) };
                let strain = Strain { rate: Scalar(1.0), increment: Scalar(1e-3) };
                let stress = LAW.update(trial, strain, &mut history, true).mises_square().0.sqrt();
                let after = history.plastic_strain.0;
                assert!((stress / closed_form(after) - 1.0).abs() < 1e-9, "{before} {overshoot}: {stress}");
                let elastic = (sigma - stress) / (3.0 * LAW.shear);
                assert!(((after - before) / elastic - 1.0).abs() < 1e-6, "{before} {overshoot}: {after}");
            }
        }
    }

    #[test]
    fn a_lane_inside_the_surface_comes_back_to_the_bit() {
        let mut trial = Deviator::<Scalar>::zero();
        trial.xy = Scalar(0.999_999 * closed_form(0.1) / 3f64.sqrt());
        let mut history = History { plastic_strain: Scalar(0.1), temperature: Scalar(0.0) };
        let strain = Strain { rate: Scalar(1.0), increment: Scalar(1e-3) };
        let back = LAW.update(trial, strain, &mut history, true);
        assert_eq!(back.xy.0.to_bits(), trial.xy.0.to_bits());
        assert_eq!(history.plastic_strain.0.to_bits(), 0.1f64.to_bits());
    }

    fn aluminium() -> Material {
        let eos = Eos::Linear { bulk: 70e9 };
        let strength = Strength::Voce(LAW);
        Material { name: "aluminium".into(), density: 2700.0, eos, strength, failure: Failure::None }
    }

    #[test]
    fn a_layer_in_plane_stress_returns_to_the_curve_by_what_elasticity_leaves() {
        let law = PlaneLaw::of(&aluminium()).expect("a law that layers know");
        let zero = Scalar(0.0);
        for overshoot in [1.001, 1.5, 4.0, 16.0] {
            let trial = overshoot * LAW.yield_stress;
            let stress = Plane { xx: zero, yy: zero, xy: Scalar(trial / 3f64.sqrt()), yz: zero, zx: zero };
            let mut layer = Layer { stress, plastic_strain: zero, temperature: zero };
            assert!(law.update(&mut layer, &sheared(0.0)));
            let (strain, stress) = (layer.plastic_strain.0, layer.stress.xy.0 * 3f64.sqrt());
            assert!((stress / closed_form(strain) - 1.0).abs() < 1e-9, "{overshoot}: {stress}");
            let elastic = (trial - stress) / (3.0 * LAW.shear);
            assert!((strain / elastic - 1.0).abs() < 1e-6, "{overshoot}: {strain} {elastic}");
        }
    }

    /// A unit cube that is squeezed along x to 40 % of its height in 6000 steps.
    #[test]
    fn an_element_hardens_along_the_curve_until_it_is_saturated() {
        let material = aluminium();
        let corner = |n: u32| [n % 2, n / 2 % 2, n / 4].map(f64::from);
        let mut block = Block::new(&Piece {
            part: 0,
            material: 0,
            topology: Topology::Structured { cells: [1; 3] },
            nodes: (0..8).collect(),
            elements: vec![0],
            x: (0..8).map(corner).collect(),
            v: (0..8).map(|n| [-corner(n)[0], 0.0, 0.0]).collect(),
            mass: vec![1.0; 8],
            constraint: vec![0; 8],
            initial_volume: vec![1.0],
            fields: std::array::from_fn(|k| vec![if k == field::RELATIVE_VOLUME { 1.0 } else { 0.0 }]),
            erosion: None,
            history: Vec::new(),
            contact: Vec::new(),
            shells: ShellState::default(),
            own: Vec::new(),
            hourglass: crate::element::hourglass::Hourglass::VISCOUS,
        });
        let step = Step {
            dt: 1e-4,
            linear_viscosity: 0.0,
            quadratic_viscosity: 0.0,
            force_quantum: Quantum::for_reference(1e12, 42),
            energy_quantum: Quantum::for_reference(1e12, 40),
            arm: 1.0,
        };
        let mut last = 0.0;
        for n in 1..=6000 {
            for (x, v) in block.x[0].iter_mut().zip(&block.v[0]) {
                *x += step.dt * v;
            }
            let mut vote = ElementVote::default();
            block.compute(&material, std::slice::from_ref(&(0..1)), &step, Width::best(), &mut vote);
            assert!(vote.fault.is_none(), "{:?}", vote.fault);
            if n % 500 == 0 {
                let strain = block.field(0, field::PLASTIC_STRAIN);
                let mises = 1.5 * block.field(0, field::SXX).abs();
                assert!((mises / closed_form(strain) - 1.0).abs() < 1e-9, "{strain}: {mises}");
                // Two thirds of the logarithmic strain, less what is elastic.
                let total = -2.0 / 3.0 * block.x[0][1].ln();
                let plastic = total - mises / (3.0 * LAW.shear);
                assert!((strain - plastic).abs() < 1e-4 * total, "{strain} of {plastic}");
                last = mises;
            }
        }
        assert!((last / (LAW.yield_stress + LAW.q) - 1.0).abs() < 1e-3, "{last}");
    }
}
