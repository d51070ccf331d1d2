//! `*ELEMENT_DISCRETE`, its section and materials, and cables.

use mechanics::element::spring2::{Damper, Elastic, Line, Spring};

use super::*;

/// The small deck with a spring of number 7 from node 1 to node 7 of this material, and more fields of its element.
fn sprung(material: &str, element: &str, more: &str) -> String {
    cube(&format!(
        "*PART\nspring\n2,2,2\n*SECTION_DISCRETE\n2,0\n\n{material}\n*ELEMENT_DISCRETE\n7,2,1,7{element}\n{more}"
    ))
}

fn law(material: &str, element: &str, more: &str) -> Spring {
    let model = read(&sprung(material, element, more)).unwrap_or_else(|f| panic!("{}", lines(&f)));
    let part = &model.mesh.parts[1];
    assert_eq!((part.name.as_str(), part.element_ids.as_slice()), ("spring", &[7][..]));
    let Topology::Springs { bars, spring } = &part.topology else { panic!("{:?}", part.topology) };
    // Its nodes are those of the cube.
    assert_eq!((bars.as_slice(), part.nodes.as_slice()), (&[[0, 1]][..], &[0, 6][..]));
    assert!(model.setup.materials[part.material as usize].is_massless());
    spring.clone()
}

const CURVE: &str = "*DEFINE_CURVE\n5\n-1.0,-4.0\n0.0,0.0\n1.0,2.0\n";

#[test]
fn springs_and_dampers_have_the_laws_of_their_cards() {
    let none = Elastic::None;
    let line = |factor: f64| Line { points: vec![[-1.0, factor * -4.0], [0.0, 0.0], [1.0, factor * 2.0]] };
    for (material, element, elastic, damper, offset) in [
        ("*MAT_SPRING_ELASTIC\n2,30.0", "", Elastic::Linear { stiffness: 30.0 }, Damper::None, 0.0),
        // S doubles all forces, and OFFSET draws it.
        ("*MAT_S01\n2,30.0", ",0,2.0,0,0.5", Elastic::Linear { stiffness: 60.0 }, Damper::None, 0.5),
        ("*MAT_DAMPER_VISCOUS\n2,3.0", "", none.clone(), Damper::Linear { damping: 3.0 }, 0.0),
        (
            "*MAT_SPRING_ELASTOPLASTIC\n2,30.0,3.0,9.0",
            ",0,2.0",
            Elastic::Plastic { stiffness: 60.0, tangent: 6.0, yields: 18.0 },
            Damper::None,
            0.0,
        ),
        ("*MAT_SPRING_NONLINEAR_ELASTIC\n2,5", ",0,3.0", Elastic::Curve(line(3.0)), Damper::None, 0.0),
        ("*MAT_DAMPER_NONLINEAR_VISCOUS\n2,5", "", none, Damper::Curve(line(1.0)), 0.0),
    ] {
        assert_eq!(law(material, element, CURVE), Spring { elastic, damper, offset }, "{material}");
    }
}

#[test]
fn what_springs_do_not_have_is_refused_at_its_field() {
    let elastic = "*MAT_SPRING_ELASTIC\n2,30.0";
    let another = "*ELEMENT_DISCRETE\n8,2,2,8,0,2.0\n";
    for (text, expected) in [
        (
            sprung(elastic, "", "").replace("7,2,1,7", "7,2,1,0"),
            "expected two nodes: no end of a spring is grounded",
        ),
        (
            sprung(elastic, ",4", ""),
            "a.k:31:9: read 4 (field 5, card 1 of *ELEMENT_DISCRETE); expected VID 0",
        ),
        (sprung(elastic, "", another), "expected S 1, that of the first of part 2; make one part"),
        (
            sprung(elastic, "", "").replace("*SECTION_DISCRETE\n2,0", "*SECTION_DISCRETE\n2,1"),
            "expected DRO 0",
        ),
        (
            sprung(elastic, "", "").replace("*SECTION_DISCRETE\n2,0", "*SECTION_DISCRETE\n2,0,0.5"),
            "expected KD 0",
        ),
        (
            sprung(elastic, "", "").replace("*SECTION_DISCRETE\n2,0\n\n", "*SECTION_DISCRETE\n2,0\n0.1\n"),
            "expected CDL 0",
        ),
        (sprung("*MAT_SPRING_NONLINEAR_ELASTIC\n2,5,6", "", CURVE), "expected LCR 0"),
        (sprung("*MAT_SPRING_NONLINEAR_ELASTIC\n2", "", CURVE), "expected the number of a curve of force"),
        (
            sprung("*MAT_SPRING_ELASTOPLASTIC\n2,30.0,31.0,9.0", "", ""),
            "expected a tangent below the stiffness",
        ),
        (
            sprung("*MAT_SPRING_MAXWELL\n2,30.0", "", ""),
            "read *MAT_SPRING_MAXWELL; expected a material of the table",
        ),
        (sprung("*MAT_ELASTIC\n2,7.85e-9,2.1e5,0.3", "", ""), "expected a *MAT_SPRING_ or *MAT_DAMPER_"),
        (sprung(elastic, "", "").replace("cube\n1,1,1", "cube\n1,1,2"), "this one is of springs"),
        (
            sprung(elastic, "", "").replace("*ELEMENT_DISCRETE", "*ELEMENT_BEAM"),
            "whose section is of springs",
        ),
        (
            sprung(elastic, "", "").replace("*SECTION_DISCRETE\n2,0\n\n", "*SECTION_BEAM\n2,3\n4.5\n"),
            "expected a part of springs alone",
        ),
        (
            sprung(elastic, "", "*NODE\n20,0.0,0.0,3.0\n").replace("7,2,1,7", "7,2,1,20"),
            "node 20 of part \"spring\", of springs alone, without mass",
        ),
    ] {
        let faults = read(&text).expect_err(expected);
        assert!(lines(&faults).contains(expected), "{expected}:\n{}", lines(&faults));
    }
}

#[test]
fn a_discrete_beam_of_the_cable_material_pulls_with_its_tension() {
    let more = |section: &str, material: &str| {
        cube(&format!(
            "*PART\nrope\n2,2,2\n*SECTION_BEAM\n2,6\n{section}\n*MAT_CABLE_DISCRETE_BEAM\n2,7.85e-9,{material}\n*ELEMENT_BEAM\n7,2,1,2\n"
        ))
    };
    let model = read(&more("0,0,0,4.5", "2.0e5,0,900.0")).unwrap_or_else(|f| panic!("{}", lines(&f)));
    let Topology::Trusses { area, cable: Some(cable), .. } = &model.mesh.parts[1].topology else {
        panic!("{:?}", model.mesh.parts[1])
    };
    // 200 MPa, a strain of 0.001.
    assert!(*area == 4.5 && ((1.0 - cable.rest) / 0.001 - 1.0).abs() < 2e-3, "{area} {cable:?}");
    for (section, material, expected) in [
        ("1.0,0,0,4.5", "2.0e5", "expected VOL 0"),
        ("0,0,0,0", "2.0e5", "an area CA above 0"),
        ("0,0,0,4.5,0.1", "2.0e5", "expected OFFSET 0"),
        ("0,0,0,4.5", "2.0e5,3", "expected LCID 0"),
        ("0,0,0,4.5", "2.0e5,0,900.0,0.1", "expected TMAXF0 0"),
        ("0,0,0,4.5", "2.0e5,0,1.0e9", "in the cables of part"),
    ] {
        let faults = read(&more(section, material)).expect_err(expected);
        assert!(lines(&faults).contains(expected), "{expected}:\n{}", lines(&faults));
    }
    let text = more("0,0,0,4.5", "2.0e5");
    let faults = read(&text.replace("rope\n2,2,2", "rope\n2,2,1")).expect_err("of steel");
    assert!(lines(&faults).contains("expected *MAT_CABLE_DISCRETE_BEAM"), "{}", lines(&faults));
    let faults =
        read(&text.replace("*SECTION_BEAM\n2,6\n0,0,0,4.5", "*SECTION_BEAM\n2,3\n4.5")).expect_err("a truss");
    assert!(lines(&faults).contains("a *SECTION_BEAM of ELFORM 6"), "{}", lines(&faults));
}

#[test]
fn a_converted_deck_has_the_same_springs_and_cables() {
    let cable = "*PART\nrope\n3,3,3\n*SECTION_BEAM\n3,6\n0,0,0,4.5\n*MAT_CABLE_DISCRETE_BEAM\n3,7.85e-9,2.0e5,0,900.0\n\
                 *ELEMENT_BEAM\n9,3,1,2\n*PART\ndamper\n4,2,4\n*MAT_DAMPER_NONLINEAR_VISCOUS\n4,5\n*ELEMENT_DISCRETE\n10,4,2,8\n";
    for law in ["*MAT_SPRING_ELASTOPLASTIC\n2,30.0,3.0,9.0", "*MAT_SPRING_NONLINEAR_ELASTIC\n2,5"] {
        let text = sprung(law, ",0,2.0,0,0.1", &format!("{cable}{CURVE}"));
        let again = converted(&text, "a.k");
        let whole = read(&text).unwrap_or_else(|f| panic!("{}", lines(&f)));
        assert!(again.mesh == whole.mesh && again.setup.materials == whole.setup.materials, "{law}");
    }
}
