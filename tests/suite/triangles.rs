//! Shells of three corners: a plate of them that a block strikes.

use deck::Model;
use tests::solve::{Workers, solve};

use crate::bits::{losing_a_worker_changes_no_bit, same_bits};

/// A plate of 60 by 60 by 2 mm, 12 by 12 squares, each of two triangles or, where `in_triangles` says no, left whole, held along its edges
/// and struck by a block of steel at 60 m/s.
fn struck(in_triangles: bool) -> Model {
    let (mut nodes, mut shells, mut held) = (String::new(), String::new(), String::new());
    let mut element = 1;
    for j in 0..=12 {
        for i in 0..=12 {
            let n = 13 * j + i + 1;
            nodes += &format!("{n},{},{},0.\n", 5 * i - 30, 5 * j - 30);
            if i % 12 == 0 || j % 12 == 0 {
                held += &format!("*BOUNDARY_SPC_NODE\n{n},0,1,1,1,1,1,1\n");
            }
            if i < 12 && j < 12 {
                let [a, b, c, d] = [n, n + 1, n + 14, n + 13];
                let halves = if in_triangles { vec![[a, b, c, c], [c, d, a, a]] } else { vec![[a, b, c, d]] };
                for [p, q, r, s] in halves {
                    shells += &format!("{element},1,{p},{q},{r},{s}\n");
                    element += 1;
                }
            }
        }
    }
    for (k, z) in [1.2, 11.2].into_iter().enumerate() {
        for (at, [x, y]) in [[-5, -5], [5, -5], [5, 5], [-5, 5]].into_iter().enumerate() {
            nodes += &format!("{},{x}.,{y}.,{z}\n", 201 + 4 * k + at);
        }
    }
    let block = (201..209).map(|n| n.to_string()).collect::<Vec<_>>().join(",");
    let text = format!(
        "*KEYWORD\n*CONTROL_TERMINATION\n0.1,300\n*PART\nplate\n1,1,1\nblock\n2,2,2\n*SECTION_SHELL\n1,2,,5\n2,2,2,2\n\
         *SECTION_SOLID\n2,1\n*MAT_PLASTIC_KINEMATIC\n1,7.85e-6,200,0.3,0.3,1\n*MAT_ELASTIC\n2,7.85e-6,200,0.3\n\
         *NODE\n{nodes}*ELEMENT_SHELL\n{shells}*ELEMENT_SOLID\n{element},2,{block}\n{held}\
         *INITIAL_VELOCITY_GENERATION\n2,2,,0,0,-60\n*CONTACT_AUTOMATIC_SURFACE_TO_SURFACE\n2,1,3,3\n\n\n*END\n"
    );
    deck::read(&text, "plate.k").unwrap_or_else(|faults| {
        panic!("{}", faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
    })
}

/// The share of its momentum that the block has lost at the end, and the energy error.
fn lost(model: Model) -> [f64; 2] {
    let solved = solve(model, Workers::default()).unwrap_or_else(|e| panic!("{e}"));
    let (first, last) = (&solved.rows[0], solved.rows.last().expect("rows"));
    [1.0 - last.part_momenta[1][2] / first.part_momenta[1][2], last.error]
}

#[test]
fn a_plate_of_triangles_stops_a_block_as_one_of_quadrilaterals_does() {
    let [[triangles, error], [quadrilaterals, _]] = [true, false].map(|halves| lost(struck(halves)));
    println!("lost: {triangles:.3} on triangles, {quadrilaterals:.3} on quadrilaterals; error {error:e}");
    assert!(error.abs() < 0.005, "{error}");
    assert!((triangles / quadrilaterals - 1.0).abs() < 0.1, "{triangles} and {quadrilaterals}");
}

#[test]
fn triangles_have_the_same_bits_on_any_workers() {
    same_bits(&struck(true));
    losing_a_worker_changes_no_bit(&struck(true));
}
