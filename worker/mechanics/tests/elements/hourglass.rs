//! Elastic hourglass control of one element: what its forces are, that they keep energy and turn with the element, and when they yield.

use mechanics::{
    block::Block,
    element::hourglass::{Hourglass, Kind},
    lanes::Width,
    material::{Failure, Material},
    piece::Piece,
    state::field,
};
use nalgebra::{Rotation3, Vector3};

use crate::bodies::*;

const ELASTIC: [Hourglass; 2] = [
    Hourglass { kind: Kind::Stiffness, coefficient: 0.05 },
    Hourglass { kind: Kind::AssumedStrain, coefficient: 1.0 },
];

/// Sign patterns of the modes eta zeta, xi zeta, xi eta, xi eta zeta.
const PATTERNS: [[f64; 8]; 4] = [
    [1.0, 1.0, -1.0, -1.0, -1.0, -1.0, 1.0, 1.0],
    [1.0, -1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0],
    [1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0],
];

/// Bulk and shear modulus; Young's modulus 2.25, Poisson's ratio 0.25.
const MODULI: (f64, f64) = (1.5, 0.9);

fn moved(piece: &Piece, pattern: usize, axis: usize, amplitude: f64) -> Piece {
    let mut piece = piece.clone();
    for (v, sign) in piece.v.iter_mut().zip(PATTERNS[pattern]) {
        v[axis] += amplitude * sign;
    }
    piece
}

/// The stiffness of a box against a pattern along an axis: work over half the squared amplitude.
fn stiffness(size: [f64; 3], control: Hourglass, pattern: usize, axis: usize) -> f64 {
    let material = elastic(1.0, MODULI.0, MODULI.1);
    let corners = UNIT_CUBE.map(|x| std::array::from_fn(|a| size[a] * x[a]));
    let amplitude = 1e-7;
    // So slowly that the damping beside the elastic forces takes nothing.
    let dt = 1e5;
    let body = moved(&controlled(one(&material, &corners), control), pattern, axis, amplitude / dt);
    let mut block = Block::new(&body);
    advance(&mut block, dt);
    let vote = compute(&mut block, &material, &bare_step(dt, 1e-6, 1e-14), Width::best());
    2.0 * vote.hourglass / (amplitude * amplitude)
}

#[test]
fn assumed_strains_bend_and_twist_a_box_as_its_closed_forms_say() {
    let (young, poisson, shear) = (2.25, 0.25, MODULI.1);
    let assumed = ELASTIC[1];
    for size in [[1.0, 1.0, 1.0], [3.0, 1.0, 0.5]] {
        let volume = size[0] * size[1] * size[2];
        // The integral of a natural coordinate squared, times (2 / l)^2, is 4 V / (3 l^2).
        let over = |axis: usize| 4.0 * volume / (3.0 * size[axis] * size[axis]);
        for axis in 0..3 {
            let [j, k] = [(axis + 1) % 3, (axis + 2) % 3];
            let bends = young / (1.0 - poisson * poisson) * over(axis);
            for (pattern, expected) in
                [(j, bends), (k, bends), (axis, shear * (over(j) + over(k))), (3, young * over(axis) / 3.0)]
            {
                let found = stiffness(size, assumed, pattern, axis);
                let name = format!("{size:?}, pattern {pattern} along {axis}");
                assert!((found / expected - 1.0).abs() < 1e-5, "{name}: {found} {expected}");
            }
        }
    }
}

#[test]
fn stiffness_of_one_is_that_of_the_fastest_strain_of_a_cube() {
    let control = Hourglass { kind: Kind::Stiffness, coefficient: 1.0 };
    // 8 k = 4 (K + 4G/3) h.
    let expected = 4.0 * (MODULI.0 + 4.0 / 3.0 * MODULI.1) * 0.5;
    for (pattern, axis) in [(0, 0), (1, 0), (3, 2)] {
        let found = stiffness([0.5; 3], control, pattern, axis);
        assert!((found / expected - 1.0).abs() < 1e-5, "{found} {expected}");
    }
}

#[test]
fn a_freely_swinging_pattern_keeps_its_energy() {
    let material = elastic(1.0, MODULI.0, MODULI.1);
    for control in ELASTIC {
        for (pattern, axis) in (0..4).flat_map(|pattern| (0..3).map(move |axis| (pattern, axis))) {
            let body = moved(&controlled(one(&material, &UNIT_CUBE), control), pattern, axis, 1e-6);
            let mut block = Block::new(&body);
            let dt = 0.02;
            let (mut taken, mut least, mut worst) = (0.0, 1.0_f64, 0.0_f64);
            for _ in 0..1000 {
                advance(&mut block, dt);
                taken += compute(&mut block, &material, &bare_step(dt, 1e-6, 1e-12), Width::best()).hourglass;
                // Eight nodes with an eighth of the mass each: half of the squared amplitude at first.
                let kinetic = kick(&mut block, dt) / 0.5e-12;
                least = least.min(kinetic);
                worst = worst.max((kinetic + taken / 0.5e-12 - 1.0).abs());
            }
            let name = format!("{control:?}, pattern {pattern} along {axis}");
            // Twisting goes over to the other axes and back.
            assert!(least < 0.5, "{name}: it does not swing, {least}");
            assert!(worst < 5e-3, "{name}: {worst}");
        }
    }
}

/// An element of a ball of soft lead that struck a plate at 200 m/s: the patterns of its modes, less what of them is linear, are up to 77
/// times as long as in a box.
const SQUASHED: [[f64; 3]; 8] = [
    [-0.125, -1.5819, -1.7291],
    [0.8986, -2.0016, -2.2129],
    [0.894, -2.4533, -0.1007],
    [-0.4956, -2.4338, -0.7559],
    [-0.9076, 3.1237, 2.4231],
    [0.8952, 2.475, 2.3551],
    [0.9087, 1.3809, -0.1053],
    [-2.0683, 1.4909, 0.1257],
];

#[test]
fn control_drives_no_element_that_is_squashed_and_bent() {
    let material = elastic(1.0, MODULI.0, MODULI.1);
    for control in [Hourglass::viscous(0.03), Hourglass::VISCOUS, ELASTIC[0], ELASTIC[1]] {
        let mut body = controlled(one(&material, &SQUASHED), control);
        let mut draws = Draws(7);
        for v in &mut body.v {
            *v = std::array::from_fn(|_| 1e-9 * draws.next());
        }
        let mut block = Block::new(&body);
        let (mut dt, mut first, mut greatest) = (0.0, 0.0, 0.0_f64);
        for cycle in 0..500 {
            advance(&mut block, dt);
            let vote = compute(&mut block, &material, &bare_step(dt, 1e-9, 1e-21), Width::best());
            dt = 2.0 / 3.0 * vote.courant;
            let kinetic = kick(&mut block, dt);
            if cycle == 0 {
                first = kinetic;
            }
            greatest = greatest.max(kinetic);
        }
        assert!(greatest < 1.2 * first, "{control:?}: {greatest} of {first}");
    }
}

#[test]
fn elastic_forces_have_neither_resultant_nor_moment_on_a_skewed_element() {
    let material = elastic(1.0, MODULI.0, MODULI.1);
    for control in ELASTIC {
        for (pattern, axis) in (0..4).flat_map(|pattern| (0..3).map(move |axis| (pattern, axis))) {
            let body = moved(&controlled(one(&material, &SKEWED), control), pattern, axis, 1e-3);
            let step = bare_step(1e-3, 1e-3, 1.0);
            let mut block = Block::new(&body);
            compute(&mut block, &material, &step, Width::best());
            let mut without = Block::new(&controlled(body.clone(), Hourglass::NONE));
            compute(&mut without, &material, &step, Width::best());
            let forces: Vec<Vector3<f64>> =
                (0..8).map(|n| Vector3::from(force(&block, n)) - Vector3::from(force(&without, n))).collect();
            let largest = forces.iter().map(|f| f.norm()).fold(0.0, f64::max);
            assert!(largest > 1e-8, "{largest}");
            let sum: Vector3<f64> = forces.iter().sum();
            let moment: Vector3<f64> =
                forces.iter().zip(&body.x).map(|(f, x)| Vector3::from(*x).cross(f)).sum();
            assert!(sum.norm() < 1e-12 * largest, "{sum}");
            assert!(moment.norm() < 1e-8 * largest, "{moment}, {largest}");
        }
    }
}

/// A body with forces on all modes.
fn strained(control: Hourglass, corners: &[[f64; 3]; 8]) -> Piece {
    let mut body = controlled(one(&elastic(1.0, MODULI.0, MODULI.1), corners), control);
    for (n, values) in body.own.iter_mut().enumerate() {
        values[0] = 1.0 + 0.1 * n as f64;
    }
    body
}

fn forces(block: &Block) -> Vec<Vector3<f64>> {
    let own = block.piece().own;
    own.chunks(3).map(|of_mode| Vector3::new(of_mode[0][0], of_mode[1][0], of_mode[2][0])).collect()
}

#[test]
fn linear_fields_leave_the_forces_and_a_turn_turns_them() {
    let material = elastic(1.0, MODULI.0, MODULI.1);
    let turn = Rotation3::from_euler_angles(0.4, -0.2, 0.7);
    for control in ELASTIC {
        let mut block = Block::new(&strained(control, &SKEWED));
        let before = forces(&block);
        let dt = 1e-3;
        let vote = carry(&mut block, &material, &bare_step(dt, 1e3, 1e3), |x| {
            ((turn * Vector3::from(x) - Vector3::from(x)) / dt).into()
        });
        assert!(vote.hourglass.abs() < 1e-12, "{}", vote.hourglass);
        for (now, before) in forces(&block).into_iter().zip(before) {
            assert!((now - turn * before).norm() < 1e-13, "{now} {}", turn * before);
        }
        let before = forces(&block);
        let vote = carry(&mut block, &material, &bare_step(dt, 1e3, 1e3), |[x, y, z]| {
            [0.1 * x + 0.2 * y, 0.2 * x - 0.3 * z, -0.3 * y + 0.05 * z]
        });
        assert!(vote.hourglass.abs() < 1e-12, "{}", vote.hourglass);
        for (now, before) in forces(&block).into_iter().zip(before) {
            assert!((now - before).norm() < 1e-13, "{now} {before}");
        }
    }
}

#[test]
fn forces_yield_with_the_stress_and_vanish_with_it() {
    let laws = all_laws();
    let yielding = laws.iter().find(|m| m.initial_temperature() > 0.0).expect("Johnson-Cook is a law");
    let fails = |m: &&Material| m.failure != Failure::None && m.shear() > 0.0;
    let failing = laws.iter().find(fails).expect("some fail");
    for control in ELASTIC {
        let dt = 1e-6;
        let mut block = Block::new(&strained(control, &UNIT_CUBE));
        let stretch = |x: [f64; 3]| [1e3 * x[0], -500.0 * x[1], -500.0 * x[2]];
        let mut last = 1.0;
        for _ in 0..10 {
            carry(&mut block, yielding, &bare_step(dt, 1e9, 1e9), stretch);
            let now = forces(&block)[0].x;
            assert!(now > 0.0 && now <= last, "{now} after {last}");
            last = now;
        }
        // A strain of 1 % is five times the one at yield.
        assert!(block.field(0, field::PLASTIC_STRAIN) > 0.005 && last < 0.5, "{last}");

        let mut body = strained(control, &UNIT_CUBE);
        body.fields[field::DAMAGE][0] = 1.0;
        let mut block = Block::new(&moved(&body, 0, 0, 10.0));
        let vote = compute(&mut block, failing, &bare_step(dt, 1e9, 1e6), Width::best());
        assert!(forces(&block).iter().all(|force| force.norm() == 0.0));
        assert!(vote.hourglass > 0.0 && force(&block, 0)[0] < 0.0, "it is resisted viscously");
    }
}

/// The force on a corner of a cube of a material, whole or failed, that moves in a pattern.
fn resisted(control: Hourglass, material: &Material, damage: f64) -> f64 {
    let mut body = moved(&controlled(one(material, &UNIT_CUBE), control), 0, 0, 10.0);
    body.fields[field::DAMAGE][0] = damage;
    let mut block = Block::new(&body);
    compute(&mut block, material, &bare_step(1e-9, 1e9, 1e-6), Width::best());
    -force(&block, 0)[0]
}

#[test]
fn a_failed_element_is_resisted_as_a_fluid_and_broken_ceramic_as_a_solid() {
    let laws = all_laws();
    let find =
        |is: &dyn Fn(&Material) -> bool| laws.iter().find(|m| m.shear() > 0.0 && is(m)).expect("a law");
    let failing = find(&|m| m.failure != Failure::None);
    let ceramic = find(&|m| !m.history().is_empty());
    let viscous = Hourglass::viscous(0.1);
    for (material, share) in [(failing, 3e-4), (ceramic, 1.0)] {
        let whole = resisted(viscous, material, 0.0);
        assert!(whole > 0.0, "{}", material.name);
        for (control, share) in [(viscous, 1.0), (ELASTIC[0], share), (ELASTIC[1], share)] {
            let failed = resisted(control, material, 1.0);
            assert!((failed / whole / share - 1.0).abs() < 1e-6, "{control:?}: {failed} of {whole}");
        }
    }
}
