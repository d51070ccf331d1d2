//! Verification book 4.3: energy of the penalty spring under central differences.

use crate::world::{Random, block, with_probe};

#[test]
fn a_bounce_on_a_fixed_face_keeps_its_energy_as_the_table_says() {
    let table = [
        (0.05, 3.6e-4, 1.000),
        (0.1, 2.4e-3, 1.001),
        (0.2, 8.8e-3, 1.005),
        (0.4, 2.6e-2, 1.020),
        (0.8, 0.111, 1.088),
        (1.2, 0.55, 1.20),
    ];
    let (mut world, probe) = with_probe(block([1, 1, 1], 1.0), 0.1, &|_| true);
    let omega = 0.5_f64.sqrt();
    let speed = 0.5 * 0.1 * omega;
    let mut random = Random(4711);
    for (omega_dt, energy, deepest) in table {
        let dt = omega_dt / omega;
        let (mut worst, mut depth) = (0.0_f64, 0.0_f64);
        for _ in 0..300 {
            let mut z = 1.1 + random.next() * speed * dt;
            let mut v = -speed;
            for _ in 0..100_000 {
                world.place(probe, [0.4, 0.7, z]);
                let vote = world.forces(dt);
                depth = depth.max(vote.worst_depth);
                v += dt * world.force_on(probe)[2];
                z += dt * v;
                if v > 0.0 && z > 1.1 {
                    break;
                }
            }
            assert!(v > 0.0 && z > 1.1);
            worst = worst.max((v * v / (speed * speed) - 1.0).abs());
        }
        println!(
            "omega dt {omega_dt}: energy {worst:.2e} (table {energy:.1e}), depth {:.4}",
            depth * 0.1 * omega / speed
        );
        assert!(worst < 1.2 * energy, "omega dt {omega_dt}: {worst} for {energy}");
        assert!(depth * 0.1 * omega / speed < deepest + 0.002, "omega dt {omega_dt}: depth {depth}");
    }
}
