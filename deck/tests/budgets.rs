//! Short texts that ask for much.

use std::fmt::Write;

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
    let faults = deck::read_at_most(text, "large.toml", 999_999).expect_err("a million");
    let words = faults.first().map(ToString::to_string).unwrap_or_default();
    assert!(words.contains("1000000 elements") && words.contains("999999 elements"), "{words}");
    assert!(words.contains("a master with more memory"), "{words}");
    assert_eq!(
        deck::read_at_most(text, "large.toml", 1_000_000).map(|m| m.mesh.n_elements()).ok(),
        Some(1_000_000)
    );
}
