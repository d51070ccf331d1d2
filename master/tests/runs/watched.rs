//! What a deck asks to have watched: forces between parts, elements, the contact surface. It is what it says, the same on
//! any workers, and changes nothing.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use deck::Model;
use master::{
    event::WorkerSpec,
    job::Job,
    results::{self, Folder, vtu::read::Piece},
};
use mechanics::state::field;
use protocol::options::JobOptions;
use tests::{
    bits::Fingerprint,
    solve::{Solved, Workers, model, run, solve, without_states},
};

const PARTS: &str = r#"
    title = "small plates"
    units = "cm-g-us"
    [control]
    end_cycle = 80
    end_time = 1e3
    plan_interval = 9
    [[part]]
    name = "target"
    material = "AL_2024_T351"
    box = { origin = [0, 0, 0], size = [8, 8, 3], cells = [8, 8, 3] }
    [[part]]
    name = "projectile"
    material = "STEEL_1006"
    velocity = [0.003, 0, -0.03]
    box = { origin = [2, 2, 3.11], size = [4, 4, 3], cells = [4, 4, 3] }
    [contact]
    gap_length = 0.1
"#;

const WATCHED: &str = r#"
    contact_forces = [["projectile", "target"]]
    contact_surface = true
    [[gauge]]
    name = "under it"
    of = "element"
    part = "target"
    point = [3.5, 3.5, 2.5]
    [[gauge]]
    name = "corner"
    element = 1
"#;

fn plates(friction: f64, watched: bool) -> Model {
    let output = if watched { WATCHED } else { "" };
    model(&format!("{PARTS}\nfriction = {friction}\n[output]\nhistory_cycles = 1\n{output}"))
}

/// Force on the projectile and contacts, by row.
fn forces(solved: &Solved) -> Vec<([f64; 3], u64)> {
    let of = |contacts: &[(u32, mechanics::contact::PairVote)]| {
        contacts.first().map_or(([0.0; 3], 0), |(_, vote)| (vote.force, vote.hits))
    };
    solved.rows.iter().map(|row| of(&row.contacts)).collect()
}

#[test]
fn watching_changes_no_bit_and_sees_the_same_on_any_workers() {
    for friction in [0.0, 0.2] {
        let alone = run(plates(friction, true));
        let unwatched = run(plates(friction, false));
        assert_eq!(alone.outcome.digest, unwatched.outcome.digest);
        assert!(unwatched.rows.iter().all(|row| row.contacts.is_empty() && row.element_gauges.is_empty()));
        let one = Fingerprint::of(&alone);
        for workers in [2, 5] {
            let at_work = Workers { threads: 2, ..Workers::of(workers) };
            let many = solve(plates(friction, true), at_work).unwrap_or_else(|e| panic!("{e}"));
            one.assert_equal(&Fingerprint::of(&many), &format!("{workers} workers, friction {friction}"));
        }
        // From a snapshot, on other workers.
        let options = without_states(JobOptions { snapshot_at: Some(33), ..JobOptions::default() });
        let stored = solve(plates(friction, true), Workers { options, ..Workers::default() });
        let resume = stored.unwrap_or_else(|e| panic!("{e}")).snapshot;
        assert!(resume.is_some(), "no snapshot at cycle 33");
        let resumed = solve(plates(friction, true), Workers { resume, ..Workers::of(3) });
        one.assert_equal(&Fingerprint::of(&resumed.unwrap_or_else(|e| panic!("{e}"))), "resumed");
    }
}

#[test]
fn force_of_the_contact_is_what_changes_the_momentum_of_the_projectile() {
    for friction in [0.0, 0.2] {
        let solved = run(plates(friction, true));
        let (forces, mass) = (forces(&solved), {
            let nodes = &solved.model.mesh.parts[1].nodes;
            nodes.iter().map(|&n| solved.state.mass[n as usize]).sum::<f64>()
        });
        assert!(forces.iter().filter(|(_, hits)| *hits > 0).count() > 30, "hardly any contact");
        // Velocities step from half a cycle before to half a cycle after the positions that forces belong to.
        let mut impulse = [0.0; 3];
        let mut before = 0.0;
        for (row, (force, _)) in solved.rows.iter().zip(&forces) {
            (0..3).for_each(|a| impulse[a] += force[a] * 0.5 * (before + row.dt));
            before = row.dt;
        }
        let end = solved.part_velocity(1);
        for (axis, start) in [(0, 0.003), (1, 0.0), (2, -0.03)] {
            let change = mass * (end[axis] - start);
            let scale = mass * 0.03;
            assert!(
                (impulse[axis] - change).abs() < 1e-6 * scale,
                "axis {axis}, friction {friction}: impulse {}, momentum changed by {change}",
                impulse[axis]
            );
        }
        assert!(impulse[2] > 0.1 * mass * 0.03, "{impulse:?}");
        assert_eq!(impulse[0] < -1e-3 * impulse[2], friction > 0.0, "{impulse:?}");
    }
}

#[test]
fn element_gauge_reads_the_state_of_the_element_that_the_deck_means() {
    let mut deck = plates(0.0, true);
    let gauges: Vec<u32> = deck.output.element_gauges.iter().map(|g| g.element).collect();
    // Element 3, 3, 2 of 8 x 8 x 3, and the first.
    assert_eq!(gauges, [3 + 8 * (3 + 8 * 2), 0]);
    deck.setup.control.end_cycle = 60;
    let long = run(deck.clone());
    // The state at the start of cycle 59 has the stresses of cycle 58.
    deck.setup.control.end_cycle = 59;
    let short = run(deck);
    for (gauge, &element) in gauges.iter().enumerate() {
        let read = &long.rows[58].element_gauges[gauge];
        for (f, value) in read.iter().enumerate() {
            assert_eq!(
                value.to_bits(),
                short.state.elements[f][element as usize].to_bits(),
                "gauge {gauge}, field {f}"
            );
        }
    }
    let pressures = long.rows.iter().map(|row| row.element_gauges[0][field::PRESSURE]);
    assert!(pressures.fold(0.0, f64::max) > 1e-3, "the gauge under the projectile feels nothing");
}

#[test]
fn history_variables_are_arrays_of_states_and_columns_of_element_gauges() {
    let hard = PARTS.replace("AL_2024_T351", "BORON_CARBIDE").replace("-0.03]", "-0.15]");
    let deck = |end_cycle: u64| {
        let mut deck = model(&format!("{hard}\n[output]\nhistory_cycles = 1\n{WATCHED}"));
        deck.setup.control.end_cycle = end_cycle;
        deck
    };
    let (long, short) = (run(deck(60)), run(deck(59)));
    let columns = &short.state.history_of(0).expect("a ceramic target").columns;
    assert_eq!(columns.len(), 2);
    let element = short.model.output.element_gauges[0].element as usize;
    let read = &long.rows[58].element_gauges[0];
    assert_eq!(read.len(), mechanics::state::N_FIELDS + 2);
    for (place, column) in columns.iter().enumerate() {
        let value = column[element];
        assert!(value > 0.0, "nothing broke under the projectile: {value}");
        assert_eq!(value.to_bits(), read[mechanics::state::N_FIELDS + place].to_bits());
    }

    let folder = Folder::create(&scratch("history"), false).expect("fresh");
    results::history::History::create(&folder, &short.model).expect("written");
    let header = fs::read_to_string(folder.file(results::HISTORY)).expect("written");
    for column in ["under it:bulking_pressure [Mbar]", "corner:released_energy [Mbar]"] {
        assert!(header.contains(column), "{header}");
    }
    let path = folder.file("broken.vtu");
    let fields = results::vtu::Fields::select(&["pressure".to_owned()]).expect("known");
    results::vtu::write_vtu(&path, &short.model, &short.state, &fields, None).expect("written");
    let piece = Piece::open(&path).expect("whole");
    let n = piece.n_cells;
    for (name, column) in ["bulking_pressure", "released_energy"].into_iter().zip(columns) {
        let array = piece.expect("CellData", name).expect("written");
        let found = piece.numbers(array, n).expect("whole");
        // The projectile has none.
        let wanted = column.iter().copied().chain(std::iter::repeat_n(0.0, n - column.len()));
        assert!(found.iter().map(|v| v.to_bits()).eq(wanted.map(f64::to_bits)), "{name}");
    }
}

/// A fresh place below the folder for tests.
fn scratch(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("watched").join(name);
    if path.exists() {
        fs::remove_dir_all(&path).expect("an earlier run of this test made it");
    }
    path
}

#[test]
fn contact_surface_carries_the_force_of_the_history_as_pressure_where_bodies_touch() {
    let mut deck = plates(0.0, true);
    deck.setup.control.end_cycle = 61;
    let row = run(deck.clone()).rows[60].contacts.clone();
    let (force, hits) = (row[0].1.force, row[0].1.hits);
    assert!(hits > 10, "{row:?}");
    deck.setup.control.end_cycle = 60;
    let solved = run(deck);
    let spec = WorkerSpec::new("one", 1.0, 1);
    let (job, _) = Job::new(Arc::clone(&solved.model), &[spec], without_states(JobOptions::default()), None)
        .expect("it has run");
    let probe = job.probe().expect("there is contact");
    let (surface, map) = probe.map(&solved.model, &solved.state);
    let on_projectile = |n: usize| surface.node_part[n] == 1;
    for axis in 0..3 {
        let sum: f64 =
            map.force.iter().enumerate().filter(|(n, _)| on_projectile(*n)).map(|(_, f)| f[axis]).sum();
        assert!((sum - force[axis]).abs() < 1e-5 * force[2].abs(), "axis {axis}: {sum}, history {force:?}");
    }

    let folder = Folder::create(&scratch("surface"), false).expect("fresh");
    probe.write(&folder, 3, &solved.model, &solved.state).expect("written");
    let piece = Piece::open(&folder.file(&results::contact_name(3))).expect("whole");
    assert_eq!((piece.n_points, piece.n_cells, piece.cycle), (surface.nodes.len(), surface.faces.len(), 60));
    let numbers = |section: &str, name: &str, n| {
        piece.numbers(piece.expect(section, name).expect("written"), n).expect("whole")
    };
    let pressure = numbers("CellData", "contact_pressure", piece.n_cells);
    let gap = numbers("CellData", "gap", piece.n_cells);
    let part = numbers("CellData", "part", piece.n_cells);
    let points = piece.points().expect("whole");
    let faces = piece.cells("Polys").expect("whole");
    let mut pushed = [0.0; 2];
    for (f, face) in faces.iter().enumerate() {
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| points[face[i] as usize]);
        let (p, q) = ([0, 1, 2].map(|i| c[i] - a[i]), [0, 1, 2].map(|i| d[i] - b[i]));
        let upward = 0.5 * (p[0] * q[1] - p[1] * q[0]);
        assert!(
            pressure[f] >= 0.0 && (0.0..=0.2).contains(&gap[f]),
            "face {f}: {} at {}",
            pressure[f],
            gap[f]
        );
        // Whoever is far from the other body feels nothing.
        assert!(
            pressure[f] == 0.0 || gap[f] < 0.1,
            "face {f}: pressure {} at a gap of {}",
            pressure[f],
            gap[f]
        );
        pushed[part[f] as usize] -= pressure[f] * upward;
    }
    // The target is pushed down by what pushes the projectile up.
    for (part, sign) in [(0, -1.0), (1, 1.0)] {
        let share = sign * pushed[part] / force[2];
        // Faces bulge, so that pressures do not quite point along the forces.
        assert!((0.94..1.06).contains(&share), "part {part}: {share} of the force");
    }
}
