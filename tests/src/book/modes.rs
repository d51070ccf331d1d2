//! The 24 modes of a free one-point cube, with and without hourglass control, and the time step that they allow.

use mechanics::{
    block::Block,
    element::{
        hourglass::Hourglass,
        shell4::{Rule, ShellStep, Shells},
    },
    exact::Quantum,
    lanes::Width,
    material::Material,
    piece::Piece,
};
use nalgebra::{Rotation3, SMatrix, Vector3};

use super::bodies::*;
use crate::{
    case::Figures,
    solve::{model, run},
};

type Matrix24 = SMatrix<f64, 24, 24>;

/// Forces on the nodes of a cube by displacements (with no `hourglass` control) or velocities of single ones, with the
/// opposite sign: stiffness, or damping of the control.
fn response(material: &Material, corners: &[[f64; 3]; 8], hourglass: f64, by_velocity: bool) -> Matrix24 {
    let rest = one(material, corners);
    let amplitude = 1e-6;
    let answer = |freedom: usize, amplitude: f64| -> [f64; 24] {
        let mut body: Piece = rest.clone();
        body.v[freedom / 3][freedom % 3] = amplitude;
        let mut block = Block::new(&body);
        let step = bare_step(1.0, 1e-6, 1.0);
        if !by_velocity {
            advance(&mut block, step.dt);
        }
        let mut without = Block::new(&block.piece());
        compute(&mut without, material, &step, Width::best());
        if !by_velocity {
            return std::array::from_fn(|i| without.f[i % 3][i / 3]);
        }
        let mut block = Block::new(&controlled(block.piece(), Hourglass::viscous(hourglass)));
        compute(&mut block, material, &step, Width::best());
        std::array::from_fn(|i| block.f[i % 3][i / 3] - without.f[i % 3][i / 3])
    };
    let mut matrix = Matrix24::zeros();
    for freedom in 0..24 {
        let (plus, minus) = (answer(freedom, amplitude), answer(freedom, -amplitude));
        for row in 0..24 {
            matrix[(row, freedom)] = 0.5 * (minus[row] - plus[row]) / amplitude;
        }
    }
    0.5 * (matrix + matrix.transpose())
}

/// Eigenvalues, ascending.
fn eigenvalues(matrix: Matrix24) -> Vec<f64> {
    let mut values: Vec<f64> = matrix.symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(f64::total_cmp);
    values
}

/// How many are nothing beside the greatest.
fn zeros(values: &[f64]) -> f64 {
    let greatest = values.iter().fold(0.0_f64, |top, v| top.max(v.abs()));
    values.iter().filter(|v| v.abs() < 1e-4 * greatest).count() as f64
}

pub(super) fn a_free_cube_has_six_strain_modes_and_control_resists_the_twelve_others(figures: &mut Figures) {
    let (density, bulk, shear, h) = (2.0, 3.0, 0.7, 0.5);
    let material = elastic(density, bulk, shear);
    let corners = UNIT_CUBE.map(|x| x.map(|c| h * (c - 0.5)));
    let stiffness = response(&material, &corners, 0.0, false);
    let values = eigenvalues(stiffness);
    figures.add("free cube: modes without a frequency, no hourglass control", zeros(&values));
    // Frequencies squared are eigenvalues over the mass of a node, density h^3 / 8.
    for value in &values[18..23] {
        figures.add("free cube: deviatoric modes, density h^2 omega^2 over G", 8.0 * value / (h * shear));
    }
    figures.add("free cube: volumetric mode, density h^2 omega^2 over K", 8.0 * values[23] / (h * bulk));
    let damping = response(&material, &corners, 0.1, true);
    let resisted = eigenvalues(damping);
    figures.add("free cube: modes that hourglass control resists", 24.0 - zeros(&resisted));
    let scale = |m: &Matrix24| m / m.norm();
    let both = eigenvalues(scale(&stiffness) + scale(&damping));
    figures.add("free cube: modes without resistance, with hourglass control", zeros(&both));
    // What control does to strains: the two matrices have no motion in common.
    figures.add(
        "free cube: share of strains that hourglass control resists",
        (scale(&stiffness) * scale(&damping)).norm(),
    );
}

/// Sign patterns of the four hourglass modes.
const PATTERNS: [[f64; 8]; 4] = [
    [1.0, 1.0, -1.0, -1.0, -1.0, -1.0, 1.0, 1.0],
    [1.0, -1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0],
    [1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0],
];

pub(super) fn each_hourglass_pattern_is_resisted_without_resultant_and_decays(figures: &mut Figures) {
    let material = elastic(1.0, 1.0, 0.4);
    let (mut free, mut sum, mut moment) = (0.0_f64, 0.0_f64, 0.0_f64);
    for corners in [UNIT_CUBE, SKEWED] {
        for (pattern, axis) in PATTERNS.iter().flat_map(|p| (0..3).map(move |axis| (p, axis))) {
            let mut body = one(&material, &corners);
            for (v, sign) in body.v.iter_mut().zip(pattern) {
                v[axis] = 1e-3 * sign;
            }
            let mut block = Block::new(&body);
            let step = bare_step(1e-3, 1e-3, 1.0);
            advance(&mut block, step.dt);
            let body = block.piece();
            compute(&mut block, &material, &step, Width::best());
            // A strain of first order would give 1e-6. On a skewed element the pattern does strain.
            if corners == UNIT_CUBE {
                free = free.max(largest_force(&block) / 1e-6);
            }
            block = Block::new(&controlled(body.clone(), Hourglass::viscous(0.1)));
            compute(&mut block, &material, &step, Width::best());
            let largest = largest_force(&block);
            assert!(largest > 1e-5, "{largest}");
            let forces: Vec<Vector3<f64>> = (0..8).map(|node| force(&block, node).into()).collect();
            let turns = forces.iter().zip(&body.x).map(|(f, x)| Vector3::from(*x).cross(f));
            sum = sum.max(forces.iter().sum::<Vector3<f64>>().norm() / largest);
            moment = moment.max(turns.sum::<Vector3<f64>>().norm() / largest);
            let power: f64 = forces.iter().zip(&body.v).map(|(f, v)| f.dot(&Vector3::from(*v))).sum();
            assert!(power < 0.0, "{power}");
        }
    }
    figures.add("hourglass patterns: force without control over that of a strain", free);
    figures.add("hourglass patterns: resultant of the control over its largest force", sum);
    figures.add("hourglass patterns: moment of the control over its largest force", moment);

    for pattern in PATTERNS {
        let mut body = one(&material, &UNIT_CUBE);
        for (v, sign) in body.v.iter_mut().zip(pattern) {
            v[1] = 1e-6 * sign;
        }
        let mut block = Block::new(&controlled(body, Hourglass::viscous(0.1)));
        let dt = 0.02;
        let step = bare_step(dt, 1e-6, 1e-12);
        let kinetic = |block: &Block| {
            let squares = block.v.iter().map(|v| v.iter().take(8).map(|v| v * v).sum::<f64>());
            0.5 * 0.125 * squares.sum::<f64>()
        };
        let first = kinetic(&block);
        let (mut before, mut booked) = (first, 0.0);
        for _ in 0..100 {
            advance(&mut block, dt);
            booked += compute(&mut block, &material, &step, Width::best()).hourglass;
            kick(&mut block, dt);
            let now = kinetic(&block);
            assert!(now < before, "{before} to {now}");
            before = now;
        }
        figures.add("hourglass patterns: energy left after 100 steps", before / first);
        figures.add("hourglass patterns: energy booked over energy lost", booked / (first - before));
    }
}

/// Density, bulk and shear modulus of the steel of time steps: 210 GPa, 0.3.
const STEEL: (f64, f64, f64) = (7850.0, 210e9 / 1.2, 210e9 / 2.6);
/// One millimetre over the longitudinal speed of that steel (s).
const CROSSING: f64 = 1.666394535606535e-7;

fn millimetre() -> [[f64; 3]; 8] {
    UNIT_CUBE.map(|x| x.map(|c| 1e-3 * c))
}

pub(super) fn time_steps_are_those_of_the_thinnest_way_through(figures: &mut Figures) {
    let material = elastic(STEEL.0, STEEL.1, STEEL.2);
    let mut block = Block::new(&one(&material, &millimetre()));
    let mut step = bare_step(0.0, 1e6, 1.0);
    let limit = compute(&mut block, &material, &step, Width::best()).courant;
    figures.add("steel cube of 1 mm: limit of the time step (s)", limit);
    // A slow compression switches the linear viscosity on.
    step.linear_viscosity = 0.06;
    for node in [1, 2, 5, 6] {
        block.v[0][node] = -1e-12;
    }
    let limit = compute(&mut block, &material, &step, Width::best()).courant;
    figures.add("steel cube of 1 mm: limit with linear viscosity of 0.06 (s)", limit);

    let material = elastic(1.0, 1.0 - 4.0 / 3.0 * 0.3, 0.3);
    for [x, y, z] in [[1.0, 1.0, 0.01], [0.01, 1.0, 1.0], [1.0, 0.01, 0.01], [1.0, 0.5, 0.2]] {
        // Turned out of the axes, where the bound is not the value.
        let turn = Rotation3::from_euler_angles(0.3, -0.8, 1.1);
        let corners = UNIT_CUBE.map(|[i, j, k]| (turn * Vector3::new(x * i, y * j, z * k)).into());
        let mut block = Block::new(&one(&material, &corners));
        let limit = compute(&mut block, &material, &bare_step(0.0, 1.0, 1.0), Width::best()).courant;
        figures.add("flat element: limit times wave speed over thickness", limit / x.min(y).min(z));
    }

    let steel = elastic(STEEL.0, STEEL.1, STEEL.2);
    let x = [[0.0; 3], [1e-3, 0.0, 0.0], [1e-3, 1e-3, 0.0], [0.0, 1e-3, 0.0]];
    let mut shells = Shells::new(&x, &[[0, 1, 2, 3]], 1e-4, Rule::Gauss(2), &steel).expect("a sound section");
    let quantum = Quantum::for_reference(1e3, 49);
    let step =
        ShellStep { dt: 1e-9, force_quantum: quantum, moment_quantum: quantum, energy_quantum: quantum };
    figures
        .add("steel shell of 1 mm: limit of the time step (s)", shells.compute(&step, Width::best()).courant);

    for safety in [0.6666, 0.9] {
        let solved = run(model(&format!(
            "title = \"cube\"\nunits = \"SI\"\n[control]\nend_cycle = 60\nend_time = 1\nsafety_factor = {safety}\n\
             [output]\nhistory_cycles = 1\n[[part]]\nname = \"cube\"\nvelocity = [1, 2, 3]\nmaterial = {{ density = 7850, \
             eos = {{ type = \"linear\", bulk = 175e9 }}, strength = {{ type = \"elastic\", shear = {:e} }} }}\n\
             box = {{ origin = [0, 0, 0], size = [1e-3, 1e-3, 1e-3], cells = [1, 1, 1] }}\n",
            STEEL.2
        )));
        let last = solved.rows.last().expect("rows");
        figures.add(&format!("steel cube of 1 mm @ step of a run at safety {safety} (s)"), last.dt);
    }
}

pub(super) fn an_isolated_cube_is_stable_to_its_own_limit_only(figures: &mut Figures) {
    let material = elastic(STEEL.0, STEEL.1, STEEL.2);
    let cube = millimetre();
    for ratio in [0.73, 0.735, 0.76] {
        let mut body = one(&material, &cube);
        for (v, x) in body.v.iter_mut().zip(cube) {
            *v = x.map(|c| 1e-3 * (c - 0.5e-3));
        }
        let mut block = Block::new(&body);
        let dt = ratio * CROSSING;
        let mut largest = 0.0_f64;
        for _ in 0..150 {
            advance(&mut block, dt);
            compute(&mut block, &material, &bare_step(dt, 1.0, 1.0), Width::best());
            kick(&mut block, dt);
            largest = block.v.iter().flatten().fold(largest, |l, v| l.max(v.abs()));
        }
        let of = format!("isolated cube @ {ratio} of its crossing time");
        figures.add(&format!("{of}, greatest velocity over the first"), largest / 0.5e-6);
    }
}
