//! Energy and momentum of a body that shakes, yields and heats.

use mechanics::{block::Block, lanes::Width};

use crate::bodies::*;

#[test]
fn energy_and_momentum_of_a_free_body_are_conserved() {
    for material in all_laws() {
        let mut piece = grid(&material, [6, 5, 4], 0.01, 0.1, 4);
        let mut draws = Draws(5);
        for (v, x) in piece.v.iter_mut().zip(&piece.x) {
            *v = [200.0 - 8000.0 * x[0], 6000.0 * x[2] - 100.0, 20.0 * draws.next()];
        }
        let mut block = Block::new(&piece);
        let momentum = |block: &Block| -> [f64; 3] {
            std::array::from_fn(|axis| (0..block.nodes.len()).map(|n| block.mass[n] * block.v[axis][n]).sum())
        };
        let before = momentum(&block);
        let scale: f64 = block.mass.iter().sum::<f64>() * 200.0;
        let mut dt = 0.0;
        let (mut first, mut taken, mut worst) = (0.0, 0.0, 0.0_f64);
        for cycle in 0..300 {
            advance(&mut block, dt);
            let vote = compute(&mut block, &material, &full_step(dt), Width::best());
            assert!(vote.fault.is_none(), "{:?}", vote.fault);
            taken += vote.hourglass;
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
        assert!(worst < 0.02, "{worst} with {material:?}");
        for (now, before) in momentum(&block).into_iter().zip(before) {
            assert!((now - before).abs() < 1e-9 * scale, "{now} {before}");
        }
    }
}
