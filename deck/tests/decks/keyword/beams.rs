//! `*SECTION_BEAM`: trusses and beams.

use super::*;

#[test]
fn beams_of_elform_3_are_trusses_with_the_area_of_their_section() {
    let more = "*PART\nrope\n2,2,1\n*SECTION_BEAM\n2,3\n4.5\n*ELEMENT_BEAM\n       7       2       1       3       5\n";
    let model = good(more);
    let rope = &model.mesh.parts[1];
    assert_eq!((rope.name.as_str(), rope.element_ids.as_slice(), rope.nodes.len()), ("rope", &[7][..], 2));
    assert_eq!(rope.topology, Topology::Trusses { bars: vec![[0, 1]], area: 4.5, cable: None });
    let faults = read(&cube(&more.replace("2,3\n4.5", "2,7\n4.5"))).expect_err("a beam of another kind");
    assert!(lines(&faults).contains("expected ELFORM 1, 2, 3, 4, 5, 6 or 9"), "{}", lines(&faults));
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

#[test]
fn a_spot_weld_is_a_round_bar_that_breaks_at_its_plastic_strain() {
    let weld = |section: &str, failure: &str| {
        let more = format!(
            "*PART\nweld\n2,2,3\n*MAT_SPOTWELD\n3,7.85e-9,2.1e5,0.3,400.0,1500.0\n{failure}\n*SECTION_BEAM\n2,9\n{section}\n\
             *ELEMENT_BEAM\n7,2,1,2\n"
        );
        read(&cube(&more))
    };
    let model = weld("6.0,6.0,0.0,0.0,1.0", "0.15").unwrap_or_else(|f| panic!("{}", lines(&f)));
    let Topology::Beams { section, .. } = &model.mesh.parts[1].topology else {
        panic!("{:?}", model.mesh.parts[1])
    };
    assert!((section.area / (9.0 * std::f64::consts::PI) - 1.0).abs() < 1e-12, "{}", section.area);
    assert_eq!(section.breaks, Some(0.15));
    let strength = model.setup.materials[model.mesh.parts[1].material as usize].strength;
    let expected =
        Strength::VonMises { shear: 2.1e5 / 2.6, yield_stress: 400.0, hardening: 1500.0, rate: None };
    assert_eq!(strength, expected);
    for (section, failure, expected) in [
        ("6.0,6.0,0.0,0.0,1.0,,1", "0.15", "a spot weld that resists torsion"),
        ("6.0,6.0,0.0,0.0", "0.15,2000.0", "expected NRR blank"),
        ("6.0,6.0,0.0,0.0", ",,,,,,900.0", "expected MTT blank"),
        ("3.0,3.0,6.0,6.0", "0.15", "an outer diameter above the inner one"),
    ] {
        let faults = weld(section, failure).expect_err(expected);
        assert!(lines(&faults).contains(expected), "{}", lines(&faults));
    }
    // A weld of solids.
    let solid = cube("")
        .replace("*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n", "*MAT_100\n1,7.85e-9,2.1e5,0.3,400.0,1500.0\n0.15\n");
    let model = read(&solid).unwrap_or_else(|f| panic!("{}", lines(&f)));
    assert_eq!(model.setup.materials[0].strength, expected);
    let strain = Criteria { plastic_strain: Some(0.15), ..Criteria::default() };
    assert_eq!(model.setup.erosion.parts, [Some(strain)]);
}

#[test]
fn null_shells_and_beams_are_refused_by_name() {
    let beam = "*PART\nseen\n2,2,3\n*MAT_NULL\n3,7.85e-9\n*SECTION_BEAM\n2,5\n6.0,6.0,0.0,0.0\n*ELEMENT_BEAM\n7,2,1,2\n";
    let shell =
        "*PART\nseen\n2,2,3\n*MAT_009\n3,7.85e-9\n*SECTION_SHELL\n2,2\n1.0\n*ELEMENT_SHELL\n7,2,1,2,3,4\n";
    for more in [beam, shell] {
        let faults = read(&cube(more)).expect_err("a null beam or shell");
        assert!(
            lines(&faults).contains("null shells and beams, which have mass alone"),
            "{}",
            lines(&faults)
        );
    }
    let solid = cube("*PART\nwater\n2,1,3\n*MAT_NULL\n3,1e-9\n").replace("\n1,1,1\n", "\n1,1,3\n");
    let faults = read(&solid).expect_err("no equation of state");
    assert!(lines(&faults).contains("needs an equation of state"), "{}", lines(&faults));
}
