//! The radial return to a yield stress that bends with the plastic strain.

use super::{Deviator, History, StrengthLaw};
use crate::lanes::Lane;

/// Most steps. The difference is convex or concave in the increment, so steps from zero come from one side.
const STEPS: usize = 12;
/// A lane stops after a step of this part of its increment: the next would be smaller than its rounding.
const SMALL: f64 = 1e-9;

/// The implicit return `sigma - 3 G d = Y(e + d)` of the lanes that yield, by Newton's steps: `sigma` is von Mises' stress of the trial, `factor` the
/// law's own of rate and temperature.
#[inline(always)]
pub(super) fn returned<L: Lane, S: StrengthLaw>(
    law: &S,
    trial: &Deviator<L>,
    sigma: L,
    factor: L,
    yields: L::Mask,
    history: &mut History<L>,
) -> Deviator<L> {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let before = history.plastic_strain;
    let three_g = L::splat(3.0 * law.shear());
    let mut slip = zero;
    let mut open = yields;
    let mut step = 0;
    while step < STEPS && L::any(open) {
        let (flow, slope) = law.flow(before + slip, factor);
        let change = (three_g.neg_mul_add(slip, sigma) - flow) / (three_g + slope);
        slip = L::select(open, slip + change, slip);
        open = L::both(open, (L::splat(SMALL) * slip).less(change.abs()));
        step += 1;
    }
    history.plastic_strain = before + slip;
    let left = three_g.neg_mul_add(slip, sigma).max(zero) / sigma;
    trial.scaled(L::select(yields, left, one))
}
