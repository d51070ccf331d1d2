//! Erosion in keyword decks: `*MAT_ADD_EROSION`, failure strains and failure laws.

use mechanics::{
    erosion::Criteria,
    material::{Eos, Strength},
};

use super::{cube, fault, good, lines, read, square};

#[test]
fn each_field_of_mat_add_erosion_is_its_criterion() {
    let none = Criteria::default();
    // Fields of the first two cards in their order.
    let cases: [(&str, &str, Criteria); 13] = [
        (",0.5", "", Criteria { pressure: Some(0.5), ..none }),
        (",,-0.5", "", Criteria { compressive_strain: Some(0.5), ..none }),
        (",,,0.5", "", Criteria { geometric_strain: Some(0.5), ..none }),
        (",,,,0.5", "", Criteria { expansion: Some(0.5), ..none }),
        (",,,,-0.5", "", Criteria { compaction: Some(0.5), ..none }),
        ("", "-0.5", Criteria { tension: Some(0.5), ..none }),
        ("", ",0.5", Criteria { principal_stress: Some(0.5), ..none }),
        ("", ",,0.5", Criteria { von_mises: Some(0.5), ..none }),
        ("", ",,,0.5", Criteria { principal_strain: Some(0.5), ..none }),
        ("", ",,,,0.5", Criteria { shear_strain: Some(0.5), ..none }),
        (",,,,,1,1", ",,,,0.5", Criteria { shear_strain: Some(0.5), ..none }),
        (",7,,7", ",,7,,0.5", Criteria { shear_strain: Some(0.5), ..none }),
        (
            "",
            ",0.25,,,0.5\n\n\n,,,1e-7",
            Criteria { principal_stress: Some(0.25), shear_strain: Some(0.5), time_step: Some(1e-7), ..none },
        ),
    ];
    for (first, second, expected) in cases {
        // EXCL 7 takes out what is 7.
        let excluded = if first.contains('7') { "7" } else { "" };
        let model = good(&format!("*MAT_ADD_EROSION\n1,{excluded}{first}\n{second}\n"));
        assert_eq!(model.setup.erosion.parts, [Some(expected)], "{first} / {second}");
    }
    // Without contact nodes stay; of two limits the lower counts; without any nothing erodes.
    let twice = good("*MAT_ADD_EROSION\n1,,0.5\n*MAT_ADD_EROSION\n1,,0.4\n-0.1\n");
    assert_eq!(
        twice.setup.erosion.parts,
        [Some(Criteria { pressure: Some(0.4), tension: Some(0.1), ..none })]
    );
    assert!(twice.setup.erosion.retain_inertia);
    assert!(!good("*MAT_ADD_EROSION\n1\n").setup.erosion.is_on());
}

#[test]
fn shells_break_point_by_point_and_say_so_where_mat_add_erosion_asks_for_fewer() {
    let steel = "*MAT_PLASTIC_KINEMATIC\n1,7.85e-9,2.1e5,0.3,300.\n";
    let of = |points: &str, limits: &str| {
        let deck =
            square(&format!("*SECTION_SHELL\n1,2,,3,,1\n1.0\n*MAT_ADD_EROSION\n1,{limits},,{points}\n"), "");
        deck::read_whole(&deck.replace("*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n", steel), "a.k")
    };
    for (points, told) in [("-100", false), ("3", false), ("", true), ("1", true), ("-50", true)] {
        let reading = of(points, ",,,-0.2").unwrap_or_else(|f| panic!("{}", lines(&f)));
        let expected = Criteria { plastic_strain: Some(0.2), ..Criteria::default() };
        assert_eq!(reading.model.setup.erosion.parts, [Some(expected)]);
        let warnings: Vec<String> = reading.warnings.iter().map(ToString::to_string).collect();
        let is_told =
            warnings.iter().any(|w| w.contains("shells leave when all 3 points through their thickness"));
        assert_eq!(is_told, told, "{points}: {warnings:?}");
    }
    for (limits, name) in [(",,,0.2", "EFFEPS"), (",0.2,,", "MXPRES"), (",,-0.2,", "MNEPS")] {
        let faults = of("-100", limits).err().map(|f| lines(&f)).unwrap_or_default();
        assert!(
            faults.contains(name) && faults.contains("expected plastic_strain: shells"),
            "{name}: {faults}"
        );
    }
    let solids = fault("*MAT_ADD_EROSION\n1,,1.0,,,,4\n");
    assert!(solids.contains("NUMFIP 0 or 1"), "{solids}");
}

#[test]
fn materials_with_a_failure_strain_a_failure_law_or_a_least_step_erode_by_it() {
    let of = |card: &str| {
        let deck = cube("").replace("*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n", card);
        assert!(deck.contains(card));
        read(&deck).unwrap_or_else(|f| panic!("{}", lines(&f))).setup
    };
    let none = Criteria::default();
    let strain = Criteria { plastic_strain: Some(0.8), ..none };
    assert_eq!(of("*MAT_003\n1,7.85e-9,2.1e5,0.3,300.\n,,0.8\n").erosion.parts, [Some(strain)]);
    let both = Criteria { time_step: Some(1e-8), ..strain };
    assert_eq!(of("*MAT_024\n1,7.85e-9,2.1e5,0.3,300.,,0.8,1e-8\n").erosion.parts, [Some(both)]);
    assert_eq!(of("*MAT_098\n1,7.85e-9,2.1e5,0.3\n300.,200.,0.3,0.01,0.8\n").erosion.parts, [Some(strain)]);
    assert!(!of("*MAT_024\n1,7.85e-9,2.1e5,0.3,300.,,1e21\n").erosion.is_on());
    let tile = of(
        "*MAT_110\n1,2.51e-9,1.97e5,0.927,0.7,0.005,0.85,0.67\n1.,260.,0.2,19000.,8710.,1.\n0.001,0.5,2.33e5,-5.93e5,2.8e6,0.8\n",
    );
    assert_eq!(tile.erosion.parts, [Some(strain)]);
    let Eos::Polynomial { a1, a2, a3, t1, .. } = tile.materials[0].eos else { panic!("{tile:?}") };
    assert_eq!([a1, a2, a3, t1], [2.33e5, -5.93e5, 2.8e6, 2.33e5]);
    let Strength::JohnsonHolmquist(law) = tile.materials[0].strength else { panic!("{tile:?}") };
    assert_eq!(
        [law.hel_stress, law.hel_pressure, law.tension, law.m, law.n],
        [15435.0, 8710.0, 260.0, 0.85, 0.67]
    );
    // Johnson and Cook: D1 to D5, and EROD in the card of D5.
    let cook = |last: &str| {
        let deck = cube("*EOS_GRUNEISEN\n1,3.9e6,1.49,,,2.0\n").replace("\n1,1,1\n", "\n1,1,1,1\n").replace(
            "*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n",
            &format!("*MAT_JOHNSON_COOK\n1,7.85e-9,8e4\n300.,200.,0.3,0.01\n,,,,0.1,0.2,-1.5,0.0\n{last}\n"),
        );
        read(&deck).unwrap_or_else(|f| panic!("{}", lines(&f))).setup
    };
    assert_eq!(cook("0.0").erosion.parts, [Some(Criteria { failure: true, ..none })]);
    assert!(!cook("0.0,0.0,1").erosion.is_on(), "EROD 1 keeps broken elements");
}
