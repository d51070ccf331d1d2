//! Laws of keyword decks that our declared laws have: constants, the equation of state that the card gives, and what is refused.

use deck::{Model, bundle};
use mechanics::{
    material::{Eos, Material, Strength},
    strength::{MooneyRivlin, Ogden, Viscoelastic},
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
