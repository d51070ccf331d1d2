//! `*HOURGLASS` and `*CONTROL_HOURGLASS` of keyword decks.

use mechanics::element::hourglass::{Hourglass, Kind};

/// A deck of one cube of steel whose `*PART` has this card, and what is added to it.
fn cube(part: &str, more: &str) -> String {
    let node = |i: u32| {
        let x = [(i ^ i >> 1) & 1, i >> 1 & 1, i >> 2];
        format!("{},{}.0,{}.0,{}.0\n", i + 1, x[0], x[1], x[2])
    };
    let nodes: String = (0..8).map(node).collect();
    format!(
        "*KEYWORD\n*CONTROL_TERMINATION\n1e-6\n*PART\ncube\n{part}\n*SECTION_SOLID\n1,1\n*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n\
         *NODE\n{nodes}*ELEMENT_SOLID\n1,1,1,2,3,4,5,6,7,8\n{more}*END\n"
    )
}

/// The small deck with a `*HOURGLASS` of its part, its control and its warnings.
fn controlled(hourglass: &str, more: &str) -> (Hourglass, Vec<String>) {
    let text = cube("1,1,1,0,5", &format!("{hourglass}{more}"));
    let reading = deck::read_whole(&text, "a.k").unwrap_or_else(|faults| panic!("{}", faults[0]));
    let found = reading.model.mesh.parts[0].hourglass;
    let words = deck::convert(&text, "a.k", "out.mesh").unwrap_or_else(|faults| panic!("{}", faults[0])).deck;
    let table =
        format!("hourglass = {{ kind = \"{}\", coefficient = {:?} }}", found.kind.name(), found.coefficient);
    assert!(words.contains(&table), "{words}");
    (found, reading.warnings.into_iter().map(|warning| warning.words).collect())
}

#[test]
fn ihq_is_a_kind_of_hourglass_control_and_qm_its_coefficient() {
    let of = |kind, coefficient| Hourglass { kind, coefficient };
    for (card, expected, warning) in [
        ("5,1,0.05", of(Kind::Viscous, 0.05), None),
        ("5,3", of(Kind::Viscous, 0.1), None),
        ("5,4,0.03", of(Kind::Stiffness, 0.03), None),
        ("5,5", of(Kind::Stiffness, 0.1), None),
        ("5,6,1.0", of(Kind::AssumedStrain, 1.0), None),
        ("5,6,2.0", of(Kind::AssumedStrain, 1.0), Some("QM 2: the coefficient of hourglass control is 1")),
        (
            "5,9,0.5",
            of(Kind::AssumedStrain, 0.5),
            Some("IHQ 9: hourglass control is that of IHQ 6, by assumed strains"),
        ),
        ("5,8,0.2", of(Kind::Viscous, 0.2), Some("IHQ 8: hourglass control is viscous, as with IHQ 1")),
    ] {
        // What the part names goes before what the deck says.
        let (found, warnings) = controlled(&format!("*HOURGLASS\n{card}\n"), "*CONTROL_HOURGLASS\n4,0.07\n");
        assert_eq!(found, expected, "{card}");
        assert_eq!(
            warnings.iter().find(|words| words.contains("hourglass control")).map(String::as_str),
            warning
        );
    }
    let text = cube("1,1,1", "*CONTROL_HOURGLASS\n4,0.07\n");
    let model = deck::read(&text, "a.k").unwrap_or_else(|faults| panic!("{}", faults[0]));
    assert_eq!(model.mesh.parts[0].hourglass, of(Kind::Stiffness, 0.07));
    let (found, warnings) = controlled("", "*CONTROL_HOURGLASS\n6,0.5\n");
    assert_eq!(found, of(Kind::AssumedStrain, 0.5));
    assert_eq!(warnings, ["HGID 5: no *HOURGLASS has this number, that of the deck serves"]);
    assert_eq!(controlled("*HOURGLASS\n5,0\n", "").0, Hourglass::VISCOUS);
    let plain = deck::read(&cube("1,1,1", ""), "a.k").unwrap_or_else(|faults| panic!("{}", faults[0]));
    assert_eq!(plain.mesh.parts[0].hourglass, Hourglass::VISCOUS);
}

#[test]
fn elastic_control_on_a_fluid_is_a_warning_and_viscous() {
    let fluid = cube("1,1,1,1,5", "*HOURGLASS\n5,6,1.0\n*EOS_GRUNEISEN\n1,1.48e6,1.75,0,0,0.28\n")
        .replace("*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3", "*MAT_NULL\n1,1e-9");
    let reading = deck::read_whole(&fluid, "a.k").unwrap_or_else(|faults| panic!("{}", faults[0]));
    assert_eq!(reading.model.mesh.parts[0].hourglass, Hourglass::viscous(0.1));
    let told = "IHQ 6: material 1 has no shear stiffness, control is viscous with 0.1";
    assert!(reading.warnings.iter().any(|warning| warning.words == told), "{:?}", reading.warnings);
}

#[test]
fn elform_2_is_a_solid_of_eight_points_where_the_material_can() {
    use mechanics::mesh::Topology;
    let text = cube("1,1,1", "").replace("*SECTION_SOLID\n1,1", "*SECTION_SOLID\n1,2");
    let reading = deck::read_whole(&text, "a.k").unwrap_or_else(|faults| panic!("{}", faults[0]));
    assert!(matches!(reading.model.mesh.parts[0].topology, Topology::EightPoint { .. }));
    assert!(reading.warnings.is_empty(), "{:?}", reading.warnings);
    let written =
        deck::convert(&text, "a.k", "out.mesh").unwrap_or_else(|faults| panic!("{}", faults[0])).deck;
    assert!(written.contains("points = 8"), "{written}");
    let fluid = text
        .replace("*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3", "*MAT_NULL\n1,1e-9")
        .replace("1,1,1\n", "1,1,1,1\n")
        .replace("*END", "*EOS_GRUNEISEN\n1,1.48e6,1.75,0,0,0.28\n*END");
    let reading = deck::read_whole(&fluid, "a.k").unwrap_or_else(|faults| panic!("{}", faults[0]));
    assert!(matches!(reading.model.mesh.parts[0].topology, Topology::Explicit { .. }));
    let told = "is computed with one point: eight need a material with shear stiffness";
    assert!(reading.warnings.iter().any(|warning| warning.words.contains(told)), "{:?}", reading.warnings);
}
