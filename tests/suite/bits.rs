//! Same bits: the cut, the threads, the lanes, the sorts and a restart change nothing of a run.
//!
//! The whole matrix, with worker processes, is the program `bits` of this package.

mod compare;
mod edges;
mod shells;
mod stress;
mod threads;

use std::sync::Arc;

use mechanics::state::{GlobalState, PartHistory};
use tests::{
    bits::Fingerprint,
    solve::{Workers, example, keyword, model, solve, without_states},
};

use deck::Model;
use protocol::options::{JobOptions, Route};

pub(crate) use compare::{
    asked, fingerprint, losing_a_worker_changes_no_bit, same_bits, same_bits_from_files,
    same_bits_on_route_direct,
};

/// Steel that shatters a ceramic tile, whose law declares history variables; behind it copper, whose law has none.
const TILE: &str = r#"
    title = "tile"
    units = "cm-g-us"
    [control]
    end_cycle = 150
    end_time = 1e3
    plan_interval = 20
    [[part]]
    name = "backing"
    material = "CU_OFHC"
    box = { origin = [0, 0, -2.11], size = [6, 6, 2], cells = [6, 6, 2] }
    [[part]]
    name = "tile"
    material = "BORON_CARBIDE"
    box = { origin = [0, 0, 0], size = [6, 6, 3], cells = [6, 6, 3] }
    [[part]]
    name = "projectile"
    material = "STEEL_1006"
    velocity = [0.01, 0, -0.15]
    box = { origin = [2, 2, 3.11], size = [2, 2, 3], cells = [2, 2, 3] }
    [contact]
    gap_length = 0.1
    [output]
    history_cycles = 1
    [[gauge]]
    name = "struck"
    of = "element"
    part = "tile"
    point = [3.5, 3.5, 2.5]
"#;

#[test]
fn history_variables_have_the_same_bits_on_any_workers_routes_and_lanes_and_over_a_snapshot_and_a_loss() {
    let model = model(TILE);
    let alone = solve(model.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}"));
    let [history] = &alone.state.history[..] else { panic!("{} parts", alone.state.history.len()) };
    assert_eq!((history.part, history.first as usize), (1, model.mesh.element_offsets()[1]));
    for column in &history.columns {
        let changed = column.iter().filter(|value| **value > 0.0).count();
        assert!((10..=108).contains(&changed), "{changed} of 108");
    }
    same_bits(&model);
    same_bits_on_route_direct(&model, &Fingerprint::of(&alone));
    losing_a_worker_changes_no_bit(&model);
}

#[test]
fn a_snapshot_whose_arrays_are_not_as_long_as_the_problems_is_refused() {
    let mut model = example("plates-joined");
    model.setup.control.end_cycle = 4;
    let options = without_states(JobOptions { snapshot_at: Some(2), ..JobOptions::default() });
    let whole = solve(model.clone(), asked(1, options)).unwrap_or_else(|e| panic!("{e}"));
    let snapshot = whole.snapshot.expect("a snapshot was asked for");
    let spoils: [fn(&mut GlobalState); 6] = [
        |state| state.x.truncate(7),
        |state| state.v.push([0.0; 3]),
        |state| state.mass.clear(),
        |state| state.elements[2].clear(),
        |state| state.initial_volume.truncate(26_999),
        |state| state.history.push(PartHistory::default()),
    ];
    for (number, spoil) in spoils.into_iter().enumerate() {
        let mut snapshot = snapshot.clone();
        spoil(Arc::make_mut(&mut snapshot.state));
        let at_work = Workers { resume: Some(snapshot), ..Workers::of(2) };
        let error = solve(model.clone(), at_work).err().unwrap_or_else(|| panic!("{number} is taken"));
        assert!(error.to_string().contains("of another problem"), "{number}: {error}");
    }
}

#[test]
fn free_slip_plates_of_27000_elements_have_the_same_bits_on_any_crew() {
    let mut model = example("plates-free-slip");
    model.setup.control.end_cycle = 24;
    model.output.history_cycles = 1;
    same_bits(&model);
}

#[test]
fn votes_of_64_and_200_workers_come_to_the_bits_of_one() {
    let mut model = example("plates-free-slip");
    model.setup.control.end_cycle = 24;
    model.output.history_cycles = 1;
    let one = fingerprint(&model, Workers::default());
    for workers in [64, 200] {
        let options = without_states(JobOptions { route: Some(Route::Direct), ..JobOptions::default() });
        let at_work = Workers { options, ..Workers::of(workers) };
        one.assert_equal(&fingerprint(&model, at_work), &format!("{workers} workers"));
    }
}

#[test]
fn small_plates_that_slide_and_bounce_have_the_same_bits_for_longer() {
    same_bits(&model(
        r#"
        title = "small plates"
        units = "cm-g-us"
        [control]
        end_cycle = 400
        end_time = 1e3
        [[part]]
        name = "target"
        material = "AL_2024_T351"
        box = { origin = [0, 0, 0], size = [9, 8, 4], cells = [9, 8, 4] }
        [[part]]
        name = "projectile"
        material = "STEEL_1006"
        velocity = [0.02, 0.01, -0.05]
        box = { origin = [1.3, 0.7, 4.2], size = [5, 6, 3], cells = [5, 6, 3] }
        rotate = { axis = [1, 2, 0], degrees = 2, point = [4, 4, 4.2] }
        translate = [0, 0, 0.2]
        [contact]
        gap_length = 0.15
        friction = 0.1
        [output]
        history_cycles = 1
        [[gauge]]
        name = "struck face"
        part = "target"
        point = [4, 4, 4]
        "#,
    ));
}

#[test]
fn joined_parts_on_a_wall_have_the_same_bits() {
    same_bits(&model(
        r#"
        title = "joined bar on a wall"
        units = "mm-ms-kg"
        [control]
        end_cycle = 600
        end_time = 1
        [[part]]
        name = "front"
        material = "COPPER_TAYLOR_BENCHMARK"
        velocity = [0, 0, -227]
        cylinder = { base = [0, 0, 0], radius = 3.2, length = 8, sector = "quarter", cells = [3, 3, 10] }
        [[part]]
        name = "rear"
        material = "STEEL_4340"
        velocity = [0, 0, -227]
        cylinder = { base = [0, 0, 8], radius = 3.2, length = 8, sector = "quarter", cells = [3, 3, 10] }
        [[join]]
        parts = "all"
        [[boundary]]
        type = "symmetry"
        axis = "x"
        [[boundary]]
        type = "symmetry"
        axis = "y"
        [[wall]]
        point = [0, 0, 0]
        normal = [0, 0, 1]
        friction = 0.2
        [output]
        history_cycles = 7
        [[gauge]]
        name = "rear"
        point = [0, 0, 16]
        "#,
    ));
}

/// Sums of energies are exact however far loads bring them beyond what the deck let expect: a soft plate under a pressure that throws it, and a
/// heavy ram that a curve drives.
#[test]
fn energies_that_nobody_foresaw_have_the_same_bits() {
    let flyer = model(
        "title = \"thrown\"\nunits = \"SI\"\n[control]\nend_cycle = 200\nend_time = 1\n[output]\nhistory_cycles = 1\n[[part]]\nname = \"flyer\"\n\
         material = { density = 8000, eos = { type = \"linear\", bulk = 20e9 } }\n\
         box = { origin = [0, 0, 0], size = [0.1, 0.1, 0.004], cells = [7, 7, 2] }\n\
         [[load]]\ntype = \"pressure\"\nface = \"k-min\"\npressure = 1e9\n",
    );
    let solved = solve(flyer.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}"));
    let last = solved.rows.last().expect("rows");
    // A thousandth of the modulus in its volume, of which sums hold 128.
    assert!(last.kinetic > 2.0 * 128.0 * 20e6 * 4e-5, "{last:?}");
    same_bits(&flyer);
    let ram = model(
        "title = \"ram\"\nunits = \"SI\"\n[control]\nend_cycle = 100\nend_time = 1\n[output]\nhistory_cycles = 1\n[[part]]\nname = \"ram\"\n\
         material = \"STEEL_1006\"\nbox = { origin = [0, 0, 1], size = [1, 1, 1], cells = [2, 2, 2] }\n[[part]]\nname = \"foil\"\n\
         material = \"LEAD\"\nvelocity = [0, 0, -20]\nbox = { origin = [0, 0, 0], size = [0.1, 0.1, 0.01], cells = [7, 7, 2] }\n\
         [[curve]]\nname = \"v\"\npoints = [[0, 0], [3e-5, 0], [3.1e-5, 100], [1, 100]]\n\
         [[rigid]]\nparts = [\"ram\"]\nvelocity = { x = 0, y = 0, z = { curve = \"v\" } }\n[gravity]\nacceleration = [0.1, 0.3, -9.81]\n",
    );
    same_bits(&ram);
}

#[test]
fn every_load_and_wall_has_the_same_bits_on_both_routes() {
    let model = model(
        r#"
        title = "loads"
        units = "cm-g-us"
        [control]
        end_cycle = 300
        safety_factor = 0.4
        end_time = 1e3
        [[curve]]
        name = "pulse"
        points = [[0, 0], [5, 1], [30, 0.5]]
        [[part]]
        name = "target"
        material = "AL_2024_T351"
        box = { origin = [0, 0, 0], size = [9, 8, 4], cells = [9, 8, 4] }
        [[part]]
        name = "projectile"
        material = "STEEL_1006"
        velocity = [0.02, 0.01, -0.05]
        box = { origin = [1.3, 0.7, 4.3], size = [5, 6, 3], cells = [5, 6, 3] }
        [contact]
        gap_length = 0.15
        [[load]]
        type = "pressure"
        parts = ["projectile"]
        face = "k-max"
        pressure = { curve = "pulse", factor = 2e-3 }
        [[load]]
        type = "moving-pressure"
        parts = ["projectile"]
        face = "k-max"
        pressure = 1e-3
        profile = "pulse"
        radius = 1.5
        axis = [0, 0, -1]
        path = [[0, 2, 2, 9], [30, 5, 4, 9]]
        [[load]]
        type = "force"
        parts = ["target"]
        face = "i-min"
        force = [1e-4, 0, 2e-4]
        curve = "pulse"
        [gravity]
        acceleration = [0, 0, -1e-5]
        curve = "pulse"
        [relaxation]
        factor = 0.999
        rate = 0.002
        until = 40
        [[boundary]]
        type = "transmit"
        parts = ["target"]
        face = "k-min"
        [[boundary]]
        type = "velocity"
        parts = ["target"]
        face = "j-max"
        velocity = { y = { curve = "pulse", factor = -1e-3 } }
        [[wall]]
        point = [0, 0, -0.02]
        normal = [0, 0, 1]
        friction = 0.2
        mass = 4000
        velocity = { z = 2e-3 }
        [[wall]]
        shape = "sphere"
        point = [4, 4, 9.32]
        radius = 2
        mass = 3000
        velocity = { z = -0.06 }
        parts = ["projectile"]
        [[wall]]
        shape = "cylinder"
        point = [-1.05, 0, 2]
        axis = [0, 1, 0]
        radius = 1
        velocity = { x = { curve = "pulse", factor = 0.01 } }
        [output]
        history_cycles = 1
        "#,
    );
    same_bits(&model);
    let one = Fingerprint::of(&solve(model.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}")));
    same_bits_on_route_direct(&model, &one);
    // Nothing of it is idle: without any one of them the bits are others.
    let without = |change: &dyn Fn(&mut Model)| {
        let mut other = model.clone();
        change(&mut other);
        fingerprint(&other, Workers::default()).digest
    };
    for wall in 0..3 {
        let idle = without(&|m| m.setup.walls[wall].parts.fill(false));
        assert_ne!(idle, one.digest, "wall {wall}");
    }
    for surface in 0..3 {
        assert_ne!(
            without(&|m| m.setup.loads.surfaces[surface].faces.clear()),
            one.digest,
            "surface {surface}"
        );
    }
    assert_ne!(without(&|m| m.setup.loads.gravity = None), one.digest);
    assert_ne!(without(&|m| m.setup.loads.relaxation = None), one.digest);
    assert_ne!(without(&|m| m.setup.loads.forces[0].force = [0.0; 3]), one.digest);
}

#[test]
fn a_split_ring_that_closes_on_itself_has_the_same_bits() {
    let mut model = model(
        r#"
        title = "split ring"
        units = "mm-ms-kg"
        [control]
        end_cycle = 300
        end_time = 1
        [[part]]
        name = "ring"
        material = "MILD_STEEL"
        [part.tube]
        axis = "y"
        base = [0, 0, 0]
        inner_radius = 9
        outer_radius = 11
        length = 4
        start_degrees = 94
        angle_degrees = 352
        cells = [3, 72, 5]
        [contact]
        self_interaction = "all"
        friction = 0.2
        [output]
        history_cycles = 5
        "#,
    );
    for (v, x) in model.velocity.iter_mut().zip(&model.mesh.positions) {
        if x[0] > 7.0 {
            v[2] = -100.0 * x[2].signum();
        }
    }
    same_bits(&model);
}

#[test]
fn an_imported_mesh_has_the_same_bits() {
    let mut model = keyword("block-on-plate");
    model.setup.control.end_cycle = 300;
    model.output.history_cycles = 1;
    same_bits(&model);
}

/// Cuts every hexahedron into elements whose corners coincide: `cut` names eight of the old corners for each.
fn cut_up(model: &mut Model, cut: &[[usize; 8]]) {
    let mut next = 0;
    for part in &mut model.mesh.parts {
        let mechanics::mesh::Topology::Explicit { hexahedra } = &mut part.topology else {
            panic!("explicit")
        };
        let whole = std::mem::take(hexahedra);
        hexahedra.extend(whole.iter().flat_map(|corners| cut.iter().map(|piece| piece.map(|c| corners[c]))));
        part.element_ids = (next..next + hexahedra.len() as u32).collect();
        next += hexahedra.len() as u32;
    }
}

#[test]
fn wedges_and_tetrahedra_have_the_same_bits_and_keep_their_energy() {
    let whole = keyword("block-on-plate");
    let solved = solve(whole.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}"));
    let of_block = |solved: &tests::solve::Solved| {
        let row = solved.rows.last().expect("rows");
        assert!(row.error.abs() < 2e-3, "{}", row.error);
        row.parts[0].kinetic
    };
    let reference = of_block(&solved);
    let wedges = [[1, 0, 4, 5, 2, 2, 6, 6], [2, 0, 4, 6, 3, 3, 7, 7]];
    let around = [[1, 2], [2, 3], [3, 7], [7, 4], [4, 5], [5, 1]];
    let tetrahedra = around.map(|[a, b]| [0, a, b, b, 6, 6, 6, 6]);
    // Tetrahedra of one point are far too stiff in plastic flow; they only have to be sound.
    for (cut, apart) in [(&wedges[..], 0.1), (&tetrahedra[..], f64::INFINITY)] {
        let mut model = whole.clone();
        cut_up(&mut model, cut);
        let kinetic = of_block(&solve(model.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}")));
        assert!((kinetic / reference - 1.0).abs() < apart, "{kinetic} of {reference}");
        model.setup.control.end_cycle = 150;
        same_bits(&model);
    }
}

#[test]
fn nodes_that_a_wall_names_have_the_same_bits_and_the_others_pass() {
    let mut model = keyword("bar-on-wall");
    model.velocity.iter_mut().for_each(|v| v[2] = -190e3);
    model.setup.control.end_cycle = 100;
    let whole = fingerprint(&model, Workers::default());
    let at_foot = |x: &[f64; 3]| x[2] < 1e-9 && x[0] < 1.5;
    // The wall by nodes of its own instead of by parts.
    model.setup.walls[0].parts.fill(false);
    let touching: Vec<usize> =
        (0..model.mesh.n_nodes()).filter(|n| at_foot(&model.mesh.positions[*n])).collect();
    assert_eq!(touching.len(), 8);
    for node in touching {
        let free = model.setup.constraints[usize::from(model.constraint[node])];
        model.constraint[node] = model.setup.constraints.len() as u16;
        model.setup.constraints.push(mechanics::constraint::Constraint { walls: 1, ..free });
    }
    same_bits(&model);
    let solved = solve(model.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}"));
    assert_ne!(Fingerprint::of(&solved).digest, whole.digest);
    let lowest = |named: bool| {
        let nodes = (0..model.mesh.n_nodes()).filter(|n| at_foot(&model.mesh.positions[*n]) == named);
        nodes.map(|n| solved.state.x[n][2]).fold(f64::INFINITY, f64::min)
    };
    assert!(lowest(true) > -1e-12 && lowest(false) < -0.1, "{} {}", lowest(true), lowest(false));
}

#[test]
fn a_keyword_deck_of_a_ball_on_a_shell_has_the_same_bits() {
    let mut model = keyword("ball-on-shell");
    model.setup.control.end_cycle = 300;
    model.output.history_cycles = 1;
    same_bits(&model);
}

#[test]
fn rigid_bodies_have_the_same_bits_on_both_routes() {
    let model = model(
        r#"
        title = "rigid bodies"
        units = "cm-g-us"
        [control]
        end_cycle = 300
        end_time = 1e3
        [[curve]]
        name = "pulse"
        points = [[0, 0], [5, 1], [30, 0.5]]
        [[part]]
        name = "target"
        material = "AL_2024_T351"
        box = { origin = [0, 0, 0], size = [9, 8, 4], cells = [9, 8, 4] }
        [[part]]
        name = "under"
        material = "STEEL_1006"
        box = { origin = [0, 0, -2], size = [9, 8, 2], cells = [9, 8, 2] }
        [[part]]
        name = "ball"
        material = "STEEL_1006"
        velocity = [0.02, 0.01, -0.05]
        sphere = { centre = [3, 4, 6.2], radius = 2, cells = [3, 3] }
        [[part]]
        name = "punch"
        material = "STEEL_1006"
        box = { origin = [6.2, 2, 4.2], size = [2, 3, 2], cells = [2, 3, 2] }
        [[part]]
        name = "handle"
        material = "STEEL_1006"
        box = { origin = [6.2, 2, 6.2], size = [2, 3, 2], cells = [2, 3, 2] }
        [[join]]
        parts = ["target", "under"]
        [[join]]
        parts = ["punch", "handle"]
        [[rigid]]
        parts = ["under"]
        mass = 2000
        [[rigid]]
        parts = ["ball"]
        start_spin = [0.01, 0, 0.03]
        [[rigid]]
        parts = ["handle", "punch"]
        velocity = { x = 0, y = 0, z = { curve = "pulse", factor = -0.03 } }
        spin = { x = 0, y = { curve = "pulse", factor = 1e-3 } }
        [contact]
        gap_length = 0.15
        friction = 0.1
        [[load]]
        type = "pressure"
        parts = ["under"]
        face = "k-min"
        pressure = { curve = "pulse", factor = 2e-3 }
        [[load]]
        type = "force"
        parts = ["under"]
        face = "i-min"
        force = [1e-4, 0, 2e-4]
        curve = "pulse"
        [gravity]
        acceleration = [0, 0, -1e-5]
        [relaxation]
        factor = 0.9999
        until = 40
        [output]
        history_cycles = 1
        [[gauge]]
        name = "ball"
        part = "ball"
        point = [3, 4, 8.2]
        "#,
    );
    same_bits(&model);
    let one = Fingerprint::of(&solve(model.clone(), Workers::default()).unwrap_or_else(|e| panic!("{e}")));
    same_bits_on_route_direct(&model, &one);
    let without = |change: &dyn Fn(&mut Model)| {
        let mut other = model.clone();
        change(&mut other);
        fingerprint(&other, Workers::default()).digest
    };
    for body in 0..2 {
        assert_ne!(without(&|m| m.setup.bodies[body].mass *= 1.001), one.digest, "mass of body {body}");
    }
    assert_ne!(without(&|m| m.setup.bodies[0].forces.clear()), one.digest);
    assert_ne!(without(&|m| m.setup.bodies[1].start.momentum[2] *= 1.001), one.digest);
    assert_ne!(without(&|m| m.setup.bodies[2].spin[1] = None), one.digest);
}

#[test]
fn another_problem_has_other_bits() {
    let mut model = example("two-bars");
    model.setup.control.end_cycle = 20;
    let one = fingerprint(&model, Workers::default());
    model.velocity[0][0] = f64::from_bits(model.velocity[0][0].to_bits() + 1);
    let other = fingerprint(&model, Workers::default());
    assert_ne!(one.digest, other.digest);
}
