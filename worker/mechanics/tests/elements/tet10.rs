//! Composite tetrahedra: what such elements must do, alone and in a mesh.

use std::collections::BTreeMap;

use mechanics::{
    block::Block,
    element::{hourglass::Hourglass, tet10},
    lanes::Width,
    material::{Eos, Failure, Material},
    mesh::{Part, Topology},
    piece::Piece,
    state::field,
};

use crate::bodies::{
    Draws, advance, all_laws, bare_step, carry, compute, elastic, force, full_step, johnson_cook, kick,
    largest_force, material, piece, stress,
};

/// Corners of an element of no symmetry.
const SKEWED: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.1, 0.1, -0.1], [0.2, 0.9, 0.1], [0.3, 0.2, 1.2]];

/// The nodes of an element with straight edges.
fn straight(corners: &[[f64; 3]; 4]) -> [[f64; 3]; tet10::NODES] {
    std::array::from_fn(|node| match node.checked_sub(4) {
        None => corners[node],
        Some(edge) => {
            let [a, b] = tet10::EDGES[edge];
            std::array::from_fn(|axis| 0.5 * (corners[a][axis] + corners[b][axis]))
        }
    })
}

/// A body of tetrahedra at rest and unstressed, its nodes at `x`.
fn body(material: &Material, x: Vec<[f64; 3]>, tetrahedra: Vec<[u32; tet10::NODES]>) -> Piece {
    let n_nodes = x.len();
    let topology = Topology::Tetrahedra { tetrahedra };
    let part = Part {
        name: "body".into(),
        material: 0,
        topology: topology.clone(),
        nodes: (0..n_nodes as u32).collect(),
        element_ids: Vec::new(),
        hourglass: Hourglass::NONE,
    };
    let rest = piece(material, x, topology);
    let (mut mass, mut initial_volume) = (vec![0.0; n_nodes], Vec::new());
    for element in 0..part.n_elements() {
        let volume = part.volume_of(element, &rest.x);
        for (&node, share) in part.nodes_of(element).iter().zip(part.shares(element)) {
            mass[node as usize] += material.density * volume * share;
        }
        initial_volume.push(volume);
    }
    let mut own = vec![vec![0.0; part.n_elements()]; part.n_own()];
    own[24..28].iter_mut().for_each(|of_point| of_point.fill(material.initial_temperature()));
    for (i, variable) in material.history().iter().enumerate() {
        own[36 + 4 * i..40 + 4 * i].iter_mut().for_each(|of_point| of_point.fill(variable.initial));
    }
    Piece { mass, initial_volume, own, ..rest }
}

fn single(material: &Material, x: &[[f64; 3]; tet10::NODES]) -> Piece {
    body(material, x.to_vec(), vec![[0, 1, 2, 3, 4, 5, 6, 7, 8, 9]])
}

/// A box of `cells` of side `h`, six tetrahedra each, its nodes moved by up to `distortion * h` where they are inside.
fn block_of(material: &Material, cells: [usize; 3], h: f64, distortion: f64, seed: u64) -> Piece {
    let mut draws = Draws(seed);
    let mut number: BTreeMap<[usize; 3], u32> = BTreeMap::new();
    let mut x = Vec::new();
    let mut tetrahedra = Vec::new();
    for cell in 0..cells.iter().product() {
        let low = [cell % cells[0], cell / cells[0] % cells[1], cell / cells[0] / cells[1]];
        for path in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
            // Twice the indices of the corners along the diagonal of the cell.
            let mut corners = [low.map(|c| 2 * c); 4];
            for (i, axis) in path.into_iter().enumerate() {
                (i + 1..4).for_each(|corner| corners[corner][axis] += 2);
            }
            if path[1] != (path[0] + 1) % 3 {
                corners.swap(1, 2);
            }
            let node = |node: usize| match node.checked_sub(4) {
                None => corners[node],
                Some(edge) => {
                    let [a, b] = tet10::EDGES[edge].map(|corner| corners[corner]);
                    std::array::from_fn(|axis| (a[axis] + b[axis]) / 2)
                }
            };
            tetrahedra.push(std::array::from_fn(|i| {
                *number.entry(node(i)).or_insert_with(|| {
                    let inside = (0..3).all(|axis| node(i)[axis] > 0 && node(i)[axis] < 2 * cells[axis]);
                    let shift = if inside { distortion } else { 0.0 };
                    x.push(node(i).map(|c| h * (0.5 * c as f64 + shift * draws.next())));
                    x.len() as u32 - 1
                })
            }));
        }
    }
    body(material, x, tetrahedra)
}

/// The same as six times its volume, or more, of numbers that a run could have.
fn stirred_block(material: &Material, seed: u64) -> Piece {
    let mut piece = block_of(material, [3, 2, 1], 0.01, 0.12, seed);
    let mut draws = Draws(seed.wrapping_mul(31) | 1);
    for v in &mut piece.v {
        *v = std::array::from_fn(|_| 40.0 * draws.next());
    }
    piece.own[..20].iter_mut().flatten().for_each(|stress| *stress = 4e8 * draws.next());
    piece.own[32..36].iter_mut().flatten().for_each(|stress| *stress = 1e7 * draws.next());
    if material.failure != Failure::None || !material.history().is_empty() {
        piece.own[28..32].iter_mut().flatten().for_each(|d| *d = (3.0 * draws.next()).clamp(0.0, 1.0));
    }
    piece
}

fn fit() -> impl Iterator<Item = Material> {
    all_laws().into_iter().filter(|material| tet10::check(material).is_ok())
}

/// Forces on the nodes of a single element that has been moved along `v` for a step.
fn forces(piece: &Piece, material: &Material, step: &mechanics::element::Step) -> Vec<f64> {
    let mut block = Block::new(piece);
    advance(&mut block, step.dt);
    let vote = compute(&mut block, material, step, Width::best());
    assert!(vote.fault.is_none());
    (0..30).map(|i| block.f[i % 3][i / 3]).collect()
}

/// Stiffness of an element, by the forces of small displacements.
fn stiffness(material: &Material, x: &[[f64; 3]; tet10::NODES]) -> nalgebra::DMatrix<f64> {
    let rest = single(material, x);
    let amplitude = 1e-6;
    let answer = |freedom: usize, amplitude: f64| {
        let mut body = rest.clone();
        body.v[freedom / 3][freedom % 3] = amplitude;
        forces(&body, material, &bare_step(1.0, 1e-6, 1.0))
    };
    let columns: Vec<Vec<f64>> = (0..30)
        .map(|freedom| {
            let (plus, minus) = (answer(freedom, amplitude), answer(freedom, -amplitude));
            plus.iter().zip(minus).map(|(plus, minus)| 0.5 * (minus - plus) / amplitude).collect()
        })
        .collect();
    let matrix = nalgebra::DMatrix::from_fn(30, 30, |row, column| columns[column][row]);
    0.5 * (&matrix + matrix.transpose())
}

fn eigenvalues(matrix: &nalgebra::DMatrix<f64>) -> Vec<f64> {
    let mut values: Vec<f64> = matrix.symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(f64::total_cmp);
    values
}

/// An element whose nodes are moved by up to `by` of its edges.
fn distorted(by: f64, draws: &mut Draws) -> [[f64; 3]; tet10::NODES] {
    straight(&SKEWED).map(|x| x.map(|c| c + 2.0 * by * draws.next()))
}

#[test]
fn nodes_carry_the_mass_and_sides_enclose_the_volume() {
    assert!((tet10::SHARES.iter().sum::<f64>() - 1.0).abs() < 1e-15);
    assert!(tet10::SHARES.iter().all(|share| *share > 0.0));
    let mut draws = Draws(3);
    let x = distorted(0.1, &mut draws);
    // Divergence theorem over the triangles.
    let volume: f64 = tet10::SIDES
        .iter()
        .map(|&[a, b, c, d]| {
            assert_eq!(c, d);
            let [a, b, c] = [a, b, c].map(|node| nalgebra::Vector3::from(x[node]));
            a.dot(&b.cross(&c)) / 6.0
        })
        .sum();
    assert!((volume / tet10::volume(&x) - 1.0).abs() < 1e-12, "{volume}");
}

#[test]
fn only_rigid_motions_cost_nothing() {
    let mut draws = Draws(11);
    for x in [straight(&SKEWED), distorted(0.1, &mut draws)] {
        let values = eigenvalues(&stiffness(&elastic(2.0, 3.0, 0.7), &x));
        assert!(values[..6].iter().all(|value| value.abs() < 1e-6), "{values:?}");
        assert!(values[6] > 3e-3 * values[29], "{values:?}");
    }
}

#[test]
fn the_step_limit_holds_for_any_shape_and_any_ratio_of_bulk_to_shear() {
    let mut draws = Draws(77);
    let (mut least, mut most, mut tried) = (f64::INFINITY, 0.0_f64, 0);
    for trial in 0..160 {
        let flat = [1.0, 1.0, [1.0, 0.1][trial % 2]];
        let by = [0.0, 0.1, 0.2][trial % 3];
        let x = distorted(by, &mut draws).map(|x| std::array::from_fn(|axis| flat[axis] * x[axis]));
        if !tet10::is_upright(&x) {
            continue;
        }
        let material = elastic(2.0, [3.0, 0.2, 300.0][trial / 3 % 3], 0.7);
        let piece = single(&material, &x);
        let vote = compute(&mut Block::new(&piece), &material, &bare_step(0.0, 1.0, 1.0), Width::best());
        assert!(vote.fault.is_none());
        let mut scaled = stiffness(&material, &x);
        for (row, column) in (0..30).flat_map(|row| (0..30).map(move |column| (row, column))) {
            scaled[(row, column)] /= (piece.mass[row / 3] * piece.mass[column / 3]).sqrt();
        }
        let limit = 2.0 / eigenvalues(&scaled)[29].sqrt();
        least = least.min(limit / vote.courant);
        most = most.max(limit / vote.courant);
        tried += 1;
    }
    println!("{tried} shapes, stable up to {least} to {most} of the limit");
    assert!(tried > 100 && least > 1.0, "stable up to {least} of the limit");
}

#[test]
fn a_linear_motion_of_a_distorted_mesh_strains_all_points_alike_and_pulls_at_no_inner_node() {
    for material in fit().filter(|material| material.history().is_empty()) {
        let mut block = Block::new(&block_of(&material, [2, 2, 2], 1.0, 0.2, 5));
        let inner: Vec<usize> = (0..block.nodes.len())
            .filter(|&n| (0..3).all(|a| block.x[a][n] > 1e-9 && block.x[a][n] < 2.0 - 1e-9))
            .collect();
        assert!(inner.len() > 20);
        for _ in 0..3 {
            let vote = carry(&mut block, &material, &bare_step(1e-5, 1e10, 1e10), |x| {
                [
                    30.0 * x[0] + 12.0 * x[1] - 7.0 * x[2],
                    -20.0 * x[0] - 55.0 * x[1] + 3.0 * x[2],
                    14.0 * x[0] + 9.0 * x[1] - 41.0 * x[2],
                ]
            });
            assert!(vote.fault.is_none() && vote.hourglass == 0.0);
        }
        let first = stress(&block, 0);
        let scale = largest_force(&block);
        assert!(scale > 0.0);
        let size = first.iter().flatten().fold(0.0_f64, |most, s| most.max(s.abs()));
        for element in 0..block.n_elements() {
            for (row, expected) in stress(&block, element).iter().zip(&first) {
                for (s, expected) in row.iter().zip(expected) {
                    assert!((s - expected).abs() < 1e-9 * size, "{s} {expected}, {material:?}");
                }
            }
        }
        for node in inner {
            let pull = force(&block, node);
            assert!(pull.iter().all(|f| f.abs() < 1e-10 * scale), "{pull:?} of {scale}, {material:?}");
        }
        let swelling = &block.piece().own[32..36];
        assert!(swelling.iter().flatten().all(|s| s.abs() < 1e-10 * size), "{material:?}");
    }
}

/// A corner is moved through the triangle of the edge nodes next to it: its point yields until half of its share of the volume is gone,
/// then it presses back, and gives the work back on the way out.
#[test]
fn a_point_that_loses_its_volume_yields_no_further() {
    let material = material(7896.0, Eos::Linear { bulk: 164e9 }, johnson_cook());
    let x = straight(&SKEWED);
    let triangle: [f64; 3] = std::array::from_fn(|axis| (x[4][axis] + x[6][axis] + x[7][axis]) / 3.0);
    let mut block = Block::new(&single(&material, &x));
    let n_steps = 300;
    let dt = 1e-5;
    // In, and half of the way out again.
    let ways = [(1.0, n_steps), (-1.0, n_steps / 2)];
    let mut swelling = Vec::new();
    for (sign, n) in ways {
        for axis in 0..3 {
            block.v[axis][0] = sign * 1.3 * (triangle[axis] - x[0][axis]) / (f64::from(n_steps) * dt);
        }
        for _ in 0..n {
            advance(&mut block, dt);
            let vote = compute(&mut block, &material, &bare_step(dt, 1e11, 1e11), Width::best());
            assert!(vote.fault.is_none());
            swelling.push(block.piece().own[32][0]);
        }
    }
    // At the triangle the share is 0.52.
    let at_triangle = f64::from(n_steps) / 1.3;
    let yielding = &swelling[..at_triangle as usize];
    assert!(yielding.iter().all(|s| s.abs() < 1e9), "{yielding:?}");
    let deepest = swelling[n_steps as usize - 1];
    assert!((-30e9..-10e9).contains(&deepest), "{deepest:e}");
    let last = swelling.last().expect("steps");
    assert!(last.abs() < 1e9, "{last:e} after {deepest:e}");
}

#[test]
fn a_turn_of_two_rounds_leaves_an_unstressed_mesh_without_forces() {
    let material = elastic(7896.0, 164e9, 81.8e9);
    let mut block = Block::new(&block_of(&material, [1, 2, 1], 0.01, 0.1, 7));
    let n_steps = 144;
    let angle = 4.0 * std::f64::consts::PI / f64::from(n_steps);
    let dt = 1e-6;
    // About an axis aslant through the origin.
    let axis = nalgebra::Unit::new_normalize(nalgebra::Vector3::new(1.0, -2.0, 0.5));
    let turn = nalgebra::Rotation3::from_axis_angle(&axis, angle);
    for _ in 0..n_steps {
        let vote = carry(&mut block, &material, &bare_step(dt, 1e6, 1e6), |x| {
            let x = nalgebra::Vector3::from(x);
            ((turn * x - x) / dt).into()
        });
        assert!(vote.fault.is_none());
    }
    let strain = largest_force(&block) / (81.8e9 * 1e-4);
    assert!(strain < 1e-12, "forces of a strain of {strain:e}");
}

/// Deflection of a cantilever of eight cubes that is clamped at x = 0 and pulled across at its end, over that of Timoshenko's beam.
fn deflection(material: &Material, [bulk, shear]: [f64; 2]) -> f64 {
    let length = 8.0;
    let rest = block_of(material, [8, 1, 1], 1.0, 0.0, 1);
    let Topology::Tetrahedra { tetrahedra } = &rest.topology else { panic!("tetrahedra") };
    // The traction on the end by its triangles.
    let mut load = nalgebra::DVector::zeros(3 * rest.x.len());
    let mut area = 0.0;
    for side in tetrahedra.iter().flat_map(|nodes| tet10::SIDES.map(|side| side.map(|n| nodes[n] as usize))) {
        if side.iter().all(|&n| rest.x[n][0] > length - 1e-9) {
            let [a, b, c] = [0, 1, 2].map(|i| nalgebra::Vector3::from(rest.x[side[i]]));
            let of_side = 0.5 * (b - a).cross(&(c - a)).norm();
            (0..3).for_each(|i| load[3 * side[i] + 2] += of_side / 3.0);
            area += of_side;
        }
    }
    assert!((area - 1.0).abs() < 1e-12, "{area}");
    let free: Vec<usize> = (0..3 * rest.x.len()).filter(|i| rest.x[i / 3][0] > 1e-9).collect();
    let answer = |freedom: usize, amplitude: f64| {
        let mut block = Block::new(&rest);
        block.v[freedom % 3][freedom / 3] = amplitude;
        advance(&mut block, 1.0);
        compute(&mut block, material, &bare_step(1.0, 1e-6, 1.0), Width::best());
        free.iter().map(|i| block.f[i % 3][i / 3]).collect::<Vec<f64>>()
    };
    let mut matrix = nalgebra::DMatrix::zeros(free.len(), free.len());
    for (column, &freedom) in free.iter().enumerate() {
        let (plus, minus) = (answer(freedom, 1e-7), answer(freedom, -1e-7));
        for (row, (plus, minus)) in plus.iter().zip(minus).enumerate() {
            matrix[(row, column)] = 0.5e7 * (minus - plus);
        }
    }
    let matrix = 0.5 * (&matrix + matrix.transpose());
    let load = nalgebra::DVector::from_iterator(free.len(), free.iter().map(|i| load[*i]));
    let moved = matrix.cholesky().expect("no motion costs nothing").solve(&load);
    let young = 9.0 * bulk * shear / (3.0 * bulk + shear);
    let beam = 4.0 * length.powi(3) / young + length / (5.0 / 6.0 * shear);
    load.dot(&moved) / beam
}

#[test]
fn a_cantilever_of_one_layer_of_cubes_bends_as_timoshenko_says_also_where_it_is_nearly_incompressible() {
    for (bulk, within) in [(1.0, 0.1), (1e4, 0.1)] {
        let of_beam = deflection(&elastic(2.0, bulk, 0.7), [bulk, 0.7]);
        println!("bulk {bulk}: {of_beam} of Timoshenko's deflection");
        assert!((of_beam - 1.0).abs() < within, "bulk {bulk}: {of_beam}");
    }
}

#[test]
fn every_width_gives_the_same_bits_for_every_law() {
    for (seed, material) in (1..).zip(fit()) {
        let piece = stirred_block(&material, seed);
        let run = |width: Width| {
            let mut block = Block::new(&piece);
            let step = full_step(1e-8);
            let mut all = Vec::new();
            for _ in 0..3 {
                advance(&mut block, step.dt);
                let vote = compute(&mut block, &material, &step, width);
                assert!(vote.fault.is_none(), "{:?}, {material:?}", vote.fault);
                let image = block.piece();
                let numbers = image.own.iter().chain(&image.fields).chain(&image.history).flatten();
                all.extend(numbers.map(|value| value.to_bits()));
                let n = block.nodes.len();
                all.extend(block.f.iter().flat_map(|f| &f[..n]).map(|force| force.to_bits()));
                all.extend([vote.courant, vote.internal, vote.viscosity, vote.hourglass].map(f64::to_bits));
                kick(&mut block, step.dt);
            }
            // What a checkpoint holds goes on as what it was taken of.
            let mut again = Block::new(&block.piece());
            for block in [&mut block, &mut again] {
                advance(block, step.dt);
                compute(block, &material, &step, width);
            }
            assert!(block.piece() == again.piece() && block.f == again.f, "{width}, {material:?}");
            all
        };
        let reference = run(Width::Scalar);
        for width in Width::ALL.into_iter().filter(|width| width.available()) {
            assert!(run(width) == reference, "{width}, {material:?}");
        }
    }
}

/// Cycles of a free body; the greatest change of its energy, over that at the start, and at the end.
fn free(material: &Material, piece: &Piece, n_cycles: usize) -> [f64; 2] {
    let mut block = Block::new(piece);
    let momentum = |block: &Block| -> [f64; 3] {
        std::array::from_fn(|axis| (0..block.nodes.len()).map(|n| block.mass[n] * block.v[axis][n]).sum())
    };
    let before = momentum(&block);
    let scale: f64 = block.mass[..block.nodes.len()].iter().sum::<f64>() * 200.0;
    let (mut dt, mut first, mut taken, mut worst, mut last) = (0.0, 0.0, 0.0, 0.0_f64, 0.0);
    for cycle in 0..n_cycles {
        advance(&mut block, dt);
        let vote = compute(&mut block, material, &full_step(dt), Width::best());
        assert!(vote.fault.is_none(), "{:?} in cycle {cycle}, {material:?}", vote.fault);
        taken += vote.hourglass;
        for f in &block.f {
            assert_eq!(f.iter().sum::<f64>(), 0.0);
        }
        let next = 0.6666 * vote.courant.min(vote.volume_limit);
        let next = if cycle == 0 { 0.1 * next } else { next.min(1.05 * dt) };
        let kinetic = kick(&mut block, 0.5 * (dt + next));
        dt = next;
        let total = kinetic + vote.internal + taken;
        if cycle == 0 {
            first = total;
        }
        last = total / first - 1.0;
        worst = worst.max(last.abs());
    }
    for (now, before) in momentum(&block).into_iter().zip(before) {
        assert!((now - before).abs() < 1e-13 * scale, "{now} {before}, scale {scale}");
    }
    [worst, last]
}

/// A body that shakes, turns and drifts.
fn shaken(material: &Material, cells: [usize; 3]) -> Piece {
    let mut piece = block_of(material, cells, 0.01, 0.1, 4);
    let mut draws = Draws(5);
    for (v, x) in piece.v.iter_mut().zip(&piece.x) {
        *v = [200.0 - 8000.0 * x[0], 6000.0 * x[2] - 100.0, 20.0 * draws.next()];
    }
    piece
}

#[test]
fn energy_and_momentum_of_a_free_body_are_conserved_under_every_law() {
    for material in fit() {
        let [worst, _] = free(&material, &shaken(&material, [3, 2, 2]), 300);
        println!("{worst} {:?}", material.strength);
        assert!(worst < 0.02, "{worst}, {material:?}");
    }
}

#[test]
fn a_free_elastic_body_keeps_its_energy_over_twenty_thousand_cycles() {
    let material = elastic(7896.0, 164e9, 81.8e9);
    let mut piece = block_of(&material, [2, 1, 1], 0.01, 0.1, 4);
    let mut draws = Draws(9);
    piece.v.iter_mut().for_each(|v| *v = std::array::from_fn(|_| 30.0 * draws.next()));
    let [worst, last] = free(&material, &piece, 20_000);
    println!("worst {worst}, last {last}");
    assert!(worst < 0.02, "{worst}");
}

#[test]
fn an_element_fails_when_its_last_point_has() {
    let material = Material { failure: Failure::PlasticStrain { limit: 0.4 }, ..all_laws().swap_remove(6) };
    let mut piece = single(&material, &straight(&SKEWED));
    piece.own[28..32].iter_mut().for_each(|damage| damage[0] = 1.0);
    for (v, x) in piece.v.iter_mut().zip(&piece.x) {
        *v = x.map(|c| 20.0 * c);
    }
    let pressure = |piece: &Piece| {
        let mut block = Block::new(piece);
        let step = bare_step(1e-3, 1e10, 1e10);
        advance(&mut block, step.dt);
        compute(&mut block, &material, &step, Width::best());
        block.field(0, field::PRESSURE)
    };
    assert_eq!(pressure(&piece), 0.0);
    piece.own[31][0] = 0.5;
    assert!(pressure(&piece) < 0.0);
}
