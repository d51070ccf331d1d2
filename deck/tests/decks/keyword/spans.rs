//! Conditions of keyword decks that begin and end, turn on circles or along vectors, and belong to parts; masses and rigid bodies of nodes.

use deck::{Model, Reading};
use mechanics::load::Span;

/// Two cubes 1 apart, of part 1 (nodes 1 to 8) and of part 2 (nodes 11 to 18), and what is added to them.
fn cubes(more: &str) -> String {
    let corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]];
    let mut nodes = String::new();
    for (first, up) in [(1, 0), (11, 2)] {
        for (i, [x, y, z]) in corners.iter().enumerate() {
            nodes += &format!("{},{x},{y},{}\n", first + i, z + up);
        }
    }
    format!(
        "*KEYWORD\n*CONTROL_TERMINATION\n1e-6\n*PART\nlower\n1,1,1\nupper\n2,1,1\n*SECTION_SOLID\n1,1\n\
         *MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n*NODE\n{nodes}*ELEMENT_SOLID\n1,1,1,2,3,4,5,6,7,8\n\
         2,2,11,12,13,14,15,16,17,18\n{more}*END\n"
    )
}

fn read(more: &str) -> Reading {
    let text = cubes(more);
    let reading = deck::read_whole(&text, "a.k").unwrap_or_else(|faults| panic!("{faults:#?}\n{text}"));
    // What `convert` writes is the same problem.
    assert_eq!(format!("{:?}", super::converted(&text, "a.k")), format!("{:?}", reading.model), "{text}");
    reading
}

fn good(more: &str) -> Model {
    read(more).model
}

fn fault(more: &str) -> String {
    let faults = deck::read(&cubes(more), "a.k").expect_err("a fault");
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

fn warned(more: &str, words: &str) {
    let warnings = read(more).warnings;
    assert!(warnings.iter().any(|warning| warning.words.contains(words)), "{warnings:?}");
}

/// What acts on the node of that number.
fn held(model: &Model, id: u32) -> mechanics::constraint::Constraint {
    let node = model.mesh.node_ids.iter().position(|n| *n == id).expect("a node");
    model.setup.constraints[usize::from(model.constraint[node])]
}

const SPAN: Span = Span { from: 2e-7, until: 5e-7 };
const CURVE: &str = "*DEFINE_CURVE\n3\n0,1\n1,2\n";

#[test]
fn supports_have_a_birth_and_a_death() {
    let by_node = good("*BOUNDARY_SPC_NODE_BIRTH_DEATH\n1,0,1,0,1\n2e-7,5e-7\n2,0,1\n0,5e-7\n");
    let [x, y, z] = held(&by_node, 1).velocity;
    assert_eq!((x.expect("held").span, y, z.expect("held").span), (SPAN, None, SPAN));
    assert_eq!(held(&by_node, 2).velocity[0].expect("held").span, Span { from: 0.0, until: 5e-7 });
    let by_set = "*SET_NODE_LIST\n7\n3,4\n*BOUNDARY_SPC_SET_BIRTH_DEATH_ID\n1,one\n7,0,0,1\n2e-7,5e-7\n";
    assert_eq!(held(&good(by_set), 4).velocity[1].expect("held").span, SPAN);
    assert!(fault("*BOUNDARY_SPC_NODE_BIRTH_DEATH\n1,0,1\n5e-7,2e-7\n").contains("a death after the birth"));
    // A birth alone, and times of many digits, are names of sets that can be read again.
    let born = good("*BOUNDARY_SPC_NODE_BIRTH_DEATH\n1,0,1,1,1\n2e-7,\n2,0,1\n3e-7,1e20\n");
    assert_eq!(held(&born, 1).velocity[0].expect("held").span, Span { until: Span::ALWAYS.until, ..SPAN });
    assert_eq!(held(&born, 2).velocity[0].expect("held").span.from, 3e-7);
    let long =
        good("*BOUNDARY_SPC_NODE_BIRTH_DEATH\n1,0,1,1,1\n1.2345678901234567e-37,1.2345678901234567e14\n");
    assert_eq!(held(&long, 1).velocity[2].expect("held").span.until, 1.2345678901234567e14);
    let both = "*BOUNDARY_SPC_NODE\n1,0,1\n*BOUNDARY_SPC_NODE_BIRTH_DEATH\n1,0,1\n2e-7,5e-7\n";
    assert!(fault(both).contains("take the nodes out of one of the two"), "{}", fault(both));
}

#[test]
fn motions_have_a_birth_and_a_death_and_headings_of_their_own() {
    let motion = "*BOUNDARY_PRESCRIBED_MOTION_NODE_ID\n1,one\n1,3,0,3,2.0,0,5e-7,2e-7\n2,two\n2,9,0,3,4.0\n0.5,-0.5\n3,three\n3,1,0,3\n";
    let more = format!("{CURVE}{motion}");
    let model = good(&more);
    let drive = held(&model, 1).velocity[2].expect("moved");
    assert_eq!((drive.span, drive.factor), (SPAN, 2.0));
    let circle = held(&model, 2).circle.expect("on a circle");
    assert_eq!((circle.axis, circle.point, circle.rate.factor), (0, [0.0, 0.5, -0.5], 4.0));
    assert!(held(&model, 3).velocity[0].is_some(), "the card behind the offsets is a motion");
    warned(&more, "the curve is read at the time of the run");
    let ways = |dof: u32| good(&format!("{CURVE}*BOUNDARY_PRESCRIBED_MOTION_NODE\n1,{dof},0,3\n0.5,-0.5\n"));
    assert_eq!(held(&ways(10), 1).circle.map(|c| (c.axis, c.point)), Some((1, [-0.5, 0.0, 0.5])));
    assert_eq!(held(&ways(11), 1).circle.map(|c| (c.axis, c.point)), Some((2, [0.5, -0.5, 0.0])));
    assert!(
        fault(&format!("{CURVE}*BOUNDARY_PRESCRIBED_MOTION_NODE\n1,-9,0,3\n0,0\n"))
            .contains("9 to 11 on circles")
    );
}

#[test]
fn a_motion_goes_along_a_vector_that_is_an_axis() {
    let more = "*BOUNDARY_PRESCRIBED_MOTION_NODE\n1,4,0,3,2.0,8\n";
    let down = good(&format!("{CURVE}*DEFINE_VECTOR\n8,0,0,1,0,0,0\n{more}"));
    assert_eq!(held(&down, 1).velocity[2].expect("moved").factor, -2.0);
    assert!(
        fault(&format!("{CURVE}*DEFINE_VECTOR\n8,0,0,0,1,1,0\n{more}")).contains("a vector along x, y or z")
    );
    assert!(fault(&format!("{CURVE}{more}")).contains("the number of a *DEFINE_VECTOR"));
}

#[test]
fn a_nodal_rigid_body_is_of_the_nodes_of_its_set() {
    let set = "*SET_NODE_LIST\n7\n5,6,7,8,11,12,13,14\n";
    let model = good(&format!("{set}*CONSTRAINED_NODAL_RIGID_BODY_TITLE\nlink\n9,0,7\n"));
    let [body] = &model.setup.bodies[..] else { panic!("one body") };
    assert_eq!((body.parts.len(), body.nodes.len(), body.account), (0, 8, 0));
    assert!((body.mass / 7.85e-9 - 1.0).abs() < 1e-12, "half of each cube: {}", body.mass);
    let held = good(&format!(
        "{CURVE}{set}*CONSTRAINED_NODAL_RIGID_BODY_SPC\n9,0,7\n1,4,7\n*BOUNDARY_PRESCRIBED_MOTION_RIGID\n9,3,0,3,1,0,5e-7\n"
    ));
    let body = &held.setup.bodies[0];
    assert_eq!([0, 1].map(|a| body.velocity[a].map(|v| v.factor)), [Some(0.0); 2]);
    assert_eq!(body.velocity[2].expect("moved").span.until, 5e-7);
    assert!(body.spin.iter().all(Option::is_some));
    assert!(fault(&format!("{set}*CONSTRAINED_NODAL_RIGID_BODY\n9,0,7,0,0,1\n")).contains("DRFLAG"));
    assert!(
        fault("*SET_NODE_LIST\n7\n5\n*CONSTRAINED_NODAL_RIGID_BODY\n9,0,7\n").contains("two nodes at least")
    );
    // Two nodes are on a line: about it they get the inertia that they have across it.
    let two = good("*SET_NODE_LIST\n7\n5,11\n*CONSTRAINED_NODAL_RIGID_BODY\n9,0,7\n");
    let [xx, _, zz, ..] = two.setup.bodies[0].inertia;
    assert!((zz / xx - 1.0).abs() < 1e-12 && zz > 0.0, "{xx} {zz}");
}

#[test]
fn extra_nodes_go_with_a_rigid_part() {
    let more = "*DEFORMABLE_TO_RIGID\n1\n*SET_NODE_LIST\n7\n11,12\n*CONSTRAINED_EXTRA_NODES_SET\n1,7\n*CONSTRAINED_EXTRA_NODES_NODE\n1,13\n";
    let model = good(more);
    assert_eq!((model.setup.bodies[0].nodes.len(), &model.setup.bodies[0].parts[..]), (11, &[0][..]));
    // An eighth of the upper cube hangs on each.
    assert!((model.setup.bodies[0].mass / (7.85e-9 * 1.375) - 1.0).abs() < 1e-12);
    assert!(fault("*CONSTRAINED_EXTRA_NODES_NODE\n2,1\n").contains("a part of a rigid body"));
}

#[test]
fn masses_are_put_at_nodes() {
    let model = good(
        "*ELEMENT_MASS\n1,1,2e-9\n2,2,3e-9\n3,1,2e-9\n*SET_NODE_LIST\n7\n3,4\n*ELEMENT_MASS_NODE_SET\n4,7,8e-9\n",
    );
    let of = |id: u32| {
        let node = model.mesh.node_ids.iter().position(|n| *n == id).expect("a node") as u32;
        model.mesh.lumped.iter().find(|(n, _)| *n == node).map(|(_, mass)| *mass)
    };
    assert_eq!([1, 2, 3, 4, 5].map(of), [Some(4e-9), Some(3e-9), Some(4e-9), Some(4e-9), None]);
    assert!(fault("*NODE\n99,5,5,5\n*ELEMENT_MASS\n1,99,2e-9\n").contains("that no element has"));
    assert!(fault("*ELEMENT_MASS\n1,1,0.0\n").contains("a mass above 0"));
}

#[test]
fn gravity_of_parts_is_that_of_all_where_all_have_it() {
    let all = good(&format!("{CURVE}*LOAD_GRAVITY_PART\n1,3,3,9810.0\n2,3,3,9810.0\n"));
    let gravity = all.setup.loads.gravity.expect("of all");
    assert_eq!((gravity.acceleration, gravity.drive.curve), ([0.0, 0.0, -9810.0], Some(0)));
    let one = good("*LOAD_GRAVITY_PART\n2,1,0,5.0\n");
    let [force] = &one.setup.loads.forces[..] else { panic!("one load") };
    assert!(force.by_mass && force.force == [-5.0, 0.0, 0.0] && one.setup.loads.gravity.is_none());
    assert_eq!((held(&one, 11).forces, held(&one, 1).forces), (1, 0));
    assert!(fault("*LOAD_GRAVITY_PART\n2,1,0,5.0,0,1\n").contains("parts that are there from the start"));
}

#[test]
fn plain_contact_is_that_of_automatic_and_interior_contact_is_left_out_with_words() {
    let pairs = |word: &str| good(&format!("*CONTACT_{word}\n1,2,3,3\n\n\n")).setup.contact.expect("contact");
    for word in
        ["SURFACE_TO_SURFACE", "NODES_TO_SURFACE", "ONE_WAY_SURFACE_TO_SURFACE", "SURFACE_TO_SURFACE_ID\n1,c"]
    {
        assert_eq!(pairs(word), pairs("AUTOMATIC_SURFACE_TO_SURFACE"), "{word}");
    }
    warned("*CONTACT_SINGLE_SURFACE\n0\n\n\n", "as *CONTACT_AUTOMATIC_SINGLE_SURFACE");
    let interior = "*SET_PART_LIST\n7\n1\n*CONTACT_INTERIOR\n7\n";
    assert!(good(interior).setup.contact.is_none());
    warned(interior, "turns inside out stops with an error");
    assert!(fault("*CONTACT_DRAWBEAD\n1,2,3,3\n\n\n").contains("a contact of the table"));
}

/// The parts that are rigid for a time, and when.
fn switches(more: &str) -> Vec<(Vec<u32>, Span)> {
    good(more).setup.switches.into_iter().map(|switch| (switch.parts, switch.span)).collect()
}

#[test]
fn automatic_switches_make_parts_rigid_for_a_time() {
    let at = |time: &str, counts: &str, parts: &str| {
        format!("*DEFORMABLE_TO_RIGID_AUTOMATIC\n1,0,{time}\n0,0,0,0,{counts}\n{parts}")
    };
    let on = at("2e-7", "1,0", "1,0\n");
    let off = at("5e-7", "0,1", "1\n");
    assert_eq!(switches(&format!("{on}{off}")), [(vec![0], SPAN)]);
    // In whatever order the cards stand, and to the end of the run.
    assert_eq!(switches(&format!("{off}{on}")), [(vec![0], SPAN)]);
    let to_the_end = Span { from: 2e-7, ..Span::ALWAYS };
    assert_eq!(switches(&on), [(vec![0], to_the_end)]);
    // From the start, by the keyword for that.
    let first = "*DEFORMABLE_TO_RIGID\n1\n";
    let begun = Span { from: 0.0, until: 5e-7 };
    assert_eq!(switches(&format!("{first}{off}")), [(vec![0], begun)]);
    // Twice, and of a set.
    let again = at("7e-7", "1,0", "1\n");
    let later = Span { from: 7e-7, ..Span::ALWAYS };
    assert_eq!(switches(&format!("{on}{off}{again}")), [(vec![0], SPAN), (vec![0], later)]);
    let set = format!(
        "*SET_PART_LIST\n3\n1,2\n{}{}",
        at("2e-7", "1,0", "3,0,PSET\n"),
        at("5e-7", "0,1", "3,PSET\n")
    );
    assert_eq!(switches(&set), [(vec![0], SPAN), (vec![1], SPAN)]);
    // One body where a card joins them.
    let joined = format!("{}{}", at("2e-7", "2,0", "1,0\n2,1\n"), at("5e-7", "0,2", "1\n2\n"));
    assert_eq!(switches(&joined), [(vec![0, 1], SPAN)]);
    warned(&format!("{on}{on}"), "part 1 is rigid before already");
    // Rigid at no time.
    let never = good(&format!("{first}{}", at("0.0", "0,1", "1\n"))).setup;
    assert!(never.switches.is_empty() && never.bodies.is_empty());
}

#[test]
fn automatic_switches_that_cannot_be_honoured_are_refused() {
    let refused = [
        ("1,3,2e-7\n0,0,0,0,1,0\n1\n", "expected CODE 0: a switch at TIME1"),
        ("1,0,2e-7,0,0,0,2\n0,0,0,0,1,0\n1\n", "expected no related switch set"),
        ("1,0,2e-7\n0,0,1,0,1,0\n1\n", "expected 0: nodal rigid bodies"),
        ("1,0,2e-7\n0,0,0,0,2,0\n1\n", "expected the number of cards behind this one, 1"),
        ("1,0,2e-7\n0,0,0,0,1,0\n7\n", "read part 7"),
        ("1,0,2e-7\n0,0,0,0,1,0\n1,2\n", "read part 1, which joins part 2"),
        ("1,0,2e-7\n0,0,0,0,1,0\n1,0,SHELL\n", "expected PTYPE PART or PSET"),
        ("1,0,-2e-7\n0,0,0,0,1,0\n1\n", "read -2e-7"),
    ];
    for (cards, words) in refused {
        let said = fault(&format!("*DEFORMABLE_TO_RIGID_AUTOMATIC\n{cards}"));
        assert!(said.contains(words), "{cards}: {said}");
    }
    let rigid = "*MAT_RIGID\n2,7.85e-9,2.1e5,0.3\n1,0,0\n*PART\nthird\n3,1,2\n*ELEMENT_SOLID\n3,3,5,6,7,8,11,12,13,14\n";
    let said = fault(&format!("{rigid}*DEFORMABLE_TO_RIGID_AUTOMATIC\n1,0,2e-7\n0,0,0,0,1,0\n3\n"));
    assert!(said.contains("read part 3 of *MAT_RIGID"), "{said}");
}
