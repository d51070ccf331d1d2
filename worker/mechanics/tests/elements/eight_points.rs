//! Hexahedra of eight points beside those of one point, and against what such elements must do.

use mechanics::{
    block::Block,
    element::{Step, hex8::eight_points},
    lanes::Width,
    material::{Failure, Material},
    mesh::Topology,
    piece::Piece,
    state::field,
};

use crate::bodies::*;

/// Fields of a point, and points of an element, as [`Piece::own`] has them.
const FIELDS: [usize; 8] = [
    field::SXX,
    field::SYY,
    field::SXY,
    field::SYZ,
    field::SZX,
    field::PLASTIC_STRAIN,
    field::TEMPERATURE,
    field::DAMAGE,
];
const POINTS: usize = 8;

/// The same body with eight points, which all have the state of the one.
fn eight(piece: &Piece) -> Piece {
    let hexahedra = match &piece.topology {
        Topology::Explicit { hexahedra } => hexahedra.clone(),
        other => panic!("an explicit piece, not {other:?}"),
    };
    let own = FIELDS.iter().flat_map(|&k| vec![piece.fields[k].clone(); POINTS]).collect();
    Piece { topology: Topology::EightPoint { hexahedra }, own, ..piece.clone() }
}

fn skewed(material: &Material) -> Piece {
    one(material, &SKEWED)
}

/// Forces on the corners of a single element that has been moved along `v` for a step.
fn forces(piece: &Piece, material: &Material, step: &Step) -> (Vec<f64>, Piece) {
    let mut block = Block::new(piece);
    advance(&mut block, step.dt);
    let vote = compute(&mut block, material, step, Width::best());
    assert!(vote.fault.is_none());
    let forces = (0..24).map(|i| block.f[i % 3][i / 3]).collect();
    (forces, block.piece())
}

#[test]
fn a_linear_motion_gives_the_forces_and_the_state_of_one_point() {
    for material in all_laws().iter().filter(|material| eight_points::check(material).is_ok()) {
        let mut piece = skewed(material);
        for (v, x) in piece.v.iter_mut().zip(&piece.x) {
            *v = [
                30.0 * x[0] + 12.0 * x[1] - 7.0 * x[2],
                -20.0 * x[0] - 55.0 * x[1] + 3.0 * x[2],
                14.0 * x[0] + 9.0 * x[1] - 41.0 * x[2],
            ];
        }
        let step = Step { linear_viscosity: 0.2, quadratic_viscosity: 1.0, ..bare_step(1e-3, 1e10, 1e10) };
        let (one, of_one) = forces(&piece, material, &step);
        let (all, of_all) = forces(&eight(&piece), material, &step);
        let greatest = one.iter().fold(0.0_f64, |most, force| most.max(force.abs()));
        assert!(greatest > 0.0);
        for (one, all) in one.iter().zip(&all) {
            assert!((one - all).abs() < 1e-11 * greatest, "{one} {all}, {material:?}");
        }
        for k in 0..of_one.fields.len() {
            let (one, all) = (of_one.fields[k][0], of_all.fields[k][0]);
            // Sums of the points cancel where a component is small.
            let scale = if k <= field::SZX { of_one.fields[field::PRESSURE][0].abs() } else { one.abs() };
            assert!((one - all).abs() <= 1e-10 * scale, "field {k}: {one} {all}, {material:?}");
        }
    }
}

/// Stiffness of an element, by the forces of small displacements.
fn stiffness(material: &Material, corners: &[[f64; 3]; 8]) -> nalgebra::DMatrix<f64> {
    let rest = eight(&one(material, corners));
    let amplitude = 1e-6;
    let answer = |freedom: usize, amplitude: f64| {
        let mut body = rest.clone();
        body.v[freedom / 3][freedom % 3] = amplitude;
        forces(&body, material, &bare_step(1.0, 1e-6, 1.0)).0
    };
    let columns: Vec<Vec<f64>> = (0..24)
        .map(|freedom| {
            let (plus, minus) = (answer(freedom, amplitude), answer(freedom, -amplitude));
            plus.iter().zip(minus).map(|(plus, minus)| 0.5 * (minus - plus) / amplitude).collect()
        })
        .collect();
    let matrix = nalgebra::DMatrix::from_fn(24, 24, |row, column| columns[column][row]);
    0.5 * (&matrix + matrix.transpose())
}

fn eigenvalues(matrix: &nalgebra::DMatrix<f64>) -> Vec<f64> {
    let mut values: Vec<f64> = matrix.symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(f64::total_cmp);
    values
}

#[test]
fn only_rigid_motions_cost_nothing() {
    for corners in [UNIT_CUBE, SKEWED] {
        let values = eigenvalues(&stiffness(&elastic(2.0, 3.0, 0.7), &corners));
        assert!(values[..6].iter().all(|value| value.abs() < 1e-6), "{values:?}");
        assert!(values[6] > 0.02, "{values:?}");
    }
}

#[test]
fn nearly_incompressible_elements_bend_as_compressible_ones() {
    // The corners of a cube in bending about z: x moves by -x y.
    let bent: Vec<f64> =
        UNIT_CUBE.iter().flat_map(|x| [(1.0 - 2.0 * x[0]) * (1.0 - 2.0 * x[1]), 0.0, 0.0]).collect();
    let bent = nalgebra::DVector::from_vec(bent);
    let energy = |bulk: f64| (bent.transpose() * stiffness(&elastic(2.0, bulk, 0.7), &UNIT_CUBE) * &bent)[0];
    let (soft, hard) = (energy(1.0), energy(1e4));
    assert!((hard / soft - 1.0).abs() < 1e-4, "{soft} {hard}");
    // By hand: strains 4 y along x and 4 x in shear over two sides, on [-1/2, 1/2]: G (4/3 + 1) 16/12.
    let exact = 0.7 * (4.0 / 3.0 + 1.0) * 16.0 / 12.0;
    assert!((soft / exact - 1.0).abs() < 1e-6, "{soft} {exact}");
}

#[test]
fn the_step_limit_holds_for_any_shape() {
    let material = elastic(2.0, 3.0, 0.7);
    let mut draws = Draws(77);
    let mut least = f64::INFINITY;
    for trial in 0..200 {
        let flat = [1.0, 1.0, [1.0, 0.2][trial % 2]];
        let corners = UNIT_CUBE.map(|x| {
            let mut at = [0.0; 3];
            for axis in 0..3 {
                at[axis] = flat[axis] * (x[axis] + 0.6 * draws.next());
            }
            at
        });
        let piece = eight(&one(&material, &corners));
        let mut block = Block::new(&piece);
        let vote = compute(&mut block, &material, &bare_step(0.0, 1.0, 1.0), Width::best());
        if vote.fault.is_some() {
            continue;
        }
        let mass = 2.0 * piece.initial_volume[0] / 8.0;
        let top = eigenvalues(&stiffness(&material, &corners))[23];
        // A run takes at most 0.7 of the limit.
        let limit = 2.0 / (top / mass).sqrt();
        least = least.min(limit / vote.courant);
    }
    assert!(least > 0.7, "stable up to {least} of the limit");
    println!("stable up to {least} of the limit");
}

/// A stirred body whose points differ.
fn stirred_points(material: &Material, cells: [u32; 3], seed: u64) -> Piece {
    let grid = stirred(material, cells, seed);
    let part = mechanics::mesh::Part {
        name: "body".into(),
        material: 0,
        topology: grid.topology.clone(),
        nodes: grid.nodes.clone(),
        element_ids: Vec::new(),
        hourglass: grid.hourglass,
    };
    let hexahedra = (0..part.n_elements()).map(|element| part.corners(element)).collect();
    let mut piece = eight(&Piece { topology: Topology::Explicit { hexahedra }, ..grid });
    let mut draws = Draws(seed | 1);
    for value in piece.own[..5 * POINTS].iter_mut().flatten() {
        *value += 1e8 * draws.next();
    }
    piece
}

#[test]
fn every_width_gives_the_same_bits() {
    for (seed, material) in
        (1..).zip(all_laws()).filter(|(_, material)| eight_points::check(material).is_ok())
    {
        let piece = stirred_points(&material, [5, 3, 2], seed);
        let run = |width: Width| {
            let mut block = Block::new(&piece);
            let step = full_step(2e-7);
            let mut all = Vec::new();
            for _ in 0..3 {
                advance(&mut block, step.dt);
                let vote = compute(&mut block, &material, &step, width);
                assert!(vote.fault.is_none(), "{:?}, {material:?}", vote.fault);
                let image = block.piece();
                all.extend(image.own.iter().chain(&image.fields).flatten().map(|value| value.to_bits()));
                let n = block.nodes.len();
                all.extend(block.f.iter().flat_map(|f| &f[..n]).map(|force| force.to_bits()));
                all.extend([vote.courant, vote.internal, vote.viscosity, vote.hourglass].map(f64::to_bits));
                kick(&mut block, step.dt);
            }
            all
        };
        let reference = run(Width::Scalar);
        for width in Width::ALL.into_iter().filter(|width| width.available()) {
            assert!(run(width) == reference, "{width}, {material:?}");
        }
    }
}

#[test]
fn an_element_fails_when_its_last_point_has() {
    let material = Material { failure: Failure::PlasticStrain { limit: 0.4 }, ..all_laws().swap_remove(6) };
    let mut piece = skewed(&material);
    piece.fields[field::DAMAGE][0] = 1.0;
    let mut piece = eight(&piece);
    for (v, x) in piece.v.iter_mut().zip(&piece.x) {
        *v = x.map(|c| 20.0 * c);
    }
    let step = bare_step(1e-3, 1e10, 1e10);
    let pressure = |piece: &Piece| forces(piece, &material, &step).1.fields[field::PRESSURE][0];
    assert_eq!(pressure(&piece), 0.0);
    piece.own[7 * POINTS + 3][0] = 0.5;
    assert!(pressure(&piece) < 0.0);
}
