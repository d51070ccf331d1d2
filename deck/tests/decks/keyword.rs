//! Keyword decks: the examples are what they say, converted decks are the same problem, bad decks are refused at their
//! lines, and no change of a deck makes the reader panic.

mod beams;
mod blast;
mod contact;
mod erosion;
mod faults;
mod hourglass;
mod joints;
mod laminates;
mod laws;
mod meaning;
mod moving;
mod mutations;
mod records;
mod reference;
mod rigid;
mod silence;
mod spans;
mod springs;
mod stress;

use std::{fs, path::Path};

use deck::{
    Fault, Model, Reading,
    bundle::{self, Options},
    mesh_file,
};
use mechanics::{
    element::shell4::{InPlane, Rule},
    erosion::Criteria,
    load::Drive,
    material::Strength,
    mesh::{Section, Topology},
    wall::Shape,
};

fn folder(name: &str) -> String {
    format!("{}/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// A deck of a folder with what it includes.
fn gathered(folder: &str, name: &str, options: &Options) -> String {
    let text = fs::read_to_string(Path::new(folder).join(name)).expect("the deck is in the repository");
    let mut open = |path: &str| fs::read_to_string(Path::new(folder).join(path)).ok();
    bundle::gather(name, text, options, &mut open).expect("few files")
}

fn example(name: &str, case: Option<u32>) -> Reading {
    let options = Options { case, ..Options::default() };
    deck::read_whole(&gathered(&folder("examples"), name, &options), name)
        .unwrap_or_else(|f| panic!("{}", lines(&f)))
}

fn lines(faults: &[Fault]) -> String {
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// A small deck: one cube of one element of steel, and what is added to it.
fn cube(more: &str) -> String {
    let nodes: String = (0..8)
        .map(|i: u32| {
            let x = [(i ^ i >> 1) & 1, i >> 1 & 1, i >> 2];
            format!("{:8}{:16}{:16}{:16}\n", i + 1, x[0], x[1], x[2])
        })
        .collect();
    format!(
        "*KEYWORD\n*CONTROL_TERMINATION\n1e-6\n*PART\ncube\n1,1,1\n*SECTION_SOLID\n1,1\n*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n*NODE\n{nodes}*ELEMENT_SOLID\n       1       1       1       2       3       4       5       6       7       8\n{more}*END\n"
    )
}

fn read(text: &str) -> Result<Model, Vec<Fault>> {
    deck::read(text, "a.k")
}

fn good(more: &str) -> Model {
    read(&cube(more)).unwrap_or_else(|f| panic!("{}", lines(&f)))
}

/// The first fault of the small deck with something added.
fn fault(more: &str) -> String {
    without_card(&read(&cube(more)).expect_err("a fault")[0].to_string())
}

/// A fault without the keyword and card that it names in brackets.
fn without_card(fault: &str) -> String {
    let Some((before, after)) = fault.split_once("; expected") else { return fault.to_string() };
    let named = before.rfind(" (").filter(|at| before[*at..].contains("card "));
    format!("{}; expected{after}", &before[..named.unwrap_or(before.len())])
}

#[test]
fn block_on_plate_is_a_quarter_with_curves_sets_and_contact() {
    let Reading { model, warnings, .. } = example("block-on-plate.k", None);
    assert_eq!((model.title.as_str(), model.units.as_str()), ("Block on a plate", "mm-ms-kg"));
    assert_eq!((model.mesh.n_elements(), model.mesh.n_nodes()), (4 * 4 * 6 + 12 * 12 * 3, 851));
    let names: Vec<&str> = model.mesh.parts.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["block", "plate"]);
    let moving: Vec<&[f64; 3]> = model.velocity.iter().filter(|v| **v != [0.0; 3]).collect();
    assert!(moving.len() == 5 * 5 * 7 && moving.iter().all(|v| **v == [0.0, 0.0, -150.0]));
    let Strength::Tabulated { hardening, .. } = model.setup.materials[1].strength else { panic!("a curve") };
    // In GPa by SFO; the last slope goes on.
    assert_eq!((hardening.n_points, hardening.strain[1], hardening.stress[1]), (5, 0.05, 0.3));
    let contact = model.setup.contact.as_ref().expect("the deck has contact");
    assert_eq!(contact.interacts, [false, true, true, false]);
    // The bodies are 0.2 apart, more than a tenth of the smallest edge.
    assert!((contact.gap - 0.4 / 3.0).abs() < 1e-6, "{}", contact.gap);
    let gauges: Vec<&str> = model.output.gauges.iter().map(|g| g.name.as_str()).collect();
    assert_eq!((model.output.period, gauges), (Some(0.01), vec!["node 1", "node 1001"]));
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].to_string().starts_with("block-on-plate.k:"), "{}", warnings[0]);
    assert!(warnings[0].words.contains("*DATABASE_GLSTAT (line 18)"), "{}", warnings[0]);
}

#[test]
fn ball_on_shell_has_clamped_shells_of_five_points_that_solids_meet() {
    let Reading { model, warnings, .. } = example("ball-on-shell.k", None);
    let words: Vec<&str> = warnings.iter().map(|w| w.words.as_str()).collect();
    assert!(
        matches!(words[..], [only] if only.contains("surfaces overlap by half a thickness")),
        "{words:?}"
    );
    let [sheet, ball] = &model.mesh.parts[..] else { panic!("two parts") };
    assert_eq!((sheet.name.as_str(), sheet.n_elements(), ball.n_elements()), ("sheet", 144, 64));
    assert_eq!(sheet.section(), Some(&Section::of(1.0, Rule::Gauss(5))));
    // Both kinds are numbered from 1.
    assert_eq!((sheet.element_ids[0], ball.element_ids[0]), (1, 1));
    let held = |n: &&u32| model.setup.constraints[usize::from(model.constraint[**n as usize])].clamped == 7;
    assert_eq!(sheet.nodes.iter().filter(held).count(), 48);
    assert!(matches!(model.setup.materials[0].strength, Strength::VonMises { rate: Some(_), .. }));
    let contact = model.setup.contact.expect("the deck has contact");
    // Half the thickness.
    assert_eq!((contact.gap, contact.interacts), (0.5, vec![true; 4]));
}

/// A square of shells whose edge is 10, spinning about z, and what is added to it.
fn square(section: &str, more: &str) -> String {
    format!(
        "*KEYWORD\n*CONTROL_TERMINATION\n1e-6\n*PART\nsquare\n1,1,1\n{section}*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n\
         *NODE\n1,0,0,0,1,7\n2,10,0,0\n3,10,10,0\n4,0,10,0\n5,5,15,0\n*ELEMENT_SHELL\n1,1,1,2,3,4\n2,1,4,3,5\n\
         *INITIAL_VELOCITY_GENERATION\n1,2,3.0\n0,0,0,0,0,1\n{more}*END\n"
    )
}

#[test]
fn shells_of_a_keyword_deck_have_their_section_their_spin_and_triangles() {
    let reading = deck::read_whole(&square("*SECTION_SHELL\n1,16,,7,,1\n2,2,2,2\n", ""), "a.k")
        .unwrap_or_else(|f| panic!("{}", lines(&f)));
    let part = &reading.model.mesh.parts[0];
    assert_eq!(
        part.section(),
        Some(&Section { thins: false, in_plane: InPlane::Four, ..Section::of(2.0, Rule::Lobatto(5)) })
    );
    assert_eq!(part.corners(1)[..4], [3, 2, 4, 4]);
    assert_eq!((reading.model.spin[2], reading.model.velocity[2]), ([0.0, 0.0, 3.0], [-30.0, 30.0, 0.0]));
    let of = |n: usize| reading.model.setup.constraints[usize::from(reading.model.constraint[n])];
    assert_eq!((of(0).velocity.map(|v| v.is_some()), of(0).clamped), ([true, false, false], 7));
    let words: Vec<&str> = reading.warnings.iter().map(|w| w.words.as_str()).collect();
    assert!(words.contains(&"NIP 7: 5 points through the thickness"), "{words:?}");
    assert!(words.iter().any(|w| w.starts_with("1 triangles")), "{words:?}");
    // Its own thickness goes before that of the section.
    let own = square("*SECTION_SHELL\n1,2\n", "").replace(
        "*ELEMENT_SHELL\n1,1,1,2,3,4\n2,1,4,3,5\n",
        "*ELEMENT_SHELL_THICKNESS\n1,1,1,2,3,4\n1,2,3,2\n2,1,4,3,5\n1,2,3\n",
    );
    let model = read(&own).unwrap_or_else(|f| panic!("{}", lines(&f)));
    assert_eq!(
        model.mesh.parts[0].section(),
        Some(&Section { thins: false, ..Section::of(2.0, Rule::Gauss(2)) })
    );
}

#[test]
fn elform_says_the_points_in_the_plane_and_what_is_a_membrane() {
    for (form, in_plane, is_membrane, warning) in [
        (2, InPlane::One, false, ""),
        (-16, InPlane::Four, false, ""),
        (
            6,
            InPlane::Four,
            false,
            "ELFORM 6: shells are computed with four points in the plane, as ELFORM 16",
        ),
        (10, InPlane::One, false, "ELFORM 10: shells are computed with one point and hourglass control"),
        (5, InPlane::One, true, ""),
        (9, InPlane::Four, true, ""),
    ] {
        let text = square(&format!("*SECTION_SHELL\n1,{form},,3\n2,2,2,2\n"), "");
        let Reading { model, warnings, .. } =
            deck::read_whole(&text, "a.k").unwrap_or_else(|f| panic!("{}", lines(&f)));
        let points = if is_membrane { 1 } else { 3 };
        let section =
            Section { thins: false, in_plane, is_membrane, ..Section::of(2.0, Rule::Gauss(points)) };
        assert_eq!(model.mesh.parts[0].section(), Some(&section), "ELFORM {form}");
        let found = warnings.iter().find(|warning| warning.words.starts_with("ELFORM"));
        assert!(found.map_or("", |found| found.words.as_str()).starts_with(warning), "{found:?}");
        assert_eq!(found.is_some(), !warning.is_empty(), "{found:?}");
        let written =
            deck::convert(&text, "a.k", "out.mesh").unwrap_or_else(|f| panic!("{}", lines(&f))).deck;
        assert_eq!(written.contains("in_plane = 4"), in_plane == InPlane::Four, "{written}");
        assert_eq!(written.contains("membrane = true"), is_membrane, "{written}");
    }
}

#[test]
fn shells_of_a_part_have_the_mean_thickness_of_their_corners() {
    let more = "*ELEMENT_SHELL_THICKNESS\n3,1,1,2,3,4\n1,2,0,4\n4,1,1,2,4\n1,1,4\n5,1,4,3,5\n0,0,0\n";
    let model =
        read(&square("*SECTION_SHELL\n1,2\n3,3,3,3\n", more)).unwrap_or_else(|f| panic!("{}", lines(&f)));
    let part = &model.mesh.parts[0];
    let own: Vec<Option<f64>> = (0..5).map(|e| part.thickness_of(e)).collect();
    assert_eq!(own, [3.0, 3.0, 2.5, 2.0, 3.0].map(Some));
    assert_eq!(part.least_thickness(), Some(2.0));
    // The same as a mesh of a TOML deck, whose part has a thickness for those without one.
    let text = square("*SECTION_SHELL\n1,2\n3,3,3,3\n", "*ELEMENT_SHELL_THICKNESS\n3,1,1,2,3,4\n1,2,3,4\n");
    let mesh = mesh_file::parse(&text, "a.k").unwrap_or_else(|f| panic!("{}", lines(&f)));
    assert_eq!(mesh.bodies[0].thicknesses, [0.0, 0.0, 2.5]);
    assert_eq!(
        mesh_file::parse(&mesh.text(), "a.mesh").map(|own| own.bodies[0].thicknesses.clone()),
        Ok(vec![0.0, 0.0, 2.5])
    );
    let uneven = mesh_file::parse(&text.replace("\n1,2,3,4\n", "\n1,2,0,4\n"), "a.k").expect_err("a fault");
    assert!(lines(&uneven).contains("shell 3 with a thickness at some of its corners"), "{}", lines(&uneven));
}

#[test]
fn shells_that_cannot_be_computed_are_refused_at_their_line() {
    let fault = |section: &str, more: &str| read(&square(section, more)).expect_err("a fault")[0].to_string();
    let sound = "*SECTION_SHELL\n1,2\n2,2,2,2\n";
    assert!(read(&square(sound, "")).is_ok());
    for (section, more, expected) in [
        ("*SECTION_SHELL\n1,12\n2\n", "", "a.k:8:"),
        ("*SECTION_SHELL\n1,2\n", "", "shell 1 without a thickness"),
        ("*SECTION_SHELL\n1,2,,,,,1\n2\n", "", "an angle for each of the NIP points"),
        ("*SECTION_SHELL\n1,2\n2,2,2,2,1\n", "", "nodes in the middle of the thickness"),
        ("*SECTION_SOLID\n1,1\n", "", "part 1 with shells and the section at line 8"),
        (sound, "*ELEMENT_SHELL\n2,1,1,2,3,4\n", "a number other than 2"),
        (sound, "*ELEMENT_SHELL\n3,1,1,2,3,9\n", "shell 3 with node 9"),
        (sound, "*ELEMENT_SHELL\n3,1,1,2,1,4\n", "a triangle that repeats the third"),
        (sound, "*ELEMENT_SHELL_THICKNESS\n3,1,1,2,3,4\n1,-1,1,1\n", "expected a number of 0 or more"),
        (
            "*SECTION_SHELL\n1,2\n",
            "*ELEMENT_SHELL_THICKNESS\n3,1,1,2,3,4\n1,0,1,1\n",
            "shell 1 without a thickness",
        ),
        (sound, "*ELEMENT_SHELL\n3,1,1,2,3,4,5\n", "at most four nodes"),
    ] {
        let said = fault(section, more);
        assert!(said.contains(expected), "{said}; expected {expected}");
    }
}

#[test]
fn bar_on_wall_runs_the_case_that_is_chosen() {
    for (case, speed, title) in
        [(101, -190e3, "Bar on a wall, 190 m/s"), (102, -100e3, "Bar on a wall, 100 m/s")]
    {
        let Reading { model, warnings, .. } = example("bar-on-wall.k", Some(case));
        assert_eq!((model.title.as_str(), model.units.as_str(), warnings.len()), (title, "mm-s-t", 0));
        assert!(model.velocity.iter().all(|v| v[2] == speed));
        let Shape::Plane { normal, .. } = model.setup.walls[0].shape else { panic!("a plane") };
        assert_eq!(normal, [0.0, 0.0, 1.0]);
        assert!(matches!(model.setup.materials[0].strength, Strength::JohnsonCook { shear: 46e3, .. }));
    }
    let undecided = example("bar-on-wall.k", None);
    assert!(
        undecided.warnings[0].words.contains("--case takes one of 101, 102"),
        "{}",
        undecided.warnings[0]
    );
}

#[test]
fn punch_through_plate_erodes_by_failure_strain_and_mat_add_erosion_and_drops_freed_nodes() {
    let Reading { model, warnings, .. } = example("punch-through-plate.k", None);
    assert_eq!(
        (model.mesh.n_elements(), model.mesh.n_nodes()),
        (4 * 2 * 8 + 14 * 7 * 3, 5 * 3 * 9 + 15 * 8 * 4)
    );
    let none = Criteria::default();
    let punch = Criteria { plastic_strain: Some(0.8), ..none };
    let plate = Criteria { plastic_strain: Some(0.7), tension: Some(0.08), shear_strain: Some(0.9), ..none };
    assert_eq!(model.setup.erosion.parts, [Some(punch), Some(plate)]);
    assert!(!model.setup.erosion.retain_inertia);
    assert!(model.setup.contact.is_some());
    let words: Vec<&str> = warnings.iter().map(|w| w.words.as_str()).collect();
    assert_eq!(words, ["ignored, nothing here depends on it: *CONTROL_CONTACT (line 8)"]);
    // ENMASS 1 keeps them.
    let text = gathered(&folder("examples"), "punch-through-plate.k", &Options::default());
    let blank = format!("{:>10}{:>70}", "1.0", "0");
    assert!(text.contains(&blank), "the card of *CONTROL_CONTACT");
    let kept =
        read(&text.replace(&blank, &format!("{:>10}{:>70}", "1.0", "1"))).expect("it is the same deck");
    assert!(kept.setup.erosion.retain_inertia);
    // A contact that does not erode follows the surface all the same, and says so.
    let plain = text.replace("*CONTACT_ERODING_SURFACE_TO_SURFACE", "*CONTACT_AUTOMATIC_SURFACE_TO_SURFACE");
    let warnings = deck::read_whole(&plain, "a.k").unwrap_or_else(|f| panic!("{}", lines(&f))).warnings;
    assert!(
        warnings.iter().any(|w| w.words.contains("as in an ERODING contact with EROSOP 1")),
        "{warnings:?}"
    );
}

/// The deck that `convert` makes of a keyword deck, read with its mesh.
fn converted(text: &str, name: &str) -> Model {
    let converted = deck::convert(text, name, "out.mesh").unwrap_or_else(|f| panic!("{}", lines(&f)));
    mesh_file::parse(&converted.mesh, "out.mesh").unwrap_or_else(|f| panic!("{}", lines(&f)));
    let mesh = converted.mesh;
    let mut open = |path: &str| (path == "some/out.mesh").then(|| mesh.clone());
    let packed =
        bundle::gather("some/out.toml", converted.deck, &Options::default(), &mut open).expect("two files");
    deck::read(&packed, "out.toml").unwrap_or_else(|f| panic!("{}", lines(&f)))
}

#[test]
fn every_converted_keyword_deck_is_the_same_problem_to_the_bit() {
    let mut seen = 0;
    for entry in fs::read_dir(folder("examples")).expect("the folder is in the repository") {
        let name = entry.expect("a file").file_name().to_string_lossy().into_owned();
        // A mesh is no deck of its own.
        if !name.ends_with(".k") || name.ends_with("-mesh.k") {
            continue;
        }
        let cases = if name == "bar-on-wall.k" { vec![None, Some(101), Some(102)] } else { vec![None] };
        for case in cases {
            seen += 1;
            let text = gathered(&folder("examples"), &name, &Options { case, ..Options::default() });
            let model = example(&name, case).model;
            let again = converted(&text, &name);
            assert_eq!(again, model, "{name}");
            // Minus zero equals zero, but not to the bit.
            assert!(format!("{again:?}") == format!("{model:?}"), "{name}");
        }
    }
    assert!(seen >= 7, "only {seen} keyword decks");
    // What no example has: forces, pressures, gravity, moving walls, yield curves, local axes, minus zero.
    let more = "*SET_NODE_LIST\n1\n1,2\n*DEFINE_CURVE\n3,,,,,-0.0\n0,1\n1,-0.0\n*LOAD_NODE_SET\n1,1,3,-2.0\n*LOAD_BODY_Z\n3\n\
        *LOAD_SEGMENT\n3,2.0,0.0,1,2,3,4\n*RIGIDWALL_PLANAR_MOVING\n1\n0,0,-1,0,0.1,2\n1e-3,0.3\n\
        *BOUNDARY_PRESCRIBED_MOTION_NODE\n5,1,2,3\n6,2,1,3,0.1\n*INITIAL_VELOCITY_GENERATION\n1,2,3.0,0,0,-0.0\n5,0,0,1,0,0\n";
    assert_eq!(format!("{:?}", converted(&cube(more), "a.k")), format!("{:?}", good(more)));
}

#[test]
fn only_keyword_decks_are_converted() {
    let toml = deck::convert("title = \"x\"\n", "a.toml", "out.mesh").expect_err("no keyword deck");
    assert!(toml[0].to_string().contains("expected an LS-DYNA keyword deck"), "{}", toml[0]);
}

#[test]
fn a_mesh_file_that_is_missing_is_a_fault_of_the_deck() {
    let deck = "title = \"x\"\nunits = \"SI\"\n[control]\nend_cycle = 1\n[[part]]\nname = \"a\"\nmaterial = \"LEAD\"\nmesh = { file = \"none.mesh\" }\n";
    let faults = deck::read(deck, "deck.toml").expect_err("no such file");
    assert_eq!(
        lines(&faults),
        "deck.toml:8:17: read file = \"none.mesh\"; expected a mesh file that can be read; put it beside the deck, or correct the name"
    );
}

#[test]
fn wedges_pyramids_and_tetrahedra_repeat_corners_of_a_hexahedron() {
    let more = "*ELEMENT_SOLID\n2,1,1,2,3,4,5,5,8,8\n3,1,1,2,3,4,5,5,5,5\n4,1,1,2,3,5,5,5,5,5\n5,1,1,2,3,5\n";
    let model = good(more);
    let corners = |e: usize| model.mesh.parts[0].corners(e).map(|n| model.mesh.node_ids[n as usize]);
    assert_eq!(corners(1), [1, 2, 3, 4, 5, 5, 8, 8]);
    assert_eq!(corners(2), [1, 2, 3, 4, 5, 5, 5, 5]);
    assert_eq!(corners(3), [1, 2, 3, 3, 5, 5, 5, 5]);
    assert_eq!(corners(4), corners(3));
    let seven = fault("*ELEMENT_SOLID\n2,1,1,2,3,4,5,6,7,7\n");
    assert!(seven.starts_with("a.k:23:1: read element 2 with 7 different corners"), "{seven}");
}

#[test]
fn parts_that_name_the_same_nodes_share_them() {
    let second = "*NODE\n9,0,0,2\n10,1,0,2\n11,1,1,2\n12,0,1,2\n*PART\nupper\n2,1,1\n*ELEMENT_SOLID\n2,2,5,6,7,8,9,10,11,12\n*CONTACT_AUTOMATIC_SINGLE_SURFACE\n\n\n";
    let model = good(second);
    assert_eq!(model.mesh.n_nodes(), 12);
    assert_eq!(model.mesh.parts[0].nodes[4..], model.mesh.parts[1].nodes[..4]);
    assert!(
        matches!(&model.mesh.parts[1].topology, Topology::Explicit { hexahedra } if hexahedra.len() == 1)
    );
    assert_eq!(model.setup.contact.expect("contact").interacts, [true; 4]);
}

#[test]
fn spinning_bodies_and_local_axes_give_each_node_its_velocity() {
    // About the axis through (1, 0, 0) along z: node 1 at the origin moves along -y.
    let model = good("*INITIAL_VELOCITY_GENERATION\n1,2,10.0,0.0,0.0,5.0\n1.0,0.0,0.0,0.0,0.0,2.0\n");
    assert_eq!(model.velocity[0], [0.0, -10.0, 5.0]);
    assert_eq!(model.velocity[1], [0.0, 0.0, 5.0]);
    // x of the system is global y, y is -x; the later card goes over the earlier one, in its box only.
    let system = "*DEFINE_COORDINATE_SYSTEM\n3,0,0,0,0,1,0\n-1,0,0\n*DEFINE_BOX\n7,-1,0.5,-9,9,-9,9\n";
    let model =
        good(&format!("{system}*INITIAL_VELOCITY\n\n4.0\n*INITIAL_VELOCITY\n0,0,7,0,3\n1.0,2.0,0.0\n"));
    assert_eq!(model.velocity[0], [-2.0, 1.0, 0.0]);
    assert_eq!(model.velocity[1], [4.0, 0.0, 0.0]);
}

#[test]
fn sets_and_what_is_held_moved_and_pushed_reach_the_nodes_meant() {
    let sets = "*SET_NODE_GENERAL\n1\nBOX,1\nDNODE,4\n*DEFINE_BOX\n1,-9,9,-9,9,-0.1,0.1\n*SET_NODE_LIST_GENERATE_TITLE\nup\n2\n5,7\n*SET_NODE_ADD\n4\n2\n";
    let conditions = "*BOUNDARY_SPC_SET_ID\n9,held\n1,0,1,0,1\n*BOUNDARY_PRESCRIBED_MOTION_SET\n4,3,2,5,2.0\n*DEFINE_CURVE\n5\n0,0\n1e-6,1e-3\n*LOAD_NODE_SET\n2,1,6,-3.0\n*LOAD_NODE_POINT\n6,1,6,-3.0\n*DEFINE_CURVE\n6\n0,1\n*LOAD_BODY_Z\n6,9810.\n*LOAD_SEGMENT\n6,2.0,0.0,1,2,3,4\n*LOAD_SEGMENT\n6,2.0,0.0,4,3,2,1\n";
    let model = good(&format!("{sets}{conditions}"));
    let of = |node: usize| model.setup.constraints[usize::from(model.constraint[node])];
    for node in 0..3 {
        let zero = Some(Drive::constant(0.0));
        assert_eq!(of(node).velocity, [zero, None, zero], "node {}", node + 1);
    }
    assert_eq!(of(3).velocity, [None; 3]);
    let curves = &model.setup.loads.curves;
    for node in 4..7 {
        let drive = of(node).velocity[2].expect("moved");
        // Twice the displacement of 1e-3 in 1e-6.
        assert!((drive.at(curves, 0.5e-6) - 2000.0).abs() < 1e-9);
        assert!((drive.integral(curves, 2e-6) - 2e-3).abs() < 1e-8);
    }
    // Node 6 is pushed by both keywords.
    let force = |node: usize| -> f64 {
        let forces = model.setup.loads.forces.iter().enumerate();
        forces.filter(|(f, _)| of(node).forces >> f & 1 == 1).map(|(_, f)| f.force[0]).sum()
    };
    assert_eq!([4, 5, 6, 7].map(force), [-3.0, -6.0, -3.0, 0.0]);
    let gravity = model.setup.loads.gravity.expect("gravity");
    assert_eq!(gravity.acceleration, [0.0, 0.0, -9810.0]);
    // The lower face, once from outside, once from inside.
    assert_eq!(model.setup.loads.surfaces.len(), 2);
}

#[test]
fn a_wall_stops_the_nodes_that_it_names() {
    let model = good("*SET_NODE_LIST\n1\n1,2\n*RIGIDWALL_PLANAR\n1\n0,0,-1,0,0,3\n");
    let of = |node: usize| model.setup.constraints[usize::from(model.constraint[node])].walls;
    assert_eq!([0, 1, 2, 7].map(of), [1, 1, 0, 0]);
    assert_eq!(model.setup.walls[0].parts, [false]);
    assert!(fault("*RIGIDWALL_PLANAR\n\n0,0,0.5,0,0,3\n").contains("behind it"));
}

#[test]
fn a_rigid_material_makes_a_body_of_its_part() {
    let rigid = |card: &str| {
        let elastic = "*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n";
        let text = cube("").replace(elastic, &format!("*MAT_RIGID\n1,7.85e-9,2.1e5,0.3\n{card}\n"));
        assert!(text.contains("MAT_RIGID"));
        read(&text).map_err(|faults| faults[0].to_string())
    };
    let model = rigid("1,4,7").expect("a good deck");
    let body = &model.setup.bodies[0];
    assert_eq!(body.parts, [0]);
    assert_eq!(body.velocity.map(|v| v.map(|v| v.factor)), [Some(0.0), Some(0.0), None]);
    assert_eq!(body.spin.map(|v| v.map(|v| v.factor)), [Some(0.0); 3]);
    assert!(rigid("-1,4,7").expect_err("a frame").contains("expected constraints along the axes"));
    assert!(rigid("1,8,7").expect_err("a code").contains("expected a number from 0 to 7"));
}

#[test]
fn what_cannot_be_honoured_is_refused_where_it_stands() {
    let refused = [
        ("*MAT_ADD_EROSION\n1,,-0.5\n", "a.k:23:4: read -0.5; expected MXPRES above 0"),
        (
            "*MAT_ADD_EROSION\n1,,,,-0.5\n",
            "a.k:23:6: read EFFEPS = -0.5; expected a material whose strength law yields",
        ),
        ("*MAT_ADD_EROSION\n1\n,,,,,1.0,2.0\n", "a.k:24:6: read 1.0; expected SIGTH blank: the impulse"),
        (
            "*MAT_ADD_EROSION\n1\n,,,,,,,3.0\n",
            "a.k:24:8: read 3.0; expected FAILTM blank: elements do not leave",
        ),
        ("*MAT_ADD_EROSION\n1\n\n1\n", "a.k:25:1: read 1; expected IDAM blank: damage models"),
        ("*MAT_ADD_EROSION\n1,,1.0,,,,,2\n", "a.k:23:12: read 2; expected NCS 0 or 1"),
        (
            "*PART\nmore\n2,1,2\n*MAT_PLASTIC_KINEMATIC\n2,7.85e-9,2.1e5,0.3,300.\n,,-0.8\n",
            "a.k:27:3: read -0.8; expected a failure strain of 0 or above",
        ),
        ("*CONTROL_CONTACT\n,,,,,,,3\n", "a.k:23:8: read 3; expected ENMASS 0, 1 or 2"),
        (
            "*PART\nmore\n2,1,2\n*MAT_SEATBELT\n2,1.0\n",
            "a.k:25:1: read *MAT_SEATBELT; expected a material of the table",
        ),
        (
            "*ELEMENT_SEATBELT\n1,1,1,2,3\n",
            "a.k:22:1: read *ELEMENT_SEATBELT; expected a keyword of the table",
        ),
        (
            "*CONTROL_IMPLICIT_GENERAL\n1\n",
            "a.k:22:1: read *CONTROL_IMPLICIT_GENERAL; expected explicit dynamics",
        ),
        (
            "*CONTACT_TIEBREAK_SURFACE_TO_SURFACE\n\n",
            "a.k:22:1: read a blank field; expected a strength of the tie above 0",
        ),
        ("*CONTACT_DRAWBEAD\n\n", "a.k:22:1: read *CONTACT_DRAWBEAD; expected a contact"),
        ("*ELEMENT_SOLID\n2,1,1,2,3,4,8,7,6,5\n", "a.k:23:1: read element 2 with volume"),
        (
            "*ELEMENT_SOLID\n2,1,1,2,3,4,5,6,7,99\n",
            "a.k:23:1: read element 2 with node 99; expected nodes of the deck",
        ),
        ("*ELEMENT_SOLID\n1,1,1,2,3,4,5,6,7,8\n", "a.k:23:1: read element 1; expected a number other than 1"),
        (
            "*NODE\n1,5.0\n",
            "a.k:23:1: read 1; expected a number other than 1, which line 12 has with another place",
        ),
        ("*SECTION_SOLID\n2,24\n", "a.k:23:3: read 24; expected ELFORM 1"),
        ("*BOUNDARY_SPC_SET\n5,0,1,1,1\n", "a.k:23:1: read set 5; expected a set of nodes of the deck"),
        ("*LOAD_NODE_POINT\n1,5,1,1.0\n", "a.k:23:3: read 5; expected DOF 1, 2 or 3"),
        ("*CONSTRAINED_JOINT_GEARS\n1,2,3,4\n", "a.k:22:1: read *CONSTRAINED_JOINT_GEARS"),
        (
            "*SET_NODE_ADD\n1\n1\n*BOUNDARY_SPC_SET\n1,0,1\n",
            "a.k:23:1: read set 1; expected sets that do not hold themselves",
        ),
        (
            "*CONTACT_AUTOMATIC_SINGLE_SURFACE\n1,0,3\n0.1,0.1,0,0,0,0,1e-7\n",
            "a.k:24:17: read 1e-7; expected a birth time of 0",
        ),
    ];
    for (more, expected) in refused {
        let found = fault(more);
        assert!(found.starts_with(expected), "{found}");
    }
    let empty = read("*KEYWORD\n*END\n").expect_err("nothing in it");
    assert!(lines(&empty).contains("expected *ELEMENT_SOLID"), "{}", lines(&empty));
}

#[test]
fn every_bad_keyword_deck_gives_exactly_its_faults() {
    let path = folder("../tests/decks/bad");
    let mut seen = 0;
    for entry in fs::read_dir(&path).expect("the folder is in the repository") {
        let name = entry.expect("a file").file_name().to_string_lossy().into_owned();
        if !name.ends_with(".k") {
            continue;
        }
        seen += 1;
        let text = fs::read_to_string(Path::new(&path).join(&name)).expect("a deck is text");
        let expected: Vec<String> =
            text.lines().filter_map(|line| line.strip_prefix("$ expect: ")).map(str::to_string).collect();
        assert!(!expected.is_empty(), "{name} expects nothing");
        let faults = deck::read(&gathered(&path, &name, &Options::default()), &name).expect_err("a bad deck");
        let found: Vec<String> = faults.iter().map(ToString::to_string).collect();
        assert_eq!(found, expected, "{name}");
    }
    assert!(seen >= 3, "only {seen} bad keyword decks");
}

#[test]
fn a_parameter_from_outside_replaces_that_of_the_deck_and_expressions_follow() {
    let text = "*KEYWORD\n*PARAMETER\nRv,5.0,Rhalf,1.0\n*PARAMETER_EXPRESSION\nRend,&v*2\n*CONTROL_TERMINATION\n&end\n*PART\ncube\n1,1,1\n\
                *SECTION_SOLID\n1,1\n*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n\
                8,0,1,1\n*ELEMENT_SOLID\n1,1,1,2,3,4,5,6,7,8\n*END\n";
    let read = |name: &str, value: f64| {
        let options = Options { parameters: [(name.to_string(), value)].into(), ..Options::default() };
        let text = bundle::gather("a.k", text.to_string(), &options, &mut |_| None).expect("one file");
        deck::read(&text, "a.k")
    };
    let end = read("v", 50.0).expect("a good deck").setup.control.end_time;
    assert_eq!(end.to_bits(), 100.0_f64.to_bits(), "{end}");
    let faults = read("w", 1.0).expect_err("no such parameter");
    assert_eq!(
        lines(&faults),
        "a.k:1:1: read a deck without a *PARAMETER w; expected w, which is given, as a parameter of the deck; define it in the deck, or do not \
         give it"
    );
}
