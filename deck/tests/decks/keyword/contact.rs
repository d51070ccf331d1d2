//! Contact in keyword decks: ties, those that break, and friction that falls with the velocity.

use deck::Model;

/// A cube of 5 above the middle of a cube of 10, `gap` above it.
fn deck_of(gap: f64, contact: &str) -> String {
    let mut nodes = String::new();
    let mut id = 0;
    for ([low, high], bottom) in [([0.0, 10.0], 0.0), ([2.0, 7.0], 10.0 + gap)] {
        for z in [bottom, bottom + high - low] {
            for [x, y] in [[low, low], [high, low], [high, high], [low, high]] {
                id += 1;
                nodes += &format!("{id},{x},{y},{z}\n");
            }
        }
    }
    format!(
        "*KEYWORD\n*CONTROL_TERMINATION\n1e-6\n*PART\nbelow\n1,1,1\nabove\n2,1,1\n*SECTION_SOLID\n1,1\n\
         *MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n*NODE\n{nodes}\
         *ELEMENT_SOLID\n1,1,1,2,3,4,5,6,7,8\n2,2,9,10,11,12,13,14,15,16\n{contact}*END\n"
    )
}

fn good(gap: f64, contact: &str) -> Model {
    deck::read(&deck_of(gap, contact), "a.k").unwrap_or_else(|faults| panic!("{faults:?}"))
}

#[test]
fn tied_contact_ties_the_nodes_of_the_first_side_to_faces_of_the_second() {
    for keyword in ["TIED_NODES_TO_SURFACE", "TIED_SURFACE_TO_SURFACE_ID\n1,glue"] {
        let model = good(0.0, &format!("*CONTACT_{keyword}\n2,1,3,3\n\n\n"));
        let settings = model.setup.contact.expect("they are tied");
        assert_eq!(settings.ties.len(), 4);
        assert!(settings.ties.iter().all(|tie| tie.parts == [1, 0]));
        assert!(!settings.interacts.contains(&true), "parts that are tied do not meet besides");
    }
    let faults = deck::read(&deck_of(1.0, "*CONTACT_TIED_NODES_TO_SURFACE\n2,1,3,3\n\n\n"), "a.k");
    let faults = faults.expect_err("they are apart");
    assert!(
        faults.iter().any(|fault| fault.to_string().contains("none of which lies on a face")),
        "{faults:?}"
    );
}

#[test]
fn mortar_contact_is_our_own_with_a_warning() {
    let text = deck_of(1.0, "*CONTACT_AUTOMATIC_SURFACE_TO_SURFACE_MORTAR_ID\n1,both\n1,2,3,3\n0.2,0.2\n\n");
    let reading = deck::read_whole(&text, "a.k").unwrap_or_else(|faults| panic!("{faults:?}"));
    assert!(reading.model.setup.contact.is_some_and(|settings| settings.interacts.contains(&true)));
    let warnings: Vec<String> = reading.warnings.iter().map(ToString::to_string).collect();
    assert!(
        warnings.iter().any(|words| words.contains("our own penalty, on nodes and faces")),
        "{warnings:?}"
    );
}

#[test]
fn tiebreak_contact_ties_until_its_strength_and_meets_then() {
    // Corners of a face of 5 by 5.
    let quarter = 25.0 / 4.0;
    for (keyword, card, pull, shear, meets) in [
        ("TIEBREAK_NODES_TO_SURFACE", "60.0,80.0", 60.0, 80.0, true),
        ("TIEBREAK_NODES_ONLY", "60.0,0.0,2,2", 60.0, f64::INFINITY, false),
        ("TIEBREAK_SURFACE_TO_SURFACE", "4.0,8.0", 4.0 * quarter, 8.0 * quarter, true),
        ("AUTOMATIC_SURFACE_TO_SURFACE_TIEBREAK_ID\n1,glue", "2,4.0,8.0", 4.0 * quarter, 8.0 * quarter, true),
        ("AUTOMATIC_ONE_WAY_SURFACE_TO_SURFACE_TIEBREAK", "2,4.0", 4.0 * quarter, f64::INFINITY, true),
    ] {
        let model = good(0.0, &format!("*CONTACT_{keyword}\n2,1,3,3\n0.2,0.2\n\n{card}\n"));
        let settings = model.setup.contact.expect("they are tied");
        assert!(settings.ties_break && settings.ties.len() == 4, "{keyword}");
        for tie in &settings.ties {
            let bond = tie.bond.expect("it breaks");
            assert!((bond.pull - pull).abs() < 1e-12 * pull, "{keyword}: {bond:?}");
            assert!(bond.shear == shear || (bond.shear - shear).abs() < 1e-12 * shear, "{keyword}: {bond:?}");
        }
        assert_eq!(settings.interacts, [false, meets, meets, false], "{keyword}");
        assert!(!meets || settings.friction[1] == 0.2, "{keyword}");
    }
    for (keyword, card, expected) in [
        ("AUTOMATIC_SURFACE_TO_SURFACE_TIEBREAK", "6,4.0,8.0", "OPTION 2"),
        ("TIEBREAK_NODES_TO_SURFACE", "60.0,80.0,1.5,2.0", "an exponent of 2"),
        ("TIEBREAK_SURFACE_TO_SURFACE", "4.0,8.0,7", "no curve by which the tie weakens"),
        ("TIEBREAK_SURFACE_TO_SURFACE", "0.0,0.0", "a strength of the tie above 0"),
        ("TIEBREAK_NODES_ONLY", "-1.0,2.0", "0"),
    ] {
        let faults = deck::read(&deck_of(0.0, &format!("*CONTACT_{keyword}\n2,1,3,3\n\n\n{card}\n")), "a.k");
        let faults = faults.expect_err(keyword);
        assert!(faults.iter().any(|fault| fault.to_string().contains(expected)), "{keyword}: {faults:?}");
    }
}

#[test]
fn friction_falls_from_fs_to_fd_by_dc() {
    let of = |card: &str| {
        good(1.0, &format!("*CONTACT_AUTOMATIC_SURFACE_TO_SURFACE\n2,1,3,3\n{card}\n\n"))
            .setup
            .contact
            .expect("they meet")
    };
    let falls = of("0.3,0.1,2.0");
    assert_eq!((falls.friction[1], falls.friction_kinetic[1], falls.friction_decay), (0.3, 0.1, 2.0));
    assert!(falls.sticks);
    // Without DC the coefficient is FS.
    let constant = of("0.3,0.1,0.0");
    assert_eq!(
        (constant.friction[1], constant.friction_kinetic[1], constant.friction_decay),
        (0.3, 0.3, 0.0)
    );
}

#[test]
fn a_first_card_that_begins_with_a_parameter_is_no_second_card_of_mpp() {
    let parameters = "*PARAMETER\nIlower,1\nIupper,2\n";
    let plain = good(1.0, "*CONTACT_AUTOMATIC_SURFACE_TO_SURFACE\n1,2,3,3\n0.3\n\n");
    for contact in [
        "*CONTACT_AUTOMATIC_SURFACE_TO_SURFACE_ID\n1,pair\n&lower,&upper,3,3\n0.3\n\n",
        "*CONTACT_AUTOMATIC_SURFACE_TO_SURFACE_MPP\n0,200\n&lower,&upper,3,3\n0.3\n\n",
        "*CONTACT_AUTOMATIC_SURFACE_TO_SURFACE_MPP\n0,200\n&,0,1\n&lower,&upper,3,3\n0.3\n\n",
        "*CONTACT_AUTOMATIC_SURFACE_TO_SURFACE_MPP_ID\n1,pair\n0,200\n&        0         1\n&lower,2,3,3\n0.3\n\n",
    ] {
        assert_eq!(good(1.0, &format!("{parameters}{contact}")).setup, plain.setup, "{contact}");
    }
}

#[test]
fn general_contact_and_one_of_soft_2_that_looks_for_edges_have_edges() {
    let edges = |contact: &str| good(1.0, contact).setup.contact.is_some_and(|settings| settings.edges);
    assert!(edges("*CONTACT_AUTOMATIC_GENERAL\n0\n\n\n"));
    assert!(edges("*CONTACT_AUTOMATIC_SINGLE_SURFACE\n0\n\n\n2,0.1,0,0,0,5\n"));
    assert!(edges("*CONTACT_ERODING_SINGLE_SURFACE\n0\n\n\n0,1\n2,0.1,0,0,0,35\n"));
    assert!(!edges("*CONTACT_ERODING_SINGLE_SURFACE\n0\n\n\n2,1,0,0,0,5\n"));
    assert!(!edges("*CONTACT_AUTOMATIC_SINGLE_SURFACE\n0\n\n\n1,0.1,0,0,0,5\n"));
    assert!(!edges("*CONTACT_AUTOMATIC_SINGLE_SURFACE\n0\n\n\n2,0.1,0,0,0,13\n"));
}

#[test]
fn friction_by_a_table_is_refused() {
    let text = deck_of(1.0, "*CONTACT_AUTOMATIC_SURFACE_TO_SURFACE\n2,1,3,3\n2.0,7\n\n");
    let faults = deck::read(&text, "a.k").expect_err("a table");
    assert!(faults[0].to_string().contains("with FS 2 the field FD is the number"), "{faults:?}");
}

fn warnings(text: &str) -> Vec<String> {
    let reading = deck::read_whole(text, "a.k").unwrap_or_else(|faults| panic!("{faults:?}"));
    reading.warnings.iter().map(ToString::to_string).collect()
}

#[test]
fn thicknesses_and_damping_of_contact_are_told() {
    let told = |keyword: &str, gap: f64, second: &str, third: &str| {
        warnings(&deck_of(gap, &format!("*CONTACT_{keyword}\n2,1,3,3\n{second}\n{third}\n"))).join("\n")
    };
    let both = "AUTOMATIC_SURFACE_TO_SURFACE";
    for (second, third) in [("0.2", ""), ("0.2,0.2,0,0,0", "1,1,0,0,1,1.0"), ("", ",,,,0,0")] {
        assert_eq!(told(both, 1.0, second, third), "");
    }
    let thick = told(both, 1.0, "", "1,1,0.2,0,1,0.5");
    assert!(
        thick.starts_with("a.k:36: SST 0.2 (field 3 of card 3), SFMT 0.5 (field 6 of card 3): "),
        "{thick}"
    );
    assert!(thick.contains("contact is as thick as its gap"), "{thick}");
    let tied = told("TIED_SURFACE_TO_SURFACE", 0.0, "", ",,,-0.2");
    assert!(tied.contains("MST -0.2 (field 4 of card 3): ties hold nodes within 5 %"), "{tied}");
    let damped = told(both, 1.0, "0.2,0.2,0,0,20", "");
    assert!(damped.contains("a.k:35: VDC 20 (field 5 of card 2): contact is not damped by it"), "{damped}");
    assert_eq!(damped.lines().count(), 1, "{damped}");
}

/// Two sheets of 2 mm, whose middles are 3 apart.
fn sheets(contact: &str) -> String {
    format!(
        "*KEYWORD\n*CONTROL_TERMINATION\n1e-6\n*PART\nbelow\n1,1,1\nabove\n2,1,1\n*SECTION_SHELL\n1,2\n2,2,2,2\n\
         *MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n*NODE\n1,0,0,0\n2,10,0,0\n3,10,10,0\n4,0,10,0\n5,0,0,3\n6,10,0,3\n7,10,10,3\n8,0,10,3\n\
         *ELEMENT_SHELL\n1,1,1,2,3,4\n2,2,5,6,7,8\n{contact}*END\n"
    )
}

#[test]
fn sheets_that_overlap_by_half_a_thickness_are_told() {
    let words = "surfaces overlap by half a thickness";
    for contact in ["SURFACE_TO_SURFACE\n1,2,3,3\n\n\n", "SINGLE_SURFACE\n0\n\n\n"] {
        let told = warnings(&sheets(&format!("*CONTACT_AUTOMATIC_{contact}")));
        assert_eq!(told.iter().filter(|warning| warning.contains(words)).count(), 1, "{contact}: {told:?}");
    }
    let solids = warnings(&deck_of(1.0, "*CONTACT_AUTOMATIC_SINGLE_SURFACE\n0\n\n\n"));
    assert!(solids.is_empty(), "{solids:?}");
}

#[test]
fn ignore_lets_nodes_start_inside() {
    let both = "AUTOMATIC_SURFACE_TO_SURFACE";
    let plain = format!("*CONTACT_{both}\n2,1,3,3\n\n\n");
    let faults = deck::read(&deck_of(-0.5, &plain), "a.k").expect_err("one is inside the other");
    assert!(faults[0].to_string().contains("or give it IGNORE 1"), "{faults:?}");
    for contact in [
        format!("*CONTACT_{both}\n2,1,3,3\n\n\n0\n,,\n0,1\n"),
        "*CONTACT_ERODING_SURFACE_TO_SURFACE\n2,1,3,3\n\n\n0,1\n0\n0\n0,2\n".to_string(),
        format!("*CONTACT_{both}_MPP\n1,200\n2,1,3,3\n\n\n"),
        format!("*CONTROL_CONTACT\n0\n0\n0\n1\n{plain}"),
    ] {
        let text = deck_of(-0.5, &contact);
        let told = warnings(&text).join("\n");
        assert_eq!(told.matches("pass the faces there for the whole run").count(), 1, "{contact}: {told}");
        let settings = super::converted(&text, "a.k").setup.contact.expect("they meet");
        assert!(settings.ignores_initial, "{contact}");
    }
    let text = deck_of(1.0, &plain);
    assert!(warnings(&text).is_empty() && !good(1.0, &plain).setup.contact.expect("contact").ignores_initial);
}
