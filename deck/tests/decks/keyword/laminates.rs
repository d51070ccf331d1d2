//! Composite shells of keyword decks: plies, angles and axes as the cards say, and what is refused.

use mechanics::{
    element::shell4::Rule,
    material::Strength,
    mesh::{Axis, Laminate, Plies, Ply},
    strength::ChangChang,
};

use super::{converted, lines, read};

/// Two shells of part 1, whose section and material follow; mm, s, tonne, N.
fn deck_of(part: &str, material: &str) -> String {
    format!(
        "*KEYWORD\n*CONTROL_TERMINATION\n1e-6\n{part}{material}*NODE\n1,0,0,0,1,7\n2,10,0,0\n3,10,10,0\n4,0,10,0\n\
         5,20,0,0\n6,20,10,0\n*ELEMENT_SHELL\n1,1,1,2,3,4\n2,1,2,5,6,3\n*END\n"
    )
}

const PLIES: &str = "*PART_COMPOSITE\npanel\n1,2\n7,0.25,0,0,7,0.125,45,0\n7,0.125,-45,0,7,0.25,90,0\n";
const ICOMP: &str = "*PART\npanel\n1,3,7\n*SECTION_SHELL\n3,2,,4,,,1\n1,1,1,1\n0,90,90,0\n";

/// `*MAT_ENHANCED_COMPOSITE_DAMAGE` with these fields: AOPT, A1 to A3 and MANGLE, V1 to V3, and those of the fifth card.
fn enhanced([aopt, a, v, fifth]: [&str; 4]) -> String {
    format!(
        "*MAT_054\n7,1.6e-9,1.4e5,1.0e4,1.0e4,0.02,0.02,0.4\n5e3,3e3,4e3,0,{aopt},0\n0,0,0,{a}\n{v},0,0,0,0.03,0.05\n\
         {fifth}\n1200,2000,200,50,80,54,0.5\n"
    )
}

fn fault(part: &str, material: &str) -> String {
    lines(&read(&deck_of(part, material)).expect_err("a fault"))
}

#[test]
fn plies_of_a_part_composite_are_those_of_its_cards() {
    let deck = deck_of(PLIES, &enhanced(["0", "0,0,0,30", "0,0,0", "0,0,0,0.5,1.2,0.02,-0.015,0.1"]));
    let model = read(&deck).unwrap_or_else(|f| panic!("{}", lines(&f)));
    let section = model.mesh.parts[0].section().expect("shells");
    let ply = |angle, share| Ply { angle, share };
    let plies = vec![ply(30.0, 0.25), ply(75.0, 0.125), ply(-15.0, 0.125), ply(120.0, 0.25)];
    assert_eq!(section.laminate, Some(Laminate { axis: Axis::Side, plies: Plies::Stacked(plies) }));
    assert_eq!((section.thickness, section.rule, section.n_layers()), (0.75, Rule::Gauss(1), 4));
    let Strength::ChangChang(law) = &model.setup.materials[0].strength else { panic!("MAT_054") };
    let expected = ChangChang {
        young_a: 1.4e5,
        young_b: 1e4,
        poisson_ba: 0.02,
        modulus_ab: 5e3,
        modulus_bc: 3e3,
        modulus_ca: 4e3,
        ax: 1.0,
        ay: 0.0,
        az: 0.0,
        tension_a: 2000.0,
        compression_a: 1200.0,
        tension_b: 50.0,
        compression_b: 200.0,
        shear_ab: 80.0,
        shear_share: 0.5,
        crushed_tension: 0.5,
        crushed_compression: 1.2 * 200.0 / 1200.0,
        strain_tension_a: 0.02,
        strain_compression_a: 0.015,
        strain_b: 0.03,
        strain_ab: 0.05,
        strain_effective: 0.1,
    };
    assert_eq!(*law, expected);
    assert!(model.setup.erosion.is_on(), "elements leave with their last layer");
    assert_eq!(format!("{:?}", converted(&deck, "a.k")), format!("{model:?}"));
}

#[test]
fn angles_of_a_section_are_those_of_its_points_and_of_more_than_five_equal_plies() {
    let across = enhanced(["3", "0,0,0,0", "0,1,0", "0,0,0,0,0,0,0,0"]);
    let deck = deck_of(ICOMP, &across);
    let model = read(&deck).unwrap_or_else(|f| panic!("{}", lines(&f)));
    let section = model.mesh.parts[0].section().expect("shells");
    let plies = Plies::AtPoints(vec![0.0, 90.0, 90.0, 0.0]);
    assert_eq!(section.laminate, Some(Laminate { axis: Axis::Across([0.0, 1.0, 0.0]), plies }));
    assert_eq!((section.rule, section.n_layers()), (Rule::Gauss(4), 4));
    assert_eq!(format!("{:?}", converted(&deck, "a.k")), format!("{model:?}"));

    let nine =
        ICOMP.replace("3,2,,4,,,1", "3,2,,9,,,1").replace("0,90,90,0\n", "0,10,20,30,40,50,60,70\n80\n");
    let model = read(&deck_of(&nine, &across)).unwrap_or_else(|f| panic!("{}", lines(&f)));
    let section = model.mesh.parts[0].section().expect("shells");
    let plies = (0..9).map(|n| Ply { angle: f64::from(10 * n), share: 1.0 }).collect();
    assert_eq!(section.laminate.as_ref().map(|laminate| laminate.plies.clone()), Some(Plies::Stacked(plies)));
    assert_eq!(section.rule, Rule::Gauss(1));
}

#[test]
fn composite_damage_is_a_law_of_shells_with_axes_by_a_vector() {
    let material = "*MAT_022\n7,1.6e-9,1.4e5,1.0e4,1.0e4,0.02,0.02,0.4\n5e3,3e3,4e3,0,2\n0,0,0,0,1,0\n0,0,0,1,0,0\n\
                    80,2000,50,200\n";
    let deck = deck_of(ICOMP, material);
    let model = read(&deck).unwrap_or_else(|f| panic!("{}", lines(&f)));
    let axis = model.mesh.parts[0]
        .section()
        .and_then(|section| section.laminate.as_ref())
        .map(|laminate| laminate.axis);
    assert_eq!(axis, Some(Axis::Material));
    let layers = model.setup.materials[0].strength.layers().expect("a law of layers");
    assert_eq!([layers.ax, layers.ay, layers.tension_a, layers.shear_ab], [0.0, 1.0, 2000.0, 80.0]);
    assert_eq!(format!("{:?}", converted(&deck, "a.k")), format!("{model:?}"));
}

#[test]
fn what_composites_cannot_have_is_refused_at_its_card() {
    let zeros = "0,0,0,0,0,0,0,0";
    let good = enhanced(["0", "0,0,0,0", "0,0,0", zeros]);
    assert!(read(&deck_of(PLIES, &good)).is_ok());
    let two = PLIES.replace("7,0.25,90", "8,0.25,90");
    for (part, material, expected) in [
        (two.as_str(), good.clone(), "material 7 in all plies"),
        (&PLIES.replace("\n1,2\n", "\n1,2,,0.5\n"), good.clone(), "no NLOC"),
        (&PLIES.replace("0.25,90,0", "-1,90,0"), good.clone(), "a thickness"),
        (&ICOMP.replace("0,90,90,0\n", ""), good.clone(), "an angle for each of the NIP points"),
        (PLIES, enhanced(["1", "0,0,0,0", "0,0,0", zeros]), "AOPT 0, 2 or 3"),
        (PLIES, enhanced(["2", "1,0,0,30", "0,0,0", zeros]), "no angle of the material with AOPT 2"),
        (PLIES, enhanced(["3", "0,0,0,0", "0,0,0", zeros]), "a vector V of some length"),
        (PLIES, enhanced(["0", "0,0,0,0", "0,0,0", "1e-7,0,0,0,0,0,0,0"]), "no time step TFAIL"),
        (PLIES, good.replace("80,54,0.5", "80,55,0.5"), "CRIT 54"),
        // An axis that is normal to the shells.
        (PLIES, enhanced(["2", "0,0,1,0", "0,0,0", zeros]), "normal to"),
    ] {
        let said = fault(part, &material);
        assert!(said.contains(expected), "{said}; expected {expected}");
        assert!(said.contains("a.k:"), "{said}: at its line");
    }
}
