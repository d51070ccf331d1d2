//! Fields that mean something else in LS-DYNA than they seem to: defaults, exclusion numbers, offsets, rules of points.

use deck::{Model, Reading};
use mechanics::{
    element::shell4::Rule,
    material::{Eos, Strength},
};

use super::{cube, fault, lines, square};

fn whole(text: &str) -> (Model, String) {
    let Reading { model, warnings, .. } =
        deck::read_whole(text, "a.k").unwrap_or_else(|faults| panic!("{}\n{text}", lines(&faults)));
    (model, warnings.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
}

fn told(text: &str) -> String {
    lines(&deck::read(text, "a.k").expect_err("a fault"))
}

/// The small deck of another material, of the equation of state `eos`.
fn of(material: &str, more: &str) -> String {
    cube(more).replace("*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n", material)
}

const SECTION: &str = "*SECTION_SHELL\n1,2,1.0,3\n1.0,1.0,1.0,1.0\n";

#[test]
fn an_equation_of_state_is_left_out_where_the_material_has_none() {
    let eos = "*EOS_GRUNEISEN\n5,4.5e6,1.49,,,2.0\n";
    for material in [
        "*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n",
        "*MAT_PLASTIC_KINEMATIC\n1,7.85e-9,2.1e5,0.3,300.,1000.\n",
        "*MAT_RIGID\n1,7.85e-9,2.1e5,0.3\n\n\n",
        "*MAT_PIECEWISE_LINEAR_PLASTICITY\n1,7.85e-9,2.1e5,0.3,300.\n",
        "*MAT_SIMPLIFIED_JOHNSON_COOK\n1,7.85e-9,2.1e5,0.3\n300,500,0.3,0.01\n",
    ] {
        let (model, warnings) = whole(&of(material, eos).replace("\n1,1,1\n", "\n1,1,1,5\n"));
        let Eos::Linear { bulk } = model.setup.materials[0].eos else { panic!("{material}") };
        assert!((bulk / (2.1e5 / 1.2) - 1.0).abs() < 1e-12, "{material}");
        assert!(warnings.contains("EOSID 5: material 1 makes its pressure of E and PR"), "{warnings}");
    }
}

#[test]
fn points_through_the_thickness_are_those_of_qr_and_intgrd() {
    let rule = |section: &str, more: &str| {
        let (model, warnings) = whole(&square(section, more));
        (model.mesh.parts[0].section().map(|section| section.rule), warnings)
    };
    let lobatto = "*CONTROL_SHELL\n20,0,-1,0,2\n1,1\n";
    assert_eq!(rule(SECTION, "").0, Some(Rule::Gauss(3)));
    assert_eq!(rule(SECTION, lobatto).0, Some(Rule::Lobatto(3)));
    // Of two points both rules are that of Gauss.
    assert_eq!(rule(&SECTION.replace("1.0,3", "1.0,2"), lobatto).0, Some(Rule::Gauss(2)));
    let (trapezoid, warnings) = rule(&SECTION.replace("1.0,3", "1.0,3,0,1"), "");
    assert_eq!(trapezoid, Some(Rule::Lobatto(3)));
    assert!(warnings.contains("QR 1, a trapezoidal rule"), "{warnings}");
}

#[test]
fn a_yield_curve_goes_back_to_strain_0() {
    let first = |points: &str| {
        let card = "*MAT_PIECEWISE_LINEAR_PLASTICITY\n1,7.85e-9,2.1e5,0.3\n\n";
        let (model, warnings) = whole(&of(&format!("{card}{points}"), ""));
        let Strength::Tabulated { hardening, .. } = model.setup.materials[0].strength else {
            panic!("a curve")
        };
        ([hardening.strain[0], hardening.stress[0], hardening.stress[1]], warnings)
    };
    assert_eq!(first("0.1,0.3\n320,340\n").0, [0.0, 310.0, 320.0]);
    let (kept, warnings) = first("0.1,0.2\n100,300\n");
    assert_eq!(kept, [0.0, 100.0, 300.0]);
    assert!(warnings.contains("comes to no stress at 0"), "{warnings}");
    let (_, warnings) = first("-0.1,0.0,0.2\n100,200,300\n");
    assert!(warnings.contains("1 points of a curve by strain lie below strain 0"), "{warnings}");
}

#[test]
fn bulk_viscosity_of_0_is_the_usual_one() {
    for more in ["0.0,0.0,1", "", "1.5,0.06"] {
        assert_eq!(
            whole(&cube(&format!("*CONTROL_BULK_VISCOSITY\n{more}\n"))).0,
            whole(&cube("")).0,
            "{more}"
        );
    }
}

#[test]
fn a_curve_of_time_that_is_offset_is_0_before_it() {
    let points = |offset: &str, meaning: u32| {
        let more = format!(
            "*DEFINE_CURVE\n3,0,1,1,{offset}\n0,1000\n1,1000\n*BOUNDARY_PRESCRIBED_MOTION_NODE\n5,3,{meaning},3,1.0\n"
        );
        let (model, warnings) = whole(&cube(&more));
        (model.setup.loads.curves[0].points.clone(), warnings)
    };
    let at = |points: &[[f64; 2]], t: f64| points.iter().rfind(|p| p[0] <= t).map(|p| p[1]);
    assert_eq!(points("", 0).0, [[0.0, 1000.0], [1.0, 1000.0]]);
    assert_eq!(points("0.5", 0).0, [[0.0, 0.0], [0.4995, 0.0], [0.5, 1000.0], [1.5, 1000.0]]);
    // A displacement that is there at the start.
    let (_, warnings) = points("", 2);
    assert!(warnings.contains("curve 3 of a displacement is 1000 at time 0"), "{warnings}");
    let (later, warnings) = points("0.5", 2);
    assert!(!warnings.contains("displacement"), "{warnings}");
    assert!(at(&later, 0.2) == Some(0.0) && at(&later, 0.4999).is_some_and(|v| v > 0.0), "{later:?}");
}

#[test]
fn a_limit_of_0_beside_an_exclusion_number_is_told() {
    let card = |second: &str| format!("*MAT_ADD_EROSION\n1,1234,0.5,1234,1234,1234\n{second}\n");
    let zero = fault(&card("0.0,1234,1234,1234,1234"));
    assert!(zero.contains("with EXCL a limit of 0 lets elements leave"), "{zero}");
    let (_, warnings) = whole(&cube(&card("1234,1234,0,1234,1234")));
    assert!(warnings.contains("SIGVM: with EXCL 1234 a field of 0 is a limit in LS-DYNA"), "{warnings}");
    let (_, warnings) = whole(&cube(&card("1234,1234,1234,1234,1234")));
    assert!(!warnings.contains("EXCL"), "{warnings}");
}

#[test]
fn hourglass_control_of_shells_is_told() {
    let part = square(SECTION, "*HOURGLASS\n7,8,0.1\n").replace("\n1,1,1\n", "\n1,1,1,0,7\n");
    assert!(whole(&part).1.contains("HGID 7: shells have a hourglass control of their own"));
    let deck = whole(&square(SECTION, "*CONTROL_HOURGLASS\n4,0.05\n")).1;
    assert!(deck.contains("shells have a hourglass control of their own, whatever IHQ and QH"), "{deck}");
    assert!(!whole(&cube("*CONTROL_HOURGLASS\n4,0.05\n")).1.contains("shells"));
}

#[test]
fn shells_of_psstupd_thin_alone_or_do_not() {
    let thins = |set: i32| {
        let more =
            format!("*SET_PART_LIST\n9\n1\n*SET_PART_LIST\n8\n\n*CONTROL_SHELL\n20,0,-1,1,2\n1,0\n{set}\n");
        whole(&square(SECTION, &more)).0.mesh.parts[0].section().is_some_and(|section| section.thins)
    };
    assert_eq!([0, 9, -9, 8, -8].map(thins), [true, true, false, false, true]);
    let nfail = whole(&square(SECTION, "*CONTROL_SHELL\n20,0,-1,1,2\n\n\n1,1\n")).1;
    assert!(nfail.contains("NFAIL1, NFAIL4"), "{nfail}");
}

#[test]
fn corners_of_a_section_without_a_thickness_have_the_first() {
    let thickness = |card: &str| {
        let section = SECTION.replace("1.0,1.0,1.0,1.0", card);
        whole(&square(&section, "")).0.mesh.parts[0].section().map(|section| section.thickness)
    };
    assert_eq!(thickness("1.0"), Some(1.0));
    assert_eq!(thickness("1.0,3.0"), Some(1.5));
    assert_eq!(thickness("1.0,2.0,3.0,2.0"), Some(2.0));
}

#[test]
fn what_was_passed_over_in_silence_is_a_warning() {
    for (more, words) in [
        ("*CONTROL_TIMESTEP\n1e-9,0.9\n", "DTINIT"),
        ("*CONTROL_TERMINATION\n1e-6,0,0.1\n", "DTMIN"),
        ("*CONTROL_TERMINATION\n5e-6\n", "a second *CONTROL_TERMINATION, other than that of line 2"),
        ("*SET_PART_LIST\n7\n1\n*CONTACT_AUTOMATIC_SINGLE_SURFACE\n7,0,6\n\n\n", "a contact of no parts"),
        ("*CONTACT_TIED_NODES_TO_SURFACE\n1,1,3,3\n\n\n", "it ties nothing"),
    ] {
        let (_, warnings) = whole(&cube(more));
        assert!(warnings.contains(words), "{more}: {warnings}");
    }
    assert!(!whole(&cube("*CONTROL_TERMINATION\n1e-6\n")).1.contains("a second"));
    let steel =
        "*MAT_JOHNSON_COOK\n1,7.85e-9,8e4,2.1e5,0.3\n300,500,0.3,0.02,1.0,1800,293,1.0\n4.5e8,9.0\n\n";
    let text = of(steel, "*EOS_GRUNEISEN\n5,4.5e6,1.49,,,2.0\n").replace("\n1,1,1\n", "\n1,1,1,5\n");
    assert!(whole(&text).1.contains("PC 9: no cut-off, which is a pressure below 0"));
}

#[test]
fn what_cannot_be_meant_is_refused() {
    for (more, expected) in [
        ("*DEFINE_COORDINATE_VECTOR\n3,1,0,0,0,1,0,5\n", "leave NID blank"),
        ("*DEFINE_BOX\n1,0,1,5,-5,0,1\n", "read -5; expected a maximum not below the minimum, 5"),
        ("*SET_NODE_LIST\n3\n1,2,3,4,5,6,7,8,1,2\n", "at most eight numbers on a card of a set"),
    ] {
        let found = fault(more);
        assert!(found.contains(expected), "{more}: {found}");
    }
    let text = told(&cube("*SET_NODE_LIST_GENERATE\n3\n1,2,3,4,5,6,7,8,1,2\n"));
    assert!(text.contains("at most eight numbers"), "{text}");
}

#[test]
fn a_deck_that_ends_among_nodes_or_elements_may_be_cut_off() {
    let text = cube("");
    let open = text.replace("*END\n", "");
    assert!(whole(&open).1.contains("the file ends with a *ELEMENT_SOLID, without *END: if it was cut off"));
    assert_eq!(whole(&text).1, "");
    assert_eq!(whole(&open.replace("*ELEMENT_SOLID", "*KEYWORD\n*ELEMENT_SOLID")).0, whole(&text).0);
    assert!(!whole(&format!("{open}*CONTROL_ENERGY\n")).1.contains("cut off"));
}

#[test]
fn a_parameter_may_say_about_which_circle_nodes_go() {
    let motion = |dof: &str| {
        let more = format!(
            "*PARAMETER\nId,9\n*DEFINE_CURVE\n3\n0,1\n1,1\n*BOUNDARY_PRESCRIBED_MOTION_NODE\n1,{dof},0,3,1.0\n0.5,0.5\n"
        );
        whole(&cube(&more)).0
    };
    assert_eq!(motion("&d"), motion("9"));
}
