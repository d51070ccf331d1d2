//! One hexahedron in closed form: volume, gradient, patch test, objectivity.

use mechanics::{
    block::Block,
    element::{
        hex8::{volume, volume_gradient},
        hourglass::Hourglass,
    },
    lanes::Width,
    mesh::Topology,
    state::field,
};
use nalgebra::{Matrix3, Vector3};

use super::bodies::*;
use crate::case::Figures;

/// Volume of [`SKEWED`].
const SKEWED_VOLUME: f64 = 1.014;

/// Derivatives of that volume by the coordinates of the corners: integrals of the trilinear map.
const SKEWED_GRADIENT: [[f64; 3]; 8] = [
    [-0.21833333333333327, -0.23499999999999996, -0.25166666666666665],
    [0.29916666666666664, -0.3008333333333333, -0.2391666666666667],
    [0.22499999999999995, 0.2466666666666666, -0.26499999999999996],
    [-0.2325, 0.26499999999999996, -0.2916666666666666],
    [-0.25166666666666665, -0.2475, 0.25833333333333325],
    [0.24166666666666667, -0.25749999999999995, 0.25749999999999995],
    [0.18499999999999997, 0.2833333333333333, 0.27249999999999996],
    [-0.2483333333333333, 0.2458333333333333, 0.2591666666666666],
];

/// The greatest magnitude.
fn greatest(numbers: impl IntoIterator<Item = f64>) -> f64 {
    numbers.into_iter().fold(0.0, |top, x| top.max(x.abs()))
}

pub(super) fn volumes_and_their_gradients_are_exact(figures: &mut Figures) {
    figures.add("hexahedron: volume of a skewed one", volume(&SKEWED));
    let (sin, cos) = 30f64.to_radians().sin_cos();
    let twisted = UNIT_CUBE.map(|[x, y, z]| {
        let (x, y) = (x - 0.5, y - 0.5);
        if z == 0.0 { [x, y, z] } else { [cos * x - sin * y, sin * x + cos * y, z] }
    });
    figures.add("hexahedron: volume of a cube twisted by 30 degrees", volume(&twisted));

    let gradient = volume_gradient(&SKEWED);
    let components = || (0..8).flat_map(|corner| (0..3).map(move |axis| (corner, axis)));
    figures.add(
        "volume gradient: difference from the integrals",
        greatest(components().map(|(c, a)| gradient[c][a] - SKEWED_GRADIENT[c][a])),
    );
    let quotient = |corner: usize, axis: usize| {
        let [low, high] = [-1e-6, 1e-6].map(|d| {
            let mut moved = SKEWED;
            moved[corner][axis] += d;
            volume(&moved)
        });
        (high - low) / 2e-6
    };
    figures.add(
        "volume gradient: difference from the difference quotient",
        greatest(components().map(|(c, a)| gradient[c][a] - quotient(c, a))),
    );
    figures.add(
        "volume gradient: sum over the corners",
        greatest((0..3).map(|a| gradient.iter().map(|row| row[a]).sum::<f64>())),
    );
    figures.add(
        "volume gradient: sum of x B",
        components().map(|(c, a)| gradient[c][a] * SKEWED[c][a]).sum::<f64>(),
    );
    let l = Matrix3::new(0.3, -0.2, 0.5, 0.1, 0.4, -0.7, 0.6, 0.2, -0.1);
    let velocity: Vec<Vector3<f64>> = SKEWED.iter().map(|x| l * Vector3::from(*x)).collect();
    let of = |i: usize, j: usize| {
        (0..8).map(|c| velocity[c][i] * gradient[c][j]).sum::<f64>() / SKEWED_VOLUME - l[(i, j)]
    };
    figures.add(
        "volume gradient: error of the gradient of linear velocities",
        greatest((0..9).map(|n| of(n / 3, n % 3))),
    );
}

/// Unit cube of seven hexahedra about eight interior nodes (MacNeal and Harder, 1985).
fn patch() -> (Vec<[f64; 3]>, Vec<[u32; 8]>) {
    let mut x = UNIT_CUBE.to_vec();
    x.extend([
        [0.249, 0.342, 0.192],
        [0.826, 0.288, 0.288],
        [0.850, 0.649, 0.263],
        [0.273, 0.750, 0.230],
        [0.320, 0.186, 0.643],
        [0.677, 0.305, 0.683],
        [0.788, 0.693, 0.644],
        [0.165, 0.745, 0.702],
    ]);
    let mut hexahedra = vec![[8, 9, 10, 11, 12, 13, 14, 15]];
    for face in [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]] {
        let [a, b, c, d]: [u32; 4] = face;
        let hexahedron = [a, b, c, d, a + 8, b + 8, c + 8, d + 8];
        if volume(&hexahedron.map(|node| x[node as usize])) > 0.0 {
            hexahedra.push(hexahedron);
        } else {
            let [a, b, c, d, e, f, g, h] = hexahedron;
            hexahedra.push([e, f, g, h, a, b, c, d]);
        }
    }
    (x, hexahedra)
}

/// Displacements of 1e-5 (2x + y + z)/2 and so on, a hundredth of the published ones: strains are finite here, and the small
/// ones of the closed form are met to their first order. Stresses are said a hundredfold.
pub(super) fn the_patch_has_one_stress_and_no_force_inside(figures: &mut Figures) {
    let (young, poisson) = (1e6, 0.25);
    let (bulk, shear) = (young / 3.0 / (1.0 - 2.0 * poisson), young / 2.0 / (1.0 + poisson));
    let material = elastic(1.0, bulk, shear);
    let (x, hexahedra) = patch();
    let body = piece(&material, x, Topology::Explicit { hexahedra });
    let mut block = Block::new(&controlled(body, Hourglass::viscous(0.1)));
    let dt = 1e-3;
    let step = bare_step(dt, 10.0, 1e-3);
    let h = Matrix3::from_fn(|i, j| if i == j { 1e-5 } else { 0.5e-5 });
    let vote = carry(&mut block, &material, &step, |x| (h / dt * Vector3::from(x)).into());
    assert!(vote.fault.is_none(), "{:?}", vote.fault);
    for element in 0..7 {
        let found = stress(&block, element);
        for axis in 0..3 {
            figures.add("patch test: normal stress", 1e2 * found[axis][axis]);
            figures.add("patch test: shear stress", 1e2 * found[axis][(axis + 1) % 3]);
        }
    }
    let inside = (8..16).flat_map(|node| force(&block, node));
    figures.add("patch test: force inside over the largest", greatest(inside) / largest_force(&block));
    let internal: f64 = (0..7).map(|e| block.field(e, field::ENERGY)).sum();
    figures.add("patch test: hourglass work over internal energy", vote.hourglass / internal);
}

pub(super) fn moving_and_turning_leave_the_stress_what_it_is(figures: &mut Figures) {
    let mut changed = 0;
    for material in all_laws() {
        // Positions and the path are multiples of 2^-10, so the moved element has the same edges exactly.
        let corners = SKEWED.map(|x| x.map(|c| (c * 1024.0).round() / 1024.0));
        let mut block = Block::new(&one(&material, &corners));
        let step = bare_step(0.125, 1e9, 1e9);
        compute(&mut block, &material, &step, Width::best());
        let before = block.piece();
        carry(&mut block, &material, &step, |_| [8.0, -16.0, 2.0]);
        let after = block.piece();
        let same = |(a, b): &(&Vec<f64>, &Vec<f64>)| a[0].to_bits() == b[0].to_bits();
        changed += before.fields.iter().zip(&after.fields).filter(|pair| !same(pair)).count();
    }
    figures.add("translation: fields of the state that changed, all laws", changed as f64);

    let material = elastic(1.0, 1.0, 1.0);
    let mut body = one(&material, &SKEWED);
    let mean = 100.0 / 3.0;
    body.fields[field::SXX][0] = 100.0 - mean;
    body.fields[field::SYY][0] = -mean;
    body.fields[field::SXY][0] = 50.0;
    let mut block = Block::new(&controlled(body, Hourglass::viscous(0.1)));
    let (sin, cos) = 30f64.to_radians().sin_cos();
    let dt = 0.01;
    let step = bare_step(dt, 1e3, 1e3);
    let vote = carry(&mut block, &material, &step, |[x, y, _]| {
        [(cos * x - sin * y - x) / dt, (sin * x + cos * y - y) / dt, 0.0]
    });
    let found = stress(&block, 0);
    figures.add("turn by 30 degrees in one step @ stress xx", found[0][0] + mean);
    figures.add("turn by 30 degrees in one step @ stress yy", found[1][1] + mean);
    figures.add("turn by 30 degrees in one step @ stress zz", found[2][2] + mean);
    figures.add("turn by 30 degrees in one step @ stress xy", found[0][1]);
    figures.add("turn by 30 degrees in one step @ energy", block.field(0, field::ENERGY));
    figures.add("turn by 30 degrees in one step @ hourglass work", vote.hourglass);
}

pub(super) fn simple_shear_follows_the_jaumann_rate(figures: &mut Figures) {
    let material = elastic(1.0, 1.0, 1.0);
    let mut block = Block::new(&one(&material, &UNIT_CUBE));
    let step = bare_step(1e-3, 10.0, 10.0);
    for cycle in 1..=1000 {
        carry(&mut block, &material, &step, |x| [x[1], 0.0, 0.0]);
        if cycle == 100 || cycle == 1000 {
            let of = format!("simple shear @ {}", f64::from(cycle) * 1e-3);
            let s = stress(&block, 0);
            figures.add(&format!("{of}, stress xy over G"), s[0][1]);
            figures.add(&format!("{of}, stress xx over G"), s[0][0]);
            figures.add(&format!("{of}, stress yy over G"), s[1][1]);
        }
    }
}
