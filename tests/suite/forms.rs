//! Wedges, pyramids and tetrahedra of four nodes in whole runs, alone and among hexahedra.

use deck::Model;
use mechanics::{erosion::Criteria, mesh::Form};
use tests::{
    forms::{Cell, struck},
    solve::run,
};

use crate::bits::{losing_a_worker_changes_no_bit, same_bits};

#[test]
fn check_foretells_the_first_step_of_each_form() {
    for of in [Cell::Whole, Cell::Wedges(0), Cell::Pyramids, Cell::Tetrahedra] {
        let mut model = struck(|_| of);
        model.setup.control.end_cycle = 1;
        let solved = run(model);
        let foretold = deck::physics::forecast(&solved.model).first_step_s.expect("a step") * 1e3;
        let first = solved.rows[0].dt;
        println!("{of:?}: first step {first:.4e}, foretold {foretold:.4e}");
        assert!((foretold / first - 1.0).abs() < 1e-3, "{of:?}: {foretold} foretold, {first}");
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
