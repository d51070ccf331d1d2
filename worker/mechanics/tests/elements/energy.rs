//! Energy and momentum of a body that shakes, yields and heats, and of a shock.

use mechanics::{
    block::Block,
    element::hourglass::{Hourglass, Kind},
    lanes::Width,
    material::{Eos, Strength},
    state::field,
};

use crate::bodies::*;

#[test]
fn energy_and_momentum_of_a_free_body_are_conserved() {
    let controls = Kind::ALL.map(|kind| Hourglass { kind, coefficient: kind.usual() });
    let all = all_laws().into_iter().flat_map(|material| controls.map(|control| (material.clone(), control)));
    for (material, control) in all {
        let mut piece = controlled(grid(&material, [6, 5, 4], 0.01, 0.1, 4), control);
        let mut draws = Draws(5);
        for (v, x) in piece.v.iter_mut().zip(&piece.x) {
            *v = [200.0 - 8000.0 * x[0], 6000.0 * x[2] - 100.0, 20.0 * draws.next()];
        }
        let mut block = Block::new(&piece);
        let momentum = |block: &Block| -> [f64; 3] {
            std::array::from_fn(|axis| (0..block.nodes.len()).map(|n| block.mass[n] * block.v[axis][n]).sum())
        };
        let before = momentum(&block);
        let scale: f64 = block.mass[..block.nodes.len()].iter().sum::<f64>() * 200.0;
        let mut dt = 0.0;
        let (mut first, mut taken, mut worst) = (0.0, 0.0, 0.0_f64);
        for cycle in 0..300 {
            advance(&mut block, dt);
            let vote = compute(&mut block, &material, &full_step(dt), Width::best());
            assert!(vote.fault.is_none(), "{:?}", vote.fault);
            taken += vote.hourglass;
            // Every sum here is exact, so a free body's forces leave nothing at all.
            for f in &block.f {
                assert_eq!(f.iter().sum::<f64>(), 0.0);
            }
            let next = 0.6666 * vote.courant.min(vote.volume_limit);
            let next = if cycle == 0 { 0.1 * next } else { next.min(1.05 * dt) };
            // The velocities stand half of the last step before the forces and half of the next behind.
            let kinetic = kick(&mut block, 0.5 * (dt + next));
            dt = next;
            let total = kinetic + vote.internal + taken;
            if cycle == 0 {
                first = total;
            }
            worst = worst.max((total / first - 1.0).abs());
        }
        assert!(worst < 0.02, "{worst} with {control:?}, {material:?}");
        for (now, before) in momentum(&block).into_iter().zip(before) {
            assert!((now - before).abs() < 1e-13 * scale, "{now} {before}, scale {scale}");
        }
    }
}

/// A column of 200 elements, free to move along z only, run onto by a piston at `up`: pressure and density over
/// initial density, averaged over the plateau, and the speed of the front.
fn piston(up: f64) -> [f64; 3] {
    let eos = Eos::Shock { c0: 3940.0, s: 1.489, gamma: 2.02 };
    let material = material(8960.0, eos, Strength::Hydro);
    let h = 1e-3;
    let mut block = Block::new(&grid(&material, [1, 1, 200], h, 0.0, 1));
    let mut step = full_step(0.0);
    let (mut dt, mut time) = (0.0, 0.0);
    let mut passed = [None; 2];
    while time < 2.6e-5 {
        block.v[0].fill(0.0);
        block.v[1].fill(0.0);
        block.v[2][..4].fill(up);
        advance(&mut block, dt);
        step.dt = dt;
        let vote = compute(&mut block, &material, &step, Width::best());
        dt = 0.6 * vote.courant.min(vote.volume_limit);
        kick(&mut block, dt);
        for (passed, node) in passed.iter_mut().zip([40, 100]) {
            if passed.is_none() && block.v[2][4 * node] > 0.5 * up {
                *passed = Some((time, h * node as f64));
            }
        }
        time += dt;
    }
    let mean = |field: usize| (20..80).map(|element| block.field(element, field)).sum::<f64>() / 60.0;
    let [(t0, z0), (t1, z1)] = passed.map(|p| p.expect("the front went by"));
    [mean(field::PRESSURE), 8960.0 / mean(field::RELATIVE_VOLUME), (z1 - z0) / (t1 - t0)]
}

#[test]
fn a_piston_drives_the_shock_of_the_hugoniot() {
    for (up, pressure, us) in [(250.0, 9.65944e9, 4312.25), (500.0, 20.98656e9, 4684.5)] {
        let [p, density, speed] = piston(up);
        assert!((p / pressure - 1.0).abs() < 5e-3, "pressure {p} {pressure}");
        assert!((density / (8960.0 * us / (us - up)) - 1.0).abs() < 5e-3, "density {density}");
        assert!((speed / us - 1.0).abs() < 1e-2, "speed {speed} {us}");
    }
}
