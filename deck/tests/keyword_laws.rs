//! Laws of keyword decks that our declared laws have: constants, the equation of state that the card gives, and what is refused.

use deck::{Model, bundle};
use mechanics::{
    material::{Eos, Material, Strength},
    strength::{CrushableFoam, LowDensityFoam, MooneyRivlin, Ogden, SoilFoam, Viscoelastic},
};

/// One cube of a material.
fn cube(material: &str, more: &str) -> String {
    format!(
        "*KEYWORD\n*CONTROL_TERMINATION\n1e-6\n*PART\ncube\n1,1,1{more}\n*SECTION_SOLID\n1,1\n{material}*NODE\n\
         1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n\
         *ELEMENT_SOLID\n1,1,1,2,3,4,5,6,7,8\n*END\n"
    )
}

fn read(text: &str) -> Model {
    deck::read(text, "a.k").unwrap_or_else(|faults| panic!("{faults:#?}\n{text}"))
}

/// The material of a cube, which a converted deck has too.
fn material(card: &str) -> Material {
    let text = cube(card, "");
    let model = read(&text);
    let converted = deck::convert(&text, "a.k", "out.mesh").expect("it was read");
    let mesh = converted.mesh;
    let mut open = |path: &str| (path == "some/out.mesh").then(|| mesh.clone());
    let packed = bundle::gather("some/out.toml", converted.deck, &bundle::Options::default(), &mut open);
    let again = deck::read(&packed.expect("two files"), "out.toml").expect("it was written");
    assert_eq!(again.setup.materials, model.setup.materials);
    model.setup.materials.into_iter().next().expect("a material")
}

fn fault(card: &str) -> String {
    let faults = deck::read(&cube(card, ""), "a.k").expect_err(card);
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

#[test]
fn rubber_has_its_constants_and_the_bulk_modulus_of_its_ratio() {
    for word in ["MOONEY-RIVLIN_RUBBER", "027"] {
        let rubber = material(&format!("*MAT_{word}\n1,1.1e-9,0.49,0.4,0.1\n"));
        assert_eq!(rubber.strength, Strength::MooneyRivlin(MooneyRivlin { a: 0.4, b: 0.1 }));
        let Eos::Linear { bulk } = rubber.eos else { panic!("{rubber:?}") };
        assert!((bulk / (2.0 * 1.49 / 0.06) - 1.0).abs() < 1e-12, "{bulk}");
    }
    assert!(fault("*MAT_027\n1,1.1e-9,0.5,0.4,0.1\n").contains("Poisson's ratio above 0 and below 0.5"));
    assert!(fault("*MAT_027\n1,1.1e-9,0.49,0.4,0.1\n,,,7\n").contains("constants A and B"));
}

#[test]
fn ogden_has_its_pairs() {
    let card = |rest: &str| format!("*MAT_OGDEN_RUBBER\n1,1.1e-9,0.495{rest}\n");
    let rubber = material(&card("\n0.63,0.0012,-0.01\n1.3,5.0,-2.0"));
    let pairs = Ogden { mu1: 0.63, alpha1: 1.3, mu2: 0.0012, alpha2: 5.0, mu3: -0.01, alpha3: -2.0 };
    assert_eq!(rubber.strength, Strength::Ogden(pairs));
    assert!(fault(&card(",2\n0.63\n1.3")).contains("constants MU and ALPHA"));
    assert!(fault(&card("\n1,1,1,1\n1,1,1,1")).contains("at most 3 pairs"));
    assert!(fault(&card("\n1.0\n-1.3")).contains("above 0, and no exponent of 0"));
    assert!(fault(&card("\n1.0\n1.3\n0.1,5.0")).contains("no relaxation"));
}

#[test]
fn foam_has_its_crush_curve() {
    let card = |rest: &str| {
        format!(
            "*DEFINE_CURVE\n9\n0.0,0.2\n0.5,0.3\n0.8,3.0\n*MAT_CRUSHABLE_FOAM\n1,6.0e-11,10.,0.0,9,0.05{rest}\n"
        )
    };
    let foam = material(&card(""));
    let Strength::CrushableFoam(law, crush) = foam.strength else { panic!("{foam:?}") };
    assert_eq!(law, CrushableFoam { young: 10.0, tension: 0.05 });
    assert_eq!(foam.eos, Eos::Linear { bulk: 10.0 / 3.0 });
    // Beyond its last point the curve goes on with its last slope.
    assert_eq!((crush.n_points, crush.strain[2], crush.stress[2], crush.strain[3]), (4, 0.8, 3.0, 10.0));
    assert!(fault(&card(",0.1,1")).contains("a crush curve by the volume alone"));
    assert!(fault(&card("").replace(",9,", ",8,")).contains("curve 8"));
}

#[test]
fn low_density_foam_unloads_by_hu_and_shape() {
    let card = |rest: &str| {
        format!("*DEFINE_CURVE\n9\n0.0,0.0\n0.5,0.1\n0.9,3.0\n*MAT_057\n1,6.0e-11,10.,9,0.05,0.3{rest}\n")
    };
    let foam = material(&card("\n5.0"));
    let Strength::LowDensityFoam(law, curve) = foam.strength else { panic!("{foam:?}") };
    assert_eq!(law, LowDensityFoam { young: 10.0, tension: 0.05, hysteresis: 0.3, shape: 5.0 });
    assert_eq!((curve.n_points, curve.stress[0], curve.stress[1]), (4, 0.0, 0.1));
    let reading = deck::read_whole(&cube(&card("\n5.0,,,,,2.0"), ""), "a.k").expect("a warning");
    assert!(reading.warnings.iter().any(|warning| warning.words.contains("KCON")), "{:?}", reading.warnings);
    assert!(fault(&card(",0.1")).contains("no decay"));
    assert!(fault(&card("\n5.0,1")).contains("tension that stays at its cut-off"));
}

#[test]
fn soil_has_its_points_by_the_logarithm_of_the_volume() {
    let card =
        "*MAT_SOIL_AND_FOAM\n1,1.8e-9,20.,300.,0.01,0.2,0.3,-0.1\n0,0,0\n0.,-0.1,-0.2\n\n0.,1.0,11.\n\n";
    let soil = material(card);
    let Strength::SoilFoam(law, curve) = soil.strength else { panic!("{soil:?}") };
    assert_eq!(law, SoilFoam { shear: 20.0, unloading: 300.0, a0: 0.01, a1: 0.2, a2: 0.3, tension: 0.1 });
    assert_eq!(soil.eos, Eos::Linear { bulk: 300.0 });
    assert_eq!(
        (curve.n_points, &curve.strain[..3], &curve.stress[..3]),
        (4, &[0.0, 0.1, 0.2][..], &[0.0, 1.0, 11.0][..])
    );
    let by_curve =
        "*DEFINE_CURVE\n9\n-0.2,11.\n-0.1,1.0\n0.,0.\n*MAT_005\n1,1.8e-9,20.,300.,0.01,0.2,0.3,-0.1\n0,0,9\n";
    assert_eq!(material(by_curve).strength, soil.strength);
    assert!(fault(&card.replace("300.", "90.")).contains("no less than the steepest line"));
    assert!(fault(&card.replace("\n0,0,0", "\n1,0,0")).contains("crushing that stays"));
}

#[test]
fn viscoelastic_relaxes_from_g0_to_gi() {
    let creeping = material("*MAT_VISCOELASTIC\n1,1.1e-9,2000.,100.,30.,50.\n");
    assert_eq!(
        creeping.strength,
        Strength::Viscoelastic(Viscoelastic { shear: 100.0, long_shear: 30.0, decay: 50.0 })
    );
    assert_eq!(creeping.eos, Eos::Linear { bulk: 2000.0 });
    assert!(fault("*MAT_006\n1,1.1e-9,2000.,100.,300.,50.\n").contains("a GI that is not above G0"));
    let gruneisen = "*EOS_GRUNEISEN\n1,3.9e6,1.49\n*MAT_006\n1,1.1e-9,2000.,100.,30.,50.\n";
    let faults = deck::read(&cube(gruneisen, ",1"), "a.k").expect_err("two equations");
    assert!(faults[0].to_string().contains("no *EOS: BULK of the material is one"), "{}", faults[0]);
}
