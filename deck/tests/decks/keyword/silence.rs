//! What the reader of keyword decks once passed over in silence: second sets of cards, second definitions, fields, and what never ends.

use deck::{
    Model, Reading,
    bundle::{self, Options},
};
use mechanics::load::SurfaceKind;

use super::{cube, fault, good, lines, read};

/// The model of a deck and its warnings, in one text.
fn whole(text: &str) -> (Model, String) {
    let Reading { model, warnings, .. } =
        deck::read_whole(text, "a.k").unwrap_or_else(|faults| panic!("{}\n{text}", lines(&faults)));
    (model, warnings.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
}

fn faults(text: &str) -> Vec<String> {
    read(text).expect_err("a fault").iter().map(ToString::to_string).collect()
}

/// The small deck with shells in place of its solid.
fn sheet(section: &str, element: &str, more: &str) -> String {
    cube(more).replace("*SECTION_SOLID\n1,1\n", section).replace(
        "*ELEMENT_SOLID\n       1       1       1       2       3       4       5       6       7       8\n",
        element,
    )
}

const SHELL: &str = "*ELEMENT_SHELL\n1,1,1,2,3,4\n";
const FIRST: &str = "0\n0,0,50,0,0,40,0\n";
const SECOND: &str = "0\n0,0,-1,0,0,0,0\n";

#[test]
fn every_wall_under_one_keyword_stands() {
    let apart = good(&format!("*RIGIDWALL_PLANAR\n{FIRST}*RIGIDWALL_PLANAR\n{SECOND}"));
    assert_eq!(apart.setup.walls.len(), 2);
    assert_eq!(good(&format!("*RIGIDWALL_PLANAR\n{FIRST}{SECOND}")), apart);
    assert_eq!(good(&format!("*RIGIDWALL_PLANAR_ID\n1,one\n{FIRST}2,two\n{SECOND}")), apart);
    assert_eq!(good(&format!("*RIGIDWALL_PLANAR_FORCES\n{FIRST}10,0,1,2,3,4\n{SECOND}0\n")), apart);
    let moving = |first: &str| format!("*RIGIDWALL_PLANAR_MOVING\n{FIRST}1.0,5.0\n{first}{SECOND}2.0,6.0\n");
    assert_eq!(good(&moving("")), good(&moving("*RIGIDWALL_PLANAR_MOVING\n")));
}

#[test]
fn every_cross_section_under_one_keyword_is_written() {
    let model =
        good("*DATABASE_CROSS_SECTION_PLANE_ID\n1,first\n0,0,0,0.25,0,0,1\n\n2,second\n0,0,0,0.75,0,0,2\n\n");
    let names: Vec<&str> = model.output.sections.iter().map(|section| section.name.as_str()).collect();
    assert_eq!(names, ["first", "second"]);
    let two = good("*DATABASE_CROSS_SECTION_PLANE\n0,0,0,0.25,0,0,1\n\n0,0,0,0.75,0,0,2\n");
    assert_eq!(two.output.sections.len(), 2);
}

#[test]
fn every_coordinate_system_under_one_keyword_is_known() {
    let along_y = |systems: &str| {
        let model = good(&format!("{systems}*INITIAL_VELOCITY_NODE\n5,1.0,0,0,0,0,0,2\n"));
        assert!(model.velocity.contains(&[0.0, 1.0, 0.0]), "{:?}", model.velocity);
    };
    along_y("*DEFINE_COORDINATE_SYSTEM\n1,0,0,0,1,0,0\n0,1,0\n2,0,0,0,0,1,0\n-1,0,0\n");
    along_y("*DEFINE_COORDINATE_SYSTEM_TITLE\none\n1,0,0,0,1,0,0\n0,1,0\ntwo\n2,0,0,0,0,1,0\n-1,0,0\n");
    along_y("*DEFINE_COORDINATE_NODES\n1,1,2,4\n2,1,4,2\n");
    along_y("*DEFINE_COORDINATE_VECTOR\n1,1,0,0,0,1,0\n2,0,1,0,-1,0,0\n");
    // Which axis the second node is on.
    assert!(fault("*DEFINE_COORDINATE_NODES\n7,1,2,4,0,Y\n").contains("read Y; expected DIR X"));
    good("*DEFINE_COORDINATE_NODES\n7,1,2,4,0,X\n");
}

#[test]
fn a_card_that_nobody_reads_is_a_fault_of_its_keyword() {
    for (more, keyword, line) in [
        ("*DAMPING_GLOBAL\n0,50\n0,60\n", "DAMPING_GLOBAL", 24),
        ("*EOS_GRUNEISEN\n2,1.48e6,1.75,,,0.28\n\n1,1.48e6,1.75,,,0.28\n", "EOS_GRUNEISEN", 25),
        ("*EOS_JWL\n1,3.7e5,3.2e3,4.15,0.95,0.3,7e3\n2,3.7e5,3.2e3,4.15,0.95,0.3,7e3\n", "EOS_JWL", 24),
        ("*INITIAL_VELOCITY\n0\n1,0,0\n0\n2,0,0\n", "INITIAL_VELOCITY", 26),
        ("*CONTROL_UNITS\nmm,s,mtrc_ton\nfurlong\n", "CONTROL_UNITS", 24),
    ] {
        let told = faults(&cube(more));
        assert_eq!(told.len(), 1, "{told:#?}");
        assert!(told[0].starts_with(&format!("a.k:{line}:1: read ")), "{told:?}");
        assert!(told[0].contains(&format!("expected no further card of *{keyword}")), "{told:?}");
        assert!(told[0].ends_with("write the keyword again before each set of cards, or take the card out"));
    }
    let two = cube("").replace("0.3\n*NODE", "0.3\n2,2.7e-9,7e4,0.3\n*NODE");
    assert!(faults(&two)[0].contains("no further card of *MAT_ELASTIC"), "{:?}", faults(&two));
    // Also where the first set is that of no part.
    let unused = two.replace("\n1,7.85e-9", "\n3,7.85e-9").replace("\n2,2.7e-9", "\n1,2.7e-9");
    assert!(faults(&unused).iter().any(|fault| fault.contains("no further card of *MAT_ELASTIC")));
    good("*MAT_ELASTIC\n3,7.85e-9,2.1e5,0.3\n*MAT_WOOD\n4,1,2,3\n5,6,7\n");
    // Cards of zeros, those of other programs and those that a law does without are no further ones.
    for fine in [
        "*DAMPING_GLOBAL\n0,50\n0,0.0\n",
        "*CONTROL_TIMESTEP\n0,0.9\n0,0,0,0,1\n",
        "*DATABASE_BINARY_D3PLOT\n1e-7\n0,0,1\n",
        "*SET_TSHELL_LIST\n1\n2,3\n",
        "*ELEMENT_PLOTEL\n1,1,2\n",
        "*TITLE\nname\nmore\n",
    ] {
        good(fine);
    }
    let rigid = cube("")
        .replace("*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n", "*MAT_RIGID\n1,7.85e-9,2.1e5,0.3\n1,7,7\n5,1,0\n");
    whole(&rigid);
}

#[test]
fn sets_that_name_each_other_are_one_fault_and_nested_ones_end() {
    let told = faults(&cube(
        "*SET_NODE_ADD\n1\n2,2,2\n*SET_NODE_ADD\n2\n1,1,1\n*BOUNDARY_SPC_SET\n1,0,1\n1,0,0,1\n",
    ));
    assert_eq!(told.len(), 1, "{told:#?}");
    assert!(told[0].contains("set 1, which names set 2, which names set 1 again"), "{told:?}");
    let eight = |id: u32| vec![id.to_string(); 8].join(",");
    let mut nested: String = (1..18).map(|id| format!("*SET_NODE_ADD\n{id}\n{}\n", eight(id + 1))).collect();
    nested += "*SET_NODE_LIST\n18\n1,2\n*BOUNDARY_SPC_SET\n1,0,1\n";
    assert_eq!(good(&nested).constraint.iter().filter(|c| **c != 0).count(), 2);
    let mut crossed = String::new();
    for id in 1..18 {
        crossed += &format!(
            "*SET_NODE_ADD\n{id}\n{0},{1}\n*SET_NODE_ADD\n{2}\n{1},{0}\n",
            id + 1,
            id + 101,
            id + 100
        );
    }
    crossed += "*SET_NODE_LIST\n18\n1,2\n*SET_NODE_LIST\n118\n3\n*BOUNDARY_SPC_SET\n1,0,1\n";
    assert_eq!(good(&crossed).constraint.iter().filter(|c| **c != 0).count(), 3);
}

/// The velocity along z of the small deck after some keywords, and its warnings.
fn speed(keywords: &str) -> (f64, String) {
    let (model, warnings) =
        whole(&cube(&format!("{keywords}*INITIAL_VELOCITY_GENERATION\n1,2,0,0,0,&v\n0\n")));
    (model.velocity[0][2], warnings)
}

#[test]
fn a_parameter_that_is_defined_again_is_told_and_follows_dflag() {
    let twice = |flag: &str| format!("{flag}*PARAMETER\nRv,-1000.0\n*PARAMETER\nRv,-5.0\n");
    for (flag, value, warned) in [
        ("", -1000.0, true),
        ("*PARAMETER_DUPLICATION\n1\n", -1000.0, true),
        ("*PARAMETER_DUPLICATION\n2\n", -5.0, true),
        ("*PARAMETER_DUPLICATION\n         4\n", -5.0, false),
        ("*PARAMETER_DUPLICATION\n5\n", -1000.0, false),
    ] {
        let (speed, warnings) = speed(&twice(flag));
        assert_eq!((speed, warnings.contains("parameter v:")), (value, warned), "{flag} {warnings}");
    }
    let refused = faults(&cube(&twice("*PARAMETER_DUPLICATION\n3\n")));
    assert!(refused.len() == 1 && refused[0].contains("one definition of each parameter"), "{refused:?}");
    let unknown = faults(&cube("*PARAMETER_DUPLICATION\n6\n"));
    assert!(
        unknown[0].contains("read 6 (card 1 of *PARAMETER_DUPLICATION); expected DFLAG 1 to 5"),
        "{unknown:?}"
    );
    // What stands above a definition has the value from before.
    let (model, _) = whole(&cube(
        "*PARAMETER\nRv,-1000.0\n*INITIAL_VELOCITY_GENERATION\n1,2,0,0,0,&v\n0\n*PARAMETER_DUPLICATION\n2\n*PARAMETER\nRv,-5.0\n",
    ));
    assert_eq!(model.velocity[0][2], -1000.0);
}

#[test]
fn a_local_parameter_ends_with_its_file() {
    let main = cube("*PARAMETER\nRv,-1000.0\n*INCLUDE\nb.k\n*INITIAL_VELOCITY_NODE\n2,0,0,&v\n");
    let inner = "*PARAMETER_LOCAL\nRv,-7.0\n*PARAMETER_EXPRESSION_LOCAL\nRw,2*v\n*INITIAL_VELOCITY_NODE\n1,0,0,&v\n3,0,0,&w\n*END\n";
    let mut open = |path: &str| (path == "b.k").then(|| inner.to_string());
    let text = bundle::gather("a.k", main, &Options::default(), &mut open).expect("two files");
    let (model, warnings) = whole(&text);
    let along_z: Vec<f64> = model.velocity.iter().take(3).map(|v| v[2]).collect();
    assert_eq!(along_z, [-7.0, -1000.0, -14.0], "{warnings}");
    assert!(!warnings.contains("parameter"), "{warnings}");
    let text = text.replace("2,0,0,&v", "2,0,0,&w");
    assert!(faults(&text)[0].contains("there is no parameter w before it"), "{:?}", faults(&text));
}

#[test]
fn expressions_are_those_of_ls_dyna() {
    for (cards, value) in [
        ("Rv         -3**2\n", 9.0),
        ("Rv,2/5\n", 0.0),
        ("Rv         -max(3,5)\n", -5.0),
        ("Rv,-max(3,5)\n", -5.0),
        ("Rv         -(3+\n           5)\n", -8.0),
    ] {
        assert_eq!(speed(&format!("*PARAMETER_EXPRESSION\n{cards}")).0, value, "{cards}");
    }
    assert_eq!(speed("*PARAMETER\nIn,7\n*PARAMETER_EXPRESSION\nRv,-n/2\n").0, -3.0);
    assert_eq!(speed("*PARAMETER\nRn,7\n*PARAMETER_EXPRESSION\nRv,-n/2\n").0, -3.5);
}

#[test]
fn a_number_that_two_of_a_kind_have_is_a_fault() {
    let curve = "*DEFINE_CURVE\n5\n0,1\n";
    let hourglass = "*HOURGLASS\n5,4\n";
    let frame = "*DEFINE_BOX\n5,0,1,0,1,0,1\n";
    let eos = "*EOS_GRUNEISEN\n5,1.48e6,1.75,,,0.28\n";
    let system = "*DEFINE_COORDINATE_VECTOR\n5,1,0,0,0,1,0\n";
    let vector = "*DEFINE_VECTOR\n5,0,0,0,0,0,1\n";
    for (set, what) in [
        (curve, "curve"),
        (hourglass, "*HOURGLASS"),
        (frame, "box"),
        (eos, "*EOS"),
        (system, "coordinate system"),
        (vector, "vector"),
        ("*SECTION_SOLID\n5,1\n", "section"),
    ] {
        good(set);
        let told = faults(&cube(&format!("{set}{set}")));
        let expected = format!("expected a {what} number other than 5, which line 23 has; renumber one");
        assert!(told.len() == 1 && told[0].ends_with(&expected), "{told:#?}");
    }
    // Sections of all elements are numbered together.
    let told = faults(&cube("*SECTION_SHELL\n1,2\n0.5\n"));
    let expected =
        "a.k:23:1: read 1 (field 1, card 1 of *SECTION_SHELL); expected a section number other than 1";
    assert!(told.iter().any(|fault| fault.starts_with(expected)), "{told:#?}");
}

#[test]
fn erosion_needs_its_material() {
    let erosion = "*MAT_ADD_EROSION\n77,0,0,0,0,0,1\n0,500.0\n";
    let told = faults(&cube(erosion));
    assert_eq!(
        told,
        [
            "a.k:23:1: read MID = 77 (card 1 of *MAT_ADD_EROSION); expected a material of the deck; add the *MAT, or correct the number"
        ]
    );
    // One that no part has does no harm.
    good(&format!("{erosion}*MAT_ELASTIC\n77,7.85e-9,2.1e5,0.3\n"));
}

#[test]
fn a_wedge_says_which_of_its_nodes_are_twice() {
    let of = |nodes: &str| {
        cube("").replace(
            "       1       1       1       2       3       4       5       6       7       8\n",
            nodes,
        )
    };
    let told = faults(&of("1,1,1,2,3,4,5,8\n"));
    assert!(told[0].contains("the fifth and the sixth node of a wedge twice each"), "{told:?}");
    whole(&of("1,1,1,2,3,4,5,5,8,8\n"));
    // A pyramid and a tetrahedron need no more.
    whole(&of("1,1,1,2,3,4,5\n"));
    whole(&of("1,1,1,2,3,5\n"));
}

#[test]
fn fields_of_sections_and_elements_are_honoured_or_refused() {
    let plain = "*SECTION_SHELL\n1,2\n0.5\n";
    let (model, warnings) = whole(&sheet(plain, SHELL, ""));
    for (section, element, expected) in [
        ("*SECTION_SHELL\n1,2\n0.5,,,,,5e-9\n", SHELL, "no MAREA"),
        (plain, "*ELEMENT_SHELL_THICKNESS\n1,1,1,2,3,4\n0.5,0.5,0.5,0.5,30.0\n", "BETA 0"),
        ("*SECTION_BEAM\n1,1,0.833,2,0,0,5e-9\n1.0,1.0,1.0,1.0\n", "*ELEMENT_BEAM\n1,1,1,2,3\n", "no NSM"),
    ] {
        let told = faults(&sheet(section, element, ""));
        assert!(told.len() == 1 && told[0].contains(expected), "{told:#?}");
    }
    for fine in ["", "1.0", "0.8333", "0.833"] {
        assert_eq!(
            whole(&sheet(&format!("*SECTION_SHELL\n1,2,{fine}\n0.5\n"), SHELL, "")),
            (model.clone(), warnings.clone())
        );
    }
    let half = whole(&sheet("*SECTION_SHELL\n1,2,0.5\n0.5\n", SHELL, ""));
    assert!(half.1.contains("SHRF 0.5: the factor of transverse shear is 5/6"), "{}", half.1);
    // Sections that say themselves which shell they are do not mind THEORY.
    let theory = "*CONTROL_SHELL\n20.0,1,-1,1,16\n";
    whole(&sheet(plain, SHELL, theory));
    let told = faults(&sheet("*SECTION_SHELL\n1\n0.5\n", SHELL, theory));
    assert!(told.len() == 1 && told[0].contains("read THEORY = 16"), "{told:#?}");
}

#[test]
fn fields_of_materials_and_controls_are_honoured_or_refused() {
    let steel = |first: &str, fourth: &str| {
        let law = format!(
            "*MAT_JOHNSON_COOK\n1,7.85e-9,8e4,2.1e5,0.3{first}\n300,500,0.3,0.02,1.0,1800,293,1.0\n4.5e8,,,,0.1,0.2,1.5,0.01\n{fourth}\n"
        );
        let eos = "*EOS_GRUNEISEN\n1,4.5e6,1.49,,,2.0\n";
        cube(eos).replace("*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n", &law).replace("\n1,1,1\n", "\n1,1,1,1\n")
    };
    whole(&steel("", "0.5,,,1e-6"));
    assert!(faults(&steel(",0,0,2", "0.5"))[0].contains("RATEOP 0"));
    assert!(faults(&steel("", "0.5,,,0.05"))[0].contains("no EFMIN"));
    assert!(whole(&steel(",0,1", "0.5")).1.contains("VP: the rate of the whole"));
    for (more, words) in [
        ("*CONTROL_BULK_VISCOSITY\n1.5,0.06,2\n", "TYPE 2: bulk viscosity"),
        ("*CONTROL_BULK_VISCOSITY\n1.5,0.06,1\n", ""),
    ] {
        let warnings = whole(&cube(more)).1;
        assert!(warnings.contains(words) && warnings.is_empty() == words.is_empty(), "{warnings}");
    }
    assert!(fault("*CONTROL_TIMESTEP\n0,1.2\n").contains("a factor above 0 and at most 1"));
    good("*CONTROL_TIMESTEP\n0,1.0\n");
    let with =
        |card: &str| cube(&format!("*HOURGLASS\n3,4,0.05,0,{card}\n")).replace("\n1,1,1\n", "\n1,1,1,0,3\n");
    let words = "Q1 0.3, Q2 0.01: bulk viscosity is that of the deck, 1.5 and 0.06";
    assert!(whole(&with("0.3,0.01")).1.contains(words), "{}", whole(&with("0.3,0.01")).1);
    for same in ["", "1.5,0.06"] {
        assert!(!whole(&with(same)).1.contains("bulk viscosity"), "{same}");
    }
}

#[test]
fn a_composite_with_a_heading_has_its_angles() {
    let law = "*MAT_ENHANCED_COMPOSITE_DAMAGE\n1,1.5e-9,130000,9000,9000,0.02,0.02,0.3\n5000,3000,5000,,0\n\n\n\n1000,2000,200,50,80,54,0\n";
    let deck = |section: &str| sheet(section, SHELL, "").replace("*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n", law);
    let cards = "1,2,0.833,4,0,0,1\n1.0,1.0,1.0,1.0\n0,45,-45,90\n";
    let plain = whole(&deck(&format!("*SECTION_SHELL\n{cards}")));
    let headed = whole(&deck(&format!("*SECTION_SHELL_TITLE\nlayup\n{cards}")));
    assert_eq!(headed.0, plain.0);
    let two = whole(&deck(&format!("*SECTION_SHELL_TITLE\nlayup\n{cards}other\n2,2\n1.0\n")));
    assert_eq!(two.0, plain.0);
}

#[test]
fn pressure_acts_on_faces_of_tetrahedra_and_wedges() {
    let curve = "*DEFINE_CURVE\n5\n0,1\n1,1\n";
    let of = |nodes: &str, face: &str| {
        cube(&format!("{curve}*LOAD_SEGMENT\n5,1.0,0,{face}\n")).replace(
            "       1       1       1       2       3       4       5       6       7       8\n",
            nodes,
        )
    };
    let (tetrahedron, wedge) = ("1,1,1,2,3,5,5,5,5,5\n", "1,1,1,2,3,4,5,5,8,8\n");
    for (nodes, inward, outward) in [
        (tetrahedron, "1,2,3,3", "1,3,2,2"),
        (tetrahedron, "1,3,5,5", "1,5,3,3"),
        (tetrahedron, "5,2,1,1", "5,1,2,2"),
        (wedge, "5,2,1,1", "5,1,2,2"),
        (wedge, "1,2,3,4", "4,3,2,1"),
        (wedge, "2,5,8,3", "2,3,8,5"),
    ] {
        let factors = [inward, outward].map(|face| {
            let model = whole(&of(nodes, face)).0;
            let surfaces = &model.setup.loads.surfaces;
            assert_eq!(surfaces.len(), 1, "{nodes} {face}");
            format!("{surfaces:?}")
        });
        assert_ne!(factors[0], factors[1], "{nodes} {inward}");
    }
    assert!(faults(&of(tetrahedron, "1,2,3,5"))[0].contains("an outer face of a solid"));
}

#[test]
fn the_second_card_of_mpp_and_the_factor_of_friction_are_read() {
    let other = "*PART\nother\n2,1,1\n*NODE\n11,0,0,2\n12,1,0,2\n13,1,1,2\n14,0,1,2\n15,0,0,3\n16,1,0,3\n17,1,1,3\n18,0,1,3\n\
                 *ELEMENT_SOLID\n2,2,11,12,13,14,15,16,17,18\n";
    let contact = |words: &str, before: &str, third: &str| {
        whole(&cube(&format!(
            "{other}*CONTACT_AUTOMATIC_SURFACE_TO_SURFACE{words}\n{before}1,2,3,3\n0.3,0.2,0.1\n{third}\n"
        )))
    };
    let plain = contact("", "", "");
    for before in ["0,200\n", "0,200\n&,0,0\n"] {
        assert_eq!(contact("_MPP", before, "").0, plain.0, "{before}");
        assert_eq!(contact("_MPP_ID", &format!("7,name\n{before}"), "").0, plain.0, "{before}");
    }
    let friction = |third: &str| contact("", "", third).0.setup.contact.expect("contact").friction;
    let (whole, half) = (friction(""), friction("1,1,0,0,1,1,0.5,1"));
    assert!(whole.contains(&0.3), "{whole:?}");
    assert_eq!(half, whole.iter().map(|mu| 0.5 * mu).collect::<Vec<_>>());
    assert_eq!(friction("1,1,0,0,1,1,1.0,1"), whole);
}

#[test]
fn long_says_how_wide_fields_are() {
    let plain = whole(&cube("")).0;
    for standard in ["*KEYWORD LONG=S\n", "*KEYWORD LONG=N\n"] {
        assert_eq!(whole(&cube("").replace("*KEYWORD\n", standard)).0, plain);
    }
    let long = "*KEYWORD LONG=K\n*CONTROL_TERMINATION\n                1e-6\n";
    assert!(faults(long).iter().all(|fault| !fault.contains("end time")), "{:?}", faults(long));
    let told = faults(&cube("").replace("*KEYWORD\n", "*KEYWORD LONG=X\n"));
    assert!(told[0].contains("expected LONG=Y, K, S or N"), "{told:?}");
}

#[test]
fn states_come_by_their_period_or_their_number() {
    let told = |card: &str| whole(&cube(&format!("*DATABASE_BINARY_D3PLOT\n{card}\n")));
    for (card, period) in
        [("1e-7", 1e-7), (",,,20", 1e-6 / 20.0), ("0,0,0,20", 1e-6 / 20.0), ("1e-7,,,4", 1e-6 / 4.0)]
    {
        let (model, warnings) = told(card);
        assert_eq!((model.output.period, warnings.as_str()), (Some(period), ""), "{card}");
    }
    let (model, warnings) = told(",3");
    assert!(model.output.period.is_none() && warnings.contains("LCDT: no curve says"), "{warnings}");
}

#[test]
fn pressure_acts_on_shells_against_the_normal_of_their_segments() {
    let curve = "*DEFINE_CURVE\n5\n0,1\n1,1\n*SET_SHELL_LIST\n7\n1\n*SET_SEGMENT\n8\n4,3,2,1\n";
    let of = |load: &str| sheet("*SECTION_SHELL\n1,2\n0.5\n", SHELL, &format!("{curve}*LOAD_{load}\n"));
    for (load, factor) in [
        ("SHELL_ELEMENT\n1,5,3.0", 3.0),
        ("SHELL_ELEMENT_ID\n9,name\n1,5,3.0", 3.0),
        ("SHELL_SET\n7,5,-3.0", -3.0),
        ("SEGMENT\n5,3.0,0,1,2,3,4", 3.0),
        ("SEGMENT\n5,3.0,0,3,2,1,4", -3.0),
        ("SEGMENT_SET\n8,5,3.0", -3.0),
    ] {
        let model = whole(&of(load)).0;
        let [surface] = &model.setup.loads.surfaces[..] else { panic!("one load: {load}") };
        let SurfaceKind::Pressure(drive) = surface.kind else { panic!("a pressure: {load}") };
        assert_eq!((drive.factor, surface.faces.len()), (factor, 1), "{load}");
        assert_eq!(format!("{:?}", super::converted(&of(load), "a.k")), format!("{model:?}"), "{load}");
    }
    assert!(
        faults(&of("SHELL_ELEMENT\n2,5"))[0].contains("read shell 2"),
        "{:?}",
        faults(&of("SHELL_ELEMENT\n2,5"))
    );
    assert!(faults(&of("SHELL_SET\n9,5"))[0].contains("a set of shells of the deck"));
    assert!(faults(&of("SHELL_ELEMENT\n1,-2"))[0].contains("read -2"));
    assert!(faults(&of("SHELL_ELEMENT\n1,5,1,1e-7"))[0].contains("an arrival time of 0"));
}
