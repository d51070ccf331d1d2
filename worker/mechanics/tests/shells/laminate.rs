//! Composite shells: the closed forms of laminate theory (R. M. Jones, Mechanics of Composite Materials, 1999), failure, energy and bits.

use mechanics::{
    element::{
        ElementVote,
        shell4::{Rule, Shells},
    },
    lanes::Width,
    material::{Eos, Failure, Material, Strength},
    mesh::{Axis, Laminate, Plies, Ply, Section},
    strength::ChangChang,
};
use nalgebra::{Matrix3, Vector3};

use super::{advance, at, grid, kick, set, step, warped};

/// Carbon fibres in epoxy.
const LAW: ChangChang = ChangChang {
    young_a: 140e9,
    young_b: 10e9,
    poisson_ba: 0.02,
    modulus_ab: 5e9,
    modulus_bc: 3e9,
    modulus_ca: 4e9,
    ax: 1.0,
    ay: 0.0,
    az: 0.0,
    tension_a: 1e30,
    compression_a: 1e30,
    tension_b: 1e30,
    compression_b: 1e30,
    shear_ab: 1e30,
    shear_share: 1.0,
    crushed_tension: 1.0,
    crushed_compression: 1.0,
    strain_tension_a: 1e30,
    strain_compression_a: 1e30,
    strain_b: 1e30,
    strain_ab: 1e30,
    strain_effective: 1e30,
};

/// The same with strengths.
const BRITTLE: ChangChang = ChangChang {
    tension_a: 2e9,
    compression_a: 1.2e9,
    tension_b: 50e6,
    compression_b: 200e6,
    shear_ab: 80e6,
    ..LAW
};

fn composite(law: ChangChang) -> Material {
    let strength = Strength::ChangChang(law);
    Material {
        name: "carbon".to_owned(),
        density: 1600.0,
        eos: Eos::Linear { bulk: strength.bulk().expect("it makes the pressure") },
        strength,
        failure: Failure::None,
    }
}

/// Equal plies of these angles, `points` in each.
fn laid(thickness: f64, points: u32, angles: &[f64], axis: Axis) -> Section {
    let plies = Plies::Stacked(angles.iter().map(|&angle| Ply { angle, share: 0.125e-3 }).collect());
    let laminate = Some(Laminate { axis, plies });
    Section { laminate, ..Section::of(thickness, Rule::Gauss(points)) }
}

/// Heights, from the middle, and weights of such layers.
fn layers(thickness: f64, points: u32, n_plies: usize) -> Vec<(f64, f64)> {
    let rule = Rule::Gauss(points).points().expect("it exists");
    let share = 1.0 / n_plies as f64;
    let of_ply = |ply: usize| {
        let middle = (ply as f64 + 0.5) * share - 0.5;
        rule.iter().map(move |(z, w)| (thickness * (middle + 0.5 * share * z), share * w)).collect::<Vec<_>>()
    };
    (0..n_plies).flat_map(of_ply).collect()
}

/// Stiffness of a ply at an angle in the plane, by its compliance turned as a tensor.
fn turned_stiffness(law: &ChangChang, degrees: f64) -> Matrix3<f64> {
    let s12 = -law.poisson_ba / law.young_b;
    let compliance = Matrix3::new(
        1.0 / law.young_a,
        s12,
        0.0,
        s12,
        1.0 / law.young_b,
        0.0,
        0.0,
        0.0,
        1.0 / law.modulus_ab,
    );
    let (s, c) = degrees.to_radians().sin_cos();
    // Strains along the axes of the ply, by those of the laminate.
    let turn =
        Matrix3::new(c * c, s * s, c * s, s * s, c * c, -c * s, -2.0 * c * s, 2.0 * c * s, c * c - s * s);
    turn.transpose() * compliance.try_inverse().expect("positive") * turn
}

/// A square element after a small step with these strains of its middle surface and curvatures (strain by height).
fn strained(section: &Section, law: ChangChang, membrane: [f64; 3], curvature: [f64; 3]) -> Shells {
    let (x, corners) = grid(1, 1, |s, t| [0.01 * s, 0.01 * t, 0.0]);
    let mut shells = Shells::of(&x, &corners, section, &composite(law)).expect("a sound section");
    let dt = 1e-9;
    for (node, &[x, y, _]) in x.iter().enumerate() {
        let [xx, yy, xy] = membrane;
        let [kx, ky, kxy] = curvature.map(|k| -k);
        let w = 0.5 * (kx * x * x + ky * y * y + kxy * x * y);
        let (slope_x, slope_y) = (kx * x + 0.5 * kxy * y, ky * y + 0.5 * kxy * x);
        set(&mut shells.v, node, [xx * x + 0.5 * xy * y, yy * y + 0.5 * xy * x, w].map(|v| v / dt * 1e-9));
        set(&mut shells.turning.w, node, [slope_y, -slope_x, 0.0].map(|v| v / dt * 1e-9));
    }
    shells.compute(&step(dt, 1e3), Width::best());
    shells
}

/// Forces and moments over the thickness, per unit of the strains of [`strained`].
fn resultants(shells: &Shells, layers: &[(f64, f64)]) -> [Vector3<f64>; 2] {
    let mut sums = [Vector3::zeros(); 2];
    for (i, (z, weight)) in layers.iter().enumerate() {
        let stress = shells.stress(0, i);
        let plane = Vector3::new(stress[0], stress[1], stress[2]) / 1e-9;
        sums[0] += *weight * plane;
        sums[1] += *weight * *z * plane;
    }
    sums
}

#[test]
fn stiffness_of_laminates_in_the_plane_in_bending_and_between_both_is_that_of_laminate_theory() {
    let h = 1e-3;
    for angles in
        [&[0.0, 90.0, 90.0, 0.0][..], &[45.0, -45.0, -45.0, 45.0], &[0.0, 90.0], &[0.0, 30.0, -60.0]]
    {
        let section = laid(h, 2, angles, Axis::Material);
        let of = layers(h, 2, angles.len());
        let n = angles.len() as f64;
        let mut abd = [Matrix3::zeros(); 3];
        for (k, &angle) in (0_i32..).zip(angles) {
            let q = turned_stiffness(&LAW, angle);
            let [low, high] = [k, k + 1].map(|k| h * (f64::from(k) / n - 0.5));
            for (power, sum) in (1..).zip(&mut abd) {
                *sum += q * ((high.powi(power) - low.powi(power)) / f64::from(power) / h);
            }
        }
        for i in 0..3 {
            let unit = std::array::from_fn(|k| f64::from(u8::from(k == i)));
            let [a, b] = resultants(&strained(&section, LAW, unit, [0.0; 3]), &of);
            let bent = unit.map(|k| k / h);
            let [b_too, d] = resultants(&strained(&section, LAW, [0.0; 3], bent), &of);
            for (found, expected, scale) in [
                (a, abd[0].column(i).into_owned(), LAW.young_a),
                (b, abd[1].column(i).into_owned(), LAW.young_a * h),
                (b_too * h, abd[1].column(i).into_owned(), LAW.young_a * h),
                (d * h, abd[2].column(i).into_owned(), LAW.young_a * h * h),
            ] {
                assert!((found - expected).norm() < 2e-8 * scale, "{angles:?} {i}: {found} {expected}");
            }
        }
    }
}

#[test]
fn a_ply_at_an_angle_is_as_stiff_in_tension_as_its_compliance_says() {
    for degrees in [0.0, 10.0, 30.0, 45.0, 60.0, 90.0, -20.0] {
        let (s, c) = f64::to_radians(degrees).sin_cos();
        let (cc, ss) = (c * c, s * s);
        let (a, b, g) = (LAW.young_a, LAW.young_b, LAW.modulus_ab);
        let poisson = LAW.poisson_ba * a / b;
        let compliance = cc * cc / a + (1.0 / g - 2.0 * poisson / a) * cc * ss + ss * ss / b;
        // The strains that this tension makes, of shear too.
        let along = turned_stiffness(&LAW, degrees).try_inverse().expect("positive").column(0).into_owned();
        let strain = along / along[0];
        let section = laid(1e-3, 1, &[degrees], Axis::Material);
        let shells = strained(&section, LAW, [strain[0], strain[1], strain[2]], [0.0; 3]);
        let [force, _] = resultants(&shells, &layers(1e-3, 1, 1));
        assert!((force[0] * compliance - 1.0).abs() < 1e-8, "{degrees}: {force} {compliance}");
        assert!(force[1].abs().max(force[2].abs()) < 1e-8 * force[0], "{degrees}: {force}");
    }
}

#[test]
fn axes_are_those_of_the_material_of_the_element_or_across_a_vector() {
    // An element that stands aslant in space, its first side along p.
    let (p, q) = ([0.6, 0.0, 0.8], [0.0, 1.0, 0.0]);
    let (x, corners) = grid(1, 1, |s, t| std::array::from_fn(|i| 0.01 * (s * p[i] + t * q[i])));
    let law = ChangChang { ax: 0.0, ay: 2.0, az: 0.0, ..LAW };
    // The normal is (-0.8, 0, 0.6); z times it is along -y.
    for (axis, expected) in
        [(Axis::Material, [0.0, 1.0]), (Axis::Side, [1.0, 0.0]), (Axis::Across([0.0, 0.0, 1.0]), [0.0, -1.0])]
    {
        let section = laid(1e-3, 1, &[0.0], axis);
        let shells = Shells::of(&x, &corners, &section, &composite(law)).expect("a sound section");
        let found = shells.variables(0);
        assert!((found[0] - expected[0]).hypot(found[1] - expected[1]) < 1e-12, "{axis:?}: {found:?}");
        assert_eq!(found.len(), 2 + ChangChang::OF_LAYER.len());
    }
    let normal = ChangChang { ax: -0.8, ay: 0.0, az: 0.6, ..LAW };
    let section = laid(1e-3, 1, &[0.0], Axis::Material);
    assert!(Shells::of(&x, &corners, &section, &composite(normal)).is_err());
}

#[test]
fn plies_turn_with_their_element() {
    let section = laid(1e-3, 1, &[30.0, -70.0], Axis::Side);
    let mut shells = strained(&section, LAW, [1e5, -3e4, 5e4], [0.0; 3]);
    let before: Vec<[f64; 5]> = (0..2).map(|layer| shells.stress(0, layer)).collect();
    let (dt, angle) = (1e-6, 0.05);
    let axis = [2.0 / 7.0, 3.0 / 7.0, 6.0 / 7.0];
    for _ in 0..100 {
        for node in 0..4 {
            let r = at(&shells.x, node);
            let k = super::cross(axis, r);
            let kk = super::cross(axis, k);
            let (sin, cos) = f64::sin_cos(angle);
            set(&mut shells.v, node, std::array::from_fn(|i| (sin * k[i] + (1.0 - cos) * kk[i]) / dt));
            set(&mut shells.turning.w, node, axis.map(|a| 2.0 * f64::tan(0.5 * angle) / dt * a));
        }
        advance(&mut shells, dt);
        shells.compute(&step(dt, 1e6), Width::best());
    }
    for (layer, before) in before.iter().enumerate() {
        for (now, then) in shells.stress(0, layer).iter().zip(before) {
            assert!((now - then).abs() < 1e-6 * before[0].abs(), "{layer}: {now} {then}");
        }
    }
}

/// Pulls an element along x until all its plies are gone; the work of its nodes and its internal energy.
#[test]
fn the_energy_of_an_element_that_is_torn_is_the_work_of_its_nodes() {
    for law in [BRITTLE, ChangChang { strain_tension_a: 0.02, strain_b: 0.03, ..BRITTLE }] {
        let section = laid(1e-3, 1, &[0.0, 90.0, 45.0], Axis::Material);
        let (x, corners) = grid(1, 1, |s, t| [0.01 * s, 0.01 * t, 0.0]);
        let mut shells = Shells::of(&x, &corners, &section, &composite(law)).expect("a sound section");
        let (dt, rate) = (1e-8, 100.0);
        let (mut work, mut internal) = (0.0, 0.0);
        let mut before: Vec<[f64; 3]> = vec![[0.0; 3]; 4];
        for _ in 0..60_000 {
            for node in 0..4 {
                let stretched = 0.01 * rate * f64::from(u8::from(node % 2 == 1));
                set(&mut shells.v, node, [stretched, 0.0, 0.0]);
            }
            advance(&mut shells, dt);
            let vote: ElementVote = shells.compute(&step(dt, 1e5), Width::best());
            internal = vote.internal;
            for (node, before) in before.iter_mut().enumerate() {
                let (f, v) = (at(&shells.f, node), at(&shells.v, node));
                work -= 0.5 * dt * (0..3).map(|i| (f[i] + before[i]) * v[i]).sum::<f64>();
                *before = f;
            }
        }
        let n = ChangChang::OF_LAYER.len();
        let variables = shells.variables(0);
        let gone = |layer: usize| variables[2 + layer * n + n - 1];
        assert_eq!([0, 1, 2].map(gone)[0], 1.0, "the ply along x is torn");
        assert!(internal > 0.0 && (work / internal - 1.0).abs() < 1e-3, "{work} {internal}");
    }
}

fn stirred(width: Width, law: ChangChang) -> (Shells, ElementVote) {
    let (x, corners) = warped();
    let section = laid(0.05, 2, &[0.0, 45.0, -30.0, 90.0], Axis::Material);
    let law = ChangChang { ax: 1.0, ay: 0.3, az: 0.1, ..law };
    let mut shells = Shells::of(&x, &corners, &section, &composite(law)).expect("a sound section");
    for node in 0..x.len() {
        let phase = node as f64;
        let v = [30.0 * phase.sin(), 40.0 * (2.0 * phase).cos(), 50.0 * (3.0 * phase).sin()];
        set(&mut shells.v, node, v);
        let turn = [200.0 * phase.cos(), 100.0 * (1.5 * phase).sin(), 20.0 * phase.sin()];
        set(&mut shells.turning.w, node, turn);
    }
    let mut vote = ElementVote::default();
    for _ in 0..60 {
        advance(&mut shells, 5e-6);
        vote = shells.compute(&step(5e-6, 1e8), width);
        kick(&mut shells, 5e-6, 0.0, &[], &[]);
    }
    (shells, vote)
}

#[test]
fn every_lane_width_gives_the_same_bits_while_plies_fail() {
    let held = ChangChang { strain_tension_a: 0.02, strain_b: 0.02, strain_effective: 0.03, ..BRITTLE };
    let n = ChangChang::OF_LAYER.len();
    for law in [LAW, BRITTLE, held] {
        let (scalar, vote) = stirred(Width::Scalar, law);
        assert!(vote.fault.is_none() && vote.internal > 0.0, "{vote:?}");
        let all = |shells: &Shells| -> Vec<u64> {
            (0..shells.n_elements()).flat_map(|e| shells.variables(e)).map(f64::to_bits).collect()
        };
        // Each mode has failed somewhere, and somewhere it has not.
        for mode in 5..9 {
            let of =
                |e: usize| scalar.variables(e)[2..].chunks(n).map(|layer| layer[mode]).collect::<Vec<_>>();
            let values: Vec<f64> = (0..scalar.n_elements()).flat_map(of).collect();
            let failed = values.iter().filter(|value| **value == 1.0).count();
            assert!(law == LAW && failed == 0 || law != LAW && failed < values.len(), "{mode}: {failed}");
        }
        let matrix =
            (0..scalar.n_elements()).any(|e| scalar.variables(e)[2..].chunks(n).any(|l| l[7] == 1.0));
        assert_eq!(matrix, law != LAW);
        for width in Width::ALL.into_iter().filter(|width| width.available()) {
            let (wide, other) = stirred(width, law);
            assert_eq!(vote, other, "{width}");
            assert!(all(&scalar) == all(&wide), "{width}");
            for (a, b) in [(&scalar.x, &wide.x), (&scalar.turning.w, &wide.turning.w)] {
                assert!(a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| a.to_bits() == b.to_bits()));
            }
        }
    }
}
