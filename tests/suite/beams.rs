//! Beams: the bits of frames with solids, shells and contact, what breaks them, and how decks describe them.

use deck::Model;
use tests::solve::{Workers, model, solve};

use crate::bits::{fingerprint, losing_a_worker_changes_no_bit, same_bits, same_bits_on_route_direct};

/// A block that falls on a plate of shells which stands on four legs of tubes that buckle and yield.
fn table() -> Model {
    let mut nodes = Vec::new();
    let mut elements = Vec::new();
    for (leg, [x, y]) in [[0.0, 0.0], [0.04, 0.0], [0.0, 0.04], [0.04, 0.04]].into_iter().enumerate() {
        for i in 0..=5 {
            let id = 1000 + 10 * leg + i;
            nodes.push(format!("[{id}, {x}, {y}, {:e}]", 0.012 * i as f64));
            if i > 0 {
                elements.push(format!("[{}, {}, {id}]", 900 + 10 * leg + i, id - 1));
            }
        }
    }
    model(&format!(
        "title = \"a table of beams and shells\"\nunits = \"SI\"\n[control]\nend_cycle = 400\nend_time = 1\n\
         [output]\nhistory_cycles = 10\n\
         [[material]]\nname = \"mild\"\ndensity = 7830\neos = {{ type = \"linear\", bulk = 175e9 }}\n\
         strength = {{ type = \"von-mises\", shear = 80e9, yield_stress = 200e6, hardening = 500e6 }}\n\
         [[part]]\nname = \"block\"\nmaterial = \"CU_OFHC\"\nvelocity = [5, 3, -60]\n\
         box = {{ origin = [0.01, 0.01, 0.0612], size = [0.02, 0.02, 0.02], cells = [3, 3, 3] }}\n\
         [[part]]\nname = \"top\"\nmaterial = \"mild\"\nshell = {{ thickness = 1e-3 }}\n\
         plate = {{ origin = [0, 0, 0.06], side_i = [0.04, 0, 0], side_j = [0, 0.04, 0], cells = [4, 4] }}\n\
         [[part]]\nname = \"legs\"\nmaterial = \"mild\"\nbeam = {{ tube = [0.004, 0.003] }}\n\
         erosion = {{ plastic_strain = 0.0005 }}\n\
         mesh = {{ nodes = [{}], elements = [{}] }}\n\
         [[join]]\nparts = [\"top\", \"legs\"]\n\
         [[boundary]]\ntype = \"fixed\"\nrotations = \"xyz\"\nbox = {{ min = [-1, -1, -0.001], max = [1, 1, 0.001] }}\n\
         [contact]\ngap_length = 8e-4\n",
        nodes.join(", "),
        elements.join(", ")
    ))
}

#[test]
fn a_table_of_beams_has_the_same_bits_on_any_workers() {
    let model = table();
    let solved = solve(model.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}"));
    assert!(solved.outcome.run_totals.eroded_elements > 0, "no beam breaks, so nothing of that is compared");
    let error = solved.rows.iter().map(|row| row.error.abs()).fold(0.0, f64::max);
    assert!(error < 0.01, "energy error {error}");
    same_bits(&model);
    let one = fingerprint(&model, Workers::default());
    same_bits_on_route_direct(&model, &one);
}

#[test]
fn a_lost_worker_changes_no_bit_of_a_table_of_beams() {
    losing_a_worker_changes_no_bit(&table());
}
