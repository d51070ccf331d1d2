//! Erosion: a rod goes through a plate, and what left is in the totals.

use mechanics::{contact::Surface, state::ALIVE};

use crate::{
    case::Figures,
    solve::{Solved, example, keyword, model, run},
};

/// A block of 4 by 4 by 4 elements without one of them: the faces on its surface.
pub(super) fn an_element_that_leaves_a_block_uncovers_its_neighbours(figures: &mut Figures) {
    let block = model(
        r#"
            title = "block"
            units = "SI"
            [control]
            end_cycle = 1
            [[part]]
            name = "block"
            material = "MILD_STEEL"
            box = { origin = [0, 0, 0], size = [1, 1, 1], cells = [4, 4, 4] }
        "#,
    );
    let n_faces = |gone: u32| Surface::new(&block.mesh, &block.setup.materials, &|e| e != gone).faces.len();
    for (place, gone) in
        [("nowhere", u32::MAX), ("a corner", 0), ("an edge", 1), ("a face", 5), ("inside", 21)]
    {
        figures.add(&format!("block without an element @ {place}, faces"), n_faces(gone) as f64);
    }
}

/// Whether what an instant of a run has lost is never less than what an earlier one had.
fn never_falls(solved: &Solved) -> bool {
    let grows = |read: &dyn Fn(usize) -> f64| (1..solved.rows.len()).all(|i| read(i) >= read(i - 1));
    grows(&|i| solved.rows[i].eroded_mass) && grows(&|i| solved.rows[i].eroded_elements as f64)
}

/// Mass of the elements of the whole mesh that have eroded, over that which the totals has.
fn mass_of_the_eroded(solved: &Solved) -> f64 {
    let offsets = solved.model.mesh.element_offsets();
    let mut mass = 0.0;
    for (part, first) in solved.model.mesh.parts.iter().zip(offsets) {
        let density = solved.model.setup.materials[part.material as usize].density;
        for e in (first..first + part.n_elements()).filter(|&e| solved.state.eroded[e] != ALIVE) {
            mass += density * solved.state.initial_volume[e];
        }
    }
    solved.outcome.run_totals.eroded_mass / mass
}

/// Tungsten of 6 mm x 24 mm through 5 mm of steel at 1200 m/s, elements out at a geometric strain of 1.5: nodes that
/// lost all their elements fly on.
pub(super) fn a_rod_goes_through_a_plate_and_energies_add_up(figures: &mut Figures) {
    let mut model = example("rod-through-plate");
    model.output.history_cycles = 10;
    let solved = run(model);
    let run_totals = &solved.outcome.run_totals;
    assert!(never_falls(&solved), "what has eroded came back");
    figures.add("rod through plate: energy error", run_totals.last.error);
    figures.add("rod through plate: momentum error", run_totals.momentum_error());
    figures.add("rod through plate: mass of the eroded over the ledger's", mass_of_the_eroded(&solved));
    let mass: f64 = solved.state.mass.iter().sum();
    let first: f64 = (0..solved.model.mesh.n_elements())
        .map(|e| {
            let part = solved.model.mesh.element_offsets().partition_point(|&first| first <= e) - 1;
            let material = solved.model.mesh.parts[part].material as usize;
            solved.model.setup.materials[material].density * solved.state.initial_volume[e]
        })
        .sum();
    figures.add("rod through plate: mass of all nodes over that of all elements", mass / first);
    let speed = -solved.part_velocity(0)[2];
    assert!(speed < 1200.0, "{speed}");
    figures.add("rod through plate: deepest contact over the gap", run_totals.worst_penetration);
    let front = solved.model.mesh.parts[0].nodes.iter().map(|&n| solved.state.x[n as usize][2]);
    assert!(front.fold(f64::INFINITY, f64::min) < -5.0, "the rod is not through");
}

/// The keyword example: a punch slantwise through a held plate; nodes without elements leave the run.
pub(super) fn a_punch_of_a_keyword_deck_goes_through_and_what_is_dropped_is_booked(figures: &mut Figures) {
    let solved = run(keyword("punch-through-plate"));
    let run_totals = &solved.outcome.run_totals;
    assert!(never_falls(&solved), "what has eroded came back");
    assert!(run_totals.eroded_momentum[2] < 0.0, "nothing was dropped: {:?}", run_totals.eroded_momentum);
    figures.add("punch through plate: energy error", run_totals.last.error);
    figures.add("punch through plate: mass of the eroded over the ledger's", mass_of_the_eroded(&solved));
}

/// The example of a ball that tears a sheet.
pub(super) fn a_torn_sheet_closes_its_account_of_energy(figures: &mut Figures) {
    let solved = run(example("ball-tears-sheet"));
    let worst = solved.rows.iter().map(|row| row.error.abs()).fold(0.0, f64::max);
    figures.add("torn sheet: worst energy error", worst);
    figures.add("torn sheet: eroded elements that come back", f64::from(u8::from(!never_falls(&solved))));
    assert!(solved.state.n_eroded() > 40, "{} eroded", solved.state.n_eroded());
}
