//! What the reader of keyword decks once refused, passed over or told badly, each in a small deck.

use deck::{
    Fault, Reading,
    bundle::{self, Options},
};

/// One cube of steel under `keyword`, with the cards of its section and element, and what is added to it.
fn cube_of(keyword: &str, section: &str, element: &str, more: &str) -> String {
    format!(
        "{keyword}\n*CONTROL_TERMINATION\n1e-6\n*PART\ncube\n1,1,1\n*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n*NODE\n\
         1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n{section}{element}{more}*END\n"
    )
}

const SECTION: &str = "*SECTION_SOLID\n1,1\n";
const ELEMENT: &str = "*ELEMENT_SOLID\n1,1,1,2,3,4,5,6,7,8\n";

fn cube(more: &str) -> String {
    cube_of("*KEYWORD", SECTION, ELEMENT, more)
}

fn lines(faults: &[Fault]) -> Vec<String> {
    faults.iter().map(ToString::to_string).collect()
}

fn good(text: &str) -> Reading {
    deck::read_whole(text, "a.k").unwrap_or_else(|faults| panic!("{:#?}\n{text}", lines(&faults)))
}

fn faults(text: &str) -> Vec<String> {
    lines(&deck::read(text, "a.k").expect_err("a fault"))
}

fn warned(reading: &Reading, words: &str) -> bool {
    reading.warnings.iter().any(|warning| warning.words.contains(words))
}

#[test]
fn an_element_on_two_cards_may_have_zeros_on_the_first() {
    let ten = "*ELEMENT_SOLID (ten nodes format)\n1,1,0,0,0,0,0,0,0,0\n1,2,3,4,5,6,7,8,0,0\n";
    let fixed = format!("*ELEMENT_SOLID\n{:8}{:8}{:>64}\n{}\n", 1, 1, 0, "1,2,3,4,5,6,7,8,0,0");
    for element in [ten, &fixed] {
        let model = good(&cube_of("*KEYWORD", SECTION, element, "")).model;
        assert_eq!(model, good(&cube("")).model);
    }
}

#[test]
fn shifted_columns_of_many_cards_are_told_three_times_and_counted() {
    let cards: String = (1..=8).map(|node| format!("{node:>8}{0:>8}{0:>8}{1:>8}{1:>8}\n", 0, 1)).collect();
    let told = faults(&cube(&format!("*BOUNDARY_SPC_NODE\n{cards}")));
    let number: Vec<&String> = told.iter().filter(|fault| fault.contains("(field 4, card")).collect();
    assert_eq!(number.len(), 3, "{told:#?}");
    assert!(number[2].ends_with("; 5 more lines have this fault, to line 30"), "{}", number[2]);
    // One that is told twice in the same words is one.
    let twice = faults("*KEYWORD\n*PARAMETER\nR,tend,1e-6\n*END\n");
    assert_eq!(twice.iter().filter(|fault| fault.contains("R,tend")).count(), 1, "{twice:#?}");
}

#[test]
fn every_section_under_one_keyword_has_its_title() {
    let solid = "*SECTION_SOLID_TITLE\nfirst\n2,1\nsecond\n1,1\n";
    assert_eq!(good(&cube_of("*KEYWORD", solid, ELEMENT, "")).model, good(&cube("")).model);
    let shells = "*SECTION_SHELL_TITLE\nthick\n2,2\n3.0\nthin\n1,2\n0.5\n";
    let element = "*ELEMENT_SHELL\n1,1,1,2,3,4\n";
    let model = good(&cube_of("*KEYWORD", shells, element, "")).model;
    assert_eq!(model.mesh.parts[0].section().map(|section| section.thickness), Some(0.5));
}

#[test]
fn a_range_may_end_far_above_the_last_number() {
    let parts =
        "*SET_PART_LIST_GENERATE\n1\n1,99999999\n*INITIAL_VELOCITY_GENERATION\n1,1,0.0,0.0,0.0,-10.0\n";
    assert!(good(&cube(parts)).model.velocity.iter().all(|v| v[2] == -10.0));
    let nodes = "*SET_NODE_LIST_GENERATE\n1\n5,1999999999\n*BOUNDARY_SPC_SET\n1,0,1\n";
    let model = good(&cube(nodes)).model;
    assert_eq!(model.constraint.iter().filter(|c| **c != 0).count(), 4);
    assert!(faults(&cube("*SET_NODE_LIST_GENERATE\n1\n5,4\n"))[0].contains("not below the first"));
}

#[test]
fn keywords_that_do_nothing_here_are_read() {
    let plain = good(&cube("")).model;
    assert_eq!(good(&cube_of("*KEYWORD_ID\nproject", SECTION, ELEMENT, "")).model, plain);
    assert_eq!(good(&cube("*PARAMETER_DUPLICATION\n1\n")).model, plain);
    let unused = "*DEFINE_CURVE\n7,1\n0,300\n1,400\n";
    assert_eq!(good(&cube(unused)).model, plain);
    // In use it is not the curve of the run.
    let used = faults(&cube(&format!("{unused}*LOAD_BODY_Z\n7\n")));
    assert!(
        used[0].starts_with("a.k:23:3: read SIDR = 1 (card 1 of *DEFINE_CURVE); expected SIDR 0 or 2"),
        "{used:?}"
    );
    assert!(used[0].ends_with("correct it; line 27 takes this curve"), "{used:?}");
}

#[test]
fn keywords_that_matter_are_honoured_or_refused() {
    for (more, expected) in [
        ("*CONTROL_ADAPTIVE\n1e-6\n", "a.k:22:1: read *CONTROL_ADAPTIVE; expected a *CONTROL_ of the table"),
        (
            "*CONTROL_SOLUTION\n1\n",
            "a.k:23:1: read 1 (field 1, card 1 of *CONTROL_SOLUTION); expected SOLN 0, mechanics alone",
        ),
        ("*CONTROL_REMESHING\n1\n", "a.k:22:1: read *CONTROL_REMESHING; expected a *CONTROL_ of the table"),
        (
            "*DEFINE_ELEMENT_DEATH_SOLID\n1,1e-7\n",
            "a.k:22:1: read *DEFINE_ELEMENT_DEATH_SOLID; expected a *DEFINE_",
        ),
    ] {
        let found = faults(&cube(more));
        assert!(found[0].starts_with(expected), "{found:?}");
    }
    let harmless = good(&cube("*CONTROL_SOLUTION\n0\n*CONTROL_OUTPUT\n1\n*CONTROL_MPP_IO_NOD3DUMP\n"));
    assert!(
        warned(&harmless, "*CONTROL_MPP_IO_NOD3DUMP (line 26), *CONTROL_OUTPUT (line 24)"),
        "{:?}",
        harmless.warnings
    );
    let sheet = |istupd: u32| {
        let shells = "*SECTION_SHELL\n1,2\n0.5\n";
        let more = format!("*CONTROL_SHELL\n20.0,2,-1,{istupd}\n");
        good(&cube_of("*KEYWORD", shells, "*ELEMENT_SHELL\n1,1,1,2,3,4\n", &more))
    };
    let thins = |reading: &Reading| reading.model.mesh.parts[0].section().map(|section| section.thins);
    for (istupd, expected) in [(0, false), (1, true), (2, false), (3, true), (4, true)] {
        assert_eq!(thins(&sheet(istupd)), Some(expected), "ISTUPD {istupd}");
        assert_eq!(warned(&sheet(istupd), "ISTUPD"), istupd == 4);
    }
    // Theirs is 0 where no card says anything.
    let silent =
        good(&cube_of("*KEYWORD", "*SECTION_SHELL\n1,2\n0.5\n", "*ELEMENT_SHELL\n1,1,1,2,3,4\n", ""));
    assert_eq!(thins(&silent), Some(false));
}

#[test]
fn control_units_name_the_units_and_ballast_of_rigid_bodies_does_not() {
    let named = good(&cube("*CONTROL_UNITS\nm,sec,kg\n"));
    assert_eq!(named.model.units, "SI");
    assert!(
        warned(&named, "are those of no solid or liquid in SI; check *CONTROL_UNITS"),
        "{:?}",
        named.warnings
    );
    let strange = good(&cube("*CONTROL_UNITS\nfurlong,s,kg\n"));
    assert_eq!(strange.model.units, "mm-s-t");
    assert!(warned(&strange, "*CONTROL_UNITS of furlong, s, kg"), "{:?}", strange.warnings);
    // A rigid part of a thousand times the density of steel.
    let ballast = "*PART\nram\n2,1,2\n*MAT_RIGID\n2,7.85e-6,2.1e5,0.3\n*NODE\n9,0,0,5\n10,1,0,5\n11,1,1,5\n12,0,1,5\n\
        13,0,0,6\n14,1,0,6\n15,1,1,6\n16,0,1,6\n*ELEMENT_SOLID\n2,2,9,10,11,12,13,14,15,16\n";
    let reading = good(&cube(ballast));
    assert_eq!((reading.model.units.as_str(), reading.warnings), ("mm-s-t", vec![]));
}

#[test]
fn what_is_missing_is_told_once_and_as_what_it_is() {
    let curve = "*DEFINE_TABLE\n100\n0.1,101\n*LOAD_BODY_Z\n100\n";
    assert!(
        faults(&cube(curve))[0]
            .contains("read curve 100, which the *DEFINE_TABLE at line 23 makes (card 1 of *LOAD_BODY_Z); expected a *DEFINE_CURVE"),
        "{:?}",
        faults(&cube(curve))
    );
    // A part with the section 0, whose shells have no thickness therefore; and a part that nobody defined.
    let shells = "*ELEMENT_SHELL\n1,1,1,2,3,4\n2,1,5,6,7,8\n3,9,1,2,6,5\n4,9,4,3,7,8\n";
    let text =
        cube_of("*KEYWORD", "*SECTION_SHELL\n1,2\n0.5\n", shells, "").replace("\n1,1,1\n", "\n1,0,1\n");
    assert_eq!(
        faults(&text),
        [
            "a.k:6:3: read SECID = 0 (card 2 of *PART); expected a section of the deck; add it",
            "a.k:24:1: read shell 3 of part 9 (card 3 of *ELEMENT_SHELL); expected a part of the deck; add the *PART",
        ]
    );
    // A material that is refused is not missing too, and one that is missing is so once.
    let second = "*PART\nother\n2,1,1\n*ELEMENT_SOLID\n2,2,1,2,3,4,5,6,7,8\n";
    let refused = cube(second).replace("*MAT_ELASTIC", "*MAT_WOOD");
    let found = faults(&refused);
    assert!(found.len() == 1 && found[0].contains("read *MAT_WOOD"), "{found:?}");
    let missing = faults(&cube(second).replace("\n1,7.85e-9", "\n3,7.85e-9"));
    assert_eq!(
        missing,
        ["a.k:6:5: read MID = 1 (card 2 of *PART); expected a material of the deck; add the *MAT"]
    );
}

#[test]
fn the_second_card_of_a_motion_is_none_of_its_own() {
    let curve = "*DEFINE_CURVE\n3\n0,1\n";
    for motion in [
        "*BOUNDARY_PRESCRIBED_MOTION_NODE\n1,-9,0,3\n0.5,0.5\n",
        "*BOUNDARY_PRESCRIBED_MOTION_RIGID\n1,-10,0,3\n0.5,0.5\n",
    ] {
        let found = faults(&cube(&format!("{curve}{motion}")));
        assert!(found.len() == 1 && found[0].starts_with("a.k:26:3: read"), "{found:?}");
    }
}

#[test]
fn the_title_is_that_of_the_deck_itself() {
    let main = cube("*TITLE\nthe deck\n*INCLUDE\nb.k\n");
    let mut open = |path: &str| (path == "b.k").then(|| "*TITLE\nan include\n*END\n".to_string());
    let whole = bundle::gather("a.k", main.clone(), &Options::default(), &mut open).expect("two files");
    assert_eq!(good(&whole).model.title, "the deck");
    let untitled = main.replace("*TITLE\nthe deck\n", "");
    let whole = bundle::gather("a.k", untitled, &Options::default(), &mut open).expect("two files");
    assert_eq!(good(&whole).model.title, "an include");
}

#[test]
fn an_acceleration_by_a_curve_without_points_is_a_fault() {
    let found = faults(&cube("*DEFINE_CURVE\n3\n*BOUNDARY_PRESCRIBED_MOTION_NODE\n1,1,1,3\n"));
    assert_eq!(
        found,
        [
            "a.k:23:1: read 3 (field 1, card 1 of *DEFINE_CURVE); expected a curve with points; give it at least one"
        ]
    );
}

#[test]
fn constants_that_no_law_takes_are_told_at_their_field() {
    let gas = |material: &str, eos: &str| {
        let text = cube(eos)
            .replace("\n1,1,1\n", "\n1,1,1,1\n")
            .replace("*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n", material);
        faults(&text)
    };
    let tile = |second: &str, fs: &str| {
        format!(
            "*MAT_JOHNSON_HOLMQUIST_CERAMICS\n1,2.51e-9,1.97e5,0.927,0.7,0.005,0.85,0.67\n{second}\n0.001,0.5,2.33e5,,,{fs}\n"
        )
    };
    let with = |material: String| faults(&cube("").replace("*MAT_ELASTIC\n1,7.85e-9,2.1e5,0.3\n", &material));
    let upside_down = with(tile("1.,260.,0.2,8710.,19000.,1.", ""));
    assert!(upside_down.len() == 1 && upside_down[0].contains("a HEL above PHEL"), "{upside_down:?}");
    let by_pressure = with(tile("1.,260.,0.2,19000.,8710.,1.", "-1."));
    assert!(
        by_pressure.len() == 1 && by_pressure[0].contains("no failure by the pressure"),
        "{by_pressure:?}"
    );
    let gruneisen = "*EOS_GRUNEISEN\n1,3.9e6,1.49,,,2.0\n";
    let doubled = gas(&tile("1.,260.,0.2,19000.,8710.,1.", ""), gruneisen);
    assert!(doubled.len() == 1 && doubled[0].contains("K1, K2 and K3"), "{doubled:?}");
    let null = "*MAT_NULL\n1,7.85e-9,-1.0\n";
    let ideal = "*EOS_LINEAR_POLYNOMIAL\n1,0,0,0,0,0.4,0.4\n0.25\n";
    assert_eq!(
        gas(null, ideal),
        [
            "a.k:8:11: read PC = -1.0 (card 1 of *MAT_NULL); expected no cut-off of the pressure in a gas; leave PC blank"
        ]
    );
    let shock = gas("*MAT_NULL\n1,7.85e-9\n", "*EOS_GRUNEISEN\n1,3.9e6,-1.49,,,2.0\n");
    assert_eq!(
        shock,
        [
            "a.k:23:9: read -1.49 (field 3, card 1 of *EOS_GRUNEISEN); expected a number of 0 or more; correct it"
        ]
    );
}

#[test]
fn faults_of_a_mesh_file_do_not_hide_those_of_its_deck() {
    let text = "title = \"x\"\nunits = \"SI\"\n[control]\nend_cycle = 0\n[[part]]\nname = \"a\"\nmaterial = \"LEAD\"\nmesh = { file = \"a.mesh\" }\n";
    let mut open = |path: &str| (path == "a.mesh").then(|| "no mesh\n".to_string());
    let whole =
        bundle::gather("a.toml", text.to_string(), &Options::default(), &mut open).expect("two files");
    let found = faults(&whole);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found[0].starts_with("a.mesh:1:1: read no mesh; expected bolide mesh 1"), "{found:?}");
    assert!(found[1].starts_with("a.toml:4:13: read end_cycle = 0"), "{found:?}");
}

#[test]
fn global_damping_is_a_rate_or_says_what_it_cannot_be() {
    let deck = |card: &str| cube(&format!("*DAMPING_GLOBAL\n{card}\n"));
    let rate = |card: &str| good(&deck(card)).model.setup.loads.relaxation.map(|r| [r.factor, r.rate]);
    assert_eq!(rate("0,50"), Some([1.0, 50.0]));
    assert_eq!(rate(",20,0.5,0.5,0.5,0.5,0.5,0.5"), Some([1.0, 10.0]));
    assert_eq!(rate("0,0"), None);
    let written = deck::convert(&deck("0,50"), "a.k", "a.mesh").expect("it was read").deck;
    assert!(written.contains("[relaxation]\nrate = 50.0\n"), "{written}");
    for (card, words) in
        [("3,50", "read 3 (field 1"), ("0,50,1,0", "read 0 (field 4"), ("0,-1", "a rate of 0 or more")]
    {
        let found = faults(&deck(card));
        assert!(found.len() == 1 && found[0].contains(words), "{found:?}");
    }
}

/// What refers to a parameter that has no value is no fault of its own.
#[test]
fn a_parameter_without_a_value_is_one_fault_whatever_refers_to_it() {
    let text = "*KEYWORD\n*PARAMETER_EXPRESSION\nRtwice,2*missing\nRtend,twice+1\n*CONTROL_TERMINATION\n&tend\n*PART\ncube\n1,1,1\n\
        *SECTION_SOLID\n1,1\n*MAT_ELASTIC\n1,7.85E-9,&tend,0.3\n*DEFINE_CURVE\n5\n0,1\n&tend,2\n*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n\
        5,0,0,&twice\n6,1,0,1\n7,1,1,1\n8,0,1,1\n*ELEMENT_SOLID\n1,1,1,2,3,4,5,6,7,8\n*END\n";
    let faults = deck::read(text, "a.k").expect_err("a fault");
    let told: Vec<String> = faults.iter().map(ToString::to_string).collect();
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(told[0].contains("there is no parameter missing before it"), "{told:?}");
}
