//! Decks under tests/decks: a bad one gives exactly the faults that its first comment lines expect, a good
//! one gives none.

use std::{fs, path::PathBuf};

/// Names and texts of the decks in a folder, by name.
fn decks(folder: &str) -> Vec<(String, String)> {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "..", "tests", "decks", folder].iter().collect();
    let mut decks = Vec::new();
    for entry in fs::read_dir(&path).expect("the folder is in the repository") {
        let path = entry.expect("the folder can be listed").path();
        if path.extension().is_some_and(|e| e == "toml") {
            let name = path.file_name().expect("a file").to_string_lossy().into_owned();
            decks.push((name, fs::read_to_string(&path).expect("a deck is text")));
        }
    }
    decks.sort();
    decks
}

#[test]
fn every_bad_deck_gives_exactly_its_faults() {
    let decks = decks("bad");
    assert!(decks.len() >= 20, "only {} bad decks", decks.len());
    let mut wrong = String::new();
    for (name, text) in decks {
        let expected: Vec<String> = text
            .lines()
            .map_while(|line| line.strip_prefix("# expect: "))
            .map(|fault| format!("{name}:{fault}"))
            .collect();
        assert!(!expected.is_empty(), "{name} expects nothing");
        let found: Vec<String> = match deck::read(&text, &name) {
            Ok(_) => Vec::new(),
            Err(faults) => faults.iter().map(ToString::to_string).collect(),
        };
        if found != expected {
            wrong += &format!("{name} gave\n  {}\n", found.join("\n  "));
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn every_good_deck_is_read() {
    let decks = decks("good");
    assert!(decks.len() >= 5, "only {} good decks", decks.len());
    for (name, text) in decks {
        let model = deck::read(&text, &name).unwrap_or_else(|faults| {
            let lines: Vec<String> = faults.iter().map(ToString::to_string).collect();
            panic!("{}", lines.join("\n"))
        });
        assert!(model.mesh.n_elements() > 0);
        assert_eq!(model.velocity.len(), model.mesh.n_nodes());
        assert_eq!(model.constraint.len(), model.mesh.n_nodes());
        assert_eq!(model.mesh.node_ids.len(), model.mesh.n_nodes());
    }
}
