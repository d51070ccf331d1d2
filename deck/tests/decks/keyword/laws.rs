//! Laws of keyword decks that our declared laws have: constants, the equation of state that the card gives, and what is refused.

use deck::Model;
use mechanics::{
    erosion::Criteria,
    material::{Eos, Failure, Material, Strength},
    mesh::{Guide, SolidAxes},
    strength::{
        CrushableFoam, HolmquistJohnsonCook, Honeycomb, LowDensityFoam, ModifiedJohnsonCook, MooneyRivlin,
        Ogden, Orthotropic, PowerLaw, RiedelHiermaierThoma, SoilFoam, SteinbergGuinan, Viscoelastic,
        ZerilliArmstrong,
    },
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
    of_deck(&cube(card, ""))
}

/// The same of a material beside a shock line.
fn shocked(card: &str) -> Material {
    of_deck(&beside_a_shock_line(card))
}

fn beside_a_shock_line(card: &str) -> String {
    cube(&format!("*EOS_GRUNEISEN\n1,3.9e6,1.49,,,2.0\n{card}"), ",1")
}

fn of_deck(text: &str) -> Material {
    let model = read(text);
    let again = super::converted(text, "a.k");
    assert_eq!(again.setup.materials, model.setup.materials);
    model.setup.materials.into_iter().next().expect("a material")
}

fn fault(card: &str) -> String {
    fault_of(&cube(card, ""))
}

fn fault_of(text: &str) -> String {
    let faults = deck::read(text, "a.k").expect_err(text);
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
fn a_power_law_first_yields_where_sigy_says() {
    let card =
        |first: &str, second: &str| format!("*MAT_018\n1,7.85e-9,2.1e5,0.3,540.,0.22{first}\n{second}\n");
    let law = |first: &str, second: &str| {
        let steel = material(&card(first, second));
        let Eos::Linear { bulk } = steel.eos else { panic!("{steel:?}") };
        assert!((bulk / 175e3 - 1.0).abs() < 1e-12, "{bulk}");
        let Strength::PowerLaw(law) = steel.strength else { panic!("{steel:?}") };
        assert_eq!([law.shear, law.k, law.n], [2.1e5 / 2.6, 540.0, 0.22]);
        law
    };
    // Where both lines meet the stress is the same.
    let PowerLaw { initial_strain, reference_rate, .. } = law("", "");
    assert!(
        (2.1e5 * initial_strain / (540.0 * libm::pow(initial_strain, 0.22)) - 1.0).abs() < 1e-12,
        "{initial_strain}"
    );
    assert_eq!(reference_rate, 0.0);
    assert_eq!(law("", "0.01").initial_strain, 0.01);
    let stress = law("", "190.").initial_strain;
    assert!((540.0 * libm::pow(stress, 0.22) / 190.0 - 1.0).abs() < 1e-12, "{stress}");
    let rated = law(",802.,3.585", "190.,,0.4");
    assert_eq!([rated.reference_rate, rated.rate_exponent], [802.0, 3.585]);
    let text = cube(&card("", "190.,1.,0.4"), "");
    let eroding = deck::read_whole(&text, "a.k").expect("a good deck");
    let strain = Criteria { plastic_strain: Some(0.4), ..Criteria::default() };
    assert_eq!(eroding.model.setup.erosion.parts, [Some(strain)]);
    assert!(
        eroding.warnings.iter().any(|warning| warning.to_string().contains("VP: the rate")),
        "{:?}",
        eroding.warnings
    );
    assert!(fault(&card("", "").replace("0.22", "1.0")).contains("a yield stress or strain"));
    assert!(fault(&card("", "1e9")).contains("above 0 and below 10"));
    assert!(fault(&card("", "").replace("540.", "0.")).contains("K"));
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

#[test]
fn modified_johnson_cook_breaks_by_the_work_of_cockcroft_and_latham() {
    let card = |first: &str, second: &str, last: &str, critical: &str| {
        format!(
            "*MAT_MODIFIED_JOHNSON_COOK\n1,7.85e-9,2.0e5,0.25{first}\n5e-4,293,1800{second}\n499,382,0.458,0.0079,0.893\n120,9,40,150\n{last}\n{critical}\n"
        )
    };
    let weldox = card(",,0.9,4.52e8", ",293,0,1", "1,1516", "1800");
    let steel = material(&weldox);
    let law = ModifiedJohnsonCook {
        shear: 8e4,
        a: 499.0,
        b: 382.0,
        n: 0.458,
        q1: 120.0,
        c1: 9.0,
        q2: 40.0,
        c2: 150.0,
        c: 0.0079,
        m: 0.893,
        t_melt: 1800.0,
        t_room: 293.0,
        specific_heat: 4.52e8,
        rate0: 5e-4,
        taylor_quinney: 0.9,
    };
    assert_eq!(steel.strength, Strength::ModifiedJohnsonCook(law));
    assert_eq!(steel.failure, Failure::CockcroftLatham { work: 1516.0 });
    let Eos::Linear { bulk } = steel.eos else { panic!("{steel:?}") };
    assert!((bulk / (2.0e5 / 1.5) - 1.0).abs() < 1e-12, "{bulk}");
    // Broken elements leave, and those that are hot where that is below the melting temperature.
    let criteria = |card: &str| read(&cube(card, "")).setup.erosion.parts.first().copied().flatten();
    let broken = Criteria { failure: true, ..Criteria::default() };
    assert_eq!(criteria(&weldox), Some(broken));
    assert_eq!(
        criteria(&card(",,0.9,4.52e8", ",293,0,1", "1,1516", "1620")),
        Some(Criteria { temperature: Some(1620.0), ..broken })
    );
    assert_eq!(criteria(&card("", "", "", "1620")), None, "nothing heats");
    assert_eq!(material(&weldox.replace("MAT_MODIFIED_JOHNSON_COOK", "MAT_107")), steel);
    let cold = material(&card("", "", "", ""));
    assert_eq!(cold.failure, Failure::None);
    let Strength::ModifiedJohnsonCook(law) = cold.strength else { panic!("{cold:?}") };
    assert_eq!((law.taylor_quinney, law.m), (0.0, 1.0));
    for (deck, words) in [
        (card(",1", "", "", ""), "no damage in the yield stress"),
        (card("", ",,1", "", ""), "the law of Johnson and Cook"),
        (card("", ",400", "", ""), "room temperature at the start"),
        (card("", "", "1,0,0.07,1.7", ""), "the fracture criterion of Cockcroft and Latham"),
        (card("", ",,,1", "1,0", ""), "WC"),
        (card("", "", "", ",900"), "no shear stress at which elements leave"),
        (card(",,0.9,4.52e8", "", "", "").replace("293,1800", "293,200"), "a melting temperature above"),
    ] {
        assert!(fault(&deck).contains(words), "{words}: {}", fault(&deck));
    }
}

#[test]
fn concrete_has_its_constants_and_leaves_by_fs() {
    let card = |lock: &str, fs: &str| {
        format!(
            "*MAT_JOHNSON_HOLMQUIST_CONCRETE\n1,2.44e-9,14860,0.79,1.6,0.007,0.61,48\n4,1,0.01,7,16,0.001,800,{lock}\n0.04,1,85000,-171000,208000,{fs}\n"
        )
    };
    let concrete = material(&card("0.1", "0.8"));
    let law = HolmquistJohnsonCook {
        shear: 14860.0,
        a: 0.79,
        b: 1.6,
        n: 0.61,
        c: 0.007,
        rate0: 1.0,
        compressive_strength: 48.0,
        strength_limit: 7.0,
        tension: 4.0,
        crush_pressure: 16.0,
        crush_compression: 0.001,
        lock_pressure: 800.0,
        lock_compression: 0.1,
        k1: 85000.0,
        k2: -171_000.0,
        k3: 208_000.0,
        d1: 0.04,
        d2: 1.0,
        least_strain: 0.01,
    };
    assert_eq!(concrete.strength, Strength::HolmquistJohnsonCook(law));
    assert_eq!(concrete.eos, Eos::Linear { bulk: 16000.0 });
    assert_eq!(material(&card("0.1", "0.8").replace("JOHNSON_HOLMQUIST_CONCRETE", "111")), concrete);
    let limits = |fs: &str| read(&cube(&card("0.1", fs), "")).setup.erosion.parts[0].expect("limits");
    assert_eq!((limits("0.8").plastic_strain, limits("0.8").tension), (Some(0.8), None));
    assert_eq!((limits("").plastic_strain, limits("").tension), (None, Some(4.0)));
    assert!(fault(&card("0.1", "-1")).contains("no failure by the damaged strength"));
    assert!(fault(&card("0.0005", "1")).contains("a lock point beyond the crush point"));
}

#[test]
fn concrete_of_five_cards_has_its_constants() {
    let card = |epsf: &str, ec: &str, t1: &str, q0: &str| {
        format!(
            "*MAT_RHT\n1,2.314e-9,16700,1,{epsf},1.22,1.22,{t1}\n1.6,0.61,35,0.18,0.1,{q0},0.0105,0\n\
             3e-5,3e-6,{ec},3e25,0.032,0.036,0.001\n0.53,0.7,0.5,0.04,1,0.01,1.6,0.61\n\
             0,35270,39580,9040,23.3,6000,3,1.1884\n"
        )
    };
    let concrete = material(&card("2.0", "3e25", "35270", "0.6805"));
    let law = RiedelHiermaierThoma {
        shear: 16700.0,
        compressive_strength: 35.0,
        tension: 0.1,
        shear_strength: 0.18,
        a: 1.6,
        n: 0.61,
        q0: 0.6805,
        b: 0.0105,
        rate0: 3e-5,
        tension_rate0: 3e-6,
        beta: 0.032,
        tension_beta: 0.036,
        elastic_compression: 0.53,
        elastic_tension: 0.7,
        hardening: 0.5,
        d1: 0.04,
        d2: 1.0,
        least_strain: 0.01,
        residual_a: 1.6,
        residual_n: 0.61,
        distension: 1.1884,
        crush_pressure: 23.3,
        compaction_pressure: 6000.0,
        pore_exponent: 3.0,
        a1: 35270.0,
        a2: 39580.0,
        a3: 9040.0,
        b0: 1.22,
        b1: 1.22,
    };
    assert_eq!(concrete.strength, Strength::RiedelHiermaierThoma(law));
    assert_eq!(concrete.eos, Eos::Linear { bulk: 35270.0 / 1.1884 });
    assert_eq!(material(&card("2.0", "", "0", "0.6805").replace("MAT_RHT", "MAT_272")), concrete);
    let deck = cube(&card("2.0", "3e25", "0", "0.6805"), "");
    assert_eq!(read(&deck).setup.erosion.parts[0].expect("limits").plastic_strain, Some(2.0));
    for (wrong, expected) in [
        (card("2.0", "100", "0", "0.6805"), "EC beyond any rate"),
        (card("2.0", "3e25", "30000", "0.6805"), "T1 that is A1"),
        (card("2.0", "3e25", "0", "0.4"), "a q0 above 0.5"),
    ] {
        assert!(fault(&wrong).contains(expected), "{expected}: {}", fault(&wrong));
    }
}

/// The constants of the cards below, elastic.
const LAMINATE: Orthotropic = Orthotropic {
    young_a: 140_000.0,
    young_b: 10_000.0,
    young_c: 9000.0,
    poisson_ba: 0.02,
    poisson_ca: 0.015,
    poisson_cb: 0.4,
    modulus_ab: 5000.0,
    modulus_bc: 3000.0,
    modulus_ca: 4000.0,
    ax: 1.0,
    ay: 1.0,
    az: 0.0,
    dx: 0.0,
    dy: 1.0,
    dz: 0.0,
    tension_a: 1e30,
    compression_a: 1e30,
    tension_b: 1e30,
    compression_b: 1e30,
    shear_ab: 1e30,
    tension_c: 1e30,
    shear_bc: 1e30,
    shear_ca: 1e30,
    failed_bulk: 0.0,
};

#[test]
fn an_orthotropic_material_has_its_moduli_and_axes() {
    let card = |aopt: &str, rest: &str| {
        format!(
            "*MAT_ORTHOTROPIC_ELASTIC\n1,1.6e-9,140000,10000,9000,0.02,0.015,0.4\n\
             5000,3000,4000,{aopt}{rest}\n,,,1,1,0\n,,,0,1,0\n"
        )
    };
    let found = material(&card("2", ""));
    assert_eq!(found.strength, Strength::Orthotropic(LAMINATE));
    assert_eq!(Some(found.eos), found.strength.bulk().map(|bulk| Eos::Linear { bulk }));
    assert_eq!(material(&card("2", "").replace("ORTHOTROPIC_ELASTIC", "002")), found);
    // By the sides of each element, and by a vector and their normals with an angle.
    let by = |card: &str| read(&cube(card, "")).axes;
    assert_eq!(by(&card("2", "")), []);
    assert_eq!(by(&card("0", "")), [SolidAxes { part: 0, by: Guide::Element, angle: 0.0 }]);
    let across = card("3", "").replace("\n,,,0,1,0\n", "\n0,2,0,0,1,0,30\n");
    assert_eq!(by(&across), [SolidAxes { part: 0, by: Guide::Across([0.0, 2.0, 0.0]), angle: 30.0 }]);
    assert!(fault(&card("4", "")).contains("AOPT 0, 2 or 3"));
    assert!(fault(&across.replace("\n0,2,0,", "\n0,0,2,")).contains("its axes give element 1 none"));
    assert!(fault(&card("2", ",0.1,0.1")).contains("no frequency damping"));
    assert!(fault(&card("2", "").replace("0.02", "0.9")).contains("no strain gives energy away"));
    assert!(fault(&card("2", "").replace(",,,0,1,0", ",,,2,2,0")).contains("not parallel"));
}

#[test]
fn a_composite_has_its_strengths() {
    let card = |rest: &str| {
        format!(
            "*MAT_COMPOSITE_DAMAGE\n1,1.6e-9,140000,10000,9000,0.02,0.015,0.4\n5000,3000,4000,8000,2\n\
             ,,,1,1,0\n,,,0,1,0\n80,2000,50,200,{rest}\n"
        )
    };
    let law = Orthotropic {
        tension_a: 2000.0,
        tension_b: 50.0,
        compression_b: 200.0,
        shear_ab: 80.0,
        tension_c: 40.0,
        shear_bc: 60.0,
        failed_bulk: 8000.0,
        ..LAMINATE
    };
    let found = material(&card(",40,60"));
    assert_eq!(found.strength, Strength::Orthotropic(law));
    assert_eq!(material(&card(",40,60").replace("COMPOSITE_DAMAGE", "022")), found);
    assert!(fault(&card("0.1")).contains("ALPH"));
}

#[test]
fn a_honeycomb_has_one_curve_for_all_stresses() {
    let card = |curves: &str, more: &str| {
        format!(
            "*DEFINE_CURVE\n9\n0.0,1.0\n0.7,1.2\n0.8,9.0\n*MAT_HONEYCOMB\n1,5e-11,70000,0.33,240,0.15\n{curves}\n\
             1000,300,200,400,100,200,2\n,,,1,0,0\n0,1,0{more}\n"
        )
    };
    let by_element = read(&cube(&card("9", "").replace(",200,2\n", ",200,0\n"), "")).axes;
    assert_eq!(by_element, [SolidAxes { part: 0, by: Guide::Element, angle: 0.0 }]);
    let found = material(&card("9", ""));
    let Strength::Honeycomb(law, curve) = found.strength else { panic!("{found:?}") };
    let wanted = Honeycomb {
        young: 70_000.0,
        poisson: 0.33,
        yield_stress: 240.0,
        solid_volume: 0.15,
        young_a: 1000.0,
        young_b: 300.0,
        young_c: 200.0,
        modulus_ab: 400.0,
        modulus_bc: 100.0,
        modulus_ca: 200.0,
        factor_b: 1.0,
        factor_c: 1.0,
        factor_ab: 1.0,
        factor_bc: 1.0,
        factor_ca: 1.0,
        ax: 1.0,
        ay: 0.0,
        az: 0.0,
        dx: 0.0,
        dy: 1.0,
        dz: 0.0,
    };
    assert_eq!(law, wanted);
    assert_eq!((curve.strain[1], curve.stress[2]), (0.7, 9.0));
    assert_eq!(material(&card("9,9,9,9", "").replace("HONEYCOMB", "026")), found);
    assert!(fault(&card("9,8", "")).contains("the curve of LCA for all stresses"));
    assert!(fault(&card("9", ",0.5")).contains("no TSEF"));
    assert!(fault(&card("9", "").replace("0.15", "1.5")).contains("solid_volume"));
}

#[test]
fn zerilli_armstrong_is_of_one_lattice_or_the_other() {
    let card = |n: &str, rest: &str, heat: &str| {
        format!(
            "*MAT_MODIFIED_ZERILLI_ARMSTRONG\n1,7.89e-9,80000,1,{n},294\n65,1033,0.00698,0.000415,266,10{rest}\n1,0,0,{heat}\n"
        )
    };
    let law = ZerilliArmstrong {
        shear: 80_000.0,
        c0: 75.0,
        c1: 1033.0,
        c2: 0.0,
        c3: 0.00698,
        c4: 0.000_415,
        c5: 266.0,
        n: 0.289,
        t_room: 294.0,
        specific_heat: 4.52e8,
        rate0: 1.0,
        taylor_quinney: 1.0,
    };
    let iron = shocked(&card("0.289", "", "4.52e8"));
    assert_eq!(iron.strength, Strength::ZerilliArmstrong(law));
    assert_eq!(iron.eos, Eos::Shock { c0: 3.9e6, s: 1.49, gamma: 2.0 });
    let copper = shocked(&card("0", "", "0").replace("MODIFIED_ZERILLI_ARMSTRONG", "065"));
    let Strength::ZerilliArmstrong(face) = copper.strength else { panic!("{copper:?}") };
    assert_eq!((face.c0, face.c1, face.c2, face.c5, face.taylor_quinney), (331.0, 0.0, 1033.0, 0.0, 0.0));
    let worn = read(&beside_a_shock_line(&card("0", ",0.7", "0")));
    assert_eq!(worn.setup.erosion.parts[0].expect("limits").plastic_strain, Some(0.7));
    for (deck, words) in [
        (card("0.289", "", "4.52e8,1"), "a constant heat capacity"),
        (
            card("0.289", "", "1").replace("1,0,0,", "1,0.1,0,"),
            "hardening that does not depend on temperature",
        ),
        (card("0.289", "", "1").replace(",294\n", ",294,-100\n"), "no pressure cut-off"),
    ] {
        let told = fault_of(&beside_a_shock_line(&deck));
        assert!(told.contains(words), "{words}: {told}");
    }
    assert!(fault(&card("0", "", "0")).contains("the number of an *EOS"));
}

#[test]
fn steinberg_guinan_has_its_heat_by_the_gas_constant() {
    let card = |second: &str, third: &str| {
        format!(
            "*MAT_STEINBERG\n1,8.93e-9,47700,120,36,0.45,0,640\n2.83e-5,2.9e-5,3.77e-4,{second}\n{third}\n"
        )
    };
    let law = SteinbergGuinan {
        shear: 47_700.0,
        yield_stress: 120.0,
        yield_limit: 640.0,
        beta: 36.0,
        n: 0.45,
        initial_strain: 0.0,
        pressure_factor: 2.83e-5,
        yield_pressure_factor: 2.9e-5,
        temperature_factor: 3.77e-4,
        t_melt: 1790.0,
        melt_gamma: 2.02,
        melt_a: 1.5,
        t_room: 300.0,
        specific_heat: 3.0 * 1.14 / 8.93e-9,
        tension: 1e30,
    };
    let copper = shocked(&card("0,63.5,1790,2.02,1.5", "-1e30,2,1.14"));
    assert_eq!(copper.strength, Strength::SteinbergGuinan(law));
    let cut = shocked(&card("0,0,1790,2.02,1.5", "-900,1,1.14").replace("STEINBERG", "011"));
    assert_eq!(cut.strength, Strength::SteinbergGuinan(SteinbergGuinan { tension: 900.0, ..law }));
    for (deck, words) in [
        (card("0.1,0,1790,2.02,1.5", ",,1.14"), "no softening by energy"),
        (card("0,63.5,1790,2.02,1.5", ""), "the heat capacity 3 R'"),
        (card("0,0,1790,2.02,1.5", "-900,2,1.14"), "a cut-off of the pressure alone"),
        (card("0,0,1790,2.02,1.5", "900,1,1.14"), "a pressure cut-off below 0"),
        (card("0,0,1790,2.02,1.5", ",,1.14,0,0,0,1.0"), "the cold energy of the equation of state"),
        (card("0,0,200,2.02,1.5", ",,1.14"), "a melting temperature above room temperature"),
    ] {
        let told = fault_of(&beside_a_shock_line(&deck));
        assert!(told.contains(words), "{words}: {told}");
    }
}

#[test]
fn a_tabulated_pressure_has_points_or_curves_by_the_logarithm_of_the_volume() {
    let null = "*MAT_NULL\n1,1e-9\n";
    let table = |first: &str, points: &str| cube(&format!("{null}*EOS_TABULATED\n{first}\n{points}"), ",1");
    let points = "0,-0.1,-0.3,0.1\n\n0,200,900,-150\n\n1,0.9,0.8,1.1\n\n";
    let Eos::Tabulated(law) = of_deck(&table("1,1.5", points)).eos else { panic!("a table") };
    assert_eq!(law.gamma, 1.5);
    assert_eq!(
        law.pressure.points().collect::<Vec<_>>(),
        [[-0.1, -150.0], [0.0, 0.0], [0.1, 200.0], [0.3, 900.0]]
    );
    assert_eq!(law.factor.points().collect::<Vec<_>>(), [[-0.1, 1.1], [0.0, 1.0], [0.1, 0.9], [0.3, 0.8]]);
    let curves = "*DEFINE_CURVE\n8\n-0.3,900\n-0.1,200\n0,0\n0.1,-150\n*DEFINE_CURVE\n9\n-0.3,0.8\n-0.1,0.9\n0,1\n0.1,1.1\n";
    assert_eq!(of_deck(&table("1,1.5,,,8,9", curves)).eos, Eos::Tabulated(law));
    assert!(fault_of(&table("1,1.5,7", points)).contains("no energy at the start"));
    assert!(fault_of(&table("1,1.5", &points.replace("0,200", "5,200"))).contains("0 at rest"));
    assert!(
        fault_of(&table("1,1.5", &points.replace("-0.1,-0.3", "-0.1,-0.1"))).contains("different volumes")
    );
}

#[test]
fn johnson_cook_of_shells_needs_no_equation_of_state_where_it_has_moduli() {
    let sheet = |moduli: &str| {
        format!(
            "*KEYWORD\n*CONTROL_TERMINATION\n1e-6\n*PART\nsheet\n1,1,1\n*SECTION_SHELL\n1,2\n1,1,1,1\n\
             *MAT_JOHNSON_COOK\n1,7.83e-9,{moduli}\n792,510,0.26,0.014,1.03,1793,293,1\n4.77e8\n\n\
             *NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n*ELEMENT_SHELL\n1,1,1,2,3,4\n*END\n"
        )
    };
    let steel = of_deck(&sheet("8e4,2.08e5,0.3"));
    let Eos::Linear { bulk } = steel.eos else { panic!("{steel:?}") };
    assert!((bulk / (2.08e5 / 1.2) - 1.0).abs() < 1e-12, "{bulk}");
    assert!(matches!(steel.strength, Strength::JohnsonCook { shear: 8e4, .. }), "{steel:?}");
    assert!(fault_of(&sheet("8e4")).contains("needs an equation of state"));
    // A solid needs one whatever moduli it has.
    let solid = "*MAT_JOHNSON_COOK\n1,7.83e-9,8e4,2.08e5,0.3\n792,510,0.26,0.014,1.03,1793,293,1\n4.77e8\n\n";
    assert!(fault(solid).contains("needs an equation of state"));
}

#[test]
fn materials_that_no_part_has_are_left_out_whatever_they_are() {
    let card =
        "*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n*MAT_HILL_3R\n7,7e-9,x\n*MAT_ELASTIC_TITLE\nspare\n8,0,-1\n";
    let reading = deck::read_whole(&cube(card, ""), "a.k").unwrap_or_else(|faults| panic!("{faults:#?}"));
    assert_eq!(reading.model.setup.materials.len(), 1);
    let words: Vec<&str> = reading.warnings.iter().map(|w| w.words.as_str()).collect();
    let told = "materials that no part has are left out: *MAT_HILL_3R 7, *MAT_ELASTIC 8";
    assert!(words.contains(&told), "{words:?}");
    assert!(
        fault(&card.replace("7,7e-9", "1,7e-9"))
            .contains("read *MAT_HILL_3R; expected a material of the table")
    );
}
