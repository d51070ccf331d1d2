//! Short texts that ask for much.

use std::{cell::Cell, fmt::Write};

use deck::bundle::{Opened, Options, gather_from};

/// A keyword deck whose files each include the next one many times.
fn nested() -> String {
    let mut text = String::from("#bolide-bundle 1\n");
    for depth in 0..15 {
        let body = format!("*KEYWORD\n*INCLUDE\n{}*END\n", format!("f{}.k\n", depth + 1).repeat(100));
        let _ = write!(text, "file {} f{depth}.k\n{body}", body.len());
    }
    let leaf = "*KEYWORD\n*COMMENT\nx\n*END\n";
    let _ = write!(text, "file {} f15.k\n{leaf}", leaf.len());
    text
}

#[test]
fn includes_of_includes_have_a_budget() {
    let text = nested();
    assert!(text.len() < 34_000, "{} bytes", text.len());
    let faults = deck::read(&text, "f0.k").expect_err("too many");
    let words: Vec<String> = faults.iter().map(ToString::to_string).collect();
    assert!(words.iter().any(|fault| fault.contains("at most 10000 includes")), "{words:?}");
    assert!(faults.len() < 10, "one fault says it: {words:?}");
}

#[test]
fn a_deck_may_ask_for_no_more_elements_than_its_reader_has_memory_for() {
    let text = "title = \"large\"\nunits = \"SI\"\n[control]\nend_time = 1.0\n[[part]]\nname = \"cube\"\nmaterial = \"LEAD\"\nbox = { origin = [0, 0, 0], size = [1, 1, 1], cells = [100, 100, 100] }\n";
    let within =
        |elements| deck::read_within(text, "large.toml", &deck::Bounds { elements, is_given_up: &|| false });
    let faults = within(999_999).expect_err("a million");
    let words = faults.first().map(ToString::to_string).unwrap_or_default();
    assert!(words.contains("1000000 elements") && words.contains("999999 elements"), "{words}");
    assert!(words.contains("a master with more memory"), "{words}");
    assert_eq!(within(1_000_000).map(|model| model.mesh.n_elements()).ok(), Some(1_000_000));
}

/// Two blocks in contact, of TOML or of cards in two files.
fn two_blocks() -> [String; 2] {
    let block = |name: &str, z: f64| {
        format!(
            "[[part]]\nname = \"{name}\"\nmaterial = \"LEAD\"\nbox = {{ origin = [0, 0, {z}], size = [1, 1, 1], cells = [8, 8, 8] }}\n"
        )
    };
    let (low, high) = (block("low", 0.0), block("high", 1.1));
    let toml = format!(
        "title = \"two\"\nunits = \"SI\"\n[control]\nend_time = 1.0\n{low}{high}[contact]\ngap_fraction = 0.1\n"
    );
    let main = "*KEYWORD\n*CONTROL_TERMINATION\n1.0\n*MAT_ELASTIC\n1,7.8e-9,2.1e5,0.3\n*SECTION_SOLID\n1,1\n*PART\ncube\n1,1,1\n*INCLUDE\nmesh.k\n*END\n";
    let mesh = "*KEYWORD\n*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n*ELEMENT_SOLID\n1,1,1,2,3,4,5,6,7,8\n*END\n";
    let cards = format!(
        "#bolide-bundle 1\nunits mm-s-t\nfile {} main.k\n{main}\nfile {} mesh.k\n{mesh}\n",
        main.len(),
        mesh.len()
    );
    [toml, cards]
}

#[test]
fn a_deck_that_is_given_up_is_read_no_further_at_whatever_stage_that_is() {
    for text in two_blocks() {
        // Given up when it is asked for the nth time.
        let read = |n: u32| {
            let asked = Cell::new(0);
            let is_given_up = || {
                asked.set(asked.get() + 1);
                asked.get() > n
            };
            let bounds = deck::Bounds { elements: deck::MAX_ELEMENTS, is_given_up: &is_given_up };
            (deck::read_within(&text, "deck", &bounds), asked.get())
        };
        let (whole, asked) = read(u32::MAX);
        assert!(whole.is_ok(), "{whole:?}");
        assert!(asked >= 8, "asked {asked} times only");
        for n in 0..asked {
            let (given_up, times) = read(n);
            let faults = given_up.expect_err("it was given up");
            assert!(faults.len() == 1 && faults[0].read == "a deck that is given up", "{n}: {faults:?}");
            assert!(times <= n + 4, "given up at {n}, and asked {times} times");
        }
    }
}

#[test]
fn files_outside_the_folder_of_a_deck_are_not_quoted() {
    let secret = "*NODE\nhunter2,hunter2\nhunter2\n*hunter2\nhunter2\n";
    let deck = "*KEYWORD\n*INCLUDE\n../secret\n*INCLUDE\nbeside.k\n*END\n";
    let toml = "title = \"x\"\nunits = \"SI\"\n[control]\nend_time = 1.0\n[[part]]\nname = \"a\"\nmaterial = \"LEAD\"\nmesh = { file = \"../secret\", body = \"hunter3\" }\n";
    for (name, deck) in [("lab/main.k", deck), ("lab/deck.toml", toml)] {
        let mut open = |path: &str| match path {
            "lab/../secret" => Some(Opened { text: secret.to_owned(), is_outside: true }),
            "lab/beside.k" => Some(Opened { text: "*NODE\nlocal1,x\n".to_owned(), is_outside: false }),
            _ => None,
        };
        let text = gather_from(name, deck.to_owned(), &Options::default(), &mut open).expect("few files");
        let faults = deck::read(&text, name).expect_err("it is no deck");
        let lines: Vec<String> = faults.iter().map(ToString::to_string).collect();
        let lines = lines.join("\n").to_lowercase();
        assert!(!lines.contains("hunter2"), "{lines}");
        assert!(lines.contains("lab/../secret:"), "{lines}");
        assert!(lines.contains("not shown, for its file stands outside the deck's folder"), "{lines}");
        assert!(!name.ends_with(".k") || lines.contains("local1"), "its own files are quoted: {lines}");
    }
}
