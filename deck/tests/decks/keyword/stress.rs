//! `*INITIAL_STRESS_SOLID` and `*INITIAL_STRESS_SHELL`.

use mechanics::initial::{InitialStress, PointStress, Points};

use super::*;

/// Two shells beside the cube, of two layers.
const SHELLS: &str = "*PART\nsheet\n2,2,1\n*SECTION_SHELL\n2,2,1.0,2\n0.5,0.5,0.5,0.5\n*ELEMENT_SHELL\n       7       2       1       2       3       4\n       8       2       5       6       7       8\n";

fn point(stress: [f64; 6], plastic_strain: f64) -> PointStress {
    PointStress { stress, plastic_strain }
}

fn of(part: u32, elements: &[u32], points: Points) -> InitialStress {
    InitialStress { part, elements: Some(elements.to_vec()), points }
}

/// With a material that yields.
fn deck(more: &str) -> String {
    cube(more).replace(
        "*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n",
        "*MAT_PLASTIC_KINEMATIC\n1,7.85e-9,2.1e5,0.3,250.0,0.0,1.0\n",
    )
}

fn stress(more: &str) -> Vec<InitialStress> {
    read(&deck(more)).unwrap_or_else(|f| panic!("{}", lines(&f))).stress
}

#[test]
fn stress_of_solids_is_that_of_their_cards_in_both_formats() {
    let one = point([10.0, 20.0, 30.0, 4.0, 5.0, 6.0], 0.07);
    let small = "*INITIAL_STRESS_SOLID\n1,1\n10.0,20.0,30.0,4.0,5.0,6.0,0.07\n";
    assert_eq!(stress(small), [of(0, &[0], Points::Same(one))]);
    // Fields of sixteen columns, and history variables that are 0.
    let wide = |numbers: &[f64]| numbers.iter().map(|x| format!("{x:16.9e}")).collect::<String>() + "\n";
    let large = "*INITIAL_STRESS_SOLID\n         1         1         4         1\n".to_owned()
        + &wide(&[10.0, 20.0, 30.0, 4.0, 5.0])
        + &wide(&[6.0, 0.07, 0.0, 0.0, 0.0])
        + &wide(&[0.0]);
    assert_eq!(stress(&large), [of(0, &[0], Points::Same(one))]);
    let eight: String = (1..=8).map(|n| format!("{n}.0,0,0,0,0,0,0\n")).collect();
    let found = stress(&format!("*INITIAL_STRESS_SOLID\n1,8\n{eight}"));
    let each = (1..=8).map(|n| point([f64::from(n), 0.0, 0.0, 0.0, 0.0, 0.0], 0.0)).collect();
    assert_eq!(found, [of(0, &[0], Points::Each(each))]);
    let of_set = "*SET_SOLID\n3\n1\n*INITIAL_STRESS_SOLID_SET\n3,1\n10.0,20.0,30.0,4.0,5.0,6.0,0.07\n";
    assert_eq!(stress(of_set), [of(0, &[0], Points::Same(one))]);
    let options = Options::default();
    let gathered = bundle::gather("a.k", deck(small), &options, &mut |_| None).expect("one file");
    let written = deck::convert(&gathered, "a.k", "a.mesh").expect("it was read").deck;
    let expected = "[[initial_stress]]\nparts = [\"cube\"]\nelements = [1]\nstress = [10.0, 20.0, 30.0, 4.0, 5.0, 6.0]\nplastic_strain = 0.07\n";
    assert!(written.contains(expected), "{written}");
}

#[test]
fn stress_of_shells_is_the_mean_of_the_points_at_a_height() {
    let cards = "*INITIAL_STRESS_SHELL\n7,2,2\n0.5,1.0,0,0,0,0,0,0.1\n0.5,3.0,0,0,0,0,0,0.3\n-0.5,-2.0,0,0,0,0,0,0\n-0.5,-6.0,0,0,0,0,0,0\n8,1,1\n0,0,5.0,0,1.0,0,0,0\n";
    let expected = [
        of(
            1,
            &[0],
            Points::Layers(vec![
                (-0.5, point([-4.0, 0.0, 0.0, 0.0, 0.0, 0.0], 0.0)),
                (0.5, point([2.0, 0.0, 0.0, 0.0, 0.0, 0.0], 0.2)),
            ]),
        ),
        of(1, &[1], Points::Same(point([0.0, 5.0, 0.0, 1.0, 0.0, 0.0], 0.0))),
    ];
    assert_eq!(stress(&format!("{SHELLS}{cards}")), expected);
    let large = "*INITIAL_STRESS_SHELL\n8,1,1,1,0,1\n0,0,5.0,0,1.0\n0,0,0\n0.0\n";
    assert_eq!(stress(&format!("{SHELLS}{large}")), expected[1..]);
    let of_set = "*SET_SHELL\n3\n7,8\n*INITIAL_STRESS_SHELL_SET\n3,1,1\n0,0,5.0,0,1.0,0,0,0\n";
    let found = stress(&format!("{SHELLS}{of_set}"));
    assert_eq!(found, [of(1, &[0, 1], Points::Same(point([0.0, 5.0, 0.0, 1.0, 0.0, 0.0], 0.0)))]);
}

#[test]
fn what_stress_cannot_be_is_told_at_its_field() {
    for (cards, words) in [
        ("*INITIAL_STRESS_SOLID\n9,1\n1.0\n", "solid 9; expected a solid of the deck"),
        ("*INITIAL_STRESS_SOLID\n1,0\n1.0\n", "expected 1 to 1000 points"),
        ("*INITIAL_STRESS_SOLID\n1,2\n1.0\n", "expected a card of stress for each point"),
        ("*INITIAL_STRESS_SOLID\n1,1,1\n1.0\n3.0\n", "expected a history variable of 0"),
        ("*INITIAL_STRESS_SOLID\n1,1,0,2\n1.0\n", "expected LARGE 0 or 1"),
        ("*INITIAL_STRESS_SOLID\n1,1,1,1,1\n1.0\n", "expected 0: stress and plastic strain"),
        ("*INITIAL_STRESS_SOLID\n1,1\n1,0,0,0,0,0,-0.1\n", "expected a plastic strain of 0 or more"),
        ("*INITIAL_STRESS_SHELL\n7,1,2\n0,1.0\n0,2.0\n", "expected so many different heights"),
        ("*INITIAL_STRESS_SHELL\n1,1,1\n0,1.0\n", "shell 1; expected a shell of the deck"),
        ("*INITIAL_STRESS_BEAM\n1\n", "*INITIAL_STRESS_BEAM"),
    ] {
        let found = read(&deck(&format!("{SHELLS}{cards}"))).expect_err(words);
        assert!(
            found.len() == 1 && without_card(&found[0].to_string()).contains(words),
            "{cards}{}",
            lines(&found)
        );
    }
    // Strains that another program reports change nothing.
    let reading = deck::read_whole(&deck("*INITIAL_STRAIN_SOLID\n1\n0.1,0,0,0,0,0\n"), "a.k");
    let reading = reading.unwrap_or_else(|f| panic!("{}", lines(&f)));
    assert!(reading.model.stress.is_empty());
    let warned = reading.warnings.iter().any(|warning| warning.words.contains("*INITIAL_STRAIN_SOLID"));
    assert!(warned, "{:?}", reading.warnings);
}
