//! Four-node shells against closed forms and published answers, and against themselves on other lane widths.

#![expect(clippy::disallowed_methods, reason = "tests compare with the platform's functions")]

mod damping;
mod laminate;
mod plane;

use mechanics::{
    element::{
        ElementVote,
        shell4::{InPlane, Rule, ShellStep, Shells},
    },
    exact::Quantum,
    lanes::Width,
    material::{Eos, Failure, Heat, Material, Strength},
    mesh::Section,
};

/// Points in the plane.
const IN_PLANE: [InPlane; 2] = [InPlane::One, InPlane::Four];

/// Shells of a section with these points in the plane and through the thickness.
fn shells(
    (x, corners): (&[[f64; 3]], &[[u32; 4]]),
    thickness: f64,
    (in_plane, rule): (InPlane, Rule),
    material: &Material,
) -> Shells {
    let section = Section { in_plane, ..Section::of(thickness, rule) };
    Shells::of(x, corners, &section, material).expect("a sound section")
}

fn material(young: f64, poisson: f64, density: f64) -> Material {
    let shear = 0.5 * young / (1.0 + poisson);
    Material {
        name: "plate".to_owned(),
        density,
        eos: Eos::Linear { bulk: young / (3.0 * (1.0 - 2.0 * poisson)) },
        strength: Strength::Elastic { shear },
        failure: Failure::None,
    }
}

fn step(dt: f64, force: f64) -> ShellStep {
    ShellStep {
        dt,
        force_quantum: Quantum::for_reference(force, 49),
        moment_quantum: Quantum::for_reference(force, 49),
        energy_quantum: Quantum::for_reference(force, 49),
    }
}

/// A grid of `ni` by `nj` elements, its nodes where `place` puts the unit square.
fn grid(ni: usize, nj: usize, place: impl Fn(f64, f64) -> [f64; 3]) -> (Vec<[f64; 3]>, Vec<[u32; 4]>) {
    let mut x = Vec::new();
    for j in 0..=nj {
        for i in 0..=ni {
            x.push(place(i as f64 / ni as f64, j as f64 / nj as f64));
        }
    }
    let row = ni as u32 + 1;
    let corners = (0..nj as u32)
        .flat_map(|j| (0..ni as u32).map(move |i| [0, 1, row + 1, row].map(|d| j * row + i + d)));
    (x, corners.collect())
}

fn set(array: &mut [Vec<f64>; 3], node: usize, value: [f64; 3]) {
    for (array, value) in array.iter_mut().zip(value) {
        array[node] = value;
    }
}

fn at(array: &[Vec<f64>; 3], node: usize) -> [f64; 3] {
    std::array::from_fn(|axis| array[axis][node])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn advance(shells: &mut Shells, dt: f64) {
    for axis in 0..3 {
        for node in 0..shells.mass.len() {
            shells.x[axis][node] += dt * shells.v[axis][node];
        }
    }
}

/// Velocities and rotation rates from forces and moments, damped by `damping` (1/time); nodes of `fixed` stay.
fn kick(shells: &mut Shells, dt: f64, damping: f64, load: &[(usize, [f64; 3])], fixed: &[usize]) {
    let (keep, take) =
        ((1.0 - 0.5 * damping * dt) / (1.0 + 0.5 * damping * dt), dt / (1.0 + 0.5 * damping * dt));
    for &(node, force) in load {
        for (array, force) in shells.f.iter_mut().zip(force) {
            array[node] += force;
        }
    }
    for axis in 0..3 {
        for node in 0..shells.mass.len() {
            shells.v[axis][node] =
                keep * shells.v[axis][node] + take * shells.f[axis][node] / shells.mass[node];
            shells.turning.w[axis][node] = keep * shells.turning.w[axis][node]
                + take * shells.turning.m[axis][node] / shells.turning.inertia[node];
        }
    }
    for &node in fixed {
        set(&mut shells.v, node, [0.0; 3]);
        set(&mut shells.turning.w, node, [0.0; 3]);
    }
}

/// A warped, skewed patch.
fn warped() -> (Vec<[f64; 3]>, Vec<[u32; 4]>) {
    grid(5, 3, |s, t| {
        let bump = (7.0 * s + 3.0 * t).sin();
        [s + 0.2 * t + 0.02 * bump, 0.8 * t - 0.1 * s * t, 0.3 * s * t + 0.02 * bump]
    })
}

#[test]
fn a_rigid_rotation_of_a_warped_patch_leaves_no_stress_and_no_force() {
    IN_PLANE.into_iter().for_each(a_rigid_rotation_leaves_nothing);
}

fn a_rigid_rotation_leaves_nothing(in_plane: InPlane) {
    let (x, corners) = warped();
    let steel = material(2e11, 0.3, 7800.0);
    let mut shells = shells((&x, &corners), 0.05, (in_plane, Rule::Gauss(5)), &steel);
    let (angle, dt) = (0.05, 1e-6);
    // The chord of the rotation by `angle` about `axis` turns the middle of the step by twice its tangent.
    let axis = [2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0];
    let rate = 2.0 * f64::tan(0.5 * angle) / dt;
    for _ in 0..100 {
        for node in 0..x.len() {
            let r = at(&shells.x, node);
            let k = cross(axis, r);
            let kk = cross(axis, k);
            let (sin, cos) = f64::sin_cos(angle);
            let v = std::array::from_fn(|i| (sin * k[i] + (1.0 - cos) * kk[i]) / dt);
            set(&mut shells.v, node, v);
            set(&mut shells.turning.w, node, axis.map(|a| rate * a));
        }
        advance(&mut shells, dt);
        shells.compute(&step(dt, 1e10), Width::best());
    }
    for element in 0..corners.len() {
        for layer in 0..5 * in_plane.points() {
            let stress = shells.stress(element, layer);
            assert!(stress.iter().all(|s| s.abs() < 1e-9 * 2e11), "{element}.{layer}: {stress:?}");
        }
    }
    let largest = shells.f.iter().flatten().fold(0.0, |l: f64, f| l.max(f.abs()));
    assert!(largest < 1e-8 * 2e11 * 0.05, "{largest}");
}

#[test]
fn constant_strain_curvature_and_twist_pass_the_patch_test_without_hourglass() {
    for in_plane in IN_PLANE {
        let corners = [[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7], [4, 5, 6, 7]];
        passes_the_patch_test(&corners, in_plane);
    }
}

#[test]
fn triangles_between_quadrilaterals_pass_the_patch_test() {
    let corners =
        [[0, 1, 5, 4], [1, 2, 5, 5], [5, 2, 6, 6], [2, 3, 7, 6], [3, 0, 4, 7], [4, 5, 6, 6], [6, 7, 4, 4]];
    IN_PLANE.into_iter().for_each(|in_plane| passes_the_patch_test(&corners, in_plane));
}

fn passes_the_patch_test(corners: &[[u32; 4]], in_plane: InPlane) {
    // MacNeal and Harder's patch: 0.24 by 0.12, four inner nodes.
    let inner = [[0.04, 0.02], [0.18, 0.03], [0.16, 0.08], [0.08, 0.08]];
    let outer = [[0.0, 0.0], [0.24, 0.0], [0.24, 0.12], [0.0, 0.12]];
    let x: Vec<[f64; 3]> = outer.iter().chain(&inner).map(|p| [p[0], p[1], 0.0]).collect();
    let (young, poisson, h, dt) = (1e6, 0.25, 0.001, 1e-9);
    let (stretch, bend) = (1e-3, 1e-3);
    let plate = material(young, poisson, 1000.0);
    let mut shells = shells((&x, corners), h, (in_plane, Rule::Gauss(2)), &plate);
    for (node, &[x, y, _]) in x.iter().enumerate() {
        // u = 1e-3 (x + y/2), v = 1e-3 (y + x/2), w = 1e-3 (x^2 + x y + y^2) / 2, rotations its slopes.
        let w = 0.5 * bend * (x * x + x * y + y * y);
        let (slope_x, slope_y) = (bend * (x + 0.5 * y), bend * (y + 0.5 * x));
        set(&mut shells.v, node, [stretch * (x + 0.5 * y), stretch * (y + 0.5 * x), w]);
        set(&mut shells.turning.w, node, [slope_y, -slope_x, 0.0]);
    }
    // Rates over a small time: the geometry stays flat.
    shells.compute(&step(dt, 1e-9), Width::best());
    let g = 0.5 * young / (1.0 + poisson);
    let membrane = stretch * young / (1.0 - poisson) * dt;
    let z = 0.5 * h / 3f64.sqrt();
    let bending = -z * bend * young / (1.0 - poisson) * dt;
    for element in 0..corners.len() {
        for layer in 0..2 * in_plane.points() {
            let side = if layer % 2 == 0 { -1.0 } else { 1.0 };
            let [xx, yy, xy, yz, zx] = shells.stress(element, layer);
            let normal = membrane + side * bending;
            let sheared = (stretch * g - side * z * bend * g) * dt;
            // In the frame of the element, whose first axis is not x: mean and radius of Mohr's circle.
            let (mean, radius) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
            for (found, expected) in [(mean, normal), (radius, sheared.abs())] {
                assert!((found / expected - 1.0).abs() < 1e-8, "{element}: {found}, not {expected}");
            }
            assert!(yz.abs().max(zx.abs()) < 1e-9 * normal, "{element}: shear {yz} {zx}");
        }
        assert!(shells.hourglass_energy(element) < 1e-20 * young * dt * dt, "{element}");
    }
    for node in 4..8 {
        let (force, moment) = (at(&shells.f, node), at(&shells.turning.m, node));
        let scale = membrane * h * 0.1;
        assert!(force.iter().all(|f| f.abs() < 1e-8 * scale), "{force:?} of {scale}");
        assert!(moment.iter().all(|m| m.abs() < 1e-8 * scale * h), "{moment:?} of {scale}");
    }
}

fn stirred(width: Width, strength: Strength, in_plane: InPlane) -> (Shells, ElementVote) {
    let (x, corners) = warped();
    let mut steel = material(2e11, 0.3, 7800.0);
    steel.strength = strength;
    let mut shells = shells((&x, &corners), 0.05, (in_plane, Rule::Lobatto(5)), &steel);
    for node in 0..x.len() {
        let phase = node as f64;
        set(
            &mut shells.v,
            node,
            [30.0 * phase.sin(), 40.0 * (2.0 * phase).cos(), 50.0 * (3.0 * phase).sin()],
        );
        set(
            &mut shells.turning.w,
            node,
            [200.0 * phase.cos(), 100.0 * (1.5 * phase).sin(), 20.0 * phase.sin()],
        );
    }
    let mut vote = ElementVote::default();
    for _ in 0..40 {
        advance(&mut shells, 5e-6);
        vote = shells.compute(&step(5e-6, 1e8), width);
        kick(&mut shells, 5e-6, 0.0, &[], &[]);
    }
    (shells, vote)
}

fn laws() -> [Strength; 3] {
    let shear = 2e11 / 2.6;
    let johnson_cook = Strength::JohnsonCook {
        shear,
        a: 3e8,
        b: 5e8,
        n: 0.26,
        c: 0.014,
        m: 1.03,
        t_melt: 1793.0,
        t_room: 294.0,
        specific_heat: 477.0,
        rate0: 1.0,
        heat: Heat::PlasticWork,
    };
    let von_mises = Strength::VonMises { shear, yield_stress: 3e8, hardening: 1e9, rate: None };
    [Strength::Elastic { shear }, von_mises, johnson_cook]
}

/// A square that opens to its trapezoid elastically and closes while it is stretched and yields, ten times over.
#[test]
fn hourglass_control_gives_back_no_more_than_it_has_taken() {
    let (x, corners) = grid(1, 1, |s, t| [0.1 * s, 0.1 * t, 0.0]);
    let [_, von_mises, _] = laws();
    let mut steel = material(2e11, 0.3, 7800.0);
    steel.strength = von_mises;
    let mut shells = Shells::new(&x, &corners, 0.005, Rule::Gauss(2), &steel).expect("a sound section");
    let dt = 1e-6;
    let mut least: f64 = 0.0;
    let mut most: f64 = 0.0;
    for cycle in 0..2000 {
        let opens = cycle % 200 < 100;
        for node in 0..4 {
            let [right, upper] = [node % 2 == 1, node / 2 == 1];
            let trapezoid = if right == upper { 0.2 } else { -0.2 };
            let stretch = if right { 2.0 } else { 0.0 };
            let v = if opens { trapezoid } else { stretch - trapezoid };
            set(&mut shells.v, node, [v, 0.0, 0.0]);
        }
        advance(&mut shells, dt);
        shells.compute(&step(dt, 1e8), Width::best());
        least = least.min(shells.hourglass_energy(0));
        most = most.max(shells.hourglass_energy(0));
    }
    assert!(shells.plastic_strain(0, 0) > 0.01, "it has to yield: {}", shells.plastic_strain(0, 0));
    // The stiffness itself changes by 2 % as the element is stretched.
    assert!(most > 0.0 && least > -0.02 * most, "hourglass energy from {least} to {most}");
}

#[test]
fn every_lane_width_gives_the_same_bits() {
    for (strength, in_plane) in laws().into_iter().flat_map(|law| IN_PLANE.map(|in_plane| (law, in_plane))) {
        let (scalar, vote) = stirred(Width::Scalar, strength, in_plane);
        assert!(vote.fault.is_none() && vote.internal > 0.0, "{vote:?}");
        let plastic = scalar.plastic_strain(3, 0);
        assert!(plastic > 0.0 || matches!(strength, Strength::Elastic { .. }), "{strength:?} never yields");
        for width in Width::ALL.into_iter().filter(|width| width.available()) {
            let (wide, other) = stirred(width, strength, in_plane);
            assert_eq!(vote, other, "{width}");
            for (a, b) in [
                (&scalar.x, &wide.x),
                (&scalar.turning.w, &wide.turning.w),
                (&scalar.turning.m, &wide.turning.m),
            ] {
                assert!(a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| a.to_bits() == b.to_bits()));
            }
        }
    }
}

#[test]
fn forces_add_to_zero_exactly_and_moments_to_rounding() {
    for (strength, in_plane) in laws().into_iter().flat_map(|law| IN_PLANE.map(|in_plane| (law, in_plane))) {
        let (shells, _) = stirred(Width::best(), strength, in_plane);
        let mut total = [0.0; 3];
        let mut turning = [0.0; 3];
        let mut scale: f64 = 0.0;
        for node in 0..shells.mass.len() {
            let (r, f, m) = (at(&shells.x, node), at(&shells.f, node), at(&shells.turning.m, node));
            let arm = cross(r, f);
            for i in 0..3 {
                total[i] += f[i];
                turning[i] += arm[i] + m[i];
                scale = scale.max(arm[i].abs());
            }
        }
        assert_eq!(total, [0.0; 3]);
        assert!(turning.iter().all(|t| t.abs() < 1e-12 * scale), "{turning:?} of {scale}");
    }
}

#[test]
fn a_cantilever_strip_vibrates_at_the_frequency_of_the_beam() {
    let (x, corners) = strip();
    vibrates_at_the_frequency_of_the_beam(&x, &corners);
}

#[test]
fn a_cantilever_strip_of_triangles_vibrates_at_the_frequency_of_the_beam() {
    let (x, corners) = strip();
    let halves = corners.iter().flat_map(|&[a, b, c, d]| [[a, b, c, c], [c, d, a, a]]);
    vibrates_at_the_frequency_of_the_beam(&x, &halves.collect::<Vec<_>>());
}

fn strip() -> (Vec<[f64; 3]>, Vec<[u32; 4]>) {
    grid(40, 2, |s, t| [0.2 * s, 0.01 * t, 0.0])
}

fn vibrates_at_the_frequency_of_the_beam(x: &[[f64; 3]], corners: &[[u32; 4]]) {
    IN_PLANE.into_iter().for_each(|in_plane| vibrates(x, corners, in_plane));
}

fn vibrates(x: &[[f64; 3]], corners: &[[u32; 4]], in_plane: InPlane) {
    // 0.2 by 0.01 by 0.002 m, 200 GPa, 8000 kg/m^3: 40.39 Hz as a beam, 42.34 Hz if the width could not curve.
    let steel = material(2e11, 0.3, 8000.0);
    let mut shells = shells((x, corners), 0.002, (in_plane, Rule::Gauss(2)), &steel);
    let fixed: Vec<usize> = (0..3).map(|j| j * 41).collect();
    for node in 0..x.len() {
        let s = x[node][0] / 0.2;
        // About the first mode: w = s^2 (6 - 4 s + s^2) / 3, w' beside it.
        let slope = (12.0 * s - 12.0 * s * s + 4.0 * s * s * s) / 3.0 / 0.2;
        set(&mut shells.v, node, [0.0, 0.0, 1e-3 * s * s * (6.0 - 4.0 * s + s * s) / 3.0]);
        set(&mut shells.turning.w, node, [0.0, -1e-3 * slope, 0.0]);
    }
    let dt = 5e-7;
    let (mut crossings, mut before, mut cycle) = (Vec::new(), 0.0, 0);
    while crossings.len() < 2 && cycle < 100_000 {
        advance(&mut shells, dt);
        let tip = shells.x[2][40];
        if cycle > 100 && (tip > 0.0) != (before > 0.0) {
            crossings.push((f64::from(cycle) - tip / (tip - before)) * dt);
        }
        before = tip;
        shells.compute(&step(dt, 1e3), Width::best());
        kick(&mut shells, dt, 0.0, &[], &fixed);
        cycle += 1;
    }
    let frequency = 0.5 / (crossings[1] - crossings[0]);
    println!("cantilever, {in_plane:?}: {frequency:.3} Hz, 40.39 Hz");
    assert!((frequency / 40.39 - 1.0).abs() < 0.02, "{frequency} Hz");
}

#[test]
fn the_twisted_beam_bends_as_published() {
    // MacNeal and Harder 1985: 12 by 1.1 by 0.32, twisted by 90 degrees, 29e6, 0.22, unit load at the tip.
    let (x, corners) = grid(12, 2, |s, t| {
        let (sin, cos) = (s * std::f64::consts::FRAC_PI_2).sin_cos();
        [12.0 * s, 1.1 * (t - 0.5) * cos, 1.1 * (t - 0.5) * sin]
    });
    let beam = material(29e6, 0.22, 2.5e-4);
    let fixed: Vec<usize> = (0..3).map(|j| j * 13).collect();
    let loads = [(2, 5.424e-3), (1, 1.754e-3)];
    for ((axis, published), in_plane) in loads.into_iter().flat_map(|load| IN_PLANE.map(|p| (load, p))) {
        let mut shells = shells((&x, &corners), 0.32, (in_plane, Rule::Gauss(5)), &beam);
        let mut load = [0.0; 3];
        load[axis] = 1.0;
        let load: Vec<_> = [(12, 0.25), (25, 0.5), (38, 0.25)]
            .into_iter()
            .map(|(node, share)| (node, load.map(|l| l * share)))
            .collect();
        let dt = 6e-7;
        for _ in 0..40_000 {
            advance(&mut shells, dt);
            shells.compute(&step(dt, 1e3), Width::best());
            kick(&mut shells, dt, 1500.0, &load, &fixed);
        }
        let found = shells.x[axis][25] - x[25][axis];
        println!("twisted beam along axis {axis}, {in_plane:?}: {found:.4e}, published {published:.4e}");
        assert!((found / published - 1.0).abs() < 0.05, "axis {axis}: {found}, published {published}");
    }
}
