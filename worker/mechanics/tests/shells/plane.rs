//! Points in the plane against closed forms, and membranes.

use mechanics::{
    element::shell4::{InPlane, Rule, Shells},
    lanes::Width,
    material::Strength,
    mesh::Section,
};

use super::{advance, at, grid, kick, material, set, shells, step};

/// A strip of one element in height that a force bends in its plane: `F L^3 / (3 E I) + 1.2 F L / (G A)`, as the assumed strain has it,
/// where elements that see the bending by bilinear velocities alone are several times too stiff.
#[test]
fn a_strip_of_one_row_bends_in_its_plane_as_a_beam() {
    let (young, poisson, length, height, h) = (2e11, 0.3, 0.2, 0.02, 0.002);
    let (x, corners) = grid(10, 1, |s, t| [length * s, height * t, 0.0]);
    let steel = material(young, poisson, 8000.0);
    let force = 100.0;
    for in_plane in [InPlane::One, InPlane::Four] {
        let mut strip = shells((&x, &corners), h, (in_plane, Rule::Gauss(2)), &steel);
        let load: Vec<_> = [10, 21].map(|node| (node, [0.0, 0.5 * force, 0.0])).into();
        for _ in 0..60_000 {
            advance(&mut strip, 4e-7);
            strip.compute(&step(4e-7, 1e6), Width::best());
            kick(&mut strip, 4e-7, 2000.0, &load, &[0, 11]);
        }
        let inertia = h * height.powi(3) / 12.0;
        let shear = 0.5 * young / (1.0 + poisson) * h * height;
        let beam = force * (length.powi(3) / (3.0 * young * inertia) + 1.2 * length / shear);
        let found = strip.x[1][10] - x[10][1];
        println!("strip in its plane, {in_plane:?}: {found:.4e}, a beam {beam:.4e}");
        assert!((found / beam - 1.0).abs() < 0.02, "{in_plane:?}: {found}, not {beam}");
    }
}

/// One element that opens to a trapezoid in its plane: its ends turn towards each other and stay plane.
fn bent_in_its_plane(in_plane: InPlane, cycles: usize) -> Shells {
    let (x, corners) = grid(1, 1, |s, t| [0.01 * s, 0.01 * t, 0.0]);
    let mut steel = material(2e11, 0.3, 7800.0);
    let shear = 2e11 / 2.6;
    steel.strength = Strength::VonMises { shear, yield_stress: 3e8, hardening: 0.0, rate: None };
    let mut shells = shells((&x, &corners), 0.001, (in_plane, Rule::Gauss(2)), &steel);
    for node in 0..4 {
        let v = if (node % 2 == 1) == (node / 2 == 1) { 0.1 } else { -0.1 };
        set(&mut shells.v, node, [v, 0.0, 0.0]);
    }
    for _ in 0..cycles {
        advance(&mut shells, 1e-8);
        shells.compute(&step(1e-8, 1e6), Width::best());
    }
    shells
}

/// Bending in the plane strains four points, which yield: at `1/sqrt(3)` of half the height each bears the yield stress then, and the end
/// the moment `s H^2 h / (2 sqrt(3))`. One point sees nothing of it, and its hourglass control grows without a limit.
#[test]
fn bending_in_the_plane_yields_at_four_points() {
    let mut moments = [0.0; 2];
    for cycles in [40_000, 50_000] {
        let bent = bent_in_its_plane(InPlane::Four, cycles);
        assert_eq!(bent.hourglass_energy(0), 0.0);
        assert!((0..8).all(|layer| bent.plastic_strain(0, layer) > 1e-3), "a point did not yield");
        let (lower, upper) = (at(&bent.f, 1), at(&bent.f, 3));
        moments[usize::from(cycles > 40_000)] = 0.5 * (lower[0] - upper[0]).abs() * 0.01;
    }
    let exact = 3e8 * 0.01 * 0.01 * 0.001 / (2.0 * 3f64.sqrt());
    println!("plastic moment in the plane: {moments:?}, {exact}");
    assert!(moments.iter().all(|moment| (moment / exact - 1.0).abs() < 0.05), "{moments:?}, not {exact}");
    let elastic = bent_in_its_plane(InPlane::One, 40_000);
    assert_eq!(elastic.plastic_strain(0, 0), 0.0);
    assert!(elastic.hourglass_energy(0) > 0.0);
}

/// A membrane has no moments and no shear across its thickness, and a strip of it swings as a string: `sqrt(sigma / rho) / (2 L)`.
#[test]
fn a_membrane_does_not_bend_and_swings_as_a_string() {
    let (young, density, length) = (1e9, 1000.0, 0.2);
    let (x, corners) = grid(20, 1, |s, t| [length * s, 0.01 * t, 0.0]);
    let rubber = material(young, 0.0, density);
    for in_plane in [InPlane::One, InPlane::Four] {
        let section = Section { is_membrane: true, in_plane, ..Section::of(0.0005, Rule::Gauss(1)) };
        let mut sheet = Shells::of(&x, &corners, &section, &rubber).expect("a sound section");
        // Stretched by 1 % with turned nodes, which strain nothing.
        for node in 0..x.len() {
            set(&mut sheet.v, node, [x[node][0], 0.0, 0.0]);
            set(&mut sheet.turning.w, node, [0.0, 3.0, 0.0]);
        }
        for _ in 0..100 {
            advance(&mut sheet, 1e-4);
            sheet.compute(&step(1e-4, 1e6), Width::best());
        }
        assert!(sheet.turning.m.iter().flatten().all(|&m| m == 0.0));
        let [xx, _, _, yz, zx] = sheet.stress(0, 0);
        assert!((yz, zx) == (0.0, 0.0), "sheared by {yz}, {zx}");
        let stretched = 1.01 * length;
        let fixed: Vec<usize> = [0, 20, 21, 41].into();
        for node in 0..x.len() {
            let swing = (std::f64::consts::PI * x[node][0] / length).sin();
            set(&mut sheet.v, node, [0.0, 0.0, 0.1 * swing]);
            set(&mut sheet.turning.w, node, [0.0; 3]);
        }
        let dt = 2e-6;
        let (mut crossings, mut before, mut cycle) = (Vec::new(), 0.0, 0);
        while crossings.len() < 2 && cycle < 100_000 {
            advance(&mut sheet, dt);
            let middle = sheet.x[2][10];
            if cycle > 10 && (middle > 0.0) != (before > 0.0) {
                crossings.push((f64::from(cycle) - middle / (middle - before)) * dt);
            }
            before = middle;
            sheet.compute(&step(dt, 1e3), Width::best());
            kick(&mut sheet, dt, 0.0, &[], &fixed);
            cycle += 1;
        }
        let frequency = 0.5 / (crossings[1] - crossings[0]);
        // Mass and length of the strip as it is stretched: the mass stays, the density along it falls.
        let string = (xx / (density / 1.01)).sqrt() / (2.0 * stretched);
        println!("membrane, {in_plane:?}: {frequency:.2} Hz, a string {string:.2} Hz, stress {xx:.4e}");
        assert!((frequency / string - 1.0).abs() < 0.02, "{in_plane:?}: {frequency}, not {string}");
    }
}

#[test]
fn sections_that_cannot_be_are_refused() {
    let (x, corners) = grid(1, 1, |s, t| [s, t, 0.0]);
    let section = Section { is_membrane: true, ..Section::of(0.1, Rule::Gauss(2)) };
    let refused = Shells::of(&x, &corners, &section, &material(1e9, 0.3, 1e3)).err().expect("two points");
    assert!(refused.to_string().contains("membrane"), "{refused}");
}
