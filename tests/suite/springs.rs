//! Springs, dampers and cables that hold bodies: the same bits on any workers, and what a spring gives to a rigid body.

use deck::Model;
use tests::solve::{Workers, model, run};

use crate::bits::{losing_a_worker_changes_no_bit, same_bits, same_bits_on_route_direct};

/// A block of copper that falls on springs, dampers and cables of every law; the springs end in nodes with masses of their own.
fn suspended() -> Model {
    let feet = |first: u32, z: f64| {
        let foot = |i: u32| {
            let [x, y] = [0.04 * f64::from(i % 2), 0.04 * f64::from(i / 2)];
            let [far_x, far_y] = [x, y].map(|x| 1.5 * x - 0.01);
            format!("[{}, {x}, {y}, 0.02], [{}, {far_x}, {far_y}, {z}]", first + 2 * i, first + 2 * i + 1)
        };
        let element = |i: u32| format!("[{}, {}, {}]", first + i, first + 2 * i, first + 2 * i + 1);
        format!(
            "mesh = {{ nodes = [{}], elements = [{}] }}",
            (0..4).map(foot).collect::<Vec<_>>().join(", "),
            (0..4).map(element).collect::<Vec<_>>().join(", ")
        )
    };
    let part = |name: &str, first: u32, law: &str, z: f64| {
        format!("[[part]]\nname = \"{name}\"\n{law}\n{}\n", feet(first, z))
    };
    let parts = [
        part(
            "yielding",
            1001,
            "spring = { stiffness = 5e6, tangent = 5e5, yield_force = 20, damping = 30, offset = 1e-6 }",
            0.06,
        ),
        part(
            "curved",
            1011,
            "spring = { points = [[-1, -1e6], [0, 0], [1, 3e6]], damper_points = [[-1, -5], [0, 0], [1, 50]] }",
            0.07,
        ),
        part("ropes", 1021, "material = \"STEEL_1006\"\ncable = { area = 1e-5, tension = 100 }", 0.08),
    ];
    model(&format!(
        "title = \"a block on springs\"\nunits = \"SI\"\n[control]\nend_cycle = 80\nend_time = 1\nplan_interval = 20\n\
         [output]\nhistory_cycles = 10\n\
         [[part]]\nname = \"block\"\nmaterial = \"CU_OFHC\"\nvelocity = [0, 0, -40]\n\
         box = {{ origin = [0, 0, 0], size = [0.04, 0.04, 0.02], cells = [4, 4, 2] }}\n{}\
         [[join]]\nparts = [\"block\", \"yielding\", \"curved\", \"ropes\"]\n\
         [[mass]]\nbox = {{ min = [-1, -1, 0.05], max = [1, 1, 0.075] }}\nmass = 0.2\n\
         [[boundary]]\ntype = \"fixed\"\nbox = {{ min = [-1, -1, 0.05], max = [1, 1, 0.09] }}\n",
        parts.concat()
    ))
}

#[test]
fn a_block_on_springs_and_cables_has_the_same_bits_on_any_workers() {
    let model = suspended();
    same_bits(&model);
    let one = crate::bits::fingerprint(&model, Workers::default());
    same_bits_on_route_direct(&model, &one);
    losing_a_worker_changes_no_bit(&model);
    let solved = run(model);
    let row = solved.rows.last().expect("rows");
    assert!(row.error.abs() < 5e-3, "{}", row.error);
    // Each kind takes its part.
    assert!(row.parts[1..].iter().all(|part| part.internal > 0.0), "{:?}", row.parts);
}

#[test]
fn a_spring_between_rigid_bodies_swings_them_by_their_masses() {
    let solved = run(model(
        "title = \"rigid bodies on a spring\"\nunits = \"SI\"\n[control]\nend_time = 0.05\nsafety_factor = 0.1\n\
         [output]\nhistory_cycles = 1\n\
         [[part]]\nname = \"light\"\nmaterial = \"CU_OFHC\"\nvelocity = [-1, 0, 0]\n\
         box = { origin = [-0.1, -0.05, -0.05], size = [0.1, 0.1, 0.1], cells = [2, 2, 2] }\n\
         [[part]]\nname = \"heavy\"\nmaterial = \"CU_OFHC\"\n\
         box = { origin = [0.2, -0.05, -0.05], size = [0.2, 0.1, 0.1], cells = [2, 2, 2] }\n\
         [[part]]\nname = \"spring\"\nspring = { stiffness = 1e6 }\n\
         mesh = { nodes = [[9001, 0, 0, 0], [9002, 0.2, 0, 0]], elements = [[9001, 9001, 9002]] }\n\
         [[join]]\nparts = [\"light\", \"heavy\", \"spring\"]\n\
         [[rigid]]\nparts = [\"light\"]\n[[rigid]]\nparts = [\"heavy\"]\n\
         [[gauge]]\nname = \"end\"\nnode = 9001\n[[gauge]]\nname = \"other\"\nnode = 9002\n",
    ));
    let mass = 8960.0 * 1e-3;
    let frequency = (1e6_f64 / mass * 1.5).sqrt();
    let stretch = |row: &master::results::history::HistoryRow| row.gauges[1].x[0] - row.gauges[0].x[0] - 0.2;
    let most = solved.rows.iter().map(stretch).fold(0.0, f64::max);
    // The velocity at which they part over the frequency at which they swing.
    assert!((most * frequency - 1.0).abs() < 2e-3, "{most} at {frequency}");
    let error = solved.rows.iter().map(|row| row.error.abs()).fold(0.0, f64::max);
    assert!(error < 2e-3, "{error}");
}

#[test]
fn a_damper_at_rest_is_drawn_by_a_force_at_the_speed_that_it_allows() {
    let solved = run(model(
        "title = \"a damper at rest\"\nunits = \"SI\"\n[control]\nend_time = 1\n[output]\nhistory_cycles = 1\n\
         [[part]]\nname = \"damper\"\nspring = { damper_points = [[-1, -20], [0, 0], [1, 20]] }\n\
         mesh = { nodes = [[1, 0, 0, 0], [2, 1, 0, 0]], elements = [[1, 1, 2]] }\n\
         [[mass]]\nnodes = [1, 2]\nmass = 0.5\n[[boundary]]\ntype = \"fixed\"\nnodes = [1]\n\
         [[load]]\ntype = \"force\"\nnodes = [2]\nforce = [6, 0, 0]\n[[gauge]]\nname = \"end\"\nnode = 2\n",
    ));
    let speed = solved.rows.last().expect("rows").gauges[0].v[0];
    assert!((speed / 0.3 - 1.0).abs() < 1e-6, "{speed}");
}
