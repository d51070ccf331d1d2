//! `*SECTION_BEAM`: trusses and beams.

use super::*;

#[test]
fn beams_of_elform_3_are_trusses_with_the_area_of_their_section() {
    let more = "*PART\nrope\n2,2,1\n*SECTION_BEAM\n2,3\n4.5\n*ELEMENT_BEAM\n       7       2       1       3       5\n";
    let model = good(more);
    let rope = &model.mesh.parts[1];
    assert_eq!((rope.name.as_str(), rope.element_ids.as_slice(), rope.nodes.len()), ("rope", &[7][..], 2));
    assert_eq!(rope.topology, Topology::Trusses { bars: vec![[0, 1]], area: 4.5 });
    let faults = read(&cube(&more.replace("2,3\n4.5", "2,6\n4.5"))).expect_err("a discrete beam");
    assert!(lines(&faults).contains("expected ELFORM 1, 2, 3, 4 or 5"), "{}", lines(&faults));
    let faults = read(&cube(&more.replace("2,2,1", "2,1,1"))).expect_err("a section of solids");
    assert!(lines(&faults).contains("*SECTION_BEAM"), "{}", lines(&faults));
}

#[test]
fn beams_have_the_section_and_the_direction_of_their_cards() {
    let of = |section: &str, beam: &str| {
        cube(&format!("*PART\nframe\n2,2,1\n*SECTION_BEAM\n{section}\n*ELEMENT_BEAM\n{beam}\n"))
    };
    let beams = |text: &str| match read(text).unwrap_or_else(|f| panic!("{}", lines(&f))).mesh.parts[1]
        .topology
        .clone()
    {
        Topology::Beams { bars, section, across } => (bars, section, across),
        other => panic!("{other:?}"),
    };
    // A square tube of moments, whose axis s points to node 4.
    let (bars, section, across) = beams(&of("2,2\n4.0,2.0,3.0,5.0,1.5", "7,2,1,2,4"));
    assert_eq!((bars, across), (vec![[0, 1]], vec![[0.0, 1.0, 0.0]]));
    assert_eq!((section.area, section.inertia, section.torsion), (4.0, [2.0, 3.0], 5.0));
    assert_eq!((section.shear, section.fibres), ([1.5; 2], None));
    // A rectangle of 2 along s by 3 along t; an elastic one needs no fibres.
    let (_, section, _) = beams(&of("2,1,0.8333,2,0\n2.0,2.0,3.0,3.0", "7,2,1,2,4"));
    assert_eq!((section.area, section.inertia, section.fibres), (6.0, [4.5, 2.0], None));
    assert!((section.shear[0] - 0.8333 * 6.0).abs() < 1e-12, "{:?}", section.shear);
    // A tube needs no direction.
    let (_, section, across) = beams(&of("2,1,1.0,2,1\n2.0,2.0,1.0,1.0", "7,2,1,2,0"));
    assert!((section.area - 0.75 * std::f64::consts::PI).abs() < 1e-12, "{}", section.area);
    assert_eq!(across, [[0.0; 3]]);
    let by_vector = of("2,2\n4.0,2.0,3.0,5.0,1.5", "7,2,1,2\n0.0,0.0,2.0")
        .replace("ELEMENT_BEAM", "ELEMENT_BEAM_ORIENTATION");
    assert_eq!(beams(&by_vector).2, [[0.0, 0.0, 2.0]]);
    for (section, beam, expected) in [
        ("2,2\n4.0,2.0,3.0,5.0,1.5", "7,2,1,2,0", "without a direction across it"),
        ("2,2\n4.0,2.0,3.0,5.0,1.5", "7,2,1,2,4,0,1", "expected ends that are not released"),
        ("2,2\n4.0,2.0,3.0,5.0,1.5", "7,2,1,2,99", "with node 99 for its direction"),
        ("2,1\n2.0,1.0,3.0,3.0", "7,2,1,2,4", "expected the same size at both ends"),
        ("2,1,1.0,2,2\n2.0,2.0,3.0,3.0", "7,2,1,2,4", "expected CST 0 or 1"),
    ] {
        let faults = read(&of(section, beam)).expect_err(expected);
        assert!(lines(&faults).contains(expected), "{}", lines(&faults));
    }
    // A yielding material has fibres, and needs the shape for them.
    let plastic = |section: &str| {
        of(section, "7,2,1,2,4").replace(
            "frame\n2,2,1",
            "frame\n2,2,3\n*MAT_PLASTIC_KINEMATIC\n3,7.85e-9,2.1e5,0.3,250.0,0.0,1.0\n0.0,0.0,0.2",
        )
    };
    let (_, section, _) = beams(&plastic("2,1,1.0,2,0\n2.0,2.0,3.0,3.0"));
    assert_eq!((section.n_fibres(), section.breaks), (36, Some(0.2)));
    let faults = read(&plastic("2,2\n4.0,2.0,3.0,5.0,1.5")).expect_err("moments alone");
    assert!(lines(&faults).contains("give the shape"), "{}", lines(&faults));
}
