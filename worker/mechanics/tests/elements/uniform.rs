//! Wedges, pyramids and tetrahedra of four nodes against hexahedra of one point and what such elements must do.

use mechanics::{
    block::Block,
    element::{Step, hourglass::Hourglass},
    lanes::Width,
    material::Material,
    mesh::Topology,
    piece::Piece,
    state::field,
};
use nalgebra::{DMatrix, DVector};

use crate::bodies::*;

/// Corners of each form by its nodes, which stand below, and where: in a cube of side 1.
const FORMS: [([u32; 8], &[[f64; 3]]); 3] = [
    (
        [0, 1, 4, 3, 2, 2, 5, 5],
        &[
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.5, 0.0, 0.8],
            [0.0, 1.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.5, 1.0, 0.8],
        ],
    ),
    (
        [0, 1, 2, 3, 4, 4, 4, 4],
        &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.5, 0.7]],
    ),
    ([0, 1, 2, 2, 3, 3, 3, 3], &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.4, 0.9, 0.0], [0.5, 0.3, 0.8]]),
];

/// One element with its nodes moved by up to `distortion` halves of the cube.
fn single(material: &Material, form: usize, distortion: f64, draws: &mut Draws) -> Piece {
    let (corners, nodes) = FORMS[form];
    let x = nodes.iter().map(|x| x.map(|x| x + distortion * draws.next())).collect();
    piece(material, x, Topology::Explicit { hexahedra: vec![corners] })
}

/// Forces on the nodes of an element that has been moved along its velocities for a step.
fn forces(piece: &Piece, material: &Material, step: &Step) -> (Vec<f64>, Block) {
    let mut block = Block::new(piece);
    advance(&mut block, step.dt);
    let vote = compute(&mut block, material, step, Width::best());
    assert!(vote.fault.is_none(), "{:?}", vote.fault);
    let n = piece.x.len();
    ((0..3 * n).map(|i| block.f[i % 3][i / 3]).collect(), block)
}

#[test]
fn a_linear_motion_gives_the_stress_of_a_hexahedron_and_its_virtual_work() {
    let gradient = [[30.0, 12.0, -7.0], [-20.0, -55.0, 3.0], [14.0, 9.0, -41.0]];
    let field = |x: &[f64; 3]| -> [f64; 3] {
        std::array::from_fn(|i| (0..3).map(|j| gradient[i][j] * x[j]).sum::<f64>())
    };
    let other = [[0.3, -1.2, 0.4], [0.7, 0.2, 1.1], [-0.9, 0.5, 0.8]];
    for material in all_laws() {
        let mut cube = one(&material, &UNIT_CUBE);
        cube.v = cube.x.iter().map(field).collect();
        let step = bare_step(1e-3, 1e10, 1e10);
        let (_, of_cube) = forces(&cube, &material, &step);
        for form in 0..3 {
            let mut body = single(&material, form, 0.1, &mut Draws(5 + form as u64));
            body.v = body.x.iter().map(field).collect();
            let (found, block) = forces(&body, &material, &step);
            for k in [field::SXX, field::SYY, field::SXY, field::SYZ, field::SZX, field::PRESSURE] {
                let (one, all) = (block.field(0, k), of_cube.field(0, k));
                let scale = of_cube.field(0, field::PRESSURE).abs();
                assert!((one - all).abs() <= 1e-9 * scale, "field {k} of {form}: {one} {all}, {material:?}");
            }
            // Of a field without its mean the forces take the work of the stress.
            let sigma = stress(&block, 0);
            let volume = body.initial_volume[0] * block.field(0, field::RELATIVE_VOLUME);
            let (mut work, mut resultant, mut largest) = (0.0, [0.0; 3], 0.0_f64);
            for node in 0..body.x.len() {
                for i in 0..3 {
                    let u: f64 = (0..3).map(|j| other[i][j] * block.x[j][node]).sum();
                    work += found[3 * node + i] * u;
                    resultant[i] += found[3 * node + i];
                    largest = largest.max(found[3 * node + i].abs());
                }
            }
            let exact: f64 = (0..9).map(|ij| -volume * sigma[ij / 3][ij % 3] * other[ij / 3][ij % 3]).sum();
            let scale = volume * sigma.iter().flatten().fold(0.0_f64, |most, s| most.max(s.abs()));
            assert!((work - exact).abs() < 1e-9 * scale, "{form}: {work} {exact}, {material:?}");
            assert!(resultant.iter().all(|r| *r == 0.0) && largest > 0.0, "{resultant:?}");
        }
    }
}

/// Stiffness of an element, by the forces of small displacements.
fn stiffness(material: &Material, rest: &Piece) -> DMatrix<f64> {
    let amplitude = 1e-6;
    let answer = |freedom: usize, amplitude: f64| {
        let mut body = rest.clone();
        // So slowly that what resists the rate is nothing.
        let dt = 1e4;
        body.v[freedom / 3][freedom % 3] = amplitude / dt;
        forces(&body, material, &bare_step(dt, 1e-6, 1.0)).0
    };
    let n = 3 * rest.x.len();
    let columns: Vec<Vec<f64>> = (0..n)
        .map(|freedom| {
            let (plus, minus) = (answer(freedom, amplitude), answer(freedom, -amplitude));
            plus.iter().zip(minus).map(|(plus, minus)| 0.5 * (minus - plus) / amplitude).collect()
        })
        .collect();
    let matrix = DMatrix::from_fn(n, n, |row, column| columns[column][row]);
    0.5 * (&matrix + matrix.transpose())
}

#[test]
fn only_rigid_motions_cost_nothing() {
    let material = elastic(2.0, 3.0, 0.7);
    for form in 0..3 {
        for control in [
            Hourglass::ASSUMED_STRAIN,
            Hourglass { kind: mechanics::element::hourglass::Kind::Stiffness, coefficient: 0.05 },
        ] {
            let body = controlled(single(&material, form, 0.2, &mut Draws(9)), control);
            let mut values: Vec<f64> =
                stiffness(&material, &body).symmetric_eigenvalues().iter().copied().collect();
            values.sort_by(f64::total_cmp);
            assert!(values[..6].iter().all(|value| value.abs() < 1e-6), "{form}: {values:?}");
            assert!(values[6] > 0.005, "{form}: {values:?}");
        }
    }
}

#[test]
fn a_wedge_bends_and_twists_as_beams_and_plates_do() {
    let (bulk, shear) = (3.0, 0.7);
    let material = elastic(2.0, bulk, shear);
    let young = 9.0 * bulk * shear / (3.0 * bulk + shear);
    let poisson = (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear));
    let body = controlled(single(&material, 0, 0.0, &mut Draws(1)), Hourglass::ASSUMED_STRAIN);
    let stiffness = stiffness(&material, &body);
    // The triangle lies in x and z, its centre at (0.5, 0.8 / 3); y is along the height, 0 to 1.
    let energy = |field: &dyn Fn([f64; 3]) -> [f64; 3]| {
        let u = body.x.iter().flat_map(|&[x, y, z]| field([x - 0.5, 2.0 * y - 1.0, z - 0.8 / 3.0]));
        let u = DVector::from_vec(u.collect());
        0.5 * (u.transpose() * &stiffness * &u)[0]
    };
    let volume = 0.4;
    // Second moments over the area of a triangle of base 1 and height 0.8, and half of the height of the wedge.
    let (mxx, mzz, half) = (1.0 / 24.0, 0.64 / 18.0, 0.5);
    let near = |found: f64, exact: f64, what: &str| {
        println!("{what}: {found} of {exact}");
        assert!((found / exact - 1.0).abs() < 1e-4, "{what}: {found} of {exact}");
    };
    near(energy(&|[x, t, _]| [0.0, t * x, 0.0]), 0.5 * young * volume * mxx / (half * half), "bar, about z");
    near(energy(&|[_, t, z]| [0.0, t * z, 0.0]), 0.5 * young * volume * mzz / (half * half), "bar, about x");
    near(
        energy(&|[x, t, _]| [t * x, 0.0, 0.0]),
        0.5 * young / (1.0 - poisson * poisson) * volume / 3.0,
        "plate",
    );
    near(energy(&|[x, t, z]| [t * z, 0.0, t * x]), 0.5 * 4.0 * shear * volume / 3.0, "plate, twisted");
    near(
        energy(&|[x, t, z]| [t * z, 0.0, -t * x]),
        0.5 * shear * volume * (mxx + mzz) / (half * half),
        "torsion",
    );
}

#[test]
fn the_step_limit_holds_for_any_shape() {
    let material = elastic(2.0, 3.0, 0.7);
    let mut draws = Draws(77);
    for (form, name) in ["wedge", "pyramid", "tetrahedron"].into_iter().enumerate() {
        let (mut least, mut count) = (f64::INFINITY, 0);
        for trial in 0..200 {
            let mut body = single(&material, form, 0.5, &mut draws);
            let flat = [1.0, 0.2][trial % 2];
            body.x.iter_mut().for_each(|x| x[trial % 3] *= flat);
            let body = piece(&material, body.x, body.topology);
            if body.initial_volume[0] <= 0.0 {
                continue;
            }
            let body = controlled(body, Hourglass::ASSUMED_STRAIN);
            let mut block = Block::new(&body);
            let vote = compute(&mut block, &material, &bare_step(0.0, 1.0, 1.0), Width::best());
            if vote.fault.is_some() {
                continue;
            }
            // By the masses: the frequencies are the eigenvalues of M^-1/2 K M^-1/2.
            let stiffness = stiffness(&material, &body);
            let n = stiffness.nrows();
            let scaled = DMatrix::from_fn(n, n, |i, j| {
                stiffness[(i, j)] / (body.mass[i / 3] * body.mass[j / 3]).sqrt()
            });
            let limit = 2.0 / scaled.symmetric_eigenvalues().max().sqrt();
            least = least.min(limit / vote.courant);
            count += 1;
        }
        println!("{name}: stable up to {least} of the limit, {count} shapes");
        // A run takes at most 0.7 of the limit.
        assert!(least > 0.7 && count > 100, "{name}: stable up to {least} of the limit, {count} shapes");
    }
}

/// Elements of one form along a line, stirred.
fn stirred_row(material: &Material, form: usize, seed: u64) -> Piece {
    let row = stirred(material, [11, 1, 1], seed);
    let (corners, _) = FORMS[form];
    let n = 11;
    // Corners of a grid by I, J, K; an element of fewer nodes takes those of its cell.
    let node = |i: usize, corner: u32| {
        let [a, b, c] = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1]][corner as usize];
        ((i + a) + (n + 1) * (b + 2 * c)) as u32
    };
    let hexahedra = (0..n).map(|i| corners.map(|corner| node(i, corner_of(form, corner)))).collect();
    let mut body = piece(material, row.x.clone(), Topology::Explicit { hexahedra });
    body.v.clone_from(&row.v);
    (body.fields, body.history) = (row.fields.clone(), row.history.clone());
    controlled(body, Hourglass::ASSUMED_STRAIN)
}

/// The corner of a cell that a node of a form stands at.
fn corner_of(form: usize, node: u32) -> u32 {
    match form {
        0 => [0, 1, 4, 3, 2, 5][node as usize],
        1 => [0, 1, 2, 3, 4][node as usize],
        _ => [0, 1, 3, 4][node as usize],
    }
}

#[test]
fn every_width_gives_the_same_bits() {
    for (seed, material) in (1..).zip(all_laws()) {
        for form in 0..3 {
            let body = stirred_row(&material, form, seed);
            let run = |width: Width| {
                let mut block = Block::new(&body);
                let step = full_step(1e-7);
                let mut all = Vec::new();
                for _ in 0..3 {
                    advance(&mut block, step.dt);
                    let vote = compute(&mut block, &material, &step, width);
                    assert!(vote.fault.is_none(), "{:?} of {form}, {material:?}", vote.fault);
                    let image = block.piece();
                    let state = image.own.iter().chain(&image.fields).chain(&image.history).flatten();
                    all.extend(state.map(|value| value.to_bits()));
                    let n = block.nodes.len();
                    all.extend(block.f.iter().flat_map(|f| &f[..n]).map(|force| force.to_bits()));
                    all.extend(
                        [vote.courant, vote.internal, vote.viscosity, vote.hourglass].map(f64::to_bits),
                    );
                    kick(&mut block, step.dt);
                }
                all
            };
            let scalar = run(Width::Scalar);
            for width in Width::ALL.into_iter().filter(|width| width.available()) {
                assert!(run(width) == scalar, "{width:?} of {form}, {material:?}");
            }
        }
    }
}
