//! Charges of keyword decks.

use deck::{Model, Reading};
use mechanics::load::{
    Span, SurfaceKind,
    blast::{Burst, Charge},
};

/// A cube of 100 mm in mm, s, t, and what is added to it.
fn cube(more: &str) -> String {
    format!(
        "*KEYWORD\n*CONTROL_TERMINATION\n1e-3\n*PART\ncube\n1,1,1\n*SECTION_SOLID\n1,1\n*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n*NODE\n\
         1,0,0,0\n2,100,0,0\n3,100,100,0\n4,0,100,0\n5,0,0,100\n6,100,0,100\n7,100,100,100\n8,0,100,100\n\
         *ELEMENT_SOLID\n1,1,1,2,3,4,5,6,7,8\n*SET_SEGMENT\n5\n1,2,3,4\n{more}*END\n"
    )
}

fn good(more: &str) -> Model {
    let text = cube(more);
    let Reading { model, .. } =
        deck::read_whole(&text, "a.k").unwrap_or_else(|faults| panic!("{faults:#?}\n{text}"));
    assert_eq!(format!("{:?}", super::converted(&text, "a.k")), format!("{model:?}"));
    model
}

fn fault(more: &str) -> String {
    let faults = deck::read(&cube(more), "a.k").expect_err(more);
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

fn charge(model: &Model) -> Charge {
    let [charge] = model.setup.loads.charges[..] else { panic!("one charge") };
    let [surface] = &model.setup.loads.surfaces[..] else { panic!("one load") };
    assert_eq!((surface.kind, surface.faces.len()), (SurfaceKind::Blast(0), 1));
    charge
}

/// 8 kg, 2 m below the cube.
const ENHANCED: &str = "*LOAD_BLAST_ENHANCED\n3,8e-3,50.,50.,-2000.,1e-4,7,1\n0,0,0,0,0,5e-3,1\n";

#[test]
fn a_charge_has_its_mass_place_units_and_times() {
    let model = good(&format!("{ENHANCED}*LOAD_BLAST_SEGMENT_SET\n3,5\n"));
    let charge = charge(&model);
    assert_eq!((charge.burst, charge.negative, charge.point), (Burst::Surface, false, [50.0, 50.0, -2000.0]));
    assert_eq!(charge.span, Span { from: 1e-4, until: 5e-3 });
    assert!((charge.root - 2.0).abs() < 1e-14, "{}", charge.root);
    let [metres, milliseconds, kilopascals] = charge.units;
    assert!((metres * 1e3 - 1.0).abs() < 1e-15 && milliseconds == 1e3 && kilopascals == 1e3);
    let one = good(&format!("{ENHANCED}*LOAD_BLAST_SEGMENT\n3,1,2,3,4\n"));
    assert_eq!(one.setup.loads.charges, model.setup.loads.charges);
}

#[test]
fn the_old_form_acts_on_segments_with_curve_minus_two() {
    let metric = |text: &str| {
        let model = deck::read(text, "a.k").unwrap_or_else(|faults| panic!("{faults:#?}"));
        charge(&model)
    };
    // In SI the cube is 100 m wide.
    let text =
        cube("*CONTROL_UNITS\nm,sec,kg\n*LOAD_BLAST\n8.,50.,50.,-2.,0.0,2,2\n*LOAD_SEGMENT_SET\n5,-2\n");
    let charge = metric(&text.replace("7.85e-9,2.1e5", "7850.,2.1e11"));
    assert_eq!((charge.burst, charge.negative, charge.units), (Burst::Air, true, [1.0, 1e3, 1e-3]));
}

#[test]
fn what_has_no_curves_here_is_refused() {
    let segment = "*LOAD_BLAST_SEGMENT_SET\n3,5\n";
    assert!(fault(segment).contains("expected a *LOAD_BLAST, or a *LOAD_BLAST_ENHANCED of that number"));
    let with = |from: &str, to: &str| fault(&format!("{}{segment}", ENHANCED.replace(from, to)));
    assert!(with(",7,1", ",7,4").contains("a hemisphere on the ground"));
    assert!(with(",7,1", ",3,1").contains("UNIT 2 (SI)"));
    assert!(with(",7,1", ",2,1").contains("give --units SI"));
    let old = fault("*LOAD_BLAST\n8e-3,50.,50.,-2000.,0.0,7,1\n*LOAD_SEGMENT_SET\n5,-2\n");
    assert!(
        old.contains(
            "expected UNIT 2 (SI) or 4 (cm, g, us); use *LOAD_BLAST_ENHANCED, which has UNIT 6 and 7"
        ),
        "{old}"
    );
    assert!(with("8e-3", "0.0").contains("a mass of TNT above 0"));
    assert!(with("-2000.", "-10.").contains("a scaled distance of at least 0.0674 for a surface burst"));
}
