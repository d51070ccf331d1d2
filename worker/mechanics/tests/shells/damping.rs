//! What damps shells, against the energy that a free sheet loses.

use mechanics::{element::shell4::Rule, lanes::Width};

use super::{IN_PLANE, advance, at, grid, kick, material, set, shells, step};

/// Time steps of a run and their length (s), two thirds of what the sheet allows.
const STEPS: usize = 4000;
const DT: f64 = 1e-6;

/// A sheet of 16 shells shakes by itself, as fast as its mesh can and then in every mode.
#[test]
fn a_free_sheet_loses_what_its_damping_books() {
    let (x, corners) = grid(4, 4, |s, t| [0.04 * s, 0.04 * t, 0.0]);
    let rows = |n: usize| [if (n % 5).is_multiple_of(2) { 10.0 } else { -10.0 }, 0.0, 0.0];
    let all = |n: usize| [2, 3, 5].map(|a| 2.0 * ((n * n * a + 7 * n + a) % 11) as f64 - 10.0);
    for in_plane in IN_PLANE {
        for (name, velocity) in [("rows", &rows as &dyn Fn(usize) -> [f64; 3]), ("all modes", &all)] {
            let steel = material(2.04e11, 0.27, 8000.0);
            let mut sheet = shells((&x, &corners), 0.002, (in_plane, Rule::Gauss(3)), &steel);
            for node in 0..x.len() {
                set(&mut sheet.v, node, velocity(node));
            }
            sheet.compute(&step(0.0, 1e6), Width::best());
            kick(&mut sheet, 0.5 * DT, 0.0, &[], &[]);
            let (mut hourglass, mut heat, mut first, mut worst) = (0.0, 0.0, 0.0, 0.0_f64);
            for n in 0..STEPS {
                advance(&mut sheet, DT);
                let vote = sheet.compute(&step(DT, 1e6), Width::best());
                hourglass += vote.hourglass;
                heat += vote.viscosity;
                let old = (sheet.v.clone(), sheet.turning.w.clone());
                kick(&mut sheet, DT, 0.0, &[], &[]);
                let mut kinetic = 0.0;
                for node in 0..x.len() {
                    for (scale, old, new) in [
                        (sheet.mass[node], &old.0, &sheet.v),
                        (sheet.turning.inertia[node], &old.1, &sheet.turning.w),
                    ] {
                        let (old, new) = (at(old, node), at(new, node));
                        kinetic += (0..3).map(|a| 0.5 * scale * old[a] * new[a]).sum::<f64>();
                    }
                }
                let total = kinetic + vote.internal + hourglass;
                if n == 0 {
                    first = total;
                }
                worst = worst.max((total / first - 1.0).abs());
            }
            println!("{in_plane:?}, {name}: heat {:.4} of the energy, error {worst:.2e}", heat / first);
            assert!(heat > 0.1 * first, "{in_plane:?}, {name}: hardly damped, {heat} of {first}");
            assert!(worst < 1e-2, "{in_plane:?}, {name}: error {worst}");
        }
    }
}
