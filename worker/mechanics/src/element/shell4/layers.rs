//! The layers of a lane set of shells: their stress, and its sums through the thickness.

use super::kernel::Constants;
use crate::{
    lanes::{Lane, SET},
    strength::plane_stress::{Layer, Plane, PlaneLaw},
};

/// State of a layer: stress xx, yy, xy, yz, zx, plastic strain, temperature.
pub const LAYER: usize = 7;
/// Index of the plastic strain in the state of a layer, behind its stresses.
pub(super) const PLASTIC_STRAIN: usize = 5;
/// Index of its temperature.
pub(super) const TEMPERATURE: usize = 6;

/// What the layers of a kind of sections are made of: the kernel has a copy for each kind.
pub(super) trait Layers: Copy + Sync {
    /// Numbers that the layers of an element share, in front of their own.
    const SHARED: usize;
    /// Numbers of each layer.
    const BY_LAYER: usize;

    /// Young's modulus, Poisson's ratio and shear modulus of the section as a whole, by which hourglass control and damping go.
    fn moduli(&self) -> [f64; 3];

    /// Stiffness of the fastest wave in the plane (stress).
    fn wave(&self) -> f64;

    /// Brings the layers from `n-1` to `n`; `elastic` is how fast stress grows by [`Layers::moduli`]. Gives the sums of the stress before and
    /// after, and the share of the thickness that is elastic, or of plies that whose fibres hold.
    ///
    /// # Safety
    /// `state` holds the numbers of a set of all points, and the lanes from `lane` on are inside the set.
    unsafe fn update<L: Lane>(
        state: &mut [f64],
        c: &Constants<'_, Self>,
        lane: usize,
        alive: L::Mask,
        h: L,
        rates: &Strains<L>,
        elastic: &Strains<L>,
    ) -> (Resultants<L>, Resultants<L>, L);
}

impl Layers for PlaneLaw {
    const SHARED: usize = 0;
    const BY_LAYER: usize = LAYER;

    #[inline(always)]
    fn moduli(&self) -> [f64; 3] {
        [self.young, self.poisson, self.shear()]
    }

    #[inline(always)]
    fn wave(&self) -> f64 {
        self.young / (1.0 - self.poisson * self.poisson)
    }

    #[inline(always)]
    unsafe fn update<L: Lane>(
        state: &mut [f64],
        c: &Constants<'_, Self>,
        lane: usize,
        alive: L::Mask,
        h: L,
        rates: &Strains<L>,
        elastic: &Strains<L>,
    ) -> (Resultants<L>, Resultants<L>, L) {
        let (zero, one, dt) = (L::splat(0.0), L::splat(1.0), L::splat(c.dt));
        let rise = Strains {
            membrane: scaled(dt, &elastic.membrane),
            curvature: scaled(dt, &elastic.curvature),
            shear: [dt * elastic.shear[0], dt * elastic.shear[1]],
        };
        let (mut before, mut after) = (Resultants::none(), Resultants::none());
        let mut whole = zero;
        let mut point = 0;
        while point < c.points.len() {
            let (height, weight) = c.points[point];
            let z = L::splat(0.5 * height) * h;
            let weight = L::splat(weight);
            let moment = weight * z;
            let first = point * LAYER * SET + lane;
            let mut old = [zero; LAYER];
            let mut i = 0;
            while i < LAYER {
                // SAFETY: the caller's promise.
                old[i] = unsafe { L::load(state, first + i * SET) };
                i += 1;
            }
            let [xx, yy, xy, yz, zx, plastic_strain, temperature] = old;
            before.add(weight, moment, &Plane { xx, yy, xy, yz, zx });
            let stress = Plane {
                xx: z.mul_add(rise.curvature[0], xx + rise.membrane[0]),
                yy: z.mul_add(rise.curvature[1], yy + rise.membrane[1]),
                xy: z.mul_add(rise.curvature[2], xy + rise.membrane[2]),
                yz: yz + rise.shear[0],
                zx: zx + rise.shear[1],
            };
            let mut layer = Layer { stress, plastic_strain, temperature };
            let strained = [
                z.mul_add(rates.curvature[0], rates.membrane[0]),
                z.mul_add(rates.curvature[1], rates.membrane[1]),
                z.mul_add(rates.curvature[2], rates.membrane[2]),
            ];
            let yields = c.law.update(&mut layer, &strained);
            let (mut soft, mut s) = (yields, layer.stress);
            if let Some(limit) = c.breaks {
                let broken = L::splat(limit).less_equal(layer.plastic_strain);
                soft = L::either(yields, broken);
                let left = L::select(broken, zero, one);
                s = Plane {
                    xx: s.xx * left,
                    yy: s.yy * left,
                    xy: s.xy * left,
                    yz: s.yz * left,
                    zx: s.zx * left,
                };
            }
            whole = whole + L::select(soft, zero, weight);
            after.add(weight, moment, &s);
            let stress = [s.xx, s.yy, s.xy, s.yz, s.zx];
            let mut i = 0;
            while i < PLASTIC_STRAIN {
                // SAFETY: the caller's promise.
                unsafe { L::select(alive, stress[i], old[i]).store(state, first + i * SET) };
                i += 1;
            }
            // Plastic strain and temperature stand where nothing yields.
            if L::any(yields) {
                // SAFETY: as above.
                unsafe {
                    let kept = L::select(alive, layer.plastic_strain, plastic_strain);
                    kept.store(state, first + PLASTIC_STRAIN * SET);
                    L::select(alive, layer.temperature, temperature).store(state, first + TEMPERATURE * SET);
                }
            }
            point += 1;
        }
        (before, after, whole)
    }
}

/// What happens to the section of an element: rates of strain xx, yy, xy of the middle surface, the same by height above it, and rates of
/// transverse shear yz, zx.
#[derive(Clone, Copy)]
pub(super) struct Strains<L> {
    pub membrane: [L; 3],
    pub curvature: [L; 3],
    pub shear: [L; 2],
}

/// Sums of the stress through the thickness, over it: forces, moments and transverse forces.
#[derive(Clone, Copy)]
pub(super) struct Resultants<L> {
    pub n: [L; 3],
    pub m: [L; 3],
    pub q: [L; 2],
}

impl<L: Lane> Resultants<L> {
    #[inline(always)]
    pub fn none() -> Self {
        let zero = L::splat(0.0);
        Self { n: [zero; 3], m: [zero; 3], q: [zero; 2] }
    }

    /// Adds the stress of a layer by its weight and that times its height.
    #[inline(always)]
    pub fn add(&mut self, weight: L, moment: L, stress: &Plane<L>) {
        let in_plane = [stress.xx, stress.yy, stress.xy];
        let mut i = 0;
        while i < 3 {
            self.n[i] = weight.mul_add(in_plane[i], self.n[i]);
            self.m[i] = moment.mul_add(in_plane[i], self.m[i]);
            i += 1;
        }
        self.q = [weight.mul_add(stress.yz, self.q[0]), weight.mul_add(stress.zx, self.q[1])];
    }

    /// Adds a share of others.
    #[inline(always)]
    pub fn add_share(&mut self, share: L, other: &Self) {
        let mut i = 0;
        while i < 3 {
            self.n[i] = share.mul_add(other.n[i], self.n[i]);
            self.m[i] = share.mul_add(other.m[i], self.m[i]);
            i += 1;
        }
        self.q = [share.mul_add(other.q[0], self.q[0]), share.mul_add(other.q[1], self.q[1])];
    }

    #[inline(always)]
    pub fn plus(&self, other: &Self) -> Self {
        let mut both = *self;
        let mut i = 0;
        while i < 3 {
            both.n[i] = self.n[i] + other.n[i];
            both.m[i] = self.m[i] + other.m[i];
            i += 1;
        }
        both.q = [self.q[0] + other.q[0], self.q[1] + other.q[1]];
        both
    }

    /// Power per volume.
    #[inline(always)]
    pub fn power(&self, rates: &Strains<L>) -> L {
        let sheared = self.q[0].mul_add(rates.shear[0], self.q[1] * rates.shear[1]);
        (sum(&self.n, &rates.membrane) + sum(&self.m, &rates.curvature)) + sheared
    }
}

/// Stress xx, yy, xy of an elastic plate by its strain.
#[inline(always)]
pub(super) fn hooke<L: Lane>(stiff: L, coupled: L, shear: L, strain: &[L; 3]) -> [L; 3] {
    let [xx, yy, xy] = *strain;
    [stiff.mul_add(xx, coupled * yy), stiff.mul_add(yy, coupled * xx), shear * xy]
}

/// Three numbers times a factor.
#[inline(always)]
pub(super) fn scaled<L: Lane>(factor: L, a: &[L; 3]) -> [L; 3] {
    [factor * a[0], factor * a[1], factor * a[2]]
}

/// Sum of products of three.
#[inline(always)]
pub(super) fn sum<L: Lane>(a: &[L; 3], b: &[L; 3]) -> L {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}
