//! The layers of a composite: plies whose fibres run at an angle to the axis of their element.
//!
//! A layer keeps its stress along its own axes. Those turn with the frame of the element, so a rigid turn leaves what it keeps to the bit; the
//! stress is brought to the frame for the sums through the thickness alone.

use super::{
    kernel::{Constants, SHEAR},
    layers::{Layers, Resultants, Strains},
};
use crate::{
    lanes::{Lane, SET},
    mesh::{Laminate, LaminateError, laminate::cosine_and_sine},
    strength::{
        ChangChang,
        chang_chang::{GONE, N_STRESSES, N_VARIABLES, Ply},
        plane_stress::Plane,
    },
};

/// Numbers of an element in front of those of its layers: the direction of angle 0 in its frame.
pub(super) const SHARED: usize = 2;
/// Numbers of a layer.
pub(super) const BY_LAYER: usize = N_VARIABLES;

/// The plies of a section, for the kernel.
#[derive(Clone, Copy)]
pub(super) struct Stack<'a> {
    ply: Ply,
    moduli: [f64; 3],
    wave: f64,
    /// Cosine and sine of the angle of each layer.
    turns: &'a [[f64; 2]],
}

/// The plies of the shells of a block.
pub(super) struct Stacked {
    law: ChangChang,
    turns: Vec<[f64; 2]>,
}

impl Stacked {
    /// The layers of a section with these points in a ply or through the thickness: their heights and weights beside them.
    ///
    /// # Errors
    /// [`LaminateError`].
    pub fn of(
        laminate: &Laminate,
        law: ChangChang,
        points: &[(f64, f64)],
    ) -> Result<(Self, Vec<(f64, f64)>), LaminateError> {
        let layers = laminate.layers(points)?;
        let turns = layers.iter().map(|layer| cosine_and_sine(layer.angle)).collect();
        Ok((Self { law, turns }, layers.iter().map(|layer| (layer.height, layer.weight)).collect()))
    }

    pub fn stack(&self) -> Stack<'_> {
        let (young, poisson) = self.law.in_all_directions();
        Stack {
            ply: Ply::new(&self.law, SHEAR),
            moduli: [young, poisson, 0.5 * (self.law.modulus_bc + self.law.modulus_ca)],
            wave: self.law.stiffest(),
            turns: &self.turns,
        }
    }

    /// Stress of a layer in the frame of its element, xx, yy, xy, yz, zx, by the direction of angle 0 and the numbers of the layer.
    pub fn stress(&self, point: usize, direction: [f64; 2], layer: impl Fn(usize) -> f64) -> [f64; 5] {
        let turn = Turn::of(direction.map(crate::lanes::scalar::Scalar), self.turns[point]);
        let plane = turn.to_frame(&std::array::from_fn(|i| crate::lanes::scalar::Scalar(layer(i))));
        [plane.xx.0, plane.yy.0, plane.xy.0, plane.yz.0, plane.zx.0]
    }
}

/// Number among those of a layer that says whether it is gone.
pub(super) const IS_GONE: usize = GONE;

/// The turn from the frame of an element to the axes of a layer.
struct Turn<L> {
    /// Cosine and sine.
    c: L,
    s: L,
    /// Their squares and products.
    cc: L,
    ss: L,
    cs: L,
}

impl<L: Lane> Turn<L> {
    #[inline(always)]
    fn of([x, y]: [L; 2], [c, s]: [f64; 2]) -> Self {
        let (cosine, sine) = (L::splat(c), L::splat(s));
        let c = sine.neg_mul_add(y, cosine * x);
        let s = sine.mul_add(x, cosine * y);
        Self { c, s, cc: c * c, ss: s * s, cs: c * s }
    }

    /// Strains along the axes of the layer, by those of the frame: xx, yy, and xy, yz, zx of shear as engineers have it.
    #[inline(always)]
    fn to_layer(&self, [xx, yy, xy, yz, zx]: &[L; N_STRESSES]) -> [L; N_STRESSES] {
        let (xx, yy, xy) = (*xx, *yy, *xy);
        let sheared = self.cs * xy;
        let twice = self.cs + self.cs;
        [
            self.cc.mul_add(xx, self.ss.mul_add(yy, sheared)),
            self.ss.mul_add(xx, self.cc.mul_add(yy, -sheared)),
            twice.mul_add(yy - xx, (self.cc - self.ss) * xy),
            self.s.neg_mul_add(*zx, self.c * *yz),
            self.c.mul_add(*zx, self.s * *yz),
        ]
    }

    /// Stress in the frame, by that along the axes of the layer: aa, bb, ab, bc, ca.
    #[inline(always)]
    fn to_frame(&self, [aa, bb, ab, bc, ca]: &[L; N_STRESSES]) -> Plane<L> {
        let (aa, bb, ab) = (*aa, *bb, *ab);
        let sheared = (self.cs + self.cs) * ab;
        Plane {
            xx: self.cc.mul_add(aa, self.ss.mul_add(bb, -sheared)),
            yy: self.ss.mul_add(aa, self.cc.mul_add(bb, sheared)),
            xy: self.cs.mul_add(aa - bb, (self.cc - self.ss) * ab),
            yz: self.s.mul_add(*ca, self.c * *bc),
            zx: self.s.neg_mul_add(*bc, self.c * *ca),
        }
    }
}

impl Layers for Stack<'_> {
    const SHARED: usize = SHARED;
    const BY_LAYER: usize = BY_LAYER;

    #[inline(always)]
    fn moduli(&self) -> [f64; 3] {
        self.moduli
    }

    #[inline(always)]
    fn wave(&self) -> f64 {
        self.wave
    }

    #[inline(always)]
    unsafe fn update<L: Lane>(
        state: &mut [f64],
        c: &Constants<'_, Self>,
        lane: usize,
        alive: L::Mask,
        h: L,
        rates: &Strains<L>,
        _elastic: &Strains<L>,
    ) -> (Resultants<L>, Resultants<L>, L) {
        let (zero, dt) = (L::splat(0.0), L::splat(c.dt));
        let (mut before, mut after) = (Resultants::none(), Resultants::none());
        let mut whole = zero;
        // SAFETY: the caller's promise.
        let direction = unsafe { [L::load(state, lane), L::load(state, SET + lane)] };
        let mut point = 0;
        while point < c.points.len() {
            let (height, weight) = c.points[point];
            let z = L::splat(0.5 * height) * h;
            let weight = L::splat(weight);
            let moment = weight * z;
            let first = (SHARED + point * BY_LAYER) * SET + lane;
            let mut old = [zero; BY_LAYER];
            let mut i = 0;
            while i < BY_LAYER {
                // SAFETY: the caller's promise.
                old[i] = unsafe { L::load(state, first + i * SET) };
                i += 1;
            }
            let turn = Turn::of(direction, c.law.turns[point]);
            let stress = turn.to_frame(&[old[0], old[1], old[2], old[3], old[4]]);
            before.add(weight, moment, &stress);
            if c.dt > 0.0 {
                let strain = [
                    dt * z.mul_add(rates.curvature[0], rates.membrane[0]),
                    dt * z.mul_add(rates.curvature[1], rates.membrane[1]),
                    dt * z.mul_add(rates.curvature[2], rates.membrane[2]),
                    dt * rates.shear[0],
                    dt * rates.shear[1],
                ];
                let mut new = old;
                let soft = c.law.ply.update(&mut new, &turn.to_layer(&strain));
                whole = whole + L::select(soft, zero, weight);
                let stress = turn.to_frame(&[new[0], new[1], new[2], new[3], new[4]]);
                after.add(weight, moment, &stress);
                let mut i = 0;
                while i < BY_LAYER {
                    // SAFETY: as above.
                    unsafe { L::select(alive, new[i], old[i]).store(state, first + i * SET) };
                    i += 1;
                }
            } else {
                // A pass that prepares a run leaves all to the bit.
                after.add(weight, moment, &stress);
                whole = whole + weight;
            }
            point += 1;
        }
        (before, after, whole)
    }
}
