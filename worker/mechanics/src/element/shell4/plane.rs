//! The points in the plane of a shell: one with hourglass control, or four that see every motion that strains the element.
//!
//! With four points (Gauss's, two by two) the patterns that one point does not see strain them: at a point the derivatives
//! `h_x`, `h_y` of `h = xi eta` times the rate of a pattern. In the plane and for the curvatures alike, with the rates `r_x`, `r_y` of the
//! patterns,
//!
//! `d_xx = h_x r_x - nu h_y r_y`, `d_yy = h_y r_y - nu h_x r_x`, `d_xy = 0`:
//!
//! the assumed strain of Belytschko and Bachrach (1986), with which an element bends in its plane as a beam does and does not lock. Nodal forces are the
//! exact conjugates. Over the element `h_x` and `h_y` have no mean, so constant strain and constant curvature leave the patterns at rest.

use super::{
    geometry::Geometry,
    kernel::{Constants, SHEAR},
    layers::{Layers, Resultants, Strains, hooke, scaled},
};
use crate::lanes::{Lane, SET};

/// Gauss's points of two by two.
pub(super) const FOUR: usize = 4;
/// Their coordinates `xi`, `eta`.
const PLACES: [[f64; 2]; FOUR] = [[-NEAR, -NEAR], [NEAR, -NEAR], [NEAR, NEAR], [-NEAR, NEAR]];
/// 1 / sqrt(3).
const NEAR: f64 = 0.577_350_269_189_625_8;

/// A point in the plane.
#[derive(Clone, Copy)]
struct Point<L> {
    /// Its share of the area.
    share: L,
    /// The derivatives of `xi eta` along x and y, times the area that belongs to this point.
    hx: L,
    hy: L,
}

impl<L: Lane> Point<L> {
    /// Adds what the stress at this point gives the patterns, over the thickness.
    #[inline(always)]
    fn press(&self, stress: &Resultants<L>, across: L, on: &mut [L; PATTERNS]) {
        let Self { hx, hy, .. } = *self;
        let Resultants { n: [n_xx, n_yy, _], m: [m_xx, m_yy, _], .. } = *stress;
        let [x, y, about_x, about_y] = *on;
        *on = [
            hx.mul_add(across.neg_mul_add(n_yy, n_xx), x),
            hy.mul_add(across.neg_mul_add(n_xx, n_yy), y),
            hy.neg_mul_add(across.neg_mul_add(m_xx, m_yy), about_x),
            hx.mul_add(across.neg_mul_add(m_yy, m_xx), about_y),
        ];
    }
}

/// The points of an element in one configuration.
struct Points<L> {
    /// `dx/dxi`, `dy/dxi`, `dx/deta`, `dy/deta` in the middle.
    along_xi: [L; 2],
    along_eta: [L; 2],
    /// The Jacobian is 1 plus this times `xi` and `eta`, over that in the middle.
    skew: [L; 2],
}

impl<L: Lane> Points<L> {
    #[inline(always)]
    fn of(g: &Geometry<L>) -> Self {
        let half = L::splat(0.5);
        // Half the diagonals, from corner 0 to 2 and from 3 to 1.
        let (t, d) = ([-(g.by[1] * g.area), g.bx[1] * g.area], [-(g.by[0] * g.area), g.bx[0] * g.area]);
        let along_xi = [half * (t[0] + d[0]), half * (t[1] + d[1])];
        let along_eta = [half * (t[0] - d[0]), half * (t[1] - d[1])];
        let [rx, ry] = g.warp;
        // Four over the area is one over the Jacobian in the middle.
        let inverse = L::splat(4.0) * g.inverse_area;
        let skew = [
            inverse * along_xi[1].neg_mul_add(rx, along_xi[0] * ry),
            inverse * along_eta[0].neg_mul_add(ry, along_eta[1] * rx),
        ];
        Self { along_xi, along_eta, skew }
    }

    #[inline(always)]
    fn at(&self, point: usize) -> Point<L> {
        let [xi, eta] = [L::splat(PLACES[point][0]), L::splat(PLACES[point][1])];
        let quarter = L::splat(0.25);
        let jacobian = xi.mul_add(self.skew[0], eta.mul_add(self.skew[1], L::splat(1.0)));
        Point {
            share: quarter * jacobian,
            hx: xi.neg_mul_add(self.along_xi[1], eta * self.along_eta[1]),
            hy: eta.neg_mul_add(self.along_eta[0], xi * self.along_xi[0]),
        }
    }
}

/// What the sections at the points of an element give in a step.
pub(super) struct Answer<L, const P: usize> {
    /// By point the sums of the stress after the step, with the viscous part.
    after: [Resultants<L>; P],
    /// Power of the stress without its viscous part, over the volume.
    pub power: L,
    /// The viscous part of the sums of the whole section, and of the forces on the patterns that the points see, on the geometry in the middle of
    /// the step.
    pub viscous: Resultants<L>,
    pub viscous_on_patterns: [L; PATTERNS],
    /// By what `n_xx + n_yy` rises in the step.
    pub rise: L,
    /// Share of the section that is elastic.
    pub elastic: L,
}

/// Patterns that four points see: of velocities along x and y, and of rotations about x and y.
pub(super) const PATTERNS: usize = 4;

impl<L: Lane, const P: usize> Answer<L, P> {
    /// The sums of the whole section with the viscous part, on the geometry of now.
    #[inline(always)]
    pub fn whole(&self, g: &Geometry<L>) -> Resultants<L> {
        if P == 1 {
            return self.after[0];
        }
        let points = Points::of(g);
        let mut whole = Resultants::none();
        let mut p = 0;
        while p < P {
            whole.add_share(points.at(p).share, &self.after[p]);
            p += 1;
        }
        whole
    }

    /// The forces on the patterns that the points see, on the geometry of now, of shells of this thickness.
    #[inline(always)]
    pub fn on_patterns(&self, g: &Geometry<L>, h: L, poisson: f64) -> [L; PATTERNS] {
        let points = Points::of(g);
        let across = L::splat(poisson);
        let mut by_thickness = [L::splat(0.0); PATTERNS];
        let mut p = 0;
        while p < P {
            points.at(p).press(&self.after[p], across, &mut by_thickness);
            p += 1;
        }
        times(h, &by_thickness)
    }
}

/// What stands for the greatest square of the gradients where points see the patterns too: theirs may be greater in an element that is far
/// from a parallelogram.
#[inline(always)]
pub(super) fn largest<L: Lane>(g: &Geometry<L>, of_gradients: L) -> L {
    let points = Points::of(g);
    let mut sum = L::splat(0.0);
    let mut p = 0;
    while p < FOUR {
        let Point { share, hx, hy } = points.at(p);
        sum = sum + hx.mul_add(hx, hy * hy) / share;
        p += 1;
    }
    // A pattern has the length 1/2: its stiffness on four quarters of the mass.
    of_gradients.max(L::splat(0.25) * g.inverse_area * g.inverse_area * sum)
}

/// Each of them times a factor.
#[inline(always)]
fn times<L: Lane>(factor: L, of: &[L; PATTERNS]) -> [L; PATTERNS] {
    [factor * of[0], factor * of[1], factor * of[2], factor * of[3]]
}

/// What the section at one point gives: as [`Answer`].
struct OfPoint<L> {
    after: Resultants<L>,
    power: L,
    viscous: Resultants<L>,
    rise: L,
    elastic: L,
}

/// Brings the layers of all points from `n-1` to `n`. `strains` are those of the middle, `rates` of the patterns, `g` the geometry in
/// the middle of the step, `lag` the time within which rates of strain give the viscous stress.
///
/// # Safety
/// As [`Layers::update`], of the layers of all `P` points, those of a point together.
#[inline(always)]
pub(super) unsafe fn update<L: Lane, W: Layers, const P: usize>(
    layers: &mut [f64],
    c: &Constants<'_, W>,
    lanes: (usize, L::Mask),
    lengths: (L, L),
    strains: &Strains<L>,
    rates: &[L; PATTERNS],
    g: &Geometry<L>,
) -> Answer<L, P> {
    if P == 1 {
        // SAFETY: handed on from the caller.
        let OfPoint { after, power, viscous, rise, elastic } =
            unsafe { at_point::<L, W>(layers, c, lanes, lengths, strains) };
        let viscous_on_patterns = [L::splat(0.0); PATTERNS];
        return Answer { after: [after; P], power, viscous, viscous_on_patterns, rise, elastic };
    }
    let zero = L::splat(0.0);
    let [_, poisson, _] = c.law.moduli();
    let mut answer = Answer {
        after: [Resultants::none(); P],
        power: zero,
        viscous: Resultants::none(),
        viscous_on_patterns: [zero; PATTERNS],
        rise: zero,
        elastic: zero,
    };
    let points = Points::of(g);
    let n_numbers = (W::SHARED + c.points.len() * W::BY_LAYER) * SET;
    let mut p = 0;
    while p < P {
        let at = points.at(p);
        let strains = strained(strains, rates, &at, g, poisson);
        let of_point = &mut layers[p * n_numbers..][..n_numbers];
        // SAFETY: handed on from the caller.
        let of_point = unsafe { at_point::<L, W>(of_point, c, lanes, lengths, &strains) };
        answer.after[p] = of_point.after;
        answer.power = at.share.mul_add(of_point.power, answer.power);
        answer.viscous.add_share(at.share, &of_point.viscous);
        at.press(&of_point.viscous, L::splat(poisson), &mut answer.viscous_on_patterns);
        answer.rise = at.share.mul_add(of_point.rise, answer.rise);
        answer.elastic = at.share.mul_add(of_point.elastic, answer.elastic);
        p += 1;
    }
    answer.viscous_on_patterns = times(lengths.0, &answer.viscous_on_patterns);
    answer
}

/// Brings the layers of one point from `n-1` to `n`.
///
/// # Safety
/// As [`Layers::update`].
#[inline(always)]
unsafe fn at_point<L: Lane, W: Layers>(
    layers: &mut [f64],
    c: &Constants<'_, W>,
    (lane, alive): (usize, L::Mask),
    (h, lag): (L, L),
    strains: &Strains<L>,
) -> OfPoint<L> {
    let [young, poisson, g_modulus] = c.law.moduli();
    let plate = young / (1.0 - poisson * poisson);
    let (stiff, coupled) = (L::splat(plate), L::splat(plate * poisson));
    let (shear, transverse) = (L::splat(g_modulus), L::splat(c.bends * SHEAR * g_modulus));
    let growth = Strains {
        membrane: hooke(stiff, coupled, shear, &strains.membrane),
        curvature: hooke(stiff, coupled, shear, &strains.curvature),
        shear: [transverse * strains.shear[0], transverse * strains.shear[1]],
    };
    // SAFETY: handed on from the caller.
    let (before, after, elastic) = unsafe { W::update(layers, c, lane, alive, h, strains, &growth) };
    let squares = L::splat(c.second_moment) * h * h;
    let viscous = Resultants {
        n: scaled(lag, &growth.membrane),
        m: scaled(lag * squares, &growth.curvature),
        q: [lag * growth.shear[0], lag * growth.shear[1]],
    };
    OfPoint {
        power: L::splat(0.5) * before.plus(&after).power(strains),
        viscous,
        rise: (after.n[0] - before.n[0]) + (after.n[1] - before.n[1]),
        after: after.plus(&viscous),
        elastic,
    }
}

/// The rates of strain at a point: those in the middle and what the patterns add.
#[inline(always)]
fn strained<L: Lane>(
    middle: &Strains<L>,
    [rx, ry, about_x, about_y]: &[L; PATTERNS],
    at: &Point<L>,
    g: &Geometry<L>,
    poisson: f64,
) -> Strains<L> {
    let inverse = g.inverse_area / at.share;
    let (hx, hy) = (at.hx * inverse, at.hy * inverse);
    let across = L::splat(poisson);
    let (x, y) = (hx * *rx, hy * *ry);
    // A rotation about y moves what is above the middle along x, one about x moves it against y.
    let (bent_x, bent_y) = (hx * *about_y, -(hy * *about_x));
    let [xx, yy, xy] = middle.membrane;
    let [bent_xx, bent_yy, bent_xy] = middle.curvature;
    Strains {
        membrane: [xx + across.neg_mul_add(y, x), yy + across.neg_mul_add(x, y), xy],
        curvature: [
            bent_xx + across.neg_mul_add(bent_y, bent_x),
            bent_yy + across.neg_mul_add(bent_x, bent_y),
            bent_xy,
        ],
        shear: middle.shear,
    }
}
