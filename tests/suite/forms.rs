//! Wedges, pyramids and tetrahedra of four nodes in whole runs, alone and among hexahedra.

use deck::Model;
use mechanics::{
    erosion::Criteria,
    mesh::{FACES, Form},
};
use tests::solve::{model, run};

use crate::bits::{losing_a_worker_changes_no_bit, same_bits};

/// What a cell of a grid is cut into.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Cell {
    Whole,
    /// Two wedges, their height along an axis.
    Wedges(usize),
    /// Six pyramids about a node in the middle.
    Pyramids,
    /// Six tetrahedra.
    Tetrahedra,
}

/// Lists of nodes and elements of a bar of cubes of 4, as a deck has them.
fn mesh(cells: [usize; 3], of: impl Fn([usize; 3]) -> Cell) -> String {
    let [ni, nj, nk] = cells;
    let node = |[i, j, k]: [usize; 3]| 1 + i + (ni + 1) * (j + (nj + 1) * k);
    let (mut nodes, mut elements) = (Vec::new(), Vec::new());
    for k in 0..=nk {
        for j in 0..=nj {
            for i in 0..=ni {
                nodes.push(format!("[{}, {}, {}, {}]", node([i, j, k]), 4 * i, 4 * j, 4 * k));
            }
        }
    }
    let mut next = nodes.len() + 1;
    let mut add = |corners: [usize; 8]| elements.push(corners);
    for k in 0..nk {
        for j in 0..nj {
            for i in 0..ni {
                let at = |[a, b, c]: [usize; 3]| node([i + a, j + b, k + c]);
                let corners =
                    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
                let c = corners.map(at);
                match of([i, j, k]) {
                    Cell::Whole => add(c),
                    Cell::Wedges(axis) => {
                        let turned =
                            [[0, 3, 7, 4, 1, 2, 6, 5], [0, 4, 5, 1, 3, 7, 6, 2], [0, 1, 2, 3, 4, 5, 6, 7]];
                        let [a, b, d, e, f, g, h, l] = turned[axis].map(|corner| c[corner]);
                        add([a, b, d, d, f, g, h, h]);
                        add([a, d, e, e, f, h, l, l]);
                    }
                    Cell::Pyramids => {
                        let middle = [i, j, k].map(|n| 4 * n + 2);
                        nodes.push(format!("[{next}, {}, {}, {}]", middle[0], middle[1], middle[2]));
                        for [p, q, r, s] in FACES.map(|face| face.map(|corner| c[corner])) {
                            add([s, r, q, p, next, next, next, next]);
                        }
                        next += 1;
                    }
                    Cell::Tetrahedra => {
                        for (turn, [p, q]) in
                            [[0, 1], [1, 2], [2, 0], [1, 0], [2, 1], [0, 2]].into_iter().enumerate()
                        {
                            let mut step = [0; 3];
                            step[p] = 1;
                            let mut two = step;
                            two[q] = 1;
                            let [mut near, mut far] = [at(step), at(two)];
                            if turn >= 3 {
                                std::mem::swap(&mut near, &mut far);
                            }
                            add([c[0], near, far, far, c[6], c[6], c[6], c[6]]);
                        }
                    }
                }
            }
        }
    }
    let list = |(e, corners): (usize, &[usize; 8])| {
        let corners: Vec<String> = corners.iter().map(ToString::to_string).collect();
        format!("[{}, {}]", e + 1, corners.join(", "))
    };
    let elements: Vec<String> = elements.iter().enumerate().map(list).collect();
    format!("mesh = {{ nodes = [{}], elements = [{}] }}\n", nodes.join(", "), elements.join(", "))
}

const STEEL: &str = "density = 7.85e-6, eos = { type = \"linear\", bulk = 166.6667 }";

/// Frequency (1/ms) of a cantilever of 80 by 4 by 4 mm with one cell across, and its energy error and hourglass energy over the total.
fn cantilever(of: Cell) -> [f64; 3] {
    let held: Vec<String> = [1, 22, 43, 64].iter().map(ToString::to_string).collect();
    let mut model = model(&format!(
        "title = \"cantilever\"\nunits = \"mm-ms-kg\"\n[control]\nend_time = 4.5\nenergy_error = 0.5\n[[part]]\nname = \"bar\"\n\
         material = {{ {STEEL}, strength = {{ type = \"elastic\", shear = 76.923077 }} }}\n{}\
         [[boundary]]\ntype = \"fixed\"\nnodes = [{}]\n[output]\nhistory_cycles = 1\n",
        mesh([20, 1, 1], |_| of),
        held.join(", "),
    ));
    for (v, x) in model.velocity.iter_mut().zip(&model.mesh.positions) {
        v[2] = 0.05 * (x[0] / 80.0).powi(2) * (3.0 - x[0] / 80.0);
    }
    let solved = run(model);
    let moved: Vec<[f64; 2]> = solved.rows.iter().map(|row| [row.time, row.momentum[2]]).collect();
    let crossings: Vec<f64> = moved
        .windows(2)
        .filter(|pair| pair[0][1] * pair[1][1] < 0.0)
        .map(|pair| {
            let [[t, p], [u, q]] = [pair[0], pair[1]];
            t + (u - t) * p / (p - q)
        })
        .collect();
    assert!(crossings.len() >= 2, "{crossings:?}");
    let n = crossings.len() - 1;
    let period = 2.0 * (crossings[n] - crossings[0]) / n as f64;
    let last = solved.rows.last().expect("rows");
    [1.0 / period, last.error, last.hourglass / last.total]
}

#[test]
fn a_bar_of_wedges_or_pyramids_bends_as_one_of_hexahedra_does() {
    // Within its triangles a wedge has one strain: two of them across the bar, with their heights along y, would bend as stiffly as any
    // triangles of one strain. Euler and Bernoulli: 1.8751^2 sqrt(E I / (rho A)) / (2 pi L^2), less 0.4 % for shear and rotation.
    let slender = 3.516 / std::f64::consts::TAU * (200.0f64 / 7.85e-6).sqrt() * 4.0 / 12.0f64.sqrt() / 6400.0;
    let of = [(Cell::Whole, 0.03), (Cell::Wedges(0), 0.05), (Cell::Wedges(2), 0.05), (Cell::Pyramids, 0.5)];
    for (cell, tolerance) in of {
        let [frequency, error, hourglass] = cantilever(cell);
        println!(
            "{cell:?}: {:.4} of slender, error {error:.1e}, hourglass {hourglass:.3}",
            frequency / slender
        );
        assert!((frequency / slender - 1.0).abs() < tolerance, "{cell:?}: {frequency} of {slender}");
        assert!(error.abs() < 0.01, "{cell:?}: {error}");
    }
}

/// A bar of 48 by 12 by 12 mm that strikes a wall at 200 m/s, and how short it becomes.
fn struck(of: impl Fn([usize; 3]) -> Cell) -> Model {
    model(&format!(
        "title = \"bar\"\nunits = \"mm-ms-kg\"\n[control]\nend_time = 0.06\nend_cycle = 2000\n[[part]]\nname = \"bar\"\n\
         material = {{ {STEEL}, strength = {{ type = \"von-mises\", shear = 76.923077, yield_stress = 0.4, hardening = 0.5 }} }}\n\
         velocity = [-200, 3, 0]\n{}[[wall]]\npoint = [0, 0, 0]\nnormal = [1, 0, 0]\n[output]\nhistory_cycles = 20\n",
        mesh([12, 3, 3], of)
    ))
}

#[test]
fn a_bar_of_each_form_shortens_as_one_of_hexahedra_does() {
    let length = |of: Cell| {
        let solved = run(struck(|_| of));
        let last = solved.rows.last().expect("rows");
        assert!(last.error.abs() < 0.01, "{of:?}: energy error {}", last.error);
        // What `bolide check` foretells.
        let first = deck::physics::forecast(&solved.model).first_step_s.expect("a step") * 1e3;
        println!("{of:?}: first step {:.4e}, foretold {first:.4e}", solved.rows[0].dt);
        assert!((first / solved.rows[0].dt - 1.0).abs() < 0.02, "{of:?}: {first} foretold");
        let ends = solved.state.x.iter().map(|x| x[0]);
        let [low, high] = ends.fold([f64::INFINITY, 0.0_f64], |[low, high], x| [low.min(x), high.max(x)]);
        println!(
            "{of:?}: {:.3} mm at {:.4} ms, {} cycles",
            high - low,
            solved.state.time,
            solved.state.cycle
        );
        (high - low) / 48.0
    };
    let whole = 1.0 - length(Cell::Whole);
    // Tetrahedra of one strain are too stiff where they flow.
    let of = [
        (Cell::Wedges(0), 0.05),
        (Cell::Wedges(1), 0.05),
        (Cell::Wedges(2), 0.05),
        (Cell::Pyramids, 0.05),
        (Cell::Tetrahedra, 0.15),
    ];
    for (of, tolerance) in of {
        let shortened = 1.0 - length(of);
        assert!((shortened / whole - 1.0).abs() < tolerance, "{of:?}: {shortened}, hexahedra {whole}");
    }
}

/// All forms in one part: hexahedra, wedges through the bar and pyramids, by slices.
fn mixed() -> Model {
    let slices = [Cell::Whole, Cell::Wedges(2), Cell::Pyramids, Cell::Wedges(0)];
    let mut model = struck(|[i, ..]| if i % 4 == 3 { Cell::Whole } else { slices[i % 4] });
    model.setup.control.end_cycle = 200;
    model
}

#[test]
fn forms_among_hexahedra_have_the_same_bits_on_any_workers() {
    let model = mixed();
    let part = &model.mesh.parts[0];
    for form in [Form::Hexahedron, Form::Wedge, Form::Pyramid] {
        assert!((0..part.n_elements()).any(|e| part.form(e) == form), "{form:?}");
    }
    same_bits(&model);
    losing_a_worker_changes_no_bit(&model);
}

#[test]
fn tetrahedra_of_four_nodes_have_the_same_bits_on_any_workers() {
    let mut model = struck(|_| Cell::Tetrahedra);
    model.setup.control.end_cycle = 120;
    same_bits(&model);
}

#[test]
fn forms_that_erode_keep_the_account_of_energy() {
    for of in [Cell::Wedges(2), Cell::Pyramids, Cell::Tetrahedra] {
        let mut model = struck(|_| of);
        let criteria = Criteria { plastic_strain: Some(0.4), ..Criteria::default() };
        model.setup.erosion.parts = vec![Some(criteria)];
        let solved = run(model);
        let (eroded, error) = (solved.state.n_eroded(), solved.rows.last().expect("rows").error);
        println!("{of:?}: {eroded} eroded, error {error:.1e}");
        assert!(eroded > 10 && error.abs() < 0.01, "{of:?}: {eroded} eroded, energy error {error}");
    }
}
