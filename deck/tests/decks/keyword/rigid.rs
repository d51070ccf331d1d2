//! Rigid bodies in keyword decks: which parts are one body, how it begins, what holds and moves it, and what is refused.

use std::fs;

use deck::{
    Fault, Model, Reading,
    bundle::{self, Options},
};

fn lines(faults: &[Fault]) -> String {
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// Three shells of 10 by 10 in a row, of parts 1 to 3 that share nodes, and a cube of 10 above them, part 4; parts 1 and
/// 4 are rigid, 2 is elastic, and 3 what `third` says. The cards of the conditions begin at line 41.
fn deck_of(third: &str, more: &str) -> String {
    let mut nodes = String::new();
    for i in 0..4 {
        nodes += &format!("{},{},0,0\n{},{},10,0\n", 2 * i + 1, 10 * i, 2 * i + 2, 10 * i);
    }
    for k in 0..2 {
        for (n, [x, y]) in [[0, 0], [10, 0], [10, 10], [0, 10]].into_iter().enumerate() {
            nodes += &format!("{},{x},{y},{}\n", 11 + 4 * k + n, 20 + 10 * k);
        }
    }
    let parts: String = [("root", 1, 1), ("strip", 1, 2), ("tip", 1, 3), ("ram", 2, 1)]
        .into_iter()
        .zip(1..)
        .map(|((name, section, material), id)| format!("{name}\n{id},{section},{material}\n"))
        .collect();
    format!(
        "*KEYWORD\n*CONTROL_TERMINATION\n1e-6\n*PART\n{parts}*SECTION_SHELL\n1,2\n2,2,2,2\n*SECTION_SOLID\n2,1\n\
         *MAT_RIGID\n1,7.85e-9,2.1e5,0.3\n1,0,5\n*MAT_ELASTIC\n2,7.85e-9,2.1e5,0.3\n{third}\n*NODE\n{nodes}\
         *ELEMENT_SHELL\n1,1,1,3,4,2\n2,2,3,5,6,4\n3,3,5,7,8,6\n*ELEMENT_SOLID\n1,4,11,12,13,14,15,16,17,18\n{more}*END\n"
    )
}

const ELASTIC: &str = "*MAT_ELASTIC\n3,7.85e-9,2.1e5,0.3";
const RIGID: &str = "*MAT_RIGID\n3,7.85e-9,2.1e5,0.3\n1,7,5";

fn whole(third: &str, more: &str) -> Reading {
    deck::read_whole(&deck_of(third, more), "a.k").unwrap_or_else(|f| panic!("{}", lines(&f)))
}

fn good(third: &str, more: &str) -> Model {
    whole(third, more).model
}

/// A fault without the keyword and card that it names in brackets.
fn without_card(fault: &str) -> String {
    let Some((before, after)) = fault.split_once("; expected") else { return fault.to_string() };
    let named = before.rfind(" (").filter(|at| before[*at..].contains("card "));
    format!("{}; expected{after}", &before[..named.unwrap_or(before.len())])
}

/// The faults, with the line of each as an offset from the first line of `more`.
fn faults(third: &str, more: &str) -> Vec<String> {
    let text = deck_of(third, more);
    let first = text[..text.len() - more.len() - "*END\n".len()].lines().count() as u32 + 1;
    let faults = deck::read(&text, "a.k").expect_err("a fault");
    let told =
        |f: &Fault| format!("{}: {}", i64::from(f.line) - i64::from(first), without_card(&f.to_string()));
    faults.iter().map(told).collect()
}

/// The parts of each body.
fn bodies(model: &Model) -> Vec<Vec<u32>> {
    model.setup.bodies.iter().map(|body| body.parts.clone()).collect()
}

#[test]
fn each_part_of_rigid_material_is_a_body_of_its_own() {
    let model = good(ELASTIC, "");
    assert_eq!(bodies(&model), [[0], [3]]);
    let [root, ram] = &model.setup.bodies[..] else { panic!("two bodies") };
    // A shell of 10 by 10 by 2, and a quarter of that of the strip on each of two nodes.
    assert!((root.mass / (7.85e-9 * 200.0 * 1.5) - 1.0).abs() < 1e-12, "{}", root.mass);
    assert!((root.start.centre[0] - (5.0 + 0.5 * 10.0) / 1.5).abs() < 1e-12, "{:?}", root.start);
    assert!((ram.mass / 7.85e-6 - 1.0).abs() < 1e-12, "{}", ram.mass);
    let free = |body: &mechanics::rigid::Body| body.spin.map(|drive| drive.is_none());
    assert_eq!((free(root), free(ram)), ([true, false, false], [true, false, false]));
}

#[test]
fn parts_become_rigid_and_join_a_body_by_card_by_set_and_by_the_nodes_they_share() {
    // Alone; with the ram; with the strip between, which joins all three shells.
    assert_eq!(bodies(&good(ELASTIC, "*DEFORMABLE_TO_RIGID\n3\n")), [vec![0], vec![2], vec![3]]);
    assert_eq!(bodies(&good(ELASTIC, "*DEFORMABLE_TO_RIGID\n3,4,PART\n")), [vec![0], vec![2, 3]]);
    let reading = whole(ELASTIC, "*SET_PART_LIST\n7\n2,3\n*DEFORMABLE_TO_RIGID\n7,0,PSET\n");
    assert_eq!(bodies(&reading.model), [vec![0, 1, 2], vec![3]]);
    let words: Vec<&str> = reading.warnings.iter().map(|w| w.words.as_str()).collect();
    assert!(words.contains(&"rigid parts 1 and 2 share nodes, such as 3: they are one body"), "{words:?}");
    assert!(words.contains(&"rigid parts 2 and 3 share nodes, such as 5: they are one body"), "{words:?}");
    let merged = "*CONSTRAINED_RIGID_BODIES\n4,1\n4,3\n";
    assert_eq!(bodies(&good(RIGID, merged)), [[0, 2, 3]]);
    assert_eq!(
        bodies(&good(RIGID, "*SET_PART_LIST\n7\n3\n*CONSTRAINED_RIGID_BODIES_SET\n1,7\n")),
        [vec![0, 2], vec![3]]
    );
    // The constraints are those of the part that leads; a warning says that another has others.
    let reading = whole(RIGID, merged);
    let held = reading.model.setup.bodies[0].velocity.map(|drive| drive.is_some());
    assert_eq!(held, [false; 3]);
    assert!(reading.warnings.iter().any(|w| w.words.contains("part 3 is of the body that part 4 leads")));
    let led = good(RIGID, "*CONSTRAINED_RIGID_BODIES\n3,4\n");
    assert_eq!(led.setup.bodies[1].velocity.map(|drive| drive.is_some()), [true; 3]);
    // What the whole problem is made of may be rigid: then its elements give the time step.
    let all = good(RIGID, "*DEFORMABLE_TO_RIGID\n2\n");
    let step = all
        .setup
        .bodies
        .iter()
        .filter_map(|body| body.courant)
        .map(|(dt, _)| dt)
        .fold(f64::INFINITY, f64::min);
    let sound = f64::sqrt(2.1e5 / 7.85e-9 * 0.7 / (1.3 * 0.4));
    assert!((step / (10.0 / sound) - 1.0).abs() < 1e-9, "{step}");
}

#[test]
fn bodies_begin_as_their_cards_or_their_nodes_say() {
    let spun = "*INITIAL_VELOCITY_GENERATION\n1,2,3.0\n5,0,0,1,0,0\n";
    let model = good(ELASTIC, spun);
    let root = &model.setup.bodies[0].start;
    assert!((root.spin[0] - 3.0).abs() < 1e-12, "{root:?}");
    assert!((root.velocity[2] - 3.0 * 5.0).abs() < 1e-9, "{root:?}");
    // Nodes of its shells turn as it does, whatever they were given.
    assert_eq!(model.spin[0], root.spin);
    let card = format!("{spun}*INITIAL_VELOCITY_RIGID_BODY\n1,1.0,2.0,3.0,4.0\n4,0,0,-7\n");
    let model = good(ELASTIC, &card);
    let [root, ram] = [0, 1].map(|b| &model.setup.bodies[b].start);
    assert_eq!((root.velocity, root.spin[0]), ([1.0, 2.0, 3.0], 4.0));
    assert_eq!((ram.velocity, ram.spin), ([0.0, 0.0, -7.0], [0.0; 3]));
    assert_eq!(model.spin[0], [4.0, 0.0, 0.0]);
    assert!(model.velocity.iter().filter(|v| **v == [0.0, 0.0, -7.0]).count() == 8);
    let turned =
        "*DEFINE_COORDINATE_SYSTEM\n9,0,0,0,0,1,0\n-1,0,0\n*INITIAL_VELOCITY_RIGID_BODY\n4,5.0,0,0,0,0,0,9\n";
    assert_eq!(good(ELASTIC, turned).setup.bodies[1].start.velocity, [0.0, 5.0, 0.0]);
}

#[test]
fn bodies_are_moved_along_and_about_axes_by_curves() {
    let curve = "*DEFINE_CURVE\n3\n0,0\n1,10\n";
    let moved = format!(
        "{curve}*BOUNDARY_PRESCRIBED_MOTION_RIGID\n4,3,0,3,-2.0\n4,5,2,3\n*BOUNDARY_PRESCRIBED_MOTION_RIGID_ID\n8,heading\n1,1,1,3\n"
    );
    let model = good(ELASTIC, &moved);
    let curves = &model.setup.loads.curves;
    let [root, ram] = &model.setup.bodies[..] else { panic!("two bodies") };
    let at = |drive: Option<mechanics::load::Drive>, t: f64| drive.map(|drive| drive.at(curves, t));
    assert_eq!((at(ram.velocity[2], 0.5), at(ram.velocity[0], 0.5)), (Some(-10.0), None));
    // An angle of 10 t, held about y and z by the material.
    assert_eq!([0, 1, 2].map(|a| at(ram.spin[a], 0.25)), [Some(10.0), Some(0.0), Some(0.0)]);
    // An acceleration of 10 t.
    let v = at(root.velocity[0], 1.0).expect("it is moved");
    assert!((v - 5.0).abs() < 1e-9, "{v}");
}

#[test]
fn parts_of_one_body_do_not_meet_and_others_do() {
    let single = "*CONTACT_AUTOMATIC_SINGLE_SURFACE\n0\n\n\n";
    let model = good(RIGID, &format!("*CONSTRAINED_RIGID_BODIES\n1,3\n{single}"));
    let contact = model.setup.contact.expect("parts meet");
    let meet = |a: usize, b: usize| contact.interacts[4 * a + b];
    assert!(!meet(0, 0) && !meet(0, 2) && meet(0, 3) && meet(1, 1) && meet(0, 1));
    // Where nothing is left there is no contact.
    let alone = "*SET_PART_LIST\n7\n1,3\n*CONSTRAINED_RIGID_BODIES\n1,3\n*CONTACT_AUTOMATIC_SINGLE_SURFACE\n7,0,2\n\n\n";
    assert!(good(RIGID, alone).setup.contact.is_none());
}

#[test]
fn what_cannot_be_honoured_of_rigid_bodies_is_refused_at_its_line() {
    let curve = "*DEFINE_CURVE\n3\n0,0\n1,10\n";
    let second = format!("{curve}*BOUNDARY_PRESCRIBED_MOTION_RIGID\n4,3,0,3\n4,3,0,3\n");
    let held = format!("{curve}*BOUNDARY_PRESCRIBED_MOTION_RIGID\n4,6,0,3\n");
    let refused = [
        (
            "*DEFORMABLE_TO_RIGID_AUTOMATIC\n1\n",
            0,
            "read *DEFORMABLE_TO_RIGID_AUTOMATIC with less than two cards; expected when parts switch",
        ),
        (
            "*DEFORMABLE_TO_RIGID_INERTIA\n1\n",
            0,
            "read *DEFORMABLE_TO_RIGID_INERTIA; expected mass and inertia",
        ),
        ("*DEFORMABLE_TO_RIGID\n9\n", 1, "read part 9; expected a part of the deck"),
        ("*DEFORMABLE_TO_RIGID\n3,0,SHELL\n", 1, "read SHELL; expected PTYPE PART or PSET"),
        (
            "*DEFORMABLE_TO_RIGID\n3,2\n",
            1,
            "read part 2, which deforms or has no elements; expected parts of rigid",
        ),
        ("*CONSTRAINED_RIGID_BODIES\n1,3\n", 1, "read part 3, which deforms or has no elements"),
        ("*CONSTRAINED_RIGID_BODIES\n,1\n", 1, "read a blank field; expected the part that leads"),
        ("*INITIAL_VELOCITY_RIGID_BODY\n2,1.0\n", 1, "read part 2; expected a part of a rigid body"),
        ("*BOUNDARY_PRESCRIBED_MOTION_RIGID\n2,1,0,3\n", 1, "read part 2; expected a part of a rigid body"),
        (
            "*BOUNDARY_PRESCRIBED_MOTION_RIGID\n1,4,0,3\n",
            1,
            "read a blank field; expected the number of a *DEFINE_VECTOR",
        ),
        ("*BOUNDARY_PRESCRIBED_MOTION_RIGID\n1,1,4,3\n", 1, "read 4; expected VAD 0, 1 or 2"),
        ("*BOUNDARY_PRESCRIBED_MOTION_RIGID\n1,1,0,3\n", 1, "read curve 3; expected a *DEFINE_CURVE"),
        ("*BOUNDARY_PRESCRIBED_MOTION_RIGID\n1,12,0,3\n", 1, "read 12; expected DOF 1 to 3 along x, y or z"),
        (
            "*BOUNDARY_PRESCRIBED_MOTION_RIGID\n1,1,0,3,1.0,0,0.5,0.7\n",
            1,
            "read 0.5; expected a death after the birth",
        ),
        (second.as_str(), 6, "read a second motion of the body of part 4; expected one by axis, which line"),
        (held.as_str(), 5, "read a motion of part 4 along or about y; expected an axis that CON1 or CON2"),
    ];
    for (more, line, expected) in refused {
        let found = faults(ELASTIC, more);
        let told = found.iter().any(|f| f.starts_with(&format!("{line}: ")) && f.contains(expected));
        assert!(told, "{more}{found:?}");
    }
    // What holds one corner along an axis ties the body's turns to its motion.
    let found = faults(ELASTIC, "*BOUNDARY_SPC_NODE\n11,0,1\n");
    assert!(found[0].contains("with node 11, which a boundary or a wall holds"), "{found:?}");
}

#[test]
fn supports_of_the_nodes_of_a_body_hold_the_body_where_that_is_what_they_say() {
    let set = "*SET_NODE_LIST\n9\n11,12,13,14,15,16,17,18\n";
    let held = |body: usize, more: &str| {
        let reading = whole(ELASTIC, more);
        let body = &reading.model.setup.bodies[body];
        let words: Vec<String> = reading.warnings.iter().map(|w| w.words.clone()).collect();
        ([body.velocity, body.spin].map(|drives| drives.map(|drive| drive.is_some())), words)
    };
    // All along x and y: it may fall along z, and does not turn.
    let (axes, words) = held(1, &format!("{set}*BOUNDARY_SPC_SET\n9,0,1,1\n"));
    assert_eq!(axes, [[true, true, false], [true; 3]]);
    let told = "the rigid body of part 4: what holds nodes of it holds the body, along [x, y] and about [x, y, z] of its centre";
    assert!(words.iter().any(|w| w == told), "{words:?}");
    // Two nodes of a sheet that neither move nor turn hold all of it.
    let (axes, _) = held(0, "*BOUNDARY_SPC_NODE\n1,0,1,1,1,1,1,1\n2,0,1,1,1,1,1,1\n");
    assert_eq!(axes, [[true; 3], [true; 3]]);
    // A motion of the body along an axis that its nodes hold is refused.
    let both = format!(
        "{set}*BOUNDARY_SPC_SET\n9,0,0,0,1\n*DEFINE_CURVE\n3\n0,1\n1,1\n*BOUNDARY_PRESCRIBED_MOTION_RIGID\n4,3,0,3\n"
    );
    let found = faults(ELASTIC, &both);
    assert!(found.iter().any(|f| f.contains("with node 11, which a boundary or a wall holds")), "{found:?}");
}

#[test]
fn a_converted_pipe_whip_is_the_same_problem() {
    let folder = format!("{}/examples", env!("CARGO_MANIFEST_DIR"));
    let name = "pipe-whip.k";
    let text = fs::read_to_string(format!("{folder}/{name}")).expect("the deck is in the repository");
    let mut open = |path: &str| fs::read_to_string(format!("{folder}/{path}")).ok();
    let gathered = bundle::gather(name, text, &Options::default(), &mut open).expect("few files");
    let Reading { model, warnings, .. } =
        deck::read_whole(&gathered, name).unwrap_or_else(|f| panic!("{}", lines(&f)));
    let words: Vec<&str> = warnings.iter().map(|w| w.words.as_str()).collect();
    assert!(
        matches!(words[..], [only] if only.contains("surfaces overlap by half a thickness")),
        "{words:?}"
    );
    let names: Vec<&str> = model.mesh.parts.iter().map(|part| part.name.as_str()).collect();
    assert_eq!(names, ["hinge", "whip", "clamp left", "clamp right", "target"]);
    assert_eq!((model.mesh.n_elements(), bodies(&model)), (672, vec![vec![0], vec![2, 3]]));
    assert_eq!(model.output.contact_forces, [[1, 4]]);
    let hinge = &model.setup.bodies[0];
    assert_eq!((hinge.start.velocity, hinge.start.spin), ([0.0; 3], [-0.15, 0.0, 0.0]));
    let converted =
        deck::convert(&gathered, name, "pipe-whip.mesh").unwrap_or_else(|f| panic!("{}", lines(&f)));
    assert!(
        converted.deck.contains("[[rigid]]\nparts = [\"clamp left\", \"clamp right\"]"),
        "{}",
        converted.deck
    );
    let mesh = converted.mesh;
    let mut open = |path: &str| (path == "pipe-whip.mesh").then(|| mesh.clone());
    let again =
        bundle::gather("a.toml", converted.deck.clone(), &Options::default(), &mut open).expect("few files");
    let again = deck::read(&again, "a.toml").unwrap_or_else(|f| panic!("{}", lines(&f)));
    assert_eq!(again, model);
}

#[test]
fn force_transducers_ask_for_the_contact_of_their_parts() {
    let single = "*CONTACT_AUTOMATIC_SINGLE_SURFACE\n0\n\n\n";
    let asked = |cards: &str| whole(ELASTIC, &format!("{single}{cards}"));
    let pairs = |cards: &str| asked(cards).model.output.contact_forces;
    assert_eq!(pairs("*CONTACT_FORCE_TRANSDUCER_PENALTY\n4,0,3,0\n\n\n"), [[3, 0], [3, 1], [3, 2]]);
    assert_eq!(pairs("*CONTACT_FORCE_TRANSDUCER_PENALTY_ID\n5,on the ram\n4,2,3,3\n\n\n"), [[3, 1]]);
    // Each pair once, as the first transducer has it.
    let both = "*CONTACT_FORCE_TRANSDUCER\n2,4,3,3\n\n\n*CONTACT_FORCE_TRANSDUCER\n4,2,3,3\n\n\n";
    assert_eq!(pairs(both), [[1, 3]]);
    // Parts of one body do not meet.
    let alone = "*CONSTRAINED_RIGID_BODIES\n4,1\n*CONTACT_FORCE_TRANSDUCER\n1,4,3,3\n\n\n";
    let reading = asked(alone);
    assert!(reading.model.output.contact_forces.is_empty());
    assert!(
        reading
            .warnings
            .iter()
            .any(|w| w.words.starts_with("a force transducer of parts that meet no other"))
    );
    // What cannot be written is no reason to refuse a deck.
    for (card, expected) in [("4,0,1,0", "surfaces of kinds [1, 0] is left out"), ("4,0,3,0,1", "with boxes")]
    {
        let reading = asked(&format!("*DEFINE_BOX\n1\n*CONTACT_FORCE_TRANSDUCER\n{card}\n"));
        assert!(reading.warnings.iter().any(|w| w.words.contains(expected)), "{:?}", reading.warnings);
    }
}

#[test]
fn a_plane_is_a_cross_section_by_its_heading() {
    let plane = |x: f64| format!("*DATABASE_CROSS_SECTION_PLANE_ID\n7,middle\n0,{x},0,0,{},0,0\n\n", x + 1.0);
    let sections = good(ELASTIC, &plane(15.0)).output.sections;
    assert_eq!((sections.len(), sections[0].name.as_str()), (1, "middle"));
    // The second shell, whose second and third corner are ahead.
    assert_eq!(sections[0].cut.elements, [(1, 0b0110)]);
    // The first is of a rigid body.
    let found = faults(ELASTIC, &plane(5.0));
    assert!(found.len() == 1 && found[0].contains("cross-section middle that cuts nothing"), "{found:?}");
}

#[test]
fn sets_of_nodes_and_elements_are_the_cross_section_of_the_plane_between_them() {
    // Shells 2 and 3, of which the set takes one, and the nodes on the far edge of shell 2.
    let of = |sets: &str, section: &str| {
        let more =
            format!("{sets}*SET_NODE_LIST\n9\n5,6\n*DATABASE_CROSS_SECTION_SET_ID\n8,weld\n{section}\n");
        good(ELASTIC, &more).output.sections
    };
    let plane = "*DATABASE_CROSS_SECTION_PLANE\n0,15,0,0,16,0,0\n\n";
    let by_plane = &good(ELASTIC, plane).output.sections[0].cut;
    for sets in [
        "*SET_SHELL_LIST\n4\n2\n",
        "*SET_SHELL_LIST_GENERATE\n4\n2,2\n",
        "*SET_SHELL_GENERAL\n4\nALL\nDELEM,1,3\n",
        "*SET_SHELL_GENERAL\n4\nPART,2\n",
    ] {
        let sections = of(sets, "9,0,0,4");
        assert_eq!(sections[0].name, "weld");
        assert_eq!(&sections[0].cut, by_plane, "{sets}");
    }
    let found = faults(ELASTIC, "*SET_NODE_LIST\n9\n5,6\n*DATABASE_CROSS_SECTION_SET\n9,3\n");
    assert!(found.len() == 1 && found[0].contains("expected a set of solids of the deck"), "{found:?}");
}

#[test]
fn irigid_goes_over_the_start_of_an_inertia_and_ivatn_takes_the_whole_body() {
    let inertia = "*PART_INERTIA\nram\n4,2,1\n25,5,5,1e-2\n1.0,0,0,1.0,0,1.0\n0,0,5\n";
    let start = |more: &str| {
        let text = deck_of(ELASTIC, &format!("{inertia}{more}")).replace("ram\n4,2,1\n*SECTION", "*SECTION");
        let model = deck::read(&text, "a.k").unwrap_or_else(|f| panic!("{}", lines(&f)));
        let start = &model.setup.bodies[1].start;
        (start.velocity, start.spin)
    };
    let (own, given) = (([0.0, 0.0, 5.0], [0.0; 3]), ([1.0, 2.0, 3.0], [0.0; 3]));
    let boxes = "*DEFINE_BOX\n1,0,100,0,100,0,100\n*DEFINE_BOX\n2,0,1,0,1,0,1\n*SET_PART_LIST\n7\n4\n*SET_PART_LIST\n8\n1\n";
    for (card, expected) in [
        ("0,0,0,0", own),
        ("0,0,0,-2", given),
        ("0,0,2,-2", given),
        ("0,0,1,-1", given),
        ("0,0,2,-1", own),
        ("0,0,0,7", given),
        ("0,0,2,7", own),
        ("0,0,0,8", own),
    ] {
        assert_eq!(start(&format!("{boxes}*INITIAL_VELOCITY\n{card}\n1,2,3\n")), expected, "{card}");
    }
    assert_eq!(start("*INITIAL_VELOCITY\n0,0,0,-2\n1,2,3,6\n"), ([1.0, 2.0, 3.0], [6.0, 0.0, 0.0]));
    let generated = |id: u32, over: u32| {
        start(&format!("*INITIAL_VELOCITY_GENERATION\n{id},2,2,1,2,3\n25,4,5,1,0,0,0,{over}\n"))
    };
    assert_eq!(generated(4, 0), own);
    assert_eq!(generated(4, 1), ([1.0, 2.0, 5.0], [2.0, 0.0, 0.0]));
    assert_eq!(generated(1, 1), own);
    let text = deck_of(ELASTIC, &format!("{inertia}*INITIAL_VELOCITY\n0,0,0,-3\n1,2,3\n"));
    let told = deck::read(&text.replace("ram\n4,2,1\n*SECTION", "*SECTION"), "a.k").expect_err("IRIGID -3");
    assert!(told[0].to_string().contains("IRIGID 0, -1, -2 or the number of a set of parts"), "{told:?}");
    // Of a body of two parts, where the card names one.
    let merged = |card: &str| {
        let more =
            format!("*CONSTRAINED_RIGID_BODIES\n1,4\n*INITIAL_VELOCITY_GENERATION\n{card}\n0,0,0,0,0,1\n");
        good(ELASTIC, &more).setup.bodies[0].start.velocity
    };
    assert!(merged("4,2,0,0,0,-7")[2] > -7.0);
    assert!((merged("4,2,0,0,0,-7,1")[2] + 7.0).abs() < 1e-9);
}
