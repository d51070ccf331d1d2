//! One cycle of a lane set of shells, from gather to scatter.

use std::ops::Range;

use super::geometry::{Geometry, dot};
use crate::{
    element::{ElementVote, Fault, vector::Vector},
    exact,
    lanes::{Lane, SET, dispatch::Task},
    strength::plane_stress::{Layer, Plane, PlaneLaw},
};

/// State of a layer: stress xx, yy, xy, yz, zx, plastic strain, temperature.
pub const LAYER: usize = 7;
/// Index of the plastic strain in the state of a layer.
pub(super) const PLASTIC_STRAIN: usize = 5;
/// State of an element beside its layers: hourglass forces of membrane x and y, bending about x and y, deflection and
/// twist; thickness; internal energy; hourglass energy.
pub const ELEMENT: usize = 9;
/// Index of the thickness in the state of an element.
pub const THICKNESS: usize = 6;
pub(crate) const INTERNAL: usize = 7;
pub(crate) const HOURGLASS: usize = 8;

/// Shear correction of a homogeneous plate.
const SHEAR: f64 = 5.0 / 6.0;
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
    /// `ELEMENT` arrays by slot.
    pub state: &'a mut [Vec<f64>],
    /// `LAYER` arrays by slot for each point.
    pub layers: &'a mut [Vec<f64>],
    pub mass: &'a [f64],
    pub alive: &'a [u8],
    pub elements: &'a [u32],
}

/// What does not change from element to element.
#[derive(Clone, Copy)]
pub(super) struct Constants<'a> {
    pub law: PlaneLaw,
    pub points: &'a [(f64, f64)],
    /// Share of the strain across the thickness that the thickness follows.
    pub thinning: f64,
    /// Plastic strain at which a layer breaks.
    pub breaks: Option<f64>,
    /// Mean square of the heights of the points over the square of the thickness: 1/12, and 0 of one point.
    pub second_moment: f64,
    pub dt: f64,
    pub force_magic: f64,
    pub moment_magic: f64,
    /// Force quantum over moment quantum (1/length).
    pub inverse_arm: f64,
    pub energy_magic: f64,
}

/// The elements of some sets.
pub(super) struct Pass<'a> {
    view: View<'a>,
    constants: &'a Constants<'a>,
    sets: &'a [Range<u32>],
    vote: &'a mut ElementVote,
}

impl<'a> Pass<'a> {
    /// # Safety
    /// As [`compute`].
    pub unsafe fn new(
        view: View<'a>,
        constants: &'a Constants<'a>,
        sets: &'a [Range<u32>],
        vote: &'a mut ElementVote,
    ) -> Self {
        Self { view, constants, sets, vote }
    }
}

impl Task for Pass<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lane>(self) {
        // Copies of its own, as the pass of hexahedra has them.
        let Self { mut view, constants, sets, vote } = self;
        let (constants, mut own) = (*constants, *vote);
        // SAFETY: whoever made the pass has promised it.
        unsafe { compute::<L>(&mut view, &constants, sets, &mut own) }
        *vote = own;
    }
}

/// The sets of these ranges.
///
/// # Safety
/// Every array by slot holds all sets of the ranges, and every corner is inside the node arrays.
#[inline(always)]
unsafe fn compute<L: Lane>(
    view: &mut View<'_>,
    c: &Constants<'_>,
    sets: &[Range<u32>],
    vote: &mut ElementVote,
) {
    for range in sets {
        let mut slot = range.start as usize * SET;
        while slot < range.end as usize * SET {
            // SAFETY: handed on from the caller.
            unsafe { slots::<L>(view, c, slot, vote) };
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
unsafe fn slots<L: Lane>(view: &mut View<'_>, c: &Constants<'_>, slot: usize, vote: &mut ElementVote) {
    let (zero, one, half, quarter) = (L::splat(0.0), L::splat(1.0), L::splat(0.5), L::splat(0.25));
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
    let mut state = [zero; ELEMENT];
    let mut i = 0;
    while i < ELEMENT {
        // SAFETY: slots are inside.
        state[i] = unsafe { L::load(&view.state[i], slot) };
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
    let [e1, e2, e3] = g.e;
    let (mut vx, mut vy, mut vz) = ([zero; 4], [zero; 4], [zero; 4]);
    let (mut wx, mut wy) = ([zero; 4], [zero; 4]);
    // In-plane velocity of the fibers, w x p.
    let (mut sx, mut sy) = ([zero; 4], [zero; 4]);
    let mut i = 0;
    while i < 4 {
        (vx[i], vy[i], vz[i]) = (e1.dot(&v[i]), e2.dot(&v[i]), e3.dot(&v[i]));
        (wx[i], wy[i]) = (e1.dot(&w[i]), e2.dot(&w[i]));
        let wz = e3.dot(&w[i]);
        sx[i] = wz.neg_mul_add(g.py[i], wy[i]);
        sy[i] = wz.mul_add(g.px[i], -wx[i]);
        i += 1;
    }
    let membrane = (dot(&g.bx, &vx), dot(&g.by, &vy), dot(&g.by, &vx) + dot(&g.bx, &vy));
    let curvature = (
        dot(&g.cx, &vx) + dot(&g.bx, &sx),
        dot(&g.cy, &vy) + dot(&g.by, &sy),
        (dot(&g.cy, &vx) + dot(&g.cx, &vy)) + (dot(&g.by, &sx) + dot(&g.bx, &sy)),
    );
    let (tilt_x, tilt_y) = (dot(&g.bx, &vz), dot(&g.by, &vz));
    let shear_x = quarter.mul_add((sx[0] + sx[1]) + (sx[2] + sx[3]), tilt_x);
    let shear_y = quarter.mul_add((sy[0] + sy[1]) + (sy[2] + sy[3]), tilt_y);
    let (bend_xx, bend_yy) = (-dot(&g.bx, &wy), dot(&g.by, &wx));
    let (turn_x, turn_y) = (dot(&g.bx, &wx), dot(&g.by, &wy));
    let twist = half * (turn_x - turn_y);
    // What the curvatures alone make of the deflection is neither shear nor hourglass.
    let curvatures = [half * bend_xx, twist, half * bend_yy];
    let bent =
        [sum(&g.curved[0], &curvatures), sum(&g.curved[1], &curvatures), sum(&g.curved[2], &curvatures)];
    let (shear_x, shear_y) = (shear_x - bent[1], shear_y - bent[2]);
    let rates = [
        g.gz.mul_add(tilt_x, dot(&g.gamma, &vx)),
        g.gz.mul_add(tilt_y, dot(&g.gamma, &vy)),
        dot(&g.gamma, &wx),
        dot(&g.gamma, &wy),
        dot(&g.gamma, &vz) - bent[0],
        turn_x + turn_y,
    ];

    // 2. Stress of the layers in plane stress, thinning, energy.
    let (young, poisson, g_modulus) = (c.law.young, c.law.poisson, c.law.shear());
    let plate = young / (1.0 - poisson * poisson);
    let (stiff, coupled) = (L::splat(plate), L::splat(plate * poisson));
    let (shear, transverse) = (L::splat(g_modulus), L::splat(SHEAR * g_modulus));
    let (mut n_xx, mut n_yy, mut n_xy) = (zero, zero, zero);
    let (mut m_xx, mut m_yy, mut m_xy) = (zero, zero, zero);
    let (mut q_x, mut q_y) = (zero, zero);
    let (mut power, mut thinning, mut elastic) = (zero, zero, zero);
    let mut point = 0;
    while point < c.points.len() {
        let (height, weight) = c.points[point];
        let z = L::splat(0.5 * height) * h;
        let weight = L::splat(weight);
        let dxx = z.mul_add(curvature.0, membrane.0);
        let dyy = z.mul_add(curvature.1, membrane.1);
        let dxy = z.mul_add(curvature.2, membrane.2);
        let mut old = [zero; LAYER];
        let mut i = 0;
        while i < LAYER {
            // SAFETY: slots are inside.
            old[i] = unsafe { L::load(&view.layers[point * LAYER + i], slot) };
            i += 1;
        }
        let mut layer = Layer {
            stress: Plane {
                xx: dt.mul_add(stiff.mul_add(dxx, coupled * dyy), old[0]),
                yy: dt.mul_add(stiff.mul_add(dyy, coupled * dxx), old[1]),
                xy: dt.mul_add(shear * dxy, old[2]),
                yz: dt.mul_add(transverse * shear_y, old[3]),
                zx: dt.mul_add(transverse * shear_x, old[4]),
            },
            plastic_strain: old[5],
            temperature: old[6],
        };
        // Effective rate of an incompressible layer.
        let rate = dxx.mul_add(dxx, dyy.mul_add(dyy, dxx * dyy));
        let rate = (quarter * dxy).mul_add(dxy, rate);
        let rate = (L::splat(4.0 / 3.0) * rate).sqrt();
        let mut yields = c.law.update(&mut layer, rate);
        let mut s = layer.stress;
        if let Some(limit) = c.breaks {
            let broken = L::splat(limit).less_equal(layer.plastic_strain);
            yields = L::either(yields, broken);
            let left = L::select(broken, zero, one);
            s = Plane { xx: s.xx * left, yy: s.yy * left, xy: s.xy * left, yz: s.yz * left, zx: s.zx * left };
        }
        elastic = elastic + L::select(yields, zero, weight);
        // The layer's strain across the thickness: elastic part by Hooke, plastic part keeps the volume.
        let rise = (s.xx - old[0]) + (s.yy - old[1]);
        let stretched = dt * (dxx + dyy);
        thinning =
            weight.mul_add(L::splat((1.0 - 2.0 * poisson) / young).mul_add(rise, -stretched), thinning);
        let work = (s.xx + old[0]).mul_add(
            dxx,
            (s.yy + old[1]).mul_add(
                dyy,
                (s.xy + old[2]).mul_add(dxy, (s.yz + old[3]).mul_add(shear_y, (s.zx + old[4]) * shear_x)),
            ),
        );
        power = (half * weight).mul_add(work, power);
        (n_xx, n_yy) = (weight.mul_add(s.xx, n_xx), weight.mul_add(s.yy, n_yy));
        (n_xy, q_x) = (weight.mul_add(s.xy, n_xy), weight.mul_add(s.zx, q_x));
        q_y = weight.mul_add(s.yz, q_y);
        let moment = weight * z;
        (m_xx, m_yy) = (moment.mul_add(s.xx, m_xx), moment.mul_add(s.yy, m_yy));
        m_xy = moment.mul_add(s.xy, m_xy);
        let new = [s.xx, s.yy, s.xy, s.yz, s.zx, layer.plastic_strain, layer.temperature];
        let mut i = 0;
        while i < LAYER {
            // SAFETY: slots are inside.
            unsafe {
                L::select(alive, new[i], old[i]).store(&mut view.layers[point * LAYER + i], slot);
            }
            i += 1;
        }
        point += 1;
    }

    // 3. Viscous stress of the section.
    let lag = L::splat(DAMPING) * dt;
    let viscous = |rates: (L, L, L)| {
        (
            lag * stiff.mul_add(rates.0, coupled * rates.1),
            lag * stiff.mul_add(rates.1, coupled * rates.0),
            lag * shear * rates.2,
        )
    };
    let squares = L::splat(c.second_moment) * h * h;
    let (n, m) = (viscous(membrane), viscous(curvature));
    let m = (squares * m.0, squares * m.1, squares * m.2);
    let q = (lag * transverse * shear_x, lag * transverse * shear_y);
    (n_xx, n_yy, n_xy) = (n_xx + n.0, n_yy + n.1, n_xy + n.2);
    (m_xx, m_yy, m_xy) = (m_xx + m.0, m_yy + m.1, m_xy + m.2);
    (q_x, q_y) = (q_x + q.0, q_y + q.1);
    let damped = q.0.mul_add(shear_x, q.1 * shear_y);
    let damped = damped + sum(&[n.0, n.1, n.2], &[membrane.0, membrane.1, membrane.2]);
    let damped = damped + sum(&[m.0, m.1, m.2], &[curvature.0, curvature.1, curvature.2]);

    // 4. Hourglass forces grow with their patterns, more softly where layers yield.
    let (bxx, byy, largest) = g.squares();
    let h3 = h * h * h;
    let membrane_k = L::splat(4.0 / 3.0 * young) * h * g.area;
    let bending_k = L::splat(young / 9.0) * h3 * g.area;
    let shear_k = L::splat(SHEAR * g_modulus) * h3;
    let stiffness = [
        membrane_k * bxx,
        membrane_k * byy,
        bending_k * byy,
        bending_k * bxx,
        L::splat(8.0 / 3.0) * shear_k / g.area,
        L::splat(1.0 / 24.0) * shear_k * g.area,
    ];
    let share = elastic.max(L::splat(SOFT));
    let (mut hourglass_power, mut hourglass_damped) = (zero, zero);
    let mut resisting = [zero; 6];
    let mut pattern = 0;
    while pattern < 6 {
        let (old, rate) = (state[pattern], rates[pattern]);
        let rise = stiffness[pattern] * rate;
        // A force falls by the whole stiffness, as it would else give back more than it has taken; what it rises by is soft.
        let whole = dt.mul_add(rise, old);
        let fallen = old.min(whole).max(old.max(whole).min(zero));
        let new = share.mul_add(whole - fallen, fallen);
        hourglass_power = (half * (new + old)).mul_add(rate, hourglass_power);
        hourglass_damped = (lag * rise).mul_add(rate, hourglass_damped);
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

    // 5. Forces and moments on the geometry of now, conjugate to the rates above.
    let g = Geometry::of(&x);
    let [e1, e2, e3] = g.e;
    let volume = h * g.area;
    let flat = (g.least.min(h)).less_equal(zero);
    let finite = (power + state[INTERNAL]).abs().less(L::splat(f64::MAX));
    let computed = L::both(alive, finite);
    let faults = L::bits(alive) & (L::bits(flat) | !L::bits(finite));
    let [hx, hy, hwx, hwy, hq, ht] = resisting;
    // Deflection forces on the curvatures xx, xy and yy.
    let mut bent = [zero; 3];
    let mut i = 0;
    while i < 3 {
        let sheared = q_x.mul_add(g.curved[1][i], q_y * g.curved[2][i]);
        bent[i] = volume.mul_add(sheared, hq * g.curved[0][i]);
        i += 1;
    }
    let force_magic = L::splat(c.force_magic);
    let moment_magic = L::splat(c.moment_magic);
    let mut forces = [Vector { x: zero, y: zero, z: zero }; 4];
    let mut moments = forces;
    let mut i = 0;
    while i < 4 {
        let (bx, by, cx, cy, gamma) = (g.bx[i], g.by[i], g.cx[i], g.cy[i], g.gamma[i]);
        let fx = n_xx.mul_add(bx, n_xy.mul_add(by, m_xx.mul_add(cx, m_xy * cy)));
        let fy = n_yy.mul_add(by, n_xy.mul_add(bx, m_yy.mul_add(cy, m_xy * cx)));
        let fz = q_x.mul_add(bx, q_y * by);
        let fx = volume.mul_add(fx, hx * gamma);
        let fy = volume.mul_add(fy, hy * gamma);
        let tilted = g.gz * hx.mul_add(bx, hy * by);
        let fz = volume.mul_add(fz, hq.mul_add(gamma, tilted));
        let tx = volume * m_xx.mul_add(bx, m_xy.mul_add(by, quarter * q_x));
        let ty = volume * m_yy.mul_add(by, m_xy.mul_add(bx, quarter * q_y));
        let about_x = half * bent[1].mul_add(bx, bent[2] * by);
        let about_y = half * bent[1].mul_add(by, bent[0] * bx);
        let mx = hwx.mul_add(gamma, ht.mul_add(bx, -(ty + about_x)));
        let my = hwy.mul_add(gamma, ht.mul_add(by, tx + about_y));
        let mz = g.px[i].mul_add(ty, -(g.py[i] * tx));
        // What the element resists with acts on the nodes the other way.
        let (fx, fy, fz) = (-fx, -fy, -fz);
        let (mx, my, mz) = (-mx, -my, -mz);
        forces[i] = e1.mul_add(fx, &e2.mul_add(fy, &e3.scaled(fz)));
        moments[i] = e1.mul_add(mx, &e2.mul_add(my, &e3.scaled(mz)));
        i += 1;
    }

    // 6. Rounding, scatter, votes.
    let mut bound = zero;
    let mut i = 0;
    while i < 4 {
        let f = forces[i];
        let f = [f.x, f.y, f.z];
        let m = [moments[i].x, moments[i].y, moments[i].z];
        let (mut rounded, mut turned) = ([zero; 3], [zero; 3]);
        let mut axis = 0;
        while axis < 3 {
            let f = L::select(computed, f[axis], zero);
            bound = bound.max_magnitude(f);
            rounded[axis] = exact::rounded(f, force_magic);
            let m = L::select(computed, m[axis], zero);
            bound = bound.max_magnitude(m * L::splat(c.inverse_arm));
            turned[axis] = exact::rounded(m, moment_magic);
            axis += 1;
        }
        forces[i] = Vector { x: rounded[0], y: rounded[1], z: rounded[2] };
        moments[i] = Vector { x: turned[0], y: turned[1], z: turned[2] };
        i += 1;
    }
    // The last corner takes what the others leave: forces of an element add to exactly zero.
    let minus = L::splat(-1.0);
    let rest = forces[0].mul_add(one, &forces[1].mul_add(one, &forces[2]));
    forces[3] = rest.scaled(minus);
    let mut i = 0;
    while i < 4 {
        let (f, m) = (forces[i], moments[i]);
        let f = [f.x.to_array(), f.y.to_array(), f.z.to_array()];
        let m = [m.x.to_array(), m.y.to_array(), m.z.to_array()];
        let mut lane = 0;
        while lane < L::N {
            let node = view.corners[i][slot + lane] as usize;
            let mut axis = 0;
            while axis < 3 {
                view.f[axis][node] += f[axis][lane];
                view.m[axis][node] += m[axis][lane];
                axis += 1;
            }
            lane += 1;
        }
        i += 1;
    }
    let mut i = 0;
    while i < ELEMENT {
        // SAFETY: slots are inside.
        unsafe {
            let old = L::load(&view.state[i], slot);
            L::select(alive, state[i], old).store(&mut view.state[i], slot);
        }
        i += 1;
    }
    // The membrane wave with the mass that the element has: c^2 = plate stiffness * volume / mass.
    let courant = (mass / (L::splat(plate) * volume * largest)).sqrt().to_array();
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

/// Sum of products of three.
#[inline(always)]
fn sum<L: Lane>(a: &[L; 3], b: &[L; 3]) -> L {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}
