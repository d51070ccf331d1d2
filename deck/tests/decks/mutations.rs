//! Whatever is done to a deck, reading it ends with a model or with faults, never with a panic.

use std::fs;

use crate::damage::{Stream, is_read};

/// Values put in the place of a number. None makes a mesh that is large but allowed.
const VALUES: [&str; 16] = [
    "0",
    "-1",
    "1",
    "3",
    "0.5",
    "1e308",
    "-1e308",
    "1e-308",
    "5e-324",
    "nan",
    "-inf",
    "4294967296",
    "99999999999999999999999",
    "\"text\"",
    "[]",
    "true",
];

const SIGNS: &[u8] = b" \"'[]{}=.,-#\n\tabcxyz_e\xc3";

/// A deck with a few changes: numbers, signs, lines, words.
fn mutated(text: &str, stream: &mut Stream) -> String {
    let mut text = text.to_string();
    for _ in 0..1 + stream.below(3) {
        let lines: Vec<&str> = text.lines().collect();
        text = match stream.below(5) {
            0 => {
                let at: Vec<usize> = text
                    .char_indices()
                    .zip(text.chars().skip(1))
                    .filter(|((_, before), c)| !before.is_ascii_alphanumeric() && c.is_ascii_digit())
                    .map(|((i, before), _)| i + before.len_utf8())
                    .collect();
                if at.is_empty() {
                    continue;
                }
                let start = at[stream.below(at.len())];
                let number = |c: char| c.is_ascii_alphanumeric() || c == '.';
                let end = text[start..].find(|c| !number(c)).map_or(text.len(), |n| start + n);
                format!("{}{}{}", &text[..start], VALUES[stream.below(VALUES.len())], &text[end..])
            }
            1 => {
                let mut bytes = text.clone().into_bytes();
                let at = stream.below(bytes.len());
                bytes[at] = SIGNS[stream.below(SIGNS.len())];
                String::from_utf8_lossy(&bytes).into_owned()
            }
            2 => {
                let drop = stream.below(lines.len());
                let kept = lines.iter().enumerate().filter(|(n, _)| *n != drop).map(|(_, l)| *l);
                kept.collect::<Vec<_>>().join("\n")
            }
            3 => {
                let mut twice = lines.clone();
                twice.insert(stream.below(lines.len()), lines[stream.below(lines.len())]);
                twice.join("\n")
            }
            _ => {
                let mut swapped = lines.clone();
                swapped.swap(stream.below(lines.len()), stream.below(lines.len()));
                swapped.join("\n")
            }
        };
        if text.is_empty() {
            break;
        }
    }
    text
}

#[test]
fn mutated_decks_never_panic_and_faults_always_have_a_place() {
    let folder = format!("{}/../tests/decks/good", env!("CARGO_MANIFEST_DIR"));
    let mut paths: Vec<_> = fs::read_dir(folder)
        .expect("the folder is in the repository")
        .map(|entry| entry.expect("the folder can be listed").path())
        .collect();
    paths.push(format!("{}/examples/self-contact.toml", env!("CARGO_MANIFEST_DIR")).into());
    paths.sort();
    let (mut read, mut refused) = (0, 0);
    for path in paths {
        let text = fs::read_to_string(&path).expect("a deck is text");
        for seed in 1..=600 {
            let deck = mutated(&text, &mut Stream(seed));
            *(if is_read(&deck, "deck.toml", seed) { &mut read } else { &mut refused }) += 1;
        }
    }
    assert!(read > 100 && refused > 100, "the changes test nothing: {read} read, {refused} refused");
}

#[test]
fn deep_nesting_and_long_text_are_refused() {
    let deep = format!("title = {}{}", "[".repeat(100_000), "]".repeat(100_000));
    let faults = deck::read(&deep, "deep.toml").expect_err("no deck is nested that deep");
    assert!(faults[0].read.contains("max recursion depth"), "{}", faults[0]);
    let long = " ".repeat(deck::MAX_TEXT + 1);
    let faults = deck::read(&long, "long.toml").expect_err("longer than the limit");
    assert_eq!(faults.len(), 1);
    assert!(faults[0].read.contains("67108865 bytes"), "{}", faults[0]);
}

#[test]
fn a_thousand_faults_are_cut_to_the_limit_and_counted() {
    let deck = "a = 1\n".to_string() + &(0..1000).map(|i| format!("b{i} = 1\n")).collect::<String>();
    let faults = deck::read(&deck, "many.toml").expect_err("nothing of a deck is in it");
    assert_eq!(faults.len(), deck::MAX_FAULTS + 1);
    // 1001 unknown keys, and title, units, control and part missing.
    assert_eq!(faults[deck::MAX_FAULTS].read, "505 more faults");
}
