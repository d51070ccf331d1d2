//! One cycle of a lane set of shells, from gather to scatter.

use std::ops::Range;

use super::{
    geometry::{Geometry, Opposed, dot},
    layers::{Layers, Resultants, Strains, sum},
    plane::{self, PATTERNS},
};
use crate::{
    element::{ElementVote, Fault, vector::Vector},
    exact,
    lanes::{Lane, SET, dispatch::Task},
};

/// State of an element beside its layers: hourglass forces of membrane x and y, bending about x and y, deflection and
/// twist; thickness; internal energy; hourglass energy; the viscous part of the sums of its section and of its hourglass forces.
pub const ELEMENT: usize = VISCOUS + SUMS + HOURGLASS_FORCES;
/// Index of the thickness in the state of an element.
pub const THICKNESS: usize = 6;
pub(crate) const INTERNAL: usize = 7;
pub(crate) const HOURGLASS: usize = 8;
/// The first number of the viscous part. It is kept because that of the step before works until `t_n`: with what the rates of now give alone,
/// the heat of a swing of frequency `w` would be `2 / (1 + cos(w dt))` times as much as the swing loses.
const VISCOUS: usize = 9;
/// Sums of the stress of a section.
const SUMS: usize = 8;
const HOURGLASS_FORCES: usize = 6;

/// Shear correction of a homogeneous plate.
pub(crate) const SHEAR: f64 = 5.0 / 6.0;
/// Share of the hourglass stiffness left where all layers yield. More of it carries load: benches/TRIED.md has a tube of three meshes.
const SOFT: f64 = 0.02;
/// The section and hourglass control resist rates of strain: by what an elastic section gains in stress within this part of a step. A
/// swing of frequency `w` loses `DAMPING (w dt)^2` of its energy in a cycle so. Without it the stresses by which elements of a
/// shaken sheet hold each other drift, because they are sums over half steps: a free sheet of 2 by 2 elastic elements that shakes with
/// 10 m/s comes to 4.9 times its energy within 200,000 cycles.
const DAMPING: f64 = 2e-4;

/// The arrays of a block as the kernel sees them.
pub(super) struct View<'a> {
    pub corners: &'a [Vec<u32>; 4],
    pub x: [&'a [f64]; 3],
    pub v: [&'a [f64]; 3],
    pub w: [&'a [f64]; 3],
    pub f: [&'a mut [f64]; 3],
    pub m: [&'a mut [f64]; 3],
    /// By lane set: `ELEMENT` fields, then those of the layers of each point in the plane.
    pub state: &'a mut [f64],
    pub mass: &'a [f64],
    pub alive: &'a [u8],
    pub elements: &'a [u32],
}

/// What does not change from element to element.
#[derive(Clone, Copy)]
pub(super) struct Constants<'a, W> {
    pub law: W,
    pub points: &'a [(f64, f64)],
    /// Share of the strain across the thickness that the thickness follows.
    pub thinning: f64,
    /// Plastic strain at which a layer breaks.
    pub breaks: Option<f64>,
    /// 1, or 0 of a membrane, which neither bends nor shears across its thickness.
    pub bends: f64,
    /// Mean square of the heights of the points over the square of the thickness: 1/12, and 0 of one point.
    pub second_moment: f64,
    pub dt: f64,
    pub force_magic: f64,
    pub moment_magic: f64,
    /// Force quantum over moment quantum (1/length).
    pub inverse_arm: f64,
    pub energy_magic: f64,
}

/// The elements of some sets, with `P` points in the plane.
pub(super) struct Pass<'a, W, const P: usize> {
    view: View<'a>,
    constants: &'a Constants<'a, W>,
    sets: &'a [Range<u32>],
    vote: &'a mut ElementVote,
}

impl<'a, W: Layers, const P: usize> Pass<'a, W, P> {
    /// # Safety
    /// As [`compute`].
    pub unsafe fn new(
        view: View<'a>,
        constants: &'a Constants<'a, W>,
        sets: &'a [Range<u32>],
        vote: &'a mut ElementVote,
    ) -> Self {
        Self { view, constants, sets, vote }
    }
}

impl<W: Layers, const P: usize> Task for Pass<'_, W, P> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane>(self) {
        // Copies of its own, as the pass of hexahedra has them.
        let Self { mut view, constants, sets, vote } = self;
        let (constants, mut own) = (*constants, *vote);
        // SAFETY: whoever made the pass has promised it.
        unsafe { compute::<L, W, P>(&mut view, &constants, sets, &mut own) }
        *vote = own;
    }
}

/// The sets of these ranges.
///
/// # Safety
/// Every array by slot holds all sets of the ranges, and every corner is inside the node arrays.
#[inline(always)]
unsafe fn compute<L: Lane, W: Layers, const P: usize>(
    view: &mut View<'_>,
    c: &Constants<'_, W>,
    sets: &[Range<u32>],
    vote: &mut ElementVote,
) {
    for range in sets {
        let mut slot = range.start as usize * SET;
        while slot < range.end as usize * SET {
            // SAFETY: handed on from the caller.
            unsafe { slots::<L, W, P>(view, c, slot, vote) };
            slot += L::N;
        }
    }
}

/// # Safety
/// As [`compute`].
#[inline(always)]
unsafe fn gather<L: Lane>(view: &View<'_>, from: &[&[f64]; 3], slot: usize) -> [Vector<L>; 4] {
    let zero = L::splat(0.0);
    let mut corners = [Vector { x: zero, y: zero, z: zero }; 4];
    let mut i = 0;
    while i < 4 {
        let nodes = &view.corners[i];
        // SAFETY: the caller's promise.
        corners[i] = unsafe {
            Vector {
                x: L::gather(from[0], nodes, slot),
                y: L::gather(from[1], nodes, slot),
                z: L::gather(from[2], nodes, slot),
            }
        };
        i += 1;
    }
    corners
}

/// # Safety
/// As [`compute`].
#[inline(always)]
unsafe fn slots<L: Lane, W: Layers, const P: usize>(
    view: &mut View<'_>,
    c: &Constants<'_, W>,
    slot: usize,
    vote: &mut ElementVote,
) {
    let (zero, one, half, quarter) = (L::splat(0.0), L::splat(1.0), L::splat(0.5), L::splat(0.25));
    let minus = L::splat(-1.0);
    let dt = L::splat(c.dt);
    // SAFETY: slots and corners are inside, says the caller.
    let (x, v, w, mass) = unsafe {
        (
            gather::<L>(view, &view.x, slot),
            gather::<L>(view, &view.v, slot),
            gather::<L>(view, &view.w, slot),
            L::load(view.mass, slot),
        )
    };
    let alive = L::mask(u32::from(view.alive[slot / SET]) >> (slot % SET));
    let lane = slot % SET;
    let n_numbers = (ELEMENT + P * (W::SHARED + c.points.len() * W::BY_LAYER)) * SET;
    let (own, of_layers) = view.state[slot / SET * n_numbers..][..n_numbers].split_at_mut(ELEMENT * SET);
    let mut state = [zero; VISCOUS];
    let mut i = 0;
    while i < VISCOUS {
        // SAFETY: slots are inside.
        state[i] = unsafe { L::load(own, i * SET + lane) };
        i += 1;
    }
    let h = state[THICKNESS];

    // 1. Velocity strains in the frame of the middle of the step.
    let mut mid = x;
    let mut i = 0;
    while i < 4 {
        mid[i] = v[i].neg_mul_add(half * dt, &x[i]);
        i += 1;
    }
    let g = Geometry::of(&mid);
    let ([vx, vy, vz], [warp_x, warp_y, warp_z]) = opposed_in(&g.e, &v);
    let [wx, wy, wz] = corners_in(&g.e, &w);
    // In-plane velocity of the fibers, w x p.
    let (mut sx, mut sy) = ([zero; 4], [zero; 4]);
    let mut i = 0;
    while i < 4 {
        sx[i] = wz[i].neg_mul_add(g.py[i], wy[i]);
        sy[i] = wz[i].mul_add(g.px[i], -wx[i]);
        i += 1;
    }
    let (mean_sx, mean_sy) =
        (quarter * ((sx[0] + sx[1]) + (sx[2] + sx[3])), quarter * ((sy[0] + sy[1]) + (sy[2] + sy[3])));
    let (warp_wx, warp_wy) =
        (quarter * ((wx[0] - wx[1]) + (wx[2] - wx[3])), quarter * ((wy[0] - wy[1]) + (wy[2] - wy[3])));
    let (sx, sy, wx, wy) = (opposed(&sx), opposed(&sy), opposed(&wx), opposed(&wy));
    let membrane = [dot(&g.bx, &vx), dot(&g.by, &vy), dot(&g.by, &vx) + dot(&g.bx, &vy)];
    let curvature = [
        dot(&g.cx, &vx) + dot(&g.bx, &sx),
        dot(&g.cy, &vy) + dot(&g.by, &sy),
        (dot(&g.cy, &vx) + dot(&g.cx, &vy)) + (dot(&g.by, &sx) + dot(&g.bx, &sy)),
    ];
    let (tilt_x, tilt_y) = (dot(&g.bx, &vz), dot(&g.by, &vz));
    let (shear_x, shear_y) = (mean_sx + tilt_x, mean_sy + tilt_y);
    let (bend_xx, bend_yy) = (-dot(&g.bx, &wy), dot(&g.by, &wx));
    let (turn_x, turn_y) = (dot(&g.bx, &wx), dot(&g.by, &wy));
    let twist = half * (turn_x - turn_y);
    // What the curvatures alone make of the deflection is neither shear nor hourglass.
    let curvatures = [half * bend_xx, twist, half * bend_yy];
    let bent =
        [sum(&g.curved[0], &curvatures), sum(&g.curved[1], &curvatures), sum(&g.curved[2], &curvatures)];
    let (shear_x, shear_y) = (shear_x - bent[1], shear_y - bent[2]);
    let rates = [
        g.gz.mul_add(tilt_x, warp_x - dot(&g.lean, &vx)),
        g.gz.mul_add(tilt_y, warp_y - dot(&g.lean, &vy)),
        warp_wx - dot(&g.lean, &wx),
        warp_wy - dot(&g.lean, &wy),
        (warp_z - dot(&g.lean, &vz)) - bent[0],
        turn_x + turn_y,
    ];

    // 2. Stress of the layers, thinning, energy.
    let [young, poisson, g_modulus] = c.law.moduli();
    let strains = Strains { membrane, curvature, shear: [shear_y, shear_x] };
    let lag = L::splat(DAMPING) * dt;
    let patterns = [rates[0], rates[1], rates[2], rates[3]];
    // SAFETY: slots are inside.
    let answer =
        unsafe { plane::update::<L, W, P>(of_layers, c, (lane, alive), (h, lag), &strains, &patterns, &g) };
    let power = answer.power;
    // SAFETY: slots are inside.
    let damped = half * unsafe { both_viscous(own, lane, alive, &answer.viscous) }.power(&strains);
    // Strain across the thickness: its elastic part by Hooke, its plastic part keeps the volume.
    let thinning =
        L::splat((1.0 - 2.0 * poisson) / young).mul_add(answer.rise, -(dt * (membrane[0] + membrane[1])));

    // 3. Hourglass forces grow with their patterns, more softly where layers yield.
    let (bxx, byy, largest) = g.squares();
    let h3 = h * h * h;
    let membrane_k = L::splat(4.0 / 3.0 * young) * h * g.area;
    let bending_k = L::splat(c.bends * young / 9.0) * h3 * g.area;
    let shear_k = L::splat(SHEAR * g_modulus) * h3;
    let stiffness = [
        membrane_k * bxx,
        membrane_k * byy,
        bending_k * byy,
        bending_k * bxx,
        L::splat(8.0 / 3.0) * shear_k * g.inverse_area,
        L::splat(c.bends / 24.0) * shear_k * g.area,
    ];
    let share = answer.elastic.max(L::splat(SOFT));
    let (mut hourglass_power, mut hourglass_damped) = (zero, zero);
    let mut resisting = [zero; HOURGLASS_FORCES];
    // Those that points in the plane see are no hourglass.
    let seen = if P == 1 { 0 } else { PATTERNS };
    let mut pattern = 0;
    while pattern < seen {
        // SAFETY: slots are inside.
        let both = unsafe {
            with_last(own, VISCOUS + SUMS + pattern, lane, alive, answer.viscous_on_patterns[pattern])
        };
        hourglass_damped = (half * both).mul_add(rates[pattern], hourglass_damped);
        pattern += 1;
    }
    while pattern < HOURGLASS_FORCES {
        let (old, rate) = (state[pattern], rates[pattern]);
        let rise = stiffness[pattern] * rate;
        // A force falls by the whole stiffness, as it would else give back more than it has taken; what it rises by is soft.
        let whole = dt.mul_add(rise, old);
        let fallen = old.min(whole).max(old.max(whole).min(zero));
        let new = share.mul_add(whole - fallen, fallen);
        hourglass_power = (half * (new + old)).mul_add(rate, hourglass_power);
        // SAFETY: slots are inside.
        let both = unsafe { with_last(own, VISCOUS + SUMS + pattern, lane, alive, lag * rise) };
        hourglass_damped = (half * both).mul_add(rate, hourglass_damped);
        state[pattern] = new;
        resisting[pattern] = lag.mul_add(rise, new);
        pattern += 1;
    }
    let spent = dt * hourglass_power;
    let heat = dt * (h * g.area).mul_add(damped, hourglass_damped);
    state[INTERNAL] = (dt * h * g.area).mul_add(power, state[INTERNAL]) + heat;
    state[HOURGLASS] = state[HOURGLASS] + spent;
    state[THICKNESS] = h * (one + L::splat(c.thinning) * thinning);
    let h = state[THICKNESS];

    // 4. Forces and moments on the geometry of now, conjugate to the rates above.
    let g = Geometry::of(&x);
    let [e1, e2, e3] = g.e;
    let volume = h * g.area;
    let flat = (g.least.min(h)).less_equal(zero);
    let finite = (power + state[INTERNAL]).abs().less(L::splat(f64::MAX));
    let computed = L::both(alive, finite);
    let faults = L::bits(alive) & (L::bits(flat) | !L::bits(finite));
    let Resultants { n: [n_xx, n_yy, n_xy], m: [m_xx, m_yy, m_xy], q: [q_y, q_x] } = answer.whole(&g);
    if P > 1 {
        let seen = answer.on_patterns(&g, h, poisson);
        let mut pattern = 0;
        while pattern < PATTERNS {
            resisting[pattern] = seen[pattern];
            pattern += 1;
        }
    }
    let [hx, hy, hwx, hwy, hq, ht] = resisting;
    // Deflection forces on the curvatures xx, xy and yy.
    let mut bent = [zero; 3];
    let mut i = 0;
    while i < 3 {
        let sheared = q_x.mul_add(g.curved[1][i], q_y * g.curved[2][i]);
        bent[i] = volume.mul_add(sheared, hq * g.curved[0][i]);
        i += 1;
    }
    // Parts of opposite sign in opposite corners, by component in the frame.
    let (mut fx, mut fy, mut fz) = ([zero; 2], [zero; 2], [zero; 2]);
    let (mut tx, mut ty, mut mx, mut my) = ([zero; 2], [zero; 2], [zero; 2], [zero; 2]);
    let mut i = 0;
    while i < 2 {
        let (bx, by, cx, cy, lean) = (g.bx[i], g.by[i], g.cx[i], g.cy[i], g.lean[i]);
        let stretching = n_xx.mul_add(bx, n_xy.mul_add(by, m_xx.mul_add(cx, m_xy * cy)));
        fx[i] = volume.mul_add(stretching, -(hx * lean));
        let stretching = n_yy.mul_add(by, n_xy.mul_add(bx, m_yy.mul_add(cy, m_xy * cx)));
        fy[i] = volume.mul_add(stretching, -(hy * lean));
        let tilted = g.gz.mul_add(hx.mul_add(bx, hy * by), -(hq * lean));
        fz[i] = volume.mul_add(q_x.mul_add(bx, q_y * by), tilted);
        tx[i] = volume * m_xx.mul_add(bx, m_xy * by);
        ty[i] = volume * m_yy.mul_add(by, m_xy * bx);
        let about_x = half * bent[1].mul_add(bx, bent[2] * by);
        let about_y = half * bent[1].mul_add(by, bent[0] * bx);
        mx[i] = ht.mul_add(bx, -hwx.mul_add(lean, ty[i] + about_x));
        my[i] = ht.mul_add(by, hwy.neg_mul_add(lean, tx[i] + about_y));
        i += 1;
    }
    let share = quarter * volume;
    let (even_x, even_y) = (share * q_x, share * q_y);
    let (tx, ty) = (at_corners(&tx, even_x, even_x), at_corners(&ty, even_y, even_y));
    let (hwx, hwy) = (quarter * hwx, quarter * hwy);
    let mx = at_corners(&mx, hwx - even_y, -(hwx + even_y));
    let my = at_corners(&my, even_x + hwy, even_x - hwy);
    // In space; what the element resists with acts on the nodes the other way.
    let (back1, back2, back3) = (e1.scaled(minus), e2.scaled(minus), e3.scaled(minus));
    let mut part = [Vector { x: zero, y: zero, z: zero }; 2];
    let mut i = 0;
    while i < 2 {
        part[i] = back1.mul_add(fx[i], &back2.mul_add(fy[i], &back3.scaled(fz[i])));
        i += 1;
    }
    let pattern = back1.mul_add(hx, &back2.mul_add(hy, &back3.scaled(hq))).scaled(quarter);
    let mut forces = [
        at_corners(&[part[0].x, part[1].x], pattern.x, -pattern.x),
        at_corners(&[part[0].y, part[1].y], pattern.y, -pattern.y),
        at_corners(&[part[0].z, part[1].z], pattern.z, -pattern.z),
    ];
    let mut moments = [[zero; 4]; 3];
    let mut i = 0;
    while i < 4 {
        let mz = g.px[i].mul_add(ty[i], -(g.py[i] * tx[i]));
        let m = back1.mul_add(mx[i], &back2.mul_add(my[i], &back3.scaled(mz)));
        (moments[0][i], moments[1][i], moments[2][i]) = (m.x, m.y, m.z);
        i += 1;
    }

    // 5. Rounding, scatter, votes.
    let (force_magic, moment_magic) = (L::splat(c.force_magic), L::splat(c.moment_magic));
    let mut bound = zero;
    let mut turning = zero;
    let mut axis = 0;
    while axis < 3 {
        let mut i = 0;
        while i < 4 {
            let f = L::select(computed, forces[axis][i], zero);
            bound = bound.max_magnitude(f);
            forces[axis][i] = exact::rounded(f, force_magic);
            let m = L::select(computed, moments[axis][i], zero);
            turning = turning.max_magnitude(m);
            moments[axis][i] = exact::rounded(m, moment_magic);
            i += 1;
        }
        // The last corner takes what the others leave: forces of an element add to exactly zero.
        let f = &mut forces[axis];
        f[3] = -(f[0] + (f[1] + f[2]));
        axis += 1;
    }
    let bound = bound.max_magnitude(turning * L::splat(c.inverse_arm));
    // SAFETY: handed on from the caller.
    unsafe {
        scatter(&mut view.f, view.corners, slot, &forces);
        scatter(&mut view.m, view.corners, slot, &moments);
    }
    let mut i = 0;
    while i < VISCOUS {
        // SAFETY: slots are inside.
        unsafe {
            let old = L::load(own, i * SET + lane);
            L::select(alive, state[i], old).store(own, i * SET + lane);
        }
        i += 1;
    }
    // The membrane wave with the mass that the element has: c^2 = plate stiffness * volume / mass.
    let largest = if P == 1 { largest } else { plane::largest(&g, largest) };
    let courant = (mass / (L::splat(c.law.wave()) * volume * largest)).sqrt().to_array();
    let energy_magic = L::splat(c.energy_magic);
    let internal = L::select(computed, state[INTERNAL], zero);
    let internal = exact::rounded(internal, energy_magic).to_array();
    let spent = L::select(computed, spent, zero);
    let spent = exact::rounded(spent, energy_magic).to_array();
    let heat = L::select(computed, heat, zero);
    let heat = exact::rounded(heat, energy_magic).to_array();
    let (bound, volume) = (bound.to_array(), volume.to_array());
    let mut lane = 0;
    while lane < L::N {
        let element = view.elements[slot + lane];
        if L::bits(alive) >> lane & 1 == 1 {
            vote.offer_courant(courant[lane], element);
            vote.internal += internal[lane];
            vote.hourglass += spent[lane];
            vote.viscosity += heat[lane];
            vote.force_bound = vote.force_bound.max(bound[lane]);
            if faults >> lane & 1 == 1 {
                vote.offer_fault(Fault { element, volume: volume[lane] });
            }
        }
        lane += 1;
    }
}

/// Leaves a number of the viscous part for the next step; gives the sum of this and of that before.
///
/// # Safety
/// `own` holds the numbers of a set, and the lanes from `lane` on are inside the set.
#[inline(always)]
unsafe fn with_last<L: Lane>(own: &mut [f64], number: usize, lane: usize, alive: L::Mask, new: L) -> L {
    // SAFETY: the caller's promise.
    unsafe {
        let last = L::load(own, number * SET + lane);
        L::select(alive, new, last).store(own, number * SET + lane);
        last + new
    }
}

/// Likewise of all sums of the section.
///
/// # Safety
/// As [`with_last`].
#[inline(always)]
unsafe fn both_viscous<L: Lane>(
    own: &mut [f64],
    lane: usize,
    alive: L::Mask,
    new: &Resultants<L>,
) -> Resultants<L> {
    let mut both = *new;
    let mut i = 0;
    while i < 3 {
        // SAFETY: the caller's promise.
        unsafe {
            both.n[i] = with_last(own, VISCOUS + i, lane, alive, new.n[i]);
            both.m[i] = with_last(own, VISCOUS + 3 + i, lane, alive, new.m[i]);
        }
        i += 1;
    }
    // SAFETY: as above.
    unsafe {
        both.q[0] = with_last(own, VISCOUS + 6, lane, alive, new.q[0]);
        both.q[1] = with_last(own, VISCOUS + 7, lane, alive, new.q[1]);
    }
    both
}

/// Components of a vector of each corner along the axes.
#[inline(always)]
fn corners_in<L: Lane>(e: &[Vector<L>; 3], v: &[Vector<L>; 4]) -> [[L; 4]; 3] {
    let mut along = [[L::splat(0.0); 4]; 3];
    let mut axis = 0;
    while axis < 3 {
        let mut i = 0;
        while i < 4 {
            along[axis][i] = e[axis].dot(&v[i]);
            i += 1;
        }
        axis += 1;
    }
    along
}

/// Components along the axes of what the vectors of corners 0 and 1 have more than those of 2 and 3, and of a quarter of their sum with
/// the signs of the hourglass.
#[inline(always)]
fn opposed_in<L: Lane>(e: &[Vector<L>; 3], v: &[Vector<L>; 4]) -> ([Opposed<L>; 3], [L; 3]) {
    let (zero, one, minus) = (L::splat(0.0), L::splat(1.0), L::splat(-1.0));
    let (first, second) = (v[2].mul_add(minus, &v[0]), v[3].mul_add(minus, &v[1]));
    let pattern = v[1].mul_add(minus, &v[0]).mul_add(one, &v[3].mul_add(minus, &v[2]));
    let pattern = pattern.scaled(L::splat(0.25));
    let (mut opposed, mut along) = ([[zero; 2]; 3], [zero; 3]);
    let mut axis = 0;
    while axis < 3 {
        opposed[axis] = [e[axis].dot(&first), e[axis].dot(&second)];
        along[axis] = e[axis].dot(&pattern);
        axis += 1;
    }
    (opposed, along)
}

/// What corners 0 and 1 have more than 2 and 3.
#[inline(always)]
fn opposed<L: Lane>(a: &[L; 4]) -> Opposed<L> {
    [a[0] - a[2], a[1] - a[3]]
}

/// By corner what is of opposite sign in opposite corners, with what corners 0 and 2, and 1 and 3, have beside it.
#[inline(always)]
fn at_corners<L: Lane>(opposed: &Opposed<L>, even: L, odd: L) -> [L; 4] {
    [even + opposed[0], odd + opposed[1], even - opposed[0], odd - opposed[1]]
}

/// Adds vectors by axis and corner to those of the nodes.
///
/// # Safety
/// As [`compute`].
#[inline(always)]
unsafe fn scatter<L: Lane>(to: &mut [&mut [f64]; 3], corners: &[Vec<u32>; 4], slot: usize, of: &[[L; 4]; 3]) {
    // Slices of its own, which need not be loaded again after each store.
    let [x, y, z] = to;
    let (x, y, z) = (&mut **x, &mut **y, &mut **z);
    let mut i = 0;
    while i < 4 {
        let nodes = &corners[i][slot..slot + L::N];
        let (of_x, of_y, of_z) = (of[0][i].to_array(), of[1][i].to_array(), of[2][i].to_array());
        let mut lane = 0;
        while lane < L::N {
            let node = nodes[lane] as usize;
            // SAFETY: corners are inside the node arrays.
            unsafe {
                *x.get_unchecked_mut(node) += of_x[lane];
                *y.get_unchecked_mut(node) += of_y[lane];
                *z.get_unchecked_mut(node) += of_z[lane];
            }
            lane += 1;
        }
        i += 1;
    }
}
