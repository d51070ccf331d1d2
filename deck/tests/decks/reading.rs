//! What a deck's tables become in the Model.

use deck::Model;
use mechanics::{
    burn::Detonation,
    constraint::Constraint,
    element::hourglass::Hourglass,
    load::{Drive, Gravity, NodalForce, Relaxation, SurfaceKind},
    material::{CowperSymonds, Eos, Failure, Strength},
    mesh::{FACES, Topology},
    wall::{Motion, Shape},
};

const HEAD: &str = "title = \"t\"\nunits = \"SI\"\n[control]\nend_time = 1.0\n";

fn read(tables: &str) -> Model {
    deck::read(&format!("{HEAD}{tables}"), "t.toml").unwrap_or_else(|faults| {
        let lines: Vec<String> = faults.iter().map(ToString::to_string).collect();
        panic!("{}", lines.join("\n"))
    })
}

fn cube(name: &str, at: [f64; 3], more: &str) -> String {
    format!(
        "[[part]]\nname = \"{name}\"\nmaterial = \"LEAD\"\n{more}\n\
         box = {{ origin = {at:?}, size = [1, 1, 1], cells = [2, 2, 2] }}\n"
    )
}

fn good(name: &str) -> Model {
    let path = format!("{}/../tests/decks/good/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).expect("the deck is in the repository");
    deck::read(&text, name).expect("a good deck")
}

#[test]
fn defaults_are_those_of_the_reference() {
    let control = read(&cube("a", [0.0; 3], "")).setup.control;
    assert_eq!(control.end_cycle, u64::MAX);
    assert_eq!((control.sort_lag, control.plan_interval), (8, 50));
    let numbers =
        [control.safety_factor, control.growth, control.linear_viscosity, control.quadratic_viscosity];
    assert_eq!(numbers.map(f64::to_bits), [0.6666f64, 1.05, 0.2, 1.0].map(f64::to_bits));
}

#[test]
fn hourglass_control_is_that_of_the_part_or_of_the_deck_and_viscous_on_fluids() {
    let water = cube("water", [3.0, 0.0, 0.0], "").replace("LEAD", "WATER");
    let parts = cube("own", [0.0; 3], "hourglass = { kind = \"assumed-strain\", coefficient = 0.5 }")
        + &cube("of the deck", [1.5, 0.0, 0.0], "")
        + &water;
    let controls = |of_deck: &str| {
        let text = format!("{HEAD}{of_deck}\n{parts}");
        let model = deck::read(&text, "t.toml").unwrap_or_else(|faults| panic!("{}", faults[0]));
        let words = |h: &Hourglass| format!("{} {}", h.kind.name(), h.coefficient);
        model.mesh.parts.iter().map(|part| words(&part.hourglass)).collect::<Vec<_>>().join(", ")
    };
    assert_eq!(
        controls("hourglass = { kind = \"stiffness\" }"),
        "assumed-strain 0.5, stiffness 0.05, viscous 0.1"
    );
    assert_eq!(controls(""), "assumed-strain 0.5, assumed-strain 1, viscous 0.1");
    assert_eq!(controls("hourglass = 0.03"), "assumed-strain 0.5, viscous 0.03, viscous 0.03");
    let fault = |tables: &str| {
        let faults = deck::read(&format!("{HEAD}{tables}"), "t.toml").expect_err("a fault");
        faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
    };
    let water = water.replace("cells", "cells ").replace("box", "hourglass = { kind = \"stiffness\" }\nbox");
    assert!(fault(&water).contains("expected viscous control, or a material with shear stiffness"));
    for (words, expected) in [
        ("{ coefficient = 0.1 }", "expected viscous, stiffness or assumed-strain; add kind = ..."),
        ("{ kind = \"asumed-strain\" }", "write \"assumed-strain\""),
        ("{ kind = \"stiffness\", coefficient = 1.5 }", "expected a number above 0 and at most 1"),
        ("{ kind = \"viscous\", coeficient = 1.5 }", "write \"coefficient\""),
        ("-0.1", "expected a number of 0 or more"),
    ] {
        let faults = fault(&cube("a", [0.0; 3], &format!("hourglass = {words}")));
        assert!(faults.contains(expected), "{words}: {faults}");
    }
    let plate = "[[part]]\nname = \"p\"\nmaterial = \"LEAD\"\nshell = { thickness = 0.1 }\nhourglass = 0.1\n\
                 plate = { origin = [0, 0, 0], side_i = [1, 0, 0], side_j = [0, 1, 0], cells = [2, 2] }\n";
    assert!(fault(plate).contains("expected solids: hourglass control of shells is not chosen"));
}

#[test]
fn merged_nodes_keep_the_lowest_index_and_the_others_close_up() {
    let parts = cube("a", [0.0; 3], "") + &cube("b", [1.0, 0.0, 0.0], "");
    let apart = read(&parts);
    let joined = read(&(parts.clone() + "[[join]]\nparts = [\"b\", \"a\"]\n"));
    assert_eq!((apart.mesh.n_nodes(), joined.mesh.n_nodes()), (54, 45));
    assert_eq!(joined.mesh.parts[0].nodes, (0..27).collect::<Vec<u32>>());
    // The i-min nodes of b are the i-max nodes of a; the rest of b follows in order.
    let mut expected = Vec::new();
    let mut next = 27;
    for row in 0..9 {
        expected.push(2 + 3 * row);
        expected.extend([next, next + 1]);
        next += 2;
    }
    assert_eq!(joined.mesh.parts[1].nodes, expected);
    // Numbers do not change with the join.
    assert_eq!(joined.mesh.node_ids[..28], [&(1..=27).collect::<Vec<u32>>()[..], &[29]].concat());
    assert_eq!(apart.mesh.parts[1].element_ids, joined.mesh.parts[1].element_ids);
}

#[test]
fn four_cubes_round_an_edge_share_its_nodes_whatever_the_order_of_joins() {
    let mut parts = String::new();
    for (n, (x, y)) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)].into_iter().enumerate() {
        parts += &cube(&format!("c{n}"), [x, y, 0.0], &format!("velocity = [{n}, 0, 0]"));
    }
    let all = read(&(parts.clone() + "[[join]]\nparts = \"all\"\n"));
    assert_eq!(all.mesh.n_nodes(), 5 * 5 * 3);
    let pairs = ["c3\", \"c2", "c1\", \"c3", "c0\", \"c1"];
    let joins: String = pairs.iter().map(|p| format!("[[join]]\nparts = [\"{p}\"]\n")).collect();
    let chain = read(&(parts + &joins));
    // c0 and c2 are not joined, so the face between them stays open but for the shared edge.
    assert_eq!(chain.mesh.n_nodes(), 5 * 5 * 3 + 2 * 3);
    let edge = all.mesh.positions.iter().position(|p| *p == [1.0, 1.0, 0.0]).expect("the edge is there");
    assert!((all.velocity[edge][0] - 1.5).abs() < 1e-15);
}

#[test]
fn join_energy_is_the_loss_of_kinetic_energy() {
    let parts = cube("a", [0.0; 3], "velocity = [0, 3, 4]") + &cube("b", [1.0, 0.0, 0.0], "");
    let model = read(&(parts + "[[join]]\nparts = \"all\"\n"));
    // Half of each cube's mass on the interface is a quarter: of 11340 kg, 2835 kg on either side.
    let reduced = 2835.0 / 2.0;
    assert!((model.join_energy / (0.5 * reduced * 25.0) - 1.0).abs() < 1e-12);
    let same = cube("a", [0.0; 3], "velocity = [0, 3, 4]")
        + &cube("b", [1.0, 0.0, 0.0], "velocity = [0, 3, 4]")
        + "[[join]]\nparts = \"all\"\n";
    let model = read(&same);
    assert_eq!(model.join_energy.to_bits(), 0);
    assert!(model.velocity.iter().all(|v| v.map(f64::to_bits) == [0.0f64, 3.0, 4.0].map(f64::to_bits)));
}

#[test]
fn contact_matrices_are_symmetric_and_follow_the_pairs() {
    let contact = good("join").setup.contact.expect("the deck has contact");
    // a, b, c: self-interaction of all but c, a and c off.
    assert_eq!(contact.interacts, [true, true, false, true, true, true, false, true, false]);
    let friction = [0.2, 0.2, 0.2, 0.2, 0.2, 0.05, 0.2, 0.05, 0.2];
    assert_eq!(contact.friction, friction);
    assert_eq!([contact.gap, contact.slack, contact.stiffness], [0.1, 0.2, 0.4]);
}

#[test]
fn the_slack_makes_the_reach_a_face_within_two_and_a_half_and_eight_gaps() {
    // Faces of half a metre.
    let slack = |keys: &str| {
        let model = read(&(cube("a", [0.0; 3], "") + &cube("b", [2.0, 0.0, 0.0], "") + "[contact]\n" + keys));
        model.setup.contact.expect("the deck has contact").slack
    };
    for (keys, wanted) in [
        ("", 0.4),
        ("gap_fraction = 0.15\n", 0.35),
        ("gap_fraction = 0.4\n", 0.5),
        ("gap_fraction = 0.4\nslack_gaps = 2\n", 0.4),
    ] {
        assert!((slack(keys) - wanted).abs() < 1e-12, "{keys}: {}", slack(keys));
    }
}

#[test]
fn boundaries_merge_by_node_and_set_the_initial_velocity() {
    let model = good("boundaries");
    let at = |p: [f64; 3]| {
        let node = model.mesh.positions.iter().position(|x| *x == p).expect("a node of the mesh");
        let velocity = model.setup.constraints[usize::from(model.constraint[node])].velocity;
        assert!(velocity.iter().flatten().all(|drive| drive.curve.is_none()));
        (velocity.map(|drive| drive.map(|drive| drive.factor)), model.velocity[node])
    };
    assert_eq!(at([2.0, 2.0, 2.0]).0, [None; 3]);
    assert_eq!(at([2.0, 2.0, 0.0]).0, [Some(0.0); 3]);
    assert_eq!(at([0.0, 2.0, 2.0]).0, [Some(0.0), None, Some(0.0)]);
    assert_eq!(at([2.0, 0.0, 2.0]).0, [None, Some(0.0), None]);
    assert_eq!(at([4.0, 4.0, 4.0]), ([Some(2.5), None, Some(0.0)], [2.5, 0.0, 0.0]));
    let wall = &model.setup.walls[0];
    assert_eq!(wall.shape, Shape::Plane { point: [0.0, 0.0, -1.0], normal: [0.0, 0.0, 1.0] });
    assert_eq!(wall.motion, Motion::Fixed);
    assert_eq!(model.setup.constraints[0].velocity, [None; 3]);
}

#[test]
fn loads_curves_and_walls_are_as_the_deck_says() {
    let model = good("loads");
    let loads = &model.setup.loads;
    let ramp = |factor| Drive::along(1, factor);
    assert_eq!(loads.curves[0].points, [[0.0, 0.0]]);
    assert_eq!(loads.curves[1].points, [[0.0, 3.0], [1e-3, 1.0]]);
    assert_eq!(loads.forces, [NodalForce { force: [1.0, 2.0, 3.0], by_mass: false, drive: ramp(1.0) }]);
    assert_eq!(loads.gravity, Some(Gravity { acceleration: [0.0, 0.0, -9.81], drive: Drive::constant(1.0) }));
    assert_eq!(loads.relaxation, Some(Relaxation { factor: 0.99, rate: 0.0, until: 5e-4 }));
    // Faces of a grid of 4 x 4 x 4: sides are those of the mechanics, so that 1 is k-max and 3 is i-max.
    let side = |corners: [usize; 4]| FACES.iter().position(|face| *face == corners).expect("a face") as u8;
    assert_eq!((side([4, 5, 6, 7]), side([1, 2, 6, 5])), (1, 3));
    let [pressure, transmit] = &loads.surfaces[..] else { panic!("{:?}", loads.surfaces) };
    assert_eq!(pressure.kind, SurfaceKind::Pressure(ramp(-2.0)));
    assert_eq!(pressure.faces, (48..64).map(|e| (e, 1)).collect::<Vec<_>>());
    assert_eq!(transmit.kind, SurfaceKind::Transmit);
    assert_eq!(transmit.faces, (0..16).map(|e| (4 * e + 3, 3)).collect::<Vec<_>>());
    // Nodes 1 and 125 have the force, the first a velocity that starts at twice the first value of the curve.
    let of = |node: usize| model.setup.constraints[usize::from(model.constraint[node])];
    assert_eq!(
        of(0),
        Constraint {
            velocity: [Some(ramp(2.0)), None, None],
            forces: 1,
            supports: [2, 0, 0],
            ..Constraint::default()
        }
    );
    assert_eq!(of(124), Constraint { forces: 1, ..Constraint::default() });
    assert_eq!((model.velocity[0], model.velocity[124]), ([6.0, 0.0, 0.0], [0.0; 3]));
    let walls: Vec<_> =
        model.setup.walls.iter().map(|wall| (wall.shape, wall.motion, wall.friction)).collect();
    let axis = [0.0, 1.0, 0.0];
    let zero = Drive::constant(0.0);
    assert_eq!(
        walls,
        [
            (
                Shape::Cylinder { point: [2.0, 0.0, 6.0], axis, radius: 1.5 },
                Motion::Driven([zero, zero, ramp(-1.0)]),
                0.0
            ),
            (
                Shape::Sphere { centre: [2.0, 2.0, -3.0], radius: 2.0 },
                Motion::Free { mass: 5.0, velocity: [0.0, 0.0, 10.0] },
                0.1
            ),
        ]
    );
}

#[test]
fn library_values_come_in_the_units_of_the_deck() {
    let deck = "title = \"t\"\nunits = \"cm-g-us\"\n[control]\nend_cycle = 1\n".to_string()
        + &cube("a", [0.0; 3], "").replace("LEAD", "STEEL_1006");
    let model = deck::read(&deck, "t.toml").expect("a good deck");
    let steel = &model.setup.materials[0];
    assert_eq!(steel.density.to_bits(), 7.896f64.to_bits());
    let Strength::JohnsonCook { shear, a, specific_heat, rate0, t_melt, .. } = steel.strength else {
        panic!("{steel:?}")
    };
    let read = [shear, a, specific_heat, rate0, t_melt];
    let expected = [0.818, 0.0035, 452e-8, 1e-6, 1811.0];
    assert!(read.iter().zip(expected).all(|(r, e)| (r / e - 1.0).abs() < 1e-15), "{read:?}");
}

#[test]
fn laws_come_in_the_units_of_the_deck_and_fracture_only_where_a_part_asks() {
    let model = good("laws");
    let [tnt, water, air, pipe, pane, tube, whole, breaking, tile] = &model.setup.materials[..] else {
        panic!("{:?}", model.setup.materials)
    };
    let near = |x: f64, y: f64| assert!((x / y - 1.0).abs() < 1e-14, "{x} {y}");
    let Eos::Jwl { a, energy, detonation, .. } = tnt.eos else { panic!("{tnt:?}") };
    near(a, 371.2);
    near(energy, 7.0);
    near(detonation, 6930.0);
    assert_eq!(water.failure, Failure::Hydrostatic { tension: 1e-4, heals: true });
    let Eos::IdealGas { energy, .. } = air.eos else { panic!("{air:?}") };
    near(energy, 206_800.0);
    let Eos::Polynomial { a1, t1, t2, .. } = pipe.eos else { panic!("{pipe:?}") };
    assert_eq!([a1, t1, t2], [164.0, 164.0, 0.0]);
    let Strength::Tabulated { hardening, rate, .. } = pipe.strength else { panic!("{pipe:?}") };
    assert_eq!((hardening.n_points, hardening.stress[2], hardening.strain[1]), (3, 0.5, 0.02));
    assert_eq!(rate, Some(CowperSymonds { reference: 0.0404, exponent: 5.0 }));
    assert_eq!(pane.failure, Failure::PrincipalStress { tension: 0.1 });
    let voce = vec![("shear", 26.0), ("yield_stress", 0.2), ("q", 0.15), ("b", 20.0)];
    assert_eq!(tube.strength.declared(), Some(("voce", voce)));
    let Some(("johnson-holmquist", tile)) = tile.strength.declared() else { panic!("{tile:?}") };
    let tile = |key: &str| tile.iter().find(|(name, _)| *name == key).expect("a constant of that name").1;
    near(tile("shear"), 197.0);
    near(tile("hel_stress"), 15.435);
    near(tile("rate0"), 0.001);
    assert_eq!(tile("d1"), 0.001);
    assert_eq!(whole.failure, Failure::None);
    assert_eq!(breaking.failure, Failure::JohnsonCook { d: [0.05, 3.44, -2.12, 0.002, 0.61] });
    assert_eq!(model.setup.detonations, [Detonation { point: [5.0, 5.0, 0.0], time: 0.001 }]);
}

#[test]
fn parts_of_one_material_share_its_entry() {
    let own = "[[material]]\nname = \"own\"\ndensity = 1\neos = { type = \"linear\", bulk = 1 }\n";
    let parts = cube("a", [0.0; 3], "")
        + &cube("b", [2.0, 0.0, 0.0], "").replace("LEAD", "own")
        + &cube("c", [4.0, 0.0, 0.0], "");
    let model = read(&(own.to_string() + &parts));
    assert_eq!(model.setup.materials.len(), 2);
    assert_eq!(model.mesh.parts.iter().map(|p| p.material).collect::<Vec<_>>(), [0, 1, 0]);
    assert_eq!(model.setup.materials[1].strength, Strength::Hydro);
}

#[test]
fn blocks_are_numbered_above_the_numbers_that_the_deck_gives() {
    let model = good("blocks");
    let explicit = model.mesh.parts.last().expect("the deck has parts");
    assert_eq!(explicit.element_ids, [100]);
    let first = &model.mesh.parts[0];
    assert_eq!((first.element_ids[0], model.mesh.node_ids[0]), (101, 9));
    assert!(matches!(first.topology, Topology::Structured { cells: [4, 3, 2] }));
    let mut ids = model.mesh.node_ids.clone();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), model.mesh.n_nodes());
    let gauge = model.output.gauges[0].node as usize;
    assert_eq!(model.mesh.positions[gauge], [81.0, 1.0, 1.0]);
}

#[test]
fn the_same_text_gives_the_same_bits() {
    let text = std::fs::read_to_string(format!("{}/examples/self-contact.toml", env!("CARGO_MANIFEST_DIR")))
        .expect("the example is in the repository");
    let (a, b) = (deck::read(&text, "a").expect("good"), deck::read(&text, "b").expect("good"));
    let bits = |m: &Model| m.mesh.positions.iter().flatten().map(|x| x.to_bits()).collect::<Vec<u64>>();
    assert_eq!(bits(&a), bits(&b));
    assert_eq!(a, b);
}

#[test]
fn solids_have_one_point_or_eight_and_eight_only_where_the_material_can() {
    use mechanics::mesh::Topology;
    let eight = read(&cube("eight", [0.0; 3], "points = 8"));
    assert!(matches!(eight.mesh.parts[0].topology, Topology::EightPoint { .. }));
    let one = read(&cube("one", [0.0; 3], "points = 1"));
    assert!(matches!(one.mesh.parts[0].topology, Topology::Structured { .. }));
    let fault = |tables: &str| {
        let faults = deck::read(&format!("{HEAD}{tables}"), "t.toml").expect_err("a fault");
        faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
    };
    for (words, expected) in
        [("points = 4", "expected 1 or 8"), ("points = 8\nhourglass = 0.1", "expected solids of one point")]
    {
        let faults = fault(&cube("a", [0.0; 3], words));
        assert!(faults.contains(expected), "{words}: {faults}");
    }
    let water = cube("water", [0.0; 3], "points = 8").replace("LEAD", "WATER");
    assert!(fault(&water).contains("expected a material with shear stiffness"));
}

#[test]
fn a_section_lists_elements_that_are_there_and_have_some_of_its_nodes() {
    let part = cube("a", [0.0; 3], "");
    let fault = |section: &str| {
        let tables = format!("{part}\n[[section]]\nname = \"s\"\n{section}\n");
        let faults = deck::read(&format!("{HEAD}{tables}"), "t.toml").expect_err("a fault");
        faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
    };
    for (section, expected) in [
        ("nodes = [1]\nsolids = [77]", "expected the number of a solid"),
        ("nodes = [1]\nshells = [1]", "expected the number of a shell"),
        ("nodes = [999]\nsolids = [1]", "expected the number of a node"),
        ("nodes = [1]", "that cuts nothing"),
        ("nodes = \"weld\"\nsolids = [1]", "expected the name of a set of a mesh file"),
    ] {
        let faults = fault(section);
        assert!(faults.contains(expected), "{section}: {faults}");
    }
}
