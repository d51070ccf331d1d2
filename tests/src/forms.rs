//! Bars whose cells are cut into wedges, pyramids or tetrahedra of four nodes, for the book and the tests of the suite.

use deck::Model;
use mechanics::mesh::FACES;

use crate::solve::{model, run};

/// What a cell of a grid is cut into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cell {
    Whole,
    /// Two wedges, their height along an axis.
    Wedges(usize),
    /// Six pyramids about a node in the middle.
    Pyramids,
    /// Six tetrahedra.
    Tetrahedra,
}

/// Lists of nodes and elements of a bar of cubes of 4, as a deck has them.
pub(crate) fn mesh(cells: [usize; 3], of: impl Fn([usize; 3]) -> Cell) -> String {
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
pub fn cantilever(of: Cell) -> [f64; 3] {
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

/// A bar of 48 by 12 by 12 mm that strikes a wall at 200 m/s, and how short it becomes.
pub fn struck(of: impl Fn([usize; 3]) -> Cell) -> Model {
    model(&format!(
        "title = \"bar\"\nunits = \"mm-ms-kg\"\n[control]\nend_time = 0.06\nend_cycle = 2000\n[[part]]\nname = \"bar\"\n\
         material = {{ {STEEL}, strength = {{ type = \"von-mises\", shear = 76.923077, yield_stress = 0.4, hardening = 0.5 }} }}\n\
         velocity = [-200, 3, 0]\n{}[[wall]]\npoint = [0, 0, 0]\nnormal = [1, 0, 0]\n[output]\nhistory_cycles = 20\n",
        mesh([12, 3, 3], of)
    ))
}
